"""Times on a car continue across the wrap of the clock at 2^30 ms."""

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from motorcade.words.ticks import elapsed_ms, later_ms, reached

LAST_TICK = 1_073_741_823
SIX_DAYS_MS = 536_870_912

TICKS = st.integers(0, LAST_TICK)
# Half of them so close to the wrap that a short time goes across it.
TICKS_NEAR_THE_WRAP = TICKS | st.integers(LAST_TICK - 5000, LAST_TICK)


@pytest.mark.parametrize(
    ("now_ms", "then_ms", "expected_ms"),
    [(700, 200, 500), (0, LAST_TICK, 1), (250, LAST_TICK - 249, 500), (7, 7, 0), (6, 7, LAST_TICK)],
)
def test_elapsed_time_is_right_across_the_wrap(now_ms, then_ms, expected_ms):
    assert elapsed_ms(now_ms, then_ms) == expected_ms


@given(begin_ms=TICKS_NEAR_THE_WRAP, duration_ms=st.integers(0, 10_000) | TICKS)
def test_what_begins_and_lasts_has_lasted_so_long_at_its_end(begin_ms, duration_ms):
    end_ms = later_ms(begin_ms, duration_ms)
    assert 0 <= end_ms <= LAST_TICK
    assert elapsed_ms(end_ms, begin_ms) == duration_ms


@given(begin_ms=TICKS_NEAR_THE_WRAP, ahead_ms=st.integers(1, 10_000) | st.integers(1, SIX_DAYS_MS))
@example(begin_ms=7, ahead_ms=SIX_DAYS_MS)
def test_a_tick_ahead_is_still_to_come(begin_ms, ahead_ms):
    assert reached(begin_ms, later_ms(begin_ms, ahead_ms)) == 0


@given(due_ms=TICKS_NEAR_THE_WRAP, late_ms=st.integers(0, 10_000) | st.integers(0, SIX_DAYS_MS - 1))
@example(due_ms=7, late_ms=SIX_DAYS_MS - 1)
def test_a_tick_is_reached_on_time_and_however_late(due_ms, late_ms):
    assert reached(later_ms(due_ms, late_ms), due_ms) == 1
