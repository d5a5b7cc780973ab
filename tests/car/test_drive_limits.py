"""What becomes of a driver's command: acceleration, an obstacle ahead, a low battery. Time is an argument."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.car.drive_limits import READINGS, DutyLimiter, duty_per_s, released_mm
from motorcade.words.ticks import TICKS_MASK

RATE = 500


def ramp(limiter: DutyLimiter, wanted: int, times_ms: list[int]) -> list[int]:
    return [limiter.next_duty(wanted, now) for now in times_ms]


def drained(limiter: DutyLimiter, millivolts: int = 5000) -> DutyLimiter:
    for _ in range(READINGS):
        limiter.see_battery(millivolts)
    return limiter


def test_wheels_gain_no_more_than_their_rate() -> None:
    limiter = DutyLimiter(gain_per_s=RATE)
    assert ramp(limiter, 100, [0, 20, 40, 100, 190, 200, 300]) == [0, 10, 20, 50, 95, 100, 100]
    assert not limiter.is_changing
    # A command that stays the same is no run-up for the next one.
    assert ramp(limiter, 200, [5000, 5020]) == [100, 110]


def test_steps_that_are_smaller_than_a_duty_are_not_lost() -> None:
    limiter = DutyLimiter(gain_per_s=3)
    assert ramp(limiter, 255, list(range(0, 2001, 10)))[-1] == 6


@pytest.mark.parametrize("wanted", [0, 30, -200])
def test_a_stop_and_a_slower_command_are_never_delayed(wanted: int) -> None:
    limiter = DutyLimiter(gain_per_s=RATE)
    ramp(limiter, 200, [0, 1000])
    assert limiter.next_duty(wanted, 1000) == max(wanted, 0)


def test_wheels_that_shall_turn_the_other_way_begin_at_0() -> None:
    limiter = DutyLimiter(gain_per_s=RATE)
    assert ramp(limiter, 100, [0, 500])[-1] == 100
    assert ramp(limiter, -100, [500, 520, 540]) == [0, -10, -20]


def test_without_limits_every_command_is_executed_as_it_is() -> None:
    limiter = DutyLimiter()
    limiter.see_obstacle(1)
    limiter.see_battery(1)
    assert ramp(limiter, 255, [0]) + ramp(limiter, -255, [0]) == [255, -255]


def test_an_obstacle_stops_the_way_ahead_alone_and_at_once() -> None:
    limiter = DutyLimiter(gain_per_s=RATE, obstacle_stop_mm=200)
    ramp(limiter, 100, [0, 200])
    limiter.see_obstacle(199)
    assert (limiter.next_duty(100, 210), limiter.obstacle_mm) == (0, 199)
    limiter.see_obstacle(None)
    assert ramp(limiter, -100, [220, 240]) == [0, -10]


def test_an_obstacle_has_to_go_away_by_more_than_it_came_near() -> None:
    limiter = DutyLimiter(obstacle_stop_mm=200)
    seen = []
    for distance_mm in (200, 199, 200, released_mm(200) - 1, released_mm(200), 240, 199):
        limiter.see_obstacle(distance_mm)
        seen.append(limiter.next_duty(100, 0))
    assert seen == [100, 0, 0, 0, 100, 100, 0]


def test_a_low_battery_slows_the_wheels_down_until_they_stand() -> None:
    limiter = DutyLimiter(loss_per_s=RATE, battery_low_mv=6000, battery_charged_mv=6500)
    assert limiter.next_duty(100, 0) == 100
    drained(limiter)
    assert ramp(limiter, 100, [1000, 1020, 1100, 1190, 1200]) == [100, 90, 50, 5, 0]
    assert ramp(limiter, 100, [1300, 2300]) == [0, 0]


def test_a_low_battery_delays_no_stop_and_gains_no_speed() -> None:
    limiter = DutyLimiter(loss_per_s=RATE, battery_low_mv=6000, battery_charged_mv=6500)
    limiter.next_duty(50, 0)
    drained(limiter)
    assert limiter.next_duty(200, 10) == 50
    assert limiter.next_duty(0, 20) == 0
    assert limiter.next_duty(-200, 30) == 0


def test_a_battery_is_low_or_charged_only_after_some_readings() -> None:
    limiter = DutyLimiter(battery_low_mv=6000, battery_charged_mv=6500)
    for millivolts, is_low in [
        *[(5900, False), (5900, False), (6000, False), (5999, False), (5999, False), (5999, True)],
        *[(6400, True), (6500, True), (6499, True), (6500, True), (6500, True), (6500, False)],
    ]:
        limiter.see_battery(millivolts)
        assert limiter.is_low is is_low


@given(
    gain=st.integers(0, 1 << 18),
    begin=st.integers(0, TICKS_MASK),
    steps=st.lists(st.tuples(st.integers(0, 400), st.integers(-255, 255), st.integers(0, 300)), max_size=30),
)
def test_no_limit_ever_adds_speed_or_turns_the_wheels_the_other_way(
    gain: int, begin: int, steps: list[tuple[int, int, int]]
) -> None:
    limiter, now, before = DutyLimiter(gain_per_s=gain, obstacle_stop_mm=150), begin, 0
    for pause_ms, wanted, distance_mm in steps:
        now = now + pause_ms & TICKS_MASK
        limiter.see_obstacle(distance_mm)
        duty = limiter.next_duty(wanted, now)
        assert abs(duty) <= abs(wanted)
        assert duty * wanted >= 0
        if gain:
            assert abs(duty) <= (abs(before) if before * duty > 0 else 0) + gain * pause_ms // 1000 + 1
        before = duty


def test_a_rate_in_duty_a_second_keeps_0_and_is_never_0_otherwise() -> None:
    assert duty_per_s(600, 300, 255) == 510
    assert duty_per_s(1, 2000, 255) == 1
    assert duty_per_s(0, 300, 255) == 0
