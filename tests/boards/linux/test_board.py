"""What every Linux car has: its clock, a serial port that may go away, its watchdog."""

import os
import sys

import pytest
import serial

from motorcade.boards.linux.board import Equipment, LinuxBoard, NoLine, run
from motorcade.boards.linux.errors import WatchdogError
from motorcade.boards.linux.hardware_watchdog import HardwareWatchdog
from motorcade.boards.linux.serial_line import SerialLine
from motorcade.boards.voice import VoiceSource
from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.config.profile import levels_of
from support.strategies import CLASSROOM


class Clock:
    """Seconds that pass only where a test says so."""

    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


class Port:
    """A serial port that can be pulled out."""

    def __init__(self) -> None:
        self.waiting = b""
        self.written = b""
        self.is_there = True
        self.is_full = False
        self.opened = 0

    def open(self) -> "Port":
        if not self.is_there:
            raise serial.SerialException("no such port")
        self.opened += 1
        return self

    @property
    def in_waiting(self) -> int:
        return len(self.waiting)

    def read(self, most: int) -> bytes:
        if not self.is_there:
            raise OSError("gone")
        data, self.waiting = self.waiting[:most], self.waiting[most:]
        return data

    def write(self, data: bytes) -> None:
        if not self.is_there:
            raise serial.SerialException("gone")
        if self.is_full:
            raise serial.SerialTimeoutException
        self.written += data

    def close(self) -> None:
        pass


def board(clock, **more):
    return LinuxBoard(
        Equipment(True, 3, levels_of(CLASSROOM), NoLine(), None, lambda data: None, clock_s=clock, **more)
    )


def test_a_car_of_nothing_but_a_clock_meets_the_contract():
    clock = Clock()
    car = board(clock)
    clock.now_s = 1.0005
    assert car.now_ms() == 1000
    clock.now_s = (1 << 30) / 1000 + 0.007
    assert car.now_ms() == 7
    assert (car.number, car.is_leader, car.load_image(), car.read_serial()) == (3, True, None, b"")
    assert (car.obstacle_mm(), car.sees_person(), car.heard_voice()) == (NOTHING_IN_SIGHT_MM, False, 0)


def test_an_image_that_cannot_be_kept_is_not_held():
    def refuse(data: bytes) -> None:
        raise OSError("disk full")

    car = LinuxBoard(Equipment(True, 0, levels_of(CLASSROOM), NoLine(), b"old", refuse))
    with pytest.raises(OSError, match="disk full"):
        car.store_image(b"new")
    assert car.load_image() == b"old"


def test_a_car_waits_and_ticks_by_turns_and_closes_its_voice():
    class Voice(VoiceSource):
        closed = False

        def close(self) -> None:
            self.closed = True

    clock, voice, waits = Clock(), Voice(), []

    def wait(seconds: float) -> None:
        waits.append(seconds)
        clock.now_s += seconds

    run(board(clock, voice=voice), wait, lambda: clock.now_s >= 0.1)
    # A car looks often enough to find the air free for as long as its profile asks.
    assert max(waits) * 1000 < CLASSROOM.infrared.sense_ms
    assert voice.closed


@pytest.mark.parametrize("fails", [False, True])
def test_a_car_is_put_in_neutral_before_its_pins_are_given_back(fails):
    done = []

    class Watched(LinuxBoard):
        def set_wheels(self, direction: int, speed_level: int) -> None:
            done.append((direction, speed_level))
            if fails:
                raise OSError("a pin is stuck")

        def set_led(self, which: int) -> None:
            done.append(which)

        def close(self) -> None:
            done.append("closed")

    made = Watched(Equipment(True, 0, levels_of(CLASSROOM), NoLine(), None, lambda data: None))
    if fails:
        with pytest.raises(OSError, match="stuck"):
            run(made, lambda seconds: None, lambda: True)
        assert done == [(0, 0), "closed"]
    else:
        run(made, lambda seconds: None, lambda: True)
        assert done == [(0, 0), 4, "closed"]


def test_a_port_that_goes_away_is_silent_and_comes_back():
    clock, port = Clock(), Port()
    line = SerialLine(port.open, clock)
    port.waiting = b"abc"
    assert line.read() == b"abc"
    assert line.read() == b""
    port.is_there = False
    assert line.read() == b""
    line.write(b"lost")
    port.is_there, port.waiting = True, b"def"
    clock.now_s = 0.9
    assert line.read() == b""
    clock.now_s = 1.0
    assert line.read() == b"def"
    line.write(b"kept")
    assert (port.written, port.opened) == (b"kept", 2)


def test_a_port_is_looked_for_once_a_second_until_it_is_there_again():
    clock, port, tries = Clock(), Port(), []

    def open_port() -> Port:
        tries.append(clock.now_s)
        return port.open()

    line = SerialLine(open_port, clock)
    port.is_there = False
    for tenth in range(41):
        clock.now_s = tenth / 10
        line.read()
        line.write(b"x")
    assert tries == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_an_answer_that_nobody_takes_doesnt_hold_the_car_up():
    port = Port()
    line = SerialLine(port.open, Clock())
    port.is_full = True
    line.write(b"lost")
    port.is_full, port.waiting = False, b"a"
    assert (line.read(), port.opened) == (b"a", 1)


def test_a_port_that_is_not_there_at_the_start_is_an_error():
    port = Port()
    port.is_there = False
    with pytest.raises(serial.SerialException):
        SerialLine(port.open, Clock())


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such watchdog")
def test_a_watchdog_is_fed_and_told_of_the_end(tmp_path):
    device = tmp_path / "watchdog"
    os.mkfifo(device)
    reader = os.open(device, os.O_RDONLY | os.O_NONBLOCK)
    watchdog = HardwareWatchdog(device)
    watchdog.feed()
    watchdog.feed()
    assert os.read(reader, 100) == b"\0\0"
    # Its documentation: without a V before the end, the computer restarts.
    watchdog.close()
    assert os.read(reader, 100) == b"V"
    os.close(reader)
    with pytest.raises(WatchdogError, match="run as root"):
        HardwareWatchdog(tmp_path / "none")
