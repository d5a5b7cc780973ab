"""What goals ask of cars at a moment, and the answers: one function judges one run or many.

A question is a row: what must be so (a car is in a zone, faces so, shows a lamp, has driven so far), of which cars, and
when. `judge_run` asks all questions of one run at one moment, whose figures `Answers` hold. Python calls it with lists
for a run whose moments a page or a recording shows; the kernel `judge` calls it for each of many worlds, after it has
read their cars. So nothing is decided in two ways. Lengths are metres in single precision, as recordings and pages have
them.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from motorcade.car.brain import lit_led
from motorcade.engine.backend import in_kernel
from motorcade.engine.geometry import FULL_TURN
from motorcade.engine.state import CarArrays, Floats, Ints, Rules, Singles
from motorcade.mats.plane import is_left_of, nearest_of_segment
from motorcade.words.ticks import TICKS_MASK

# What is asked.
INSIDE, OUTSIDE, FACES, LIT, NOT_LIT, TRAVELLED = range(6)
# When a car must be so: at the last moment, at one of its own, at all.
END, SOME_MOMENT, ALWAYS = range(3)

# Columns of Questions.rows. Moments before FROM_MS and after UNTIL_MS don't count. Of the CARS from FIRST_CAR on in
# `who`, NEEDED must be so. A zone is the CORNERS from FIRST_CORNER on, or a disc where there are none.
KIND, WHEN, FROM_MS, UNTIL_MS, NEEDED, FIRST_CAR, CARS, FIRST_CORNER, CORNERS, LED = range(10)
COLUMNS = 10
# Columns of Questions.figures: an angle and how far off it may be in degrees, or the least and the most length; a disc.
WANTED, TOLERANCE, DISC_X, DISC_Y, DISC_RADIUS = range(5)
LEAST, MOST = WANTED, TOLERANCE
FIGURES = 5


class Questions(NamedTuple):
    """What is asked of cars, a row a question."""

    rows: Ints  # (questions, COLUMNS)
    figures: Floats  # (questions, FIGURES)
    corners: Floats  # x and y of each corner, one zone after the other
    who: Ints  # the numbers of cars


class Answers(NamedTuple):
    """How it stands, and what the cars of one world show now. There is a place for each entry of `Questions.who`."""

    # (worlds, 2 * places): 0 where the car is so; how far it drove, for TRAVELLED. Then since when that counts, in ms.
    off: Floats
    before: Singles  # (worlds, 2 * places): where it was at the moment before
    since: Ints  # (worlds, questions): since when as many cars as needed are so, in ms; -1: they aren't
    led: Ints  # (cars,): the LED of each car
    shown: Singles  # (3 * cars,): x of each car, then y, then the heading


@in_kernel
def shown_m(metres: float) -> float:
    """A length as sentences show it, in whole centimetres: what is compared must be what a pupil reads."""
    return math.floor(metres * 100.0 + 0.5) / 100.0


@in_kernel
def apart_m(x0: float, y0: float, x1: float, y1: float) -> float:
    """How far two points are from each other."""
    return math.sqrt((x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0))


@in_kernel
def to_outline_m(corners: Floats | Sequence[float], first: int, count: int, x: float, y: float) -> float:
    """How far a point is from a polygon of ``count`` corners, whose coordinates begin at ``first``; 0 inside."""
    inside, nearest = False, 1e300
    x0, y0 = corners[first + 2 * count - 2], corners[first + 2 * count - 1]
    for k in range(count):
        x1, y1 = corners[first + 2 * k], corners[first + 2 * k + 1]
        if is_left_of(x, y, x0, y0, x1, y1):
            inside = not inside
        near_x, near_y = nearest_of_segment(x, y, x0, y0, x1, y1)
        nearest = min(nearest, apart_m(x, y, near_x, near_y))
        x0, y0 = x1, y1
    return 0.0 if inside else nearest


@in_kernel
def to_disc_m(x: float, y: float, disc_x: float, disc_y: float, radius: float) -> float:
    """How far a point is from a disc; 0 inside."""
    return max(apart_m(x, y, disc_x, disc_y) - radius, 0.0)


@in_kernel
def turned_deg(heading: float, wanted_deg: float) -> float:
    """By how many whole degrees a heading in radians differs from an angle, 0 to 180."""
    turn = heading * (180.0 / math.pi) - wanted_deg + 180.0
    return float(math.floor(abs(turn - 360.0 * math.floor(turn / 360.0) - 180.0) + 0.5))


@in_kernel
def _wide(single: float) -> float:
    """A number of single precision in double precision; Numba's ``float`` alone leaves it as it is."""
    return float(single) * 1.0


def judge(tick: int, cars: CarArrays, rules: Rules, questions: Questions, answers: Answers) -> None:
    """Ask all questions of the cars of each world before a tick, for the next moment of their run."""
    worlds, shown = answers.off.shape[0], answers.shown
    count = cars.x.shape[0] // worlds
    now = tick * rules.tick_ms & TICKS_MASK
    asks_led = False
    for question in range(len(questions.rows)):
        asks_led = asks_led or questions.rows[question][KIND] in (LIT, NOT_LIT)
    for world in range(worlds):
        for i in range(world * count, (world + 1) * count):
            car = cars.number[i]
            shown[car] = float(cars.x[i]) / 1e6
            shown[count + car] = float(cars.y[i]) / 1e6
            heading = float(cars.heading[i]) / float(FULL_TURN) * math.tau
            shown[2 * count + car] = heading - math.tau if heading > math.pi else heading
            if asks_led:
                # The LEDs as the last tick set them.
                answers.led[car] = lit_led(cars.memory[:, i], (now - rules.tick_ms) & TICKS_MASK, rules.levels)
        judge_run(world, now, questions, answers)


@in_kernel
def judge_run(world: int, now: int, questions: Questions, answers: Answers) -> None:
    """Ask all questions of one run, at the moment ``now`` in ms that `Answers.led` and `Answers.shown` hold."""
    off, since, places = answers.off[world], answers.since[world], len(questions.who)
    for question in range(len(questions.rows)):
        row, figures = questions.rows[question], questions.figures[question]
        if row[FROM_MS] <= now <= row[UNTIL_MS]:
            met, when = 0, row[WHEN]
            for place in range(row[FIRST_CAR], row[FIRST_CAR] + row[CARS]):
                car = questions.who[place]
                if row[KIND] == TRAVELLED:
                    driven = shown_m(_drive(world, now, place, car, answers))
                    if figures[LEAST] <= driven <= figures[MOST]:
                        met += 1
                else:
                    # What was always so and no longer is, stays as it is.
                    if when != ALWAYS or off[place] == 0.0:
                        found = _how_far(car, row, figures, questions.corners, answers)
                        if when != SOME_MOMENT or found <= off[place]:
                            off[place] = found
                            off[places + place] = float(now)
                    if off[place] == 0.0:
                        met += 1
            if met < row[NEEDED]:
                since[question] = -1
            elif since[question] < 0:
                since[question] = now


@in_kernel
def _drive(world: int, now: int, place: int, car: int, answers: Answers) -> float:
    """Add up how far a car has driven since the moment before; return how far since the first."""
    off, before, shown = answers.off[world], answers.before[world], answers.shown
    x, y = shown[car], shown[len(answers.led) + car]
    if now > 0:
        off[place] += apart_m(_wide(before[2 * place]), _wide(before[2 * place + 1]), _wide(x), _wide(y))
    before[2 * place] = x
    before[2 * place + 1] = y
    return float(off[place])


@in_kernel
def _how_far(car: int, row: Ints, figures: Floats, corners: Floats, answers: Answers) -> float:
    """How far a car is from being as a question asks; 0 where it is so."""
    kind, count, shown = row[KIND], len(answers.led), answers.shown
    if kind == LIT:
        return 0.0 if answers.led[car] == row[LED] else 1.0
    if kind == NOT_LIT:
        return 1.0 if answers.led[car] == row[LED] else 0.0
    if kind == FACES:
        turned = turned_deg(_wide(shown[2 * count + car]), figures[WANTED])
        return 0.0 if turned <= figures[TOLERANCE] else turned
    x, y = _wide(shown[car]), _wide(shown[count + car])
    if row[CORNERS] > 0:
        apart = to_outline_m(corners, row[FIRST_CORNER], row[CORNERS], x, y)
    else:
        apart = to_disc_m(x, y, figures[DISC_X], figures[DISC_Y], figures[DISC_RADIUS])
    if kind == INSIDE:
        return shown_m(apart)
    return 1.0 if apart == 0.0 else 0.0
