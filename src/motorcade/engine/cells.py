"""Square cells, so that what is near a place is found quickly.

The cars of a world are sorted by them (a counting sort). For each cell of a mat, the walls and obstacles that can
matter to a car in it are listed, the nearest first.
"""

import math

from motorcade.engine.backend import in_kernel
from motorcade.engine.state import Arrays, CarArrays, Cells, Floats, Now, Obstacles, Words
from motorcade.mats.plane import nearest_of_segment

ORIGIN_X, ORIGIN_Y, PER_UM, COLUMNS, ROWS = range(5)
# So many cars, one after the other in the arrays, rest together.
GROUP = 32
# What rounding of a distance and of the corner of a cell can make, µm.
_ROUNDING_UM = 2.0
_HALF_DIAGONAL = math.sqrt(0.5)
# Where nothing stands there, there are 0 cells a µm.
_LEAST_PER_UM = 1e-12


@in_kernel
def cell_at(length: float, origin: float, per_um: float, most: int) -> int:
    """The column or row of a coordinate, 0 to ``most`` - 1; places outside belong to the border."""
    return int(min(max((length - origin) * per_um, 0.0), float(most - 1)))


@in_kernel
def cell_of(x: float, y: float, frame: Floats) -> int:
    """The cell of a place."""
    columns = int(frame[COLUMNS])
    column = cell_at(x, frame[ORIGIN_X], frame[PER_UM], columns)
    return cell_at(y, frame[ORIGIN_Y], frame[PER_UM], int(frame[ROWS])) * columns + column


@in_kernel
def cells_around(x: float, y: float, wide: float, frame: Floats) -> tuple[int, int, int, int, int]:
    """The columns and rows of cells within ``wide`` of a place (left, right, bottom, top), and how many columns."""
    return cells_between(x, y, x, y, wide, frame)


@in_kernel
def cells_between(
    low_x: float, low_y: float, high_x: float, high_y: float, wide: float, frame: Floats
) -> tuple[int, int, int, int, int]:
    """The columns and rows of cells within ``wide`` of a rectangle (left, right, bottom, top), and how many columns."""
    columns = int(frame[COLUMNS])
    rows = int(frame[ROWS])
    left = cell_at(low_x - wide, frame[ORIGIN_X], frame[PER_UM], columns)
    right = cell_at(high_x + wide, frame[ORIGIN_X], frame[PER_UM], columns)
    bottom = cell_at(low_y - wide, frame[ORIGIN_Y], frame[PER_UM], rows)
    top = cell_at(high_y + wide, frame[ORIGIN_Y], frame[PER_UM], rows)
    return left, right, bottom, top, columns


@in_kernel
def fit(world: int, begin: int, end: int, cars: CarArrays, cells: Cells, side: float) -> None:
    """Divide the rectangle around the cars of a world into cells ``side`` wide (µm); wider if there are too many."""
    low_x = cars.x[begin]
    high_x = cars.x[begin]
    low_y = cars.y[begin]
    high_y = cars.y[begin]
    for i in range(begin + 1, end):
        low_x, high_x = min(low_x, cars.x[i]), max(high_x, cars.x[i])
        low_y, high_y = min(low_y, cars.y[i]), max(high_y, cars.y[i])
    width = float(high_x) - float(low_x)
    height = float(high_y) - float(low_y)
    most = cells.first.shape[1] - 1
    columns = math.floor(width / side) + 1
    rows = math.floor(height / side) + 1
    while columns * rows > most:
        side = side * 1.125
        columns = math.floor(width / side) + 1
        rows = math.floor(height / side) + 1
    frame = cells.frame[world]
    frame[ORIGIN_X] = low_x
    frame[ORIGIN_Y] = low_y
    frame[PER_UM] = 1.0 / side
    frame[COLUMNS] = columns
    frame[ROWS] = rows


@in_kernel
def order_by_cell(world: int, begin: int, end: int, cars: CarArrays, cells: Cells) -> None:
    """Fill ``cars.order`` (for each new index the old one, cell by cell, stable) and ``cells.first``."""
    frame = cells.frame[world]
    first = cells.first[world]
    count = int(frame[COLUMNS]) * int(frame[ROWS])
    for c in range(count + 1):
        first[c] = 0
    for i in range(begin, end):
        cell = cell_of(float(cars.x[i]), float(cars.y[i]), frame)
        cars.push[i] = cell
        first[cell] += 1
    total = begin
    for c in range(count):
        size = first[c]
        first[c] = total
        total += size
    for i in range(begin, end):
        cell = cars.push[i]
        cars.order[first[cell]] = i
        first[cell] += 1
    for c in range(count, 0, -1):
        first[c] = first[c - 1]
    first[0] = begin


@in_kernel
def is_in_order(begin: int, end: int, cars: CarArrays) -> bool:
    """Whether ``cars.order`` leaves all cars where they are."""
    others = 0
    for i in range(begin, end):
        others |= int(cars.order[i]) ^ i
    return others == 0


@in_kernel
def wake_all(begin: int, end: int, share: int, arrays: Arrays) -> None:
    """Let no group of the cars between two indices rest."""
    for group in range((end - begin + GROUP - 1) // GROUP):
        arrays.around.wakes[share, group] = 0


@in_kernel
def disturb(i: int, arrays: Arrays, now: Now) -> None:
    """Let the group of car ``i``, which may be due sooner than was known, find out anew for how long it rests."""
    wakes = arrays.around.wakes
    group = (i - now.begin) // GROUP
    if wakes[now.share, group] > now.tick + 1:
        wakes[now.share, group] = 0


@in_kernel
def fields(cars: CarArrays) -> int:
    """How many fields of a car have to be moved when cars are sorted."""
    return int(cars.rows.shape[0]) + 2


@in_kernel
def gather(low: int, high: int, field: int, scratch: Words, cars: CarArrays) -> None:
    """Collect the sorted values of a field in ``scratch``, which may be ``cars.push``."""
    rows = cars.rows.shape[0]
    for i in range(low, high):
        if field < rows:
            scratch[i] = cars.rows[field, cars.order[i]]
        elif field == rows:
            scratch[i] = cars.wheels[cars.order[i]]
        else:
            scratch[i] = cars.program[cars.order[i]]


@in_kernel
def put_back(low: int, high: int, field: int, scratch: Words, cars: CarArrays) -> None:
    """Write the values that ``gather`` collected back into the field."""
    rows = cars.rows.shape[0]
    for i in range(low, high):
        if field < rows:
            cars.rows[field, i] = scratch[i]
        elif field == rows:
            cars.wheels[i] = scratch[i]
        else:
            cars.program[i] = scratch[i]


@in_kernel
def clear_push(low: int, high: int, cars: CarArrays) -> None:
    """Set the pushes to zero after a sort, which uses them as scratch."""
    for i in range(low, high):
        cars.push[i] = 0


@in_kernel
def _each_near(reach: float, fills: bool, obstacles: Obstacles) -> None:
    """Count what is near each cell in ``first[cell + 1]``, or put it at ``first[cell]``, which moves on."""
    frame = obstacles.frame
    first = obstacles.first
    segments = obstacles.segments.shape[0]
    left = float(frame[ORIGIN_X])
    bottom = float(frame[ORIGIN_Y])
    columns = int(frame[COLUMNS])
    per_um = float(frame[PER_UM])
    side = 1.0 / max(per_um, _LEAST_PER_UM)
    margin = side * _HALF_DIAGONAL + _ROUNDING_UM
    for item in range(segments + obstacles.discs.shape[0]):
        # A disc is a wall from its middle to its middle, with a radius.
        if item < segments:
            wall = obstacles.segments[item]
            x0 = float(wall[0])
            y0 = float(wall[1])
            x1 = float(wall[2])
            y1 = float(wall[3])
            radius = 0.0
        else:
            disc = obstacles.discs[item - segments]
            x0 = float(disc[0])
            y0 = float(disc[1])
            x1 = float(disc[0])
            y1 = float(disc[1])
            radius = float(disc[2])
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
                    obstacles.items[k] = item
                    obstacles.away[k] = away
                    first[cell] = k + 1
                else:
                    first[cell + 1] += 1


def count_walls(reach: float, obstacles: Obstacles) -> None:
    """Count the walls and obstacles within ``reach`` of each cell: fill ``obstacles.first``.

    Its last number is then how many items all lists have.
    """
    first = obstacles.first
    cells = int(obstacles.frame[COLUMNS]) * int(obstacles.frame[ROWS])
    for cell in range(cells + 1):
        first[cell] = 0
    _each_near(reach, False, obstacles)
    for cell in range(cells):
        first[cell + 1] += first[cell]


def list_walls(reach: float, obstacles: Obstacles) -> None:
    """List the walls and obstacles within ``reach`` of each cell, after ``count_walls``: fill items and away."""
    first = obstacles.first
    items = obstacles.items
    away = obstacles.away
    cells = int(obstacles.frame[COLUMNS]) * int(obstacles.frame[ROWS])
    _each_near(reach, True, obstacles)
    for cell in range(cells, 0, -1):
        first[cell] = first[cell - 1]
    first[0] = 0
    for cell in range(cells):
        # Lists are short.
        for k in range(first[cell] + 1, first[cell + 1]):
            item = items[k]
            near = away[k]
            at = k
            while at > first[cell] and away[at - 1] > near:
                items[at], away[at] = items[at - 1], away[at - 1]
                at -= 1
            items[at] = item
            away[at] = near
