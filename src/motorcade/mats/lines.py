"""Lines on the floor of a mat: their way through their points, with rounded corners."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

Point = tuple[float, float]
# How far a chord may be from the arc that it stands for.
_SAGITTA_M = 0.001


@dataclass(frozen=True, slots=True)
class Line:
    """A dark line on the floor.

    Attributes:
        points_m: its points, two or more, in order.
        width_m: its width.
        bend_m: the radius of the arcs that round its corners; 0 for sharp corners. An arc takes at most half of a
            stretch, so between near points it is smaller.
        closed: whether it goes on from its last point to its first.
    """

    points_m: tuple[Point, ...]
    width_m: float = 0.03
    bend_m: float = 0.0
    closed: bool = False


def way_of(line: Line) -> list[Point]:
    """Return the points of the line's middle, the first again where it is closed.

    Arcs become chords that are at most 1 mm off.
    """
    points = line.points_m
    if len(points) == 2:
        return list(points)
    way: list[Point] = []
    count = len(points)
    for at, here in enumerate(points):
        is_end = not line.closed and at in (0, count - 1)
        if is_end or line.bend_m == 0:
            way.append(here)
        else:
            way += _bend(points[at - 1], here, points[(at + 1) % count], line.bend_m)
    return [*way, way[0]] if line.closed else way


def _bend(before: Point, corner: Point, after: Point, radius_m: float) -> Sequence[Point]:
    """Return the points of the arc that touches both sides of a corner; the corner itself where the way is straight."""
    to_before, to_after = _direction(corner, before), _direction(corner, after)
    if to_before is None or to_after is None:
        return (corner,)
    half = math.acos(max(-1.0, min(1.0, to_before[0] * to_after[0] + to_before[1] * to_after[1]))) / 2
    if half < 1e-3 or half > math.pi / 2 - 1e-3:
        return (corner,)
    most_m = min(math.dist(corner, before), math.dist(corner, after)) / 2
    from_corner_m = min(radius_m / math.tan(half), most_m)
    radius = from_corner_m * math.tan(half)
    begin = corner[0] + to_before[0] * from_corner_m, corner[1] + to_before[1] * from_corner_m
    to_middle = to_before[0] + to_after[0], to_before[1] + to_after[1]
    length = math.hypot(*to_middle)
    away = from_corner_m / math.cos(half)
    centre = corner[0] + to_middle[0] / length * away, corner[1] + to_middle[1] / length * away
    first = math.atan2(begin[1] - centre[1], begin[0] - centre[0])
    turn = math.pi - 2 * half
    if to_before[0] * to_after[1] - to_before[1] * to_after[0] > 0:
        turn = -turn
    step = 2 * math.acos(max(0.0, 1 - _SAGITTA_M / radius)) if radius > _SAGITTA_M else math.pi
    pieces = max(1, math.ceil(abs(turn) / step))
    angles = [first + turn * piece / pieces for piece in range(pieces + 1)]
    return [(centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle)) for angle in angles]


def _direction(here: Point, there: Point) -> Point | None:
    length = math.dist(here, there)
    return ((there[0] - here[0]) / length, (there[1] - here[1]) / length) if length else None
