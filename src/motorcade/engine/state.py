"""What the engine keeps, as arrays: one a field, the same index for the same car.

Lengths are µm, times ms, headings binary angles (2^32 is a full turn). Within a
world the cars stand in the order of the cells that they are in, so that
neighbours are near in memory; ``number`` says which car is at an index.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Words = NDArray[np.uint32]
Lengths = NDArray[np.int32]
# An array where the brain, of which each target has its own kind, says list or tuple of integers.
ForBrain = Any

NOBODY = 0xFFFFFFFF
# Wheels that obey a driver and no brain: a direction that no brain gives, at level 0, at which nothing else moves them.
DRIVEN = 3 * 4
# The cars that somebody drives, of all worlds: (7, driven), rows as of `motorcade.engine.bicycle`. One matrix, since a
# kernel gets slower with every array that it is given.
Driven = Ints
# Strips of a large world; more than threads, so that a crowded one holds up no other.
MOST_PARTS = 32


class Cars(NamedTuple):
    """Every car of every world, one world behind the other: arrays of shape (cars,) but for the first two."""

    rows: Words  # (ROWS, cars): all that follows in one, down to sends_until
    memory: ForBrain  # uint32, (brain.SIZE, cars): the brain's; a column is one car's
    x: Lengths
    y: Lengths
    way_x: Lengths  # what it drives in a tick, in 2^-12 µm
    way_y: Lengths
    heading: Words
    number: Words  # within its world
    due: Words  # when it has to be looked at next
    clear: Words  # until which ticks nothing can come near enough to matter, as of `motorcade.engine.clearance`
    heard: Words  # the frame that it is hearing
    heard_at: Words  # when that ends
    heard_from: Words  # the number of its sender; NOBODY: it hears none, or it is lost
    loudest: Words  # distance of the nearest sender since the air here was last free
    air_until: Words  # until when others' frames are on the air here
    sends_until: Words
    push: Words  # how contacts move it in this tick, x and y as two int16, µm; else scratch
    order: Words  # those who begin a frame in this tick; else scratch
    wheels: NDArray[np.uint8]  # direction * 4 + speed level, or DRIVEN
    program: NDArray[np.uint8]  # 0: follows; k: leads by image k - 1


class Cells(NamedTuple):
    """Which cars are in which cell, world by world."""

    first: Lengths  # (worlds, most cells + 1): index of each cell's first car
    frame: Floats  # (worlds, 5): origin x and y (µm), cells a µm, columns, rows
    strips: Ints  # (2, MOST_PARTS + 1): of a large world, how many cars of each begin a frame, and its first row


class Place(NamedTuple):
    """What stands still: walls and the sides of polygons, round obstacles, and lists of them by cell."""

    segments: Floats  # (segments, 4): x0, y0, x1, y1
    discs: Floats  # (discs, 3): x, y, radius
    frame: Floats  # (5,): as of Cells
    first: Lengths  # (cells + 1,)
    items: Lengths  # of each cell, the nearest first: a segment's index, or a disc's behind all segments
    away: Singles  # µm that each of them is away from its cell at least


class People(NamedTuple):
    """Who walks where; the points of all paths one behind the other."""

    first: Ints  # (people + 1,): index of each one's first point
    at_ms: Ints  # (points,)
    x: Floats
    y: Floats
    repeats: Ints  # (people,): 1 where the path begins anew when it is over
    now_x: Floats  # (parts, people): where they are
    now_y: Floats
    walked_ms: Ints  # (parts,): when that was worked out


class Voices(NamedTuple):
    """What is said when and where."""

    at_ms: Ints  # (voices,), rising
    word: Ints
    x: Floats
    y: Floats
    radius: Floats  # FAR_UM: heard everywhere


class Rules(NamedTuple):
    """The profile's and the mat's figures."""

    levels: ForBrain  # int64
    images: ForBrain  # uint32, (images, longest)
    cosines: Floats
    normals: Floats
    flips: Floats  # (33,): chance of at most k flipped bits, times 2^32
    speeds: Floats  # (4,): µm a tick
    turns: Ints  # (16,): binary angle a tick by wheels
    wheel_turn: float  # binary angle a tick that a difference of 1 µm a tick between the wheels makes
    tick_ms: int
    fastest: float  # µm a tick
    collisions: int
    line_of_sight: int
    radius: float
    contact: float  # distance of the centres of cars that touch
    ultrasonic_range_mm: int
    cone_cos: float
    cone_sin: float
    pir_range: float
    pir_cos: float
    person_step: float  # µm a tick that people walk at most
    range: float
    beam_cos: float  # -2: all round
    capture: float  # 0: never
    wheel_noise: float
    drift: float  # µm that a car may have gone since the last sort
    sort_every: int  # ticks
    cell: float  # side of a cell
