"""Who drives: the first to send, until silence, a wish for the wheel or a stop says else."""

import pytest

from motorcade.car.arbiter import APPLIED, HALTED, NEEDS_NEUTRAL, NOBODY, STATES, TABLE, WATCHING, YIELDED, Arbiter
from motorcade.words.positions import DRIVE_NEUTRAL
from motorcade.words.ticks import TICKS_MASK
from support.arbiter_witness import MOVES, STILLS


@pytest.fixture
def car() -> Arbiter:
    return Arbiter(300, 5000)


def state(car: Arbiter) -> str:
    return STATES[car.state][0]


def test_the_first_to_send_drives_and_others_watch(car: Arbiter) -> None:
    assert car.command(1, MOVES[1], 0) == APPLIED
    assert car.command(2, MOVES[2], 10) == WATCHING
    assert (car.word, car.driver) == (MOVES[1], 1)


def test_a_command_counts_for_300_ms_and_not_for_one_more(car: Arbiter) -> None:
    car.command(1, MOVES[1], 0)
    assert car.tick(300) == 1
    assert car.word == MOVES[1]
    car.tick(301)
    assert (state(car), car.word) == ("failsafe", DRIVE_NEUTRAL)


@pytest.mark.parametrize("now", [0, TICKS_MASK - 100])
def test_the_next_tick_is_due_when_something_happens(car: Arbiter, now: int) -> None:
    car.command(1, MOVES[1], now)
    due = car.tick((now + 100) & TICKS_MASK)
    assert due == 201
    due = car.tick((now + 301) & TICKS_MASK)
    assert (state(car), due) == ("failsafe", 4700)
    assert car.tick((now + 5000) & TICKS_MASK) == 1
    car.tick((now + 5001) & TICKS_MASK)
    assert car.driver == NOBODY


def test_after_a_failsafe_one_command_with_speed_0_arms(car: Arbiter) -> None:
    car.command(1, MOVES[1], 0)
    assert car.command(1, MOVES[1], 400) == NEEDS_NEUTRAL
    assert car.word == DRIVE_NEUTRAL
    assert car.command(1, STILLS[1], 410) == APPLIED
    assert car.word == STILLS[1]
    assert car.command(1, MOVES[1], 420) == APPLIED
    assert car.word == MOVES[1]


def test_who_stood_still_before_the_silence_drives_on_at_once(car: Arbiter) -> None:
    car.command(1, STILLS[1], 0)
    car.tick(2000)
    assert (state(car), car.word) == ("ready", DRIVE_NEUTRAL)
    assert car.command(1, MOVES[1], 2000) == APPLIED


def test_a_driver_who_gives_back_leaves_a_car_that_the_next_command_drives(car: Arbiter) -> None:
    car.command(1, MOVES[1], 0)
    car.release(1, 10)
    assert (state(car), car.word) == ("ready", DRIVE_NEUTRAL)
    assert car.command(2, MOVES[2], 20) == APPLIED


def test_a_driver_who_is_gone_while_moving_leaves_a_car_that_needs_arming(car: Arbiter) -> None:
    car.command(1, MOVES[1], 0)
    car.gone(1, 10)
    assert (state(car), car.driver) == ("failsafe", NOBODY)
    assert car.command(2, MOVES[2], 20) == NEEDS_NEUTRAL
    assert car.command(2, STILLS[2], 30) == APPLIED


def test_a_driver_who_is_gone_while_standing_leaves_a_centred_car_that_the_next_command_drives(car: Arbiter) -> None:
    car.command(1, STILLS[1], 0)
    car.gone(1, 10)
    assert (state(car), car.word) == ("ready", DRIVE_NEUTRAL)
    assert car.command(2, MOVES[2], 20) == APPLIED


def test_a_watcher_who_leaves_changes_nothing(car: Arbiter) -> None:
    car.command(1, MOVES[1], 0)
    car.request(2, 5)
    car.gone(2, 10)
    car.command(1, STILLS[1], 20)
    assert (car.driver, state(car)) == (1, "standing")


def test_five_seconds_after_the_drivers_last_command_anybody_may_drive(car: Arbiter) -> None:
    car.command(1, MOVES[1], 0)
    assert car.command(2, STILLS[2], 5000) == WATCHING
    assert car.command(2, STILLS[2], 5001) == APPLIED
    assert car.command(1, STILLS[1], 5002) == WATCHING


@pytest.mark.parametrize(("stops", "outcome"), [(False, NEEDS_NEUTRAL), (True, HALTED)])
def test_a_refused_command_of_the_driver_is_a_sign_of_life(car: Arbiter, stops: bool, outcome: int) -> None:
    car.command(1, MOVES[1], 0)
    if stops:
        car.stop()
    assert car.command(1, MOVES[1], 4000) == outcome
    assert car.command(2, STILLS[2], 8000) == WATCHING


def test_the_wheel_passes_to_who_asked_once_the_car_stands(car: Arbiter) -> None:
    car.command(1, MOVES[1], 0)
    assert car.request(2, 10) is False
    assert car.request(3, 11) is False
    assert car.word == MOVES[1]
    assert car.command(1, STILLS[1], 20) == APPLIED
    assert (car.driver, state(car)) == (2, "ready")
    assert car.command(1, MOVES[1], 30) == WATCHING
    assert car.command(2, MOVES[2], 40) == APPLIED


def test_who_asks_while_the_car_stands_has_the_wheel_at_once(car: Arbiter) -> None:
    assert car.word == DRIVE_NEUTRAL
    assert car.request(2, 0) is True
    assert car.request(2, 5) is True
    assert car.command(1, MOVES[1], 10) == WATCHING
    car.command(2, STILLS[2], 20)
    assert car.request(1, 30) is True


def test_who_asked_gets_the_wheel_from_one_who_fell_silent(car: Arbiter) -> None:
    car.command(1, MOVES[1], 0)
    car.request(2, 10)
    car.tick(301)
    assert (car.driver, state(car)) == (2, "failsafe")


def test_nothing_moves_after_an_emergency_stop_until_it_is_lifted_and_the_car_armed(car: Arbiter) -> None:
    car.command(1, MOVES[1], 0)
    car.stop()
    assert car.word == DRIVE_NEUTRAL
    for word in (STILLS[1], MOVES[1]):
        assert car.command(1, word, 10) == HALTED
    assert car.resume(1, 20) is False
    car.clear()
    assert car.command(1, MOVES[1], 30) == NEEDS_NEUTRAL
    assert car.command(1, STILLS[1], 40) == APPLIED
    assert car.command(1, MOVES[1], 50) == APPLIED


def test_a_program_yields_to_a_driver_and_goes_on_when_told(car: Arbiter) -> None:
    assert car.resume(1, 0) is True
    assert (state(car), car.word) == ("program", DRIVE_NEUTRAL)
    assert car.command(1, STILLS[1], 10) == YIELDED
    assert car.command(1, MOVES[1], 20) == APPLIED
    assert car.resume(2, 30) is False
    assert car.word == MOVES[1]
    assert car.resume(1, 40) is True
    assert (state(car), car.word, car.driver) == ("program", DRIVE_NEUTRAL, NOBODY)


def test_an_emergency_stop_ends_the_program_too(car: Arbiter) -> None:
    car.resume(1, 0)
    car.stop()
    car.clear()
    assert state(car) == "failsafe"


@pytest.mark.parametrize("before", ["ready", "standing", "moving", "program"])
def test_after_a_stall_nothing_old_counts(car: Arbiter, before: str) -> None:
    if before == "program":
        car.resume(1, 0)
    elif before != "ready":
        car.command(1, MOVES[1] if before == "moving" else STILLS[1], 0)
    assert state(car) == before
    car.stall()
    assert car.command(1, MOVES[1], 250) == NEEDS_NEUTRAL
    assert car.command(1, STILLS[1], 260) == APPLIED


@pytest.mark.parametrize(("before", "after"), [("ready", "ready"), ("standing", "failsafe"), ("program", "failsafe")])
def test_a_delay_of_a_car_that_stands_and_nobody_drives_needs_no_arming(car: Arbiter, before: str, after: str) -> None:
    if before == "program":
        car.resume(1, 0)
    if before == "standing":
        car.command(1, STILLS[1], 0)
    car.delay()
    assert state(car) == after


def test_the_table_has_each_case_once_and_leads_somewhere() -> None:
    cases = [(state, event) for state, event, _ in TABLE]
    assert len(set(cases)) == len(cases)
    assert all(state != following for state, _, following in TABLE)
