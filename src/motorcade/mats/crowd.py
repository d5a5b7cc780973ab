"""Places for many cars at once: in rows or anyhow, clear of what stands there, some of them leaders."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motorcade.engine.errors import MatError

Points = NDArray[np.float64]
IsFree = Callable[[Points, Points], NDArray[np.bool_]]
_MOST_PLACES = 1 << 24
_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class Crowd:
    """``cars`` cars in the area from ``corner_m``, of ``size_m``, their centres ``spacing_m`` apart or more.

    ``anyhow`` has them stand at random instead of in rows; ``heading`` is in radians, None for a
    random one each; ``seed`` is what that randomness begins with. ``mat`` and ``place`` are for
    errors: what the mat is called, and where in it the crowd stands.
    """

    mat: str
    place: str
    cars: int
    leaders: int
    corner_m: tuple[float, float]
    size_m: tuple[float, float]
    spacing_m: float
    anyhow: bool
    heading: float | None
    seed: int


def place_crowd(crowd: Crowd, is_free: IsFree) -> tuple[Points, Points, Points, NDArray[np.bool_]]:
    """x, y, heading (radians) and whether it leads, for each car of ``crowd``.

    Args:
        crowd: who stands where.
        is_free: says of points (x, y) whether a car of the crowd may stand there.

    Raises:
        MatError: they don't find room, or lead more than there are.
    """
    if crowd.leaders > crowd.cars:
        raise MatError("too-many-leaders", mat=crowd.mat, place=crowd.place, leaders=crowd.leaders, cars=crowd.cars)
    # The legacy generator: NumPy keeps its stream the same for ever.
    dice = np.random.RandomState(crowd.seed)
    x_m, y_m = _anyhow(crowd, is_free, dice) if crowd.anyhow else _in_rows(crowd, is_free)
    heading = (
        np.full(crowd.cars, crowd.heading) if crowd.heading is not None else dice.random_sample(crowd.cars) * math.tau
    )
    leads = np.zeros(crowd.cars, np.bool_)
    leads[_spread(x_m, y_m, crowd.leaders)] = True
    return x_m, y_m, heading, leads


def _in_rows(crowd: Crowd, is_free: IsFree) -> tuple[Points, Points]:
    """The lowest free places of a grid, row by row from the left."""
    columns, most_rows = _fitting(crowd, crowd.spacing_m)
    most_rows = min(most_rows, _MOST_PLACES // max(columns, 1))
    rows = -(-crowd.cars // max(columns, 1))
    free = 0
    while columns and most_rows:
        rows = min(rows, most_rows)
        row, column = np.divmod(np.arange(rows * columns), columns)
        x_m = crowd.corner_m[0] + (column + 0.5) * crowd.spacing_m
        y_m = crowd.corner_m[1] + (row + 0.5) * crowd.spacing_m
        places = np.flatnonzero(is_free(x_m, y_m))
        free = len(places)
        if free >= crowd.cars:
            places = places[: crowd.cars]
            return x_m[places], y_m[places]
        if rows == most_rows:
            break
        rows *= 2
    raise _no_room(crowd, free)


def _anyhow(crowd: Crowd, is_free: IsFree, dice: np.random.RandomState) -> tuple[Points, Points]:
    """Random places in cells that are as large as can be, in each of them one car or none."""
    width, height = crowd.size_m
    side = max(crowd.spacing_m, min(math.sqrt(width * height / crowd.cars), width, height))
    free = 0
    while True:
        columns, rows = _fitting(crowd, side)
        if not columns or not rows or columns * rows > _MOST_PLACES:
            break
        row, column = np.divmod(np.arange(rows * columns), columns)
        x_m = crowd.corner_m[0] + _jittered(column, width / columns, crowd.spacing_m, dice)
        y_m = crowd.corner_m[1] + _jittered(row, height / rows, crowd.spacing_m, dice)
        places = np.flatnonzero(is_free(x_m, y_m))
        free = max(free, len(places))
        if len(places) >= crowd.cars:
            places = np.sort(dice.permutation(places)[: crowd.cars])
            return x_m[places], y_m[places]
        if side == crowd.spacing_m:
            break
        side = max(crowd.spacing_m, side * 0.9)
    raise _no_room(crowd, free)


def _fitting(crowd: Crowd, side_m: float) -> tuple[int, int]:
    """How many columns and rows of cells, ``side_m`` wide, the crowd's area holds."""
    width, height = crowd.size_m
    return int(width / side_m + _ROUNDING), int(height / side_m + _ROUNDING)


def _jittered(cell: NDArray[np.int64], side_m: float, spacing_m: float, dice: np.random.RandomState) -> Points:
    """A random place in each cell, half of ``spacing_m`` or more from its edges."""
    return cell * side_m + spacing_m / 2 + dice.random_sample(len(cell)) * max(side_m - spacing_m, 0.0)


def _no_room(crowd: Crowd, free: int) -> MatError:
    width, height = crowd.size_m
    figures = {"free": free, "cars": crowd.cars, "width": width, "height": height, "spacing": crowd.spacing_m}
    return MatError("no-room", mat=crowd.mat, place=crowd.place, **figures)


def _spread(x_m: Points, y_m: Points, count: int) -> NDArray[np.intp]:
    """``count`` points spread evenly: the middle one of each of ``count`` blocks that hold equally many points."""
    if count == 0:
        return np.zeros(0, np.intp)
    width, height = np.ptp(x_m) + _ROUNDING, np.ptp(y_m) + _ROUNDING
    bands = min(max(round(math.sqrt(count * height / width)), 1), count)
    points = len(x_m)
    band = np.empty(points, np.int64)
    band[np.argsort(y_m, kind="stable")] = np.arange(points) * bands // points
    # Every other band backwards, so that a block which ends one band and begins the next stays in one place.
    order = np.lexsort((np.where(band % 2, -x_m, x_m), band))
    block = np.arange(points) * count // points
    size = np.bincount(block)
    across = x_m[order] - (np.bincount(block, x_m[order]) / size)[block]
    up = y_m[order] - (np.bincount(block, y_m[order]) / size)[block]
    by_distance = np.lexsort((across * across + up * up, block))
    return order[by_distance[np.searchsorted(block, np.arange(count))]]
