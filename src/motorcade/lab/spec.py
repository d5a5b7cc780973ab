"""A sweep's specification, a TOML file; the parameters that it can vary, and the points of its parameter space.

Parameters are the number of cars, the tick, a mat's physics and every number of a profile.
"""

import difflib
import hashlib
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from motorcade.config.check import (
    Schema,
    Text,
    allowed,
    allowed_as,
    choice,
    flag,
    line,
    list_of,
    load,
    number,
    shown,
    table,
    whole,
)
from motorcade.config.files import parse, read_text
from motorcade.config.profile import Profile, profile_from_dict, profile_schema
from motorcade.errors import InputError, MotorcadeError, Phrase
from motorcade.mats import Mat
from motorcade.mats.schema import mat_schema

FORMAT = "motorcade-sweep/1"
EMPTY_TABLE = "empty"
MOST_RUNS = 10_000_000
MOST_SECONDS = 86_400
MOST_SEED = (1 << 32) - 1
_LONGEST_NAME = 1000

Value = bool | int | float | None
NEVER = "never"
MOST_FOLLOWERS = 1_000_000
_MOST_IN_PROFILE = (1 << 20) - 1
_TYPES: dict[str, type[bool] | type[int]] = {"boolean": bool, "integer": int}
_PHYSICS = "physics."
_PROFILE = "profile."


@cache
def parameter_schemas() -> dict[str, Schema]:
    """The schema of the values of each parameter, by its name."""
    keys = mat_schema()["properties"]
    schemas = {"cars": whole(0, MOST_FOLLOWERS), "tick_ms": keys["tick_ms"]}
    for name, part in keys["physics"]["properties"].items():
        schemas[_PHYSICS + name] = part if "default" in part else _or_never(part)
    for name in _numbers(profile_schema()):
        schemas[_PROFILE + name] = whole(0, _MOST_IN_PROFILE)
    return schemas


def kind_of(name: str) -> type[bool] | type[int] | type[float]:
    """The Python type of a parameter's values."""
    return _TYPES.get(str(parameter_schemas()[name]["type"]), float)


def to_value(name: str, value: Any) -> Value:
    """Convert a value that fits a parameter's schema."""
    if value == NEVER:
        return None
    return kind_of(name)(value)


def _or_never(part: Schema) -> Schema:
    values = {**part, "type": ["number", "string"], "pattern": f"^{NEVER}$"}
    return allowed_as("either", values, first=allowed(part), second=f'"{NEVER}"')


def _numbers(schema: Schema, before: str = "") -> Iterator[str]:
    """The name of every number of a profile, such as ``infrared.range_mm`` or ``speeds_mm_s[2]``."""
    for name, part in schema["properties"].items():
        if part["type"] == "object":
            yield from _numbers(part, f"{before}{name}.")
        elif part["type"] == "array":
            # A list of names has any length.
            yield from (f"{before}{name}[{index}]" for index in range(part.get("maxItems", 0)))
        else:
            yield before + name


def mat_with(mat: Mat, values: Mapping[str, Value]) -> Mat:
    """Change ``tick_ms`` and the physics of ``mat`` as ``values`` say."""
    physics: dict[str, Any] = {
        name.removeprefix(_PHYSICS): value for name, value in values.items() if name.startswith(_PHYSICS)
    }
    tick_ms: Any = values.get("tick_ms", mat.tick_ms)
    return replace(mat, tick_ms=tick_ms, physics=replace(mat.physics, **physics))


def profile_with(profile: Profile, values: Mapping[str, Value]) -> Profile:
    """Change ``profile`` as ``values`` say. Raises MotorcadeError where the values don't fit each other."""
    changed = tuple((name.removeprefix(_PROFILE), value) for name, value in values.items() if name.startswith(_PROFILE))
    if changed:
        return _changed(profile, changed)
    return profile


@lru_cache(maxsize=4096)
def _changed(profile: Profile, changed: tuple[tuple[str, Value], ...]) -> Profile:
    document = asdict(profile)
    del document["name"]
    for name, value in changed:
        *tables, key = name.split(".")
        table = document
        for name_of_table in tables:
            table = table[name_of_table]
        key, _, index = key.removesuffix("]").partition("[")
        if index:
            levels = list(table[key])
            levels[int(index)] = value
            table[key] = levels
        else:
            table[key] = value
    return profile_from_dict(document, profile.name)


@dataclass(frozen=True, slots=True)
class Grid:
    """Every combination of the values; the last parameter varies fastest. Without parameters: one point."""

    lists: Mapping[str, tuple[Value, ...]]

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names of the parameters that vary."""
        return tuple(self.lists)

    @property
    def count(self) -> int:
        """The number of points."""
        return math.prod(len(values) for values in self.lists.values())

    def at(self, index: int) -> dict[str, Value]:
        """The values of point ``index``, 0 to ``count`` - 1."""
        chosen: dict[str, Value] = {}
        for name, values in reversed(list(self.lists.items())):
            index, position = divmod(index, len(values))
            chosen[name] = values[position]
        return {name: chosen[name] for name in self.lists}


@dataclass(frozen=True, slots=True)
class Range:
    """The range that a parameter is drawn from, evenly or evenly in its logarithm. Integers include ``highest``."""

    lowest: float
    highest: float
    logarithmic: bool


@dataclass(frozen=True, slots=True)
class Sample:
    """Independent draws. A draw depends only on the seed, the parameter's name and the point's number.

    So a larger count, or one more parameter, changes no other draw.
    """

    ranges: Mapping[str, Range]
    count: int
    seed: int

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names of the parameters that vary."""
        return tuple(self.ranges)

    def at(self, index: int) -> dict[str, Value]:
        """The values of point ``index``, 0 to ``count`` - 1."""
        return {
            name: _drawn(kind_of(name) is int, limits, _share(self.seed, name, index))
            for name, limits in self.ranges.items()
        }


def _share(seed: int, name: str, index: int) -> float:
    """A number from 0 to below 1, from 53 bits of a hash: the same with every version of every library."""
    digest = hashlib.blake2b(f"{seed}/{name}/{index}".encode(), digest_size=8).digest()
    return (int.from_bytes(digest, "big") >> 11) / (1 << 53)


def _drawn(is_whole: bool, limits: Range, share: float) -> Value:
    end = limits.highest
    if is_whole:
        end = limits.highest + 1
    if limits.logarithmic:
        value = limits.lowest * (end / limits.lowest) ** share
    else:
        value = limits.lowest + (end - limits.lowest) * share
    # Rounding could reach the end, which is excluded.
    if is_whole:
        return int(min(value, limits.highest))
    highest: float = min(value, limits.highest)
    return highest


@dataclass(frozen=True, slots=True)
class Sweep:
    """The content of a specification.

    Attributes:
        programs: projects and images, as the file names them, relative to it.
        mats: mats likewise, or projects with one of their own; EMPTY_TABLE is an unbounded plane.
        profile: that of the cars of an image; a project names its own.
        duration_ms: simulated time of each run.
        seeds: each parameter point runs once with each.
        points: the parameter points.
        citation: title, authors, license, abstract and keywords of the experiment, as far as the file has them.
    """

    programs: tuple[str, ...]
    mats: tuple[str, ...]
    profile: str
    duration_ms: int
    seeds: Sequence[int]
    points: Grid | Sample
    citation: Mapping[str, Any] = field(default_factory=dict)

    @property
    def runs(self) -> int:
        """The number of runs."""
        return self.cells * len(self.seeds)

    @property
    def cells(self) -> int:
        """The number of combinations of program, mat and parameter point."""
        return len(self.programs) * len(self.mats) * self.points.count


def read_sweep(path: Path, has_own_mat: Callable[[str], bool] = lambda program: False) -> Sweep:
    """Read the specification in a file, as `parse_sweep`. Raises MotorcadeError."""
    return parse_sweep(read_text(path, path.name), path.name, has_own_mat)


def parse_sweep(text: str, file: str, has_own_mat: Callable[[str], bool] = lambda program: False) -> Sweep:
    """Read the specification in TOML ``text``; errors name ``file`` and the place. Raises MotorcadeError.

    Where it names no mats, the one of its programs that ``has_own_mat`` gives its mat, or else there is an empty table.
    """
    try:
        document = parse(text, "TOML", file)
    except MotorcadeError as problem:
        if re.search(r"^[\w.]+\[\d", text, re.MULTILINE):
            raise InputError("brackets-need-quotes", file=file, reason=problem.details["reason"]) from None
        raise
    for key in ("grid", "sample"):
        if isinstance(document.get(key), dict):
            document[key] = _flattened(document[key], file, key)
    values = load(document, _schema(document), file)
    duration_ms = round(values["seconds"] * 1000)
    if not duration_ms or abs(duration_ms / 1000 - values["seconds"]) > 1e-9 * values["seconds"]:
        allowed = Phrase("sweep-seconds", most=MOST_SECONDS)
        raise InputError("not-allowed", file=file, place="seconds", value=shown(values["seconds"]), allowed=allowed)
    sweep = Sweep(
        programs=tuple(values["programs"]),
        mats=tuple(values.get("mats") or _own_mats(values["programs"], has_own_mat, file)),
        profile=values["profile"],
        duration_ms=duration_ms,
        seeds=_seeds(values["seeds"], file),
        points=_points(values, file),
        citation=values.get("citation", {}),
    )
    _check_cars(sweep, file)
    if sweep.runs > MOST_RUNS:
        counts = {"programs": len(sweep.programs), "mats": len(sweep.mats), "points": sweep.points.count}
        counts |= {"seeds": len(sweep.seeds), "runs": sweep.runs}
        raise InputError("sweep-has-too-many-runs", file=file, **counts, most=MOST_RUNS)
    return sweep


def _own_mats(programs: Sequence[str], has_own_mat: Callable[[str], bool], file: Text) -> list[str]:
    """Return the mats of a sweep that names none. Raises MotorcadeError where several programs may give theirs."""
    owners = [program for program in programs if has_own_mat(program)]
    if owners and len(programs) > 1:
        raise InputError("sweep-mats-unnamed", file=file, program=owners[0], empty=EMPTY_TABLE)
    return owners or [EMPTY_TABLE]


def _schema(document: dict[str, Any]) -> Schema:
    """The schema of a specification whose parameters have flat names; `seeds` may have three forms."""
    names = list_of(line(_LONGEST_NAME), 1, uniqueItems=True)
    seed = whole(0, MOST_SEED)
    seeds: Schema = allowed_as("sweep-seeds", whole(1, MOST_SEED))
    if isinstance(document.get("seeds"), list):
        seeds = list_of(seed, 1, uniqueItems=True)
    elif isinstance(document.get("seeds"), dict):
        seeds = table(first=whole(0, MOST_SEED, default=0), count=whole(1, MOST_SEED + 1))
    grid = {name: list_of(part, 1, uniqueItems=True) for name, part in parameter_schemas().items()}
    ranges = {name: _range(part) for name, part in parameter_schemas().items() if kind_of(name) is not bool}
    text = line(_LONGEST_NAME)
    citation = {
        "title": text,
        "authors": list_of(text, 1),
        "license": text,
        "abstract": text,
        "keywords": list_of(text),
    }
    return table(
        ("mats", "grid", "sample", "citation"),
        format=choice(FORMAT),
        programs=names,
        mats=names,
        profile=line(_LONGEST_NAME, default="classroom"),
        seconds=allowed_as("sweep-seconds", number(0.001, MOST_SECONDS), most=MOST_SECONDS),
        seeds={**seeds, "default": 1},
        citation=table(tuple(citation), **citation),
        grid=table(tuple(grid), **grid),
        sample=table(tuple(ranges), count=whole(1, MOST_SEED), seed=whole(0, MOST_SEED, default=0), **ranges),
    )


def _range(part: Schema) -> Schema:
    limits = {key: {name: value for name, value in part.items() if name != "default"} for key in ("from", "to")}
    return allowed_as("sweep-range", table(**limits, log=flag(default=False)))


def _flattened(parameters: dict[str, Any], file: str, place: str) -> dict[str, Any]:
    """Join nested keys: ``{"physics": {"wheel_noise": ...}}`` becomes ``{"physics.wheel_noise": ...}``."""
    flat: dict[str, Any] = {}
    known = parameter_schemas()
    for name, value in _flat(parameters):
        if name not in known and (place == "grid" or name not in ("count", "seed")):
            near = difflib.get_close_matches(name, known, n=1)
            hint = Phrase("did-you-mean", name=near[0]) if near else Phrase("sweep-parameters")
            raise InputError("no-such-parameter", file=file, place=place, name=name[:60], hint=hint)
        if place == "sample" and name in known and kind_of(name) is bool:
            raise InputError("parameter-without-range", file=file, place=f"{place}.{name}")
        if name in flat:
            raise InputError("parameter-twice", file=file, place=f"{place}.{name}")
        flat[name] = value
    return flat


def _flat(parameters: dict[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in parameters.items():
        name = f"{before}{key}"
        if isinstance(value, dict) and value and not {"from", "to"} & set(value):
            yield from _flat(value, f"{name}.")
        else:
            yield name, value


def _seeds(seeds: Any, file: str) -> Sequence[int]:
    if isinstance(seeds, list):
        return tuple(seeds)
    if isinstance(seeds, int):
        return range(seeds)
    first = seeds["first"]
    count = seeds["count"]
    most = MOST_SEED + 1 - first
    if count > most:
        allowed = Phrase("whole-range", minimum=1, maximum=most)
        raise InputError("not-allowed", file=file, place="seeds.count", value=count, allowed=allowed)
    return range(first, first + count)


def _points(values: dict[str, Any], file: str) -> Grid | Sample:
    if "sample" not in values:
        lists = values.get("grid", {})
        return Grid({name: tuple(to_value(name, given) for given in lists[name]) for name in lists})
    if "grid" in values:
        raise InputError("grid-and-sample", file=file)
    sample = values["sample"]
    count = sample.pop("count")
    seed = sample.pop("seed")
    if not sample:
        raise InputError("sample-without-parameter", file=file)
    return Sample({name: _limits(name, sample[name], file) for name in sample}, count, seed)


def _limits(name: str, limits: dict[str, Any], file: str) -> Range:
    lowest, highest = (to_value(name, limits[key]) for key in ("from", "to"))
    place = f"sample.{name}"
    if lowest is None or highest is None:
        raise InputError("range-to-never", file=file, place=place)
    if lowest >= highest:
        raise InputError("range-not-rising", file=file, place=place, lowest=lowest, highest=highest)
    if limits["log"] and lowest <= 0:
        raise InputError("log-range-from-zero", file=file, place=place, lowest=lowest)
    return Range(lowest, highest, limits["log"])


def _check_cars(sweep: Sweep, file: Text) -> None:
    """Only the empty table can have any number of cars: a mat from a file has its own."""
    named = [index for index, name in enumerate(sweep.mats) if name != EMPTY_TABLE]
    if "cars" in sweep.points.parameters and named:
        place = f"mats[{named[0]}]"
        raise InputError("cars-vary-on-mat", file=file, place=place, name=sweep.mats[named[0]], empty=EMPTY_TABLE)
