"""What happened in a world: counts, and on request events, which are rows of one array.

The order of the rows has no meaning: the kernel ``sort_events`` sorts them. This module needs no NumPy.
"""

from motorcade.engine.state import Counters

# One event, as NumPy's type of a row. run counts the resets before it. kind is an index into KINDS, and why is an index
# into LOSS_REASONS. word is the control word, for a lost frame the bits on the air. other is a state's index, the tag
# of a word that starts, or the number of a frame's sender; for a flow word its index, and NEXT_WORD times that of the
# word that came next; else 0.
EVENT = [
    ("t_ms", "<u4"),
    ("world", "<u4"),
    ("run", "<u4"),
    ("car", "<u4"),
    ("kind", "u1"),
    ("why", "u1"),
    ("word", "<u4"),
    ("other", "<u4"),
]
KINDS = ("state", "start", "over", "frame", "heard", "lost", "flow")
NEXT_WORD = 256
LOSS_REASONS = ("", "parity", "reserved", "deaf", "sending", "collision", "check", "remote")

# Indices into KINDS; the first three are those of `motorcade.car.step`.
STATE, START, OVER, FRAME, HEARD, LOST, FLOW = range(7)
# Indices into LOSS_REASONS.
PARITY, RESERVED, DEAF, SENDING, COLLISION, CHECK, REMOTE = range(1, 8)

# Columns of the counts. Lost frames are counted at their index into LOSS_REASONS, whose index 0 is no reason: that
# column counts the frames that were begun.
FRAMES = 0
FRAMES_HEARD = 8
UNDETECTED = 9
TOUCHING_MS = 10
EVENTS = 11  # events that happened, whether or not there was room for them
TICK = 12  # how many ticks have passed: a world and its clock advance in one call
COUNTS = 16  # two cache lines, so that no two threads write to one
# Columns of an event in Counters.events.
T_MS, CAR, KIND, WHY, WORD, OTHER = range(6)
COLUMNS = 6


def record(counters: Counters, part: int, at_ms: int, car: int, kind: int, why: int, word: int, other: int) -> None:
    """Store an event if there is room for it, and count it in any case."""
    k = counters.counts[part, EVENTS]
    counters.counts[part, EVENTS] = k + 1
    if k < counters.events.shape[1]:
        event = counters.events[part, k]
        event[T_MS] = at_ms
        event[CAR] = car
        event[KIND] = kind
        event[WHY] = why
        event[WORD] = word
        event[OTHER] = other


def forget_flow(counters: Counters, part: int, at_ms: int, car: int) -> None:
    """Take back the flow words of a tick that led a car to no state: one that waits executes some in each tick."""
    k = counters.counts[part, EVENTS]
    if k > counters.events.shape[1]:
        return
    while k > 0 and counters.events[part, k - 1, KIND] == FLOW:
        event = counters.events[part, k - 1]
        if event[CAR] != car or event[T_MS] != at_ms:
            break
        k -= 1
    counters.counts[part, EVENTS] = k


def record_loss(counters: Counters, part: int, at_ms: int, car: int, why: int, frame: int, sender: int) -> None:
    """Count a lost frame and store the event."""
    counters.counts[part, why] += 1
    record(counters, part, at_ms, car, LOST, why, frame, sender)
