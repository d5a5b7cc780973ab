"""The terminal of `motorcade drive connect`: its keys, and what it shows."""

import sys
import time
from contextlib import suppress

from blessed import Terminal

from motorcade.cli.output import plain, sentence_of, translated
from motorcade.drive.blocking_client import BlockingDriveClient
from motorcade.drive.wire import Telemetry
from motorcade.errors import DriveError, MotorcadeError, Phrase
from motorcade.words.formats import SWITCHES

AHEAD = "ahead"
BACK = "back"
LEFT = "left"
RIGHT = "right"
_OPPOSITE = {AHEAD: BACK, BACK: AHEAD, LEFT: RIGHT, RIGHT: LEFT}
_ARROWS = {"KEY_UP": AHEAD, "KEY_DOWN": BACK, "KEY_LEFT": LEFT, "KEY_RIGHT": RIGHT}
# A car takes 100 commands a second.
_LOOK_S = 0.02
_DRAW_S = 0.1
_USUAL_SIZE = 80, 24


def check_terminal() -> None:
    """Check that input and output are a terminal. Raises MotorcadeError."""
    if not (sys.stdin and sys.stdin.isatty() and sys.stdout and sys.stdout.isatty()):
        raise MotorcadeError("keyboard-needs-terminal")


class KeyTerminal(Terminal):
    """A terminal whose keys are read whatever bytes come: what is no text, such as Alt and a letter, is another key."""

    def __init__(self, force_styling: bool | None = False) -> None:
        super().__init__(force_styling=force_styling)
        self._keyboard_decoder = type(self._keyboard_decoder)("replace")


class KeyStick:
    """Make axes of keys.

    Most terminals report a key only when it is pressed and repeatedly while it is held, and of several keys the newest
    alone. So keys that are pressed together count while the newest one repeats, and all are released ``hold_s`` after
    its last repetition.
    """

    def __init__(self, hold_s: float) -> None:
        self._hold_s = hold_s
        self._down: set[str] = set()
        self._event_s = 0.0

    def press(self, key: str, now_s: float) -> None:
        """Note that AHEAD, BACK, LEFT or RIGHT is pressed, or repeats."""
        self._expire(now_s)
        self._down.discard(_OPPOSITE[key])
        self._down.add(key)
        self._event_s = now_s

    def axes(self, now_s: float) -> tuple[int, int]:
        """Throttle and steering, each -1, 0 or 1, as `motorcade.drive.wire.stick_word` takes them."""
        self._expire(now_s)
        return (AHEAD in self._down) - (BACK in self._down), (RIGHT in self._down) - (LEFT in self._down)

    def _expire(self, now_s: float) -> None:
        if now_s - self._event_s > self._hold_s:
            self._down.clear()


class DriveTerminal:
    """Drive a car by the keys of this terminal.

    Args:
        car: the car's name on the screen.
        throttle: the throttle of a key, 0 to 1.
        hold_s: see `KeyStick`.
    """

    def __init__(self, car: str, throttle: float, hold_s: float) -> None:
        self._car = car
        self._throttle = throttle
        self._terminal = KeyTerminal()
        self._stick = KeyStick(hold_s)
        self._drives = self._is_done = False
        self._hold_s = hold_s
        # When the key of a switch that is held was last pressed, by the switch's name.
        self._pressed_s: dict[str, float] = {}

    def drive(self, client: BlockingDriveClient) -> None:
        """Drive until the user quits."""
        terminal = self._terminal
        with terminal.cbreak(), terminal.fullscreen(), terminal.hidden_cursor():
            # Keys that were pressed before the user saw the car don't drive it.
            while terminal.inkey(timeout=0):
                pass
            drawn_s = 0.0
            while not self._is_done:
                time.sleep(_LOOK_S)
                self._steer(client)
                if time.monotonic() - drawn_s >= _DRAW_S:
                    drawn_s = time.monotonic()
                    self._draw(client)

    def _steer(self, client: BlockingDriveClient) -> None:
        """Send the car what the keys command."""
        switches: dict[str, int] = {}
        while key := self._terminal.inkey(timeout=0):
            if direction := _ARROWS.get(key.name or ""):
                self._stick.press(direction, time.monotonic())
            elif switch := next((switch for switch in SWITCHES if switch.key == key.lower()), None):
                if switch.is_held:
                    self._pressed_s[switch.name] = time.monotonic()
                elif client.telemetry:
                    switches[switch.name] = 1 - client.telemetry.switches.get(switch.name, 0)
            elif key.name == "KEY_ESCAPE" or key.lower() == "q":
                self._is_done = True
            elif order := {" ": client.stop, "c": client.clear}.get(key.lower()):
                try:
                    order()
                except DriveError:
                    # It can't be reached, or takes no requests: then commands alone can stop it.
                    self._stick = KeyStick(self._hold_s)
                    self._drives = True
        throttle, steering = self._stick.axes(time.monotonic())
        for name, pressed_s in self._pressed_s.items():
            if time.monotonic() - pressed_s <= self._hold_s:
                switches[name] = 1
        is_held = bool(throttle or steering or switches)
        # A release is one command to stand still, which the client repeats; then others can have the wheel.
        if is_held or self._drives:
            self._drives = is_held
            with suppress(DriveError):
                client.drive(throttle * self._throttle, steering, **switches)

    def _draw(self, client: BlockingDriveClient) -> None:
        terminal = self._terminal
        # A terminal at a serial line has no known size.
        width = terminal.width or _USUAL_SIZE[0]
        height = terminal.height or _USUAL_SIZE[1]
        lines = [plain(_text("title", car=self._car)), ""]
        if not client.connected:
            lines.append(plain(_text("away", car=self._car)))
        elif client.telemetry:
            lines += map(plain, _telemetry_lines(client.telemetry))
            if client.waits_for_release:
                lines.append(terminal.bold(_text("let-go")))
        lines += ["", *terminal.wrap(_text("keys"), width)]
        if client.telemetry:
            for switch in SWITCHES:
                if (is_on := client.telemetry.switches.get(switch.name)) is not None:
                    name = Phrase(f"device-{switch.name}")
                    lines.append(_text("switch", letter=switch.key, name=name, state=_text("on" if is_on else "off")))
        shown = [terminal.truncate(line, width) + terminal.clear_eol for line in lines[:height]]
        print(terminal.home + "\r\n".join(shown) + terminal.clear_eos, end="", flush=True)


def _telemetry_lines(telemetry: Telemetry) -> list[str]:
    way = _text("ahead" if telemetry.direction else "back")
    wheels = _text("applied", angle=telemetry.angle_deg, way=way, speed=telemetry.speed)
    lines = [
        f"{_text('state')}: {sentence_of(Phrase(f'car-state-{telemetry.state}'))}",
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
