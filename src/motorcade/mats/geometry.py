"""Geometry of mats: which cars are too near to obstacles or to each other.

Points are visited row by row, from the lowest row to the highest. In each row only those points are tested that a side
or a disc can be near; the others are decided by the thousand. So the cost grows with the points and with the rows that
obstacles reach over, and not with their product: a crowd has up to 16 million places to choose from. A hash of cells
would be shorter; to find close cars among 250,000 it took seven times as long. The tests use only operations that IEEE
754 rounds exactly, so that the result is the same on every computer.
"""

import math
from bisect import bisect_left, bisect_right
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from operator import sub
from typing import Literal, NamedTuple

from motorcade.config.check import Text
from motorcade.errors import MatError
from motorcade.mats.model import Disc, Mat
from motorcade.mats.plane import is_left_of, nearest_of_segment

Points = Sequence[float]
# Two heights, outside of which no point of the row is, and the x and y of its points. They are sorted by x, and not
# lower than those of the rows before.
PointRow = tuple[float, float, Points, Points]
# A point in a row is within what was computed for the row plus this, whatever was rounded.
_MARGIN_M = 1e-4
# A side that rises less is taken as level.
_LEVEL_M = 1e-3
# Points that are made or tested: half a second, and more for many cars.
_MOST_TESTS = 1_000_000
_TESTS_A_CAR = 32
# To go up to a side or a disc in a row takes as long as so many tests.
_TESTS_A_VISIT = 10


class Obstacle(NamedTuple):
    """A wall, round obstacle or box by its index in the mat's list; the mat's edge (0); or a car by its number."""

    kind: Literal["wall", "disc", "polygon", "edge", "car"]
    number: int


class Surface(NamedTuple):
    """The nearest point of an obstacle; of a disc its middle, which is ``thick_m`` below the surface."""

    obstacle: Obstacle
    x_m: float
    y_m: float
    thick_m: float


class _Side(NamedTuple):
    """A wall, or a side of a polygon."""

    bottom_m: float
    top_m: float
    shape: int
    is_solid: bool
    x0: float
    y0: float
    x1: float
    y1: float

    def span(self, low_m: float, high_m: float) -> tuple[float, float]:
        """The least and the greatest x of the part between two heights."""
        # Called for every side in every row: plain comparisons take half the time of min and max.
        x0 = self.x0
        y0 = self.y0
        x1 = self.x1
        y1 = self.y1
        if y0 > y1:
            x0, y0, x1, y1 = x1, y1, x0, y0
        if y1 - y0 > _LEVEL_M:
            slope = (x1 - x0) / (y1 - y0)
            begin_x = x0
            if high_m < y1:
                x1 = begin_x
                if high_m > y0:
                    x1 = begin_x + (high_m - y0) * slope
            if low_m > y0:
                x0 = x1
                if low_m < y1:
                    x0 = begin_x + (low_m - y0) * slope
        if x0 < x1:
            return x0 - _MARGIN_M, x1 + _MARGIN_M
        return x1 - _MARGIN_M, x0 + _MARGIN_M

    def is_near(self, x: float, y: float, clearance_m: float) -> bool:
        """Whether a point is nearer to the side than ``clearance_m``."""
        near_x, near_y = nearest_of_segment(x, y, self.x0, self.y0, self.x1, self.y1)
        return (x - near_x) * (x - near_x) + (y - near_y) * (y - near_y) < clearance_m * clearance_m


class _Round(NamedTuple):
    """A round obstacle, with the clearance around it."""

    bottom_m: float
    top_m: float
    shape: int
    x: float
    y: float
    radius_m: float


class Budget:
    """How much work is left for placing and checking the cars of a mat, so that none takes long.

    Args:
        cars: how many there are.
        file: what errors call the mat.

    Attributes:
        left: how many points may still be made or tested.
    """

    def __init__(self, cars: int, file: Text) -> None:
        self.left = _MOST_TESTS + _TESTS_A_CAR * cars
        self._file = file

    def take(self, tests: int) -> None:
        """Take from what is left. Raises MotorcadeError where it isn't enough."""
        self.left -= tests
        if self.left < 0:
            raise MatError("mat-too-detailed", file=self._file)


class SweepLine:
    """Find the points of rows, from the lowest row upwards, that are inside obstacles or nearer than a clearance.

    Args:
        mat: walls, discs and polygons; they are numbered in this order.
        clearance_m: how far points have to be from obstacles, above 0.
        budget: the work that is left.
        discs: more discs, for those who need no numbers.
    """

    def __init__(self, mat: Mat, clearance_m: float, budget: Budget, discs: Iterable[Disc] = ()) -> None:
        self._clearance_m = clearance_m
        self._budget = budget
        parts: list[_Side | _Round] = [*_sides_of(mat, clearance_m), *_rounds_of(mat, discs, clearance_m)]
        budget.take(_TESTS_A_VISIT * len(parts))
        self._waiting = sorted(parts, reverse=True)
        self._here: list[_Side | _Round] = []

    def reaches(self, low_m: float, high_m: float) -> bool:
        """Go up to the next row; return whether any obstacle can be near its points."""
        waiting = self._waiting
        here = [part for part in self._here if part.top_m >= low_m]
        while waiting and waiting[-1].bottom_m <= high_m:
            part = waiting.pop()
            if part.top_m >= low_m:
                here.append(part)
        self._here = here
        return bool(here)

    def touched(self, row: PointRow) -> Iterator[tuple[int, int, int]]:
        """Yield the number of an obstacle, and the first and the end of points in the row that it touches.

        Raises MotorcadeError where the budget is not enough.
        """
        if not self.reaches(*row[:2]):
            return
        self._budget.take(_TESTS_A_VISIT * len(self._here))
        # The number of a polygon: the ends of runs of points, from the row's first point on, that have a side to their
        # right. A point that is in an odd number of runs is inside.
        runs: dict[int, list[int]] = {}
        for part in self._here:
            if isinstance(part, _Round):
                yield from self._in_disc(part, row)
                continue
            yield from self._near_side(part, row)
            if part.is_solid:
                self._cross(part, row, runs.setdefault(part.shape, []))
        for shape, ends in runs.items():
            ends.sort(reverse=True)
            for end, first in zip(ends[::2], (*ends[1::2], 0), strict=False):
                if first < end:
                    yield shape, first, end

    def _near_side(self, side: _Side, row: PointRow) -> Iterator[tuple[int, int, int]]:
        clearance_m = self._clearance_m
        low_m, high_m, x_m, y_m = row
        left, right = side.span(low_m - clearance_m, high_m + clearance_m)
        first = bisect_left(x_m, left - clearance_m)
        end = bisect_right(x_m, right + clearance_m)
        self._budget.take(end - first)
        for k in range(first, end):
            if side.is_near(x_m[k], y_m[k], clearance_m):
                yield side.shape, k, k + 1

    def _cross(self, side: _Side, row: PointRow, runs: list[int]) -> None:
        """Add the runs of points whose rays to the right cross a side."""
        low_m, high_m, x_m, y_m = row
        bottom_m = min(side.y0, side.y1)
        top_m = max(side.y0, side.y1)
        if bottom_m > high_m or top_m <= low_m or bottom_m == top_m:
            return
        left, right = side.span(low_m, high_m)
        first = 0
        if bottom_m <= low_m and high_m < top_m:
            first = bisect_left(x_m, left)
            runs.append(first)
        end = bisect_right(x_m, right)
        self._budget.take(end - first)
        for k in range(first, end):
            if is_left_of(x_m[k], y_m[k], side.x0, side.y0, side.x1, side.y1):
                runs += (k, k + 1)

    def _in_disc(self, disc: _Round, row: PointRow) -> Iterator[tuple[int, int, int]]:
        low_m, high_m, x_m, y_m = row
        x = disc.x
        y = disc.y
        reach_m = disc.radius_m + self._clearance_m
        nearest_m = max(low_m - y, y - high_m, 0.0)
        farthest_m = max(abs(low_m - y), abs(high_m - y))
        most_m = math.sqrt(max(reach_m * reach_m - nearest_m * nearest_m, 0.0)) + _MARGIN_M
        least_m = math.sqrt(max(reach_m * reach_m - farthest_m * farthest_m, 0.0)) - _MARGIN_M
        first = bisect_left(x_m, x - most_m)
        end = bisect_right(x_m, x + most_m)
        # Whatever their y is, these are inside.
        sure = sure_end = end
        if least_m > 0:
            sure = bisect_left(x_m, x - least_m)
            sure_end = bisect_right(x_m, x + least_m)
        if sure < sure_end:
            yield disc.shape, sure, sure_end
        self._budget.take(sure - first + end - sure_end)
        for k in (*range(first, sure), *range(sure_end, end)):
            if (x_m[k] - x) * (x_m[k] - x) + (y_m[k] - y) * (y_m[k] - y) < reach_m * reach_m:
                yield disc.shape, k, k + 1


def _sides_of(mat: Mat, clearance_m: float) -> Iterator[_Side]:
    away_m = clearance_m + _MARGIN_M
    sides = [(number, False, wall) for number, wall in enumerate(mat.walls)]
    for number, corners in enumerate(mat.polygons, len(mat.walls) + len(mat.discs)):
        ends = zip(corners, (*corners[1:], corners[0]), strict=True)
        sides += [(number, True, (*begin, *end)) for begin, end in ends]
    for number, is_solid, (x0, y0, x1, y1) in sides:
        yield _Side(min(y0, y1) - away_m, max(y0, y1) + away_m, number, is_solid, x0, y0, x1, y1)


def _rounds_of(mat: Mat, more: Iterable[Disc], clearance_m: float) -> Iterator[_Round]:
    away_m = clearance_m + _MARGIN_M
    for number, (x, y, radius_m) in enumerate((*mat.discs, *more), len(mat.walls)):
        yield _Round(y - radius_m - away_m, y + radius_m + away_m, number, x, y, radius_m)


def obstructed(mat: Mat, x_m: Points, y_m: Points, clearance_m: float, file: Text) -> tuple[str, int] | None:
    """Find the first obstacle that contains points, or that is nearer to points than ``clearance_m``.

    Returns its place, such as ``wall[2]``, and the index of the first of those points.
    """
    if not (mat.walls or mat.discs or mat.polygons):
        return None
    sweep = SweepLine(mat, clearance_m, Budget(len(x_m), file))
    found: tuple[int, int] | None = None
    height_m = max((max(y_m) - min(y_m)) / math.sqrt(len(y_m)), 2 * clearance_m)
    for points in _rows(y_m, height_m):
        heights = [y_m[k] for k in points]
        low_m = min(heights)
        high_m = max(heights)
        if not sweep.reaches(low_m, high_m):
            continue
        points.sort(key=x_m.__getitem__)
        row = low_m, high_m, [x_m[k] for k in points], [y_m[k] for k in points]
        for shape, first, end in sweep.touched(row):
            hit = (shape, min(points[first:end]))
            found = hit if found is None else min(found, hit)
    if found is None:
        return None
    shape, point = found
    counts = {"wall": len(mat.walls), "disc": len(mat.discs), "polygon": len(mat.polygons)}
    places = [f"{name}[{number}]" for name, count in counts.items() for number in range(count)]
    return places[shape], point


def close_pair(x_m: Points, y_m: Points, distance_m: float) -> tuple[int, int] | None:
    """Find two points nearer to each other than ``distance_m``, the lower index first; None where there are none.

    Where there are several pairs, it is one of the lowest.
    """
    # A little higher than the distance, so that a near point is at most one row away, whatever was rounded.
    height_m = distance_m * (1 + 1e-6)
    below: list[int] = []
    below_x: list[float] = []
    top_m = -math.inf
    for points in _rows(y_m, height_m):
        points.sort(key=x_m.__getitem__)
        xs = [x_m[k] for k in points]
        heights = [y_m[k] for k in points]
        pair = None
        if len(xs) > 1 and min(map(sub, xs[1:], xs)) < distance_m:
            pair = _near(points, xs, points, xs, y_m, distance_m)
        if pair is None and min(heights) - top_m < distance_m:
            pair = _near(points, xs, below, below_x, y_m, distance_m)
        if pair:
            return min(pair), max(pair)
        below = points
        below_x = xs
        top_m = max(heights)
    return None


def _near(
    points: list[int], x_m: Points, others: list[int], other_x_m: Points, y_m: Points, distance_m: float
) -> tuple[int, int] | None:
    """Find two near points of two rows, each sorted by x; where the rows are one, two different points."""
    begin = 0
    is_one = points is others
    reach_m = distance_m * (1 + 1e-6)
    for k, x in enumerate(x_m):
        while begin < len(others) and other_x_m[begin] < x - reach_m:
            begin += 1
        for other in range(k + 1 if is_one else begin, len(others)):
            across = other_x_m[other] - x
            if across > reach_m:
                break
            up = y_m[others[other]] - y_m[points[k]]
            if across * across + up * up < distance_m * distance_m:
                return points[k], others[other]
    return None


def _rows(y_m: Points, height_m: float) -> Iterator[list[int]]:
    """Group points by rows of equal height, the lowest first; empty rows are left out."""
    rows: dict[int, list[int]] = defaultdict(list)
    bottom_m = min(y_m, default=0.0)
    for point, y in enumerate(y_m):
        rows[int((y - bottom_m) / height_m)].append(point)
    for row in sorted(rows):
        yield rows[row]


def surfaces(mat: Mat, x: float, y: float) -> Iterator[Surface]:
    """Yield the nearest point of each wall, disc and side of a polygon, and of each edge that is a wall."""
    for k, (x0, y0, x1, y1) in enumerate(mat.walls):
        yield Surface(Obstacle("wall", k), *nearest_of_segment(x, y, x0, y0, x1, y1), 0.0)
    for k, (at_x, at_y, radius_m) in enumerate(mat.discs):
        yield Surface(Obstacle("disc", k), at_x, at_y, radius_m)
    for k, corners in enumerate(mat.polygons):
        for one, other in zip(corners, (*corners[1:], corners[0]), strict=True):
            yield Surface(Obstacle("polygon", k), *nearest_of_segment(x, y, *one, *other), 0.0)
    if mat.walled and mat.size_m:
        width, height = mat.size_m
        for at_x, at_y in ((0.0, y), (width, y), (x, 0.0), (x, height)):
            yield Surface(Obstacle("edge", 0), at_x, at_y, 0.0)
