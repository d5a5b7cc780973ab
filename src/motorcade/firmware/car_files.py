"""The files that a board with MicroPython gets: what its main.py needs, directly or through others, and its settings.

A file is needed where another imports it outside of functions. What is imported inside a function is for some cars
alone: EXTRAS says which setting brings it.

The settings are the contents of a pin file, a profile and a voice map as JSON, since MicroPython reads no TOML.
`motorcade.boards.on_chip.power_on` reads them on the board.
"""

import json
from pathlib import Path
from typing import Any

from motorcade.boards.on_chip.power_on import SETTINGS_FILE, SETTINGS_FORMAT
from motorcade.config.chips import CHIPS
from motorcade.config.pins import INPUTS, PARTS, PinMap, VoiceMap
from motorcade.config.profile import Profile, levels_of
from motorcade.devices.declaration import Part
from motorcade.errors import InputError
from motorcade.firmware import firmware_folder
from motorcade.firmware.shortened import shortened
from motorcade.imports import PACKAGE, needed_files

MAIN = "main.py"
# The folder that MicroPython searches for modules.
LIBRARY = "lib"
# The module that main.py imports, which all others are joined to where they are compiled.
START = f"{LIBRARY}/{PACKAGE.name}/boards/on_chip/power_on.py"
# What only some cars need, by the setting that asks for it: those modules are imported inside functions.
EXTRAS = {
    "wifi": PACKAGE / "boards" / "on_chip" / "wifi_line.py",
    "keys": PACKAGE / "boards" / "on_chip" / "secure_line.py",
    "options": PACKAGE / "boards" / "on_chip" / "any_board.py",
    "check": PACKAGE / "car" / "check" / "__init__.py",
}
# The parts, and wires of parts, that only the module of "options" knows.
_MORE = {"pixels", "button", "horn", "motor_driver", "left_rear_motor", "right_rear_motor", "ultrasonic.signal"}
_MORE |= {"left_motor.direction", "right_motor.direction"}


def templates() -> Path:
    """Return the folder of main.py and of the pin files."""
    return firmware_folder("micropython")


def board_files(settings: dict[str, Any]) -> dict[str, bytes]:
    """Return each file's path on the board and its bytes; main.py is the last, since nothing starts without it."""
    main = templates() / MAIN
    starts = [main, *(file for setting, file in EXTRAS.items() if setting in settings)]
    files: dict[str, bytes] = {}
    for file in sorted(needed_files(starts, lazily=False) - {main}):
        path = f"{LIBRARY}/{PACKAGE.name}/{file.relative_to(PACKAGE).as_posix()}"
        files[path] = file.read_bytes()
    # Motorcade's own needs CPython's importlib.
    files[f"{LIBRARY}/{PACKAGE.name}/__init__.py"] = b""
    files = shortened(files, LIBRARY)
    files[SETTINGS_FILE] = json.dumps(settings).encode()
    files[MAIN] = main.read_bytes()
    return files


def settings_of(
    pins: PinMap, profile: Profile, is_leader: bool, number: int | None = None, voice: VoiceMap | None = None
) -> dict[str, Any]:
    """Return the settings of one car.

    Args:
        pins: which part is at which pin.
        profile: the car's kind.
        is_leader: whether the car leads or follows.
        number: 0 to 2^32 - 1; None for one that the board makes from its chip's number.
        voice: the bytes that the voice module sends; needed where the pin file has one.

    Raises:
        MotorcadeError: no MicroPython car can be wired like this.
    """
    if not pins.chip.micropython:
        known = " / ".join(sorted(chip.name for chip in CHIPS if chip.micropython))
        code = "no-micropython-for-arduino" if pins.chip.arduino else "no-micropython-for-chip"
        raise InputError(code, car=pins.name, known=known, chip=pins.chip.title)
    settings: dict[str, Any] = {
        "format": SETTINGS_FORMAT,
        "name": pins.name,
        "is_leader": is_leader,
        "number": number,
        "levels": list(levels_of(profile)),
        "range_mm": profile.body.ultrasonic_range_mm,
        "baud": profile.serial.baud,
        "drive_duties": list(pins.drive_duties),
        "turn_duties": list(pins.turn_duties),
        "duty_percents": [profile.wheels.left_duty_percent, profile.wheels.right_duty_percent],
        "pins": _pins(pins),
        # A dict loses its order on a board; the order of pins is that of the bits.
        "inputs": {
            part.key: [wire.pin for wire in pins.wires if wire.device is part] for part in INPUTS if pins.has(part.key)
        },
        "uarts": {device: _uart(pins, device) for device in ("serial", "voice") if pins.has(device)},
    }
    if pins.options or any({wire.device.key, f"{wire.device.key}.{wire.role.key}"} & _MORE for wire in pins.wires):
        settings["options"] = {part.key: _options(pins, part) for part in PARTS if part.options and pins.has(part.key)}
    if pins.has("voice"):
        if voice is None:
            raise InputError("no-voice-map", car=pins.name)
        settings["voice"] = {
            "baud": voice.baud,
            "patterns": [[pattern.hex(), word] for pattern, word in voice.patterns],
        }
    return settings


def _options(pins: PinMap, part: Part) -> dict[str, int]:
    """Return what the pin file says of a part, with levels as 1 for high and 0 for low."""
    options = {}
    for option in part.options:
        value = pins.option(part.key, option.key)
        key = option.key
        if key == part.active:
            key = "active"
        if option.choices:
            value = pins.level(part.key, option.key)
        options[key] = int(value)
    return options


def _pins(pins: PinMap) -> dict[str, dict[str, int]]:
    devices: dict[str, dict[str, int]] = {}
    for wire in pins.wires:
        devices.setdefault(wire.device.key, {})[wire.role.key] = wire.pin
    return devices


def _uart(pins: PinMap, device: str) -> int:
    """Return which UART the device's pins lead to. Raises MotorcadeError where there is none or it is in use."""
    wires = {wire.role.key: wire.pin for wire in pins.wires if wire.device.key == device}
    if pins.chip.uarts:
        sends_at = pins.chip.sends_at.get(device)
        if sends_at in [wire.pin for wire in pins.wires if wire.device.key != device]:
            raise InputError("pin-of-voice-uart", car=pins.name, pin=sends_at)
        return pins.chip.uarts[device]
    uarts = set()
    for role, pin in wires.items():
        # GP0 sends and GP1 receives for UART 0, GP4 and GP5 for UART 1, and so on in this order: 0 1 1 0 0 1 1.
        if pin % 4 != ("transmit", "receive").index(role):
            raise InputError("pin-without-uart", car=pins.name, wire=f"{device}.{role}", value=pin)
        uarts.add((pin + 4) // 8 % 2)
    if len(uarts) != 1:
        raise InputError("pins-of-two-uarts", car=pins.name, device=device)
    uart = uarts.pop()
    if device == "voice" and pins.has("serial") and _uart(pins, "serial") == uart:
        raise InputError("uart-takes-uploads", car=pins.name)
    return uart
