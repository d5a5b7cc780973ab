"""Dark marks on the floor, and what the floor sensors of a car see of them.

A mark is a run of stretches with round ends, one after the other, a spot (a stretch without length) or a polygon. All
marks of a mat are in one array of float64, because a kernel gets slower with every array:

    frame       origin x and y (µm), cells a µm, columns, rows
    cells       of each cell, and one behind the last: where in the array its list begins
    lists       of each cell, where in the array the marks begin that may matter there
    marks       of a run half its width, of a polygon -1; the middle (x, y) and radius of a circle around it; the
                number of its corners, and x and y of each (µm)

The array is empty where there are no marks.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import accumulate, chain, pairwise
from typing import Any, NamedTuple

from motorcade.engine.backend import in_kernel
from motorcade.engine.bodies import ROUNDED_UM, slips
from motorcade.engine.clearance import MOST_TICKS, whole_ticks
from motorcade.engine.geometry import FAR_UM, ahead_of
from motorcade.engine.state import DRIVEN, Buffer, CarArrays, Floor, Rules
from motorcade.errors import MatError, Phrase
from motorcade.mats import Mat
from motorcade.mats.model import path_of
from motorcade.mats.plane import is_left_of

ORIGIN_X, ORIGIN_Y, PER_UM, COLUMNS, ROWS, CELLS = range(6)
_HALF, _X, _Y, _AROUND, _COUNT, _CORNERS = range(6)
# Sensors in a cell know of all marks that are nearer than this.
MARGIN_UM = 60_000.0
# With smaller cells, the lists of a road network outgrow a processor's caches.
_CELL_UM = 400_000.0
# A processor's vector has four.
_MOST_STRETCHES = 4
# Places are whole µm: a place right on an edge is dark, however its distance is rounded.
_TIE_UM = 0.5
# What stands for 0 where something is divided by it.
_LEAST = 1e-9
_MOST_CELLS = 1 << 20
# A second of work.
_MOST_CORNERS = 200_000
_MOST_LISTED = 2_000_000


Corner = tuple[float, float]


class Mark(NamedTuple):
    """A mark in whole µm: half the width of a run of stretches, or -1 for a polygon, and its corners."""

    half: float
    corners: Sequence[Corner]


@in_kernel
def look_down(i: int, cars: CarArrays, floor: Floor, rules: Rules) -> tuple[int, float, float]:
    """Look at the floor, which has marks.

    Returns:
        Which floor sensors of car ``i`` are over dark (1 left plus 2 right), and how far they can at least move before
        that changes, in µm: however it drives, and straight ahead.
    """
    ahead_x, ahead_y = ahead_of(cars.heading[i], rules.cosines)
    x = float(cars.x[i]) + rules.floor_ahead * ahead_x
    y = float(cars.y[i]) + rules.floor_ahead * ahead_y
    aside_x = -rules.floor_aside * ahead_y
    aside_y = rules.floor_aside * ahead_x
    left, right, free = outside_um(x, y, aside_x, aside_y, ahead_x, ahead_y, floor)
    return int(left <= 0.0) + 2 * int(right <= 0.0), min(abs(left), abs(right)), free


@in_kernel
def ticks_unchanged(wheels: int, any_um: float, ahead_um: float, rules: Rules) -> int:
    """For how many ticks the floor sensors of a car with ``wheels`` see the same, unless something pushes the car."""
    length = rules.speeds[wheels & 3]
    turn = abs(float(rules.turns[wheels]))
    if wheels == DRIVEN or slips(wheels, rules):
        return whole_ticks((any_um - ROUNDED_UM) / rules.floor_step)
    if turn > 0.0:
        return whole_ticks((any_um - ROUNDED_UM) / (turn * rules.floor_turn))
    return whole_ticks((ahead_um - ROUNDED_UM) / length) if length > 0.0 else MOST_TICKS


@in_kernel
def outside_um(
    x: float, y: float, aside_x: float, aside_y: float, ahead_x: float, ahead_y: float, floor: Floor
) -> tuple[float, float, float]:
    """How far two sensors are from the nearest mark, and can at least move ahead before one crosses an edge.

    The left one is ``aside`` of (x, y), the right one as far on the other side; both are looked up together, since most
    of the time goes to marks that are too far from either. The results are at most MARGIN_UM. The distance of a sensor
    is 0 or less where it is on a mark: minus the distance to the mark's edge, or less where marks overlap. The distance
    from a stretch is a convex function of the distance ahead, so no edge is crossed before its tangent is 0.
    """
    column = math.floor((x - floor[ORIGIN_X]) * floor[PER_UM])
    row = math.floor((y - floor[ORIGIN_Y]) * floor[PER_UM])
    if column < 0.0 or row < 0.0 or column >= floor[COLUMNS] or row >= floor[ROWS]:
        return MARGIN_UM, MARGIN_UM, MARGIN_UM
    left_x = float(math.floor(x + aside_x + 0.5))
    left_y = float(math.floor(y + aside_y + 0.5))
    right_x = float(math.floor(x - aside_x + 0.5))
    right_y = float(math.floor(y - aside_y + 0.5))
    left = MARGIN_UM
    left_ahead = MARGIN_UM
    right = MARGIN_UM
    right_ahead = MARGIN_UM
    aside = math.sqrt(aside_x * aside_x + aside_y * aside_y) + ROUNDED_UM
    reach = MARGIN_UM + aside
    cell = CELLS + int(row) * int(floor[COLUMNS]) + int(column)
    for listed in range(int(floor[cell]), int(floor[cell + 1])):
        mark = int(floor[listed])
        to_x = x - floor[mark + _X]
        to_y = y - floor[mark + _Y]
        far = floor[mark + _AROUND] + reach
        if to_x * to_x + to_y * to_y >= far * far:
            continue
        half = floor[mark]
        first = mark + _CORNERS
        end = mark + _CORNERS + 2 * int(floor[mark + _COUNT])
        if half < 0.0:
            outside = _outside_polygon(left_x, left_y, first, end, floor)
            left, left_ahead = min(left, outside), min(left_ahead, abs(outside))
            outside = _outside_polygon(right_x, right_y, first, end, floor)
            right, right_ahead = min(right, outside), min(right_ahead, abs(outside))
        else:
            # Without branches, several stretches at an instruction.
            for corner in range(first, end - 2, 2):
                x0 = floor[corner]
                y0 = floor[corner + 1]
                x1 = floor[corner + 2]
                y1 = floor[corner + 3]
                away_x, away_y = _away_from(left_x, left_y, x0, y0, x1, y1)
                left, left_ahead = _nearer(away_x, away_y, half, ahead_x, ahead_y, left, left_ahead)
                away_x, away_y = _away_from(right_x, right_y, x0, y0, x1, y1)
                right, right_ahead = _nearer(away_x, away_y, half, ahead_x, ahead_y, right, right_ahead)
            reach = max(left, left_ahead, right, right_ahead) + aside
    return left, right, min(left_ahead, right_ahead)


@in_kernel
def _away_from(x: float, y: float, x0: float, y0: float, x1: float, y1: float) -> tuple[float, float]:
    """Do the work of `_away` without branches, since a processor can't foresee where on a stretch the nearest point is.

    It isn't exact where a place is right on the stretch.
    """
    along_x = x1 - x0
    along_y = y1 - y0
    to_x = x - x0
    to_y = y - y0
    part = (to_x * along_x + to_y * along_y) / max(along_x * along_x + along_y * along_y, 1.0)
    part = min(max(part, 0.0), 1.0)
    return to_x - part * along_x, to_y - part * along_y


@in_kernel
def _nearer(
    away_x: float, away_y: float, half: float, ahead_x: float, ahead_y: float, nearest: float, ahead: float
) -> tuple[float, float]:
    """Return what a sensor knows, ``nearest`` and ``ahead``, once it has seen a stretch ``away`` from it."""
    distance = math.sqrt(away_x * away_x + away_y * away_y)
    outside = distance - half
    closing = distance if outside <= 0.0 else -(away_x * ahead_x + away_y * ahead_y)
    return min(nearest, outside), min(ahead, abs(outside) * distance / max(closing, _LEAST))


@in_kernel
def _away(x: float, y: float, x0: float, y0: float, x1: float, y1: float) -> tuple[float, float]:
    """Return the vector to a place from the nearest point of a stretch."""
    along_x = x1 - x0
    along_y = y1 - y0
    to_x = x - x0
    to_y = y - y0
    length = along_x * along_x + along_y * along_y
    dot = to_x * along_x + to_y * along_y
    if dot <= 0.0:
        return to_x, to_y
    if dot >= length:
        return x - x1, y - y1
    # Along the normal: exact where the stretch is level or upright.
    aside = (to_x * along_y - to_y * along_x) / length
    return aside * along_y, -aside * along_x


@in_kernel
def _outside_polygon(x: float, y: float, first: int, end: int, floor: Floor) -> float:
    x0 = floor[end - 2]
    y0 = floor[end - 1]
    inside = False
    nearest = FAR_UM * FAR_UM
    for corner in range(first, end, 2):
        x1 = floor[corner]
        y1 = floor[corner + 1]
        away_x, away_y = _away(x, y, x0, y0, x1, y1)
        nearest = min(nearest, away_x * away_x + away_y * away_y)
        if is_left_of(x, y, x0, y0, x1, y1):
            inside = not inside
        x0 = x1
        y0 = y1
    return -math.sqrt(nearest) if inside else math.sqrt(nearest)


def floor_of(mat: Mat, aside_um: float = 0.0) -> Any:
    """Return the buffer of the mat's marks, for sensors that are ``aside_um`` from the middle between them.

    Raises:
        MotorcadeError: mat-too-detailed.
    """
    refused = MatError("mat-too-detailed", file=Phrase("mat-named", name=mat.name))
    marks = list[Mark]()
    corners = 0
    for mark in marks_of(mat):
        marks.append(mark)
        corners += len(mark.corners)
        if corners > _MOST_CORNERS:
            raise refused
    if not marks:
        return Buffer.of("float64", ())
    margin = MARGIN_UM + aside_um + ROUNDED_UM
    boxes = [_box(mark.corners, max(mark.half, 0.0)) for mark in marks]
    left = min(box[0] for box in boxes) - margin
    bottom = min(box[1] for box in boxes) - margin
    right = max(box[2] for box in boxes) + margin
    top = max(box[3] for box in boxes) + margin
    side = max(_CELL_UM, math.sqrt((right - left) * (top - bottom) / _MOST_CELLS))
    columns = math.ceil((right - left) / side)
    rows = math.ceil((top - bottom) / side)
    lists: list[list[int]] = [[] for _ in range(columns * rows)]
    listed = 0
    for number, mark in enumerate(marks):
        reach = max(mark.half, 0.0) + margin
        # A polygon as a whole, a run stretch by stretch.
        for piece in [mark.corners] if mark.half < 0 else pairwise(mark.corners):
            box = _box(piece, reach)
            for row in _cells_between(box[1] - bottom, box[3] - bottom, side, rows):
                low = box[0]
                high = box[2]
                if mark.half >= 0.0:
                    low, high = _span(piece[0], piece[1], reach, bottom + row * side, bottom + (row + 1) * side)
                its_columns = _cells_between(low - left, high - left, side, columns)
                listed += len(its_columns)
                if listed > _MOST_LISTED:
                    raise refused
                for column in its_columns:
                    here = lists[row * columns + column]
                    if here[-1:] != [number]:
                        here.append(number)
    begin = CELLS + len(lists) + 1
    firsts = list(accumulate(map(len, lists), initial=begin))
    places = list(accumulate((_CORNERS + 2 * len(mark.corners) for mark in marks), initial=firsts[-1]))
    held = [left, bottom, 1 / side, columns, rows, *firsts, *(places[number] for number in chain.from_iterable(lists))]
    for mark, (x0, y0, x1, y1) in zip(marks, boxes, strict=True):
        x = (x0 + x1) / 2
        y = (y0 + y1) / 2
        around = max(math.dist((x, y), corner) for corner in mark.corners) + max(mark.half, 0.0)
        held.extend((mark.half, x, y, around, len(mark.corners), *chain.from_iterable(mark.corners)))
    return Buffer.of("float64", held)


def _cells_between(low: float, high: float, side: float, count: int) -> range:
    return range(max(int(low / side), 0), min(int(high / side) + 1, count))


def _span(here: Corner, there: Corner, reach: float, low: float, high: float) -> tuple[float, float]:
    """Return the least and the greatest x of what is within ``reach`` of a stretch in a row of cells."""
    (x0, y0) = here
    (x1, y1) = there
    # Of a level stretch, each row has all.
    if abs(y1 - y0) * 1e3 <= abs(x1 - x0):
        return min(x0, x1) - reach, max(x0, x1) + reach
    slope = (x1 - x0) / (y1 - y0)
    ends = [x0 + (min(max(y, min(y0, y1)), max(y0, y1)) - y0) * slope for y in (low - reach, high + reach)]
    return min(ends) - reach, max(ends) + reach


def marks_of(mat: Mat) -> Iterator[Mark]:
    """Yield the mat's marks."""
    for line in mat.lines:
        for run in _runs([(_um(x), _um(y)) for x, y in path_of(line)]):
            yield Mark(_um(line.width_m / 2) + _TIE_UM, run)
    for x, y, radius in mat.spots:
        yield Mark(_um(radius) + _TIE_UM, [(_um(x), _um(y))] * 2)
    for corners in mat.patches:
        yield Mark(-1.0, [(_um(x), _um(y)) for x, y in corners])


def _runs(path: Sequence[Corner]) -> Iterator[Sequence[Corner]]:
    """Cut a path into runs of at most _MOST_STRETCHES stretches that are about equally long, as a bend's are."""
    run = list(path[:2])
    for there in path[2:]:
        usual = math.dist(run[0], run[1])
        length = math.dist(run[-1], there)
        if len(run) > _MOST_STRETCHES or not usual / 2 <= length <= usual * 2:
            yield run
            run = run[-1:]
        run.append(there)
    yield run


def _um(length_m: float) -> float:
    return float(round(length_m * 1e6))


def _box(corners: Sequence[Corner], reach: float) -> tuple[float, float, float, float]:
    """Return the least x and y, and the greatest, of places within ``reach`` of corners."""
    xs, ys = zip(*corners, strict=True)
    return min(xs) - reach, min(ys) - reach, max(xs) + reach, max(ys) + reach
