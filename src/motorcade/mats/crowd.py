"""Place many cars at once: in rows or at random, clear of obstacles, some of them leaders."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motorcade.config.check import Text
from motorcade.errors import MotorcadeError

Points = NDArray[np.float64]
IsFree = Callable[[Points, Points], NDArray[np.bool_]]
_MOST_PLACES = 1 << 24
_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class Crowd:
    """Cars in an area.

    Attributes:
        file: what errors call the mat.
        place: the crowd's place in the file, for errors.
        cars, leaders: how many cars there are, and how many of them lead.
        corner_m, size_m: the area's lower left corner, and its width and height.
        spacing_m: the least distance between two cars' centres.
        is_random: whether they stand at random instead of in rows.
        heading: in radians; None: each car has a random one.
        seed: of the random numbers.
    """

    file: Text
    place: str
    cars: int
    leaders: int
    corner_m: tuple[float, float]
    size_m: tuple[float, float]
    spacing_m: float
    is_random: bool
    heading: float | None
    seed: int


def place_crowd(crowd: Crowd, is_free: IsFree) -> tuple[Points, Points, Points, NDArray[np.bool_]]:
    """Find x, y, heading (radians) and whether it leads, for each car of ``crowd``.

    ``is_free`` tells for points (x, y) whether a car of the crowd may stand there. Raises MotorcadeError where there
    isn't room for all cars, or there are more leaders than cars.
    """
    if crowd.leaders > crowd.cars:
        details = {"place": crowd.place, "leaders": crowd.leaders, "cars": crowd.cars}
        raise MotorcadeError("crowd-has-too-many-leaders", file=crowd.file, **details)
    # NumPy promises that the numbers of its legacy generator never change.
    random = np.random.RandomState(crowd.seed)
    x_m, y_m = _at_random(crowd, is_free, random) if crowd.is_random else _in_rows(crowd, is_free)
    heading = (
        np.full(crowd.cars, crowd.heading) if crowd.heading is not None else random.random_sample(crowd.cars) * math.tau
    )
    leads = np.zeros(crowd.cars, np.bool_)
    leads[_spread(x_m, y_m, crowd.leaders)] = True
    return x_m, y_m, heading, leads


def _in_rows(crowd: Crowd, is_free: IsFree) -> tuple[Points, Points]:
    """Take the lowest free places of a grid, row by row from the left."""
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


def _at_random(crowd: Crowd, is_free: IsFree, random: np.random.RandomState) -> tuple[Points, Points]:
    """Take random places in the cells of a grid that is as coarse as possible, at most one in each cell."""
    width, height = crowd.size_m
    side = max(crowd.spacing_m, min(math.sqrt(width * height / crowd.cars), width, height))
    free = 0
    while True:
        columns, rows = _fitting(crowd, side)
        if not columns or not rows or columns * rows > _MOST_PLACES:
            break
        row, column = np.divmod(np.arange(rows * columns), columns)
        x_m = crowd.corner_m[0] + _jittered(column, width / columns, crowd.spacing_m, random)
        y_m = crowd.corner_m[1] + _jittered(row, height / rows, crowd.spacing_m, random)
        places = np.flatnonzero(is_free(x_m, y_m))
        free = max(free, len(places))
        if len(places) >= crowd.cars:
            places = np.sort(random.permutation(places)[: crowd.cars])
            return x_m[places], y_m[places]
        if side == crowd.spacing_m:
            break
        side = max(crowd.spacing_m, side * 0.9)
    raise _no_room(crowd, free)


def _fitting(crowd: Crowd, side_m: float) -> tuple[int, int]:
    """How many columns and rows of cells, ``side_m`` wide, the crowd's area holds."""
    width, height = crowd.size_m
    return int(width / side_m + _ROUNDING), int(height / side_m + _ROUNDING)


def _jittered(cell: NDArray[np.int64], side_m: float, spacing_m: float, random: np.random.RandomState) -> Points:
    """A random place in each cell, at least half of ``spacing_m`` from its edges."""
    return cell * side_m + spacing_m / 2 + random.random_sample(len(cell)) * max(side_m - spacing_m, 0.0)


def _no_room(crowd: Crowd, free: int) -> MotorcadeError:
    width, height = crowd.size_m
    details = {"free": free, "cars": crowd.cars, "width": width, "height": height, "spacing": crowd.spacing_m}
    return MotorcadeError("crowd-has-no-room", file=crowd.file, place=crowd.place, **details)


def _spread(x_m: Points, y_m: Points, count: int) -> NDArray[np.intp]:
    """Choose ``count`` points evenly: the middle one of each of ``count`` blocks of equally many points."""
    if count == 0:
        return np.zeros(0, np.intp)
    width, height = np.ptp(x_m) + _ROUNDING, np.ptp(y_m) + _ROUNDING
    bands = min(max(round(math.sqrt(count * height / width)), 1), count)
    points = len(x_m)
    band = np.empty(points, np.int64)
    band[np.argsort(y_m, kind="stable")] = np.arange(points) * bands // points
    # Every other band runs backwards, so that the points of a block that lies in two bands are near each other.
    order = np.lexsort((np.where(band % 2, -x_m, x_m), band))
    block = np.arange(points) * count // points
    size = np.bincount(block)
    across = x_m[order] - (np.bincount(block, x_m[order]) / size)[block]
    up = y_m[order] - (np.bincount(block, y_m[order]) / size)[block]
    by_distance = np.lexsort((across * across + up * up, block))
    return order[by_distance[np.searchsorted(block, np.arange(count))]]
