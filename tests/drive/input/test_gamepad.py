"""A gamepad as SDL reads it: SDL's own code, and a pad that SDL makes up."""

import random

import pytest

from motorcade.drive.input.deadman import CLEAR, STOP
from motorcade.drive.input.gamepad import Gamepad
from motorcade.errors import MotorcadeError
from support.virtual_pad import (
    BUTTONS,
    DOWN,
    LEFT_X,
    LEFT_Y,
    RIGHT_BUTTON,
    RIGHT_TRIGGER,
    RIGHT_X,
    START,
    UP,
    VirtualPad,
)


@pytest.fixture
def plug():
    """Plugs virtual pads in by name; skips loudly where SDL can't be had."""
    try:
        VirtualPad()
    except MotorcadeError as problem:
        pytest.skip(str(problem))
    pads = []

    def plug(*pushed, **about):
        pad = VirtualPad(**about).__enter__()
        pads.append(pad)
        pad.plug(*pushed)
        return pad

    yield plug
    for pad in reversed(pads):
        pad.__exit__()


@pytest.fixture
def gamepad(plug):
    with Gamepad(lambda: 0) as gamepad:
        assert gamepad.read().device is None
        yield gamepad


def settled(gamepad):
    """What it says once SDL has passed on what was done to it."""
    return [gamepad.read() for _ in range(2)][-1]


def test_a_pad_is_found_whether_it_was_there_or_comes(plug):
    plug(name="First")
    with Gamepad() as gamepad:
        assert settled(gamepad).device == "First"
        plug(name="Second")
        assert settled(gamepad).device == "First"


@pytest.mark.parametrize(
    ("axis", "number", "axes"),
    [
        (LEFT_Y, UP, (1, 0)),
        (LEFT_Y, DOWN, (-1, 0)),
        (LEFT_X, UP, (0, -1)),
        (LEFT_X, DOWN, (0, 1)),
        (RIGHT_TRIGGER, DOWN, (1, 0)),
        (RIGHT_X, DOWN, (0, 0)),
    ],
)
def test_the_left_stick_drives_and_the_triggers_do(plug, gamepad, axis, number, axes):
    pad = plug()
    assert settled(gamepad).axes == (0, 0)
    pad.push(axis, number)
    assert settled(gamepad).axes == axes


def test_a_pad_that_goes_is_missed_at_one_look_though_another_is_there(plug, gamepad):
    first, _ = plug(name="First"), plug(name="Second")
    assert settled(gamepad).device == "First"
    first.push(LEFT_Y, UP)
    assert settled(gamepad).axes == (1, 0)
    first.unplug()
    seen = [gamepad.read() for _ in range(3)]
    assert [(each.device, each.axes) for each in seen] == [(None, None), ("Second", (0, 0)), ("Second", (0, 0))]


def test_a_button_is_an_order_once_however_long_it_is_held(plug, gamepad):
    pad = plug()
    settled(gamepad)
    orders = []
    for button in (RIGHT_BUTTON, START, 0):
        pad.hold(button)
        orders += [order for _ in range(4) for order in gamepad.read().orders]
    assert orders == [STOP, CLEAR]


def test_the_buttons_of_a_pad_that_does_not_drive_give_no_orders(plug, gamepad):
    plug(name="First")
    settled(gamepad)
    plug(name="Second").hold(RIGHT_BUTTON)
    assert [gamepad.read().orders for _ in range(3)] == [()] * 3


def test_what_is_no_gamepad_is_told_and_never_driven_by(plug, gamepad):
    plug((1, UP), name="Odd\x1b[2J wheel" + "!" * 60, is_gamepad=False)
    notices = [reading.notice for reading in (gamepad.read(), gamepad.read()) if reading.notice]
    assert [notice.code for notice in notices] == ["not-a-gamepad"]
    assert "\x1b" not in str(notices[0])
    assert "Odd" in notices[0].sentence("zh")
    assert gamepad.read().device is None


def test_whatever_a_pad_shows_gives_axes_in_range(plug, gamepad):
    pad, dice = plug(), random.Random(6)
    for _ in range(300):
        for _ in range(dice.randrange(8)):
            pad.push(dice.randrange(6), dice.randint(UP, DOWN))
            pad.hold(dice.randrange(BUTTONS), dice.random() < 0.5)
        reading = gamepad.read()
        if reading.axes:
            assert all(-1 <= axis <= 1 for axis in reading.axes)


def test_a_pad_whose_radio_is_gone_is_not_believed(plug):
    now_ms = 0
    pad = plug()
    with Gamepad(lambda: now_ms) as gamepad:
        settled(gamepad)
        pad.push(LEFT_Y, UP)
        assert settled(gamepad).axes == (1, 0)
        now_ms = 4000
        assert gamepad.read().axes is None
        assert gamepad.read().device == "Pad of the tests"
