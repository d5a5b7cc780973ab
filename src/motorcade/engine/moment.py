"""What the cars of a world show at a moment, and what happened: the one table of each, and their bytes.

The kernels' arrays, the bytes of pictures and of stored moments, the columns of recordings and the page's decoder
follow from COLUMNS, to which devices add what their methods set or return. A new column needs a line in `Moment`
besides, and one in the kernel ``read_moment``. Bytes are little-endian. This module needs no NumPy.
"""

import math
import struct
from array import array
from collections import namedtuple
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, Self

from motorcade.devices import DEVICES
from motorcade.devices.declaration import Column
from motorcade.engine.backend import Backend, BackendArray
from motorcade.engine.state import CODES, Bytes, Flags, Metres, Words, width_of

_NONE: Mapping[str, Any] = MappingProxyType({})
# The index of a car that executes or holds none of the image's words.
NO_INDEX = 0xFFFF
# A car's flags in a picture: its word runs; its frame is on the air; it lost, or received, a frame since the moment
# before; it is to drive forward, and what it touches lets it go no further.
FLAGS = {"runs": 1, "sends": 2, "lost": 4, "heard": 8, "stuck": 16}
RUNS, SENDS, LOST, HEARD, STUCK = FLAGS.values()


class Moment(NamedTuple):
    """What the cars of a world show at one moment, in the order of their numbers.

    Engine, recordings, missions, pictures and cameras all use this one type. Columns are arrays of NumPy, or memory
    views where there is no NumPy.

    Attributes:
        t_ms: the simulated time.
        x_m, y_m, heading: float64 from a world, float32 in recordings.
        word: the word that each car executes or holds; 0 for none.
        runs: whether that word's length is not yet over.
        wheels: direction * 4 + speed level (directions forward, left, right); direction 3 where somebody drives the
            car.
        led: the LED that is on, 4 for none.
        sends: whether the car's frame is on the air.
        counts: what was counted since the run began, by name, as in `World.counts`; empty where they are not needed.
        world: which of the worlds side by side it is of.
        run: how often the worlds had been reset.
    """

    t_ms: int
    x_m: Metres
    y_m: Metres
    heading: Metres
    word: Words
    runs: Flags
    wheels: Bytes
    led: Bytes
    sends: Flags
    counts: Mapping[str, int] = _NONE
    world: int = 0
    run: int = 0

    def map(self, change: Callable[[str, Any], Any]) -> Self:
        """Return the moment with ``change(name, column)`` in place of each column."""
        return self._replace(**{name: change(name, getattr(self, name)) for name in COLUMNS})

    def in_single_precision(self) -> "Moment":
        """The same moment with positions and headings as float32, as recordings and pictures hold them."""
        return self.map(lambda name, column: _singles(column) if COLUMNS[name].packed == "float32" else column)

    def to_dict(self) -> dict[str, Any]:
        """The moment for JSON: lists in the order of car numbers, lengths and angles to a millionth."""
        import numpy as np

        lists = {
            column.recorded: (
                np.round(getattr(self, name).astype(float), 6) if column.packed == "float32" else getattr(self, name)
            ).tolist()
            for name, column in COLUMNS.items()
        }
        which = {"t_ms": self.t_ms, "world": self.world, "run": self.run}
        return {**which, "number": list(range(len(self.x_m))), **lists, "counts": dict(self.counts)}


def _singles(column: Any) -> Any:
    if isinstance(column, memoryview):
        return memoryview(array("f", column.tolist()))
    import numpy as np

    return np.asarray(column, np.float32)


_COLUMNS = (
    Column("x_m", "float64", "float32", unit="m"),
    Column("y_m", "float64", "float32", unit="m"),
    Column("heading", "float64", "float32", unit="rad", limits=(-math.pi, math.pi), recorded="heading_rad"),
    Column("word", "uint32", "uint32", is_pictured=False),
    Column("runs", "uint8", "bool", is_pictured=False),
    *(method.shown for device in DEVICES for method in device.methods if method.shown),
)
COLUMNS: Mapping[str, Column] = {column.name: column for column in _COLUMNS}
"""The columns of a moment by name."""

if TYPE_CHECKING:
    Columns = Moment
else:
    # The columns alone, as kernels take them.
    Columns = namedtuple("Columns", COLUMNS)


def allocate_columns(
    memory: Backend, slot: str, cars: int, packed: Mapping[str, BackendArray] = _NONE
) -> tuple[Columns, BackendArray]:
    """Return arrays for the columns of a moment, and the one array that holds those of float64.

    ``packed`` has those columns of a picture in which a kernel is to write.
    """
    wide = [name for name, column in COLUMNS.items() if column.dtype == "float64"]
    together = memory.zeros(f"{slot}.float64", (len(wide) * cars,), "float64")
    columns = {name: together[k * cars : (k + 1) * cars] for k, name in enumerate(wide)}
    for name in COLUMNS.keys() - columns.keys():
        there = packed[name] if name in packed else memory.zeros(f"{slot}.{name}", (cars,), COLUMNS[name].dtype)
        columns[name] = there
    return Columns(**{name: columns[name] for name in COLUMNS}), together


_PICTURED = {name: column.packed for name, column in COLUMNS.items() if column.is_pictured}
PICTURED: Mapping[str, str] = dict(
    sorted({**_PICTURED, "index": "uint16", "flags": "uint8"}.items(), key=lambda packed: -width_of(packed[1]))
)
"""The columns of a picture with their types, in the order of its bytes: wide ones first, so each begins at a multiple
of its width. ``index`` is that of the car's word among the image's words, or NO_INDEX; ``flags`` are FLAGS."""


CAR_BYTES = sum(map(width_of, PICTURED.values()))
"""The bytes of a car in a picture."""


def moment_bytes(cars: int) -> int:
    """The bytes of a picture's columns, up to a multiple of four."""
    return -(-CAR_BYTES * cars // 4) * 4


def places(cars: int) -> Iterator[tuple[str, int, int]]:
    """Yield the name of each column of a picture, and where its bytes begin and end."""
    end = 0
    for name, dtype in PICTURED.items():
        begin, end = end, end + width_of(dtype) * cars
        yield name, begin, end


def unpack_moment(data: bytes, cars: int) -> dict[str, Any]:
    """Return the columns of a picture, or of a stored moment, by name."""
    view = memoryview(data)
    return {name: view[begin:end].cast(CODES[PICTURED[name]]) for name, begin, end in places(cars)}


def to_moment(t_ms: int, data: bytes, cars: int, counts: Mapping[str, int] = _NONE) -> Moment:
    """Return the moment of a picture's columns; columns that pictures don't have are empty."""
    columns = unpack_moment(data, cars)
    return Moment(t_ms, counts=counts, **{name: columns.get(name, ()) for name in COLUMNS})


def first_cars(data: bytes, cars: int, shown: int) -> bytes:
    """Return the columns of the first ``shown`` cars of a picture of ``cars``."""
    if shown == cars:
        return data
    packed = b"".join(data[begin : begin + (end - begin) // cars * shown] for _, begin, end in places(cars))
    return packed + bytes(moment_bytes(shown) - len(packed))


def view_column(name: str, data: bytes) -> Any:
    """Return a column of a world's moment from its bytes."""
    return memoryview(data).cast(CODES[COLUMNS[name].dtype])


class Event(NamedTuple):
    """What happened to a car of one world; `motorcade.engine.events.EVENT` is the same for many worlds.

    Attributes:
        kind, why: indices of `motorcade.engine.events.KINDS` and LOSS_REASONS.
    """

    t_ms: int
    car: int
    kind: int
    why: int
    word: int
    other: int


# An event in a picture. For a page it is five numbers: kind is the lowest byte of the third, and why the one above.
EVENT_ROW = struct.Struct("<IIBBxxII")
EVENT_BYTES = EVENT_ROW.size


def unpack_events(rows: bytes) -> Iterator[Event]:
    """Yield the events of a picture's rows. Raises struct.error where they aren't whole rows."""
    return map(Event._make, EVENT_ROW.iter_unpack(rows))
