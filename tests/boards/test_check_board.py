"""check_board: boards that keep the contract pass, and each that breaks it is told how, in a sentence."""

import re
import threading
import time
from functools import partial
from pathlib import Path

import pytest
from driven_car import Bench
from tin_car import Tin, TinBoard

import roverhat
from motorcade import check_board
from motorcade.boards.pins import parse_pins
from motorcade.car.board import Board
from motorcade.car.check.parts import METHODS
from motorcade.firmware.bundle import templates
from motorcade.firmware.settings import settings_of
from motorcade.profile import built_in_profile
from motorcade.sim.virtual_car import ImageStore, VirtualBoard, monotonic_clock

# A cut of power closes no files.
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
CLASSROOM = built_in_profile("classroom")
DOCS = Path(__file__).parents[2] / "docs"
SMALL = bytes.fromhex("01000000 64800000")


def test_a_board_in_fewer_than_a_hundred_lines_passes():
    source = (Path(__file__).parent / "tin_car.py").read_text(encoding="utf-8")
    assert len(source.splitlines()) < 100


def checked(kind: type, folder: Path) -> list[str]:
    """What check_board says of a board of ``kind`` on a tin."""
    tin = Tin()
    tin_board = kind(tin, folder)

    def wait_ms(duration_ms):
        tin.now_s += duration_ms / 1000

    def say(data):
        tin.line_in += data

    reopen = partial(kind, tin, folder)
    return check_board(tin_board, reopen, wait_ms, hear=lambda frame: tin.to_report.append(frame), say=say)


def test_a_board_that_keeps_the_contract_passes_and_has_its_image_again(tmp_path):
    board = TinBoard(Tin(), tmp_path)
    board.store_image(SMALL)
    assert checked(TinBoard, tmp_path) == []
    assert board.load_image() == SMALL


def test_where_no_image_was_the_empty_one_is_left(tmp_path):
    assert checked(TinBoard, tmp_path) == []
    assert TinBoard(Tin(), tmp_path).load_image() == bytes(4)


class RealClock(TinBoard):
    """A tin in real time."""

    def now_ms(self):
        self.tin.now_s = time.monotonic()
        return int(self.tin.now_s * 1000) & 0x3FFFFFFF


def test_a_board_in_real_time_passes_too(tmp_path):
    assert check_board(RealClock(Tin(), tmp_path)) == []


def test_the_virtual_car_passes(tmp_path):
    class Nobody:
        address = ""

        def read(self):
            return b""

        def write(self, data):
            pass

    store = ImageStore(tmp_path / "car.image")
    board = partial(VirtualBoard, Nobody(), store, CLASSROOM, lambda *noted: None, monotonic_clock())
    assert check_board(board(), reopen=board) == []


@pytest.mark.parametrize(("chip", "platform"), [("esp32", "esp32"), ("rp2040", "rp2")])
@pytest.mark.parametrize("is_leader", [True, False])
def test_a_micropython_car_passes(chip, platform, is_leader):
    text = (templates() / f"{chip}.toml").read_text(encoding="utf-8")
    bench = Bench(settings_of(parse_pins(text, chip), CLASSROOM, is_leader), platform)
    hear = None if is_leader else lambda frame: bench.hear_frame(frame)
    check = partial(check_board, wait_ms=bench.clock.sleep_ms, hear=hear, say=bench.usb.arrive)
    assert check(bench.open().board) == []


# Boards that break the contract


class NotWrapped(TinBoard):
    def now_ms(self):
        return int((self.tin.now_s + 1.7e9) * 1000)


class WrapsInTwelveDays(RealClock):
    def now_ms(self):
        super().now_ms()
        return int(time.monotonic() * 1000)


class WrapsTooSoon(RealClock):
    def now_ms(self):
        super().now_ms()
        return int(time.monotonic() * 1000) & 0xFFFFFFF


class GoesBack(TinBoard):
    def now_ms(self):
        self.tin.now_s -= 0.01
        return super().now_ms()


class StandsStill(TinBoard):
    def now_ms(self):
        return 5


class FloatClock(TinBoard):
    def now_ms(self):
        return self.tin.now_s * 1000 % 2**30


class MicrosecondClock(RealClock):
    def now_ms(self):
        super().now_ms()
        return int(time.monotonic() * 1_000_000) & 0x3FFFFFFF


class NoClock(Board):
    levels = TinBoard.levels

    def __init__(self, tin, folder):
        pass


class NotDerived:
    number, is_leader, levels = 0, False, TinBoard.levels

    def __init__(self, tin, folder):
        self.board = TinBoard(tin, folder)
        for name in ("now_ms", "load_image", "store_image", "read_serial", "write_serial", "received_frames"):
            setattr(self, name, getattr(self.board, name))


class BadLevels(TinBoard):
    levels = (0, 1000, 2000, 3000)


class ShuffledLevels(TinBoard):
    levels = TinBoard.levels[::-1]


class BadNumber(TinBoard):
    number = -1


class BadRole(TinBoard):
    is_leader = "leader"


class FramesStay(TinBoard):
    def received_frames(self):
        return self.tin.to_report


class FramesChecked(TinBoard):
    def received_frames(self):
        return [frame for frame in super().received_frames() if frame.bit_count() % 2 == 0]


class FramesAsText(TinBoard):
    def received_frames(self):
        return [f"{frame:08X}" for frame in super().received_frames()] + ["A4A80000"]


class NoFramesAtAll(TinBoard):
    def received_frames(self):
        return None


class DeafToMost(TinBoard):
    def received_frames(self):
        super().received_frames()
        return ()


class LineAsText(TinBoard):
    def read_serial(self):
        return super().read_serial().decode()


class LineStays(TinBoard):
    def read_serial(self):
        return self.tin.line_in


class LineWaits(TinBoard):
    def read_serial(self):
        self.tin.now_s += 0.5
        return super().read_serial()


class WheelsOfThreeSpeeds(TinBoard):
    def set_wheels(self, direction, speed_level):
        super().set_wheels(direction, [0, 1, 2].index(speed_level))


class WheelsByOne(TinBoard):
    def set_wheels(self, direction):
        pass


class NoDarkness(TinBoard):
    def set_led(self, which):
        (10, 11, 12, 13)[which]


class SendsAndWaits(TinBoard):
    def send_frame(self, frame):
        super().send_frame(frame)
        self.tin.now_s += FRAME_ON_AIR_S

    def is_sending(self):
        return False


class NeverSending(TinBoard):
    def is_sending(self):
        return False


class SendsForEver(TinBoard):
    def is_sending(self):
        return self.tin.busy_until_s > 0


class SendsTooShort(TinBoard):
    def is_sending(self):
        return self.tin.now_s < self.tin.busy_until_s - 0.06


class HearsItself(TinBoard):
    def send_frame(self, frame):
        super().send_frame(frame)
        self.tin.to_report.append(frame)


class NoDistance(TinBoard):
    def obstacle_mm(self):
        return None


class FarInMetres(TinBoard):
    def obstacle_mm(self):
        return 1.5


class SaysWords(TinBoard):
    def heard_voice(self):
        return "stop"


class SaysItAgain(TinBoard):
    def heard_voice(self):
        return 1


class PersonByVolts(TinBoard):
    def sees_person(self):
        return 1023


class SensorUnplugged(TinBoard):
    def sees_person(self):
        raise RuntimeError("no PIR at pin 7")


class Forgets(TinBoard):
    def store_image(self, data):
        pass


class InMemoryOnly(TinBoard):
    image = None

    def load_image(self):
        return self.image

    def store_image(self, data):
        self.image = data


class WritesOver(TinBoard):
    def store_image(self, data):
        self.path.write_bytes(data)


class WritesOverSlowly(TinBoard):
    def store_image(self, data):
        with self.path.open("wb") as file:
            for place in range(0, len(data), 256):
                file.write(data[place : place + 256])


class RemovesFirst(TinBoard):
    def store_image(self, data):
        new = self.path.with_suffix(".new")
        new.write_bytes(data)
        self.path.unlink(missing_ok=True)
        new.rename(self.path)


class TailStays(TinBoard):
    def store_image(self, data):
        old = self.load_image() or b""
        super().store_image(data + old[len(data) :])


class TakesSmallOnes(TinBoard):
    def store_image(self, data):
        if len(data) > 512:
            raise OSError("the EEPROM has 512 bytes")
        super().store_image(data)


class StoresText(TinBoard):
    def load_image(self):
        data = super().load_image()
        return bytearray(data) if data is not None else None


class NotesStates(TinBoard):
    def note(self, kind, at_ms, word, detail):
        {"state": 1, "frame": 2}[kind]


FRAME_ON_AIR_S = 0.06
BROKEN = [
    (NotWrapped, "wrap at 2^30"),
    (WrapsInTwelveDays, "on for some days"),
    (WrapsTooSoon, "neither sooner nor later"),
    (GoesBack, "went back"),
    (StandsStill, "stands still"),
    (FloatClock, "whole milliseconds"),
    (MicrosecondClock, "count milliseconds"),
    (NoClock, "override now_ms"),
    (NotDerived, "no method set_wheels"),
    (BadLevels, "levels is (0, 1000, 2000, 3000)"),
    (ShuffledLevels, "make_levels"),
    (BadNumber, "number is -1"),
    (BadRole, "is_leader is 'leader'"),
    (FramesStay, "same frames twice"),
    (FramesChecked, "odd parity"),
    (FramesAsText, "ints of 32 bits"),
    (NoFramesAtAll, "received_frames() gave None"),
    (DeafToMost, "gave none in all"),
    (LineAsText, "read_serial() gave ''"),
    (LineStays, "each byte is told once"),
    (LineWaits, "read_serial took 500 ms"),
    (WheelsOfThreeSpeeds, "set_wheels(0, 3) raised ValueError"),
    (WheelsByOne, "set_wheels(0, 0) raised TypeError"),
    (NoDarkness, "set_led(4) raised IndexError"),
    (SendsAndWaits, "send_frame took 60 ms"),
    (NeverSending, "right after send_frame"),
    (SendsForEver, "still True"),
    (SendsTooShort, "is on the air for"),
    (HearsItself, "can't hear while it sends"),
    (NoDistance, "obstacle_mm() gave None"),
    (FarInMetres, "obstacle_mm() gave 1.5"),
    (SaysWords, "heard_voice() gave 'stop'"),
    (SaysItAgain, "gave 1 twice"),
    (PersonByVolts, "sees_person() gave 1023"),
    (SensorUnplugged, "no PIR at pin 7"),
    (Forgets, "load_image() gave None"),
    (InMemoryOnly, "has lost the image"),
    (WritesOver, "a cut of power in store_image"),
    (WritesOverSlowly, "a cut of power in store_image"),
    (RemovesFirst, "a cut of power in store_image"),
    (TailStays, "load_image() gave"),
    (TakesSmallOnes, "the EEPROM has 512 bytes"),
    (StoresText, "bytearray"),
    (NotesStates, "raised KeyError"),
]
REAL_TIME = (WrapsInTwelveDays, WrapsTooSoon, MicrosecondClock)


@pytest.mark.parametrize(("kind", "says"), BROKEN, ids=lambda value: getattr(value, "__name__", None))
def test_a_board_that_breaks_the_contract_is_told_how(kind, says, tmp_path, monkeypatch):
    if kind in REAL_TIME:
        # Clocks are set ahead only where no other thread would see it; those that other tests left may.
        monkeypatch.setattr(threading, "active_count", lambda: 1)
        breaches = check_board(kind(Tin(), tmp_path), reopen=partial(kind, Tin(), tmp_path))
    else:
        breaches = checked(kind, tmp_path)
    assert any(says in sentence for sentence in breaches), breaches
    # One fault is told in one sentence or two, and not blamed on the rest.
    limit = len(breaches) if kind in (NotDerived, WheelsByOne, NotesStates, WheelsOfThreeSpeeds) else 2
    assert len(breaches) <= limit


def test_a_cut_is_told_with_its_place(tmp_path):
    (sentence,) = checked(WritesOverSlowly, tmp_path)
    assert "of test_check_board.py" in sentence
    assert "rename it" in sentence


# What the documentation shows


def python_in(page: str) -> list[str]:
    return re.findall(r"```python\n(.*?)```", (DOCS / page).read_text(encoding="utf-8"), re.DOTALL)


def test_the_board_in_the_documentation_passes_and_drives(tmp_path, monkeypatch):
    roverhat.switch_on(10_000)
    monkeypatch.chdir(tmp_path)
    space: dict = {}
    exec(python_in("write-a-board.md")[0], space)
    board = space["RoverBoard"]
    assert check_board(board(), reopen=board) == []
    assert (-100, 100) in roverhat.done


def test_both_languages_show_the_same_board():
    assert python_in("write-a-board.md") == python_in("write-a-board.zh.md")


@pytest.mark.parametrize("page", ["write-a-board.md", "write-a-board.zh.md"])
def test_the_documentation_names_every_method(page):
    text = (DOCS / page).read_text(encoding="utf-8")
    assert [name for name in METHODS if f"| `{name}(" not in text] == []
