"""What a client sends and when: a wish lives as long as its caller renews it, and no longer."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.car.arbiter import NEUTRAL
from motorcade.drive.deadman import CommandStream, stick_word
from motorcade.words.formats import DRIVE
from motorcade.words.ticks import later_ms

FRESH_MS, PERIOD_MS = 300, 50
AHEAD, LEFT = stick_word(0.5, 0), stick_word(0.5, -1)


def sent(stream, until_ms, begin_ms=0):
    """What the stream sends from one time to another, a word or None a period."""
    return [stream.next_word(now_ms) for now_ms in range(begin_ms, until_ms, PERIOD_MS)]


def armed(rearm=True):
    """A stream that has wished neutral, and sent it, at 0 ms."""
    stream = CommandStream(FRESH_MS, rearm)
    stream.set_word(NEUTRAL, 0)
    assert stream.next_word(0) == NEUTRAL
    return stream


def test_who_wishes_nothing_sends_nothing():
    assert sent(CommandStream(FRESH_MS, True), 1000) == [None] * 20


def test_the_first_word_is_neutral_and_the_last_wish_follows_until_it_is_no_longer_fresh():
    stream = CommandStream(FRESH_MS, True)
    stream.set_word(LEFT, 0)
    stream.set_word(AHEAD, 0)
    assert sent(stream, 500) == [NEUTRAL, *[AHEAD] * 6, NEUTRAL, None, None]


def test_a_wish_that_is_renewed_goes_on():
    stream = armed()
    for begin_ms in range(100, 2000, 200):
        stream.set_word(AHEAD, begin_ms)
        assert sent(stream, begin_ms + 200, begin_ms) == [AHEAD] * 4


def test_a_car_that_stands_is_steered_and_armed_by_the_same_word():
    stream, steered = CommandStream(FRESH_MS, False), stick_word(0, -1)
    stream.set_word(steered, 0)
    assert sent(stream, 100) == [steered] * 2
    stream.set_word(AHEAD, 100)
    assert stream.next_word(100) == AHEAD


@pytest.mark.parametrize("rearm", [True, False])
def test_a_new_wish_after_a_pause_arms_the_car_again(rearm):
    stream = armed(rearm)
    stream.set_word(AHEAD, 0)
    assert sent(stream, 5000)[-1] is None
    stream.set_word(AHEAD, 5000)
    assert sent(stream, 5150, 5000) == [NEUTRAL, AHEAD, AHEAD]


def test_a_helm_that_may_arms_again_after_a_failsafe():
    stream = armed()
    stream.set_word(AHEAD, 900)
    stream.receive_failsafe(900)
    assert sent(stream, 1000, 900) == [NEUTRAL, AHEAD]


def test_a_helm_that_may_not_waits_until_its_hand_lets_go():
    stream = armed(rearm=False)
    stream.set_word(AHEAD, 600)
    stream.receive_failsafe(600)
    assert sent(stream, 900, 600) == [None] * 6
    assert stream.waits_for_release
    stream.set_word(NEUTRAL, 800)
    assert not stream.waits_for_release
    stream.set_word(LEFT, 850)
    assert sent(stream, 950, 850) == [NEUTRAL, LEFT]


def test_a_failsafe_that_has_been_answered_already_is_not_answered_twice():
    stream = armed()
    stream.set_word(AHEAD, 0)
    stream.receive_failsafe(100)
    assert stream.next_word(100) == AHEAD


@pytest.mark.parametrize("rearm", [True, False])
def test_a_new_connection_begins_with_neutral_and_does_not_jump(rearm):
    stream = armed(rearm)
    stream.set_word(AHEAD, 100)
    assert stream.next_word(100) == AHEAD
    stream.disarm()
    assert sent(stream, 250, 150) == ([NEUTRAL, AHEAD] if rearm else [None, None])


acts = st.lists(
    st.tuples(st.sampled_from(["wish", "neutral", "disarm", "failsafe", "next"]), st.integers(0, 400)), max_size=60
)


@given(acts=acts, rearm=st.booleans(), begin_ms=st.sampled_from([0, (1 << 30) - 1000]))
def test_no_moving_word_is_ever_sent_but_a_fresh_wish_after_a_neutral_one(acts, rearm, begin_ms):
    stream, now_ms, at_ms = CommandStream(FRESH_MS, rearm), begin_ms, 0
    wished_at_ms, neutral_since_disarm = None, False
    for act, later in acts:
        now_ms, at_ms = later_ms(now_ms, later), at_ms + later
        if act == "wish":
            stream.set_word(AHEAD, now_ms)
            wished_at_ms = at_ms
        elif act == "neutral":
            stream.set_word(NEUTRAL, now_ms)
            wished_at_ms = None
        elif act == "disarm":
            stream.disarm()
            neutral_since_disarm = False
        elif act == "failsafe":
            stream.receive_failsafe(now_ms)
        else:
            word = stream.next_word(now_ms)
            assert word in (None, NEUTRAL, AHEAD)
            neutral_since_disarm |= word == NEUTRAL
            if word == AHEAD:
                assert wished_at_ms is not None
                assert at_ms - wished_at_ms <= FRESH_MS
                assert neutral_since_disarm


@pytest.mark.parametrize(
    ("throttle", "steering", "angle", "direction", "speed"),
    [
        (0, 0, 90, 1, 0),
        (1, 0, 90, 1, 255),
        (-1, 0, 90, 0, 255),
        (0.4, -0.2, 108, 1, 102),
        (0, -1, 180, 1, 0),
        (0, 1, 0, 1, 0),
        (-0.0, 0.5, 45, 1, 0),
    ],
)
def test_a_stick_s_axes_become_the_fields_of_a_drive_word(throttle, steering, angle, direction, speed):
    values = DRIVE.decode(stick_word(throttle, steering))
    assert (values.angle, values.direction, values.speed) == (angle, direction, speed)


@pytest.mark.parametrize("wrong", [1.001, -2, float("nan"), float("inf")])
def test_an_axis_out_of_range_is_refused_by_name(wrong):
    with pytest.raises(ValueError, match="throttle is"):
        stick_word(wrong, 0)
    with pytest.raises(ValueError, match=r"steering is .*allowed: -1 to 1"):
        stick_word(0, wrong)
