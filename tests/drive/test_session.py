"""One car and all who want to drive it, on a bench: its clock and its hardware are the test's."""

import threading
from dataclasses import replace

import pytest

from motorcade.car.arbiter import APPLIED
from motorcade.config.profile import built_in_profile
from motorcade.drive.session import ControlSession
from motorcade.drive.stamps import stamp_at
from motorcade.drive.wire import OUTCOMES, OVER_RATE, STALE, SessionError
from motorcade.words.field import WordError
from motorcade.words.formats import DRIVE
from support.mock_board import MockCar

PROFILE = built_in_profile("classroom")
NEUTRAL = ("neutral",)
MOVE = DRIVE.encode(angle=40, direction=1, speed=150)
STILL = DRIVE.encode(angle=40, direction=1, speed=0)


@pytest.fixture
def car() -> MockCar:
    return MockCar()


@pytest.fixture
def session(car: MockCar) -> ControlSession:
    return ControlSession(car.control, "ada")


def test_silence_stops_the_wheels_once(car: MockCar, session: ControlSession) -> None:
    session.command(MOVE)
    for car.now_ms in (300, 301, 400, 500):
        car.control.beat()
    assert car.board.calls == [NEUTRAL, ("apply", 40, 1, 150), NEUTRAL]
    assert (car.state, car.control.telemetry().failsafes) == ("failsafe", 1)


def test_without_its_guard_a_car_stands_also_where_the_board_refused_to(car: MockCar, session: ControlSession) -> None:
    def fail() -> None:
        raise OSError("the guard is gone")

    car.control.wheels.before_moving = fail
    car.board.is_broken = True
    session.command(STILL)
    car.board.is_broken = False
    session.command(STILL)
    session.command(MOVE)
    assert set(car.board.calls) == {NEUTRAL}


def test_a_profile_says_how_long_a_command_counts() -> None:
    car = MockCar(replace(PROFILE, drive=replace(PROFILE.drive, failsafe_ms=800)))
    ControlSession(car.control, "ada").command(MOVE)
    car.now_ms = 800
    assert car.control.beat() == 1
    assert car.state == "moving"


def test_a_driver_that_leaves_while_moving_leaves_a_car_that_stands(car: MockCar, session: ControlSession) -> None:
    session.command(MOVE)
    session.leave()
    session.leave()
    assert car.board.calls[-1] == NEUTRAL
    assert car.control.telemetry().failsafes == 1
    assert OUTCOMES[session.command(MOVE)] == "watching"
    assert session.request() is False


@pytest.mark.parametrize(
    ("word", "said"),
    [
        *[(code << 28, f"code is {code}") for code in (0, *range(3, 16))],
        (DRIVE.encode(angle=180) + (1 << 20), "angle is 181; allowed: 0 to 180"),
        (1 << 28 | 255 << 20, "angle is 255"),
    ],
)
def test_what_is_no_command_is_named_counted_and_not_done(
    car: MockCar, session: ControlSession, word: int, said: str
) -> None:
    session.command(STILL)
    with pytest.raises(WordError, match=said):
        session.command(word)
    assert car.board.calls[-1] == ("apply", 40, 1, 0)
    assert (session.counts["refused"], car.control.telemetry().refused) == (1, 1)
    assert said in session.you()["last_refusal"]


def test_wrong_words_are_no_sign_of_life(car: MockCar, session: ControlSession) -> None:
    session.command(MOVE)
    for car.now_ms in range(0, 400, 20):
        with pytest.raises(WordError):
            session.command(0)
        car.control.beat()
    assert car.state == "failsafe"


def test_words_that_were_sent_long_ago_are_no_sign_of_life(car: MockCar, session: ControlSession) -> None:
    session.take_place()
    car.now_ms = 700
    # Nobody knows how old it is before the client has answered the car's clock.
    assert session.command(MOVE | stamp_at(7), 1) == STALE
    assert session.silent_ms == 700


def test_a_hundred_commands_a_second_are_taken_and_who_sends_more_drives_on_and_can_stop(
    car: MockCar, session: ControlSession
) -> None:
    for car.now_ms in range(1000):
        last = session.command(MOVE)
        car.control.beat()
    counted = session.counts
    assert (counted["applied"], counted["over-rate"], last) == (100, 900, OVER_RATE)
    assert car.control.telemetry().failsafes == 0
    assert session.command(STILL) == APPLIED
    assert car.board.calls[-1] == ("apply", 40, 1, 0)


@pytest.mark.parametrize("period_ms", [10, 20, 50])
def test_a_driver_that_sends_in_time_is_never_refused(car: MockCar, session: ControlSession, period_ms: int) -> None:
    for car.now_ms in range(0, 5000, period_ms):
        assert session.command(MOVE) == APPLIED


def test_one_drives_and_eight_watch_who_leave_a_place_for_the_driver(car: MockCar, session: ControlSession) -> None:
    watchers = [ControlSession(car.control, f"watcher {number}", watches=True) for number in range(9)]
    for watcher in watchers[:8]:
        watcher.take_place()
    with pytest.raises(SessionError, match="9 in all"):
        watchers[8].take_place()
    assert session.command(MOVE) == APPLIED
    assert car.control.telemetry().watchers == 8
    with pytest.raises(SessionError):
        ControlSession(car.control, "one too many").take_place()
    watchers[0].leave()
    ControlSession(car.control, "next").take_place()


def test_telemetry_has_driver_and_setpoint(car: MockCar, session: ControlSession) -> None:
    other = ControlSession(car.control, "grace")
    session.command(MOVE)
    other.request()
    car.now_ms = 120
    told = car.control.telemetry()
    assert (told.state, told.driver, told.wanted_by, told.age_ms) == ("moving", "ada", "grace", 120)
    assert (told.angle_deg, told.direction, told.speed, told.watchers) == (40, 1, 150, 1)
    car.now_ms = 400
    car.control.beat()
    told = car.control.telemetry()
    assert (told.angle_deg, told.direction, told.speed, told.driver) == (90, 1, 0, "grace")


def test_telemetry_has_the_battery_which_is_read_once_a_second(car: MockCar) -> None:
    assert car.control.telemetry().battery_mv is None
    car.board.voltage_mv = 7400
    car.now_ms = 999
    assert car.control.telemetry().battery_mv is None
    car.now_ms = 1000
    assert car.control.telemetry().battery_mv == 7400


def test_a_driver_takes_the_wheels_from_the_program_before_the_command(car: MockCar, session: ControlSession) -> None:
    session.resume_program()
    assert (car.state, car.board.calls[-1]) == ("program", ("begin",))
    session.command(MOVE)
    assert car.board.calls[-2:] == [("end",), ("apply", 40, 1, 150)]
    session.resume_program()
    assert car.board.calls[-2:] == [NEUTRAL, ("begin",)]
    session.stop()
    assert car.board.calls[-2:] == [("end",), NEUTRAL]


def test_a_program_does_not_push_a_driver_aside(car: MockCar, session: ControlSession) -> None:
    session.command(MOVE)
    with pytest.raises(SessionError, match="somebody else drives"):
        ControlSession(car.control, "grace").resume_program()
    assert car.state == "moving"


def test_hardware_that_fails_is_a_car_that_stands_and_needs_arming(car: MockCar, session: ControlSession) -> None:
    session.command(MOVE)
    car.board.is_broken = True
    session.command(MOVE)
    told = car.control.telemetry()
    assert (told.state, told.last_fault) == ("failsafe", "the cable is out")
    assert told.faults == 2
    assert car.board.calls[-1] == ("apply", 40, 1, 150)
    car.board.is_broken = False
    car.control.beat()
    assert car.board.calls[-1] == NEUTRAL
    session.command(MOVE)
    assert car.board.calls[-1] == NEUTRAL


def test_a_program_that_cannot_be_ended_does_not_keep_the_wheels_turning(car: MockCar, session: ControlSession) -> None:
    session.resume_program()

    def fail() -> None:
        raise OSError("stuck")

    end, car.board.end_program = car.board.end_program, fail
    session.stop()
    assert car.board.calls[-1] == NEUTRAL
    car.board.end_program = end
    car.control.beat()
    assert car.board.calls[-2:] == [("end",), NEUTRAL]


def test_a_loop_that_gives_no_sign_of_life_for_200_ms_stops_the_wheels(car: MockCar, session: ControlSession) -> None:
    car.control.beat()
    session.command(MOVE)
    car.now_ms = 199
    assert car.control.watch() == 1
    assert car.state == "moving"
    car.now_ms = 200
    car.control.watch()
    assert car.board.calls[-1] == NEUTRAL
    for car.now_ms in (250, 300):
        car.control.watch()
    told = car.control.telemetry()
    assert (told.state, told.stalls) == ("failsafe", 1)
    assert OUTCOMES[session.command(MOVE)] == "needs-neutral"
    car.control.beat()
    car.now_ms = 600
    car.control.watch()
    assert car.control.telemetry().stalls == 2


def test_a_hold_up_of_a_car_that_stands_and_nobody_drives_needs_no_arming(
    car: MockCar, session: ControlSession
) -> None:
    car.control.beat()
    car.now_ms = 300
    car.control.watch()
    told = car.control.telemetry()
    assert (told.state, told.stalls) == ("ready", 1)
    assert OUTCOMES[session.command(MOVE)] == "applied"


def test_a_call_that_hangs_in_the_hardware_does_not_hold_up_the_watchdog(car: MockCar, session: ControlSession) -> None:
    hangs, goes_on = threading.Event(), threading.Event()

    def hang(angle_deg: int, direction: int, speed: int) -> None:
        hangs.set()
        goes_on.wait(20)

    car.board.apply = hang
    driver = threading.Thread(target=session.command, args=[MOVE])
    driver.start()
    assert hangs.wait(20)
    car.board.calls.clear()
    car.control.watch()
    assert car.board.calls == [NEUTRAL]
    goes_on.set()
    driver.join()


def test_a_hardware_watchdog_is_fed_by_the_loop_alone(car: MockCar) -> None:
    car.control.watch()
    assert car.board.fed == 0
    car.control.beat()
    assert car.board.fed == 1


def test_a_closed_car_ends_its_program_and_does_nothing_more(car: MockCar, session: ControlSession) -> None:
    session.resume_program()
    car.control.close()
    assert ("end",) in car.board.calls
    assert car.board.calls[-1] == NEUTRAL
    session.clear()
    for word in (STILL, MOVE):
        session.command(word)
    car.control.watch()
    assert car.board.calls[-1] == NEUTRAL
