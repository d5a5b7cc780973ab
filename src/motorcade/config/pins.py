"""How a car is wired: pin files, and voice maps.

A pin file says which of a car's devices is connected to which pin of which computer, the same TOML for every board:

    format = "motorcade-pins/1"
    name = "Classroom car"
    chip = "raspberry-pi"

    [left_motor]
    forward = 5
    backward = 6

A car has the parts that have a table; `motorcade.devices` declares those that there are. Pins are the chip's own
numbers (GPIO or BCM), not those of a connector.

A voice map says what a voice module sends for which spoken word. Makers and users program such modules themselves, so
each sends bytes of its own:

    format = "motorcade-voice/1"
    baud = 9600

    [[word]]
    says = "stop"
    bytes = "AA 01"     # hexadecimal; or text = "stop\\r\\n", sent as UTF-8
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from itertools import permutations
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from motorcade.car.board import VOICE_WORDS
from motorcade.config.check import Schema, allowed_as, choice, line, list_of, load, shown, table, whole
from motorcade.config.files import parse, read_text
from motorcade.devices import DEVICES
from motorcade.devices.declaration import Part, Role
from motorcade.errors import InputError, Phrase
from motorcade.words.formats import SWITCHES

FORMAT = "motorcade-pins/1"
VOICE_FORMAT = "motorcade-voice/1"
DUTY_MAX = 255
_LONGEST_NAME = 60
_LONGEST_PATTERN = 64
_MOST_WORDS = 50
_FASTEST_BAUD = 4_000_000
_LEVELS = 4
_SWITCHED = tuple(Part(each.name, each.supply, (Role("signal", True, each.terminal),)) for each in SWITCHES)
PARTS = (*(part for device in DEVICES for part in device.parts), *_SWITCHED)
# The parts that a board reads as bits.
INPUTS = tuple(part for part in PARTS if part.read_by)


class Caution(NamedTuple):
    """What a pin does at power-on, or what is there on the board.

    Attributes:
        reason: the end of a sentence that begins with the pin.
        concerns: which wires it matters for: "all", "read", or those that "act" while no program runs.
    """

    reason: Phrase
    concerns: str = "all"


class Chip(NamedTuple):
    """A computer that a car may have.

    Attributes:
        name: its name in a pin file.
        title: its name for people.
        header: for each pin that a car may use, its number on the connector, or 0 where boards differ.
        input_only: pins that can be read but not driven.
        taken: pins that the computer needs for itself, each with the reason.
        only: for wires that not every pin can serve, such as ``infrared.sender``, the pins that can.
        cautions: pins that a car may use, but that do something at power-on or carry a load.
        names: what is printed at a pin, where that isn't GPIO and its number.
        has_5_v_pins: whether its pins give and take 5 V; otherwise 3.3 V.
    """

    name: str
    title: str
    header: dict[int, int]
    input_only: frozenset[int] = frozenset()
    taken: Mapping[int, Phrase] = MappingProxyType({})
    only: Mapping[str, tuple[int, ...]] = MappingProxyType({})
    cautions: Mapping[int, tuple[Caution, ...]] = MappingProxyType({})
    names: Mapping[int, str] = MappingProxyType({})
    has_5_v_pins: bool = False

    def label(self, pin: int) -> str:
        """Return what to look for on the board: ``GPIO17 (11)`` is GPIO 17, the connector's pin 11."""
        if pin in self.names:
            return self.names[pin]
        place = self.header[pin]
        return f"GPIO{pin} ({place})" if place else f"GPIO{pin}"


_RASPBERRY_PI_ORDER = (
    *((2, 3), (3, 5), (4, 7), (14, 8), (15, 10), (17, 11), (18, 12), (27, 13), (22, 15), (23, 16), (24, 18), (10, 19)),
    *((9, 21), (25, 22), (11, 23), (8, 24), (7, 26), (5, 29), (6, 31), (12, 32), (13, 33), (19, 35), (16, 36)),
    *((26, 37), (20, 38), (21, 40)),
)
_PICO_ORDER = (
    *((0, 1), (1, 2), (2, 4), (3, 5), (4, 6), (5, 7), (6, 9), (7, 10), (8, 11), (9, 12), (10, 14), (11, 15), (12, 16)),
    *((13, 17), (14, 19), (15, 20), (16, 21), (17, 22), (18, 24), (19, 25), (20, 26), (21, 27), (22, 29), (26, 31)),
    *((27, 32), (28, 34)),
)
# The most lines that one gpiochip of a small computer has.
_MAX_LINES = 512
_ESP32_USABLE = (0, 2, 4, 5, *range(12, 20), *range(21, 24), *range(25, 28), *range(32, 40))

# An Arduino's analog pins follow its digital ones; pins 0 and 1 are the USB port's serial line.
_UNO_PINS, _MEGA_PINS = range(2, 20), range(2, 70)
_MEGA_PWM = (*range(2, 9), 13, 44, 45, 46)
_UNO_NAMES = {pin: f"D{pin}" if pin < 14 else f"A{pin - 14}" for pin in _UNO_PINS}
_MEGA_NAMES = {pin: f"D{pin}" if pin < 54 else f"A{pin - 54}" for pin in _MEGA_PINS}

_MEMORY = Phrase("pin-of-memory")
_FLASH = Phrase("pin-of-flash")
_USB = Phrase("pin-of-usb")
# Sources: data sheets of ESP32 (strapping pins), BCM2835 (pulls at reset) and Raspberry Pi (pull-ups of its I2C bus),
# the schematics of Arduino boards.
_ESP32_CAUTIONS = {
    0: (Caution(Phrase("pin-boots-low")),),
    2: (Caution(Phrase("pin-boots-high")),),
    5: (Caution(Phrase("pin-pulses")),),
    12: (Caution(Phrase("pin-sets-flash-voltage")),),
    14: (Caution(Phrase("pin-pulses"), "act"),),
    15: (Caution(Phrase("pin-pulses")),),
}
_PULLED_UP = Caution(Phrase("pin-pulled-up"), "act")
_PI_CAUTIONS = {
    **dict.fromkeys(range(4, 9), (_PULLED_UP,)),
    **dict.fromkeys((2, 3), (Caution(Phrase("pin-held-up")),)),
}
_ARDUINO_CAUTIONS = {13: (Caution(Phrase("pin-with-led"), "read"), Caution(Phrase("pin-blinks"), "act"))}
# Outputs that do no harm at power-on: a ping more, a blink.
_HARMLESS = ("ultrasonic", "leds")


def _only(
    pwm: tuple[int, ...], interrupts: tuple[int, ...], sender: int, voice: tuple[int, ...]
) -> dict[str, tuple[int, ...]]:
    """The wires of an Arduino that not every pin can serve."""
    return {
        "left_motor.enable": pwm,
        "right_motor.enable": pwm,
        "ultrasonic.echo": interrupts,
        "infrared.receiver": interrupts,
        "infrared.sender": (sender,),
        "voice.receive": voice,
    }


CHIPS = (
    Chip(
        "raspberry-pi",
        "Raspberry Pi",
        dict(_RASPBERRY_PI_ORDER),
        taken={0: _MEMORY, 1: _MEMORY},
        cautions=_PI_CAUTIONS,
    ),
    Chip(
        "rp2040",
        "Raspberry Pi Pico (RP2040)",
        dict(_PICO_ORDER),
        taken={
            23: Phrase("pin-of-supply-switch"),
            24: Phrase("pin-of-usb-sensing"),
            25: Phrase("pin-of-board-led"),
            29: Phrase("pin-of-supply-measure"),
        },
    ),
    Chip(
        "esp32",
        "ESP32",
        dict.fromkeys(_ESP32_USABLE, 0),
        frozenset(range(34, 40)),
        {**dict.fromkeys(range(6, 12), _FLASH), 1: _USB, 3: _USB},
        cautions=_ESP32_CAUTIONS,
    ),
    # Infrared leaves at timer 2's output, and timers 1 and 2 drive no motors then. Receivers need an interrupt each.
    Chip(
        "arduino-uno",
        "Arduino Uno or Nano",
        dict.fromkeys(_UNO_PINS, 0),
        taken={0: _USB, 1: _USB},
        only=_only(pwm=(5, 6), interrupts=(2, 3), sender=11, voice=tuple(range(14, 20))),
        cautions=_ARDUINO_CAUTIONS,
        names=_UNO_NAMES,
        has_5_v_pins=True,
    ),
    Chip(
        "arduino-mega",
        "Arduino Mega 2560",
        dict.fromkeys(_MEGA_PINS, 0),
        taken={0: _USB, 1: _USB},
        only=_only(pwm=_MEGA_PWM, interrupts=(2, 3, 18, 19, 20, 21), sender=10, voice=(19,)),
        cautions=_ARDUINO_CAUTIONS,
        names=_MEGA_NAMES,
        has_5_v_pins=True,
    ),
    Chip("linux", "another computer with Linux", dict.fromkeys(range(_MAX_LINES), 0)),
)


class Wire(NamedTuple):
    """A part's wire and the pin that it leads to."""

    device: Part
    role: Role
    pin: int

    @property
    def title(self) -> Phrase:
        """What people call the part."""
        return Phrase(f"device-{self.device.key}")

    def terminal(self, chip: Chip) -> str:
        """What is printed on the device, and what belongs between it and a pin of ``chip``."""
        return (self.role.terminal_5_v if chip.has_5_v_pins else "") or self.role.terminal

    def supply(self, chip: Chip) -> str:
        """What the device needs besides its wires to ``chip``."""
        return (self.device.supply_5_v if chip.has_5_v_pins else "") or self.device.supply


@dataclass(frozen=True, slots=True)
class PinMap:
    """A pin file that was read and checked.

    Attributes:
        name: what the car is called.
        chip: the computer that it has.
        wires: its wires, in the order of PARTS.
        drive_duties: PWM duty of a motor, 0 to 255, for each speed level while the car drives straight on.
        turn_duties: the same while it turns on the spot.
    """

    name: str
    chip: Chip
    wires: tuple[Wire, ...]
    drive_duties: tuple[int, ...] = (0, 85, 170, 255)
    turn_duties: tuple[int, ...] = (0, 85, 170, 255)

    def has(self, device: str) -> bool:
        """Whether the car has that part of PARTS."""
        return any(wire.device.key == device for wire in self.wires)

    def pin(self, device: str, role: str) -> int | None:
        """The pin of a device's wire, None where it has none."""
        return next((wire.pin for wire in self.wires if (wire.device.key, wire.role.key) == (device, role)), None)

    @property
    def warnings(self) -> tuple[Phrase, ...]:
        """A sentence for each wire at a pin that does something at power-on, or carries a load, that matters to it."""
        return tuple(
            Phrase(
                "pin-warning",
                wire=f"{wire.device.key}.{wire.role.key}",
                pin=self.chip.label(wire.pin),
                reason=caution.reason,
            )
            for wire in self.wires
            for caution in self.chip.cautions.get(wire.pin, ())
            if self._concerns(caution, wire)
        )

    def _concerns(self, caution: Caution, wire: Wire) -> bool:
        if caution.concerns == "all":
            return True
        if caution.concerns == "read":
            return not wire.role.drives
        # The direction pins of a motor with an enable turn nothing by themselves.
        is_direction = wire.role.key in ("forward", "backward") and self.pin(wire.device.key, "enable") is not None
        return wire.role.drives and not is_direction and wire.device.key not in _HARMLESS


@cache
def pins_schema() -> Schema:
    """The JSON Schema of a pin file, parsed; which pins a chip has is not in it."""
    devices = {}
    for device in PARTS:
        optional = tuple(role.key for role in device.roles if not role.needed)
        devices[device.key] = table(optional, **{role.key: {"type": "integer"} for role in device.roles})
    levels = list_of(whole(0, DUTY_MAX), _LEVELS, _LEVELS)
    keys = {
        "format": choice(FORMAT),
        "name": line(_LONGEST_NAME),
        "chip": choice(*(chip.name for chip in CHIPS)),
        **devices,
        "duties": table(("drive", "turn"), drive=levels, turn=levels),
    }
    return table((*devices, "duties"), **keys)


def load_pins(path: Path) -> PinMap:
    """Return the pin file at ``path``. Raises MotorcadeError, which names the file and the key that is wrong."""
    return parse_pins(read_text(path, Phrase("pin-file", path=path)), path.name)


def parse_pins(text: str, file: str) -> PinMap:
    """Return the PinMap in TOML ``text``; ``file`` is what errors call it. Raises MotorcadeError."""
    values = load(parse(text, "TOML", file), pins_schema(), file)
    chip = next(chip for chip in CHIPS if chip.name == values["chip"])
    wires = []
    for device in PARTS:
        if (given := values.get(device.key)) is not None:
            if not given:
                known = ", ".join(role.key for role in device.roles)
                raise InputError("device-without-pins", file=file, device=device.key, known=known)
            wires += [Wire(device, role, given[role.key]) for role in device.roles if role.key in given]
    if not wires:
        raise InputError("no-device", file=file, known=", ".join(device.key for device in PARTS))
    _check_pins(wires, chip, file)
    return PinMap(values["name"], chip, tuple(wires), **_duties(values.get("duties", {}), file))


def _check_pins(wires: list[Wire], chip: Chip, file: str) -> None:
    wire_at: dict[int, str] = {}
    for wire in wires:
        name, pin = f"{wire.device.key}.{wire.role.key}", wire.pin
        place = {"file": file, "wire": name, "value": shown(pin), "chip": chip.title}
        if pin in chip.taken:
            raise InputError("pin-taken", **place, use=chip.taken[pin])
        if pin not in chip.header:
            raise InputError("no-such-pin", **place, pins=_ranges(chip))
        if pin not in chip.only.get(name, (pin,)):
            able = ", ".join(map(chip.label, chip.only[name]))
            raise InputError("pin-cannot", **place, pins=able)
        if wire.role.drives and pin in chip.input_only:
            raise InputError("pin-only-reads", **place)
        if pin in wire_at:
            raise InputError("same-pin", file=file, wire=wire_at[pin], other=name, pin=chip.label(pin))
        wire_at[pin] = name


def _ranges(chip: Chip) -> str:
    """The chip's pins, such as ``0, 2-27``."""
    ranges: list[list[int]] = []
    for pin in sorted(chip.header):
        if ranges and pin == ranges[-1][1] + 1:
            ranges[-1][1] = pin
        else:
            ranges.append([pin, pin])
    return ", ".join(f"{first}" if first == last else f"{first}-{last}" for first, last in ranges)


def _duties(duties: dict[str, list[int]], file: str) -> dict[str, Any]:
    for key, values in duties.items():
        if values[0] != 0 or values != sorted(set(values)):
            raise InputError("duties-not-rising", file=file, key=f"duties.{key}", value=values, most=DUTY_MAX)
    return {f"{key}_duties": tuple(values) for key, values in duties.items()}


class VoiceMap(NamedTuple):
    """The module's baud rate (8N1), and the bytes it sends for each voice of `motorcade.car.brain`."""

    baud: int
    patterns: tuple[tuple[bytes, int], ...]


@cache
def voice_map_schema() -> Schema:
    """The JSON Schema of a voice map, parsed."""
    word = table(
        ("bytes", "text"),
        says=choice(*(name for name, _ in VOICE_WORDS)),
        bytes=allowed_as("hexadecimal", {"type": "string"}),
        text={"type": "string"},
    )
    words = list_of(word | {"oneOf": [{"required": ["bytes"]}, {"required": ["text"]}]}, 1, _MOST_WORDS)
    return table(format=choice(VOICE_FORMAT), baud=whole(1, _FASTEST_BAUD), word=words)


def load_voice_map(path: Path) -> VoiceMap:
    """Return the voice map at ``path``. Raises MotorcadeError, which names the file and the key that is wrong."""
    return parse_voice_map(read_text(path, Phrase("voice-map-file", path=path)), path.name)


def parse_voice_map(text: str, file: str) -> VoiceMap:
    """Return the VoiceMap in TOML ``text``; ``file`` is what errors call it. Raises MotorcadeError."""
    values = load(parse(text, "TOML", file), voice_map_schema(), file)
    voices = dict(VOICE_WORDS)
    patterns = tuple(
        (_pattern(word, f"word[{number}]", file), voices[word["says"]]) for number, word in enumerate(values["word"])
    )
    for (inner, _), (outer, _) in permutations(patterns, 2):
        if inner in outer:
            first, second = (each.hex(" ").upper() for each in (inner, outer))
            raise InputError("pattern-in-another", file=file, inner=first, outer=second)
    return VoiceMap(values["baud"], patterns)


def _pattern(word: dict[str, Any], place: str, file: str) -> bytes:
    key = "text" if "text" in word else "bytes"
    try:
        pattern = word[key].encode() if key == "text" else bytes.fromhex(word[key])
    except ValueError:
        details = {"file": file, "place": f"{place}.{key}", "value": shown(word[key])}
        raise InputError("not-allowed", **details, allowed=Phrase("hexadecimal")) from None
    if not 1 <= len(pattern) <= _LONGEST_PATTERN:
        length = {"count": len(pattern), "most": _LONGEST_PATTERN}
        raise InputError("pattern-length", file=file, place=f"{place}.{key}", **length)
    return pattern
