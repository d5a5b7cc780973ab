"""For each cell of a mat, list the walls and obstacles that can matter to a car in it, the nearest first."""

import math

from motorcade.engine.cells import COLUMNS, ORIGIN_X, ORIGIN_Y, PER_UM, ROWS
from motorcade.engine.decorators import in_kernel
from motorcade.engine.geometry import nearest_of_segment
from motorcade.engine.state import Place

# What rounding of a distance and of the corner of a cell can make, µm.
_ROUNDING_UM = 2.0
_HALF_DIAGONAL = math.sqrt(0.5)
# Where nothing stands there, there are 0 cells a µm.
_LEAST_PER_UM = 1e-12


@in_kernel
def each_near(reach: float, fills: bool, place: Place) -> None:
    """Count what is near each cell in ``first[cell + 1]``, or put it at ``first[cell]``, which moves on."""
    frame, first, segments = place.frame, place.first, place.segments.shape[0]
    left, bottom, columns = float(frame[ORIGIN_X]), float(frame[ORIGIN_Y]), int(frame[COLUMNS])
    per_um = float(frame[PER_UM])
    side = 1.0 / max(per_um, _LEAST_PER_UM)
    margin = side * _HALF_DIAGONAL + _ROUNDING_UM
    for item in range(segments + place.discs.shape[0]):
        # A disc is a wall from its middle to its middle, with a radius.
        if item < segments:
            wall = place.segments[item]
            x0, y0, x1, y1, radius = float(wall[0]), float(wall[1]), float(wall[2]), float(wall[3]), 0.0
        else:
            disc = place.discs[item - segments]
            x0, y0, x1, y1, radius = float(disc[0]), float(disc[1]), float(disc[0]), float(disc[1]), float(disc[2])
        near = radius + reach
        first_column = math.floor((min(x0, x1) - near - left) * per_um)
        last_column = math.floor((max(x0, x1) + near - left) * per_um)
        first_row = math.floor((min(y0, y1) - near - bottom) * per_um)
        last_row = math.floor((max(y0, y1) + near - bottom) * per_um)
        for row in range(first_row, last_row + 1):
            y = (row + 0.5) * side + bottom
            for column in range(first_column, last_column + 1):
                x = (column + 0.5) * side + left
                near_x, near_y = nearest_of_segment(x, y, x0, y0, x1, y1)
                middle = math.sqrt((x - near_x) * (x - near_x) + (y - near_y) * (y - near_y)) - radius
                # No point of the cell is nearer.
                away = max(middle - margin, 0.0)
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


"""Make the kernel ``count_walls``."""


def count_walls(reach: float, place: Place) -> None:
    """Count the walls and obstacles within ``reach`` of each cell."""
    count_near(reach, place)


"""Make the kernel ``list_walls``."""


def list_walls(reach: float, place: Place) -> None:
    """List the walls and obstacles within ``reach`` of each cell, after ``count_walls``."""
    list_near(reach, place)
