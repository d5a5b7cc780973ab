"""Read mats from TOML and JSON, check them for the cars of a profile, and find outlines that are not valid."""

import math
from array import array
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, replace
from functools import partial
from operator import itemgetter
from pathlib import Path
from typing import Any

from motorcade.config.arguments import instance_of, not_allowed, to_list
from motorcade.config.check import Text, load
from motorcade.config.files import KINDS, Kind, parse, read_text
from motorcade.config.profile import Profile
from motorcade.errors import MatError, MotorcadeError, Phrase
from motorcade.mats.crowd import Crowd, place_crowd
from motorcade.mats.geometry import Budget, Points, SweepLine, close_pair, obstructed
from motorcade.mats.model import Corners, Line, Mat, Person, Physics, Point, Starts, Voice, flags, floats
from motorcade.mats.schema import FARTHEST_M, FORMAT, MOST_CARS, SHORTEST_M, THINGS, mat_schema

MOST_HEADING = 1e6
# How the format of a project begins; beside its program it may hold the mat that its author saw.
_PROJECT = "motorcade-program/"
# The simulator rounds positions to whole micrometres.
_ROUNDING_M = 1e-6
_SMALLEST_M2 = SHORTEST_M * SHORTEST_M
_SHORTEST_S = 0.001
# Pairs of sides of all polygons that are checked: a second. A polygon of 1,000 corners has at most half a million.
_MOST_PAIRS = 1_000_000


def read_mat(path: str | Path) -> Mat:
    """Read the mat in the file at ``path``, which ends in .toml or .json, or that of the project in it.

    Raises MotorcadeError where it can't be read or is not a mat; the sentence names the place and what to do.
    """
    path = Path(path)
    file = Phrase("mat-named", name=path.name)
    kind = KINDS.get(path.suffix.lower())
    if kind is None:
        raise MatError("mat-file-ending", file=file)
    return parse_mat(read_text(path, file), path.name, kind)


def parse_mat(text: str, name: str, kind: Kind) -> Mat:
    """Read the mat in ``text``, or that of the project in it; errors call it ``name``. Raises MotorcadeError."""
    return mat_of(document_in(text, name, kind), Phrase("mat-named", name=name))


def document_in(text: str, name: str, kind: Kind) -> Any:
    """Return the document of the mat in ``text``, or that of the project in it, for `mat_of`. Raises MotorcadeError."""
    document = parse(text, kind, Phrase("mat-named", name=name))
    if isinstance(document, dict) and str(document.get("format")).startswith(_PROJECT):
        if document.get("mat") is None:
            raise MatError("project-without-mat", file=name)
        return document["mat"]
    return document


def mat_of(document: Any, file: Text) -> Mat:
    """Convert a parsed document; errors call it ``file``. Raises MotorcadeError."""
    mat, checked = mat_without_cars(document, file)
    check_outlines(mat, file)
    return replace(mat, starts=_place_cars(mat, checked["car"], checked["crowd"], file))


def mat_without_cars(document: Any, file: Text) -> tuple[Mat, dict[str, Any]]:
    """Convert a parsed document but for its cars and `check_outlines`; also return it with defaults.

    Raises MotorcadeError.
    """
    checked = load(document, mat_schema(), file)
    mat = Mat(
        name=checked["name"],
        starts=Starts.of([], []),
        tick_ms=checked["tick_ms"],
        size_m=_floats(checked.get("size_m")),
        walled=checked["edge"] == "wall",
        **{thing.field: tuple(map(_SHAPES[thing.shape][0], _floats(checked[thing.key]))) for thing in THINGS},
        physics=Physics(**_floats(checked["physics"])),
    )
    return mat, checked


def check_mat(mat: Mat, profile: Profile) -> None:
    """Check ``mat``, from a file or built in Python, and that each car of ``profile`` has room where it starts.

    Raises MotorcadeError where a value on the mat is not allowed, or a car starts over the mat's edge, in an obstacle
    or in another car; the sentence names the place and what to do.
    """
    check_things(mat)
    check_starts(mat, profile)


def check_starts(mat: Mat, profile: Profile) -> None:
    """Check the places of the cars on a mat that is right otherwise. Raises MotorcadeError, as `check_mat` does."""
    file = Phrase("mat-named", name=mat.name)
    starts = mat.starts
    if not len(starts):
        raise MatError("mat-needs-cars", file=file)
    columns = starts.x_m.tolist(), starts.y_m.tolist(), starts.heading.tolist()
    limits = (("x-of-car", FARTHEST_M), ("y-of-car", FARTHEST_M), ("heading-of-car", MOST_HEADING))
    for (key, most), values in zip(limits, columns, strict=True):
        for car, value in enumerate(values):
            if not -most <= value <= most:
                what = Phrase(key, car=_name_of(mat, car))
                raise MatError("start-out-of-range", file=file, what=what, value=value, most=most)
    if mat.physics.collisions:
        _check_room(mat, *columns[:2], profile.body.diameter_mm / 1000, file)


def check_things(mat: Mat) -> None:
    """Check all of ``mat`` but its cars. Raises MotorcadeError where a value is not allowed, as `check_mat` does."""
    instance_of(Physics, "physics", mat.physics)
    file = Phrase("mat-named", name=mat.name)
    load(document_of(mat), mat_schema(), file)
    check_outlines(mat, file)


def _check_room(mat: Mat, x_m: Points, y_m: Points, diameter_m: float, file: Text) -> None:
    clearance_m = diameter_m / 2 - _ROUNDING_M

    def error(code: str, car: int, **details: Any) -> MotorcadeError:
        details |= {"car": _name_of(mat, car), "x": x_m[car], "y": y_m[car], "diameter": diameter_m}
        return MatError(code, file=file, **details)

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
            if count > 1:
                return Phrase("car-of-crowd", place=place, number=car - first)
            return place
        first += count
    return Phrase("car-number", number=car)


def document_of(mat: Mat) -> dict[str, Any]:
    """Convert ``mat`` to the document of its file, without its cars."""
    document: dict[str, Any] = {
        "format": FORMAT,
        "name": mat.name,
        "tick_ms": mat.tick_ms,
        "edge": "wall" if mat.walled else "open",
        **{thing.key: _tables_of(mat, thing.field, _SHAPES[thing.shape][1]) for thing in THINGS},
        "physics": {key: value for key, value in asdict(mat.physics).items() if value is not None},
    }
    if mat.size_m is not None:
        document["size_m"] = mat.size_m
    plain: dict[str, Any] = _without_numpy(document)
    return plain


def _tables_of(mat: Mat, field: str, table_of: Callable[[Any], dict[str, Any]]) -> list[dict[str, Any]]:
    """The tables of a mat's things. Raises MotorcadeError where what Python code gave is of another shape."""
    things = to_list(field, getattr(mat, field))
    try:
        return [table_of(thing) for thing in things]
    except (TypeError, ValueError, IndexError, AttributeError):
        raise not_allowed(field, things, Phrase("as-mat-says")) from None


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
        return {key: _without_numpy(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_without_numpy(part) for part in value]
    if hasattr(value, "tolist"):
        return value.tolist()
    return value


def _floats(value: Any) -> Any:
    """Return a part of a document with its numbers as floats and its lists as tuples, at every depth."""
    if isinstance(value, dict):
        return {key: _floats(part) for key, part in value.items()}
    if isinstance(value, list):
        return tuple(map(_floats, value))
    if isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    return value


def _voice(at_s: float, word: str, centre_m: Point = (0.0, 0.0), radius_m: float | None = None) -> Voice:
    return Voice(at_s, word, *centre_m, radius_m)


def _table_of_voice(voice: Voice) -> dict[str, Any]:
    table: dict[str, Any] = {"at_s": voice.at_s, "word": voice.word}
    if voice.radius_m is not None:
        table |= {"centre_m": (voice.x_m, voice.y_m), "radius_m": voice.radius_m}
    return table


# Of each shape: a thing as `Mat` holds it, from its table; and its table.
_SHAPES: dict[str, tuple[Callable[[Any], Any], Callable[[Any], dict[str, Any]]]] = {
    "ends": (lambda it: (*it["from_m"], *it["to_m"]), lambda wall: {"from_m": wall[:2], "to_m": wall[2:]}),
    "round": (lambda it: (*it["centre_m"], it["radius_m"]), lambda disc: {"centre_m": disc[:2], "radius_m": disc[2]}),
    "corners": (itemgetter("corners_m"), lambda corners: {"corners_m": corners}),
    "line": (lambda it: Line(**it), asdict),
    "walk": (lambda it: Person(**it), asdict),
    "speech": (lambda it: _voice(**it), _table_of_voice),
}


def _place_cars(mat: Mat, cars: list[dict[str, Any]], crowds: list[dict[str, Any]], file: Text) -> Starts:
    """Place all cars: first each of ``cars``, then crowd by crowd."""
    total = len(cars) + sum(crowd["cars"] for crowd in crowds)
    if total > MOST_CARS:
        raise MatError("mat-has-too-many-cars", file=file, count=total, most=MOST_CARS)
    x_m, y_m = (array("d", [car["at_m"][axis] for car in cars]) for axis in (0, 1))
    heading = array("d", [math.radians(car["heading_deg"]) for car in cars])
    leads = bytearray(car["role"] == "leader" for car in cars)
    listed = [*zip(x_m, y_m, strict=True)]
    groups = [(f"car[{number}]", 1) for number in range(len(cars))]
    budget = Budget(total, file)
    for number, table in enumerate(crowds):
        place = f"crowd[{number}]"
        area = {"corner_m": (0.0, 0.0), "size_m": mat.size_m} if mat.size_m else {}
        if "corner_m" not in table and not area:
            raise MatError("crowd-without-area", file=file, place=place)
        crowd = Crowd(file=file, place=place, **(area | table))
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


def check_outlines(mat: Mat, file: Text) -> None:
    """Raise MotorcadeError where a wall, a polygon or a path is not valid; the error calls the mat ``file``."""
    if mat.walled and mat.size_m is None:
        raise MatError("edge-without-size", file=file)
    for number, (x0, y0, x1, y1) in enumerate(mat.walls):
        if (x1 - x0) ** 2 + (y1 - y0) ** 2 < _SMALLEST_M2:
            raise MatError("wall-without-length", file=file, place=f"wall[{number}]")
    pairs = 0
    for number, corners in enumerate(mat.polygons):
        place = f"polygon[{number}].corners_m"
        beside = _beside(corners)
        pairs += sum(len(others) for _, others in beside)
        if pairs > _MOST_PAIRS:
            raise MatError("polygons-too-detailed", file=file, place=place)
        if fault := _fault_of(corners, beside):
            code, sides = fault
            raise MatError(code, file=file, place=place, **sides)
    for number, person in enumerate(mat.people):
        place = f"person[{number}].path"
        times = [t_s for t_s, _, _ in person.path]
        if times[0] != 0:
            raise MatError("path-begins-late", file=file, place=f"{place}[0]", time=times[0])
        for step in range(1, len(times)):
            if times[step] - times[step - 1] < _SHORTEST_S * (1 - 1e-6):
                details = {"time": times[step], "before": times[step - 1]}
                raise MatError("path-times-not-rising", file=file, place=f"{place}[{step}]", **details)


def _fault_of(corners: Corners, beside: Sequence[tuple[int, Sequence[int]]]) -> tuple[str, dict[str, int]] | None:
    """What is wrong with a polygon whose sides lie ``beside`` each other: an error's code, and the corners or sides."""
    sides = list(zip(corners, (*corners[1:], corners[0]), strict=True))
    for number, ((x0, y0), (x1, y1)) in enumerate(sides):
        if (x1 - x0) ** 2 + (y1 - y0) ** 2 < _SMALLEST_M2:
            return "polygon-repeats-corner", {"one": number, "other": (number + 1) % len(corners)}
    if math.fsum(abs(_turn(corners[0], *side)) for side in sides) / 2 < _SMALLEST_M2:
        return "polygon-without-area", {}
    if crossing := min(_crossings(sides, beside), default=None):
        return "polygon-crosses-itself", {"one": crossing[0], "other": crossing[2]}
    return None


def _beside(corners: Corners) -> list[tuple[int, list[int]]]:
    """Each side of a polygon, in the order of their least x, and those after it that it overlaps in x.

    Side k begins at corner k.
    """
    ends = zip(corners, (*corners[1:], corners[0]), strict=True)
    spans = sorted((min(begin[0], end[0]), max(begin[0], end[0]), side) for side, (begin, end) in enumerate(ends))
    lows = [low for low, _, _ in spans]
    order = [side for _, _, side in spans]
    return [(side, order[k + 1 : bisect_right(lows, high)]) for k, (_, high, side) in enumerate(spans)]


def _crossings(
    sides: Sequence[tuple[Point, Point]], beside: Sequence[tuple[int, Sequence[int]]]
) -> Iterator[tuple[int, int, int]]:
    """Yield each side whose following side runs back over it, with 0 between them; with 1 others that meet."""
    for side, ((x0, y0), (x1, y1)) in enumerate(sides):
        following = (side + 1) % len(sides)
        x2, y2 = sides[following][1]
        if _turn((x0, y0), (x1, y1), (x2, y2)) == 0 and (x1 - x0) * (x2 - x1) + (y1 - y0) * (y2 - y1) < 0:
            yield side, 0, following
    for side, others in beside:
        for other in others:
            if abs(side - other) not in (1, len(sides) - 1) and _meet(*sides[side], *sides[other]):
                yield min(side, other), 1, max(side, other)


def _meet(a: Point, b: Point, c: Point, d: Point) -> bool:
    """Whether the segment from ``a`` to ``b`` meets that from ``c`` to ``d``; their ends count."""
    if min(a[0], b[0]) > max(c[0], d[0]) or min(c[0], d[0]) > max(a[0], b[0]):
        return False
    if min(a[1], b[1]) > max(c[1], d[1]) or min(c[1], d[1]) > max(a[1], b[1]):
        return False
    return not _is_same_side(_turn(a, b, c), _turn(a, b, d)) and not _is_same_side(_turn(c, d, a), _turn(c, d, b))


def _is_same_side(one: float, other: float) -> bool:
    return (one > 0 and other > 0) or (one < 0 and other < 0)


def _turn(a: Point, b: Point, c: Point) -> float:
    """Above 0 where the path from ``a`` over ``b`` to ``c`` turns left, 0 where it is straight."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
