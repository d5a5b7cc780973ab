"""How often something may be done."""

from hypothesis import given
from hypothesis import strategies as st

from motorcade.timing import RateLimit
from motorcade.words.ticks import TICKS_MASK


@given(st.lists(st.integers(0, 300), max_size=200), st.integers(0, TICKS_MASK))
def test_no_window_has_more_than_the_limit_and_nothing_below_it_is_refused(pauses_ms, begin_ms) -> None:
    limit, now_ms, allowed_ms = RateLimit(10, 1000), begin_ms, []
    for pause_ms in pauses_ms:
        now_ms += pause_ms
        recent = [each for each in allowed_ms if now_ms - each < 1000]
        assert limit.allows(now_ms & TICKS_MASK) == (len(recent) < 10)
        if len(recent) < 10:
            allowed_ms.append(now_ms)
