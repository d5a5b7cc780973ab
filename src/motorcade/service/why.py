"""Why a car does what it does: what it heard, or what keeps it from hearing anything, and what would change that."""

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Literal, NamedTuple

from motorcade.engine.pictures import Near
from motorcade.errors import Phrase
from motorcade.mats import Mat
from motorcade.service.messages import Remedy
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

Kind = Literal["wall", "disc", "polygon", "edge", "car"]


class Obstacle(NamedTuple):
    """A wall, round obstacle or box by its index in the mat's list; the mat's edge (0); or a car by its number."""

    kind: Kind
    number: int


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
        for obstacle, at_x, at_y, thick_m in _furniture(mat, x, y):
            if math.hypot(at_x - x, at_y - y) < radius_m + thick_m + _TOUCH_M:
                yield car, obstacle
        for step in (-1, 1):
            at = place[car] + step
            while 0 <= at < len(order) and abs(x_m[order[at]] - x) < reach:
                if math.hypot(x_m[order[at]] - x, y_m[order[at]] - y) < reach:
                    yield car, Obstacle("car", order[at])
                at += step


class _Surface(NamedTuple):
    obstacle: Obstacle
    x_m: float
    y_m: float
    # From that point to the surface: a disc's radius, 0 for a line.
    thick_m: float


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
    for obstacle, at_x, at_y, thick_m in (*_furniture(mat, x, y), *_cars(car, x_m, y_m, radius_m)):
        dx, dy = at_x - x, at_y - y
        away = math.hypot(dx, dy)
        # Bodies push each other only while they overlap.
        if 0 < away < radius_m + thick_m and (dx * ahead_x + dy * ahead_y) / away > best:
            best, found = (dx * ahead_x + dy * ahead_y) / away, obstacle
    return found


def _furniture(mat: Mat, x: float, y: float) -> Iterator[_Surface]:
    """The point of each piece that is nearest to a point."""
    for k, (x0, y0, x1, y1) in enumerate(mat.walls):
        yield _Surface(Obstacle("wall", k), *_nearest(x, y, x0, y0, x1, y1), 0.0)
    for k, (at_x, at_y, radius_m) in enumerate(mat.discs):
        yield _Surface(Obstacle("disc", k), at_x, at_y, radius_m)
    for k, corners in enumerate(mat.polygons):
        for one, other in zip(corners, (*corners[1:], corners[0]), strict=True):
            yield _Surface(Obstacle("polygon", k), *_nearest(x, y, *one, *other), 0.0)
    if mat.walled and mat.size_m:
        width, height = mat.size_m
        for at_x, at_y in ((0.0, y), (width, y), (x, 0.0), (x, height)):
            yield _Surface(Obstacle("edge", 0), at_x, at_y, 0.0)


def _cars(car: int, x_m: Sequence[float], y_m: Sequence[float], radius_m: float) -> Iterator[_Surface]:
    x, y, reach = x_m[car], y_m[car], 2 * radius_m
    for k, at_x in enumerate(x_m):
        if abs(at_x - x) < reach and k != car and abs(y_m[k] - y) < reach:
            yield _Surface(Obstacle("car", k), at_x, y_m[k], radius_m)


def _nearest(x: float, y: float, x0: float, y0: float, x1: float, y1: float) -> tuple[float, float]:
    """The point of a line from (x0, y0) to (x1, y1) that is nearest to (x, y)."""
    along_x, along_y = x1 - x0, y1 - y0
    squared = along_x * along_x + along_y * along_y
    part = ((x - x0) * along_x + (y - y0) * along_y) / squared if squared else 0.0
    part = min(max(part, 0.0), 1.0)
    return x0 + part * along_x, y0 + part * along_y
