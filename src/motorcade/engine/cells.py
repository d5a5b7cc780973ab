"""Sort the cars of a world by square cells, so that the cars near a place are found quickly (a counting sort)."""

import math

from motorcade.engine.decorators import in_kernel
from motorcade.engine.state import Cars, Cells, Floats, Words

ORIGIN_X = 0
ORIGIN_Y = 1
PER_UM = 2
COLUMNS = 3
ROWS = 4


@in_kernel
def cell_at(length: float, origin: float, per_um: float, most: int) -> int:
    """The column or row of a coordinate, 0 to ``most`` - 1; places outside belong to the border."""
    return int(min(max((length - origin) * per_um, 0.0), float(most - 1)))


@in_kernel
def cells_around(x: float, y: float, wide: float, frame: Floats) -> tuple[int, int, int, int, int]:
    """The columns and rows of cells within ``wide`` of a place: left, right, bottom, top; and how many columns are."""
    columns, rows = int(frame[COLUMNS]), int(frame[ROWS])
    left = cell_at(x - wide, frame[ORIGIN_X], frame[PER_UM], columns)
    right = cell_at(x + wide, frame[ORIGIN_X], frame[PER_UM], columns)
    bottom = cell_at(y - wide, frame[ORIGIN_Y], frame[PER_UM], rows)
    top = cell_at(y + wide, frame[ORIGIN_Y], frame[PER_UM], rows)
    return left, right, bottom, top, columns


@in_kernel
def fit(world: int, begin: int, end: int, cars: Cars, cells: Cells, side: float) -> None:
    """Divide the rectangle around the cars of a world into cells ``side`` wide (µm); wider if there are too many."""
    low_x, high_x = cars.x[begin], cars.x[begin]
    low_y, high_y = cars.y[begin], cars.y[begin]
    for i in range(begin + 1, end):
        low_x, high_x = min(low_x, cars.x[i]), max(high_x, cars.x[i])
        low_y, high_y = min(low_y, cars.y[i]), max(high_y, cars.y[i])
    width, height = float(high_x) - float(low_x), float(high_y) - float(low_y)
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
def order_by_cell(world: int, begin: int, end: int, cars: Cars, cells: Cells) -> None:
    """Fill ``cars.order`` (for each new index the old one, cell by cell, stable) and ``cells.first``."""
    frame = cells.frame[world]
    first = cells.first[world]
    columns, rows = int(frame[COLUMNS]), int(frame[ROWS])
    count = columns * rows
    for c in range(count + 1):
        first[c] = 0
    for i in range(begin, end):
        cell = _cell_of(cars, i, frame, columns, rows)
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
def _cell_of(cars: Cars, i: int, frame: Floats, columns: int, rows: int) -> int:
    column = cell_at(float(cars.x[i]), frame[ORIGIN_X], frame[PER_UM], columns)
    return cell_at(float(cars.y[i]), frame[ORIGIN_Y], frame[PER_UM], rows) * columns + column


@in_kernel
def fields(cars: Cars) -> int:
    """How many fields of a car have to be moved when cars are sorted."""
    return int(cars.rows.shape[0]) + 2


@in_kernel
def gather(low: int, high: int, field: int, scratch: Words, cars: Cars) -> None:
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
def put_back(low: int, high: int, field: int, scratch: Words, cars: Cars) -> None:
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
def clear_push(low: int, high: int, cars: Cars) -> None:
    """Set the pushes to zero after a sort, which uses them as scratch."""
    for i in range(low, high):
        cars.push[i] = 0
