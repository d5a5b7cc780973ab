"""Carry out what the answer to 'Why?' (`motorcade.service.why`) names: on the mat, the range, or the blocks."""

import math
from collections.abc import Iterator
from typing import Annotated, Any

from msgspec import Meta, Struct

from motorcade.errors import Phrase
from motorcade.mats import Mat, Starts
from motorcade.mats.document import mat_of
from motorcade.mats.geometry import obstructed
from motorcade.program.blocks import INFRARED
from motorcade.service.messages import MatDocument, RangeMm, Remedy, WorkspaceState
from motorcade.service.programs import profile_named

# From the middle of a car to that of the car that is put in front of it: they do not touch.
_FRONT_M = 0.4
# Where a new leader stands, behind the car that has none.
_BEHIND_M = 0.5
# Kept free around a car that is placed.
_AIR_M = 0.05
_RING_M = 0.1
_RINGS = 60
# Places and headings are rounded to millimetres and degrees, so a car isn't put at the very edge of range and beam.
_SPARE_M, _SPARE_DEG = 0.002, 0.5
# Between the points of a line of sight that are tested; obstacles are kept farther away from each.
_SIGHT_STEP_M = 0.02
# The scale of the range's slider.
_RANGE_STEP_MM = 50
_FIELDS = {"forward": "FORWARD", "listen": "ACCEPT_IR"}

Point = tuple[float, float]


class RemedyOrder(Struct):
    """Carry out the remedy that the answer to 'Why?' of a car names, on a project's mat, range and blocks.

    Attributes:
        remedy, value: as in the answer.
        car: the car that was asked about.
        followers: the blocks of the followers.
    """

    mat: MatDocument
    remedy: Remedy
    value: Annotated[int, Meta(ge=0, lt=1 << 30)]
    car: Annotated[int, Meta(ge=0, lt=1 << 20)]
    followers: WorkspaceState | None = None
    profile: str = "classroom"
    range_mm: RangeMm | None = None


class FieldChange(Struct):
    """A new value for a field of one of the followers' blocks; ``block`` is None for the first one."""

    block: str | None
    field: str
    value: str


class RemedyChanges(Struct):
    """What a remedy changes; what stays as it is is None or empty. All of it is so where there is no room for a car."""

    mat: MatDocument | None = None
    range_mm: RangeMm | None = None
    fields: list[FieldChange] = []


def carry_out(order: RemedyOrder) -> RemedyChanges:
    """Return what changes; what stays as it is is None or empty. Raises MotorcadeError for a mat that is none."""
    remedy, document = order.remedy, order.mat
    if remedy == "range_mm":
        return RemedyChanges(range_mm=math.ceil(order.value / _RANGE_STEP_MM) * _RANGE_STEP_MM)
    if remedy in _FIELDS:
        return RemedyChanges(fields=_followers_fields(order.followers, _FIELDS[remedy]))
    mat = mat_of(document, Phrase("mat-of-page"))
    if remedy == "loss":
        return RemedyChanges({**document, "physics": _without(document.get("physics", {}), "bit_error_rate")})
    if remedy in ("move", "leader"):
        return RemedyChanges(_placed(order, mat))
    if remedy == "remove-car":
        cars = _cars(document, mat)
        return RemedyChanges(_with_cars(document, [car for k, car in enumerate(cars) if k != order.value]))
    kind = remedy.removeprefix("remove-")
    pieces = [piece for k, piece in enumerate(document.get(kind, [])) if k != order.value]
    return RemedyChanges({**_without(document, kind), **({kind: pieces} if pieces else {})})


def _placed(order: RemedyOrder, mat: Mat) -> MatDocument | None:
    """The mat with a leader more, or with the car in front of the one that it should hear; None without room."""
    cars, starts, profile = _cars(order.mat, mat), mat.starts, profile_named(order.profile)
    is_new = order.remedy == "leader"
    near = order.car if is_new else order.value
    if max(order.car, near) >= len(cars):
        return None
    at, heading = (starts.x_m[near], starts.y_m[near]), starts.heading[near]
    others = [(starts.x_m[k], starts.y_m[k]) for k in range(len(cars)) if is_new or k != order.car]
    radius_m = profile.body.diameter_mm / 2000
    reach_m = (order.range_mm or profile.infrared.range_mm) / 1000
    away_m = -_BEHIND_M if is_new else _FRONT_M
    for point in _rings((at[0] + away_m * math.cos(heading), at[1] + away_m * math.sin(heading))):
        if math.dist(at, point) > reach_m - _SPARE_M or not _has_room(mat, others, point, radius_m):
            continue
        # A new leader is turned towards the car; else the car is put where the other one's beam is.
        if not is_new and _off_deg(at, heading, point) > mat.physics.beam_half_angle_deg - _SPARE_DEG:
            continue
        if not _is_in_sight(mat, at, point, [each for each in others if each != at], radius_m):
            continue
        place = {"at_m": [round(point[0], 3), round(point[1], 3)]}
        if is_new:
            facing_deg = round(math.degrees(math.atan2(at[1] - point[1], at[0] - point[0])))
            return _with_cars(order.mat, [*cars, {**place, "heading_deg": facing_deg, "role": "leader"}])
        return _with_cars(order.mat, [{**car, **place} if k == order.car else car for k, car in enumerate(cars)])
    return None


def _rings(wished: Point) -> Iterator[Point]:
    """The wished point, then points around it, farther and farther away."""
    yield wished
    for ring in range(1, _RINGS + 1):
        for k in range(8 * ring):
            angle = math.tau * k / (8 * ring)
            yield wished[0] + ring * _RING_M * math.cos(angle), wished[1] + ring * _RING_M * math.sin(angle)


def _has_room(mat: Mat, others: list[Point], point: Point, radius_m: float) -> bool:
    """Whether a car fits at a point: on the mat, beside all cars and all furniture."""
    air_m, (x, y) = radius_m + _AIR_M, point
    if mat.size_m and not (air_m <= x <= mat.size_m[0] - air_m and air_m <= y <= mat.size_m[1] - air_m):
        return False
    if any(math.dist(each, point) < air_m + radius_m for each in others):
        return False
    return obstructed(mat, [x], [y], air_m, Phrase("mat-of-page")) is None


def _off_deg(at: Point, heading: float, point: Point) -> float:
    """How far a point is beside the way that a car looks, in degrees."""
    return abs(math.degrees(math.remainder(math.atan2(point[1] - at[1], point[0] - at[0]) - heading, math.tau)))


def _is_in_sight(mat: Mat, at: Point, point: Point, others: list[Point], radius_m: float) -> bool:
    """Whether neither furniture nor a car stands between two points."""
    if not mat.physics.line_of_sight:
        return True
    steps = max(2, math.ceil(math.dist(at, point) / _SIGHT_STEP_M))
    x_m = [at[0] + (point[0] - at[0]) * k / steps for k in range(steps + 1)]
    y_m = [at[1] + (point[1] - at[1]) * k / steps for k in range(steps + 1)]
    if any(
        math.dist((x, y), each) < radius_m + _SIGHT_STEP_M for x, y in zip(x_m, y_m, strict=True) for each in others
    ):
        return False
    return obstructed(mat, x_m, y_m, _SIGHT_STEP_M, Phrase("mat-of-page")) is None


def _cars(document: MatDocument, mat: Mat) -> list[dict[str, Any]]:
    """Each car of the mat on its own, those of crowds too, in the order of their numbers."""
    listed, starts = document.get("car", []), mat.starts
    return [*listed, *(_car(starts, k) for k in range(len(listed), len(starts)))]


def _car(starts: Starts, k: int) -> dict[str, Any]:
    car: dict[str, Any] = {"at_m": [round(starts.x_m[k], 3), round(starts.y_m[k], 3)]}
    if heading_deg := round(math.degrees(starts.heading[k])):
        car["heading_deg"] = heading_deg
    return {**car, "role": "leader"} if starts.leads[k] else car


def _with_cars(document: MatDocument, cars: list[dict[str, Any]]) -> MatDocument:
    return {**_without(document, "crowd"), "car": cars}


def _without(document: dict[str, Any], key: str) -> dict[str, Any]:
    return {each: value for each, value in document.items() if each != key}


def _followers_fields(workspace: Any, field: str) -> list[FieldChange]:
    """Switch a setting on for all words of the followers: in their first block, and where a block says otherwise."""
    changes = [FieldChange(None, field, "TRUE")]
    left: list[Any] = [workspace]
    while left:
        each = left.pop()
        left += each.values() if isinstance(each, dict) else each if isinstance(each, list) else ()
        if isinstance(each, dict) and each.get("type") == INFRARED and each.get("fields", {}).get(field) == "no":
            changes.append(FieldChange(str(each.get("id")), field, "same"))
    return changes
