"""Place many cars at once: in rows or at random, clear of obstacles, some of them leaders."""

import math
from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import chain, compress, count
from operator import add
from random import Random

from motorcade.config.check import Text
from motorcade.errors import MatError, MotorcadeError
from motorcade.mats.geometry import Budget, PointRow, SweepLine

_Positions = tuple["array[float]", "array[float]"]
_MOST_PLACES = 1 << 24
_ROUNDING = 1e-9
# Places of a grid whose row has no obstacle cost as much as one test of a point.
_PLACES_A_TEST = 64
_RANDOM_WORDS = 624


@dataclass(frozen=True, slots=True)
class Crowd:
    """Cars in an area, as a mat's file tells them.

    Attributes:
        file: what errors call the mat.
        place: the crowd's place in the file, for errors.
        cars, leaders: how many cars there are, and how many of them lead.
        corner_m, size_m: the area's lower left corner, and its width and height.
        spacing_m: the least distance between two cars' centres.
        placement: ``grid`` or ``random``.
        heading_deg: ``random``: each car has a random one.
        seed: of the random numbers.
    """

    file: Text
    place: str
    cars: int
    leaders: int
    corner_m: Sequence[float]
    size_m: Sequence[float]
    spacing_m: float
    placement: str
    heading_deg: float | str
    seed: int


def place_crowd(
    crowd: Crowd, sweep: Callable[[], SweepLine], budget: Budget
) -> tuple["array[float]", "array[float]", "array[float]", bytes]:
    """Find x, y, heading (radians) and whether it leads (0 or 1), for each car of ``crowd``.

    Each ``sweep`` finds the points where no car of the crowd may stand. Raises MotorcadeError where there isn't room
    for all cars, where to find it takes more work than ``budget`` has, or where there are more leaders than cars.
    """
    if crowd.leaders > crowd.cars:
        details = {"place": crowd.place, "leaders": crowd.leaders, "cars": crowd.cars}
        raise MatError("crowd-has-too-many-leaders", file=crowd.file, **details)
    generator = _generator(crowd.seed)
    if crowd.placement == "random":
        x_m, y_m = _at_random(crowd, sweep, budget, generator)
    else:
        x_m, y_m = _in_rows(crowd, sweep(), budget)
    if isinstance(crowd.heading_deg, str):
        random = generator.random
        heading = array("d", [random() * math.tau for _ in range(crowd.cars)])
    else:
        heading = array("d", [math.radians(crowd.heading_deg)]) * crowd.cars
    leads = bytearray(crowd.cars)
    for car in _spread(x_m.tolist(), y_m.tolist(), crowd.leaders):
        leads[car] = 1
    return x_m, y_m, heading, bytes(leads)


def _generator(seed: int) -> Random:
    """A Mersenne Twister that begins as the reference implementation does (init_genrand, Matsumoto and Nishimura 2002).

    `random.seed` begins in another way, and `Random.shuffle` draws in another way than `_shuffle`: with either, the
    crowds of all mats there are, and so the runs of missions, would change.
    """
    words = [seed]
    for number in range(1, _RANDOM_WORDS):
        words.append((1812433253 * (words[-1] ^ words[-1] >> 30) + number) & 0xFFFFFFFF)
    generator = Random(0)
    generator.setstate((3, (*words, _RANDOM_WORDS), None))
    return generator


def _in_rows(crowd: Crowd, sweep: SweepLine, budget: Budget) -> _Positions:
    """Take the lowest free places of a grid, row by row from the left."""
    columns, rows = _fitting(crowd, crowd.spacing_m)
    corner_x, corner_y = crowd.corner_m
    budget.take(columns)
    across = array("d", [corner_x + (column + 0.5) * crowd.spacing_m for column in range(columns)])
    x_m = array("d")
    y_m = array("d")
    for row in range(min(rows, _MOST_PLACES // max(columns, 1))):
        budget.take(1 + columns // _PLACES_A_TEST)
        y = corner_y + (row + 0.5) * crowd.spacing_m
        free = across
        if sweep.reaches(y, y):
            free = array("d", compress(across, _free(sweep, (y, y, across, [y] * columns))))
        x_m += free[: crowd.cars - len(x_m)]
        y_m += array("d", [y]) * (len(x_m) - len(y_m))
        if len(x_m) == crowd.cars:
            return x_m, y_m
    raise _no_room(crowd, len(x_m))


def _at_random(crowd: Crowd, sweep: Callable[[], SweepLine], budget: Budget, generator: Random) -> _Positions:
    """Take random places in the cells of a grid that is as coarse as possible, at most one in each cell."""
    width, height = crowd.size_m
    corner_x, corner_y = crowd.corner_m
    random = generator.random
    side = max(crowd.spacing_m, min(math.sqrt(width * height / crowd.cars), width, height))
    most_free = 0
    while True:
        columns, rows = _fitting(crowd, side)
        if not columns or not rows or columns * rows > min(_MOST_PLACES, budget.left):
            break
        budget.take(columns * rows)
        x_rows = _jittered(corner_x, [[*range(columns)]] * rows, width / columns, crowd.spacing_m, random)
        y_rows = _jittered(corner_y, [[row] * columns for row in range(rows)], height / rows, crowd.spacing_m, random)
        here = sweep()
        places = [
            place
            for row, (x_m, y_m) in enumerate(zip(x_rows, y_rows, strict=True))
            for place in compress(count(row * columns), _free(here, (min(y_m), max(y_m), x_m, y_m)))
        ]
        most_free = max(most_free, len(places))
        if len(places) >= crowd.cars:
            _shuffle(places, generator)
            chosen = sorted(places[: crowd.cars])
            x_m, y_m = (array("d", chain.from_iterable(rows)) for rows in (x_rows, y_rows))
            return array("d", map(x_m.__getitem__, chosen)), array("d", map(y_m.__getitem__, chosen))
        if side == crowd.spacing_m:
            break
        side = max(crowd.spacing_m, side * 0.9)
    raise _no_room(crowd, most_free)


def _fitting(crowd: Crowd, side_m: float) -> tuple[int, int]:
    """How many columns and rows of cells, ``side_m`` wide, the crowd's area holds."""
    width, height = crowd.size_m
    return int(width / side_m + _ROUNDING), int(height / side_m + _ROUNDING)


def _jittered(
    corner_m: float, cells: list[list[int]], side_m: float, spacing_m: float, random: Callable[[], float]
) -> list[list[float]]:
    """A random place in each cell, at least half of ``spacing_m`` from its edges."""
    low_m = spacing_m / 2
    width_m = max(side_m - spacing_m, 0.0)
    return [[corner_m + (cell * side_m + low_m + random() * width_m) for cell in row] for row in cells]


def _free(sweep: SweepLine, row: PointRow) -> bytearray:
    """For each point of a row 1 where a car may stand there, else 0."""
    free = bytearray(b"\1") * len(row[-1])
    for _, first, end in sweep.touched(row):
        free[first:end] = bytes(end - first)
    return free


def _shuffle(values: list[int], generator: Random) -> None:
    """Shuffle by Fisher and Yates' method, from the end; `Random.shuffle` may change with Python's version."""
    for last in range(len(values) - 1, 0, -1):
        mask = (1 << last.bit_length()) - 1
        other = generator.getrandbits(32) & mask
        while other > last:
            other = generator.getrandbits(32) & mask
        values[last], values[other] = values[other], values[last]


def _no_room(crowd: Crowd, free: int) -> MotorcadeError:
    width, height = crowd.size_m
    details = {"free": free, "cars": crowd.cars, "width": width, "height": height, "spacing": crowd.spacing_m}
    return MatError("crowd-has-no-room", file=crowd.file, place=crowd.place, **details)


def _spread(x_m: list[float], y_m: list[float], leaders: int) -> list[int]:
    """Choose ``leaders`` points evenly: the middle one of each of ``leaders`` blocks of equally many points."""
    if leaders == 0:
        return []
    points = len(x_m)
    width = max(x_m) - min(x_m) + _ROUNDING
    height = max(y_m) - min(y_m) + _ROUNDING
    bands = min(max(round(math.sqrt(leaders * height / width)), 1), leaders)
    upwards = sorted(range(points), key=y_m.__getitem__)
    order: list[int] = []
    for band in range(bands):
        # Every other band runs backwards, so that the points of a block that lies in two bands are near each other.
        inside = sorted(upwards[-(-band * points // bands) : -(-(band + 1) * points // bands)])
        inside.sort(key=x_m.__getitem__ if band % 2 == 0 else lambda point: -x_m[point])
        order += inside
    chosen = []
    for block in range(leaders):
        members = order[-(-block * points // leaders) : -(-(block + 1) * points // leaders)]
        # Not `sum`, whose rounding depends on Python's version.
        middle_x = reduce(add, map(x_m.__getitem__, members), 0.0) / len(members)
        middle_y = reduce(add, map(y_m.__getitem__, members), 0.0) / len(members)
        chosen.append(_nearest(members, x_m, y_m, middle_x, middle_y))
    return chosen


def _nearest(points: list[int], x_m: list[float], y_m: list[float], x: float, y: float) -> int:
    return min(points, key=lambda point: (x_m[point] - x) * (x_m[point] - x) + (y_m[point] - y) * (y_m[point] - y))
