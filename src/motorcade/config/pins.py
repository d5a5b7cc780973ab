"""How a car is wired: pin files, and voice maps.

A pin file says which of a car's devices is connected to which pin of which computer, the same TOML for every board:

    format = "motorcade-pins/1"
    name = "Classroom car"
    chip = "raspberry-pi"

    [left_motor]
    forward = 5
    backward = "GPIO6"

A car has the parts that have a table; `motorcade.devices` declares those that there are. Pins are what is printed on
the board, or the chip's own numbers (GPIO or BCM), not those of a connector.

A voice map says what a voice module sends for which spoken word. Makers and users program such modules themselves, so
each sends bytes of its own:

    format = "motorcade-voice/1"
    baud = 9600

    [[word]]
    says = "stop"
    bytes = "AA 01"     # hexadecimal; or text = "stop\\r\\n", sent as UTF-8
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import permutations
from pathlib import Path
from typing import Any, NamedTuple

from motorcade.car.board import VOICE_WORDS
from motorcade.config.check import Schema, allowed, allowed_as, choice, line, list_of, load, shown, table, whole
from motorcade.config.chips import CHIPS, Caution, Chip, chip_named
from motorcade.config.files import parse, read_text
from motorcade.devices import DEVICES
from motorcade.devices.declaration import Between, Part, Role
from motorcade.errors import InputError, Phrase
from motorcade.words.formats import SWITCHES

FORMAT = "motorcade-pins/1"
VOICE_FORMAT = "motorcade-voice/1"
DUTY_MAX = 255
_LONGEST_NAME = 60
_LONGEST_SOURCE = 400
_LONGEST_PATTERN = 64
_MOST_WORDS = 50
_FASTEST_BAUD = 4_000_000
_LEVELS = 4
_SWITCHED = tuple(Part(switch.name, switch.supply, (Role("signal", True, switch.terminal),)) for switch in SWITCHES)
PARTS = (*(part for device in DEVICES for part in device.parts), *_SWITCHED)
# The parts that a board reads as bits.
INPUTS = tuple(part for part in PARTS if part.read_by)
# Outputs that do no harm at power-on: a ping more, a blink.
_HARMLESS = ("ultrasonic", "leds", "pixels")
_PIN: Schema = {"type": ["integer", "string"]}


class Wire(NamedTuple):
    """A part's wire and the pin that it leads to."""

    device: Part
    role: Role
    pin: int

    def between(self, chip: Chip) -> list[Between]:
        """The components that belong between a pin of ``chip`` and the terminal."""
        return [component for component in self.role.between if not (chip.has_5_v_pins and component.protects)]

    def supply(self, chip: Chip) -> str:
        """What the terminal needs besides its wire to ``chip``."""
        voltage = "3.3 V"
        if chip.has_5_v_pins:
            voltage = "5 V"
        return (self.role.supply or self.device.supply).format(chip=voltage)


@dataclass(frozen=True, slots=True)
class PinMap:
    """A pin file that was read and checked.

    Attributes:
        name: what the car is called.
        chip: the computer that it has.
        wires: its wires, in the order of PARTS.
        drive_duties: PWM duty of a motor, 0 to 255, for each speed level while the car drives straight on.
        turn_duties: the same while it turns on the spot.
        options: what it says beside pins: a part's key, the option's and its value.
        sources: the parts whose pins a source confirms, in a car that somebody else made.
    """

    name: str
    chip: Chip
    wires: tuple[Wire, ...]
    drive_duties: tuple[int, ...] = (0, 85, 170, 255)
    turn_duties: tuple[int, ...] = (0, 85, 170, 255)
    options: tuple[tuple[str, str, str | int], ...] = ()
    sources: tuple[str, ...] = ()

    def has(self, device: str) -> bool:
        """Whether the car has that part of PARTS."""
        return any(wire.device.key == device for wire in self.wires)

    def pin(self, device: str, role: str) -> int | None:
        """The pin of a device's wire, None where it has none."""
        return next((wire.pin for wire in self.wires if (wire.device.key, wire.role.key) == (device, role)), None)

    def option(self, device: str, key: str) -> str | int:
        """What the file says of a part beside its pins; what is usual where it says nothing."""
        usual = {(part.key, option.key): option.usual for part in PARTS for option in part.options}
        said = {(part, name): value for part, name, value in self.options}
        return (usual | said)[device, key]

    def level(self, device: str, key: str) -> int:
        """The option as a level: 1 for "high", 0 for "low"."""
        return int(self.option(device, key) == "high")

    def threshold_percent(self, device: str) -> int:
        """Above so many percent of the supply an analog input of the part is high; 0 for digital inputs."""
        for part, key, value in self.options:
            if (part, key) == (device, "threshold"):
                return int(value)
        return 0

    @property
    def warnings(self) -> tuple[Phrase, ...]:
        """A sentence for each wire at a pin that does something at power-on, or carries a load, that matters to it."""
        found = []
        for wire in self.wires:
            name = f"{wire.device.key}.{wire.role.key}"
            for caution in self.chip.cautions.get(wire.pin, ()):
                if self._concerns(caution, wire):
                    pin = self.chip.label(wire.pin)
                    found.append(Phrase("pin-warning", wire=name, pin=pin, reason=caution.reason))
        return tuple(found)

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
        optional = tuple(role.key for role in device.roles if device.forms or not role.needed)
        values = {role.key: _PIN for role in device.roles}
        for option in device.options:
            values[option.key] = choice(*option.choices) if option.choices else whole(option.least, option.most)
        others = tuple(option.key for option in device.options)
        devices[device.key] = table((*optional, *others), **values)
    levels = list_of(whole(0, DUTY_MAX), _LEVELS, _LEVELS)
    keys = {
        "format": choice(FORMAT),
        "name": line(_LONGEST_NAME),
        "chip": choice(*(chip.name for chip in CHIPS)),
        **devices,
        # What is known of a car that somebody else made, and from where.
        "sources": table(tuple(devices), **{key: line(_LONGEST_SOURCE) for key in devices}),
        "duties": table(("drive", "turn"), drive=levels, turn=levels),
    }
    return table((*devices, "sources", "duties"), **keys)


def load_pins(path: Path) -> PinMap:
    """Return the pin file at ``path``. Raises MotorcadeError, which names the file and the key that is wrong."""
    return parse_pins(read_text(path, Phrase("pin-file", path=path)), path.name)


def parse_pins(text: str, file: str) -> PinMap:
    """Return the PinMap in TOML ``text``; ``file`` is what errors call it. Raises MotorcadeError."""
    values = load(parse(text, "TOML", file), pins_schema(), file)
    chip = chip_named(values["chip"])
    wires = []
    options = []
    for device in PARTS:
        given = values.get(device.key)
        if given is None:
            continue
        if not given:
            known = ", ".join(role.key for role in device.roles)
            raise InputError("device-without-pins", file=file, device=device.key, known=known)
        _check_form(device, given, file)
        roles = [role for role in device.roles if role.key in given]
        wires += [
            Wire(device, role, _number(f"{device.key}.{role.key}", given[role.key], chip, file)) for role in roles
        ]
        options += [(device.key, option.key, given[option.key]) for option in device.options if option.key in given]
    if not wires:
        raise InputError("no-device", file=file, known=", ".join(device.key for device in PARTS))
    duties = _duties(values.get("duties", {}), file)
    sources = tuple(values.get("sources", {}))
    pins = PinMap(values["name"], chip, tuple(wires), **duties, options=tuple(options), sources=sources)
    _check_pins(pins, file)
    return pins


def _number(wire: str, pin: int | str, chip: Chip, file: str) -> int:
    """Return the number of a pin that a file may call by what is printed there."""
    number = chip.pin_named(pin) if isinstance(pin, str) else pin
    if number in {**chip.header, **chip.taken}:
        return number
    raise InputError("no-such-pin", file=file, wire=wire, value=shown(pin), chip=chip.title, pins=_ranges(chip))


def _check_form(device: Part, given: dict[str, Any], file: str) -> None:
    """Check that a part has all wires of one of its forms, and no others."""
    keys = {role.key for role in device.roles if role.key in given}
    forms = [form for form in device.forms if keys <= set(form)]
    if device.forms and not forms:
        known = " / ".join(", ".join(form) for form in device.forms)
        raise InputError("wires-of-two-forms", file=file, device=device.key, given=", ".join(sorted(keys)), known=known)
    if forms and keys not in map(set, forms):
        missing = next(key for key in forms[0] if key not in keys)
        raise InputError("missing-key", file=file, place=f"{device.key}.{missing}", allowed=allowed(_PIN))


def _check_pins(pins: PinMap, file: str) -> None:
    chip = pins.chip
    wire_at: dict[int, str] = {}
    for wire in pins.wires:
        name = f"{wire.device.key}.{wire.role.key}"
        pin = wire.pin
        place = {"file": file, "wire": name, "value": chip.names.get(pin, pin), "chip": chip.title}
        if {name, wire.device.key} & chip.lacks:
            raise InputError("part-not-on-chip", **place)
        if pin in chip.taken:
            raise InputError("pin-taken", **place, use=chip.taken[pin])
        measures = pins.threshold_percent(wire.device.key) > 0
        if measures and not chip.analog:
            raise InputError("part-not-on-chip", **place | {"wire": f"{wire.device.key}.threshold"})
        if measures and pin not in chip.analog:
            raise InputError("pin-not-analog", **place, pins=", ".join(map(chip.label, chip.analog)))
        if pin in chip.analog_only and not measures:
            raise InputError("pin-only-measures", **place)
        if pin not in chip.only.get(name, (pin,)):
            able = ", ".join(map(chip.label, chip.only[name]))
            raise InputError("pin-cannot", **place, pins=able)
        if wire.role.drives and pin in chip.input_only:
            raise InputError("pin-only-reads", **place)
        if pin in wire_at:
            raise InputError("same-pin", file=file, wire=wire_at[pin], other=name, pin=chip.label(pin))
        wire_at[pin] = name


def _ranges(chip: Chip) -> str:
    """The chip's pins, such as ``0, 2-27``, or as they are printed on the board."""
    if chip.names:
        return ", ".join(map(chip.label, sorted(chip.header)))
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
            shown_inner = inner.hex(" ").upper()
            shown_outer = outer.hex(" ").upper()
            raise InputError("pattern-in-another", file=file, inner=shown_inner, outer=shown_outer)
    return VoiceMap(values["baud"], patterns)


def _pattern(word: dict[str, Any], place: str, file: str) -> bytes:
    key = "bytes"
    read: Callable[[str], bytes] = bytes.fromhex
    if "text" in word:
        key = "text"
        read = str.encode
    try:
        pattern = read(word[key])
    except ValueError:
        details = {"file": file, "place": f"{place}.{key}", "value": shown(word[key])}
        raise InputError("not-allowed", **details, allowed=Phrase("hexadecimal")) from None
    if not 1 <= len(pattern) <= _LONGEST_PATTERN:
        length = {"count": len(pattern), "most": _LONGEST_PATTERN}
        raise InputError("pattern-length", file=file, place=f"{place}.{key}", **length)
    return pattern
