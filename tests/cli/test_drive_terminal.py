"""A stick made of keys: whoever lets go, lets go."""

import pytest

from motorcade.cli.drive_terminal import AHEAD, BACK, LEFT, RIGHT, KeyStick

HOLD_S = 0.25


@pytest.fixture
def keys():
    return KeyStick(HOLD_S)


@pytest.mark.parametrize(("key", "axes"), [(AHEAD, (1, 0)), (BACK, (-1, 0)), (LEFT, (0, -1)), (RIGHT, (0, 1))])
def test_each_key_moves_one_axis(keys, key, axes):
    assert keys.axes(0) == (0, 0)
    keys.press(key, 5)
    assert keys.axes(5) == axes


def test_a_key_that_no_longer_repeats_is_released(keys):
    for at_s in (0, 0.2, 0.4):
        keys.press(AHEAD, at_s)
        assert keys.axes(at_s + 0.2) == (1, 0)
    assert keys.axes(0.7) == (0, 0)


def test_keys_that_are_pressed_together_live_as_long_as_the_newest_repeats(keys):
    keys.press(AHEAD, 0)
    for at_s in (0.2, 0.4, 0.6):
        keys.press(LEFT, at_s)
    assert keys.axes(0.8) == (1, -1)
    assert keys.axes(0.9) == (0, 0)


def test_a_key_that_was_over_does_not_come_back_with_another(keys):
    keys.press(AHEAD, 0)
    keys.press(LEFT, 1)
    assert keys.axes(1) == (0, -1)


def test_the_opposite_key_takes_over(keys):
    keys.press(AHEAD, 0)
    keys.press(LEFT, 0)
    keys.press(BACK, 0.1)
    keys.press(RIGHT, 0.1)
    assert keys.axes(0.1) == (-1, 1)
