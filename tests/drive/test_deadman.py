"""What keys command: nothing by themselves, and nothing that was held before."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.drive.deadman import RESTS_MS, DeadmanSwitch
from motorcade.words.ticks import later_ms

REST, PUSHED, STILL = (0, 0), (0.5, -1), (0, 0)


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


def test_withdraw_commands_nothing_until_a_release(switch):
    switch.update(PUSHED, 0)
    switch.withdraw()
    assert switch.update(PUSHED, 40) is None
    assert switch.update(REST, 60) is None
    assert switch.update(PUSHED, 80) == PUSHED


looks = st.lists(st.tuples(st.sampled_from([REST, PUSHED, (1, 0), "withdraw"]), st.integers(0, 3000)), max_size=60)


@given(looks=looks, begin_ms=st.sampled_from([0, (1 << 30) - 1000]))
def test_a_stick_drives_only_by_a_push_after_a_release(looks, begin_ms):
    switch, now_ms, rested, silent_ms = DeadmanSwitch(), begin_ms, False, RESTS_MS
    for look, later in looks:
        now_ms, silent_ms = later_ms(now_ms, later), silent_ms + later
        if isinstance(look, str):
            switch.withdraw()
            rested = False
            continue
        wish = switch.update(look, now_ms)
        rested = rested or look == REST
        if wish and any(wish):
            assert rested
            assert wish == look
            silent_ms = 0
        elif rested and look != REST:
            pytest.fail("a push behind a rest did nothing")
        elif wish is not None:
            assert silent_ms < RESTS_MS
