"""A sweep's specification: a TOML file, read once and checked."""

import math
import re
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from motorcade.experiments.parameters import Parameter, SweepError, parameter_named
from motorcade.experiments.points import Grid, Range, Sample

FORMAT = "motorcade-sweep/1"
EMPTY_TABLE = "empty"
MOST_RUNS = 10_000_000
MOST_SECONDS = 86_400
MOST_SEED = (1 << 32) - 1
_KEYS = ("format", "programs", "mats", "profile", "seconds", "seeds", "grid", "sample")


@dataclass(frozen=True, slots=True)
class Sweep:
    """What a specification asks for.

    Attributes:
        programs: projects and images, as the file names them, relative to it.
        mats: mats likewise; EMPTY_TABLE is a plane without end.
        profile: that of the cars of an image; a project names its own.
        duration_ms: simulated time of each run.
        seeds: each parameter point runs once with each.
        points: the parameter points.
    """

    programs: tuple[str, ...]
    mats: tuple[str, ...]
    profile: str
    duration_ms: int
    seeds: Sequence[int]
    points: Grid | Sample

    @property
    def runs(self) -> int:
        """How many runs it asks for."""
        return self.cells * len(self.seeds)

    @property
    def cells(self) -> int:
        """How many parameter points it asks for, each program and mat counted."""
        return len(self.programs) * len(self.mats) * self.points.count


def read_sweep(path: Path) -> Sweep:
    """The specification in a file. Raises SweepError, OSError."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise SweepError(f"{path.name} is no text: a sweep is a TOML file in UTF-8") from None
    return parse_sweep(text, path.name)


def parse_sweep(text: str, name: str) -> Sweep:
    """The specification in TOML ``text`` of a file called ``name``. Raises SweepError that names the place."""
    try:
        return _sweep(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        bracketed = re.search(r"^[\w.]+\[\d", text, re.MULTILINE)
        hint = '. A name with brackets stands in quotes, such as "profile.speeds_mm_s[2]"' if bracketed else ""
        raise SweepError(f"{name} is not TOML: {error}{hint}") from None
    except SweepError as problem:
        raise SweepError(f"{name}: {problem}") from None


def _sweep(table: dict[str, Any]) -> Sweep:
    if table.get("format") != FORMAT:
        raise SweepError(f'format is {table.get("format")!r}; a sweep begins with format = "{FORMAT}"')
    _check_keys(table, _KEYS, "")
    for key in ("programs", "seconds"):
        if key not in table:
            raise SweepError(f"'{key}' is missing")
    profile = table.get("profile", "classroom")
    if not isinstance(profile, str):
        raise SweepError(f"profile is {profile!r}; allowed: a built-in profile's name, or a .toml file's")
    sweep = Sweep(
        programs=_names(table["programs"], "programs"),
        mats=_names(table.get("mats", [EMPTY_TABLE]), "mats"),
        profile=profile,
        duration_ms=_duration_ms(table["seconds"]),
        seeds=_seeds(table.get("seeds", 1)),
        points=_points(table),
    )
    _check_cars(sweep)
    if sweep.runs > MOST_RUNS:
        raise SweepError(
            f"these are {sweep.runs:,} runs ({len(sweep.programs)} programs × {len(sweep.mats)} mats × "
            f"{sweep.points.count:,} parameter points × {len(sweep.seeds):,} seeds); at most {MOST_RUNS:,}: "
            "shorten a list, or draw with [sample]"
        )
    return sweep


def _check_keys(table: dict[str, Any], known: Sequence[str], place: str) -> None:
    if unknown := [key for key in table if key not in known]:
        raise SweepError(f"{place}'{unknown[0][:60]}' is not known; known are {', '.join(known)}")


def _names(value: object, place: str) -> tuple[str, ...]:
    if not isinstance(value, list) or not value:
        raise SweepError(f"{place} is {value!r}; allowed: a list of file names")
    for index, each in enumerate(value):
        if not isinstance(each, str) or not each:
            raise SweepError(f"{place}[{index}] is {each!r}; allowed: a file's name")
        if each in value[:index]:
            raise SweepError(f"{place}[{index}] is '{each}', which stands there already: name each once")
    return tuple(value)


def _duration_ms(value: object) -> int:
    if isinstance(value, int | float) and not isinstance(value, bool) and 0 < value <= MOST_SECONDS:
        duration_ms = round(value * 1000)
        if duration_ms and math.isclose(duration_ms / 1000, value):
            return duration_ms
    raise SweepError(f"seconds is {value!r}; allowed: whole milliseconds from 0.001 to {MOST_SECONDS}")


def _whole(value: object, place: str, lowest: int = 0, highest: int = MOST_SEED) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not lowest <= value <= highest:
        raise SweepError(f"{place} is {value!r}; allowed: whole numbers from {lowest} to {highest}")
    return value


def _seeds(value: object) -> Sequence[int]:
    if isinstance(value, list):
        if not value:
            raise SweepError("seeds is an empty list: name at least one")
        seeds = [_whole(each, f"seeds[{index}]") for index, each in enumerate(value)]
        if len(set(seeds)) < len(seeds):
            twice = next(index for index, seed in enumerate(seeds) if seed in seeds[:index])
            raise SweepError(f"seeds[{twice}] is {seeds[twice]}, which stands there already: the run would be the same")
        return tuple(seeds)
    first = 0
    if isinstance(value, dict):
        _check_keys(value, ("first", "count"), "seeds: ")
        first = _whole(value.get("first", 0), "seeds.first")
        value = value.get("count")
        return range(first, first + _whole(value, "seeds.count", 1, MOST_SEED + 1 - first))
    if isinstance(value, int):
        return range(_whole(value, "seeds", 1))
    raise SweepError(f"seeds is {value!r}; allowed: how many, {{first = 0, count = 100}}, or a list of them")


def _points(table: dict[str, Any]) -> Grid | Sample:
    if "grid" in table and "sample" in table:
        raise SweepError("[grid] and [sample] exclude each other: keep one")
    for key in ("grid", "sample"):
        if not isinstance(table.get(key, {}), dict):
            raise SweepError(f"{key} is {table[key]!r}; it is a table of its own: [{key}]")
    if "sample" in table:
        return _sample(dict(table["sample"]))
    lists = {}
    for parameter, values in _parameters(table.get("grid", {}), "grid"):
        place = f"grid.{parameter.name}"
        if not isinstance(values, list) or not values:
            raise SweepError(f"{place} is {values!r}; allowed: a list of values")
        read = tuple(parameter.read(each, f"{place}[{index}]") for index, each in enumerate(values))
        for index, each in enumerate(read):
            if each in read[:index]:
                raise SweepError(f"{place}[{index}] is {values[index]!r}, which stands there already: name each once")
        lists[parameter] = read
    return Grid(lists)


def _parameters(table: dict[str, Any], place: str) -> Iterator[tuple[Parameter, Any]]:
    """Each parameter with what stands behind it, whether its name is written with quotes or as nested keys."""
    seen: set[str] = set()
    for name, value in _flat(table):
        parameter = parameter_named(name, place)
        if name in seen:
            raise SweepError(f"{place}.{name} stands there twice: keep one")
        seen.add(name)
        yield parameter, value


def _flat(table: dict[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        name = f"{before}{key}"
        if isinstance(value, dict) and not {"from", "to"} & set(value) and value:
            yield from _flat(value, f"{name}.")
        else:
            yield name, value


def _sample(table: dict[str, Any]) -> Sample:
    if "count" not in table:
        raise SweepError("sample.count is missing: how many points to draw")
    count = _whole(table.pop("count"), "sample.count", 1)
    seed = _whole(table.pop("seed", 0), "sample.seed")
    ranges = {
        parameter: _range(parameter, limits, f"sample.{parameter.name}")
        for parameter, limits in _parameters(table, "sample")
    }
    if not ranges:
        raise SweepError("[sample] names no parameter to draw, such as cars = {from = 1, to = 50}")
    return Sample(ranges, count, seed)


def _range(parameter: Parameter, limits: object, place: str) -> Range:
    if parameter.kind is bool:
        raise SweepError(f"{place} is true or false and has no range: use [grid]")
    if not isinstance(limits, dict) or not {"from", "to"} <= set(limits):
        raise SweepError(f"{place} is {limits!r}; allowed: a range such as {{from = 1, to = 50}}")
    _check_keys(limits, ("from", "to", "log"), f"{place}: ")
    lowest, highest = (parameter.read(limits[key], f"{place}.{key}") for key in ("from", "to"))
    if lowest is None or highest is None:
        raise SweepError(f"{place} has 'never', which is no end of a range: use [grid]")
    if lowest >= highest:
        raise SweepError(f"{place}: from is {lowest!r} and to is {highest!r}; from must be below to")
    logarithmic = limits.get("log", False)
    if not isinstance(logarithmic, bool):
        raise SweepError(f"{place}.log is {logarithmic!r}; allowed: true or false")
    if logarithmic and lowest <= 0:
        raise SweepError(f"{place}.from is {lowest!r}; with log it must be above 0")
    return Range(lowest, highest, logarithmic)


def _check_cars(sweep: Sweep) -> None:
    """A mat brings its own cars, so their number can vary on the empty table alone."""
    varied = [parameter.name for parameter in sweep.points.parameters]
    for index, name in enumerate(sweep.mats):
        if "cars" in varied and name != EMPTY_TABLE:
            raise SweepError(
                f"cars varies, but mats[{index}], '{name}', brings its own cars: "
                f'leave one of them out, or use mats = ["{EMPTY_TABLE}"]'
            )
