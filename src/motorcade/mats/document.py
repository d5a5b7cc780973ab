"""Read mats from TOML and JSON, and check them for the cars of a profile."""

import math
from array import array
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

from motorcade.config.check import Text, load
from motorcade.config.files import Kind, parse, read_text
from motorcade.config.profile import Profile
from motorcade.errors import MotorcadeError, Phrase
from motorcade.mats.crowd import Crowd, place_crowd
from motorcade.mats.geometry import Budget, Points, SweepLine, close_pair, obstructed
from motorcade.mats.lines import Line
from motorcade.mats.model import Mat, Person, Physics, Starts, Voice, flags, floats
from motorcade.mats.outlines import check_outlines
from motorcade.mats.schema import FARTHEST_M, FORMAT, MOST_CARS, mat_schema

_KINDS: dict[str, Kind] = {".toml": "TOML", ".json": "JSON"}
_MOST_HEADING = 1e6
# The simulator rounds positions to whole micrometres.
_ROUNDING_M = 1e-6
# What a car takes while a mat is read and simulated, and how many cars any computer has room for.
_BYTES_A_CAR = 2200
_ALWAYS_FIT = 100_000


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
        lines=tuple(_line(line) for line in checked["line"]),
        spots=tuple((*_pair(spot["centre_m"]), float(spot["radius_m"])) for spot in checked["spot"]),
        patches=tuple(tuple(map(_pair, patch["corners_m"])) for patch in checked["patch"]),
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
    columns = starts.x_m.tolist(), starts.y_m.tolist(), starts.heading.tolist()
    for key, values, most in zip(
        ("x-of-car", "y-of-car", "heading-of-car"), columns, (FARTHEST_M, FARTHEST_M, _MOST_HEADING), strict=True
    ):
        if not all(-most <= value <= most for value in values):
            car = next(car for car, value in enumerate(values) if not -most <= value <= most)
            what = Phrase(key, car=_name_of(mat, car))
            raise MotorcadeError("start-out-of-range", file=file, what=what, value=values[car], most=most)
    _check_room(mat, *columns[:2], profile.body.diameter_mm / 1000, file)


def _check_room(mat: Mat, x_m: Points, y_m: Points, diameter_m: float, file: Text) -> None:
    clearance_m = diameter_m / 2 - _ROUNDING_M

    def error(code: str, car: int, **details: Any) -> MotorcadeError:
        details |= {"car": _name_of(mat, car), "x": x_m[car], "y": y_m[car], "diameter": diameter_m}
        return MotorcadeError(code, file=file, **details)

    if mat.walled and mat.size_m is not None:
        width, height = mat.size_m
        for car, (x, y) in enumerate(zip(x_m, y_m, strict=True)):
            if x < clearance_m or width - x < clearance_m or y < clearance_m or height - y < clearance_m:
                raise error("start-over-edge", car, inside=diameter_m / 2)
    if hit := obstructed(mat, x_m, y_m, clearance_m, file):
        place, car = hit
        raise error("start-in-obstacle", car, place=place)
    if pair := close_pair(x_m, y_m, diameter_m - _ROUNDING_M):
        one, other = pair
        apart_m = math.dist((x_m[one], y_m[one]), (x_m[other], y_m[other]))
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
        "line": [asdict(line) for line in mat.lines],
        "spot": [{"centre_m": [x, y], "radius_m": radius} for x, y, radius in mat.spots],
        "patch": [{"corners_m": corners} for corners in mat.patches],
        "person": [asdict(person) for person in mat.people],
        "voice": [{"at_s": voice.at_s, "word": voice.word} | _area_of(voice) for voice in mat.voices],
        "physics": {key: value for key, value in asdict(mat.physics).items() if value is not None},
    }
    if mat.size_m is not None:
        document["size_m"] = mat.size_m
    plain: dict[str, Any] = _without_numpy(document)
    return plain


def cars_of(starts: Starts) -> list[dict[str, Any]]:
    """The cars as a mat's file has them, each in its place."""
    columns = zip(starts.x_m, starts.y_m, starts.heading, starts.leads, strict=True)
    return [
        {"at_m": [x, y], "heading_deg": math.degrees(heading), "role": "leader" if leads else "follower"}
        for x, y, heading, leads in columns
    ]


def _without_numpy(value: Any) -> Any:
    """Convert NumPy's numbers to Python's, at every depth."""
    if isinstance(value, dict):
        return {key: _without_numpy(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_without_numpy(each) for each in value]
    return value.item() if hasattr(value, "item") else value


def _area_of(voice: Voice) -> dict[str, Any]:
    return {} if voice.radius_m is None else {"centre_m": [voice.x_m, voice.y_m], "radius_m": voice.radius_m}


def _pair(values: list[float]) -> tuple[float, float]:
    return float(values[0]), float(values[1])


def _float(value: Any) -> Any:
    return value if isinstance(value, bool) else float(value)


def _line(line: dict[str, Any]) -> Line:
    points = tuple(map(_pair, line["points_m"]))
    return Line(points, float(line["width_m"]), float(line["bend_m"]), line["closed"])


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
    free = math.inf if total <= _ALWAYS_FIT else _free_bytes()
    if total * _BYTES_A_CAR > free:
        sizes = {"needed": total * _BYTES_A_CAR / 1e9, "free": free / 1e9}
        raise MotorcadeError("mat-needs-memory", file=file, count=total, **sizes)
    x_m, y_m = (array("d", [car["at_m"][axis] for car in cars]) for axis in (0, 1))
    heading = array("d", [math.radians(car["heading_deg"]) for car in cars])
    leads = bytearray(car["role"] == "leader" for car in cars)
    listed = [*zip(x_m, y_m, strict=True)]
    groups = [(f"car[{number}]", 1) for number in range(len(cars))]
    budget = Budget(total, file)
    for number, table in enumerate(crowds):
        crowd = _crowd(mat, table, file, f"crowd[{number}]")
        # A crowd's cars stand half of their spacing from obstacles, and all of it from listed cars.
        apart = [(x, y, crowd.spacing_m / 2) for x, y in listed]
        its_x, its_y, its_heading, its_leads = place_crowd(
            crowd, partial(SweepLine, mat, crowd.spacing_m / 2, budget, apart), budget
        )
        x_m += its_x
        y_m += its_y
        heading += its_heading
        leads += its_leads
        groups.append((crowd.place, crowd.cars))
    return Starts(floats(x_m), floats(y_m), floats(heading), flags(leads), tuple(groups))


def _free_bytes() -> float:
    """The memory that is free; infinite where that can't be known, as in a browser."""
    try:
        import psutil
    except ImportError:
        return math.inf
    return float(psutil.virtual_memory().available)


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
