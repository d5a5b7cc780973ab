"""A stick made of keys: whoever lets go, lets go."""

import pytest

from motorcade.drive.input.deadman import AHEAD, BACK, LEFT, LONGEST_HOLD_S, RIGHT, KeyStick

HOLD_S = 0.25


@pytest.fixture
def plain():
    return KeyStick(HOLD_S, reports_releases=False)


@pytest.fixture
def telling():
    return KeyStick(HOLD_S, reports_releases=True)


def test_nothing_is_pressed_at_first(plain):
    assert plain.axes(0) == plain.axes(1000) == (0, 0)


@pytest.mark.parametrize(("key", "axes"), [(AHEAD, (1, 0)), (BACK, (-1, 0)), (LEFT, (0, -1)), (RIGHT, (0, 1))])
def test_each_key_moves_one_axis(plain, key, axes):
    plain.press(key, 5)
    assert plain.axes(5) == axes


def test_a_key_that_no_longer_repeats_is_released(plain):
    for at_s in (0, 0.2, 0.4):
        plain.press(AHEAD, at_s)
        assert plain.axes(at_s + 0.2) == (1, 0)
    assert plain.axes(0.7) == (0, 0)


def test_keys_that_are_pressed_together_live_as_long_as_the_newest_repeats(plain):
    plain.press(AHEAD, 0)
    for at_s in (0.2, 0.4, 0.6):
        plain.press(LEFT, at_s)
    assert plain.axes(0.8) == (1, -1)
    assert plain.axes(0.9) == (0, 0)


def test_a_key_that_was_over_does_not_come_back_with_another(plain):
    plain.press(AHEAD, 0)
    plain.press(LEFT, 1)
    assert plain.axes(1) == (0, -1)


def test_the_opposite_key_takes_over(plain):
    plain.press(AHEAD, 0)
    plain.press(LEFT, 0)
    plain.press(BACK, 0.1)
    plain.press(RIGHT, 0.1)
    assert plain.axes(0.1) == (-1, 1)


def test_letting_go_is_at_once(plain):
    plain.press(AHEAD, 0)
    plain.release_all()
    assert plain.axes(0) == (0, 0)


def test_where_releases_are_told_a_key_is_down_until_then(telling):
    telling.press(AHEAD, 0)
    telling.press(LEFT, 0.6)
    telling.release(LEFT, 0.9)
    assert telling.axes(0.9) == (1, 0)
    telling.release(AHEAD, 1)
    assert telling.axes(1) == (0, 0)


def test_a_terminal_that_has_fallen_silent_holds_no_key(telling):
    telling.press(AHEAD, 0)
    assert telling.axes(LONGEST_HOLD_S) == (1, 0)
    assert telling.axes(LONGEST_HOLD_S + 0.01) == (0, 0)
