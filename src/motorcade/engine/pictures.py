"""Pictures of one world for a page, and what happened to each of its cars, by kernels. This module needs no NumPy."""

from typing import NamedTuple

from motorcade.config.arguments import to_whole
from motorcade.engine import showing
from motorcade.engine.channel import REACHES, Reach
from motorcade.engine.events import LOSS_REASONS
from motorcade.engine.moment import PICTURED, allocate_columns, moment_bytes, places
from motorcade.engine.showing import MOST_NEAREST, TALLY_ROWS, Page, Tally
from motorcade.engine.simulation import Simulation

# The colours of the LEDs in pictures, films and what a camera sees.
LEDS = ("#ffd60a", "#00e5ff", "#b8ff3d", "#ff5cd6")


class Near(NamedTuple):
    """A car near another one: how far it is, and whether a frame of it would reach the other one now."""

    car: int
    distance_mm: int
    reach: Reach


class CarTally(NamedTuple):
    """How many frames a car sent and received, how many it lost by reason, and the last one that it received."""

    frames: int
    heard: int
    lost: dict[str, int]
    last_word: int
    last_sender: int
    last_ms: int


class Pictures:
    """Packs moments and events of a world, and counts its events for each car.

    Args:
        world: one world that keeps events; nobody else may take them. After a reset, make this object anew.
    """

    def __init__(self, world: Simulation) -> None:
        self._world = world
        memory = world.backend
        self._tally = Tally(
            memory.zeros("Tally.cars", (TALLY_ROWS, world.cars), "uint32"),
            memory.zeros("Tally.marks", (3, world.cars), "uint8"),
        )
        self._packed = memory.zeros("picture", (moment_bytes(world.cars),), "uint8")
        packed = {name: self._packed[begin:end].view(PICTURED[name]) for name, begin, end in places(world.cars)}
        # The kernel writes those columns of the moment that the picture has too where the picture has them.
        self._columns, wide = allocate_columns(world.backend, "picture", world.cars, packed)
        narrow = self._packed[: 4 * wide.shape[0]].view("float32")
        self._page = Page(wide, narrow, packed["index"], packed["flags"])

    def take_events(self) -> bytes:
        """Return the events since the last call, as rows of a picture (`motorcade.service.history`), by time."""
        world = self._world
        memory = self._world.backend
        rows = world.take_rows()
        packed = memory.zeros("packed events", (rows.shape[0], showing.EVENT_NUMBERS), "uint32")
        world.backend.call("note_events", rows, self._tally, packed)
        return memory.read(packed)

    def moment(self, is_stored: bool) -> bytes:
        """Return the columns of a moment, with the marks since the last call with the same ``is_stored``."""
        return self._pack(showing.STORED if is_stored else showing.PICTURED)

    def look(self) -> bytes:
        """Return the columns of a moment, without taking marks that are meant for a picture or a stored moment."""
        return self._pack(showing.ASKED)

    def index_of(self, car: int) -> int:
        """Return the index, among the image's words, of what a car executes or holds; NO_INDEX for none."""
        car = self._checked(car)
        self._pack(showing.ASKED)
        return int.from_bytes(self._world.backend.read(self._page.index[car : car + 1]), "little")

    def _checked(self, car: int) -> int:
        return to_whole("car", car, 0, self._world.cars - 1)

    def _pack(self, purpose: int) -> bytes:
        world = self._world
        world.read_moment(into=self._columns)
        world.backend.call("pack_picture", purpose, world.tick, world.arrays(), self._columns, self._tally, self._page)
        return world.backend.read(self._packed)

    def counted(self, car: int) -> CarTally:
        """Return what has happened to a car."""
        car, memory = self._checked(car), self._world.backend
        rows = (self._tally.cars[row, car : car + 1] for row in range(TALLY_ROWS))
        column = [int.from_bytes(memory.read(row), "little") for row in rows]
        first = showing.LOST_FRAMES
        lost = {why: column[first + k] for k, why in enumerate(LOSS_REASONS) if why}
        return CarTally(column[showing.FRAMES], column[showing.FRAMES_HEARD], lost, *column[showing.LAST_WORD :])

    def nearest(self, car: int) -> tuple[list[Near], list[Near]]:
        """Return the cars nearest to one: those that have sent frames, and those that have only received some."""
        car, world, memory = self._checked(car), self._world, self._world.backend
        away = memory.zeros("away", (2, MOST_NEAREST), "float64")
        found = memory.zeros("nearest", (2, MOST_NEAREST, 3), "int64")
        world.backend.call("find_nearest", car, world.arrays(), self._tally, away, found)
        numbers = memoryview(memory.read(found)).cast("q").tolist()
        rows = [numbers[at : at + 3] for at in range(0, len(numbers), 3)]
        parts = rows[:MOST_NEAREST], rows[MOST_NEAREST:]
        near = [[Near(row[0], row[1], REACHES[row[2]]) for row in part if row[0] >= 0] for part in parts]
        return near[showing.SENDERS], near[showing.LISTENERS]
