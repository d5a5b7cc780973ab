"""Cars with a Raspberry Pi on gpiozero's mock pins, whose clock the tests set."""

from types import SimpleNamespace

import gpiozero.pins.mock as mock
import pytest
from gpiozero.pins.mock import MockFactory, MockPWMPin

from motorcade.boards.computer import Equipment
from motorcade.boards.linux.raspberry_pi import RaspberryPi
from motorcade.config.pins import parse_pins
from motorcade.config.profile import levels_of
from support.mock_pi import HEAD, Clock, Line, Sender
from support.strategies import CLASSROOM


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
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
    """Make cars from the text of a pin file; each has its board, line, sender, and the images that it stored."""
    boards = []

    def make(text: str, is_leader: bool = False, image: bytes | None = None) -> SimpleNamespace:
        line, sender, stored = Line(), Sender(clock), []
        levels = levels_of(CLASSROOM)
        equipment = Equipment(is_leader, 7, levels, line, image, stored.append, clock_s=clock)
        board = RaspberryPi(equipment, parse_pins(HEAD + text, "test.toml"), CLASSROOM, pins, sender)
        boards.append(board)
        return SimpleNamespace(board=board, line=line, sender=sender, stored=stored)

    yield make
    for board in boards:
        board.close()
