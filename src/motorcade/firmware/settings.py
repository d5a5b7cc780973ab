"""A car's settings: what a pin file, a profile and a voice map say, as JSON for MicroPython, which reads no TOML.

`motorcade.boards.on_chip.power_on` reads them on the board.
"""

from typing import Any

from motorcade.boards.on_chip.power_on import SETTINGS_FORMAT
from motorcade.config.pins import PinMap
from motorcade.config.profile import Profile, levels_of
from motorcade.config.voice_map import VoiceMap
from motorcade.errors import MotorcadeError

# What sys.platform says on a chip of a pin file.
PLATFORMS = {"esp32": "esp32", "rp2040": "rp2"}
_ESP32_UARTS = {"serial": 1, "voice": 2}
# An ESP32's second UART sends on this pin, even where it was told to receive alone.
_ESP32_VOICE_SENDS_AT = 17


def settings_of(
    pins: PinMap, profile: Profile, is_leader: bool, number: int | None = None, voice: VoiceMap | None = None
) -> dict[str, Any]:
    """The settings of one car.

    Args:
        number: 0 to 2^32 - 1; None lets the board make one of its chip's own number.
        voice: what the voice module sends; needed where the pin file has one.

    Raises:
        MotorcadeError: no MicroPython car can be wired like this.
    """
    if pins.chip.name not in PLATFORMS:
        raise MotorcadeError(
            "no-micropython-for-chip", car=pins.name, known=" / ".join(PLATFORMS), chip=pins.chip.title
        )
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
        "pins": _pins(pins),
        "uarts": {device: _uart(pins, device) for device in ("serial", "voice") if pins.has(device)},
    }
    if pins.has("voice"):
        if voice is None:
            raise MotorcadeError("no-voice-map", car=pins.name)
        settings["voice"] = {
            "baud": voice.baud,
            "patterns": [[pattern.hex(), says] for pattern, says in voice.patterns],
        }
    return settings


def _pins(pins: PinMap) -> dict[str, dict[str, int]]:
    devices: dict[str, dict[str, int]] = {}
    for wire in pins.wires:
        devices.setdefault(wire.device.key, {})[wire.role.key] = wire.pin
    return devices


def _uart(pins: PinMap, device: str) -> int:
    """Which UART the device's pins lead to. Raises MotorcadeError where they lead to none, or one is in use already."""
    wires = {wire.role.key: wire.pin for wire in pins.wires if wire.device.key == device}
    if pins.chip.name == "esp32":
        others = [wire.pin for wire in pins.wires if wire.device.key != "voice"]
        if device == "voice" and _ESP32_VOICE_SENDS_AT in others:
            raise MotorcadeError("pin-of-voice-uart", car=pins.name, pin=_ESP32_VOICE_SENDS_AT)
        return _ESP32_UARTS[device]
    uarts = set()
    for role, pin in wires.items():
        # GP0 sends and GP1 receives for UART 0, GP4 and GP5 for UART 1, and so on in this order: 0 1 1 0 0 1 1.
        if pin % 4 != ("transmit", "receive").index(role):
            raise MotorcadeError("pin-without-uart", car=pins.name, wire=f"{device}.{role}", value=pin)
        uarts.add((pin + 4) // 8 % 2)
    if len(uarts) != 1:
        raise MotorcadeError("pins-of-two-uarts", car=pins.name, device=device)
    uart = uarts.pop()
    if device == "voice" and pins.has("serial") and _uart(pins, "serial") == uart:
        raise MotorcadeError("uart-takes-uploads", car=pins.name)
    return uart
