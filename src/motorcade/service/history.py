"""The past of a world, as bytes, and the format of the pictures that a page draws of it.

All numbers are little-endian. A picture is a header (its kind, flags, number, t_ms, how many cars, events, and frames
that were lost in the last LATELY_MS), the columns of a moment (17 bytes a car, filled up to a multiple
of four: x_m, y_m, heading as float32, index of the word as uint16, wheels, led and flags as uint8), and rows of 20
bytes for the events since the last picture: t_ms, car, kind and reason, word, other. `motorcade.engine.showing` has the
flags of a car, and its kernels pack moments and events.
"""

import struct
from bisect import bisect_right
from collections import deque
from collections.abc import Iterator
from typing import NamedTuple

from motorcade.engine.events import LOST
from motorcade.engine.showing import CAR_BYTES, EVENT_BYTES

PICTURE = 1
# A picture's flags.
PAST = 1
FIRST = 2
MOST_EVENTS = 4000

EVERY_MS = 100
# The time whose lost frames a picture counts.
LATELY_MS = 5000
MOST_MOMENT_BYTES = 24 << 20
MOST_EVENT_BYTES = 12 << 20
PAST_BYTES = (MOST_MOMENT_BYTES, MOST_EVENT_BYTES)
# The approximate size in Python of an object without content.
_OBJECT_BYTES = 128
# As in a picture: time, car, kind, reason, word, and other.
_EVENT = struct.Struct("<IIBBxxII")
_TIME = struct.Struct("<I")
_KIND = struct.Struct("<8xB11x")
_HEADER = struct.Struct("<BBHIIIII")
# Where the moment of a picture begins.
HEADER_BYTES = _HEADER.size


def pack_picture(number: int, flags: int, t_ms: int, cars: int, lost: int, moment: bytes, events: bytes) -> bytes:
    """Return a picture of ``moment`` and the newest MOST_EVENTS rows of ``events``; ``lost`` frames in LATELY_MS."""
    events = events[-MOST_EVENTS * EVENT_BYTES :]
    count = len(events) // EVENT_BYTES
    return _HEADER.pack(PICTURE, flags, 0, number & 0xFFFFFFFF, t_ms, cars, count, lost) + moment + events


def index_and_flags(moment: bytes, cars: int, car: int) -> tuple[int, int]:
    """Return two columns of a moment for a car: the index of its word, and its flags."""
    index = int.from_bytes(moment[12 * cars + 2 * car :][:2], "little")
    return index, moment[(CAR_BYTES - 1) * cars + car]


class StoredEvent(NamedTuple):
    """An event of a car; kind and reason are indices of `motorcade.engine.events`."""

    t_ms: int
    car: int
    kind: int
    why: int
    word: int
    other: int


class StoredMoment(NamedTuple):
    """A moment of the past, and all stored events of one car, also those of later."""

    t_ms: int
    moment: bytes
    events: list[StoredEvent]


class History:
    """Moments and events by time, each up to a number of bytes; the oldest are dropped."""

    def __init__(self, most_moment_bytes: int = MOST_MOMENT_BYTES, most_event_bytes: int = MOST_EVENT_BYTES):
        self.most_bytes = most_moment_bytes, most_event_bytes
        self._times: deque[int] = deque()
        self._moments: deque[bytes] = deque()
        self._events: deque[bytes] = deque()
        self._moment_bytes = self._event_bytes = 0
        # By time, how many frames were lost before; also of the LATELY_MS before the oldest moment.
        self._losses: deque[tuple[int, int]] = deque()

    def add_moment(self, t_ms: int, moment: bytes, lost: int = 0) -> None:
        """Store a moment that is later than all before; ``lost`` frames were lost from the beginning until then."""
        self._losses.append((t_ms, lost))
        self._times.append(t_ms)
        self._moments.append(moment)
        self._moment_bytes += len(moment) + _OBJECT_BYTES
        while self._moment_bytes > self.most_bytes[0] and len(self._moments) > 1:
            self._times.popleft()
            self._moment_bytes -= len(self._moments.popleft()) + _OBJECT_BYTES
        while len(self._losses) > 1 and self._losses[1][0] <= self.earliest_ms - LATELY_MS:
            self._losses.popleft()

    def add_events(self, events: bytes) -> None:
        """Store rows of events, sorted by time, that are later than all before."""
        if not events:
            return
        self._events.append(events)
        self._event_bytes += len(events) + _OBJECT_BYTES
        while self._event_bytes > self.most_bytes[1] and len(self._events) > 1:
            self._event_bytes -= len(self._events.popleft()) + _OBJECT_BYTES

    @property
    def earliest_ms(self) -> int:
        """The time of the oldest moment; 0 where there is none."""
        return self._times[0] if self._times else 0

    def moment_at(self, t_ms: int) -> tuple[int, bytes]:
        """Return time and bytes of the last moment at ``t_ms`` or before, or else of the oldest; there must be one."""
        at = max(bisect_right(self._times, t_ms) - 1, 0)
        return self._times[at], self._moments[at]

    def moments(self, from_ms: int) -> Iterator[tuple[int, bytes]]:
        """The times and the bytes of the moments from ``from_ms`` on, as they are stored now."""
        return iter([each for each in zip(self._times, self._moments, strict=True) if each[0] >= from_ms])

    def events_between(self, after_ms: int, until_ms: int) -> bytes:
        """The rows of the events later than ``after_ms`` and not later than ``until_ms``."""
        found = []
        for batch in self._events:
            first, last = _row_after(batch, after_ms), _row_after(batch, until_ms)
            found.append(batch[first * EVENT_BYTES : last * EVENT_BYTES])
        return b"".join(found)

    def lost_before(self, t_ms: int) -> int:
        """How many frames were lost before ``t_ms``, which is no earlier than the oldest moment less LATELY_MS."""
        at = bisect_right(self._losses, t_ms, key=lambda each: each[0]) - 1
        if at < 0:
            return 0
        stored_ms, lost = self._losses[at]
        between = self.events_between(stored_ms - 1, t_ms - 1) if t_ms > stored_ms else b""
        kinds: Iterator[tuple[int]] = _KIND.iter_unpack(between)
        return lost + sum(kind == LOST for (kind,) in kinds)

    def newest_events(self, most: int) -> bytes:
        """The last ``most`` rows."""
        batches: deque[bytes] = deque()
        size = 0
        for batch in reversed(self._events):
            batches.appendleft(batch)
            size += len(batch)
            if size >= most * EVENT_BYTES:
                break
        return b"".join(batches)[-most * EVENT_BYTES :]

    def events_of(self, car: int) -> list[StoredEvent]:
        """The events of a car, by time."""
        return [StoredEvent._make(row) for batch in self._events for row in _EVENT.iter_unpack(batch) if row[1] == car]

    def events(self) -> list[bytes]:
        """All rows, in batches."""
        return list(self._events)


def _row_after(batch: bytes, t_ms: int) -> int:
    """The index of the first row that is later than ``t_ms``."""
    rows = range(len(batch) // EVENT_BYTES)
    return bisect_right(rows, t_ms, key=lambda row: _TIME.unpack_from(batch, row * EVENT_BYTES)[0])
