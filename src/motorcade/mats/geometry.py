"""Geometry of mats: which points are too near to obstacles or to each other, and which outlines are not valid.

It is fast for a million points. It decides only by operations that IEEE 754 rounds exactly, so that the result is the
same on every computer.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from motorcade.config.check import Text
from motorcade.errors import MotorcadeError
from motorcade.mats.model import Corners, Disc, Mat, Wall
from motorcade.mats.schema import SHORTEST_M

Points = NDArray[np.float64]
Flags = NDArray[np.bool_]
_Shape = tuple[str, tuple[float, float, float, float], Callable[[Points, Points], Flags]]

_SMALLEST_M2 = SHORTEST_M * SHORTEST_M
_SHORTEST_S = 0.001
# Offsets, in columns and rows, of cells that can hold points nearer than a cell's diagonal; the others mirror these.
_NEIGHBOURS = ((0, 1), (0, 2), (1, -2), (1, -1), (1, 0), (1, 1), (1, 2), (2, -1), (2, 0), (2, 1))


def obstructed(
    x_m: Points,
    y_m: Points,
    clearance_m: float,
    walls: Iterable[Wall] = (),
    discs: Iterable[Disc] = (),
    polygons: Iterable[Corners] = (),
) -> Iterator[tuple[str, NDArray[np.intp]]]:
    """Find the obstacles that contain points, or that are nearer to points than ``clearance_m``.

    Yields the place of each, such as ``wall[2]``, and the indices of those points.
    """
    order = np.argsort(x_m, kind="stable")
    x_m, y_m = x_m[order], y_m[order]
    for place, (left, bottom, right, top), touches in _shapes(clearance_m, walls, discs, polygons):
        first, end = np.searchsorted(x_m, (left - clearance_m, right + clearance_m))
        inner = first + np.flatnonzero((y_m[first:end] > bottom - clearance_m) & (y_m[first:end] < top + clearance_m))
        inner = inner[touches(x_m[inner], y_m[inner])]
        if inner.size:
            yield place, order[inner]


def close_pair(x_m: Points, y_m: Points, distance_m: float) -> tuple[int, int] | None:
    """Find two points nearer to each other than ``distance_m``, the lower index first; None where there are none."""
    if len(x_m) < 2:
        return None
    # The diagonal of a cell is distance_m, so two points in one cell are a pair.
    side = distance_m * math.sqrt(0.5)
    column = np.floor((x_m - x_m.min()) / side).astype(np.int64)
    row = np.floor((y_m - y_m.min()) / side).astype(np.int64)
    stride = int(row.max()) + 5
    key = column * stride + row
    order = np.argsort(key, kind="stable")
    key, x_m, y_m = key[order], x_m[order], y_m[order]
    same = np.flatnonzero(key[1:] == key[:-1])
    if same.size:
        return _lowest(order[same], order[same + 1])
    for columns, rows in _NEIGHBOURS:
        wanted = key + (columns * stride + rows)
        other = np.minimum(np.searchsorted(key, wanted), len(key) - 1)
        one = np.flatnonzero(key[other] == wanted)
        other = other[one]
        across, up = x_m[one] - x_m[other], y_m[one] - y_m[other]
        near = across * across + up * up < distance_m * distance_m
        if near.any():
            return _lowest(order[one[near]], order[other[near]])
    return None


def _lowest(one: NDArray[np.intp], other: NDArray[np.intp]) -> tuple[int, int]:
    low, high = np.minimum(one, other), np.maximum(one, other)
    first = int(np.lexsort((high, low))[0])
    return int(low[first]), int(high[first])


def _shapes(
    clearance_m: float, walls: Iterable[Wall], discs: Iterable[Disc], polygons: Iterable[Corners]
) -> Iterator[_Shape]:
    for number, wall in enumerate(walls):
        x0, y0, x1, y1 = wall
        box = (min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1))
        yield f"wall[{number}]", box, partial(_near_segment, wall, clearance_m)
    for number, disc in enumerate(discs):
        x0, y0, radius = disc
        box = (x0 - radius, y0 - radius, x0 + radius, y0 + radius)
        yield f"disc[{number}]", box, partial(_near_disc, disc, clearance_m)
    for number, corners in enumerate(polygons):
        xs, ys = zip(*corners, strict=True)
        box = (min(xs), min(ys), max(xs), max(ys))
        yield f"polygon[{number}]", box, partial(_near_polygon, corners, clearance_m)


def _near_segment(segment: Wall, clearance_m: float, x: Points, y: Points) -> Flags:
    x0, y0, x1, y1 = segment
    along_x, along_y = x1 - x0, y1 - y0
    part = ((x - x0) * along_x + (y - y0) * along_y) / (along_x * along_x + along_y * along_y)
    part = np.clip(part, 0.0, 1.0)
    across, up = x - (x0 + part * along_x), y - (y0 + part * along_y)
    near: Flags = across * across + up * up < clearance_m * clearance_m
    return near


def _near_disc(disc: Disc, clearance_m: float, x: Points, y: Points) -> Flags:
    x0, y0, radius = disc
    near: Flags = (x - x0) * (x - x0) + (y - y0) * (y - y0) < (radius + clearance_m) * (radius + clearance_m)
    return near


def _near_polygon(corners: Corners, clearance_m: float, x: Points, y: Points) -> Flags:
    near = np.zeros(len(x), np.bool_)
    inside = np.zeros(len(x), np.bool_)
    for (x0, y0), (x1, y1) in zip(corners, corners[1:] + corners[:1], strict=True):
        near |= _near_segment((x0, y0, x1, y1), clearance_m, x, y)
        if y0 != y1:
            # A ray to the right from a point inside crosses the sides an odd number of times.
            inside ^= ((y0 > y) != (y1 > y)) & (x < x0 + (y - y0) / (y1 - y0) * (x1 - x0))
    return near | inside


def check_outlines(mat: Mat, file: Text) -> None:
    """Raise MotorcadeError where a wall, a polygon or a path is not valid; the error calls the mat ``file``."""
    if mat.walled and mat.size_m is None:
        raise MotorcadeError("edge-without-size", file=file)
    for number, (x0, y0, x1, y1) in enumerate(mat.walls):
        if (x1 - x0) ** 2 + (y1 - y0) ** 2 < _SMALLEST_M2:
            raise MotorcadeError("wall-without-length", file=file, place=f"wall[{number}]")
    for number, corners in enumerate(mat.polygons):
        if fault := _fault_of(corners):
            code, sides = fault
            raise MotorcadeError(code, file=file, place=f"polygon[{number}].corners_m", **sides)
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
    points = np.array(corners)
    nexts = np.roll(points, -1, axis=0)
    short = np.flatnonzero(((nexts - points) ** 2).sum(axis=1) < _SMALLEST_M2)
    if short.size:
        return "polygon-repeats-corner", {"one": int(short[0]), "other": (int(short[0]) + 1) % len(corners)}
    if np.abs(_turn(points[0], points, nexts)).sum() / 2 < _SMALLEST_M2:
        return "polygon-without-area", {}
    if crossing := _crossing(points, nexts):
        one, other = crossing
        return "polygon-crosses-itself", {"one": one, "other": other}
    return None


def _crossing(begins: Points, ends: Points) -> tuple[int, int] | None:
    """Find two sides of a polygon that meet elsewhere than at their common corner; side k begins at corner k."""
    count = len(begins)
    for side in range(count):
        begin, end = begins[side], ends[side]
        following = (side + 1) % count
        if _turn(begin, end, ends[following]) == 0 and np.dot(end - begin, ends[following] - end) < 0:
            return side, following
        others = np.arange(side + 2, count if side else count - 1)
        if hits := others[_meet(begin, end, begins[others], ends[others])].tolist():
            return side, hits[0]
    return None


def _meet(a: Points, b: Points, c: Points, d: Points) -> NDArray[np.bool_]:
    """Whether the segment from ``a`` to ``b`` meets each of those from ``c`` to ``d``; their ends count."""
    boxes = (np.minimum(a, b) <= np.maximum(c, d)) & (np.minimum(c, d) <= np.maximum(a, b))
    apart = np.sign(_turn(a, b, c)) * np.sign(_turn(a, b, d)) > 0
    beside = np.sign(_turn(c, d, a)) * np.sign(_turn(c, d, b)) > 0
    meet: NDArray[np.bool_] = boxes.all(axis=1) & ~apart & ~beside
    return meet


def _turn(a: Points, b: Points, c: Points) -> Points:
    """Above 0 where the path from ``a`` over ``b`` to ``c`` turns left, 0 where it is straight."""
    ahead, onward = b - a, c - a
    turn: Points = ahead[..., 0] * onward[..., 1] - ahead[..., 1] * onward[..., 0]
    return turn
