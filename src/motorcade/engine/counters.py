"""What a run tells of itself: counts, and events where they are wanted.

Each part of a world that is stepped by itself has its own row of both, so that
threads don't meet; their order means nothing, since events are sorted when taken.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from motorcade.engine.native import in_kernel

# Columns of the counts.
FRAMES = 0
HEARD = 1
LOST_COLLISION = 2
LOST_SENDING = 3
LOST_PARITY = 4
LOST_RESERVED = 5
DEAF = 6
UNDETECTED = 7
TOUCHING_MS = 8
EVENTS = 9  # events that happened, whether or not there was room for them
COUNTS = 16  # two cache lines, so that no two threads write to one

# Indices into KINDS and LOSS_REASONS of `motorcade.engine.events`.
STATE = 0
START = 1
OVER = 2
FRAME = 3
HEARD_FRAME = 4
LOST = 5
PARITY = 1
RESERVED = 2
DEAFNESS = 3
SENDING = 4
COLLISION = 5
_COLUMN_OF_WHY = (FRAMES, LOST_PARITY, LOST_RESERVED, DEAF, LOST_SENDING, LOST_COLLISION)

# One event: when, the car's number, its kind, why, the word, and the other car or the state's index.
COLUMNS = 6


class Counters(NamedTuple):
    """What has happened so far."""

    counts: NDArray[np.int64]  # (parts, COUNTS)
    events: NDArray[np.uint32]  # (parts, room, COLUMNS)


@in_kernel
def tell(tally: Counters, part: int, at_ms: int, car: int, kind: int, why: int, word: int, other: int) -> None:
    """Note an event where there is room for it."""
    k = tally.counts[part, EVENTS]
    tally.counts[part, EVENTS] = k + 1
    if k < tally.events.shape[1]:
        event = tally.events[part, k]
        event[0] = at_ms
        event[1] = car
        event[2] = kind
        event[3] = why
        event[4] = word
        event[5] = other


@in_kernel
def lose(tally: Counters, part: int, at_ms: int, car: int, why: int, frame: int, sender: int) -> None:
    """Count and note a lost frame."""
    tally.counts[part, _COLUMN_OF_WHY[why]] += 1
    tell(tally, part, at_ms, car, LOST, why, frame, sender)
