"""Dark marks on the floor, and what the floor sensors of a car see of them.

A mark is a stretch of a line with round ends, a spot (a stretch without length) or a polygon. All marks of a mat are in
one array of float64, because a kernel gets slower with every array:

    frame       origin x and y (µm), cells a µm, columns, rows
    cells       of each cell, and one behind the last: where in the array its list begins
    lists       of each cell, the marks that are within MARGIN_UM of it: of a stretch half its width, x0, y0, its
                length (µm), and its direction in x and y; of a polygon -1 and where in the array it is. Stretches
                stand in each list anew, since what is near in memory is read faster
    polygons    the number of corners, and x and y of each

The array is empty where there are no marks.
"""

import math
from array import array
from collections.abc import Iterator, Sequence
from itertools import accumulate, chain, islice, pairwise

from motorcade.engine.backend import in_kernel
from motorcade.engine.clearance import MOST_TICKS, whole_ticks
from motorcade.engine.geometry import FAR_UM, cosine, sine
from motorcade.engine.state import DRIVEN, Buffer, Cars, Floor, Rules
from motorcade.errors import MotorcadeError, Phrase
from motorcade.mats import Mat
from motorcade.mats.model import way_of

ORIGIN_X, ORIGIN_Y, PER_UM, COLUMNS, ROWS, CELLS = range(6)
# A sensor in a cell knows of all marks that are nearer than this.
MARGIN_UM = 60_000.0
# With smaller cells, the lists of a road network outgrow a processor's caches.
_CELL_UM = 400_000.0
# Places are whole µm: a place right on an edge is dark, however its distance is rounded.
_TIE_UM = 0.5
# Places and ways are rounded to µm.
_ROUNDED_UM = 3.0
_MOST_CELLS = 1 << 20
# Half a second of work.
_MOST_MARKS = 100_000
_MOST_LISTED = 2_000_000


@in_kernel
def look_down(i: int, cars: Cars, floor: Floor, rules: Rules) -> tuple[int, float, float]:
    """Look at the floor, which has marks.

    Returns:
        Which floor sensors of car ``i`` are over dark (1 left plus 2 right), and how far they can at least move before
        that changes, in µm: in any way, and straight ahead.
    """
    ahead_x, ahead_y = cosine(cars.heading[i], rules.cosines), sine(cars.heading[i], rules.cosines)
    x, y = float(cars.x[i]) + rules.floor_ahead * ahead_x, float(cars.y[i]) + rules.floor_ahead * ahead_y
    aside_x, aside_y = -rules.floor_aside * ahead_y, rules.floor_aside * ahead_x
    left, left_ahead = outside_um(x + aside_x, y + aside_y, ahead_x, ahead_y, floor)
    right, right_ahead = outside_um(x - aside_x, y - aside_y, ahead_x, ahead_y, floor)
    dark = (1 if left <= 0.0 else 0) + (2 if right <= 0.0 else 0)
    return dark, min(abs(left), abs(right)), min(left_ahead, right_ahead)


@in_kernel
def ticks_unchanged(wheels: int, any_um: float, ahead_um: float, rules: Rules) -> int:
    """For how many ticks the floor sensors of a car with ``wheels`` see the same, unless something pushes the car."""
    way, turn = rules.speeds[wheels & 3], abs(float(rules.turns[wheels]))
    if wheels == DRIVEN or rules.wheel_noise > 0.0:
        return whole_ticks((any_um - _ROUNDED_UM) / rules.floor_step)
    if turn > 0.0:
        return whole_ticks((any_um - _ROUNDED_UM) / (turn * rules.floor_turn))
    return whole_ticks((ahead_um - _ROUNDED_UM) / way) if way > 0.0 else MOST_TICKS


@in_kernel
def outside_um(x: float, y: float, ahead_x: float, ahead_y: float, floor: Floor) -> tuple[float, float]:
    """How far a place is from the nearest mark, and how far it can at least move ahead before it crosses an edge.

    Both are at most MARGIN_UM. The first is 0 or less where the place is on a mark: minus the distance to the mark's
    edge, or less where marks overlap. The distance from a stretch is a convex function of the way ahead, so no edge is
    crossed before its tangent is 0.
    """
    x, y = math.floor(x + 0.5), math.floor(y + 0.5)
    column = math.floor((x - floor[ORIGIN_X]) * floor[PER_UM])
    row = math.floor((y - floor[ORIGIN_Y]) * floor[PER_UM])
    if column < 0.0 or row < 0.0 or column >= floor[COLUMNS] or row >= floor[ROWS]:
        return MARGIN_UM, MARGIN_UM
    cell = CELLS + int(row) * int(floor[COLUMNS]) + int(column)
    nearest, ahead = MARGIN_UM, MARGIN_UM
    mark, end = int(floor[cell]), int(floor[cell + 1])
    while mark < end:
        half = floor[mark]
        if half < 0.0:
            outside = _outside_polygon(x, y, int(floor[mark + 1]), floor)
            closing = 1.0
            mark += 2
        else:
            to_x, to_y, length = x - floor[mark + 1], y - floor[mark + 2], floor[mark + 3]
            along_x, along_y = floor[mark + 4], floor[mark + 5]
            part = min(max(to_x * along_x + to_y * along_y, 0.0), length)
            away_x, away_y = to_x - part * along_x, to_y - part * along_y
            mark += 6
            squared, reach = away_x * away_x + away_y * away_y, half + max(nearest, ahead)
            if squared >= reach * reach:
                continue
            distance = math.sqrt(squared)
            outside = distance - half
            closing = 1.0 if outside <= 0.0 else -(away_x * ahead_x + away_y * ahead_y) / distance
        nearest = min(nearest, outside)
        if closing * ahead > abs(outside):
            ahead = abs(outside) / closing
    return nearest, ahead


@in_kernel
def _away(x: float, y: float, x0: float, y0: float, x1: float, y1: float) -> tuple[float, float]:
    """Return the vector to a place from the nearest point of a stretch."""
    along_x, along_y, to_x, to_y = x1 - x0, y1 - y0, x - x0, y - y0
    length, dot = along_x * along_x + along_y * along_y, to_x * along_x + to_y * along_y
    if dot <= 0.0:
        return to_x, to_y
    if dot >= length:
        return x - x1, y - y1
    # Along the normal: exact where the stretch is level or upright.
    aside = (to_x * along_y - to_y * along_x) / length
    return aside * along_y, -aside * along_x


@in_kernel
def _outside_polygon(x: float, y: float, mark: int, floor: Floor) -> float:
    corners = int(floor[mark])
    last = mark + 2 * corners - 1
    x0, y0, inside, nearest = floor[last], floor[last + 1], False, FAR_UM * FAR_UM
    for corner in range(mark + 1, mark + 2 * corners, 2):
        x1, y1 = floor[corner], floor[corner + 1]
        away_x, away_y = _away(x, y, x0, y0, x1, y1)
        nearest = min(nearest, away_x * away_x + away_y * away_y)
        if (y0 > y) != (y1 > y) and x < x0 + (y - y0) / (y1 - y0) * (x1 - x0):
            inside = not inside
        x0, y0 = x1, y1
    return -math.sqrt(nearest) if inside else math.sqrt(nearest)


def floor_of(mat: Mat) -> Buffer:
    """Return the array of the mat's marks. Raises MotorcadeError mat-too-detailed."""
    marks = list(islice(marks_of(mat), _MOST_MARKS + 1))
    if len(marks) > _MOST_MARKS:
        raise MotorcadeError("mat-too-detailed", file=Phrase("mat-named", name=mat.name))
    if not marks:
        return Buffer("float64", (0,), array("d"))
    boxes = [_box(mark) for mark in marks]
    left, bottom = min(box[0] for box in boxes) - MARGIN_UM, min(box[1] for box in boxes) - MARGIN_UM
    right, top = max(box[2] for box in boxes) + MARGIN_UM, max(box[3] for box in boxes) + MARGIN_UM
    side = max(_CELL_UM, math.sqrt((right - left) * (top - bottom) / _MOST_CELLS))
    columns, rows = math.ceil((right - left) / side), math.ceil((top - bottom) / side)
    lists: list[list[int]] = [[] for _ in range(columns * rows)]
    listed = 0
    for number, (mark, box) in enumerate(zip(marks, boxes, strict=True)):
        for row in _cells_between(box[1] - bottom, box[3] - bottom, side, rows):
            low, high = _span(mark, box, bottom + row * side, bottom + (row + 1) * side)
            its_columns = _cells_between(low - left, high - left, side, columns)
            listed += len(its_columns)
            if listed > _MOST_LISTED:
                raise MotorcadeError("mat-too-detailed", file=Phrase("mat-named", name=mat.name))
            for column in its_columns:
                lists[row * columns + column].append(number)
    begin = CELLS + len(lists) + 1
    sizes = [6 if mark[0] >= 0.0 else 2 for mark in marks]
    firsts = list(accumulate((sum(sizes[number] for number in each) for each in lists), initial=begin))
    polygons = [mark for mark in marks if mark[0] < 0.0]
    places = iter(accumulate(map(len, polygons), initial=firsts[-1]))
    listed_as = [mark if mark[0] >= 0.0 else (-1.0, float(next(places))) for mark in marks]
    held = array("d", (left, bottom, 1 / side, columns, rows))
    held.extend(firsts)
    for number in chain.from_iterable(lists):
        held.extend(listed_as[number])
    for corners, *places_of in polygons:
        held.extend((-corners, *places_of))
    return Buffer("float64", (len(held),), held)


def _cells_between(low: float, high: float, side: float, count: int) -> range:
    return range(int((low - MARGIN_UM) / side), min(int((high + MARGIN_UM) / side) + 1, count))


def _span(
    mark: Sequence[float], box: tuple[float, float, float, float], low: float, high: float
) -> tuple[float, float]:
    """Return the least and the greatest x of a mark in a row of cells and the margin below and above it."""
    half = mark[0]
    # Of a level stretch, each row has all.
    if half < 0.0 or abs(mark[5]) < 1e-3:
        return box[0], box[2]
    _, x0, y0, length, along_x, along_y = mark
    reach = half + MARGIN_UM
    ends = [x0 + min(max((y - y0) / along_y, 0.0), length) * along_x for y in (low - reach, high + reach)]
    return min(ends) - half, max(ends) + half


def marks_of(mat: Mat) -> Iterator[tuple[float, ...]]:
    """Yield the mat's marks as the array holds them, in whole µm."""
    for line in mat.lines:
        half = _um(line.width_m / 2) + _TIE_UM
        way = [(_um(x), _um(y)) for x, y in way_of(line)]
        for here, there in pairwise(way):
            yield (half, *here, *_direction(here, there))
    for x, y, radius in mat.spots:
        yield _um(radius) + _TIE_UM, _um(x), _um(y), 0.0, 0.0, 0.0
    for corners in mat.patches:
        yield -float(len(corners)), *(_um(length) for corner in corners for length in corner)


def _direction(here: tuple[float, float], there: tuple[float, float]) -> tuple[float, float, float]:
    length = math.dist(here, there)
    return (length, (there[0] - here[0]) / length, (there[1] - here[1]) / length) if length else (0.0, 0.0, 0.0)


def _um(length_m: float) -> float:
    return float(round(length_m * 1e6))


def _box(mark: Sequence[float]) -> tuple[float, float, float, float]:
    if mark[0] < 0.0:
        return min(mark[1::2]), min(mark[2::2]), max(mark[1::2]), max(mark[2::2])
    half, x0, y0, length, along_x, along_y = mark
    x1, y1 = x0 + length * along_x, y0 + length * along_y
    return min(x0, x1) - half, min(y0, y1) - half, max(x0, x1) + half, max(y0, y1) + half
