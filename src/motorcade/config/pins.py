"""Pin files: which of a car's devices hangs on which pin, the same TOML for every kind of board.

    format = "motorcade-pins/1"
    name = "Classroom car"
    chip = "raspberry-pi"

    [left_motor]
    forward = 5
    backward = 6

A device that has no table is not there; DEVICES says which there are. Pins are
the chip's own numbers (GPIO or BCM), not those of a connector.
"""

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from motorcade.boards.linux.chips import CHIPS, Chip
from motorcade.config.pin_sentences import NO_TEXT, PINS, ranges
from motorcade.errors import ToldError

FORMAT = "motorcade-pins/1"
DUTY_MAX = 255
_LONGEST_NAME = 60
_LEVELS = 4


class PinsError(ToldError, ValueError):
    """A pin file that isn't there, isn't TOML, can't be or is another car's."""

    SENTENCES = PINS


class Role(NamedTuple):
    """One wire of a device.

    Attributes:
        key: its name in the pin file.
        drives: whether the computer drives it; else it reads it.
        needed: whether the device is of no use without it.
        terminal: what is printed at the device's end, as a rule.
    """

    key: str
    drives: bool
    needed: bool
    terminal: str


class Device(NamedTuple):
    """Something that a car may have.

    Attributes:
        key: its table in the pin file.
        title, title_zh: what people call it.
        supply: what it needs besides the wires of its roles.
        roles: its wires.
    """

    key: str
    title: str
    title_zh: str
    supply: str
    roles: tuple[Role, ...]


class Wire(NamedTuple):
    """A device's wire and the pin that it leads to."""

    device: Device
    role: Role
    pin: int


def _motor(key: str, title: str, title_zh: str, terminals: tuple[str, str, str]) -> Device:
    forward, backward, enable = terminals
    roles = (
        Role("forward", True, True, forward),
        Role("backward", True, True, backward),
        Role("enable", True, False, enable),
    )
    return Device(key, title, title_zh, "6–12 V, GND", roles)


DEVICES = (
    _motor("left_motor", "Left motor, by an L298N", "左电机（经 L298N）", ("IN1", "IN2", "ENA")),
    _motor("right_motor", "Right motor, by an L298N", "右电机（经 L298N）", ("IN3", "IN4", "ENB")),
    Device(
        "leds",
        "LEDs, 330 Ω each",
        "发光二极管（各串 330 Ω）",
        "GND",
        tuple(Role(f"led_{which}", True, False, f"LED {which}") for which in range(4)),
    ),
    Device(
        "ultrasonic",
        "Ultrasonic sensor HC-SR04",
        "超声波传感器 HC-SR04",
        "5 V, GND",
        (Role("trigger", True, True, "TRIG"), Role("echo", False, True, "ECHO ÷ 1 kΩ, 2 kΩ")),
    ),
    Device("pir", "PIR sensor HC-SR501", "人体红外传感器 HC-SR501", "5 V, GND", (Role("output", False, True, "OUT"),)),
    Device(
        "infrared",
        "Infrared, 38 kHz",
        "38 kHz 红外收发",
        "3.3 V, 5 V, GND",
        (Role("receiver", False, False, "OUT, VS1838B"), Role("sender", True, False, "LED 940 nm, NPN")),
    ),
    Device(
        "serial",
        "Serial line for uploads",
        "上传用串口",
        "GND",
        (Role("transmit", True, True, "RX"), Role("receive", False, True, "TX")),
    ),
    Device("voice", "Voice module", "语音识别模块", "3.3 V, GND", (Role("receive", False, True, "TX"),)),
    Device("servo", "Steering servo", "转向舵机", "5 V, GND", (Role("signal", True, True, "SIG"),)),
    _motor("drive_motor", "Drive motor, by an L298N", "驱动电机（经 L298N）", ("IN1", "IN2", "ENA")),
)


@dataclass(frozen=True, slots=True)
class PinMap:
    """A pin file that was read and checked.

    Attributes:
        name: what the car is called.
        chip: the computer that it has.
        wires: its wires, in the order of DEVICES.
        drive_duties: PWM duty of a motor, 0 to 255, for each speed level while the car drives straight on.
        turn_duties: the same while it turns on the spot.
    """

    name: str
    chip: Chip
    wires: tuple[Wire, ...]
    drive_duties: tuple[int, ...] = (0, 85, 170, 255)
    turn_duties: tuple[int, ...] = (0, 85, 170, 255)

    def has(self, device: str) -> bool:
        """Whether the car has that device of DEVICES."""
        return any(wire.device.key == device for wire in self.wires)

    def pin(self, device: str, role: str) -> int | None:
        """The pin of a device's wire, None where it has none."""
        return next((wire.pin for wire in self.wires if (wire.device.key, wire.role.key) == (device, role)), None)


def load_pins(path: Path) -> PinMap:
    """The pin file at ``path``. Raises PinsError, whose sentence names the file and the key at fault."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        raise PinsError("unreadable", where=path, reason=getattr(error, "strerror", None) or NO_TEXT) from None
    return parse_pins(text, path.name)


def parse_pins(text: str, where: str) -> PinMap:
    """The PinMap in TOML ``text``; ``where`` is the file's name for the sentences. Raises PinsError."""
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise PinsError("no-toml", where=where, reason=error) from None
    known = ("format", "name", "chip", *(device.key for device in DEVICES), "duties")
    if unknown := [key for key in table if key not in known]:
        raise PinsError("unknown-key", where=where, key=unknown[0], known=", ".join(known))
    if table.get("format") != FORMAT:
        raise PinsError("format", where=where, value=repr(table.get("format")), format=FORMAT)
    chip = _chip(table.get("chip"), where)
    wires = [
        wire for device in DEVICES if device.key in table for wire in _wires(device, table[device.key], chip, where)
    ]
    if not wires:
        raise PinsError("no-device", where=where, known=", ".join(device.key for device in DEVICES))
    _check_meetings(wires, chip, where)
    return PinMap(_name(table.get("name"), where), chip, tuple(wires), **_duties(table.get("duties", {}), where))


def _name(value: object, where: str) -> str:
    if not isinstance(value, str) or not value.strip() or len(value) > _LONGEST_NAME or not value.isprintable():
        raise PinsError("name", where=where, value=repr(value), most=_LONGEST_NAME)
    return value


def _chip(value: object, where: str) -> Chip:
    found = next((chip for chip in CHIPS if chip.name == value), None)
    if found is None:
        raise PinsError("chip", where=where, value=repr(value), known=", ".join(chip.name for chip in CHIPS))
    return found


def _wires(device: Device, table: Any, chip: Chip, where: str) -> list[Wire]:
    keys = [role.key for role in device.roles]
    if not isinstance(table, dict):
        raise PinsError("no-table", where=where, key=device.key)
    inside = f"{where}, [{device.key}]"
    if unknown := [key for key in table if key not in keys]:
        raise PinsError("unknown-key", where=inside, key=unknown[0], known=", ".join(keys))
    if missing := [role.key for role in device.roles if role.needed and role.key not in table]:
        raise PinsError("missing-key", where=inside, key=missing[0])
    if not table:
        raise PinsError("no-pins", where=inside, known=", ".join(keys))
    roles = [role for role in device.roles if role.key in table]
    return [Wire(device, role, _pin(table[role.key], device, role, chip, where)) for role in roles]


def _pin(value: object, device: Device, role: Role, chip: Chip, where: str) -> int:
    place = {"where": where, "wire": f"{device.key}.{role.key}", "value": repr(value), "chip": chip.title}
    if type(value) is not int:
        raise PinsError("no-number", **place)
    if value in chip.taken:
        raise PinsError("taken", **place, use=chip.taken[value])
    if value not in chip.header:
        raise PinsError("no-such-pin", **place, pins=ranges(_runs(chip)))
    if role.drives and value in chip.input_only:
        raise PinsError("only-reads", **place)
    return value


def _runs(chip: Chip) -> list[list[int]]:
    runs: list[list[int]] = []
    for pin in sorted(chip.header):
        if runs and pin == runs[-1][1] + 1:
            runs[-1][1] = pin
        else:
            runs.append([pin, pin])
    return runs


def _check_meetings(wires: list[Wire], chip: Chip, where: str) -> None:
    seen: dict[int, Wire] = {}
    for wire in wires:
        other = seen.setdefault(wire.pin, wire)
        if other is not wire:
            first, second = (f"{each.device.key}.{each.role.key}" for each in (other, wire))
            raise PinsError("same-pin", where=where, wire=first, other=second, pin=chip.label(wire.pin))


def _duties(table: Any, where: str) -> dict[str, tuple[int, ...]]:
    if not isinstance(table, dict):
        raise PinsError("no-table", where=where, key="duties")
    if unknown := [key for key in table if key not in ("drive", "turn")]:
        raise PinsError("unknown-key", where=f"{where}, [duties]", key=unknown[0], known="drive, turn")
    for key, values in table.items():
        whole = isinstance(values, list) and len(values) == _LEVELS and all(type(value) is int for value in values)
        if not whole or values[0] != 0 or values != sorted(set(values)) or values[-1] > DUTY_MAX:
            raise PinsError(
                "duties", where=where, key=f"duties.{key}", value=repr(values), count=_LEVELS, most=DUTY_MAX
            )
    return {f"{key}_duties": tuple(values) for key, values in table.items()}
