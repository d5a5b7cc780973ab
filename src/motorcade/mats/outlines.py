"""Check walls, polygons and paths: which of them are not valid."""

import math
from bisect import bisect_right
from collections.abc import Iterator

from motorcade.config.check import Text
from motorcade.errors import MotorcadeError
from motorcade.mats.model import Corners, Mat
from motorcade.mats.schema import SHORTEST_M

_Point = tuple[float, float]

_SMALLEST_M2 = SHORTEST_M * SHORTEST_M
_SHORTEST_S = 0.001
# Pairs of sides of all polygons that are checked: a second. A polygon of 1,000 corners has at most half a million.
_MOST_PAIRS = 1_000_000


def check_outlines(mat: Mat, file: Text) -> None:
    """Raise MotorcadeError where a wall, a polygon or a path is not valid; the error calls the mat ``file``."""
    if mat.walled and mat.size_m is None:
        raise MotorcadeError("edge-without-size", file=file)
    for number, (x0, y0, x1, y1) in enumerate(mat.walls):
        if (x1 - x0) ** 2 + (y1 - y0) ** 2 < _SMALLEST_M2:
            raise MotorcadeError("wall-without-length", file=file, place=f"wall[{number}]")
    pairs = 0
    for number, corners in enumerate(mat.polygons):
        place = f"polygon[{number}].corners_m"
        pairs += _Sides(corners).pairs
        if pairs > _MOST_PAIRS:
            raise MotorcadeError("polygons-too-detailed", file=file, place=place)
        if fault := _fault_of(corners):
            code, sides = fault
            raise MotorcadeError(code, file=file, place=place, **sides)
    for number, person in enumerate(mat.people):
        place = f"person[{number}].path"
        times = [t_s for t_s, _, _ in person.path]
        if times[0] != 0:
            raise MotorcadeError("path-begins-late", file=file, place=f"{place}[0]", time=times[0])
        for step in range(1, len(times)):
            if times[step] - times[step - 1] < _SHORTEST_S * (1 - 1e-6):
                details = {"time": times[step], "before": times[step - 1]}
                raise MotorcadeError("path-times-not-rising", file=file, place=f"{place}[{step}]", **details)


def _fault_of(corners: Corners) -> tuple[str, dict[str, int]] | None:
    """What is wrong with a polygon: an error's code, and the two corners or sides."""
    nexts = (*corners[1:], corners[0])
    for number, ((x0, y0), (x1, y1)) in enumerate(zip(corners, nexts, strict=True)):
        if (x1 - x0) ** 2 + (y1 - y0) ** 2 < _SMALLEST_M2:
            return "polygon-repeats-corner", {"one": number, "other": (number + 1) % len(corners)}
    if math.fsum(abs(_turn(corners[0], here, there)) for here, there in zip(corners, nexts, strict=True)) / 2 < (
        _SMALLEST_M2
    ):
        return "polygon-without-area", {}
    if crossing := _Sides(corners).crossing():
        one, other = crossing
        return "polygon-crosses-itself", {"one": one, "other": other}
    return None


class _Sides:
    """The sides of a polygon in the order of their least x or y, whichever leaves fewer pairs to check.

    Attributes:
        pairs: how many pairs of sides overlap in x or in y.
    """

    def __init__(self, corners: Corners) -> None:
        self._sides = list(zip(corners, (*corners[1:], corners[0]), strict=True))
        self.pairs, self._order, self._ends = min(self._ordered(axis) for axis in (0, 1))

    def _ordered(self, axis: int) -> tuple[int, list[int], list[int]]:
        """Count the pairs; return the sides in order, and up to where in the order each one overlaps others."""
        lows = [min(begin[axis], end[axis]) for begin, end in self._sides]
        order = sorted(range(len(lows)), key=lows.__getitem__)
        in_order = [lows[side] for side in order]
        ends = [bisect_right(in_order, max(begin[axis] for begin in self._sides[side])) for side in order]
        return sum(ends) - len(ends) * (len(ends) + 1) // 2, order, ends

    def crossing(self) -> tuple[int, int] | None:
        """Find the first two sides that meet elsewhere than at their common corner; side k begins at corner k."""
        found = min((*self._turned_back(), *self._met()), default=None)
        return found and (found[0], found[2])

    def _turned_back(self) -> Iterator[tuple[int, int, int]]:
        """Yield each side whose following side runs back over it."""
        sides = self._sides
        for side, ((x0, y0), (x1, y1)) in enumerate(sides):
            following = (side + 1) % len(sides)
            x2, y2 = sides[following][1]
            if _turn((x0, y0), (x1, y1), (x2, y2)) == 0 and (x1 - x0) * (x2 - x1) + (y1 - y0) * (y2 - y1) < 0:
                yield side, 0, following

    def _met(self) -> Iterator[tuple[int, int, int]]:
        """Yield the pairs of sides that are no neighbours and meet."""
        sides, order = self._sides, self._order
        for k, (side, end) in enumerate(zip(order, self._ends, strict=True)):
            for other in order[k + 1 : end]:
                if abs(side - other) not in (1, len(sides) - 1) and _meet(*sides[side], *sides[other]):
                    yield min(side, other), 1, max(side, other)


def _meet(a: _Point, b: _Point, c: _Point, d: _Point) -> bool:
    """Whether the segment from ``a`` to ``b`` meets that from ``c`` to ``d``; their ends count."""
    if min(a[0], b[0]) > max(c[0], d[0]) or min(c[0], d[0]) > max(a[0], b[0]):
        return False
    if min(a[1], b[1]) > max(c[1], d[1]) or min(c[1], d[1]) > max(a[1], b[1]):
        return False
    return not _is_same_side(_turn(a, b, c), _turn(a, b, d)) and not _is_same_side(_turn(c, d, a), _turn(c, d, b))


def _is_same_side(one: float, other: float) -> bool:
    return (one > 0 and other > 0) or (one < 0 and other < 0)


def _turn(a: _Point, b: _Point, c: _Point) -> float:
    """Above 0 where the path from ``a`` over ``b`` to ``c`` turns left, 0 where it is straight."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
