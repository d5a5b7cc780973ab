"""Read mats from TOML and JSON, and check them for the cars of a profile."""

import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motorcade.config.check import Text, load
from motorcade.config.files import Kind, parse, read_text
from motorcade.config.profile import Profile
from motorcade.errors import MotorcadeError, Phrase
from motorcade.mats.crowd import Crowd, IsFree, place_crowd
from motorcade.mats.geometry import Points, check_outlines, close_pair, obstructed
from motorcade.mats.model import Mat, Person, Physics, Starts, Voice
from motorcade.mats.schema import FARTHEST_M, FORMAT, MOST_CARS, mat_schema

_KINDS: dict[str, Kind] = {".toml": "TOML", ".json": "JSON"}
_MOST_HEADING = 1e6
# The simulator rounds positions to whole micrometres.
_ROUNDING_M = 1e-6

_Cars = tuple[Points, Points, Points, NDArray[np.bool_]]


def read_mat(path: str | Path) -> Mat:
    """Read the mat in the file at ``path``, which ends in .toml or .json.

    Raises MotorcadeError where it can't be read or is not a mat; the sentence names the place and what to do.
    """
    path = Path(path)
    file = Phrase("mat-named", name=path.name)
    kind = _KINDS.get(path.suffix.lower())
    if kind is None:
        raise MotorcadeError("mat-file-ending", file=file)
    return mat_of(parse(read_text(path, file), kind, file), file)


def parse_mat(text: str, name: str, kind: Kind) -> Mat:
    """Read the mat in ``text``; errors call it ``name``. Raises MotorcadeError."""
    file = Phrase("mat-named", name=name)
    return mat_of(parse(text, kind, file), file)


def mat_of(document: Any, file: Text) -> Mat:
    """Convert a parsed document; errors call it ``file``. Raises MotorcadeError."""
    checked = load(document, mat_schema(), file)
    mat = Mat(
        name=checked["name"],
        starts=Starts.of([], []),
        tick_ms=checked["tick_ms"],
        size_m=_pair(checked["size_m"]) if "size_m" in checked else None,
        walled=checked["edge"] == "wall",
        walls=tuple((*_pair(wall["from_m"]), *_pair(wall["to_m"])) for wall in checked["wall"]),
        discs=tuple((*_pair(disc["centre_m"]), float(disc["radius_m"])) for disc in checked["disc"]),
        polygons=tuple(tuple(map(_pair, polygon["corners_m"])) for polygon in checked["polygon"]),
        people=tuple(_person(person) for person in checked["person"]),
        voices=tuple(_voice(voice) for voice in checked["voice"]),
        physics=Physics(**{key: _float(value) for key, value in checked["physics"].items()}),
    )
    check_outlines(mat, file)
    return replace(mat, starts=_place_cars(mat, checked["car"], checked["crowd"], file))


def check_mat(mat: Mat, profile: Profile) -> None:
    """Check ``mat``, from a file or built in Python, and that each car of ``profile`` has room where it starts.

    Raises MotorcadeError where a value on the mat is not allowed, or a car starts over the mat's edge, in an obstacle
    or in another car; the sentence names the place and what to do.
    """
    file = Phrase("mat-named", name=mat.name)
    load(document_of(mat), mat_schema(), file)
    check_outlines(mat, file)
    starts = mat.starts
    if not len(starts):
        raise MotorcadeError("mat-needs-cars", file=file)
    for key, values, most in (
        ("x-of-car", starts.x_m, FARTHEST_M),
        ("y-of-car", starts.y_m, FARTHEST_M),
        ("heading-of-car", starts.heading, _MOST_HEADING),
    ):
        wrong = np.flatnonzero(~(np.abs(values) <= most))
        if wrong.size:
            car = int(wrong[0])
            what = Phrase(key, car=_name_of(mat, car))
            raise MotorcadeError("start-out-of-range", file=file, what=what, value=values[car], most=most)
    _check_room(mat, profile.body.diameter_mm / 1000, file)


def _check_room(mat: Mat, diameter_m: float, file: Text) -> None:
    x_m, y_m = mat.starts.x_m, mat.starts.y_m
    clearance_m = diameter_m / 2 - _ROUNDING_M

    def error(code: str, car: int, **details: Any) -> MotorcadeError:
        details |= {"car": _name_of(mat, car), "x": x_m[car], "y": y_m[car], "diameter": diameter_m}
        return MotorcadeError(code, file=file, **details)

    if mat.walled and mat.size_m is not None:
        width, height = mat.size_m
        outside = np.minimum(np.minimum(x_m, width - x_m), np.minimum(y_m, height - y_m)) < clearance_m
        if outside.any():
            raise error("start-over-edge", int(np.argmax(outside)), inside=diameter_m / 2)
    for place, cars in obstructed(x_m, y_m, clearance_m, mat.walls, mat.discs, mat.polygons):
        raise error("start-in-obstacle", int(cars.min()), place=place)
    if pair := close_pair(x_m, y_m, diameter_m - _ROUNDING_M):
        one, other = pair
        apart_m = float(np.hypot(x_m[one] - x_m[other], y_m[one] - y_m[other]))
        raise error("starts-too-close", other, apart=apart_m, other=_name_of(mat, one))


def _name_of(mat: Mat, car: int) -> Text:
    """Name a car by its place in the file, or by its number."""
    first = 0
    for place, count in mat.starts.groups:
        if car < first + count:
            return Phrase("car-of-crowd", place=place, number=car - first) if count > 1 else place
        first += count
    return Phrase("car-number", number=car)


def document_of(mat: Mat) -> dict[str, Any]:
    """Convert ``mat`` to the document of its file, without its cars."""
    document: dict[str, Any] = {
        "format": FORMAT,
        "name": mat.name,
        "tick_ms": mat.tick_ms,
        "edge": "wall" if mat.walled else "open",
        "wall": [{"from_m": wall[:2], "to_m": wall[2:]} for wall in mat.walls],
        "disc": [{"centre_m": [x, y], "radius_m": radius} for x, y, radius in mat.discs],
        "polygon": [{"corners_m": corners} for corners in mat.polygons],
        "person": [asdict(person) for person in mat.people],
        "voice": [{"at_s": voice.at_s, "word": voice.word} | _area_of(voice) for voice in mat.voices],
        "physics": {key: value for key, value in asdict(mat.physics).items() if value is not None},
    }
    if mat.size_m is not None:
        document["size_m"] = mat.size_m
    plain: dict[str, Any] = _without_numpy(document)
    return plain


def _without_numpy(value: Any) -> Any:
    """Convert NumPy's numbers to Python's, at every depth."""
    if isinstance(value, dict):
        return {key: _without_numpy(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_without_numpy(each) for each in value]
    return value.item() if isinstance(value, np.generic) else value


def _area_of(voice: Voice) -> dict[str, Any]:
    return {} if voice.radius_m is None else {"centre_m": [voice.x_m, voice.y_m], "radius_m": voice.radius_m}


def _pair(values: list[float]) -> tuple[float, float]:
    return float(values[0]), float(values[1])


def _float(value: Any) -> Any:
    return value if isinstance(value, bool) else float(value)


def _person(person: dict[str, Any]) -> Person:
    return Person(tuple((float(t_s), float(x), float(y)) for t_s, x, y in person["path"]), person["repeats"])


def _voice(voice: dict[str, Any]) -> Voice:
    at_s, word = float(voice["at_s"]), voice["word"]
    if "radius_m" not in voice:
        return Voice(at_s, word)
    return Voice(at_s, word, *_pair(voice["centre_m"]), float(voice["radius_m"]))


def _place_cars(mat: Mat, cars: list[dict[str, Any]], crowds: list[dict[str, Any]], file: Text) -> Starts:
    """Place all cars: first each of ``cars``, then crowd by crowd."""
    total = len(cars) + sum(crowd["cars"] for crowd in crowds)
    if total > MOST_CARS:
        raise MotorcadeError("mat-has-too-many-cars", file=file, count=total, most=MOST_CARS)
    listed = np.array([car["at_m"] for car in cars], float).reshape(-1, 2)
    heading = np.radians(np.array([car["heading_deg"] for car in cars], float))
    leads = np.array([car["role"] == "leader" for car in cars], np.bool_)
    parts = [(listed[:, 0], listed[:, 1], heading, leads)]
    groups = [(f"car[{number}]", 1) for number in range(len(cars))]
    for number, table in enumerate(crowds):
        crowd = _crowd(mat, table, file, f"crowd[{number}]")
        parts.append(place_crowd(crowd, _free_places(mat, parts[0], crowd.spacing_m)))
        groups.append((crowd.place, crowd.cars))
    return _joined(parts, groups)


def _joined(parts: Sequence[_Cars], groups: Sequence[tuple[str, int]]) -> Starts:
    x_m, y_m, heading, leads = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Starts(x_m, y_m, heading, leads, tuple(groups))


def _crowd(mat: Mat, table: dict[str, Any], file: Text, place: str) -> Crowd:
    if "corner_m" in table:
        corner_m, size_m = _pair(table["corner_m"]), _pair(table["size_m"])
    elif mat.size_m is not None:
        corner_m, size_m = (0.0, 0.0), mat.size_m
    else:
        raise MotorcadeError("crowd-without-area", file=file, place=place)
    heading = table["heading_deg"]
    return Crowd(
        file=file,
        place=place,
        cars=table["cars"],
        leaders=table["leaders"],
        corner_m=corner_m,
        size_m=size_m,
        spacing_m=float(table["spacing_m"]),
        is_random=table["placement"] == "random",
        heading=None if heading == "random" else math.radians(heading),
        seed=table["seed"],
    )


def _free_places(mat: Mat, listed: _Cars, spacing_m: float) -> IsFree:
    """Return the test where a car of a crowd may stand: half its spacing from obstacles, all of it from listed cars."""
    cars = tuple((float(x), float(y), spacing_m / 2) for x, y in zip(listed[0], listed[1], strict=True))

    def is_free(x_m: Points, y_m: Points) -> NDArray[np.bool_]:
        free = np.ones(len(x_m), np.bool_)
        for _, indices in obstructed(x_m, y_m, spacing_m / 2, mat.walls, mat.discs + cars, mat.polygons):
            free[indices] = False
        return free

    return is_free
