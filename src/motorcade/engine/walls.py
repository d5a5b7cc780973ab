"""For each cell of a mat, list the walls and obstacles that can matter to a car in it, the nearest first."""

import math

from motorcade.engine.cells import COLUMNS, ORIGIN_X, ORIGIN_Y, PER_UM, ROWS
from motorcade.engine.geometry import nearest_of_segment
from motorcade.engine.marking import in_kernel
from motorcade.engine.state import Place

# What rounding of a distance and of the corner of a cell can make, µm.
_ROUNDING_UM = 2.0
_HALF_DIAGONAL = math.sqrt(0.5)
# Where nothing stands there, there are 0 cells a µm.
_LEAST_PER_UM = 1e-12


@in_kernel
def bounds(item: int, reach: float, place: Place) -> tuple[int, int, int, int]:
    """The first and last column, and the first and last row, that a wall or an obstacle comes within ``reach`` of."""
    segments, frame = place.segments.shape[0], place.frame
    if item < segments:
        wall = place.segments[item]
        left, right = min(wall[0], wall[2]), max(wall[0], wall[2])
        bottom, top = min(wall[1], wall[3]), max(wall[1], wall[3])
    else:
        disc = place.discs[item - segments]
        left, right = disc[0] - disc[2], disc[0] + disc[2]
        bottom, top = disc[1] - disc[2], disc[1] + disc[2]
    return (
        math.floor((left - reach - frame[ORIGIN_X]) * frame[PER_UM]),
        math.floor((right + reach - frame[ORIGIN_X]) * frame[PER_UM]),
        math.floor((bottom - reach - frame[ORIGIN_Y]) * frame[PER_UM]),
        math.floor((top + reach - frame[ORIGIN_Y]) * frame[PER_UM]),
    )


@in_kernel
def distance(item: int, x: float, y: float, place: Place) -> float:
    """The distance of a point from a wall or an obstacle; below 0 inside the latter."""
    segments = place.segments.shape[0]
    if item < segments:
        wall = place.segments[item]
        near_x, near_y = nearest_of_segment(x, y, wall[0], wall[1], wall[2], wall[3])
        return math.sqrt((x - near_x) * (x - near_x) + (y - near_y) * (y - near_y))
    disc = place.discs[item - segments]
    return float(math.sqrt((x - disc[0]) * (x - disc[0]) + (y - disc[1]) * (y - disc[1])) - disc[2])


@in_kernel
def each_near(reach: float, fills: bool, place: Place) -> None:
    """Count what is near each cell in ``first[cell + 1]``, or put it at ``first[cell]``, which moves on."""
    frame, first = place.frame, place.first
    columns, side = int(frame[COLUMNS]), 1.0 / max(frame[PER_UM], _LEAST_PER_UM)
    for item in range(place.segments.shape[0] + place.discs.shape[0]):
        first_column, last_column, first_row, last_row = bounds(item, reach, place)
        for row in range(first_row, last_row + 1):
            y = (row + 0.5) * side + frame[ORIGIN_Y]
            for column in range(first_column, last_column + 1):
                x = (column + 0.5) * side + frame[ORIGIN_X]
                # No point of the cell is nearer.
                away = max(distance(item, x, y, place) - side * _HALF_DIAGONAL - _ROUNDING_UM, 0.0)
                if away > reach:
                    continue
                cell = row * columns + column
                if fills:
                    k = first[cell]
                    place.items[k] = item
                    place.away[k] = away
                    first[cell] = k + 1
                else:
                    first[cell + 1] += 1


@in_kernel
def count_near(reach: float, place: Place) -> None:
    """Fill ``place.first``; its last number is then how many items all lists have."""
    first, cells = place.first, int(place.frame[COLUMNS]) * int(place.frame[ROWS])
    for cell in range(cells + 1):
        first[cell] = 0
    each_near(reach, False, place)
    for cell in range(cells):
        first[cell + 1] += first[cell]


@in_kernel
def list_near(reach: float, place: Place) -> None:
    """Fill ``place.items`` and ``place.away``, after `count_near`."""
    first, items, away = place.first, place.items, place.away
    cells = int(place.frame[COLUMNS]) * int(place.frame[ROWS])
    each_near(reach, True, place)
    for cell in range(cells, 0, -1):
        first[cell] = first[cell - 1]
    first[0] = 0
    for cell in range(cells):
        # Lists are short.
        for k in range(first[cell] + 1, first[cell + 1]):
            item, near, at = items[k], away[k], k
            while at > first[cell] and away[at - 1] > near:
                items[at], away[at] = items[at - 1], away[at - 1]
                at -= 1
            items[at], away[at] = item, near
