"""A car that runs on a computer: its clock, its image store, its end and its watchdog."""

import os
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from motorcade.boards.computer import (
    ComputerBoard,
    Equipment,
    HardwareWatchdog,
    ImageStore,
    StoreError,
    run,
    run_many,
    sealed,
)
from motorcade.boards.lines import WaitingLine
from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.config.profile import levels_of
from motorcade.errors import MotorcadeError
from support.mock_pi import PiClock
from support.strategies import CLASSROOM

OLD = bytes.fromhex("02000000 64800000 6D000000")
NEW = bytes.fromhex("01000000 40280000")


class Crash(BaseException):
    """A cut of power."""


@pytest.fixture
def store(tmp_path):
    return ImageStore(tmp_path / "car" / "store.image")


def board(clock, **more):
    return ComputerBoard(
        Equipment(True, 3, levels_of(CLASSROOM), WaitingLine(), None, lambda data: None, clock_s=clock, **more)
    )


def test_a_car_with_only_a_clock_keeps_the_contract():
    clock = PiClock()
    car = board(clock)
    clock.now_s = 1.0005
    assert car.now_ms() == 1000
    clock.now_s = (1 << 30) / 1000 + 0.007
    assert car.now_ms() == 7
    assert (car.number, car.is_leader, car.load_image(), car.read_serial()) == (3, True, None, b"")
    assert (car.obstacle_mm(), car.sees_person(), car.heard_voice()) == (NOTHING_IN_SIGHT_MM, False, 0)


def test_a_car_waits_before_each_tick():
    clock, waits = PiClock(), []

    def wait(seconds: float) -> None:
        waits.append(seconds)
        clock.now_s += seconds

    run(board(clock), wait, lambda: clock.now_s >= 100.1)
    # A car ticks often enough to sense that the air is free for as long as its profile demands.
    assert max(waits) * 1000 < CLASSROOM.infrared.sense_ms


class ComputerPort(WaitingLine):
    """A line shared with others: how often its car read from it."""

    has_come, reads = False, 0

    def wait(self, seconds: float) -> None:
        pass

    def read(self) -> bytes:
        self.reads += 1
        return b""


def test_of_many_cars_those_are_ticked_for_which_something_came(monkeypatch):
    monkeypatch.setattr("motorcade.boards.computer.time", SimpleNamespace(monotonic=lambda: 0.0))
    ports, turns = [ComputerPort(), ComputerPort()], iter([False, False, True])
    ports[1].has_come = True
    boards = [ComputerBoard(Equipment(True, 0, levels_of(CLASSROOM), port, None, clock_s=PiClock())) for port in ports]
    run_many(list(zip(boards, ports, strict=True)), lambda: next(turns))
    assert [port.reads for port in ports] == [0, 1]


def test_a_car_whose_wheels_do_not_stop_is_closed_all_the_same():
    done = []

    class WatchedComputer(ComputerBoard):
        def set_wheels(self, direction: int, speed_level: int) -> None:
            done.append((direction, speed_level))
            raise OSError("a pin is stuck")

        def close(self) -> None:
            done.append("closed")

    made = WatchedComputer(Equipment(True, 0, levels_of(CLASSROOM), WaitingLine(), None, lambda data: None))
    with pytest.raises(OSError, match="stuck"):
        run(made, lambda seconds: None, lambda: True)
    assert done == [(0, 0), "closed"]


def test_a_store_keeps_the_last_image(store):
    assert store.load() is None
    store.save(OLD)
    store.save(NEW)
    assert ImageStore(store.path).load() == NEW
    assert list(store.path.parent.iterdir()) == [store.path]


def test_a_store_keeps_the_cars_name_and_gives_none_that_no_car_may_have(store):
    assert store.load_name() == ""
    store.save_name("ada")
    assert ImageStore(store.path).load_name() == "ada"
    for content in (*map(sealed, (b"a" * 200, b"ada\n", b"\xff")), b"ada", sealed(b"ada").replace(b"d", b"e")):
        store.path.with_name("store.image.name").write_bytes(content)
        assert store.load_name() == ""


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
    [
        *[(content, "checksum") for content in (b"", OLD, b"notes\n", sealed(OLD)[:-1], sealed(OLD) + b"\0")],
        (sealed(b""), "the image is empty"),
        (sealed(OLD[:-4]), "cut off"),
        (sealed(b"notes\n"), "no whole number"),
        (sealed(NEW + NEW), "too long"),
    ],
)
def test_a_file_that_is_no_image_is_refused_and_kept(store, content, says):
    store.path.parent.mkdir()
    store.path.write_bytes(content)
    with pytest.raises(StoreError, match=says) as raised:
        store.load()
    assert str(store.path) in str(raised.value)
    assert "--store" in str(raised.value)
    assert store.path.read_bytes() == content


def test_an_image_with_one_flipped_bit_is_not_run(store):
    store.save(OLD)
    whole = store.path.read_bytes()
    for bit in range(8 * len(whole)):
        flipped = bytearray(whole)
        flipped[bit // 8] ^= 1 << bit % 8
        store.path.write_bytes(flipped)
        with pytest.raises(StoreError, match="checksum"):
            store.load()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such watchdog")
def test_a_watchdog_gets_signs_of_life_and_is_disarmed_at_the_end(tmp_path):
    device = tmp_path / "watchdog"
    os.mkfifo(device)
    reader = os.open(device, os.O_RDONLY | os.O_NONBLOCK)
    watchdog = HardwareWatchdog(device)
    watchdog.keep_alive()
    watchdog.keep_alive()
    assert os.read(reader, 100) == b"\0\0"
    # The kernel's documentation: without a V before the end, the computer restarts.
    watchdog.close()
    assert os.read(reader, 100) == b"V"
    os.close(reader)
    with pytest.raises(MotorcadeError, match="run as root"):
        HardwareWatchdog(tmp_path / "none")
