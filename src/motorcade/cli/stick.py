"""What steers at this computer: the keyboard of the terminal, or a gamepad."""

from contextlib import AbstractContextManager
from enum import StrEnum
from typing import TYPE_CHECKING

from motorcade.cli.recordings import needs_extra

if TYPE_CHECKING:
    from motorcade.drive.input.deadman import StickSource
    from motorcade.drive.input.gamepad import Gamepad


class StickName(StrEnum):
    """What can steer."""

    KEYBOARD = "keyboard"
    GAMEPAD = "gamepad"


def gamepad() -> "Gamepad":
    """A gamepad, to be opened. Raises UsageError or MotorcadeError where none can be read."""
    with needs_extra("a gamepad", "gamepad"):
        from motorcade.drive.input.gamepad import Gamepad

        return Gamepad()


def stick_at_the_car(name: StickName) -> "AbstractContextManager[StickSource]":
    """A stick that drives the car that is served here, to be opened. Raises UsageError or MotorcadeError."""
    if name == StickName.GAMEPAD:
        return gamepad()
    with needs_extra("driving with the keyboard", "drive"):
        from motorcade.cli.keyboard import Keyboard, check_terminal

    check_terminal()
    return Keyboard()
