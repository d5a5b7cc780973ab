"""Cars with a Raspberry Pi on gpiozero's mock pins, whose clock the tests set."""

from types import SimpleNamespace

import gpiozero.pins.mock as mock
import pytest
from gpiozero.pins.mock import MockFactory, MockPWMPin

from motorcade.boards.computer import Equipment
from motorcade.boards.linux.raspberry_pi import RaspberryPi
from motorcade.config.pins import parse_pins
from motorcade.config.profile import levels_of
from support.mock_pi import HEAD, PiClock, PiLine, PiObserver, Sender, Voice
from support.strategies import CLASSROOM


@pytest.fixture
def clock(monkeypatch):
    clock = PiClock()
    monkeypatch.setattr(mock, "monotonic", clock)
    return clock


@pytest.fixture
def pins(clock):
    factory = MockFactory(pin_class=MockPWMPin)
    yield factory
    factory.close()
    factory.reset()


@pytest.fixture
def car(clock, pins):
    """Make cars from the text of a pin file; each has its board, line, sender, stored images and observer."""
    boards = []

    def make(text: str, is_leader: bool = False, image: bytes | None = None) -> SimpleNamespace:
        line, sender, stored, voice = PiLine(), Sender(clock), [], Voice()
        levels = levels_of(CLASSROOM)
        equipment = Equipment(is_leader, 7, levels, line, image, stored.append, voice, clock_s=clock)
        wired = parse_pins(HEAD + text, "test.toml")
        board = RaspberryPi(equipment, wired, CLASSROOM, pins, sender)
        boards.append(board)
        observer = PiObserver(line, voice, wired, pins, sender)
        return SimpleNamespace(board=board, line=line, sender=sender, stored=stored, observer=observer)

    yield make
    for board in boards:
        board.close()
