"""Why a car does what it does: what it heard, or what keeps it from hearing anything; and the remedy, carried out."""

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Annotated, Any, Literal, NamedTuple

from msgspec import Meta, Struct

from motorcade.engine.pictures import Near
from motorcade.errors import Phrase
from motorcade.mats import Mat, Starts
from motorcade.mats.document import mat_of
from motorcade.mats.geometry import Obstacle, Surface, obstructed, surfaces
from motorcade.program.blocks import INFRARED
from motorcade.service.messages import MatDocument, RangeMm, Remedy, WorkspaceState
from motorcade.service.programs import profile_named
from motorcade.service.world_messages import ReceivedFrame

# The losses that no flipped bits cause, and what a car is told that has heard nothing.
_NOT_DAMAGED = {"deaf": "why-lost-deaf", "sending": "why-lost-sending", "collision": "why-lost-collision"}
# What keeps a car from hearing the newest message, where it has heard older ones.
_BEHIND = {"sending": "why-behind-sending", "collision": "why-behind-collision"}
_AGAINST = {"wall": "why-against-wall", "disc": "why-against-disc", "polygon": "why-against-polygon"}
_REMOVALS: dict[str, Remedy] = {"wall": "remove-wall", "disc": "remove-disc", "polygon": "remove-polygon"}
# The longest range that the page lets infrared have.
_LONGEST_RANGE_MM = 5000
# Bodies that touched in a tick may be so far apart after it, as they push each other.
_TOUCH_M = 0.003
# A body that lies farther aside is grazed: the car slides past it.
_AHEAD_COS = 0.5
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


class Facts(NamedTuple):
    """What is known of a car at a moment of a run.

    Attributes:
        leads, driven: whether it runs its own program, or somebody drives it.
        followers_words: how many words the image has for followers.
        leaders: the cars that lead.
        t_ms: the time since the run began; in the first round nobody has to have heard anything.
        senders: the nearest cars that have sent frames.
        listeners: the nearest cars that heard some and do not pass them on.
        lost: how many frames reached the car and were lost, by reason.
        last_frame: the last one that it received.
        obstacle: what it drives against now.
        ignores: its word does not accept infrared while it is executed.
        flips: bits can flip on the way, so a car that passes words on is not sure to have any.
        is_garbled: bits of its word flipped on the way, and no check has found that.
        is_behind: it has another word than the one that the only leader sends now.
    """

    leads: bool
    driven: bool
    followers_words: int
    leaders: list[int]
    t_ms: int
    range_mm: int
    senders: Sequence[Near]
    listeners: Sequence[Near]
    lost: dict[str, int]
    last_frame: ReceivedFrame | None
    obstacle: Obstacle | None = None
    ignores: bool = False
    flips: bool = False
    is_garbled: bool = False
    is_behind: bool = False


class Cause(NamedTuple):
    """The answer.

    Attributes:
        phrase: its sentence.
        remedy: what would change it: a range in mm, ``followers`` (they need blocks), ``leader`` (one is needed),
            ``forward`` (the cars between pass words on), ``listen`` (to infrared, while words are executed), ``move``
            (this car in front of the one that sends), ``loss`` (no bits flip on the way), ``remove-wall`` and so on
            (what it drives against); "" where nothing is wrong, or no single change is sure to help.
        value: of the remedy: a range, the number of a car, or the index of a wall, a round obstacle or a box.
    """

    phrase: Phrase
    remedy: Remedy | Literal["", "followers"] = ""
    value: int = 0


def why(facts: Facts) -> Cause:
    """Return why a car does what it does; the first cause without whose removal no other matters."""
    if facts.driven:
        return Cause(Phrase("why-driven"))
    if facts.obstacle:
        return _against(facts.obstacle, facts.leaders)
    if facts.leads:
        return Cause(Phrase("why-leads"))
    if facts.last_frame is not None:
        return _heard(facts, facts.last_frame)
    if not facts.leaders:
        return Cause(Phrase("why-no-leader"), "leader")
    if facts.followers_words == 0:
        return Cause(Phrase("why-no-words"), "followers")
    if not facts.senders:
        return Cause(Phrase("why-nothing-sent"))
    if any(facts.lost.values()):
        reason = max(facts.lost, key=lambda name: facts.lost[name])
        phrase = Phrase(_NOT_DAMAGED.get(reason, "why-lost"), count=sum(facts.lost.values()))
        return Cause(phrase, "" if reason in _NOT_DAMAGED else "loss")
    return _out_of_reach(facts)


def _against(obstacle: Obstacle, leaders: list[int]) -> Cause:
    """Return the answer of a car that drives against something."""
    kind, number = obstacle
    if kind == "edge":
        return Cause(Phrase("why-against-edge"))
    if kind != "car":
        return Cause(Phrase(_AGAINST[kind]), _REMOVALS[kind], number)
    if number in leaders:
        return Cause(Phrase("why-against-leader", car=number))
    return Cause(Phrase("why-against-car", car=number), "remove-car", number)


def _heard(facts: Facts, heard: ReceivedFrame) -> Cause:
    """Return the answer of a car that has received a frame: it may have lost what followed."""
    details = {"car": heard.car, "seconds": f"{(facts.t_ms - heard.t_ms) / 1000:.1f}"}
    if facts.is_garbled:
        return Cause(Phrase("why-garbled", **details), "loss")
    if facts.ignores and facts.lost.get("deaf"):
        return Cause(Phrase("why-does-not-listen", **details, count=facts.lost["deaf"]), "listen")
    reason = max(_BEHIND, key=lambda name: facts.lost.get(name, 0))
    if facts.is_behind and facts.lost.get(reason):
        return Cause(Phrase(_BEHIND[reason], **details))
    return Cause(Phrase("why-heard", **details))


def _out_of_reach(facts: Facts) -> Cause:
    """Return why no frame reaches the car."""
    between = next((each for each in facts.listeners if each.reach == "reaches"), None)
    if between and not facts.flips:
        return Cause(Phrase("why-not-passed-on", car=between.car), "forward")
    nearest = min(facts.senders, key=lambda each: each.distance_mm)
    details = {"car": nearest.car, "metres": f"{nearest.distance_mm / 1000:.2f}"}
    if nearest.reach == "too-far":
        value = nearest.distance_mm + 1
        phrase = Phrase("why-too-far", **details, range=f"{facts.range_mm / 1000:g}")
        # Where infrared can't reach so far, the car comes nearer.
        return Cause(phrase, "range_mm", value) if value <= _LONGEST_RANGE_MM else Cause(phrase, "move", nearest.car)
    if nearest.reach == "hidden":
        return Cause(Phrase("why-hidden", **details), "move", nearest.car)
    if nearest.reach == "outside-beam":
        return Cause(Phrase("why-outside-beam", **details), "move", nearest.car)
    return Cause(Phrase("why-not-yet", **details))


def touched(
    mat: Mat, cars: Iterable[int], x_m: Sequence[float], y_m: Sequence[float], radius_m: float
) -> Iterator[tuple[int, Obstacle]]:
    """Yield each of ``cars`` that touches something now, and what it touches.

    Args:
        x_m, y_m: where all cars are, in metres.
        radius_m: of the body of each car.
    """
    order = sorted(range(len(x_m)), key=lambda car: x_m[car])
    place = {car: at for at, car in enumerate(order)}
    reach = 2 * radius_m + _TOUCH_M
    for car in cars:
        x, y = x_m[car], y_m[car]
        for obstacle, at_x, at_y, thick_m in surfaces(mat, x, y):
            if math.hypot(at_x - x, at_y - y) < radius_m + thick_m + _TOUCH_M:
                yield car, obstacle
        for step in (-1, 1):
            at = place[car] + step
            while 0 <= at < len(order) and abs(x_m[order[at]] - x) < reach:
                if math.hypot(x_m[order[at]] - x, y_m[order[at]] - y) < reach:
                    yield car, Obstacle("car", order[at])
                at += step


def in_the_way(
    mat: Mat, car: int, x_m: Sequence[float], y_m: Sequence[float], heading: float, radius_m: float
) -> Obstacle | None:
    """Return what a car that drives forward pushes against; None where nothing is in its way.

    Args:
        mat: what is around the cars.
        car: its number.
        x_m, y_m: where all cars are, in metres.
        heading: of this car, in radians counter-clockwise from the x axis.
        radius_m: of the body of each car.
    """
    if not mat.physics.collisions:
        return None
    x, y = x_m[car], y_m[car]
    ahead_x, ahead_y = math.cos(heading), math.sin(heading)
    best, found = _AHEAD_COS, None
    for obstacle, at_x, at_y, thick_m in (*surfaces(mat, x, y), *_bodies(car, x_m, y_m, radius_m)):
        dx, dy = at_x - x, at_y - y
        away = math.hypot(dx, dy)
        # Bodies push each other only while they overlap.
        if 0 < away < radius_m + thick_m and (dx * ahead_x + dy * ahead_y) / away > best:
            best, found = (dx * ahead_x + dy * ahead_y) / away, obstacle
    return found


def _bodies(car: int, x_m: Sequence[float], y_m: Sequence[float], radius_m: float) -> Iterator[Surface]:
    x, y, reach = x_m[car], y_m[car], 2 * radius_m
    for k, at_x in enumerate(x_m):
        if abs(at_x - x) < reach and k != car and abs(y_m[k] - y) < reach:
            yield Surface(Obstacle("car", k), at_x, y_m[k], radius_m)


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
