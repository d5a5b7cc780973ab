"""The virtual car: what it stores, whom it answers, and how it ends."""

import select
import shutil
import signal
import subprocess
import sys
import threading
import time
from contextlib import closing, contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest
import serial
from serial.urlhandler import protocol_socket

from motorcade.boards import simulated as virtual_car
from motorcade.boards.simulated import ImageStore, PseudoTerminal, StoreError, TcpPort, VirtualBoard
from motorcade.car.loop import Car
from motorcade.config.profile import built_in_profile
from motorcade.upload import serial_port
from motorcade.upload.failures import PortBusyError

INSTALLED = shutil.which("motorcade", path=str(Path(sys.executable).parent))
CLASSROOM = built_in_profile("classroom")
DEADLINE_S = 60
# A state of 1 s and one of 2 s; another program of one state.
OLD = bytes.fromhex("02000000 64800000 6D000000")
NEW = bytes.fromhex("01000000 40280000")
OK_NEW = b"OK words=2 crc32=04c29092\n"
READBACK_REQUEST = b"\0\0\0\xff"
NO_PROGRAM = b"\0\0\0\0"
PTY = pytest.param("pty", marks=pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals"))
every_line = pytest.mark.parametrize("kind", [PTY, "tcp"])


class Crash(BaseException):
    """The power goes."""


@pytest.fixture(autouse=True)
def no_pauses(monkeypatch):
    """pyserial rests a while after each socket that it closes."""
    monkeypatch.setattr(protocol_socket, "time", SimpleNamespace(sleep=lambda seconds: None))


@pytest.fixture
def store(tmp_path):
    return ImageStore(tmp_path / "car" / "store.image")


class Rig:
    """A virtual car whose loop and clock a test moves by hand, and a client at the other end of its line."""

    def __init__(self, kind, store):
        self.line = PseudoTerminal() if kind == "pty" else TcpPort("127.0.0.1", 0)
        self.now_s = 0.0
        self.noted = []
        board = VirtualBoard(self.line, store, CLASSROOM, lambda *noted: self.noted.append(noted), lambda: self.now_s)
        self.car = Car(board)
        self.client = serial.serial_for_url(self.line.address, timeout=0)

    def tick(self, times=1):
        for _ in range(times):
            self.line.wait(0)
            self.car.tick()

    def answer(self, data, count):
        """What the car has answered to ``data`` by the time that ``count`` bytes are there."""
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
def driven(kind, store):
    """The address of a virtual car that drives by itself, in a thread."""
    stop = threading.Event()
    with closing(PseudoTerminal() if kind == "pty" else TcpPort("127.0.0.1", 0)) as line:
        board = VirtualBoard(line, store, CLASSROOM, lambda *noted: None, virtual_car.monotonic_clock())
        driving = threading.Thread(target=virtual_car.serve, args=(board, line, stop.is_set))
        driving.start()
        try:
            yield line.address
        finally:
            stop.set()
            driving.join(DEADLINE_S)


@pytest.fixture
def rig(kind, store):
    with closing(Rig(kind, store)) as made:
        yield made


# The store


def test_a_store_keeps_the_last_image(store):
    assert store.load() is None
    store.save(OLD)
    store.save(NEW)
    assert ImageStore(store.path).load() == NEW
    assert list(store.path.parent.iterdir()) == [store.path]


@pytest.mark.parametrize("problem", [Crash, OSError])
def test_a_crash_between_writing_and_replacing_leaves_the_old_image(store, monkeypatch, problem):
    def crash(path, target):
        raise problem("just now")

    store.save(OLD)
    monkeypatch.setattr(Path, "replace", crash)
    with pytest.raises(problem):
        store.save(NEW)
    assert ImageStore(store.path).load() == OLD
    assert problem is Crash or list(store.path.parent.iterdir()) == [store.path]


@pytest.mark.parametrize(
    ("content", "says"),
    [(b"", "the image is empty"), (OLD[:-4], "cut off"), (b"notes\n", "no whole number"), (NEW + NEW, "too long")],
)
def test_a_file_that_is_no_image_is_refused_and_kept(store, content, says):
    store.path.parent.mkdir()
    store.path.write_bytes(content)
    with pytest.raises(StoreError, match=says) as raised:
        store.load()
    assert str(store.path) in str(raised.value)
    assert "--store" in str(raised.value)
    assert store.path.read_bytes() == content


# The car, its clock moved by hand


@every_line
def test_a_car_without_a_program_gives_back_the_empty_image(rig):
    assert rig.readback(4) == NO_PROGRAM


@every_line
def test_a_new_image_is_stored_answered_and_run_at_once(rig, store):
    assert rig.answer(NEW, len(OK_NEW)) == OK_NEW
    assert store.load() == NEW
    assert rig.readback(len(NEW)) == NEW
    assert [kind for kind, *_ in rig.noted if kind != "frame"] == ["image", "state"]


@every_line
def test_a_restart_keeps_the_image_and_runs_it(kind, store):
    store.save(OLD)
    with closing(Rig(kind, store)) as restarted:
        assert restarted.readback(len(OLD)) == OLD
        restarted.now_s = 3.5
        restarted.tick()
    states = [(at_ms, word, index) for kind, at_ms, word, index in restarted.noted if kind == "state"]
    assert states == [(0, 0x64800000, 0), (1000, 0x6D000000, 1), (3000, 0x64800000, 0)]


@every_line
@pytest.mark.parametrize("cut", [1, 4, 7])
def test_an_upload_that_breaks_off_keeps_the_old_image_and_the_car_answers_again(kind, store, cut):
    store.save(OLD)
    refusal = f"ERR cut off after {cut} bytes\n".encode()
    with closing(Rig(kind, store)) as rig:
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


@every_line
def test_bytes_that_are_no_image_are_refused_and_skipped_until_silence(kind, store):
    store.save(OLD)
    with closing(Rig(kind, store)) as rig:
        assert rig.answer(bytes.fromhex("01010300") + OLD * 9, 4) == b"ERR "
        rig.tick(5)
        assert b"image-header word=0x01010300" in rig.client.read(500)
        rig.client.write(NEW)
        rig.line.wait(DEADLINE_S)
        rig.tick(2)
        assert rig.client.read(500) == b""
        rig.now_s += 0.6
        rig.tick()
        assert rig.answer(NEW, len(OK_NEW)) == OK_NEW
    assert store.load() == NEW


@every_line
def test_an_image_that_cannot_be_stored_is_refused_and_the_old_one_stays(kind, store, monkeypatch):
    def full(path, target):
        raise OSError("disk full")

    store.save(OLD)
    refusal = b"ERR the image could not be stored\n"
    with closing(Rig(kind, store)) as rig:
        with monkeypatch.context() as broken:
            broken.setattr(Path, "replace", full)
            assert rig.answer(NEW, len(refusal)) == refusal
        assert rig.readback(len(OLD)) == OLD
        assert store.load() == OLD
        assert rig.answer(NEW, len(OK_NEW)) == OK_NEW


# The lines: a pseudo-terminal, and TCP with one client at a time


@pytest.mark.parametrize("kind", [PTY])
def test_a_pseudo_terminal_carries_every_byte_as_it_is(kind):
    with closing(PseudoTerminal()) as line, Path(line.address).open("r+b", buffering=0) as client:
        client.write(bytes(range(256)))
        line.wait(DEADLINE_S)
        assert line.read() == bytes(range(256))
        line.write(bytes(range(256)))
        assert client.read(500) == bytes(range(256))


@every_line
def test_who_tries_again_at_once_after_an_upload_that_broke_off_succeeds(kind, store):
    with driven(kind, store) as address:
        with serial.serial_for_url(address) as client:
            client.write(NEW[:6])
            client.flush()
        assert serial_port.upload(address, NEW, 115200) == OK_NEW.decode().strip()
    assert store.load() == NEW


def test_a_second_client_is_told_busy_and_the_first_goes_on(store):
    with driven("tcp", store) as address, serial.serial_for_url(address, timeout=DEADLINE_S) as first:
        first.write(READBACK_REQUEST)
        assert first.read(4) == NO_PROGRAM
        with pytest.raises(PortBusyError, match="busy with another uploader"):
            serial_port.upload(address, NEW, 115200)
        with pytest.raises(PortBusyError, match="busy with another uploader"):
            serial_port.readback(address, 115200)
        first.write(NEW)
        assert first.read(len(OK_NEW)) == OK_NEW
    assert store.load() == NEW


def test_who_comes_as_the_first_client_leaves_is_served(store):
    with closing(Rig("tcp", store)) as rig:
        assert rig.readback(4) == NO_PROGRAM
        rig.client.close()
        rig.client = serial.serial_for_url(rig.line.address, timeout=0)
        assert rig.readback(4) == NO_PROGRAM


def test_a_client_that_leaves_in_the_middle_does_not_stop_the_car(store):
    with closing(Rig("tcp", store)) as rig:
        rig.client.write(NEW[:6])
        rig.client.close()
        rig.tick(5)
        rig.now_s += 0.6
        rig.tick()
        rig.client = serial.serial_for_url(rig.line.address, timeout=0)
        assert rig.answer(NEW, len(OK_NEW)) == OK_NEW


# The process


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no signals to send")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
@pytest.mark.parametrize("where", [["--pty"], ["--tcp", "127.0.0.1:0"]], ids=["pty", "tcp"])
def test_a_signal_ends_the_car_in_peace(store, where, number):
    store.save(OLD)
    command = [INSTALLED, "virtual-car", *where, "--store", str(store.path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as car:
        try:
            assert select.select([car.stdout], [], [], DEADLINE_S)[0]
            assert b"A virtual car waits at " in car.stdout.readline()
            car.send_signal(number)
            _, complaints = car.communicate(timeout=DEADLINE_S)
        finally:
            car.kill()
    assert (car.returncode, complaints) == (0, b"")
    assert store.load() == OLD
