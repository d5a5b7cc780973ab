"""What goals ask of a car at a moment, and the kernel that asks it of all cars of many worlds.

`motorcade.missions.goals` asks the same of one run, with these functions; the kernel only says who met what, for many
seeds at once. Lengths are metres in single precision, as recordings and pages have them.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from motorcade.car.brain import lit_led
from motorcade.engine.backend import in_kernel
from motorcade.engine.geometry import FULL_TURN, nearest_of_segment
from motorcade.engine.state import CarArrays, Floats, Ints, Rules, Singles
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
    """How it stands. ``off`` and ``before`` have a place for each entry of `Questions.who`."""

    off: Floats  # (worlds, places): 0 where the car is so; how far it drove, for TRAVELLED
    before: Singles  # (worlds, 2 * places): where it was at the moment before
    since: Ints  # (worlds, questions): since when as many cars as needed are so, in ms; -1: they aren't
    where: Ints  # scratch: where each car of a world is in the arrays
    single: Singles  # scratch


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
        if (y0 > y) != (y1 > y) and x < x0 + (y - y0) / (y1 - y0) * (x1 - x0):
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
def replaces(off: float, before: float, when: int) -> bool:
    """Whether how far a car is from being so takes the place of ``before``: at best, or when it first was not so."""
    return when == END or (off <= before if when == SOME_MOMENT else before == 0.0)


@in_kernel
def _wide(single: float) -> float:
    """A number of single precision in double precision; Numba's ``float`` alone leaves it as it is."""
    return float(single) * 1.0


def judge(tick: int, cars: CarArrays, rules: Rules, questions: Questions, answers: Answers) -> None:
    """Ask all questions of the cars of each world before a tick, for the next moment of their run."""
    worlds, rows = answers.off.shape[0], questions.rows
    per_world = cars.x.shape[0] // worlds
    now = tick * rules.tick_ms & TICKS_MASK
    for world in range(worlds):
        for i in range(world * per_world, (world + 1) * per_world):
            answers.where[cars.number[i]] = i
        for question in range(rows.shape[0]):
            if rows[question, FROM_MS] <= now <= rows[question, UNTIL_MS]:
                met = 0
                for k in range(rows[question, CARS]):
                    place = int(rows[question, FIRST_CAR]) + k
                    met += _ask(world, question, place, now, cars, rules, questions, answers)
                if met < rows[question, NEEDED]:
                    answers.since[world, question] = -1
                elif answers.since[world, question] < 0:
                    answers.since[world, question] = now


@in_kernel
def _ask(
    world: int,
    question: int,
    place: int,
    now: int,
    cars: CarArrays,
    rules: Rules,
    questions: Questions,
    answers: Answers,
) -> int:
    """Ask one car; return 1 where it is so, else 0."""
    i = int(answers.where[questions.who[place]])
    row, figures, kind = questions.rows[question], questions.figures[question], questions.rows[question, KIND]
    off, single, before = answers.off[world], answers.single, answers.before[world]
    if kind in (LIT, NOT_LIT):
        # The LEDs as the last tick set them.
        led = lit_led(cars.memory[:, i], (now - rules.tick_ms) & TICKS_MASK, rules.levels)
        found = 1.0 if (led == row[LED]) == (kind == NOT_LIT) else 0.0
    elif kind == FACES:
        heading = float(cars.heading[i]) / float(FULL_TURN) * math.tau
        single[0] = heading - math.tau if heading > math.pi else heading
        found = turned_deg(_wide(single[0]), figures[WANTED])
        if found <= figures[TOLERANCE]:
            found = 0.0
    else:
        single[0] = float(cars.x[i]) / 1e6
        single[1] = float(cars.y[i]) / 1e6
        x, y = _wide(single[0]), _wide(single[1])
        if kind == TRAVELLED:
            if now > 0:
                off[place] += apart_m(_wide(before[2 * place]), _wide(before[2 * place + 1]), x, y)
            before[2 * place] = single[0]
            before[2 * place + 1] = single[1]
            driven = shown_m(off[place])
            return 1 if figures[LEAST] <= driven <= figures[MOST] else 0
        if row[CORNERS] > 0:
            found = to_outline_m(questions.corners, int(row[FIRST_CORNER]), int(row[CORNERS]), x, y)
        else:
            found = to_disc_m(x, y, figures[DISC_X], figures[DISC_Y], figures[DISC_RADIUS])
        found = shown_m(found) if kind == INSIDE else 1.0 if found == 0.0 else 0.0
    if replaces(found, off[place], int(row[WHEN])):
        off[place] = found
    return 1 if off[place] == 0.0 else 0
