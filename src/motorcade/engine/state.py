"""The arrays of a world, or of many side by side: one array per field, with the same index for the same car.

Lengths are µm, times ms, headings binary angles (2^32 is a full turn). Within a world the cars stand in the order of
the cells that they are in, so that neighbours are near in memory; ``number`` says which car is at an index.

This module needs no NumPy, because a world is also prepared where there is none.
"""

import struct
from array import array
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Ints = NDArray[np.int64]
    Floats = NDArray[np.float64]
    Singles = NDArray[np.float32]
    Words = NDArray[np.uint32]
    Lengths = NDArray[np.int32]
    Bytes = NDArray[np.uint8]
    Flags = NDArray[np.bool_]
    Metres = NDArray[np.float64] | NDArray[np.float32]
else:
    # The annotations of a named tuple are evaluated, also where there is no NumPy.
    Ints = Floats = Singles = Words = Lengths = Bytes = Flags = Metres = Any
# The codes of types, by NumPy's names, in `array` and `struct`.
CODES: Any = {"int64": "q", "float64": "d", "uint32": "I", "int32": "i", "float32": "f", "uint16": "H", "uint8": "B"}
# An array that is passed to functions of the brain, whose annotations are a list or a tuple of integers.
ForBrain = Any

NOBODY = 0xFFFFFFFF
# The wheels of a car that somebody drives: a direction that no brain gives, at level 0, so nothing else moves them.
DRIVEN = 3 * 4
# The cars that somebody drives, of all worlds: (7, driven), rows as in `motorcade.engine.bicycle`. It is one matrix
# because a kernel gets slower with every array.
Driven = Ints
# The marks on the floor, in the layout of `motorcade.engine.floor`; one array for the same reason.
Floor = Floats
# Strips of a large world, at most.
MOST_PARTS = 32
# Spare places behind a list of cars around a sender, so that several can be tested at once.
SPARE = 4


def width_of(dtype: str) -> int:
    """The bytes of a number of a type."""
    return struct.calcsize(CODES[dtype])


@dataclass(frozen=True, slots=True)
class Buffer:
    """The contents of an array before a backend allocates it: what prepares a world needs no NumPy.

    Attributes:
        dtype: NumPy's name of the type of its items.
        shape: how many rows and columns, or how many items.
        items: row by row.
    """

    dtype: str
    shape: tuple[int, ...]
    items: "array[Any]"

    @classmethod
    def of(cls, dtype: str, items: Iterable[float], columns: int | None = None, rows: int | None = None) -> Any:
        """A buffer, with rows of ``columns`` items where they are given; typed as the array that it becomes."""
        held = array(CODES[dtype], items)
        if columns is None:
            return cls(dtype, (len(held),), held)
        return cls(dtype, (len(held) // columns if rows is None else rows, columns), held)


class CarArrays(NamedTuple):
    """Every car of every world, one world after the other: arrays of shape (cars,) except the first two."""

    rows: Words  # (rows, cars): all fields from memory to sends_until in one array
    memory: ForBrain  # uint32, (brain.SIZE, cars): the brain's memory; a column per car
    x: Lengths
    y: Lengths
    displacement_x: Lengths  # how far it drives in a tick, in 2^-12 µm
    displacement_y: Lengths
    heading: Words
    number: Words  # within its world
    due: Words  # when its next turn is due, ms
    clear: Words  # until which ticks nothing can come near enough to matter; see `motorcade.engine.clearance`
    heard: Words  # the frame that it is receiving; its own while it sends
    heard_at: Words  # when that frame ends, ms; of a leader, which receives none: its row of Decisions
    heard_from: Words  # the number of its sender; NOBODY: it receives none, or the frame is lost
    loudest: Words  # distance of the nearest sender since the air here was last free, µm
    air_until: Words  # until when frames of others are on the air here, ms
    sends_until: Words  # until when it sends its own frame, ms
    push: Words  # how contacts move it in this tick: x and y as two int16, µm; scratch while cars are sorted
    order: Words  # the cars that begin a frame in this tick; scratch while cars are sorted or listed
    wheels: Bytes  # direction * 4 + speed level, or DRIVEN
    program: Bytes  # 0: follows; k: leads with image k - 1


class Cells(NamedTuple):
    """Which cars are in which cell, world by world."""

    first: Lengths  # (worlds, most cells + 1): index of each cell's first car
    frame: Floats  # (worlds, 5): origin x and y (µm), cells a µm, columns, rows
    strips: Ints  # (2, MOST_PARTS + 1): of each strip of a large world, how many cars begin a frame, and its first row


class Obstacles(NamedTuple):
    """What does not move: walls and the sides of polygons, round obstacles, and lists of them by cell."""

    segments: Floats  # (segments, 4): x0, y0, x1, y1
    discs: Floats  # (discs, 3): x, y, radius
    frame: Floats  # (5,): as in Cells
    first: Lengths  # (cells + 1,)
    items: Lengths  # of each cell, the nearest first: a segment's index, or a disc's after all segments
    away: Singles  # µm from its cell to each of them, at least


class People(NamedTuple):
    """Who walks where; the points of all paths one after the other."""

    first: Ints  # (people + 1,): index of each one's first point
    at_ms: Ints  # (points,)
    x: Floats
    y: Floats
    repeats: Ints  # (people,): 1 where the path begins anew when it is over
    now_x: Floats  # (parts, people): where they are now
    now_y: Floats
    walked_ms: Ints  # (parts,): the time that now_x and now_y belong to


class Voices(NamedTuple):
    """The voices of the mat: which word is spoken when and where."""

    at_ms: Ints  # (voices,), rising
    word: Ints
    x: Floats
    y: Floats
    radius: Floats  # FAR_UM: heard everywhere


class Rules(NamedTuple):
    """The figures of the profile and the mat."""

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
    beyond: float  # how much farther than that a car looks for others, so that it need not look again soon
    ultrasonic_range_mm: int
    cone_cos: float
    cone_sin: float
    pir_range: float
    pir_cos: float
    person_step: float  # µm a tick that people walk at most
    range: float
    beam_cos: float  # -2: in all directions
    capture: float  # 0: no frame survives a collision
    wheel_noise: float  # above 0 too where wheels differ by themselves, or cars roll on: no way is straight then
    coast: float  # the share of its displacement that a car which rolls on keeps in a tick; 0: it stops at once
    floor_ahead: float  # µm of the floor sensors in front of the axle
    floor_aside: float  # and to either side
    floor_step: float  # µm a tick that a floor sensor moves at most
    floor_turn: float  # µm that it moves, where the car turns on the spot by a binary angle of 1
    drift: float  # µm that a car may have gone since the last sort
    sort_every: int  # ticks
    cell: float  # side of a cell
    strip: float  # µm that a strip of a large world is high at least


class Counters(NamedTuple):
    """What has happened so far. Each part of a world that a thread steps by itself has a row of its own."""

    counts: Ints  # (parts, COUNTS of `motorcade.engine.events`)
    events: Words  # (parts, room, its COLUMNS)


# What the leaders that decide remember besides (`motorcade.car.decisions`): uint8, a row for each leader
# of each world.
Decisions = ForBrain


class Around(NamedTuple):
    """Scratch memory: lists of cars around a sender or with something to do in a tick, and which cars rest."""

    x: Floats  # (shares, bodies): µm from the sender
    y: Floats
    car: Lengths  # its index, or that of a car that has a turn
    looks: Lengths  # the index of a car that looks for bodies, besides its turn
    wakes: Ints  # (shares, groups): the tick before which no car of a group is due; see `motorcade.engine.resting`
    moves: Bytes  # (shares, groups): 1 where a car of the group may move


class Arrays(NamedTuple):
    """All that a kernel reads and writes."""

    cars: CarArrays
    cells: Cells
    obstacles: Obstacles
    people: People
    voices: Voices
    driven: Driven
    decisions: Decisions
    floor: Floor
    around: Around
    rules: Rules
    counters: Counters


class Now(NamedTuple):
    """The tick that is being simulated, in one world or in one part of it."""

    world: int
    part: int  # which row of the counters and of the people's places
    share: int  # which row of scratch memory
    seed: int
    tick: int
    ms: int
    said: int  # the voice command that every car hears: NO_VOICE, VOICE_STOP or VOICE_GO of the brain
    first_voice: int  # the mat's voices that are spoken in this tick: from first_voice to last_voice - 1
    last_voice: int
    begin: int  # the cars of the world or of this part of it: from begin to end - 1
    end: int
