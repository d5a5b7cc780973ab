"""How often something may be done."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.errors import MotorcadeError
from motorcade.timing import Attempts, RateLimit
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


def test_who_has_tried_too_often_is_told_how_long_to_wait_and_others_are_not():
    attempts = Attempts(2, 60.0)
    attempts.count("Mia", 10.0)
    attempts.count("Mia", 30.5)
    with pytest.raises(MotorcadeError) as refused:
        attempts.count("Mia", 40.0)
    assert refused.value.details == {"seconds": 30, "most": 1}
    attempts.count("Bo", 40.0)
    # What was refused doesn't count.
    attempts.count("Mia", 70.0)
    with pytest.raises(MotorcadeError):
        attempts.check("Mia", 90.4)
    attempts.check("Mia", 90.5)
