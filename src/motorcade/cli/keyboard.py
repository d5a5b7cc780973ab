"""Read a terminal's keys as a stick, at a car or far from it."""

import sys
import time
from contextlib import ExitStack
from types import TracebackType
from typing import Self

from blessed import Terminal
from blessed.keyboard import Keystroke

from motorcade.drive.input.deadman import (
    AHEAD,
    BACK,
    CLEAR,
    LEFT,
    QUIT,
    RELEASE,
    REQUEST,
    RESUME,
    RIGHT,
    STOP,
    KeyStick,
    Reading,
)
from motorcade.errors import MotorcadeError

THROTTLE, HOLD_S = 0.4, 0.25
_STEERS = {"w": AHEAD, "s": BACK, "a": LEFT, "d": RIGHT}
_ARROWS = {"KEY_UP": AHEAD, "KEY_DOWN": BACK, "KEY_LEFT": LEFT, "KEY_RIGHT": RIGHT}
_ORDERS = {" ": STOP, "c": CLEAR, "g": RELEASE, "t": REQUEST, "p": RESUME, "q": QUIT}
# Terminals that report releases send Ctrl-C as a key too.
_QUITS = ("KEY_CTRL_C", "KEY_ESCAPE")
_STEP, _LEAST = 0.05, 0.05
_QUERY_S = 0.3


def check_terminal() -> None:
    """Check that input and output are a terminal. Raises MotorcadeError."""
    if not (sys.stdin and sys.stdin.isatty() and sys.stdout and sys.stdout.isatty()):
        raise MotorcadeError("keyboard-needs-terminal")


class Keyboard:
    """The keyboard of this terminal: ``with Keyboard() as keyboard: ...``, all in one thread.

    Args:
        throttle: the throttle of a key, 0 to 1; the user changes it.
        hold_s: see `KeyStick`.

    Attributes:
        terminal: where to write.
    """

    def __init__(self, throttle: float = THROTTLE, hold_s: float = HOLD_S) -> None:
        self.throttle = throttle
        self.terminal = Terminal()
        self._hold_s = hold_s
        self._stick = KeyStick(hold_s, reports_releases=False)
        self._modes = ExitStack()

    def __enter__(self) -> Self:
        """Read single keys from now on."""
        with ExitStack() as modes:
            modes.enter_context(self.terminal.cbreak())
            modes.enter_context(
                self.terminal.enable_kitty_keyboard(report_events=True, report_all_keys=True, timeout=_QUERY_S)
            )
            reported = self.terminal.get_kitty_keyboard_state(timeout=_QUERY_S)
            self._stick = KeyStick(self._hold_s, reports_releases=bool(reported and reported.report_events))
            self._modes = modes.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Restore the terminal."""
        self._modes.close()

    def read(self) -> Reading:
        """What the keys command now."""
        orders = []
        while key := self.terminal.inkey(timeout=0):
            if order := self._take(key):
                # An order releases the keys first.
                self._stick.release_all()
                orders.append(order)
        throttle, steering = self._stick.axes(time.monotonic())
        return Reading("keyboard", (throttle * self.throttle, steering), tuple(orders))

    def _take(self, key: Keystroke) -> str | None:
        """Note a key. Returns the order that it is, or None."""
        if key.name in _QUITS:
            return QUIT
        letter = str(key.key_value).lower()
        steers = _ARROWS.get(key.key_name or "") or _STEERS.get(letter)
        if steers:
            (self._stick.release if key.released else self._stick.press)(steers, time.monotonic())
            return None
        if key.released:
            return None
        if letter in ("+", "="):
            self.throttle = min(1.0, self.throttle + _STEP)
        elif letter == "-":
            self.throttle = max(_LEAST, self.throttle - _STEP)
        return _ORDERS.get(letter)
