"""What goals ask of cars at a moment, and the answers: one function judges one run or many.

A question is a row: what must be so (a car is in a zone, faces so, shows a lamp, has driven so far, cars are together),
of which cars, and when. `judge_run` asks all questions of one run at one moment, whose figures `Answers` hold. Python
calls it with lists for a run whose moments a page or a recording shows. The kernel ``run`` calls it for each of many
worlds in the middle of a call, as often as its questions want, after it has read their cars. So nothing is decided in
two ways, and a run that nobody looks at is judged without a step of Python. Lengths are metres in single precision, as
recordings and pages have them.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from motorcade.car.brain import STILL, lit_led
from motorcade.engine.backend import Backend, in_kernel
from motorcade.engine.geometry import FULL_TURN
from motorcade.engine.state import CarArrays, Floats, Ints, Rules, Singles
from motorcade.mats.plane import is_left_of, nearest_of_segment
from motorcade.words.ticks import TICKS_MASK

# What is asked of each car.
INSIDE, OUTSIDE, FACES, LIT, NOT_LIT, TRAVELLED = range(6)
# What is asked of all cars together; and whether each obeys voices. These have no `when` but `together`.
TOGETHER, OBEYS, GATHERED, STOPPED = range(6, 10)
# When a car must be so: at the last moment, at one of its own, at all.
END, SOME_MOMENT, ALWAYS = range(3)

# Columns of Questions.rows. Moments before FROM_MS and after UNTIL_MS don't count. Of the CARS from FIRST_CAR on in
# `who`, NEEDED must be so. A zone is the CORNERS from FIRST_CORNER on, or a disc where there are none; for OBEYS these
# are voices.
KIND, WHEN, FROM_MS, UNTIL_MS, NEEDED, FIRST_CAR, CARS, FIRST_CORNER, CORNERS, LED = range(10)
COLUMNS = 10
# Columns of Questions.figures: an angle and how far off it may be in degrees, or the least and the most length; a disc.
WANTED, TOLERANCE, DISC_X, DISC_Y, DISC_RADIUS = range(5)
LEAST = WANTED
MOST = TOLERANCE
FIGURES = 5
# A voice among the corners, as three of them: when in ms, where, how far it is heard (less than 0: everywhere), 1 where
# it says 'go', and nothing.
VOICE_MS, VOICE_X, VOICE_Y, VOICE_RADIUS, SAYS_GO = range(5)
VOICE = 6
# A car has stopped by this time after a voice said so.
STOPS_MS = 300
# How a car failed to obey: it stood already, or it drives on.
STOOD = 1.0
DROVE = 2.0
# A car that moves less between two moments, along x and along y, stands.
STANDS_M = 0.005
# Of a larger group only the cars that are outermost in one of so many directions are compared with each other.
_DIRECTIONS = 16
_COSINE = math.cos(math.tau / _DIRECTIONS)
_SINE = math.sin(math.tau / _DIRECTIONS)


class Questions(NamedTuple):
    """What is asked of cars, a row a question."""

    rows: Ints  # (questions, COLUMNS)
    figures: Floats  # (questions, FIGURES)
    corners: Floats  # x and y of each corner, one zone after the other
    who: Ints  # the numbers of cars


class Answers(NamedTuple):
    """How it stands, and what the cars show now; a row a world. There is a place for each entry of `Questions.who`."""

    # (worlds, 3 * places): 0 where the car is so; how far it drove, for TRAVELLED; what it scored; how it failed. Then
    # since when that counts, in ms. Then 1 more than when a voice told it to stop; a car that is outermost.
    off: Floats
    before: Singles  # (worlds, 3 * places): x, y and wheels at the moment before; the two cars that are farthest apart
    since: Ints  # (worlds, questions): since when as many cars as needed are so, in ms; -1: they aren't
    led: Ints  # (worlds, cars): the LED of each car
    shown: Singles  # (worlds, 4 * cars): x of each car, then y, then the heading, then the wheels


class Asked(NamedTuple):
    """What the kernel ``run`` asks of the cars of worlds meanwhile."""

    every_ms: int  # how often; 0: never
    questions: Questions
    answers: Answers


def nothing(backend: Backend) -> Asked:
    """Return what asks nothing."""
    questions = Questions(
        rows=backend.zeros("Questions.rows", (0, COLUMNS), "int64"),
        figures=backend.zeros("Questions.figures", (0, FIGURES), "float64"),
        corners=backend.zeros("Questions.corners", (0,), "float64"),
        who=backend.zeros("Questions.who", (0,), "int64"),
    )
    answers = Answers(
        off=backend.zeros("Answers.off", (0, 0), "float64"),
        before=backend.zeros("Answers.before", (0, 0), "float32"),
        since=backend.zeros("Answers.since", (0, 0), "int64"),
        led=backend.zeros("Answers.led", (0, 0), "int64"),
        shown=backend.zeros("Answers.shown", (0, 0), "float32"),
    )
    return Asked(0, questions, answers)


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
    inside = False
    nearest = 1e300
    x0 = corners[first + 2 * count - 2]
    y0 = corners[first + 2 * count - 1]
    for k in range(count):
        x1 = corners[first + 2 * k]
        y1 = corners[first + 2 * k + 1]
        if is_left_of(x, y, x0, y0, x1, y1):
            inside = not inside
        near_x, near_y = nearest_of_segment(x, y, x0, y0, x1, y1)
        nearest = min(nearest, apart_m(x, y, near_x, near_y))
        x0 = x1
        y0 = y1
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


@in_kernel
def next_moment(tick: int, every_ms: int, tick_ms: int) -> int:
    """The first tick after ``tick`` at or after a multiple of ``every_ms``: moments are as many as ticks allow."""
    next_ms = (tick * tick_ms // every_ms + 1) * every_ms
    return (next_ms + tick_ms - 1) // tick_ms


def judge(tick: int, cars: CarArrays, rules: Rules, questions: Questions, answers: Answers) -> None:
    """Ask all questions of the cars of each world before a tick, for the next moment of their run."""
    for world in range(answers.off.shape[0]):
        judge_world(world, tick, cars, rules, questions, answers)


@in_kernel
def judge_world(world: int, tick: int, cars: CarArrays, rules: Rules, questions: Questions, answers: Answers) -> None:
    """Ask all questions of the cars of a world before a tick."""
    led = answers.led[world]
    shown = answers.shown[world]
    count = led.shape[0]
    now = tick * rules.tick_ms & TICKS_MASK
    asks_led = False
    for question in range(len(questions.rows)):
        asks_led = asks_led or questions.rows[question][KIND] in (LIT, NOT_LIT)
    for i in range(world * count, (world + 1) * count):
        car = cars.number[i]
        shown[car] = float(cars.x[i]) / 1e6
        shown[count + car] = float(cars.y[i]) / 1e6
        heading = float(cars.heading[i]) / float(FULL_TURN) * math.tau
        shown[2 * count + car] = heading - math.tau if heading > math.pi else heading
        shown[3 * count + car] = cars.wheels[i]
        if asks_led:
            # The LEDs as the last tick set them.
            led[car] = lit_led(cars.memory[:, i], (now - rules.tick_ms) & TICKS_MASK, rules.levels)
    judge_run(world, now, questions, answers)


@in_kernel
def judge_run(world: int, now: int, questions: Questions, answers: Answers) -> None:
    """Ask all questions of one run, at the moment ``now`` in ms that `Answers.led` and `Answers.shown` hold."""
    for question in range(len(questions.rows)):
        row = questions.rows[question]
        if row[FROM_MS] <= now <= row[UNTIL_MS]:
            if row[KIND] == TOGETHER:
                _compare(world, now, question, questions, answers)
            elif row[KIND] == OBEYS:
                _listen(world, now, question, questions, answers)
            elif row[KIND] >= GATHERED:
                _score(world, now, question, questions, answers)
            else:
                _ask_each(world, now, question, questions, answers)


@in_kernel
def _ask_each(world: int, now: int, question: int, questions: Questions, answers: Answers) -> None:
    """Ask a question of each of its cars."""
    off = answers.off[world]
    since = answers.since[world]
    places = len(questions.who)
    row = questions.rows[question]
    figures = questions.figures[question]
    met = 0
    when = row[WHEN]
    for place in range(row[FIRST_CAR], row[FIRST_CAR] + row[CARS]):
        car = questions.who[place]
        if row[KIND] == TRAVELLED:
            driven = shown_m(_drive(world, now, place, car, answers))
            if figures[LEAST] <= driven <= figures[MOST]:
                met += 1
        else:
            # What was always so and no longer is, stays as it is.
            if when != ALWAYS or off[place] == 0.0:
                found = _how_far(world, car, row, figures, questions.corners, answers)
                if when != SOME_MOMENT or found <= off[place]:
                    off[place] = found
                    off[places + place] = float(now)
            if off[place] == 0.0:
                met += 1
    _note(question, now, met >= row[NEEDED], since)


@in_kernel
def _note(question: int, now: int, is_met: bool, since: Ints) -> None:
    """Note since when a question is met."""
    if not is_met:
        since[question] = -1
    elif since[question] < 0:
        since[question] = now


@in_kernel
def _compare(world: int, now: int, question: int, questions: Questions, answers: Answers) -> None:
    """Find the two cars that are farthest apart; what went wrong, or was met at some moment, stays as it is."""
    off = answers.off[world]
    before = answers.before[world]
    since = answers.since[world]
    row = questions.rows[question]
    most_m = questions.figures[question][MOST]
    places = len(questions.who)
    first = row[FIRST_CAR]
    when = row[WHEN]
    if when == ALWAYS and off[first] > most_m:
        return
    if when == SOME_MOMENT and since[question] >= 0:
        return
    shown = answers.shown[world]
    count = len(answers.led[world])
    outer = 2 * places + first
    compared = _list_outer(first, row[CARS], outer, count, questions, off, shown)
    farthest_m = -1.0
    one = 0
    other = 0
    for k in range(compared):
        for j in range(compared):
            a = int(off[outer + k])
            b = int(off[outer + j])
            if a <= b:
                apart = apart_m(_wide(shown[a]), _wide(shown[count + a]), _wide(shown[b]), _wide(shown[count + b]))
                # Of equally distant pairs the one with the lowest numbers.
                if apart > farthest_m or (apart == farthest_m and (a < one or (a == one and b < other))):
                    farthest_m = apart
                    one = a
                    other = b
    farthest_m = shown_m(farthest_m)
    if when != SOME_MOMENT or farthest_m <= off[first]:
        off[first] = farthest_m
        off[places + first] = float(now)
        before[3 * first] = one
        before[3 * first + 1] = other
    _note(question, now, farthest_m <= most_m, since)


@in_kernel
def _list_outer(
    first: int, cars: int, outer: int, count: int, questions: Questions, off: Floats, shown: Singles
) -> int:
    """List the cars that can be one of the two that are farthest apart from ``off[outer]`` on; return how many."""
    if cars <= _DIRECTIONS:
        for k in range(cars):
            off[outer + k] = float(questions.who[first + k])
        return cars
    cosine = 1.0
    sine = 0.0
    for k in range(_DIRECTIONS):
        most = -1e300
        for place in range(first, first + cars):
            car = questions.who[place]
            along = _wide(shown[car]) * cosine + _wide(shown[count + car]) * sine
            if along > most:
                most = along
                off[outer + k] = float(car)
        cosine, sine = cosine * _COSINE - sine * _SINE, sine * _COSINE + cosine * _SINE
    return _DIRECTIONS


@in_kernel
def _listen(world: int, now: int, question: int, questions: Questions, answers: Answers) -> None:
    """Tell cars what voices said since the moment before, and see whether those that must stand do so."""
    off = answers.off[world]
    before = answers.before[world]
    since = answers.since[world]
    shown = answers.shown[world]
    row, places, count, corners = (
        questions.rows[question],
        len(questions.who),
        len(answers.led[world]),
        questions.corners,
    )
    last_ms = since[question]
    for place in range(row[FIRST_CAR], row[FIRST_CAR] + row[CARS]):
        car = questions.who[place]
        told = 2 * places + place
        if last_ms < 0:
            _keep(place, car, count, before, shown)
        for voice in range(row[FIRST_CORNER], row[FIRST_CORNER] + 2 * row[CORNERS], VOICE):
            at_ms = corners[voice + VOICE_MS]
            radius = corners[voice + VOICE_RADIUS]
            if last_ms <= at_ms < now:
                x = _wide(before[3 * place])
                y = _wide(before[3 * place + 1])
                if radius < 0.0 or apart_m(x, y, corners[voice + VOICE_X], corners[voice + VOICE_Y]) <= radius:
                    if corners[voice + SAYS_GO] > 0.0:
                        off[told] = 0.0
                    elif off[told] == 0.0:
                        if before[3 * place + 2] == STILL:
                            _fail(place, places, STOOD, max(last_ms, 0), off)
                        else:
                            off[told] = at_ms + 1.0
        if off[told] > 0.0 and now >= off[told] - 1.0 + STOPS_MS and shown[3 * count + car] != STILL:
            _fail(place, places, DROVE, now, off)
        _keep(place, car, count, before, shown)
    since[question] = now


@in_kernel
def _keep(place: int, car: int, count: int, before: Singles, shown: Singles) -> None:
    """Keep where a car is, and its wheels."""
    before[3 * place] = shown[car]
    before[3 * place + 1] = shown[count + car]
    before[3 * place + 2] = shown[3 * count + car]


@in_kernel
def _fail(place: int, places: int, how: float, at_ms: int, off: Floats) -> None:
    """Note how and when a car failed first."""
    if off[place] == 0.0:
        off[place] = how
        off[places + place] = float(at_ms)


@in_kernel
def _score(world: int, now: int, question: int, questions: Questions, answers: Answers) -> None:
    """Add up what each car scores at each moment but the first; for STOPPED, what is counted off for it."""
    off = answers.off[world]
    before = answers.before[world]
    since = answers.since[world]
    shown = answers.shown[world]
    row = questions.rows[question]
    figures = questions.figures[question]
    count = len(answers.led[world])
    is_found = since[question] >= 0
    finds = False
    for place in range(row[FIRST_CAR], row[FIRST_CAR] + row[CARS]):
        car = questions.who[place]
        x = _wide(shown[car])
        y = _wide(shown[count + car])
        is_in = _to_zone_m(x, y, row, figures, questions.corners) == 0.0
        if now > 0:
            finds = finds or is_in
            if row[KIND] == GATHERED:
                off[place] += 1.0 if is_in else 0.0
            else:
                moved_x = abs(x - _wide(before[3 * place]))
                moved_y = abs(y - _wide(before[3 * place + 1]))
                standing = 1.0 if moved_x < STANDS_M and moved_y < STANDS_M else 0.0
                off[place] += 1.0 - standing if is_found else 1.0 + standing
        _keep(place, car, count, before, shown)
    if finds and not is_found:
        since[question] = now


@in_kernel
def _drive(world: int, now: int, place: int, car: int, answers: Answers) -> float:
    """Add up how far a car has driven since the moment before; return how far since the first."""
    off = answers.off[world]
    before = answers.before[world]
    shown = answers.shown[world]
    count = len(answers.led[world])
    x = shown[car]
    y = shown[count + car]
    if now > 0:
        off[place] += apart_m(_wide(before[3 * place]), _wide(before[3 * place + 1]), _wide(x), _wide(y))
    _keep(place, car, count, before, shown)
    return float(off[place])


@in_kernel
def _to_zone_m(x: float, y: float, row: Ints, figures: Floats, corners: Floats) -> float:
    """How far a point is from the zone of a question; 0 inside."""
    if row[CORNERS] > 0:
        return to_outline_m(corners, row[FIRST_CORNER], row[CORNERS], x, y)
    return to_disc_m(x, y, figures[DISC_X], figures[DISC_Y], figures[DISC_RADIUS])


@in_kernel
def _how_far(world: int, car: int, row: Ints, figures: Floats, corners: Floats, answers: Answers) -> float:
    """How far a car is from being as a question asks; 0 where it is so."""
    kind = row[KIND]
    led = answers.led[world]
    shown = answers.shown[world]
    if kind == LIT:
        return 0.0 if led[car] == row[LED] else 1.0
    if kind == NOT_LIT:
        return 1.0 if led[car] == row[LED] else 0.0
    if kind == FACES:
        turned = turned_deg(_wide(shown[2 * len(led) + car]), figures[WANTED])
        return 0.0 if turned <= figures[TOLERANCE] else turned
    apart = _to_zone_m(_wide(shown[car]), _wide(shown[len(led) + car]), row, figures, corners)
    if kind == INSIDE:
        return shown_m(apart)
    return 1.0 if apart == 0.0 else 0.0
