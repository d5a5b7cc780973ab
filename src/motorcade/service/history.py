"""The past of a world, as bytes, and the format of the pictures that a page draws of it.

All numbers are little-endian. A picture is its HEADER (``lost``: how many frames were lost in the last LATELY_MS), the
columns of a moment (`motorcade.engine.moment.PICTURED`, filled up to a multiple of four bytes), and rows of events
since the last picture (`motorcade.engine.moment.EVENT_ROW`). The engine's kernels pack moments and events.
"""

import struct
from bisect import bisect_right
from collections import deque
from collections.abc import Iterable, Iterator
from typing import Annotated, Generic, NamedTuple, TypeVar, get_type_hints

from motorcade.engine.events import KINDS, LOSS_REASONS, LOST
from motorcade.engine.moment import EVENT_BYTES, EVENT_ROW, Event, unpack_events
from motorcade.errors import MotorcadeError
from motorcade.service.messages import Text
from motorcade.words.infrared import tag_of, word_of

PICTURE = 1
# A picture's flags.
PAST = 1
FIRST = 2
MOST_EVENTS = 4000

EVERY_MS = 100
# The time whose lost frames a picture counts.
LATELY_MS = 5000
# How much of the past is stored: bytes of moments and of events.
PAST_BYTES = (24 << 20, 12 << 20)
# The approximate size in Python of an object without content.
_OBJECT_BYTES = 128
# The changes of what a page was told that are kept.
_MOST_TOLD = 4000


class Header(NamedTuple):
    """The header of a picture: its fields with the types that `struct` has for them."""

    kind: Annotated[int, "B"]
    flags: Annotated[int, "B"]
    reserved: Annotated[int, "H"]
    number: Annotated[int, "I"]
    t_ms: Annotated[int, "I"]
    cars: Annotated[int, "I"]
    events: Annotated[int, "I"]
    lost: Annotated[int, "I"]


HEADER = {name: hint.__metadata__[0] for name, hint in get_type_hints(Header, include_extras=True).items()}
_HEADER = struct.Struct("<" + "".join(HEADER.values()))
HEADER_BYTES = _HEADER.size
"""Where the columns of a picture begin."""


def header_of(picture: bytes) -> Header:
    """Read the header of a picture."""
    return Header._make(_HEADER.unpack_from(picture))


def pack_picture(number: int, flags: int, t_ms: int, cars: int, lost: int, moment: bytes, events: bytes) -> bytes:
    """Return a picture of ``moment`` and the newest MOST_EVENTS rows of ``events``; ``lost`` frames in LATELY_MS."""
    events = events[-MOST_EVENTS * EVENT_BYTES :]
    rows = len(events) // EVENT_BYTES
    return _HEADER.pack(PICTURE, flags, 0, number & 0xFFFFFFFF, t_ms, cars, rows, lost) + moment + events


def renumbered(picture: bytes, number: int) -> bytes:
    """Return a picture with another number."""
    return _HEADER.pack(*header_of(picture)._replace(number=number)) + picture[HEADER_BYTES:]


class _Past:
    """Pieces of the past by time, up to a number of bytes; the oldest are dropped."""

    def __init__(self, most_bytes: int) -> None:
        self.times: deque[int] = deque()
        self.pieces: deque[bytes] = deque()
        self._left_bytes = most_bytes

    def add(self, t_ms: int, piece: bytes) -> None:
        """Store a piece that is later than all before."""
        self.times.append(t_ms)
        self.pieces.append(piece)
        self._left_bytes -= len(piece) + _OBJECT_BYTES
        while self._left_bytes < 0 and len(self.pieces) > 1:
            self.times.popleft()
            self._left_bytes += len(self.pieces.popleft()) + _OBJECT_BYTES


class History:
    """Moments and events by time, each up to a number of bytes; the oldest are dropped."""

    def __init__(self, most_bytes: tuple[int, int] = PAST_BYTES):
        # Of a batch of events the time is that of its last row.
        self._moments, self._events = map(_Past, most_bytes)
        # By time, how many frames were lost before; also of the LATELY_MS before the oldest moment.
        self._losses: deque[tuple[int, int]] = deque()

    def add_moment(self, t_ms: int, moment: bytes, lost: int = 0) -> None:
        """Store a moment that is later than all before; ``lost`` frames were lost from the beginning until then."""
        self._losses.append((t_ms, lost))
        self._moments.add(t_ms, moment)
        while len(self._losses) > 1 and self._losses[1][0] <= self.earliest_ms - LATELY_MS:
            self._losses.popleft()

    def add_events(self, events: bytes) -> None:
        """Store rows of events, sorted by time, that are later than all before."""
        if events:
            self._events.add(EVENT_ROW.unpack_from(events, len(events) - EVENT_BYTES)[0], events)

    @property
    def earliest_ms(self) -> int:
        """The time of the oldest moment; 0 where there is none."""
        return next(iter(self._moments.times), 0)

    def moment_at(self, t_ms: int) -> tuple[int, bytes]:
        """Return time and bytes of the last moment at ``t_ms`` or before, or else of the oldest; there must be one."""
        times = self._moments.times
        at = max(bisect_right(times, t_ms) - 1, 0)
        return times[at], self._moments.pieces[at]

    def events_between(self, after_ms: int, until_ms: int) -> bytes:
        """The rows of the events later than ``after_ms`` and not later than ``until_ms``."""
        found = []
        # A page asks for the last moments with each picture: batches that are over before them are not looked at.
        for at in range(bisect_right(self._events.times, after_ms), len(self._events.pieces)):
            batch = self._events.pieces[at]
            first = _row_after(batch, after_ms)
            last = _row_after(batch, until_ms)
            found.append(batch[first * EVENT_BYTES : last * EVENT_BYTES])
            if last * EVENT_BYTES < len(batch):
                break
        return b"".join(found)

    def lost_before(self, t_ms: int) -> int:
        """How many frames were lost before ``t_ms``, which is no earlier than the oldest moment less LATELY_MS."""
        at = bisect_right(self._losses, t_ms, key=lambda loss: loss[0]) - 1
        if at < 0:
            return 0
        stored_ms, lost = self._losses[at]
        between = b""
        if t_ms > stored_ms:
            between = self.events_between(stored_ms - 1, t_ms - 1)
        return lost + sum(event.kind == LOST for event in unpack_events(between))

    def newest_events(self, most: int) -> bytes:
        """The last ``most`` rows."""
        batches: list[bytes] = []
        missing = most * EVENT_BYTES
        for batch in reversed(self._events.pieces):
            if missing <= 0:
                break
            batches.append(batch)
            missing -= len(batch)
        return b"".join(reversed(batches))[max(-missing, 0) :]

    def events_of(self, car: int) -> list[Event]:
        """The events of a car, by time."""
        return [
            Event._make(row) for batch in self._events.pieces for row in EVENT_ROW.iter_unpack(batch) if row[1] == car
        ]

    def events(self) -> list[bytes]:
        """All rows, in batches."""
        return list(self._events.pieces)


Shown = TypeVar("Shown")


class Timed(Generic[Shown]):
    """What a page was told by time, so that one which shows the past is told it again.

    Args:
        nothing: what holds before the first time.

    Attributes:
        now: what was told last.
    """

    def __init__(self, nothing: Shown) -> None:
        self._nothing = self.now = nothing
        self._past: deque[tuple[int, Shown]] = deque(maxlen=_MOST_TOLD)

    def keep(self, t_ms: int, told: Shown) -> None:
        """Keep what holds from a time on."""
        if told != self.now:
            self.now = told
            self._past.append((t_ms, told))

    def then(self, t_ms: int) -> Shown:
        """Return what held at a time."""
        return next((told for at_ms, told in reversed(self._past) if at_ms <= t_ms), self._nothing)


def _row_after(batch: bytes, t_ms: int) -> int:
    """The index of the first row that is later than ``t_ms``."""
    rows = range(len(batch) // EVENT_BYTES)
    return bisect_right(rows, t_ms, key=lambda row: EVENT_ROW.unpack_from(batch, row * EVENT_BYTES)[0])


def table_texts(batches: Iterable[bytes]) -> Iterator[str]:
    """Yield events as CSV: the columns' names, then each batch of rows (`motorcade.engine.moment.EVENT_ROW`)."""
    yield "t_ms,car,event,why,word,other,tag\r\n"
    for batch in batches:
        yield "".join(map(_row_text, unpack_events(batch)))


def _row_text(event: Event) -> str:
    t_ms, car, kind, why, word, other = event
    name = KINDS[kind]
    tag = 0
    if name == "start":
        tag = other
    elif name in ("frame", "heard") and tag_of(word):
        word, tag = word_of(word), tag_of(word)
    return f"{t_ms},{car},{name},{LOSS_REASONS[why]},0x{word:08X},{other},{tag}\r\n"


def event_table(rows: bytes) -> Text:
    """Return the page's events as CSV. Raises MotorcadeError where they aren't whole rows of events."""
    try:
        return Text("".join(table_texts([rows])))
    except (struct.error, IndexError):
        raise MotorcadeError("bad-message", reason="these are no rows of events") from None
