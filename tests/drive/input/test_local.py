"""A stick at the car itself, on a bench with somebody on the network: readings and the clock are the test's."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drive.test_session import MOVE, NEUTRAL, STILL, Car
from motorcade.car.arbiter import APPLIED, LOCAL
from motorcade.drive.input.deadman import CLEAR, QUIT, RELEASE, REQUEST, RESTS_MS, RESUME, STOP, Reading
from motorcade.drive.input.local import PERIOD_S, LocalStick
from motorcade.drive.session import Who
from motorcade.drive.wire import OUTCOMES
from motorcade.errors import MotorcadeError

PERIOD_MS = round(PERIOD_S * 1000)
PAD = "Pad"
REST, AHEAD, LEFT, GONE = Reading(PAD, (0, 0)), Reading(PAD, (1, 0)), Reading(PAD, (0, -1)), Reading(None)
BY_NETWORK = ("apply", 40, 1, 150)
ALL_AHEAD, ALL_LEFT = ("apply", 90, 1, 255), ("apply", 180, 1, 0)


class Bench(Car):
    """A car, a stick at it that has been seen at rest, and a driver on the network."""

    def __init__(self) -> None:
        super().__init__()
        self.said: list[str] = []
        self.stick = LocalStick(self.control, lambda sentence: self.said.append(str(sentence)))
        self.network = self.control.join("ada")
        self.look(REST)

    def look(self, reading: Reading, for_ms: int = 0) -> None:
        """Let the stick show the same for so long, while the car's clock goes on."""
        for _ in range(max(1, for_ms // PERIOD_MS)):
            self.now_ms += PERIOD_MS
            self.control.tick()
            self.stick.take(reading, self.now_ms)

    @property
    def driver(self) -> str | None:
        return self.control.telemetry().driver


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_a_stick_that_nobody_touches_never_takes_the_wheel(bench: Bench) -> None:
    for _ in range(100):
        assert bench.network.command(MOVE) == APPLIED
        bench.look(REST, 100)
    assert bench.driver == "ada"


def test_a_push_takes_the_wheel_from_the_network_and_keeps_it(bench: Bench) -> None:
    bench.network.command(MOVE)
    bench.look(AHEAD, 100)
    assert (bench.last, bench.driver) == (ALL_AHEAD, "Pad at the car")
    assert OUTCOMES[bench.network.command(MOVE)] == "watching"
    # The wheels stand before they turn another way.
    after = bench.board.told[bench.board.told.index(BY_NETWORK) + 1 :]
    assert after[0] == ("apply", 90, 1, 0)
    bench.look(LEFT, 1000)
    assert bench.last == ALL_LEFT


def test_a_release_stops_at_once_and_gives_the_wheel_back_after_a_while(bench: Bench) -> None:
    bench.network.command(STILL)
    bench.look(AHEAD, 500)
    bench.look(REST, RESTS_MS - PERIOD_MS)
    assert bench.state == "standing"
    assert OUTCOMES[bench.network.command(MOVE)] == "watching"
    bench.look(REST, 2 * PERIOD_MS)
    assert (bench.state, bench.driver) == ("ready", None)
    assert bench.network.command(MOVE) == APPLIED


def test_a_stick_that_is_pulled_out_while_it_drives_leaves_a_car_that_stands(bench: Bench) -> None:
    bench.look(AHEAD, 100)
    bench.look(GONE)
    assert (bench.last, bench.state, bench.driver) == (NEUTRAL, "failsafe", None)
    # Who held a key meanwhile on the network has to let go first.
    assert OUTCOMES[bench.network.command(MOVE)] == "needs-neutral"
    bench.network.command(STILL)
    bench.look(AHEAD, 100)
    assert bench.driver == "ada"
    bench.look(REST)
    bench.look(AHEAD, 100)
    assert bench.last == ALL_AHEAD


def test_a_stick_that_replaces_another_has_to_be_released_first(bench: Bench) -> None:
    bench.look(AHEAD, 100)
    bench.look(AHEAD._replace(device="Other"), 100)
    assert bench.last == NEUTRAL
    assert bench.said == [
        "Pad is connected: it drives this car before everybody on the network",
        "Pad is gone",
        "Other is connected: it drives this car before everybody on the network",
    ]


def test_untrusted_axes_stop_the_car(bench: Bench) -> None:
    bench.look(AHEAD, 100)
    bench.look(Reading(PAD, None))
    assert bench.last == ("apply", 90, 1, 0)
    bench.look(AHEAD, 100)
    assert bench.last == ("apply", 90, 1, 0)


def test_a_pushed_stick_does_not_drive_on_after_the_car_s_own_software_was_stuck(bench: Bench) -> None:
    bench.look(AHEAD, 100)
    bench.now_ms += 400
    bench.control.tick()
    assert bench.state == "failsafe"
    bench.look(AHEAD, 1000)
    assert bench.last[-1] == 0
    assert bench.state == "standing"
    bench.look(REST)
    bench.look(AHEAD, 100)
    assert bench.last == ALL_AHEAD


@pytest.mark.parametrize("before", [REST, AHEAD])
def test_a_stick_arms_a_car_that_a_lost_driver_left_in_failsafe(bench: Bench, before: Reading) -> None:
    bench.look(before, 100)
    bench.look(REST, RESTS_MS + PERIOD_MS)
    bench.network.command(MOVE)
    bench.network.leave()
    assert bench.state == "failsafe"
    bench.look(AHEAD, 100)
    assert bench.last == ALL_AHEAD


def test_the_emergency_stop_stops_whoever_drives_and_holds(bench: Bench) -> None:
    bench.network.command(MOVE)
    bench.look(REST._replace(orders=(STOP,)))
    assert (bench.last, bench.state, bench.driver) == (NEUTRAL, "stopped", "ada")
    bench.look(AHEAD, 100)
    assert bench.state == "stopped"
    bench.look(AHEAD._replace(orders=(CLEAR,)), 100)
    assert bench.last != ALL_AHEAD
    bench.look(REST)
    bench.look(AHEAD, 100)
    assert bench.last == ALL_AHEAD


def test_a_push_that_began_while_the_car_was_stopped_drives_nothing_once_it_is_lifted(bench: Bench) -> None:
    bench.network.stop()
    bench.look(AHEAD)
    bench.network.clear()
    bench.look(AHEAD, 1000)
    assert ALL_AHEAD not in bench.board.told


def test_a_stop_in_the_look_in_which_it_is_pushed_comes_first(bench: Bench) -> None:
    bench.look(AHEAD._replace(orders=(STOP,)), 500)
    assert bench.state == "stopped"
    assert ALL_AHEAD not in bench.board.told


def test_release_gives_the_wheel_back_at_once_though_the_stick_is_pushed(bench: Bench) -> None:
    bench.look(AHEAD, 100)
    bench.look(AHEAD._replace(orders=(RELEASE,)))
    bench.look(AHEAD, 100)
    assert (bench.last, bench.driver) == (NEUTRAL, None)


def test_resume_gives_the_program_the_wheels_or_reports_why_not(bench: Bench) -> None:
    bench.look(REST._replace(orders=(RESUME,)))
    assert bench.state == "program"
    bench.look(AHEAD, 100)
    assert bench.last == ALL_AHEAD
    bench.control.stop()
    bench.look(REST._replace(orders=(RESUME,)))
    assert "somebody else drives, the emergency stop holds" in bench.said[-1]


def test_orders_for_terminals_change_nothing(bench: Bench) -> None:
    bench.network.command(MOVE)
    bench.look(REST._replace(orders=(REQUEST, QUIT)))
    assert (bench.driver, bench.state) == ("ada", "moving")


def test_another_stick_that_drives_is_not_followed_by_one_that_stayed_pushed(bench: Bench) -> None:
    other = bench.control.join("other", Who(kind=LOCAL))
    other.command(MOVE)
    bench.look(AHEAD, 100)
    assert bench.driver == "other"
    other.release()
    bench.look(AHEAD, 1000)
    assert ALL_AHEAD not in bench.board.told


def test_a_notice_is_reported(bench: Bench) -> None:
    bench.look(REST._replace(notice=MotorcadeError("not-a-gamepad", name="Wheel")))
    assert "Wheel is no gamepad" in bench.said[-1]


def test_the_car_takes_each_of_its_commands(bench: Bench) -> None:
    bench.look(AHEAD, 100)
    count = len(bench.board.told)
    bench.look(AHEAD, 2000)
    assert bench.board.told[count:] == [ALL_AHEAD] * (2000 // PERIOD_MS)


looks = st.lists(
    st.tuples(
        st.sampled_from(["rest", "push", "untrusted", "gone", "stop", "clear", "release", "network", "stall"]),
        st.integers(0, 400),
    ),
    max_size=60,
)


@given(looks=looks)
def test_the_stick_moves_the_wheels_only_by_a_push_after_a_release(looks: list[tuple[str, int]]) -> None:
    bench, has_rested = Bench(), True
    readings = {"rest": REST, "push": AHEAD, "untrusted": Reading(PAD, None), "gone": GONE}
    readings |= {order: AHEAD._replace(orders=(order,)) for order in (STOP, CLEAR, RELEASE)}
    for act, later_ms in looks:
        bench.now_ms += later_ms
        bench.control.tick()
        if act == "stall":
            bench.control.fail(OSError())
        if act in ("network", "stall"):
            bench.network.command(MOVE)
            continue
        was_stopped, before = bench.state in ("failsafe", "stopped"), bench.last
        bench.stick.take(readings[act], bench.now_ms)
        has_rested = act == "rest" or (has_rested and act in ("push", "clear"))
        if bench.driver == "Pad at the car" and bench.last == ALL_AHEAD:
            assert act in ("push", "clear")
            assert has_rested
            assert before != BY_NETWORK
            assert not was_stopped
        elif act == "push" and bench.state == "failsafe":
            has_rested = False
