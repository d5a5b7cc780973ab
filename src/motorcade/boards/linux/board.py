"""What every car has that runs Linux: a clock, a line for uploads, an image in a file, a voice.

Alone it is a simulated car: all the rest of its board isn't there.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from motorcade.boards.voice import VoiceSource
from motorcade.car.board import Board
from motorcade.car.brain import NO_LED
from motorcade.car.loop import Car
from motorcade.words.ticks import TICKS_MASK

# Shorter than the shortest time for which a car listens before it passes a word on.
TICK_S = 0.004


class Line(Protocol):
    """The car's end of the line that uploads come by."""

    def wait(self, seconds: float) -> None:
        """Until bytes may be there, or ``seconds`` have gone."""

    def read(self) -> bytes:
        """The bytes that are there; never waits."""

    def write(self, data: bytes) -> None:
        """Send ``data``; lost where nobody is connected."""

    def close(self) -> None:
        """Give the line up."""


class NoLine:
    """The line of a car that takes no uploads."""

    def wait(self, seconds: float) -> None:
        """See Line."""
        time.sleep(seconds)

    def read(self) -> bytes:
        """See Line."""
        return b""

    def write(self, data: bytes) -> None:
        """See Line."""

    def close(self) -> None:
        """See Line."""


def _tell_nobody(kind: str, at_ms: int, word: int, detail: int | str) -> None:
    """Not everybody wants to know."""


@dataclass(frozen=True)
class Equipment:
    """What a car is given when it is switched on.

    Attributes:
        is_leader, number, levels: as in `motorcade.car.board.Board`.
        line: where uploads come from.
        image: the stored image, None for none.
        save: keeps an image, whole or not at all. Raises OSError.
        voice: where 'stop' and 'go' come from.
        observe: hears what a car's loop notes: (kind, at_ms, word, detail).
        clock_s: a clock in seconds that never goes back.
    """

    is_leader: bool
    number: int
    levels: tuple[int, ...]
    line: Line
    image: bytes | None
    save: Callable[[bytes], None]
    voice: VoiceSource = field(default_factory=VoiceSource)
    observe: Callable[[str, int, int, int | str], None] = _tell_nobody
    clock_s: Callable[[], float] = time.monotonic

    def now_ms(self) -> int:
        """The clock as a board tells it: milliseconds that wrap."""
        return int(self.clock_s() * 1000) & TICKS_MASK


class LinuxBoard(Board):
    """A car without wheels and lights; `motorcade.boards.linux.raspberry_pi` adds them."""

    def __init__(self, equipment: Equipment) -> None:
        self.is_leader = equipment.is_leader
        self.number = equipment.number
        self.levels = equipment.levels
        self._equipment = equipment
        self._image = equipment.image

    def now_ms(self) -> int:
        return self._equipment.now_ms()

    def load_image(self) -> bytes | None:
        return self._image

    def store_image(self, data: bytes) -> None:
        self._equipment.save(data)
        self._image = data

    def read_serial(self) -> bytes:
        return self._equipment.line.read()

    def write_serial(self, data: bytes) -> None:
        self._equipment.line.write(data)

    def heard_voice(self) -> int:
        return self._equipment.voice.heard()

    def note(self, kind: str, at_ms: int, word: int, detail: int | str) -> None:
        self._equipment.observe(kind, at_ms, word, detail)

    def neutral(self) -> None:
        """Stand still, in the dark."""
        self.set_wheels(0, 0)
        self.set_led(NO_LED)

    def close(self) -> None:
        """Give up what the board holds; outputs are then as at power-on."""
        self._equipment.voice.close()


def run(board: LinuxBoard, wait: Callable[[float], None], stops: Callable[[], bool]) -> None:
    """Run the car until ``stops()``, and leave it in neutral however that ends.

    Args:
        wait: called before each tick with the seconds until it; may come back early where bytes have come.
        stops: asked before each tick.
    """
    car = Car(board)
    try:
        while not stops():
            wait(TICK_S)
            car.tick()
    finally:
        try:
            board.neutral()
        finally:
            board.close()
