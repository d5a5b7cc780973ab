"""The Arduino library: its files, and a sketch for one car with its builder's pins, profile and voice map."""

import io
import re
import zipfile
from collections.abc import Iterable
from pathlib import Path

from motorcade.config.chips import CHIPS, MOTORS
from motorcade.config.files import replace_file
from motorcade.config.pins import INPUTS, PinMap, VoiceMap
from motorcade.config.profile import Profile, levels_of
from motorcade.errors import InputError
from motorcade.firmware import firmware_folder

LIBRARY = "Motorcade"
# The examples whose sketches serve every car: that of a whole one, and of another.
SKETCH = "examples/Uno/Uno.ino"
ANY_SKETCH = "examples/AnyBoard/AnyBoard.ino"
SETTINGS = "car.h"
OWN_SKETCH = "Car"
_SUFFIXES = (".ino", ".h", ".c", ".cpp", ".txt", ".properties", ".toml")
_NO_PIN = "NO_PIN"
# What MotorcadeParts.h has room for.
_LONGEST_PATTERN = 16


def library_folder() -> Path:
    """Return the folder of the library."""
    return firmware_folder("arduino")


def library_files() -> dict[str, bytes]:
    """Return the library's files: each path in the library and its bytes."""
    folder = library_folder()
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.suffix in _SUFFIXES
    }


def sketch_files(
    pins: PinMap, profile: Profile, is_leader: bool, number: int, voice: VoiceMap | None = None
) -> dict[str, bytes]:
    """Return the files of a sketch for one car, as a further example of the library.

    Args:
        pins: which part is at which pin.
        profile: the car's kind.
        is_leader: whether the car leads or follows.
        number: 0 to 2^32 - 1.
        voice: the bytes that the voice module sends; needed where the pin file has one.

    Raises:
        MotorcadeError: no Arduino car can be wired like this.
    """
    example = ANY_SKETCH
    if pins.chip.is_whole_arduino:
        example = SKETCH
    sketch = (library_folder() / example).read_text(encoding="utf-8")
    sketch = re.sub(r"(?<=bool LEADS = )\w+", str(is_leader).lower(), sketch)
    literal = str(number)
    if number >> 15:
        literal += "U"
    sketch = re.sub(r"(?<=uint32_t NUMBER = )\w+", literal, sketch)
    folder = f"examples/{OWN_SKETCH}"
    return {
        f"{folder}/{OWN_SKETCH}.ino": sketch.encode(),
        f"{folder}/{SETTINGS}": settings_header(pins, profile, voice).encode(),
    }


def settings_header(pins: PinMap, profile: Profile, voice: VoiceMap | None = None) -> str:
    """Return car.h, in which a sketch finds its pins, levels, duties and voice patterns. Raises as sketch_files.

    On another chip than the pin file's it doesn't compile: a pin there may have another use.
    """
    _check(pins, voice)
    # A backslash at a line's end would join the next line to the comment.
    name = pins.name.replace("\\", "/")
    about = f"// Made from the pin file of '{name}' by motorcade arduino-library: don't edit."
    return header_of([about], _guard(pins), pins, profile, voice)


def header_of(about: list[str], guard: list[str], pins: PinMap, profile: Profile, voice: VoiceMap | None) -> str:
    """Return a car.h: the lines ``about`` it, those that ``guard`` it, and what the sketch needs to know of the car."""
    fields = {
        "levels": "LEVELS",
        "baud": profile.serial.baud,
        "range_mm": profile.body.ultrasonic_range_mm,
        **{motor: _motor(pins, motor) for motor in MOTORS},
        "standby": _pin(pins, "motor_driver", "standby"),
        "drive_duties": _list(pins.drive_duties),
        "turn_duties": _list(pins.turn_duties),
        "left_duty_percent": profile.wheels.left_duty_percent,
        "right_duty_percent": profile.wheels.right_duty_percent,
        "leds": _list(_pin(pins, "leds", f"led_{which}") for which in range(4)),
        "pixels": _pin(pins, "pixels", "signal"),
        "pixel_count": pins.option("pixels", "count"),
        # Both are the only wire where there is one.
        "trigger": _pin(pins, "ultrasonic", "trigger", "signal"),
        "echo": _pin(pins, "ultrasonic", "echo", "signal"),
        **_inputs(pins),
        "button": _pin(pins, "button", "signal"),
        "button_pressed": pins.level("button", "pressed"),
        "button_threshold": pins.threshold_percent("button"),
        "infrared_receiver": _pin(pins, "infrared", "receiver"),
        "infrared_sender": _pin(pins, "infrared", "sender"),
        "horn": _pin(pins, "horn", "signal"),
        "voice": _pin(pins, "voice", "receive"),
        "voice_baud": 0,
        "voice_patterns": "nullptr",
        "voice_pattern_count": 0,
    }
    patterns: list[str] = []
    if voice:
        fields |= {
            "voice_baud": voice.baud,
            "voice_patterns": "VOICE_PATTERNS",
            "voice_pattern_count": len(voice.patterns),
        }
        patterns = [
            "static const motorcade::VoicePattern VOICE_PATTERNS[] = {",
            *map(_pattern, voice.patterns),
            "};",
            "",
        ]
    lines = [f"    {value},  // {name}" for name, value in fields.items()]
    return "\n".join(
        [
            *about,
            "#ifndef MOTORCADE_CAR_SETTINGS",
            "#define MOTORCADE_CAR_SETTINGS",
            "",
            *guard,
            "#include <MotorcadeSettings.h>",
            "",
            "using motorcade::NO_PIN;",
            "",
            *patterns,
            f"static const uint32_t LEVELS[] = {_list(levels_of(profile))};",
            "",
            # An argument of a template can't be static.
            "extern const motorcade::CarSettings CAR;",
            "constexpr motorcade::CarSettings CAR = {",
            *lines,
            "};",
            "",
            "#endif",
            "",
        ]
    )


def _pattern(pattern: tuple[bytes, int]) -> str:
    data, word = pattern
    escaped = "".join(f"\\{byte:03o}" for byte in data)
    return f'    {{"{escaped}", {len(data)}, {word}}},'


def write_library(output: Path, files: dict[str, bytes]) -> None:
    """Write the library's files: into a zip file where ``output`` ends in .zip, else into a folder. Raises OSError."""
    if output.suffix.lower() != ".zip":
        for path, data in files.items():
            target = output / LIBRARY / path
            target.parent.mkdir(parents=True, exist_ok=True)
            replace_file(target, data)
        return
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, data in files.items():
            # A fixed time, so that the same files make the same bytes.
            archive.writestr(zipfile.ZipInfo(f"{LIBRARY}/{path}"), data, zipfile.ZIP_DEFLATED)
    replace_file(output, packed.getvalue())


def _guard(pins: PinMap) -> list[str]:
    names = " && ".join(f"!defined({name})" for name in pins.chip.arduino)
    return [
        f"#if {names}",
        f'#error "This sketch is for the pins of this board: {pins.chip.title}. Choose it in the menu Tools. For '
        f'another board begin with the example AnyBoard."',
        "#endif",
        "",
    ]


def _check(pins: PinMap, voice: VoiceMap | None) -> None:
    chip = pins.chip
    if not chip.arduino:
        whole = [other.name for other in CHIPS if other.is_whole_arduino]
        known = whole + sorted(other.name for other in CHIPS if other.arduino and not other.is_whole_arduino)
        raise InputError("no-arduino-for-chip", car=pins.name, known=" / ".join(known), chip=chip.title)
    if pins.has("serial"):
        raise InputError("arduino-serial-is-usb", car=pins.name)
    if pins.has("voice") and not chip.is_whole_arduino:
        raise InputError("arduino-without-voice", car=pins.name, chip=chip.title)
    if pins.has("pixels") and not chip.is_whole_arduino:
        raise InputError("arduino-without-pixels", car=pins.name, chip=chip.title)
    able = chip.only.get("left_motor.enable", chip.header)
    for wire in pins.wires:
        has_enable = pins.pin(wire.device.key, "enable") is not None
        is_pulsed = wire.device.key in MOTORS and not has_enable
        if is_pulsed and wire.pin not in able:
            # The car's sketch pulses the direction pins of a motor without enable.
            raise InputError(
                "motor-needs-enable", car=pins.name, device=wire.device.key, pins=", ".join(map(chip.label, able))
            )
    if pins.has("voice"):
        if voice is None:
            raise InputError("no-voice-map", car=pins.name)
        if chip.fastest_voice_baud and voice.baud > chip.fastest_voice_baud:
            raise InputError("voice-too-fast", car=pins.name, baud=voice.baud, most=chip.fastest_voice_baud)
        longest = max(len(data) for data, _ in voice.patterns)
        if longest > _LONGEST_PATTERN:
            raise InputError("voice-pattern-too-long", car=pins.name, count=longest, most=_LONGEST_PATTERN)


def _pin(pins: PinMap, device: str, *roles: str) -> str:
    """Return the pin of the first of ``roles`` that the device has."""
    for role in roles:
        pin = pins.pin(device, role)
        if pin is not None:
            return str(pin)
    return _NO_PIN


def _motor(pins: PinMap, motor: str) -> str:
    wires = [_pin(pins, motor, role) for role in ("forward", "backward", "enable", "direction")]
    return _list((*wires, pins.level(motor, "forward_is")))


def _inputs(pins: PinMap) -> dict[str, object]:
    fields: dict[str, object] = {}
    for part in INPUTS:
        fields[part.key] = _list(_pin(pins, part.key, role.key) for role in part.roles)
        if part.active:
            fields[f"{part.key}_{part.active}"] = pins.level(part.key, part.active)
            fields[f"{part.key}_threshold"] = pins.threshold_percent(part.key)
    return fields


def _list(values: Iterable[object]) -> str:
    return f"{{{', '.join(map(str, values))}}}"
