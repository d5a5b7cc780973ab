"""check_board with an observer: each broken output, sensor and store gets a sentence that names its fault."""

from functools import partial
from pathlib import Path

import pytest

from motorcade import check_board
from motorcade.car.check import NOT_CHECKED, BoardObserver
from support.mutant_boards import ALONE, OBSERVED, go, mutant
from support.observed_tin import EepromTin, FullTin, TinBench, TinObserver

# A cut of power closes no files.
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
NAMES = {"ids": lambda value: value if isinstance(value, str) else ""}
PARTS = ("wheels", "lit_leds", "sent_frames", "written_bytes")
SENSORS = ("put_obstacle", "show_carrier", "show_person", "show_floor", "speak")


def checked(
    kind: type, folder: Path, observer: type[BoardObserver] | None = TinObserver, bench: TinBench | None = None
) -> list:
    """Return what check_board finds in a board of ``kind`` on ``bench``; ``observer`` is made for that."""
    bench = bench or TinBench()

    def wait_ms(duration_ms):
        bench.now_s += duration_ms / 1000

    def say(data):
        bench.line_in += data

    def hear(frame):
        bench.to_report.append(frame)

    observe = observer and observer(bench)
    return check_board(kind(bench, folder), partial(kind, bench, folder), wait_ms, hear, say, observe)


def faults(found: list) -> list[str]:
    return [str(each) for each in found if each.key != NOT_CHECKED]


def not_checked(found: list) -> list[str]:
    parts = [each.details["parts"].split(", ") for each in found if each.key == NOT_CHECKED]
    return sorted(parts[0]) if parts else []


def test_a_correct_board_that_is_observed_passes_and_nothing_is_left_unchecked(tmp_path):
    assert checked(FullTin, tmp_path) == []


@pytest.mark.parametrize("kind", [FullTin, EepromTin])
def test_without_an_observer_each_part_is_named_as_not_checked(kind, tmp_path):
    found = checked(kind, tmp_path, None)
    assert faults(found) == []
    parts = PARTS + SENSORS + (("cut_power",) if kind is EepromTin else ())
    assert not_checked(found) == sorted(f"observe.{part}" for part in parts)


@pytest.mark.parametrize("part", PARTS + SENSORS)
def test_an_observer_may_offer_a_part_alone(part, tmp_path):
    methods = {part: getattr(TinObserver, part), "__init__": TinObserver.__init__}
    found = checked(FullTin, tmp_path, type("Partial", (BoardObserver,), methods))
    assert faults(found) == []
    assert not_checked(found) == sorted(f"observe.{other}" for other in PARTS + SENSORS if other != part)


def test_what_the_arguments_were_not_given_is_named(tmp_path):
    bench = TinBench()

    def wait_ms(duration_ms):
        bench.now_s += duration_ms / 1000

    found = check_board(FullTin(bench, tmp_path), wait_ms=wait_ms, observe=TinObserver(bench))
    assert (faults(found), not_checked(found)) == ([], ["hear", "reopen", "say"])


@pytest.mark.parametrize("faulty", [{}, {"wheels": (1, 1)}, {"lit_leds": [2]}], ids=str)
def test_the_check_leaves_the_wheels_still_and_the_leds_dark(faulty, tmp_path):
    bench = TinBench()
    shows = {name: lambda self, value=value: value for name, value in faulty.items()}
    found = checked(FullTin, tmp_path, type("Faulty", (TinObserver,), shows), bench)
    assert bool(faults(found)) == bool(faulty)
    assert (TinObserver(bench).wheels(), TinObserver(bench).lit_leds()) == ((0, 0), [])


@pytest.mark.parametrize(("name", "changes", "says"), ALONE, **NAMES)
@pytest.mark.parametrize("observer", [None, TinObserver], ids=["alone", "observed"])
def test_a_fault_is_found_without_an_observer_and_with_one(name, changes, says, observer, tmp_path):
    kind = mutant(changes, FullTin if "store_image" in changes else EepromTin)
    found = faults(checked(kind, tmp_path, observer))
    assert [sentence for sentence in found if says in sentence], found
    assert len(found) <= 2, found


@pytest.mark.parametrize("level", [1, 2, 3])
def test_wheels_that_fail_at_a_level_do_not_turn_on(level, tmp_path):
    def set_wheels(self, direction, speed_level):
        self.tin.command(go(direction, {each: each for each in range(4) if each != level}[speed_level]))

    bench = TinBench()
    found = checked(mutant({"set_wheels": set_wheels}, FullTin), tmp_path, TinObserver, bench)
    assert faults(found) == [f"set_wheels(0, {level}) raised KeyError: {level}"]
    assert TinObserver(bench).wheels() == (0, 0)


class BusyComputer(FullTin):
    """A correct board on a computer that does something else for 30 ms now and then, at whatever is called then."""

    readings = 0

    def now_ms(self):
        self.readings += 1
        self.tin.now_s += 0.03 if self.readings % 50 == 0 else 0.0005
        return super().now_ms()


def test_pauses_of_the_computer_are_not_the_boards(tmp_path, monkeypatch):
    monkeypatch.setattr("motorcade.car.check.signals.HAS_CLOCK", False)
    assert faults(check_board(BusyComputer(TinBench(), tmp_path))) == []


@pytest.mark.parametrize(("name", "changes", "says"), OBSERVED, **NAMES)
def test_a_fault_is_found_by_observing_alone(name, changes, says, tmp_path):
    kind = mutant(changes, EepromTin)
    found = faults(checked(kind, tmp_path))
    assert [sentence for sentence in found if says in sentence], found
    assert len(found) <= 2, found
    assert faults(checked(kind, tmp_path, None)) == []
