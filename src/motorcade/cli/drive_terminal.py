"""What `motorcade drive connect` shows and which keys it takes."""

import time
from contextlib import suppress

from blessed import Terminal

from motorcade.cli.driving_texts import STATES
from motorcade.cli.keyboard import Keyboard
from motorcade.drive.blocking_client import BlockingDriveClient
from motorcade.drive.connection import CarError
from motorcade.drive.input.deadman import CLEAR, QUIT, RELEASE, REQUEST, RESUME, STOP, DeadmanSwitch, StickSource
from motorcade.drive.wire import Telemetry
from motorcade.errors import MotorcadeError
from motorcade.timing import monotonic_ms

# A car takes 100 commands a second.
_LOOK_S = 0.02
_DRAW_S = 0.1
_USUAL_SIZE = 80, 24

TEXTS = {
    "en": {
        "title": "Driving {car}",
        "away": "{car} is away; trying again. It stands still meanwhile.",
        "let-go": "Let go of the keys or the stick, then drive on.",
        "pad": "gamepad: {name}; its right button is the emergency stop, Start lifts it",
        "no-pad": "No gamepad is there: plug one in.",
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
        "keys": "{drive}space emergency stop · c lift it · t take the wheel · g give it back · p program · q leave",
        "drive-keys": "arrows or WASD drive · + - throttle {throttle:.0%} · ",
    },
    "zh": {
        "title": "正在驾驶 {car}",
        "away": "{car} 已断开，正在重试。其间它停在原地。",
        "let-go": "请先松开按键或摇杆，再继续驾驶。",
        "pad": "手柄：{name}；右侧按钮为紧急停止，Start 解除",
        "no-pad": "没有手柄：请插入一个。",
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
        "keys": "{drive}空格 紧急停止 · c 解除 · t 取得方向盘 · g 交还 · p 程序 · q 离开",
        "drive-keys": "方向键或 WASD 驾驶 · + - 油门 {throttle:.0%} · ",
    },
}


class DriveTerminal:
    """A terminal that drives a car.

    Args:
        car: what the car is called on the screen.
        keyboard: its keys.
        language: en or zh.
        pad: what drives in place of the keys, which still give the orders.
    """

    def __init__(self, car: str, keyboard: Keyboard, language: str, pad: StickSource | None = None) -> None:
        self._car = car
        self._keyboard = keyboard
        self._pad = pad
        self._language = language
        self._texts = TEXTS[language] | STATES[language]
        self._switch = DeadmanSwitch()
        self._device: str | None = None
        self._notice: MotorcadeError | None = None
        self._is_done = False

    def drive(self, client: BlockingDriveClient) -> None:
        """Drive until the user leaves."""
        terminal = self._keyboard.terminal
        with terminal.fullscreen(), terminal.hidden_cursor():
            drawn_s = 0.0
            while not self._is_done:
                time.sleep(_LOOK_S)
                is_away = not self._steer(client)
                if time.monotonic() - drawn_s >= _DRAW_S:
                    drawn_s = time.monotonic()
                    self._draw(terminal, client, is_away)

    def _steer(self, client: BlockingDriveClient) -> bool:
        """Tell the car what the hand wants; False while it is away."""
        keys = self._keyboard.read()
        stick = self._pad.read() if self._pad else keys
        if stick.device != self._device:
            self._device, self._notice = stick.device, None
        self._notice = stick.notice or self._notice
        for order in (*keys.orders, *(stick.orders if stick is not keys else ())):
            with suppress(CarError):
                self._obey(order, client)
        wish = self._switch.update(stick.axes, monotonic_ms())
        if wish is not None:
            with suppress(CarError):
                client.drive(*wish)
        return client.connected

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
        # A terminal at a serial line doesn't know its size.
        width, height = terminal.width or _USUAL_SIZE[0], terminal.height or _USUAL_SIZE[1]
        lines = [self._texts["title"].format(car=self._car), *self._stick_lines(), ""]
        if is_away:
            lines.append(self._texts["away"].format(car=self._car))
        elif client.telemetry:
            lines += self._told(client.telemetry)
            if client.waits_for_release or (self._device and self._switch.must_rest):
                lines.append(terminal.bold(self._texts["let-go"]))
        drives = "" if self._pad else self._texts["drive-keys"].format(throttle=self._keyboard.throttle)
        lines += ["", *terminal.wrap(self._texts["keys"].format(drive=drives), width)]
        shown = [terminal.truncate(line, width) + terminal.clear_eol for line in lines[:height]]
        print(terminal.home + "\r\n".join(shown) + terminal.clear_eos, end="", flush=True)

    def _stick_lines(self) -> list[str]:
        if self._pad is None:
            return []
        line = self._texts["pad"].format(name=self._device) if self._device else self._texts["no-pad"]
        return [line, *([self._notice.sentence(self._language)] if self._notice else [])]

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
