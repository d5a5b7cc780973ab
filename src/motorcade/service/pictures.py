"""The binary pictures of a world that a page draws, little-endian.

A picture is a header, what the cars show (`PictureColumns`), and what happened since the picture before (rows of
EVENT_ROW). Headings are radians counter-clockwise from the x axis, ``wheels`` is direction * 4 + speed level.
"""

import struct
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

PICTURE = 1
# A picture's flags.
PAST = 1
FIRST = 2
# A car's flags.
RUNS = 1
SENDS = 2
LOST = 4
HEARD = 8
NO_INDEX = 0xFFFF
MOST_EVENTS = 4000

_HEADER = struct.Struct("<BBHIIII")
EVENT_ROW = np.dtype(
    [
        ("t_ms", "<u4"),
        ("car", "<u4"),
        ("kind", "u1"),
        ("why", "u1"),
        ("reserved", "<u2"),
        ("word", "<u4"),
        ("other", "<u4"),
    ]
)
# Wide columns first, so that each begins where its kind of number may.
_COLUMNS = (
    ("x_m", "<f4"),
    ("y_m", "<f4"),
    ("heading", "<f4"),
    ("held", "<u2"),
    ("wheels", "u1"),
    ("led", "u1"),
    ("flags", "u1"),
)


class PictureColumns(NamedTuple):
    """A `motorcade.engine.moment.Moment` as the columns of a picture, in the order of the cars' numbers.

    ``held`` is the index of the word that each executes or holds, among the image's words; NO_INDEX for none.
    """

    t_ms: int
    x_m: NDArray[np.float32]
    y_m: NDArray[np.float32]
    heading: NDArray[np.float32]
    held: NDArray[np.uint16]
    wheels: NDArray[np.uint8]
    led: NDArray[np.uint8]
    flags: NDArray[np.uint8]

    def pack(self) -> bytes:
        """The columns, one behind the other, filled up to a whole number of four bytes."""
        packed = b"".join([np.asarray(getattr(self, name)).astype(kind).tobytes() for name, kind in _COLUMNS])
        return packed + bytes(-len(packed) % 4)

    @classmethod
    def unpack(cls, t_ms: int, data: bytes, cars: int) -> "PictureColumns":
        """What ``pack`` made of so many cars."""
        columns, at = [], 0
        for _, kind in _COLUMNS:
            columns.append(np.frombuffer(data, kind, cars, at))
            at += columns[-1].nbytes
        return cls(t_ms, *columns)


def event_rows(events: NDArray[np.void]) -> NDArray[np.void]:
    """Events of `motorcade.engine.events.EVENT` as a picture has them."""
    rows = np.zeros(len(events), EVENT_ROW)
    for name in ("t_ms", "car", "kind", "why", "word", "other"):
        rows[name] = events[name]
    return rows


def pack_picture(number: int, flags: int, t_ms: int, cars: int, moment: bytes, events: NDArray[np.void]) -> bytes:
    """A picture's bytes: ``moment`` as packed, and the newest MOST_EVENTS rows of ``events``."""
    events = events[-MOST_EVENTS:]
    return _HEADER.pack(PICTURE, flags, 0, number & 0xFFFFFFFF, t_ms, cars, len(events)) + moment + events.tobytes()
