"""What `motorcade drive connect` shows and which keys it takes."""

import sys
import time
from contextlib import ExitStack, suppress

from blessed import Terminal
from blessed.keyboard import Keystroke

from motorcade.cli.failures import UsageError
from motorcade.link.blocking_drive_client import BlockingDriveClient
from motorcade.link.car_failures import CarError
from motorcade.link.driving.key_stick import AHEAD, BACK, LEFT, RIGHT, KeyStick
from motorcade.link.driving.telemetry import Telemetry

_KEYS = {"w": AHEAD, "s": BACK, "a": LEFT, "d": RIGHT}
_ARROWS = {"KEY_UP": AHEAD, "KEY_DOWN": BACK, "KEY_LEFT": LEFT, "KEY_RIGHT": RIGHT}
_LOOK_S = 0.05
_DRAW_S = 0.1
# A driver whose keys rest for longer lets others have the wheel.
_RESTS_S = 2.0
_STEP, _LEAST = 0.05, 0.05
_QUERY_S = 0.3
_USUAL_SIZE = 80, 24

TEXTS = {
    "en": {
        "title": "Driving {car}",
        "away": "{car} is away; trying again. It stands still meanwhile.",
        "let-go": "The car stopped by itself: let go of the keys, then drive on.",
        "state": "state",
        "driver": "driver",
        "nobody": "nobody",
        "waits": "{name} waits for the wheel",
        "wheels": "wheels",
        "applied": "{angle}°, {way} {speed}",
        "ahead": "ahead",
        "back": "back",
        "age": "last command {age} ms ago",
        "battery": "battery",
        "keys": "arrows or WASD drive · + - throttle {throttle:.0%} · space emergency stop · c lift it · "
        "t take the wheel · g give it back · p program · q leave",
        "ready": "ready",
        "standing": "standing",
        "moving": "moving",
        "failsafe": "stopped by itself",
        "stopped": "EMERGENCY STOP",
        "program": "runs its program",
    },
    "zh": {
        "title": "正在驾驶 {car}",
        "away": "{car} 已断开，正在重试。其间它停在原地。",
        "let-go": "小车已自动停下：请先松开按键，再继续驾驶。",
        "state": "状态",
        "driver": "驾驶者",
        "nobody": "无",
        "waits": "{name} 在等待方向盘",
        "wheels": "车轮",
        "applied": "{angle}°，{way} {speed}",
        "ahead": "前进",
        "back": "后退",
        "age": "上一条指令在 {age} 毫秒前",
        "battery": "电池",
        "keys": "方向键或 WASD 驾驶 · + - 油门 {throttle:.0%} · 空格 紧急停止 · c 解除 · "
        "t 取得方向盘 · g 交还 · p 程序 · q 离开",
        "ready": "就绪",
        "standing": "停住",
        "moving": "行驶中",
        "failsafe": "已自动停下",
        "stopped": "紧急停止",
        "program": "正在运行程序",
    },
}


def check_terminal() -> None:
    """Raise UsageError where nobody sits at a keyboard."""
    if not (sys.stdin and sys.stdin.isatty() and sys.stdout and sys.stdout.isatty()):
        raise UsageError("driving with the keyboard needs a terminal; a script drives with `motorcade drive send`")


class Cockpit:
    """A terminal that drives a car.

    Args:
        car: what the car is called on the screen.
        throttle: what a key gives, 0 to 1.
        hold_s: as `KeyStick` takes it.
        language: en or zh.
    """

    def __init__(self, car: str, throttle: float, hold_s: float, language: str) -> None:
        self._car = car
        self._throttle = throttle
        self._hold_s = hold_s
        self._texts = TEXTS[language]
        self._stick = KeyStick(hold_s, tells_releases=False)
        self._touched_s = float("-inf")
        self._is_done = False

    def drive(self, client: BlockingDriveClient) -> None:
        """Drive until the user leaves."""
        terminal = Terminal()
        with ExitStack() as stack:
            for mode in (terminal.fullscreen(), terminal.cbreak(), terminal.hidden_cursor()):
                stack.enter_context(mode)
            stack.enter_context(
                terminal.enable_kitty_keyboard(report_events=True, report_all_keys=True, timeout=_QUERY_S)
            )
            reported = terminal.get_kitty_keyboard_state(timeout=_QUERY_S)
            self._stick = KeyStick(self._hold_s, tells_releases=bool(reported and reported.report_events))
            drawn_s = 0.0
            while not self._is_done:
                key = terminal.inkey(timeout=_LOOK_S)
                while key:
                    self._take(key, client)
                    key = terminal.inkey(timeout=0)
                is_away = not self._wish(client)
                if time.monotonic() - drawn_s >= _DRAW_S:
                    drawn_s = time.monotonic()
                    self._draw(terminal, client, is_away)

    def _take(self, key: Keystroke, client: BlockingDriveClient) -> None:
        # Terminals that tell of releases send Ctrl-C as a key too.
        if key.name in ("KEY_CTRL_C", "KEY_ESCAPE"):
            self._is_done = True
            return
        now_s, letter = time.monotonic(), str(key.key_value).lower()
        steers = _ARROWS.get(key.key_name or "") or _KEYS.get(letter)
        if steers:
            self._touched_s = now_s
            (self._stick.release if key.released else self._stick.press)(steers, now_s)
        elif not key.released:
            with suppress(CarError):
                self._command(letter, client)

    def _command(self, letter: str, client: BlockingDriveClient) -> None:
        if letter in ("+", "="):
            self._throttle = min(1.0, self._throttle + _STEP)
        elif letter == "-":
            self._throttle = max(_LEAST, self._throttle - _STEP)
        elif letter == "q":
            self._is_done = True
        elif letter in "cgpt " and letter:
            # What isn't driving ends driving first.
            self._stick.let_go()
            self._touched_s = float("-inf")
            orders = {
                " ": client.stop,
                "c": client.clear,
                "g": client.release,
                "p": client.resume_program,
                "t": client.request,
            }
            orders[letter]()

    def _wish(self, client: BlockingDriveClient) -> bool:
        """Tell the car what the keys say; False while it is away."""
        now_s = time.monotonic()
        throttle, steering = self._stick.axes(now_s)
        if throttle or steering:
            self._touched_s = now_s
        if now_s - self._touched_s > _RESTS_S:
            return client.connected
        with suppress(CarError):
            client.drive(throttle * self._throttle, steering)
        return client.connected

    def _draw(self, terminal: Terminal, client: BlockingDriveClient, is_away: bool) -> None:
        # A terminal at a serial line doesn't know its size.
        width, height = terminal.width or _USUAL_SIZE[0], terminal.height or _USUAL_SIZE[1]
        lines = [self._texts["title"].format(car=self._car), ""]
        if is_away:
            lines.append(self._texts["away"].format(car=self._car))
        elif client.telemetry:
            lines += self._told(client.telemetry)
            if client.waits_for_release:
                lines.append(terminal.bold(self._texts["let-go"]))
        lines += ["", *terminal.wrap(self._texts["keys"].format(throttle=self._throttle), width)]
        shown = [terminal.truncate(line, width) + terminal.clear_eol for line in lines[:height]]
        print(terminal.home + "\r\n".join(shown) + terminal.clear_eos, end="", flush=True)

    def _told(self, telemetry: Telemetry) -> list[str]:
        texts = self._texts
        way = texts["ahead" if telemetry.direction else "back"]
        lines = [
            f"{texts['state']}: {texts.get(telemetry.state, telemetry.state)}",
            f"{texts['driver']}: {telemetry.driver or texts['nobody']}",
            f"{texts['wheels']}: " + texts["applied"].format(angle=telemetry.angle_deg, way=way, speed=telemetry.speed),
        ]
        if telemetry.age_ms is not None:
            lines.append(texts["age"].format(age=telemetry.age_ms))
        if telemetry.wanted_by:
            lines.append(texts["waits"].format(name=telemetry.wanted_by))
        if telemetry.battery_mv is not None:
            lines.append(f"{texts['battery']}: {telemetry.battery_mv / 1000:.2f} V")
        return lines
