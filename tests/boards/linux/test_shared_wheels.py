"""Wheels that a driver and a program share stop where a write to the hardware hangs or fails."""

import threading

import pytest

from motorcade.boards.linux.programmed_drive import SharedWheels
from support.waiting import DEADLINE_S

STILL, AHEAD, TURN, DRIVEN = (0, 0), (0, 3), (1, 2), (90, 1, 255)


class Hardware:
    """Note each write; a write hangs or fails where a test asks for it."""

    def __init__(self) -> None:
        self.done = []
        self.problem = None
        self.hangs, self.is_hanging, self.thaws = False, threading.Event(), threading.Event()

    def _write(self, what):
        if self.problem:
            raise self.problem
        if self.hangs:
            self.is_hanging.set()
            assert self.thaws.wait(DEADLINE_S)
        self.done.append(what)

    def set(self, direction, speed_level):
        self._write((direction, speed_level))

    def apply(self, angle_deg, direction, speed):
        self._write((angle_deg, direction, speed))

    def neutral(self):
        # This write doesn't hang: the tests hang the program's.
        self.done.append("neutral")


@pytest.fixture
def hardware():
    return Hardware()


@pytest.fixture
def shared(hardware):
    return SharedWheels(hardware, lambda: 0, max_silence_ms=150)


def programmed(shared):
    shared.neutral()
    shared.set(*AHEAD)
    shared.begin_program()
    return shared


def hanging(hardware, call, *arguments):
    """Run ``call`` in a thread, which hangs in the hardware."""
    hardware.hangs = True
    thread = threading.Thread(target=call, args=arguments, daemon=True)
    thread.start()
    assert hardware.is_hanging.wait(DEADLINE_S)
    return thread


def thaw(hardware, thread):
    hardware.thaws.set()
    thread.join(DEADLINE_S)
    assert not thread.is_alive()


def test_the_wheels_get_the_programs_latest_setpoint(shared, hardware):
    shared.neutral()
    shared.set(*AHEAD)
    shared.set(*TURN)
    assert hardware.done == ["neutral"]
    shared.begin_program()
    shared.set(*AHEAD)
    assert hardware.done == ["neutral", TURN, AHEAD]
    shared.end_program()
    shared.apply(*DRIVEN)
    shared.set(*TURN)
    assert hardware.done[-1] == DRIVEN


def test_neutral_stops_wheels_in_which_the_program_hangs_for_good(shared, hardware):
    programmed(shared)
    thread = hanging(hardware, shared.set, *TURN)
    shared.neutral()
    assert hardware.done == ["neutral", AHEAD, "neutral"]
    thaw(hardware, thread)
    assert hardware.done == ["neutral", AHEAD, "neutral", TURN, "neutral"]
    with pytest.raises(OSError, match="were stopped"):
        shared.check_program()


def test_a_command_fails_while_the_program_hangs_in_the_wheels(shared, hardware):
    programmed(shared)
    thread = hanging(hardware, shared.set, *TURN)
    shared.end_program()
    with pytest.raises(OSError, match="hangs in the hardware"):
        shared.apply(*DRIVEN)
    thaw(hardware, thread)
    assert hardware.done[-2:] == [TURN, "neutral"]


def test_neutral_stops_a_program_that_hangs_as_it_begins(shared, hardware):
    shared.set(*AHEAD)
    thread = hanging(hardware, shared.begin_program)
    shared.neutral()
    thaw(hardware, thread)
    assert hardware.done == ["neutral", AHEAD, "neutral"]


def test_a_failing_write_of_the_program_stops_the_wheels_and_is_reported(shared, hardware):
    programmed(shared)
    hardware.problem = OSError("the cable is out")
    shared.set(*TURN)
    assert hardware.done == ["neutral", AHEAD, "neutral"]
    with pytest.raises(OSError, match="the cable is out"):
        shared.check_program()
    with pytest.raises(OSError, match="the cable is out"):
        shared.begin_program()
    hardware.problem = None
    shared.begin_program()
    shared.check_program()
    assert hardware.done[-1] == TURN


def test_a_fault_of_the_program_does_not_stop_the_driver(shared, hardware):
    shared.apply(*DRIVEN)
    shared.fail(OSError("the LEDs are out"))
    assert hardware.done == [DRIVEN]


def test_a_paused_program_stands_still_and_then_continues(shared, hardware):
    programmed(shared)
    with shared.paused():
        shared.set(*TURN)
    assert hardware.done == ["neutral", AHEAD, STILL, STILL, TURN]
    shared.end_program()
    shared.apply(*DRIVEN)
    with shared.paused():
        pass
    assert hardware.done[-1] == DRIVEN
