"""The kernels for cars that a program of the user steers: give each a word between two ticks, and read its senses."""

import math

from motorcade.car import brain, frames
from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.car.senses import NOTHING
from motorcade.engine import bodies, clearance, floor
from motorcade.engine.backend import in_kernel
from motorcade.engine.geometry import FULL_TURN
from motorcade.engine.state import Arrays, Ints, Now, Singles, Words
from motorcade.words.ticks import TICKS_MASK

# No control word: a car that gets it keeps its own.
KEEP = 1
# Columns of what `read_senses` writes of a car: what it senses, the word that it executes or holds, when that began,
# and where it is; the heading is a binary angle.
OBSTACLE_MM, PERSON, DARK_FLOOR, WORD, STARTED_MS, X_UM, Y_UM, HEADING = range(8)
SENSED = 8
# What `observe` writes of a car beside the fields of what it heard.
SEEN = 8


@in_kernel
def _obstacle_ahead_mm(i: int, world: int, look_mm: int, arrays: Arrays) -> int:
    """What the ultrasonic sensor of car ``i`` measures between two ticks, up to ``look_mm``."""
    look = float(look_mm) * 1000.0
    _, seen = bodies.others_ahead(i, world, look, arrays.cars, arrays.cells, arrays.rules)
    _, _, _, distance, _, _ = bodies.obstacles_near(i, look, 0.0, 0.0, arrays.cars, arrays.obstacles, arrays.rules)
    nearest = min(seen, distance)
    return bodies.obstacle_mm(nearest, arrays.rules) if nearest <= look else NOTHING_IN_SIGHT_MM


def begin_words(tick: int, worlds: int, words: Words, arrays: Arrays) -> None:
    """Let followers begin bare words before a tick, as if each had just heard its own by infrared.

    ``words`` is in the order of worlds and car numbers. A car whose word is KEEP, and a leader, goes on
    with what it does.
    """
    cars = arrays.cars
    rules = arrays.rules
    now = tick * rules.tick_ms & TICKS_MASK
    per_world = cars.x.shape[0] // worlds
    for i in range(cars.x.shape[0]):
        world = i // per_world
        begin = world * per_world
        word = int(words[begin + int(cars.number[i])])
        if word == KEEP or cars.program[i] > 0:
            continue
        s = cars.memory[:, i]
        if s[brain.RUNNING]:
            brain.break_off(s, now, rules.levels)
        if s[brain.TAG] or s[brain.HOLDS] == 0:
            s[brain.TAG] = 0
            s[brain.RELAY] = frames.BUSY
        s[brain.HOLDS] = 1
        brain.begin_word(s, word, now)
        wheels = brain.wheels(s, NOTHING, now, rules.levels)
        last = Now(world, 0, 0, 0, tick - 1, now, brain.NO_VOICE, 0, 0, begin, begin + per_world)
        clearance.set_wheels(i, wheels, arrays, last)
        # Where the wheels depend on sensors, its turn in this tick sets them.
        cars.due[i] = now


def read_obstacle(i: int, look_mm: int, arrays: Arrays, answer: Ints) -> None:
    """Write what the ultrasonic sensor of car ``i`` in world 0 measures, up to ``look_mm``, into ``answer[0]``."""
    answer[0] = _obstacle_ahead_mm(i, 0, look_mm, arrays)


def read_senses(tick: int, worlds: int, look_mm: int, arrays: Arrays, sensed: Ints) -> None:
    """Write what every car senses before a tick, and what it holds, in the order of worlds and car numbers.

    Its sensors are on whatever its word asks for; the ultrasonic sensor looks ``look_mm`` ahead.
    """
    cars = arrays.cars
    people = arrays.people
    now = tick * arrays.rules.tick_ms & TICKS_MASK
    per_world = cars.x.shape[0] // worlds
    for i in range(cars.x.shape[0]):
        world = i // per_world
        row = sensed[world * per_world + int(cars.number[i])]
        row[OBSTACLE_MM] = _obstacle_ahead_mm(i, world, look_mm, arrays)
        row[PERSON] = 0
        row[DARK_FLOOR] = 0
        if people.now_x.shape[1]:
            row[PERSON], _ = bodies.person_near(i, world, now, cars, people, arrays.rules)
        if arrays.floor.shape[0]:
            row[DARK_FLOOR], _, _ = floor.look_down(i, cars, arrays.floor, arrays.rules)
        row[WORD] = cars.memory[brain.WORD, i]
        row[STARTED_MS] = cars.memory[brain.STARTED_MS, i]
        row[X_UM] = cars.x[i]
        row[Y_UM] = cars.y[i]
        row[HEADING] = cars.heading[i]


def observe(given_ms: int, range_m: float, given: Words, told: Ints, fields: Ints, sensed: Ints, seen: Singles) -> None:
    """Write what cars observe, after `read_senses`: what they sense, the fields of what they heard, and their pose.

    Args:
        given_ms: when the cars got the words ``given``, or KEEP.
        range_m: what an ultrasonic sensor that finds nothing observes.
        told: (3, cars): the word of each car at the last call, when it began, and whether it is to hear; goes on.
        fields: (fields, 2): the lowest bit and the mask of each.
        sensed: what `read_senses` wrote.
        seen: (cars, 8 + fields): person, dark on the left and on the right, heard, obstacle; the fields; the pose.
    """
    for k in range(sensed.shape[0]):
        row = sensed[k]
        line = seen[k]
        if given[k] != KEEP:
            told[0, k], told[1, k] = int(given[k]), given_ms
        heard = told[2, k] if row[WORD] != told[0, k] or row[STARTED_MS] != told[1, k] else 0
        told[0, k] = row[WORD]
        told[1, k] = row[STARTED_MS]
        line[0] = row[PERSON]
        line[1] = row[DARK_FLOOR] & 1
        line[2] = row[DARK_FLOOR] >> 1 & 1
        line[3] = heard
        line[4] = min(float(row[OBSTACLE_MM]) / 1000.0, range_m)
        for field in range(fields.shape[0]):
            line[5 + field] = (row[WORD] >> fields[field, 0] & fields[field, 1]) * heard
        at = 5 + fields.shape[0]
        line[at] = float(row[X_UM]) / 1e6
        line[at + 1] = float(row[Y_UM]) / 1e6
        line[at + 2] = float(row[HEADING]) * (math.tau / FULL_TURN)
