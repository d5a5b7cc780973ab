"""Why a car does what it does: what it heard, or what keeps it from hearing anything; and the remedy, carried out."""

import math
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from typing import Annotated, Any, Literal

from msgspec import Meta, Struct

from motorcade.car.brain import FORWARD, HOLDS, RUNNING, SLOT, WORD
from motorcade.config.profile import built_in_profile
from motorcade.engine.floor import outside_um
from motorcade.engine.moment import view_column
from motorcade.engine.pictures import Near, Pictures
from motorcade.engine.simulation import Simulation
from motorcade.errors import Phrase
from motorcade.mats import Mat
from motorcade.mats.document import cars_of, mat_of
from motorcade.mats.geometry import Obstacle, Surface, obstructed, surfaces
from motorcade.mats.model import Point
from motorcade.program.blocks import INFRARED
from motorcade.service.deciding import Deciding, doing, minded
from motorcade.service.messages import MatDocument, RangeMm, Remedy, WorkspaceState, sentences
from motorcade.service.world_messages import CarNumber, ReceivedFrame, Why
from motorcade.words.formats import CONTROL
from motorcade.words.image import parse_image_bytes

# The losses that no flipped bits cause, and what a car is told that has heard nothing.
_NOT_DAMAGED = {"deaf": "why-lost-deaf", "sending": "why-lost-sending", "collision": "why-lost-collision"}
# What keeps a car from hearing the newest message, where it has heard older ones.
_BEHIND = {"sending": "why-behind-sending", "collision": "why-behind-collision"}
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
_SPARE_M = 0.002
_SPARE_DEG = 0.5
# Between the points of a line of sight that are tested; obstacles are kept farther away from each.
_SIGHT_STEP_M = 0.02
# The scale of the range's slider.
_RANGE_STEP_MM = 50
_FIELDS = {"forward": "FORWARD", "listen": "ACCEPT_IR"}
# A car that stands, and has heard nothing for so long, waits for a message again.
SILENT_MS = 4000


def why(
    world: Simulation,
    pictures: Pictures,
    deciding: Deciding,
    car: int,
    *,
    driven: bool,
    lost: dict[str, int],
    last_frame: ReceivedFrame | None,
) -> Why:
    """Return why a car does what it does; the first cause without whose removal no other matters.

    Args:
        world, pictures, deciding: the car's world, and what its leaders decide.
        driven: whether somebody drives it.
        lost: how many frames reached it and were lost, by reason.
        last_frame: the last one that it received.
    """
    leaders = world.mat.starts.leaders
    if driven:
        return _why(Phrase("why-driven"))
    if obstacle := _obstacle_of(world, car):
        return _against(obstacle, leaders)
    word, runs = world.memory_of(car, (WORD, RUNNING))
    if runs and follows_line(word) and not _sees_line(world, car):
        return _why(Phrase("why-no-line"))
    if runs and (phrase := minded(world, car)):
        return _why(phrase)
    if car in leaders:
        return _why(_of_leader(world, deciding, car, word, bool(runs)))
    words = _followers_words(world.images[0])
    if last_frame is not None:
        waits = not runs and world.now_ms - last_frame.t_ms >= SILENT_MS
        if waits:
            senders, listeners = pictures.nearest(car)
            if senders and all(sender.reach != "reaches" for sender in senders):
                return _out_of_reach(world, senders, listeners)
        return _heard(world, car, words, lost, last_frame, "why-waits" if waits else "why-heard")
    if not leaders:
        return _why(Phrase("why-no-leader"), "leader")
    if not words:
        return _why(Phrase("why-no-words"), "followers")
    senders, listeners = pictures.nearest(car)
    if not senders:
        return _why(Phrase("why-nothing-sent"))
    if any(lost.values()):
        reason = max(lost, key=lambda name: lost[name])
        phrase = Phrase(_NOT_DAMAGED.get(reason, "why-lost"), count=sum(lost.values()))
        return _why(phrase, "" if reason in _NOT_DAMAGED else "loss")
    return _out_of_reach(world, senders, listeners)


def _of_leader(world: Simulation, deciding: Deciding, car: int, word: int, runs: bool) -> Phrase:
    """Say why a leader that nothing is in the way of does what it does."""
    if world.now_ms and not runs:
        return Phrase("why-timeless" if deciding.decides(car) else "why-no-program")
    decision = deciding.last(car)
    if decision is None:
        return Phrase("why-leads")
    reason = deciding.phrase(decision.asked, decision.is_met)
    return Phrase("why-decided", doing=doing(word), reason=reason, seconds=f"{decision.t_ms / 1000:.1f}")


def _why(phrase: Phrase, remedy: Remedy | Literal["", "followers"] = "", value: int = 0) -> Why:
    return Why(phrase.key, sentences(phrase), phrase.details.get("car"), remedy, value)


@lru_cache(maxsize=64)
def _followers_words(image: bytes) -> tuple[int, ...]:
    """The words that an image has for followers; each answer needs them."""
    return tuple(parse_image_bytes(image).followers)


def follows_line(word: int) -> bool:
    """Whether a car with a control word is to follow a line."""
    values = CONTROL.decode(word)
    is_ahead = values.motor_direction == FORWARD and values.motor_speed > 0
    return bool(values.floor and values.motor_enable and is_ahead)


def _sees_line(world: Simulation, car: int) -> bool:
    """Whether something dark is under the floor sensors of a car, or between them."""
    marks: Any = memoryview(world.backend.read(world.arrays().floor)).cast("d")
    if not marks:
        return False
    shown = world.read_moment()
    x_m, y_m, heading = (
        view_column(name, world.backend.read(getattr(shown, name)[car : car + 1]))[0]
        for name in ("x_m", "y_m", "heading")
    )
    sensors = world.profile.floor
    ahead_x = math.cos(heading)
    ahead_y = math.sin(heading)
    middle_x = x_m * 1e6 + sensors.ahead_mm * 1000 * ahead_x
    middle_y = y_m * 1e6 + sensors.ahead_mm * 1000 * ahead_y
    away_um, _, _ = outside_um(middle_x, middle_y, 0.0, 0.0, ahead_x, ahead_y, marks)
    return away_um <= sensors.apart_mm * 500


def _obstacle_of(world: Simulation, car: int) -> Obstacle | None:
    """Return what a car that drives straight on drives against."""
    shown = world.read_moment()
    memory = world.backend
    (wheels,) = memory.read(shown.wheels[car : car + 1])
    if not wheels & 3 or wheels >> 2:
        return None
    x_m, y_m, heading = (view_column(name, memory.read(getattr(shown, name))) for name in ("x_m", "y_m", "heading"))
    return in_the_way(world.mat, car, x_m, y_m, heading[car], world.profile.body.diameter_mm / 2000)


def _against(obstacle: Obstacle, leaders: list[int]) -> Why:
    """Return the answer of a car that drives against something."""
    kind, number = obstacle
    if kind == "edge":
        return _why(Phrase("why-against-edge"))
    if kind != "car":
        return _why(Phrase(f"why-against-{kind}"), _REMOVALS[kind], number)
    if number in leaders:
        return _why(Phrase("why-against-leader", car=number))
    return _why(Phrase("why-against-car", car=number), "remove-car", number)


def _heard(
    world: Simulation, car: int, words: Sequence[int], lost: dict[str, int], heard: ReceivedFrame, otherwise: str
) -> Why:
    """Return the answer of a car that has received a frame: it may have lost what followed.

    Args:
        words: those that the image has for followers.
        otherwise: the answer where nothing is wrong.
    """
    details = {"car": heard.car, "seconds": f"{(world.now_ms - heard.t_ms) / 1000:.1f}"}
    word, holds = world.memory_of(car, (WORD, HOLDS))
    # Where leaders have several images, the word may be of another one.
    if holds and world.mat.physics.bit_error_rate > 0 and len(world.images) == 1 and word not in words:
        return _why(Phrase("why-garbled", **details), "loss")
    if holds and not CONTROL.decode(word).accept_ir and lost["deaf"]:
        return _why(Phrase("why-does-not-listen", **details, count=lost["deaf"]), "listen")
    reason = max(_BEHIND, key=lambda name: lost[name])
    if holds and lost[reason] and _sent_now(world, words) not in (None, word):
        return _why(Phrase(_BEHIND[reason], **details))
    return _why(Phrase(otherwise, **details))


def _sent_now(world: Simulation, words: Sequence[int]) -> int | None:
    """The word for followers that the only leader sends now; None where there is none, or several lead."""
    leaders = world.mat.starts.leaders
    if len(leaders) != 1:
        return None
    (slot,) = world.memory_of(leaders[0], (SLOT,))
    if slot < len(words):
        return words[slot]
    return None


def _out_of_reach(world: Simulation, senders: Sequence[Near], listeners: Sequence[Near]) -> Why:
    """Return why no frame of those who have sent some reaches the car; ``listeners`` pass none on."""
    between = next((listener for listener in listeners if listener.reach == "reaches"), None)
    # Where bits can flip on the way, a car that passes words on is not sure to have any.
    if between and world.mat.physics.bit_error_rate == 0:
        return _why(Phrase("why-not-passed-on", car=between.car), "forward")
    nearest = min(senders, key=lambda listener: listener.distance_mm)
    details = {"car": nearest.car, "metres": f"{nearest.distance_mm / 1000:.2f}"}
    if nearest.reach == "too-far":
        value = nearest.distance_mm + 1
        phrase = Phrase("why-too-far", **details, range=f"{world.profile.infrared.range_mm / 1000:g}")
        # Where infrared can't reach so far, the car comes nearer.
        if value <= _LONGEST_RANGE_MM:
            return _why(phrase, "range_mm", value)
        return _why(phrase, "move", nearest.car)
    if nearest.reach in ("hidden", "outside-beam"):
        return _why(Phrase(f"why-{nearest.reach}", **details), "move", nearest.car)
    return _why(Phrase("why-not-yet", **details))


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
        x = x_m[car]
        y = y_m[car]
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
    x = x_m[car]
    y = y_m[car]
    ahead_x = math.cos(heading)
    ahead_y = math.sin(heading)
    best = _AHEAD_COS
    found = None
    for obstacle, at_x, at_y, thick_m in (*surfaces(mat, x, y), *_bodies(car, x_m, y_m, radius_m)):
        dx = at_x - x
        dy = at_y - y
        away = math.hypot(dx, dy)
        # Bodies push each other only while they overlap.
        if not 0 < away < radius_m + thick_m:
            continue
        cosine = (dx * ahead_x + dy * ahead_y) / away
        if cosine > best:
            best = cosine
            found = obstacle
    return found


def _bodies(car: int, x_m: Sequence[float], y_m: Sequence[float], radius_m: float) -> Iterator[Surface]:
    x = x_m[car]
    y = y_m[car]
    reach = 2 * radius_m
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
    car: CarNumber
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
    remedy = order.remedy
    document = order.mat
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
    changed = _without(document, kind)
    if pieces := [piece for k, piece in enumerate(document.get(kind, [])) if k != order.value]:
        changed[kind] = pieces
    return RemedyChanges(changed)


def _placed(order: RemedyOrder, mat: Mat) -> MatDocument | None:
    """The mat with a leader more, or with the car in front of the one that it should hear; None without room."""
    cars = _cars(order.mat, mat)
    starts = mat.starts
    profile = built_in_profile(order.profile)
    is_new = order.remedy == "leader"
    near = order.value
    if is_new:
        near = order.car
    if max(order.car, near) >= len(cars):
        return None
    at = (starts.x_m[near], starts.y_m[near])
    heading = starts.heading[near]
    others = [(starts.x_m[k], starts.y_m[k]) for k in range(len(cars)) if is_new or k != order.car]
    radius_m = profile.body.diameter_mm / 2000
    reach_m = (order.range_mm or profile.infrared.range_mm) / 1000
    away_m = _FRONT_M
    if is_new:
        away_m = -_BEHIND_M
    wished = (at[0] + away_m * math.cos(heading), at[1] + away_m * math.sin(heading))
    for point in _rings(wished):
        if math.dist(at, point) > reach_m - _SPARE_M or not _has_room(mat, others, point, radius_m):
            continue
        direction = math.atan2(point[1] - at[1], point[0] - at[0])
        off_deg = abs(math.degrees(math.remainder(direction - heading, math.tau)))
        # A new leader is turned towards the car; else the car is put where the other one's beam is.
        if not is_new and off_deg > mat.physics.beam_half_angle_deg - _SPARE_DEG:
            continue
        if not _is_in_sight(mat, at, point, [car for car in others if car != at], radius_m):
            continue
        place = {"at_m": [round(point[0], 3), round(point[1], 3)]}
        if is_new:
            facing_deg = round(math.degrees(math.atan2(at[1] - point[1], at[0] - point[0])))
            return _with_cars(order.mat, [*cars, {**place, "heading_deg": facing_deg, "role": "leader"}])
        cars[order.car] = {**cars[order.car], **place}
        return _with_cars(order.mat, cars)
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
    air_m = radius_m + _AIR_M
    (x, y) = point
    if mat.size_m:
        width_m, depth_m = mat.size_m
        if not (air_m <= x <= width_m - air_m and air_m <= y <= depth_m - air_m):
            return False
    if any(math.dist(car, point) < air_m + radius_m for car in others):
        return False
    return obstructed(mat, [x], [y], air_m, Phrase("mat-of-page")) is None


def _is_in_sight(mat: Mat, at: Point, point: Point, others: list[Point], radius_m: float) -> bool:
    """Whether neither furniture nor a car stands between two points."""
    if not mat.physics.line_of_sight:
        return True
    steps = max(2, math.ceil(math.dist(at, point) / _SIGHT_STEP_M))
    x_m = [at[0] + (point[0] - at[0]) * k / steps for k in range(steps + 1)]
    y_m = [at[1] + (point[1] - at[1]) * k / steps for k in range(steps + 1)]
    for between in zip(x_m, y_m, strict=True):
        if any(math.dist(between, car) < radius_m + _SIGHT_STEP_M for car in others):
            return False
    return obstructed(mat, x_m, y_m, _SIGHT_STEP_M, Phrase("mat-of-page")) is None


def _cars(document: MatDocument, mat: Mat) -> list[dict[str, Any]]:
    """Each car of the mat on its own, those of crowds too, in the order of their numbers."""
    listed = document.get("car", [])
    return [*listed, *cars_of(mat.starts)[len(listed) :]]


def _with_cars(document: MatDocument, cars: list[dict[str, Any]]) -> MatDocument:
    return {**_without(document, "crowd"), "car": cars}


def _without(document: dict[str, Any], key: str) -> dict[str, Any]:
    return {name: value for name, value in document.items() if name != key}


def _followers_fields(workspace: Any, field: str) -> list[FieldChange]:
    """Switch a setting on for all words of the followers: in their first block, and where a block says otherwise."""
    changes = [FieldChange(None, field, "TRUE")]
    left: list[Any] = [workspace]
    while left:
        part = left.pop()
        if isinstance(part, list):
            left += part
        if isinstance(part, dict):
            left += part.values()
            if part.get("type") == INFRARED and part.get("fields", {}).get(field) == "no":
                changes.append(FieldChange(str(part.get("id")), field, "same"))
    return changes
