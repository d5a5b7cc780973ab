"""What a car on a simulated mat drives against at a moment."""

import math
from collections.abc import Iterator, Sequence
from typing import Literal, NamedTuple

from motorcade.mats import Mat

# A body that lies farther aside is grazed: the car slides past it.
_AHEAD_COS = 0.5

Kind = Literal["wall", "disc", "polygon", "edge", "car"]


class Obstacle(NamedTuple):
    """A wall, round obstacle or box by its index in the mat's list; the mat's edge (0); or a car by its number."""

    kind: Kind
    number: int


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
