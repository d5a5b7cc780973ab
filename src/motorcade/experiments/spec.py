"""Read a sweep's specification, a TOML file."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from motorcade.config.check import (
    Schema,
    Text,
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
from motorcade.errors import MotorcadeError, Phrase
from motorcade.experiments.parameters import (
    Grid,
    Range,
    Sample,
    check_known,
    has_range,
    parameter_schemas,
    to_value,
)

FORMAT = "motorcade-sweep/1"
EMPTY_TABLE = "empty"
MOST_RUNS = 10_000_000
MOST_SECONDS = 86_400
MOST_SEED = (1 << 32) - 1
_LONGEST_NAME = 1000


@dataclass(frozen=True, slots=True)
class Sweep:
    """The content of a specification.

    Attributes:
        programs: projects and images, as the file names them, relative to it.
        mats: mats likewise; EMPTY_TABLE is an unbounded plane.
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


def read_sweep(path: Path) -> Sweep:
    """Read the specification in a file. Raises MotorcadeError."""
    return parse_sweep(read_text(path, path.name), path.name)


def parse_sweep(text: str, file: str) -> Sweep:
    """Read the specification in TOML ``text``; errors name ``file`` and the place. Raises MotorcadeError."""
    try:
        document = parse(text, "TOML", file)
    except MotorcadeError as problem:
        if re.search(r"^[\w.]+\[\d", text, re.MULTILINE):
            raise MotorcadeError("brackets-need-quotes", file=file, reason=problem.details["reason"]) from None
        raise
    for key in ("grid", "sample"):
        if isinstance(document.get(key), dict):
            document[key] = _flattened(document[key], file, key)
    values = load(document, _schema(document), file)
    duration_ms = round(values["seconds"] * 1000)
    if not duration_ms or abs(duration_ms / 1000 - values["seconds"]) > 1e-9 * values["seconds"]:
        allowed = Phrase("sweep-seconds", most=MOST_SECONDS)
        raise MotorcadeError("not-allowed", file=file, place="seconds", value=shown(values["seconds"]), allowed=allowed)
    sweep = Sweep(
        programs=tuple(values["programs"]),
        mats=tuple(values["mats"]),
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
        raise MotorcadeError("sweep-has-too-many-runs", file=file, **counts, most=MOST_RUNS)
    return sweep


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
    ranges = {name: _range(part) for name, part in parameter_schemas().items() if has_range(name)}
    text = line(_LONGEST_NAME)
    citation = {
        "title": text,
        "authors": list_of(text, 1),
        "license": text,
        "abstract": text,
        "keywords": list_of(text),
    }
    return table(
        ("grid", "sample", "citation"),
        format=choice(FORMAT),
        programs=names,
        mats={**names, "default": [EMPTY_TABLE]},
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
    for name, value in _flat(parameters):
        if place == "grid" or name not in ("count", "seed"):
            check_known(name, file, place)
        if place == "sample" and name in parameter_schemas() and not has_range(name):
            raise MotorcadeError("parameter-without-range", file=file, place=f"{place}.{name}")
        if name in flat:
            raise MotorcadeError("parameter-twice", file=file, place=f"{place}.{name}")
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
    first, count = seeds["first"], seeds["count"]
    most = MOST_SEED + 1 - first
    if count > most:
        allowed = Phrase("whole-range", minimum=1, maximum=most)
        raise MotorcadeError("not-allowed", file=file, place="seeds.count", value=count, allowed=allowed)
    return range(first, first + count)


def _points(values: dict[str, Any], file: str) -> Grid | Sample:
    if "sample" not in values:
        lists = values.get("grid", {})
        return Grid({name: tuple(to_value(name, each) for each in lists[name]) for name in lists})
    if "grid" in values:
        raise MotorcadeError("grid-and-sample", file=file)
    sample = values["sample"]
    count, seed = sample.pop("count"), sample.pop("seed")
    if not sample:
        raise MotorcadeError("sample-without-parameter", file=file)
    return Sample({name: _limits(name, sample[name], file) for name in sample}, count, seed)


def _limits(name: str, limits: dict[str, Any], file: str) -> Range:
    lowest, highest = (to_value(name, limits[key]) for key in ("from", "to"))
    place = f"sample.{name}"
    if lowest is None or highest is None:
        raise MotorcadeError("range-to-never", file=file, place=place)
    if lowest >= highest:
        raise MotorcadeError("range-not-rising", file=file, place=place, lowest=lowest, highest=highest)
    if limits["log"] and lowest <= 0:
        raise MotorcadeError("log-range-from-zero", file=file, place=place, lowest=lowest)
    return Range(lowest, highest, limits["log"])


def _check_cars(sweep: Sweep, file: Text) -> None:
    """Only the empty table can have any number of cars: a mat from a file has its own."""
    named = [index for index, name in enumerate(sweep.mats) if name != EMPTY_TABLE]
    if "cars" in sweep.points.parameters and named:
        place = f"mats[{named[0]}]"
        raise MotorcadeError("cars-vary-on-mat", file=file, place=place, name=sweep.mats[named[0]], empty=EMPTY_TABLE)
