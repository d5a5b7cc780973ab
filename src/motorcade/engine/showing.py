"""The kernels that tell what a world shows: moments, pictures for a page, events in order, and the nearest senders.

They change no car. Every shell and backend uses them, so a picture has the same bytes everywhere.
"""

import math
from typing import Any, NamedTuple

from motorcade.car.brain import HOLDS, RUNNING, SLOT, STATE, WORD, lit_led
from motorcade.engine import bicycle, channel, clearance, events
from motorcade.engine.backend import in_kernel
from motorcade.engine.geometry import FULL_TURN
from motorcade.engine.moment import EVENT_BYTES, HEARD, LOST, NO_INDEX, RUNS, SENDS, STUCK, Columns
from motorcade.engine.state import Arrays, Bytes, CarArrays, Driven, Floats, Ints, Rules, Singles, Words
from motorcade.words.ticks import TICKS_MASK, reached

# The numbers of an event in a picture.
EVENT_NUMBERS = EVENT_BYTES // 4

# Rows of Tally.cars. Lost frames are counted at LOST_FRAMES plus their index into LOSS_REASONS.
FRAMES, FRAMES_HEARD, LOST_FRAMES = range(3)
LAST_WORD = LOST_FRAMES + len(events.LOSS_REASONS)
LAST_SENDER = LAST_WORD + 1
LAST_MS = LAST_WORD + 2
TALLY_ROWS = LAST_WORD + 3

# Rows of Tally.marks: what the columns of a picture are packed for.
PICTURED, STORED, ASKED = range(3)

# Rows of what `find_nearest` finds, and the columns of each.
SENDERS, LISTENERS = range(2)
CAR, DISTANCE_MM, REACH = range(3)
MOST_NEAREST = 8


class Tally(NamedTuple):
    """What happened to each car, in the order of their numbers, as `note_events` counts it."""

    cars: Words  # (TALLY_ROWS, cars)
    marks: Bytes  # (3, cars): LOST and HEARD since the columns were packed for PICTURED, STORED and ASKED


class Page(NamedTuple):
    """The columns of a picture that a moment doesn't have; its other bytes are columns of the moment."""

    wide: Floats  # (3 * cars,): of the moment, one column after the other
    narrow: Singles  # the same in the picture
    index: Any  # uint16
    flags: Bytes


def read_moment(world: int, tick: int, cars: CarArrays, driven: Driven, rules: Rules, shown: Columns) -> None:
    """Write what the cars of a world show before a tick."""
    count = shown.x_m.shape[0]
    now = tick * rules.tick_ms & TICKS_MASK
    # The LEDs as the last tick set them; the next tick may switch some off.
    last = (tick - 1) * rules.tick_ms & TICKS_MASK
    for i in range(world * count, (world + 1) * count):
        k = int(cars.number[i])
        shown.x_m[k] = float(cars.x[i]) / 1e6
        shown.y_m[k] = float(cars.y[i]) / 1e6
        heading = float(cars.heading[i]) / float(FULL_TURN) * math.tau
        shown.heading[k] = heading - math.tau if heading > math.pi else heading
        shown.word[k] = cars.memory[WORD, i]
        shown.runs[k] = 1 if cars.memory[RUNNING, i] else 0
        shown.wheels[k] = cars.wheels[i]
        shown.led[k] = lit_led(cars.memory[:, i], last, rules.levels)
        shown.sends[k] = 1 - reached(now, int(cars.sends_until[i]))
    for column in range(driven.shape[1]):
        if driven[bicycle.WORLD, column] == world:
            shown.wheels[cars.number[driven[bicycle.PLACE, column]]] = bicycle.shown_wheels(
                float(driven[bicycle.AHEAD, column]), float(driven[bicycle.ASIDE, column]), rules.speeds
            )


def pack_picture(purpose: int, tick: int, arrays: Arrays, shown: Columns, tally: Tally, page: Page) -> None:
    """Write the rest of a picture of the only world before a tick, after ``read_moment``.

    The marks of the purpose are taken with it.

    Where the image has a follower's word more than once, the index is that of the one that the leader with the
    lowest number sent last.
    """
    cars = arrays.cars
    rules = arrays.rules
    count = shown.x_m.shape[0]
    first = count
    image = 0
    slot = 0
    for i in range(count):
        if cars.program[i] > 0 and int(cars.number[i]) < first:
            first = int(cars.number[i])
            image = int(cars.program[i]) - 1
            slot = int(cars.memory[SLOT, i])
    header = int(rules.images[image, 0])
    states = header >> 24
    words = header >> 16 & 255
    for i in range(count):
        k = int(cars.number[i])
        if cars.program[i] > 0:
            index = int(cars.memory[STATE, i]) + 1 if cars.memory[RUNNING, i] else NO_INDEX
        elif cars.memory[HOLDS, i]:
            index = _last_sent(int(cars.memory[WORD, i]), slot, image, states, words, rules)
        else:
            index = NO_INDEX
        page.index[k] = index
        drives = 0 < int(shown.wheels[k]) < 1 << 2
        stuck = STUCK if drives and clearance.is_stuck(i, tick, arrays) else 0
        page.flags[k] = shown.runs[k] * RUNS | shown.sends[k] * SENDS | stuck | tally.marks[purpose, k]
        tally.marks[purpose, k] = 0
    for k in range(page.narrow.shape[0]):
        page.narrow[k] = page.wide[k]


@in_kernel
def _last_sent(word: int, slot: int, image: int, states: int, words: int, rules: Rules) -> int:
    """The index of a follower's word in its latest place of a round that ends with ``slot``; NO_INDEX for none."""
    place = slot
    for _ in range(words):
        # The leader sends from slot 0 on, and begins again after the last one.
        if place >= words or place < 0:
            place = place - words if place >= words else place + words
        if int(rules.images[image, 1 + states + place]) == word:
            return 1 + states + place
        place -= 1
    return NO_INDEX


def sort_events(rows: Words, order: Ints, in_order: Words) -> None:
    """Write rows of events (`motorcade.engine.events`) by time, then by car; otherwise their order stays.

    ``order``, with two rows of as many numbers as there are events, is scratch.
    """
    count = rows.shape[0]
    for k in range(count):
        order[0, k] = k
    width = 1
    source = 0
    while width < count:
        for begin in range(0, count, 2 * width):
            middle = min(begin + width, count)
            end = min(begin + 2 * width, count)
            left = begin
            right = middle
            for k in range(begin, end):
                takes_right = left >= middle or (
                    right < end and _is_earlier(order[source, right], order[source, left], rows)
                )
                if takes_right:
                    order[1 - source, k] = order[source, right]
                    right += 1
                else:
                    order[1 - source, k] = order[source, left]
                    left += 1
        width, source = 2 * width, 1 - source
    for k in range(count):
        for column in range(events.COLUMNS):
            in_order[k, column] = rows[order[source, k], column]


@in_kernel
def _is_earlier(one: int, other: int, rows: Words) -> bool:
    if rows[one, events.T_MS] != rows[other, events.T_MS]:
        return bool(rows[one, events.T_MS] < rows[other, events.T_MS])
    return bool(rows[one, events.CAR] < rows[other, events.CAR])


def note_events(in_order: Words, tally: Tally, packed: Words) -> None:
    """Count events of the only world for each car, and write them as a picture has them."""
    for k in range(in_order.shape[0]):
        t_ms = in_order[k, events.T_MS]
        car = int(in_order[k, events.CAR])
        kind = int(in_order[k, events.KIND])
        why = int(in_order[k, events.WHY])
        word = in_order[k, events.WORD]
        other = in_order[k, events.OTHER]
        if kind == events.FRAME:
            tally.cars[FRAMES, car] += 1
        elif kind == events.HEARD:
            tally.cars[FRAMES_HEARD, car] += 1
            tally.cars[LAST_WORD, car] = word
            tally.cars[LAST_SENDER, car] = other
            tally.cars[LAST_MS, car] = t_ms
            _mark(car, HEARD, tally)
        elif kind == events.LOST:
            tally.cars[LOST_FRAMES + why, car] += 1
            _mark(car, LOST, tally)
        packed[k, 0] = t_ms
        packed[k, 1] = car
        packed[k, 2] = kind | why << 8
        packed[k, 3] = word
        packed[k, 4] = other


@in_kernel
def _mark(car: int, flag: int, tally: Tally) -> None:
    for purpose in range(tally.marks.shape[0]):
        tally.marks[purpose, car] = int(tally.marks[purpose, car]) | flag


def find_nearest(car: int, arrays: Arrays, tally: Tally, away: Floats, found: Ints) -> None:
    """Find the cars nearest to one in the only world: those that have sent, and those that have only heard.

    ``found``, (2, MOST_NEAREST, 3), gets number, distance and reach of each, the nearest first; number -1 for none.
    ``away``, (2, MOST_NEAREST), is scratch.
    """
    cars = arrays.cars
    count = cars.x.shape[0]
    here = 0
    for i in range(count):
        if int(cars.number[i]) == car:
            here = i
    for kind in range(2):
        for place in range(MOST_NEAREST):
            found[kind, place, CAR] = -1
    for i in range(count):
        number = int(cars.number[i])
        if number == car or (tally.cars[FRAMES, number] == 0 and tally.cars[FRAMES_HEARD, number] == 0):
            continue
        kind = SENDERS if tally.cars[FRAMES, number] > 0 else LISTENERS
        dx = float(cars.x[i]) - float(cars.x[here])
        dy = float(cars.y[i]) - float(cars.y[here])
        _insert(kind, i, dx * dx + dy * dy, cars, away, found)
    for kind in range(2):
        for place in range(MOST_NEAREST):
            i = int(found[kind, place, CAR])
            if i >= 0:
                found[kind, place, CAR] = cars.number[i]
                found[kind, place, DISTANCE_MM] = math.ceil(math.sqrt(away[kind, place]) / 1000.0)
                found[kind, place, REACH] = channel.reach(i, here, 0, arrays)


@in_kernel
def _insert(kind: int, i: int, squared: float, cars: CarArrays, away: Floats, found: Ints) -> None:
    """Insert the car at index ``i`` into a row of ``found``, for whose order equal distances go by number."""
    place = MOST_NEAREST
    while place > 0:
        before = int(found[kind, place - 1, CAR])
        if before >= 0:
            if away[kind, place - 1] < squared:
                break
            if away[kind, place - 1] == squared and cars.number[before] < cars.number[i]:
                break
            if place < MOST_NEAREST:
                found[kind, place, CAR] = before
                away[kind, place] = away[kind, place - 1]
        place -= 1
    if place < MOST_NEAREST:
        found[kind, place, CAR] = i
        away[kind, place] = squared
