"""check_board: a correct board passes, and each broken board gets a sentence that says what is wrong."""

import re
import threading
from functools import partial
from pathlib import Path
from types import SimpleNamespace

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
from support.broken_boards import (
    BROKEN,
    REAL_TIME,
    NotDerived,
    WritesOverSlowly,
)
from support.observed_tin import TinBench, TinObserver
from support.tin_car import RealClock, Tin, TinBoard

# A cut of power closes no files.
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
CLASSROOM = built_in_profile("classroom")
DOCS = Path(__file__).parents[2] / "docs"
SMALL = bytes.fromhex("01000000 64800000")


def test_a_board_in_fewer_than_a_hundred_lines_passes():
    source = (Path(__file__).parents[1] / "support" / "tin_car.py").read_text(encoding="utf-8")
    assert len(source.splitlines()) < 100


def faults(found: list) -> list[str]:
    return [str(each) for each in found if each.key != NOT_CHECKED]


def checked(kind: type, folder: Path) -> list[str]:
    """Return what check_board finds in a board of ``kind``."""
    tin = TinBench()
    tin_board = kind(tin, folder)

    def wait_ms(duration_ms):
        tin.now_s += duration_ms / 1000

    def say(data):
        tin.line_in += data

    reopen = partial(kind, tin, folder)

    def hear(frame):
        tin.to_report.append(frame)

    return check_board(tin_board, reopen, wait_ms, hear, say, TinObserver(tin, has_sensors=False))


def test_a_correct_board_passes_and_gets_its_image_back(tmp_path):
    board = TinBoard(Tin(), tmp_path)
    board.store_image(SMALL)
    assert checked(TinBoard, tmp_path) == []
    assert board.load_image() == SMALL


def test_a_board_without_an_image_holds_the_empty_one_after_the_check(tmp_path):
    assert checked(TinBoard, tmp_path) == []
    assert TinBoard(Tin(), tmp_path).load_image() == bytes(4)


def test_a_board_in_real_time_passes_too(tmp_path):
    board = RealClock(Tin(), tmp_path)
    # Short frames make a short test.
    board.levels = (*board.levels[:17], 100, *board.levels[18:])
    board.tin.frame_s = 0.016
    assert faults(check_board(board)) == []


def test_a_simulated_car_passes(tmp_path):
    store, line, voice, clock = ImageStore(tmp_path / "car.image"), mock_pi.Line(), mock_pi.Voice(), mock_pi.Clock()

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


@pytest.mark.parametrize(("kind", "says"), BROKEN, ids=lambda value: getattr(value, "__name__", None))
def test_each_broken_board_gets_a_sentence_that_names_its_fault(kind, says, tmp_path, monkeypatch):
    if kind in REAL_TIME:
        # check_board sets clocks ahead only where there are no other threads; other tests may have left some.
        monkeypatch.setattr(threading, "active_count", lambda: 1)
        breaches = check_board(kind(Tin(), tmp_path), reopen=partial(kind, Tin(), tmp_path))
    else:
        breaches = checked(kind, tmp_path)
    assert any(says in str(breach) for breach in breaches), breaches
    # One fault gives one or two sentences, and none about other methods.
    assert len(breaches) <= (len(breaches) if kind is NotDerived else 2)


def test_a_fault_found_by_a_cut_of_power_names_the_line(tmp_path):
    (sentence,) = checked(WritesOverSlowly, tmp_path)
    assert "of broken_boards.py" in str(sentence)
    assert "rename it" in str(sentence)


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
    clock = mock_pi.Clock()
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
