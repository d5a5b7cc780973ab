"""The terminal of `motorcade drive connect`: its keys, and what it shows."""

import sys
import time
from contextlib import ExitStack, suppress
from typing import Self

from blessed import Terminal
from blessed.keyboard import Keystroke

from motorcade.cli.language import current_language, translated
from motorcade.drive.blocking_client import BlockingDriveClient
from motorcade.drive.connection import CarError
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
    DeadmanSwitch,
    KeyStick,
    Reading,
    StickSource,
)
from motorcade.drive.wire import Telemetry
from motorcade.errors import MotorcadeError, Phrase
from motorcade.timing import monotonic_ms

THROTTLE, HOLD_S = 0.4, 0.25
_STEERS = {"w": AHEAD, "s": BACK, "a": LEFT, "d": RIGHT}
_ARROWS = {"KEY_UP": AHEAD, "KEY_DOWN": BACK, "KEY_LEFT": LEFT, "KEY_RIGHT": RIGHT}
_ORDERS = {" ": STOP, "c": CLEAR, "g": RELEASE, "t": REQUEST, "p": RESUME, "q": QUIT}
# Terminals that report releases send Ctrl-C as a key too.
_QUITS = ("KEY_CTRL_C", "KEY_ESCAPE")
_STEP, _LEAST = 0.05, 0.05
_QUERY_S = 0.3
# A car takes 100 commands a second.
_LOOK_S = 0.02
_DRAW_S = 0.1
_USUAL_SIZE = 80, 24


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

    def __exit__(self, *_: object) -> None:
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


class DriveTerminal:
    """Drive a car from a terminal.

    Args:
        car: the car's name on the screen.
        keyboard: the terminal's keys.
        pad: what steers in place of the keys, which still give the orders.
    """

    def __init__(self, car: str, keyboard: Keyboard, pad: StickSource | None = None) -> None:
        self._car = car
        self._keyboard = keyboard
        self._pad = pad
        self._switch = DeadmanSwitch()
        self._device: str | None = None
        self._notice: MotorcadeError | None = None
        self._is_done = False

    def drive(self, client: BlockingDriveClient) -> None:
        """Drive until the user quits."""
        terminal = self._keyboard.terminal
        with terminal.fullscreen(), terminal.hidden_cursor():
            drawn_s = 0.0
            while not self._is_done:
                time.sleep(_LOOK_S)
                is_away = self._steer(client)
                if time.monotonic() - drawn_s >= _DRAW_S:
                    drawn_s = time.monotonic()
                    self._draw(terminal, client, is_away)

    def _steer(self, client: BlockingDriveClient) -> bool:
        """Send the car what keys and stick command. Returns whether the car can't be reached."""
        keys = self._keyboard.read()
        stick = self._pad.read() if self._pad else keys
        if stick.device != self._device:
            self._device, self._notice = stick.device, None
        self._notice = stick.notice or self._notice
        for order in (*keys.orders, *(stick.orders if stick is not keys else ())):
            with suppress(CarError):
                self._obey(order, client)
        axes = self._switch.update(stick.axes, monotonic_ms())
        if axes is not None:
            with suppress(CarError):
                client.drive(*axes)
        return not client.connected

    def _obey(self, order: str, client: BlockingDriveClient) -> None:
        if order == QUIT:
            self._is_done = True
            return
        self._switch.withdraw()
        orders = {
            STOP: client.stop,
            CLEAR: client.clear,
            RELEASE: client.release,
            RESUME: client.resume_program,
            REQUEST: client.request,
        }
        orders[order]()

    def _draw(self, terminal: Terminal, client: BlockingDriveClient, is_away: bool) -> None:
        # A terminal at a serial line has no known size.
        width, height = terminal.width or _USUAL_SIZE[0], terminal.height or _USUAL_SIZE[1]
        lines = [_text("title", car=self._car), *self._stick_lines(), ""]
        if is_away:
            lines.append(_text("away", car=self._car))
        elif client.telemetry:
            lines += _telemetry_lines(client.telemetry)
            if client.waits_for_release or (self._device and self._switch.must_rest):
                lines.append(terminal.bold(_text("let-go")))
        drives = "" if self._pad else _text("drive-keys", throttle=self._keyboard.throttle)
        lines += ["", *terminal.wrap(_text("keys", drive=drives), width)]
        shown = [terminal.truncate(line, width) + terminal.clear_eol for line in lines[:height]]
        print(terminal.home + "\r\n".join(shown) + terminal.clear_eos, end="", flush=True)

    def _stick_lines(self) -> list[str]:
        if self._pad is None:
            return []
        line = _text("pad", name=self._device) if self._device else _text("no-pad")
        return [line, *([self._notice.sentence(current_language())] if self._notice else [])]


def _telemetry_lines(telemetry: Telemetry) -> list[str]:
    way = _text("ahead" if telemetry.direction else "back")
    wheels = _text("applied", angle=telemetry.angle_deg, way=way, speed=telemetry.speed)
    lines = [
        f"{_text('state')}: {Phrase(f'car-state-{telemetry.state}').sentence(current_language())}",
        f"{_text('driver')}: {telemetry.driver or _text('nobody')}",
        f"{_text('wheels')}: {wheels}",
    ]
    if telemetry.obstacle_mm is not None:
        lines.append(_text("obstacle", distance=telemetry.obstacle_mm // 10))
    if telemetry.age_ms is not None:
        lines.append(_text("age", age=telemetry.age_ms))
    if telemetry.wanted_by:
        lines.append(_text("waits", name=telemetry.wanted_by))
    if telemetry.battery_mv is not None:
        lines.append(f"{_text('battery')}: {telemetry.battery_mv / 1000:.2f} V")
    return lines


def _text(key: str, **details: object) -> str:
    return translated(f"terminal-{key}", **details)
