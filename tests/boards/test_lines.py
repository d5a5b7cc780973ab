"""A simulated car at a TCP port; and a serial port that may go away."""

import socket
import time
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path

import pytest
import serial

from motorcade.boards.computer import ComputerBoard, Equipment, ImageStore, simulated_car
from motorcade.boards.lines import SerialLine, TcpPort
from motorcade.car.loop import Car
from motorcade.config.profile import levels_of
from motorcade.errors import MotorcadeError
from motorcade.upload import serial_port
from support.mock_pi import PiClock
from support.socket_lines import without_pauses
from support.strategies import CLASSROOM
from support.waiting import DEADLINE_S, wait_until

# A state of 1 s and one of 2 s; another program of one state.
OLD = bytes.fromhex("02000000 64800000 6D000000")
NEW = bytes.fromhex("01000000 40280000")
OK_NEW = b"OK words=2 crc32=04c29092\n"
READBACK_REQUEST = b"\0\0\0\xff"
NO_PROGRAM = b"\0\0\0\0"


@pytest.fixture(autouse=True)
def no_pauses(monkeypatch):
    """Keep pyserial from sleeping after each socket that it closes."""
    without_pauses(monkeypatch)


@pytest.fixture
def store(tmp_path):
    return ImageStore(tmp_path / "car" / "store.image")


class LineRig:
    """A simulated car whose loop and clock a test moves, and a client at the other end of its line."""

    def __init__(self, store):
        self.line = TcpPort("127.0.0.1", 0)
        self.now_s = 0.0
        self.events = []
        equipment = Equipment(
            True,
            0,
            levels_of(CLASSROOM),
            self.line,
            store.load(),
            store.save,
            observe=lambda *event: self.events.append(event),
            clock_s=lambda: self.now_s,
        )
        self.car = Car(ComputerBoard(equipment))
        self.client = serial.serial_for_url(self.line.address, timeout=0)

    def tick(self, times=1):
        for _ in range(times):
            self.line.wait(0)
            self.car.tick()

    def answer(self, data, count):
        """Return the first ``count`` bytes of the car's answer to ``data``."""
        self.client.write(data)
        got = b""
        end_s = time.monotonic() + DEADLINE_S
        while time.monotonic() < end_s:
            self.line.wait(0.001)
            self.car.tick()
            got += self.client.read(count - len(got))
            if len(got) == count:
                return got
        raise AssertionError(f"the car answered no more than {got}")

    def readback(self, length):
        return self.answer(READBACK_REQUEST, length)

    def close(self):
        self.client.close()
        self.line.close()


@contextmanager
def running_car(store):
    """Run a simulated car in a thread and give the address of its line."""
    line = TcpPort("127.0.0.1", 0)
    with closing(line), simulated_car(line, store, CLASSROOM):
        yield line.address


# A car whose clock the test moves


def test_a_new_image_is_stored_answered_and_run_at_once(store):
    with closing(LineRig(store)) as rig:
        assert rig.readback(4) == NO_PROGRAM
        assert rig.answer(NEW, len(OK_NEW)) == OK_NEW
        assert store.load() == NEW
        assert rig.readback(len(NEW)) == NEW
    assert [kind for kind, *_ in rig.events if kind != "frame"] == ["image", "state"]


def test_a_restart_keeps_the_image_and_runs_it(store):
    store.save(OLD)
    with closing(LineRig(store)) as restarted:
        assert restarted.readback(len(OLD)) == OLD
        restarted.now_s = 3.5
        restarted.tick()
    states = [(at_ms, word, index) for kind, at_ms, word, index in restarted.events if kind == "state"]
    assert states == [(0, 0x64800000, 0), (1000, 0x6D000000, 1), (3000, 0x64800000, 0)]


@pytest.mark.parametrize("cut", [1, 4, 7])
def test_an_upload_that_breaks_off_keeps_the_old_image_and_the_car_answers_again(store, cut):
    store.save(OLD)
    refusal = f"ERR cut off after {cut} bytes\n".encode()
    with closing(LineRig(store)) as rig:
        rig.tick()
        rig.client.write(NEW[:cut])
        rig.line.wait(DEADLINE_S)
        rig.tick(2)
        rig.now_s += 0.6
        assert rig.answer(b"", len(refusal)) == refusal
        assert rig.readback(len(OLD)) == OLD
        assert store.load() == OLD
        assert rig.answer(NEW, len(OK_NEW)) == OK_NEW
    assert store.load() == NEW


def test_an_image_that_cannot_be_stored_is_refused_and_the_old_one_stays(store, monkeypatch):
    def full(path, target):
        raise OSError("disk full")

    store.save(OLD)
    refusal = b"ERR the image could not be stored\n"
    with closing(LineRig(store)) as rig:
        with monkeypatch.context() as broken:
            broken.setattr(Path, "replace", full)
            assert rig.answer(NEW, len(refusal)) == refusal
        assert rig.readback(len(OLD)) == OLD
        assert store.load() == OLD
        assert rig.answer(NEW, len(OK_NEW)) == OK_NEW


# TCP, with one client at a time


def test_a_second_client_gets_the_answer_busy_and_the_first_goes_on(store):
    with running_car(store) as address, serial.serial_for_url(address, timeout=DEADLINE_S) as first:
        first.write(READBACK_REQUEST)
        assert first.read(4) == NO_PROGRAM
        with pytest.raises(MotorcadeError, match="busy with another uploader"):
            serial_port.upload(address, NEW, 115200)
        with pytest.raises(MotorcadeError, match="busy with another uploader"):
            serial_port.readback(address, 115200)
        first.write(NEW)
        assert first.read(len(OK_NEW)) == OK_NEW
    assert store.load() == NEW


def test_a_mute_client_gives_way_to_one_that_uploads():
    now_s = [0.0]
    with closing(TcpPort("127.0.0.1", 0, lambda: now_s[0])) as line, ExitStack() as clients:
        _, port = line.address.rsplit(":", 1)
        mute, other = (
            clients.enter_context(socket.create_connection(("127.0.0.1", int(port)), DEADLINE_S)) for _ in range(2)
        )

        def reads(data):
            line.wait(0.001)
            return line.read() == data

        mute.sendall(NEW[:4])
        wait_until(lambda: reads(NEW[:4]))
        other.sendall(NEW)
        other.setblocking(False)
        answers = []

        def is_answered(beginning):
            line.wait(0.001)
            with suppress(BlockingIOError):
                answers.append(other.recv(200))
            return any(answer.startswith(beginning) for answer in answers)

        wait_until(lambda: is_answered(b"ERR busy"))
        now_s[0] = 5.0
        assert line.read() == b""
        other.sendall(NEW)
        wait_until(lambda: reads(NEW))
        line.write(OK_NEW)
        wait_until(lambda: is_answered(OK_NEW))


def test_an_upload_waits_for_what_one_that_left_has_sent():
    with closing(TcpPort("127.0.0.1", 0)) as line, ExitStack() as clients:
        at = ("127.0.0.1", int(line.address.rpartition(":")[2]))
        first, other = (clients.enter_context(socket.create_connection(at, DEADLINE_S)) for _ in range(2))

        def has_come():
            line.wait(0.001)
            return line.has_come

        first.sendall(OLD)
        wait_until(has_come)
        first.close()
        other.sendall(NEW)
        # By now the line has seen both.
        for _ in range(20):
            line.wait(0.005)
        came = []

        def has_read_both():
            line.wait(0.001)
            came.append(line.read())
            return b"".join(came) == OLD + NEW

        wait_until(has_read_both)
        other.setblocking(False)
        with pytest.raises(BlockingIOError):
            other.recv(1)


# A serial port


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


def test_a_port_that_goes_away_gives_no_bytes_and_is_opened_again():
    clock, port = PiClock(), Port()
    clock.now_s = 0.0
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


def test_a_lost_port_is_tried_once_a_second():
    clock, port, tries = PiClock(), Port(), []
    clock.now_s = 0.0

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


def test_an_answer_that_nobody_reads_does_not_block_the_car():
    port = Port()
    line = SerialLine(port.open, PiClock())
    port.is_full = True
    line.write(b"lost")
    port.is_full, port.waiting = False, b"a"
    assert (line.read(), port.opened) == (b"a", 1)


def test_a_port_that_is_not_there_at_the_start_is_an_error():
    port = Port()
    port.is_there = False
    with pytest.raises(serial.SerialException):
        SerialLine(port.open, PiClock())
