"""Which points are too near to walls and obstacles, or to each other; fast for a million points.

Only what IEEE 754 rounds exactly decides, so that every machine decides alike.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from motorcade.mats.model import Corners, Disc, Wall

Points = NDArray[np.float64]
Flags = NDArray[np.bool_]
_Shape = tuple[str, tuple[float, float, float, float], Callable[[Points, Points], Flags]]

# How many columns and rows apart cells may be to hold points nearer than a cell's diagonal; the rest mirror these.
_NEIGHBOURS = ((0, 1), (0, 2), (1, -2), (1, -1), (1, 0), (1, 1), (1, 2), (2, -1), (2, 0), (2, 1))


def obstructed(
    x_m: Points,
    y_m: Points,
    clearance_m: float,
    walls: Iterable[Wall] = (),
    discs: Iterable[Disc] = (),
    polygons: Iterable[Corners] = (),
) -> Iterator[tuple[str, NDArray[np.intp]]]:
    """The obstacles that points are in, or nearer to than ``clearance_m``.

    Yields each one's place, such as ``wall[2]``, and the indices of those points.
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
    """Two points nearer to each other than ``distance_m``, the lower index first; None where there are none."""
    if len(x_m) < 2:
        return None
    # The cell's diagonal is the distance: either each cell holds one point, or the search is over.
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
            # A ray to the right crosses this side once where it begins inside.
            inside ^= ((y0 > y) != (y1 > y)) & (x < x0 + (y - y0) / (y1 - y0) * (x1 - x0))
    return near | inside
