"""check_board: a correct board passes; each broken output, sensor and store gets a sentence that names its fault."""

import re
import threading
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from checked_board import check as checked_chip
from driven_car import Bench
from simulated.flash import Flash

from motorcade import check_board
from motorcade.boards.computer import ComputerBoard, Equipment, ImageStore
from motorcade.car.check import METHODS, NOT_CHECKED
from motorcade.config.pins import parse_pins
from motorcade.config.profile import built_in_profile, levels_of
from motorcade.firmware.car_files import settings_of, templates
from support import mock_pi, roverhat
from support.broken_boards import ALONE, BAD_CLOCKS, OBSERVED, go, mutant, writes_over_slowly
from support.tin_car import EepromTin, RealClock, Tin, TinBoard, TinObserver

# A cut of power closes no files.
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
CLASSROOM = built_in_profile("classroom")
DOCS = Path(__file__).parents[2] / "docs"
SMALL = bytes.fromhex("01000000 64800000")
NAMES: dict[str, Any] = {"ids": lambda value: value if isinstance(value, str) else ""}
PARTS = ("wheels", "lit_leds", "sent_frames", "written_bytes")
SENSORS = ("put_obstacle", "show_carrier", "show_person", "show_floor", "speak")


def checked(kind: type, folder: Path, observer: Any = TinObserver, tin: Tin | None = None) -> list:
    """Return what check_board finds in a board of ``kind`` on ``tin``; ``observer`` is made for that."""
    tin = tin or Tin()

    def wait_ms(duration_ms):
        tin.now_s += duration_ms / 1000

    def say(data):
        tin.line_in += data

    def hear(frame):
        tin.to_report.append(frame)

    observe = observer and observer(tin)
    return check_board(kind(tin, folder), partial(kind, tin, folder), wait_ms, hear, say, observe)


def faults(found: list) -> list[str]:
    return [str(each) for each in found if each.key != NOT_CHECKED]


def not_checked(found: list) -> list[str]:
    parts = [each.details["parts"].split(", ") for each in found if each.key == NOT_CHECKED]
    return sorted(parts[0]) if parts else []


# Correct boards


def test_a_correct_board_that_is_observed_passes_and_gets_its_image_back(tmp_path):
    assert checked(TinBoard, tmp_path) == []
    # Without an image it holds the empty one after the check.
    assert TinBoard(Tin(), tmp_path).load_image() == bytes(4)
    TinBoard(Tin(), tmp_path).store_image(SMALL)
    assert checked(TinBoard, tmp_path) == []
    assert TinBoard(Tin(), tmp_path).load_image() == SMALL


def test_a_board_in_real_time_passes_too(tmp_path):
    board = RealClock(Tin(), tmp_path)
    # Short frames make a short test.
    board.levels = (*board.levels[:17], 100, *board.levels[18:])
    board.tin.frame_s = 0.016
    assert faults(check_board(board)) == []


def test_a_simulated_car_passes(tmp_path):
    store, line, voice, clock = ImageStore(tmp_path / "car.image"), mock_pi.PiLine(), mock_pi.Voice(), mock_pi.PiClock()

    def open_board():
        return ComputerBoard(
            Equipment(True, 0, levels_of(CLASSROOM), line, store.load(), store.save, voice, clock_s=clock)
        )

    def say(data):
        line.sent += data

    observe = mock_pi.LineObserver(line, voice)
    assert check_board(open_board(), open_board, clock.wait_ms, say=say, observe=observe) == []


@pytest.mark.parametrize(("chip", "platform"), [("esp32", "esp32"), ("rp2040", "rp2")])
@pytest.mark.parametrize("is_leader", [True, False])
@pytest.mark.parametrize("atomic_rename", [True, False], ids=["littlefs", "FAT"])
def test_a_micropython_car_passes(chip, platform, is_leader, atomic_rename):
    text = (templates() / f"{chip}.toml").read_text(encoding="utf-8")
    bench = Bench(settings_of(parse_pins(text, chip), CLASSROOM, is_leader), platform, Flash(atomic_rename))
    assert checked_chip(bench, bench.open().board) == []


@pytest.mark.parametrize("kind", [TinBoard, EepromTin])
def test_without_an_observer_each_part_is_named_as_not_checked(kind, tmp_path):
    found = checked(kind, tmp_path, None)
    assert faults(found) == []
    parts = PARTS + SENSORS + (("cut_power",) if kind is EepromTin else ())
    assert not_checked(found) == sorted(f"observe.{part}" for part in parts)


def test_what_the_arguments_were_not_given_is_named(tmp_path):
    tin = Tin()

    def wait_ms(duration_ms):
        tin.now_s += duration_ms / 1000

    found = check_board(TinBoard(tin, tmp_path), wait_ms=wait_ms, observe=TinObserver(tin))
    assert (faults(found), not_checked(found)) == ([], ["hear", "reopen", "say"])


@pytest.mark.parametrize("faulty", [{}, {"wheels": (1, 1)}, {"lit_leds": [2]}], ids=str)
def test_the_check_leaves_the_wheels_still_and_the_leds_dark(faulty, tmp_path):
    tin = Tin()
    shows = {name: lambda self, value=value: value for name, value in faulty.items()}
    found = checked(TinBoard, tmp_path, type("Faulty", (TinObserver,), shows), tin)
    assert bool(faults(found)) == bool(faulty)
    assert (TinObserver(tin).wheels(), TinObserver(tin).lit_leds()) == ((0, 0), [])


class BusyComputer(TinBoard):
    """A correct board on a computer that does something else for 30 ms now and then, at whatever is called then."""

    readings = 0

    def now_ms(self):
        self.readings += 1
        self.tin.now_s += 0.03 if self.readings % 50 == 0 else 0.0005
        return super().now_ms()


def test_pauses_of_the_computer_are_not_the_boards(tmp_path, monkeypatch):
    monkeypatch.setattr("motorcade.car.check.signals.HAS_CLOCK", False)
    assert faults(check_board(BusyComputer(Tin(), tmp_path))) == []


# Broken boards


@pytest.mark.parametrize(("name", "kind", "says"), BAD_CLOCKS, **NAMES)
def test_a_broken_clock_is_found_in_real_time(name, kind, says, tmp_path, monkeypatch):
    # check_board sets clocks ahead only where there are no other threads; other tests may have left some.
    monkeypatch.setattr(threading, "active_count", lambda: 1)
    found = check_board(kind(Tin(), tmp_path), reopen=partial(kind, Tin(), tmp_path))
    assert [sentence for sentence in faults(found) if says in sentence], found
    assert len(found) <= 2


def test_a_fault_found_by_a_cut_of_power_names_the_line(tmp_path):
    (sentence,) = checked(mutant({"store_image": writes_over_slowly}), tmp_path)
    assert "of broken_boards.py" in str(sentence)
    assert "rename it" in str(sentence)


@pytest.mark.parametrize(("name", "changes", "says"), ALONE, **NAMES)
@pytest.mark.parametrize("observer", [None, TinObserver], ids=["alone", "observed"])
def test_a_fault_is_found_without_an_observer_and_with_one(name, changes, says, observer, tmp_path):
    found = faults(checked(mutant(changes), tmp_path, observer))
    assert [sentence for sentence in found if says in sentence], found
    # One fault gives one or two sentences, and none about other methods.
    assert len(found) <= 2 or name == "not derived", found


@pytest.mark.parametrize("level", [1, 2, 3])
def test_wheels_that_fail_at_a_level_do_not_turn_on(level, tmp_path):
    def set_wheels(self, direction, speed_level):
        self.tin.command(go(direction, {each: each for each in range(4) if each != level}[speed_level]))

    tin = Tin()
    found = checked(mutant({"set_wheels": set_wheels}), tmp_path, TinObserver, tin)
    assert faults(found) == [f"set_wheels(0, {level}) raised KeyError: {level}"]
    assert TinObserver(tin).wheels() == (0, 0)


@pytest.mark.parametrize(("name", "changes", "says"), OBSERVED, **NAMES)
def test_a_fault_is_found_by_observing_alone(name, changes, says, tmp_path):
    found = faults(checked(mutant(changes), tmp_path))
    assert [sentence for sentence in found if says in sentence], found
    assert len(found) <= 2, found
    assert faults(checked(mutant(changes), tmp_path, None)) == []


# What the documentation shows


def python_in(page: str) -> list[str]:
    return re.findall(r"```python\n(.*?)```", (DOCS / page).read_text(encoding="utf-8"), re.DOTALL)


@pytest.fixture
def rover(tmp_path, monkeypatch):
    """Check the board of the documentation with its observer, on a clock of the test's own."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(roverhat, "obstacle_cm", [30.0])
    monkeypatch.setattr(roverhat, "wheels_swapped", [False])
    roverhat.switch_on(10_000)
    clock = mock_pi.PiClock()
    monkeypatch.setattr(roverhat, "time", SimpleNamespace(monotonic=clock))
    space: dict = {}
    for block in (0, 1):
        exec(python_in("write-a-board.md")[block], space)
    space["time"] = SimpleNamespace(monotonic=clock)
    board, observer = space["RoverBoard"], space["RoverObserver"]
    return lambda: [str(each) for each in check_board(board(), board, clock.wait_ms, observe=observer())]


SAYS = re.compile(r"^(?:left and right|obstacle_mm|not checked).*", re.MULTILINE)


def test_the_board_in_the_documentation_passes_and_drives(rover):
    _, _, not_checked = SAYS.findall((DOCS / "write-a-board.md").read_text(encoding="utf-8"))
    assert rover() == [not_checked]
    assert (-100, 100) in roverhat.done


def test_the_mistakes_that_the_documentation_shows_are_found_so(rover):
    roverhat.wheels_swapped[0] = True
    roverhat.obstacle_cm[0] = 3.0
    shown = SAYS.findall((DOCS / "write-a-board.md").read_text(encoding="utf-8"))
    assert [re.sub(r"-?\d+", "N", sentence) for sentence in rover()] == [re.sub(r"-?\d+", "N", each) for each in shown]


def test_both_languages_show_the_same_board():
    assert python_in("write-a-board.md") == python_in("write-a-board.zh.md")


@pytest.mark.parametrize("page", ["write-a-board.md", "write-a-board.zh.md"])
def test_the_documentation_names_every_method(page):
    text = (DOCS / page).read_text(encoding="utf-8")
    assert [name for name in METHODS if f"| `{name}(" not in text] == []
