"""What a hand on a stick wants, and a gamepad's numbers as a stick."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.drive.input.deadman import RESTS_MS, DeadmanSwitch
from motorcade.drive.input.gamepad import DEAD_ZONE, FULL, LONGEST_STILL_MS, PadNumbers, PadStick
from motorcade.words.ticks import later_ms

REST, PUSHED, STILL = (0, 0), (0.5, -1), (0, 0)
NO_NUMBERS = PadNumbers(0, 0, 0, 0, 0, 0)


@pytest.fixture
def switch():
    """One that was seen at rest at 0 ms."""
    switch = DeadmanSwitch()
    assert switch.update(REST, 0) is None
    return switch


def test_a_stick_that_nobody_touches_commands_nothing(switch):
    assert [switch.update(REST, now_ms) for now_ms in range(0, 10_000, 20)] == [None] * 500


@pytest.mark.parametrize("pushed", [(0.1, 0), (-1, 0), (0, 0.1), PUSHED])
def test_a_push_is_a_command_at_once(switch, pushed):
    assert switch.update(pushed, 20) == pushed


def test_a_release_commands_to_stand_still_and_after_a_while_nothing(switch):
    switch.update(PUSHED, 100)
    assert [switch.update(REST, 100 + later) for later in (20, RESTS_MS - 1, RESTS_MS, 9000)] == [
        STILL,
        STILL,
        None,
        None,
    ]


def test_a_second_push_before_that_drives_on(switch):
    switch.update(PUSHED, 100)
    assert switch.update(REST, 1900) == STILL
    assert switch.update(PUSHED, 2050) == PUSHED
    assert switch.update(REST, 4000) == STILL


def test_a_stick_that_is_pushed_when_it_is_plugged_in_has_to_be_released_first():
    switch = DeadmanSwitch()
    assert switch.update(PUSHED, 0) is None
    assert switch.must_rest
    assert switch.update(REST, 20) is None
    assert switch.update(PUSHED, 40) == PUSHED


@pytest.mark.parametrize("wrong", [None, (float("nan"), 0), (0, float("inf")), (1.01, 0), (0, -2)])
def test_axes_out_of_range_stop_and_require_a_release(switch, wrong):
    switch.update(PUSHED, 0)
    assert switch.update(wrong, 20) == STILL
    assert switch.update(PUSHED, 40) == STILL
    assert switch.update(REST, 60) == STILL
    assert switch.update(PUSHED, 80) == PUSHED


def test_distrust_stops_and_withdraw_commands_nothing_until_a_release(switch):
    switch.update(PUSHED, 0)
    switch.distrust()
    assert switch.update(PUSHED, 20) == STILL
    switch.withdraw()
    assert switch.update(PUSHED, 40) is None
    assert switch.update(REST, 60) is None
    assert switch.update(PUSHED, 80) == PUSHED


looks = st.lists(
    st.tuples(st.sampled_from([REST, PUSHED, (1, 0), None, "distrust", "withdraw"]), st.integers(0, 3000)), max_size=60
)


@given(looks=looks, begin_ms=st.sampled_from([0, (1 << 30) - 1000]))
def test_a_stick_drives_only_by_a_push_after_a_release(looks, begin_ms):
    switch, now_ms, rested, silent_ms = DeadmanSwitch(), begin_ms, False, RESTS_MS
    for look, later in looks:
        now_ms, silent_ms = later_ms(now_ms, later), silent_ms + later
        if isinstance(look, str):
            getattr(switch, look)()
            rested = False
            continue
        wish = switch.update(look, now_ms)
        rested = look is not None and (rested or look == REST)
        if wish and any(wish):
            assert rested
            assert wish == look
            silent_ms = 0
        elif rested and look != REST:
            pytest.fail("a push behind a rest did nothing")
        elif wish is not None:
            assert silent_ms < RESTS_MS


# gamepads


def shown(now_ms=0, stick=None, **numbers):
    return (stick or PadStick()).axes(NO_NUMBERS._replace(**numbers), now_ms)


@pytest.mark.parametrize("number", [FULL, -FULL - 1])
def test_full_is_full_on_each_side(number):
    sign = 1 if number > 0 else -1
    assert shown(left_x=number) == (0, sign)
    assert shown(left_y=number) == (-sign, 0)


def test_triggers_are_speed_and_the_stronger_of_stick_and_triggers_counts():
    assert shown(right_trigger=FULL) == (1, 0)
    assert shown(left_trigger=FULL) == (-1, 0)
    assert shown(right_trigger=FULL, left_trigger=FULL) == (0, 0)
    assert shown(right_trigger=FULL, left_y=FULL // 2) == (1, 0)
    assert shown(right_trigger=FULL // 3, left_y=FULL) == (-1, 0)


def test_what_a_worn_stick_shows_at_rest_is_rest_and_beyond_it_begins_at_nothing():
    edge = int(FULL * DEAD_ZONE)
    for sign in (1, -1):
        assert shown(left_x=sign * edge, left_y=sign * edge) == (0, 0)
        _, steering = shown(left_x=sign * (edge + 40))
        assert 0 < sign * steering < 0.01


def test_a_push_that_is_too_still_for_a_hand_is_not_believed():
    stick = PadStick()
    assert shown(0, stick, left_y=-FULL) == (1, 0)
    assert shown(LONGEST_STILL_MS, stick, left_y=-FULL) == (1, 0)
    assert shown(LONGEST_STILL_MS + 1, stick, left_y=-FULL) is None


def test_any_tremble_of_any_axis_is_a_sign_of_a_hand():
    stick = PadStick()
    for second in range(10):
        assert shown(1000 * second, stick, left_y=-FULL, right_x=second) == (1, 0)


def test_a_stick_that_rested_for_long_is_believed_when_it_is_pushed():
    stick = PadStick()
    for now_ms in (0, LONGEST_STILL_MS + 1, 5 * LONGEST_STILL_MS):
        assert shown(now_ms, stick) == (0, 0)
    assert shown(6 * LONGEST_STILL_MS, stick, left_x=FULL) == (0, 1)
