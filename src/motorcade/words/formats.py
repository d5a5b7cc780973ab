"""The seven word formats of Motorcade, each declared once, their fingerprints, and what drive commands switch.

Sources: seed 000 (h1-h3, c1-c9) for HEADER and CONTROL, the protocol's section "A leader that decides" for STATE and
FLOW, seed 001 for DRIVE, docs/drive.md for LIGHTS, which is a second code of drive commands, the protocol's section
"Tagged words" for FRAME.
"""

from binascii import crc32
from collections.abc import Mapping
from typing import NamedTuple

from motorcade.devices import DEVICES
from motorcade.errors import MotorcadeError
from motorcade.words.field import WORD_MASK, Field, WordError, WordFormat
from motorcade.words.flow import CONDITIONS, OPS, UNTIL_CONDITIONS

HEADER = WordFormat(
    "header",
    (
        Field("leader_states", 31, 24, "how many leader control words follow", "seed 000, h1"),
        Field("follower_words", 23, 16, "how many follower control words follow those", "seed 000, h2"),
        Field(
            "dwell",
            15,
            8,
            "how long each follower word is sent: one bit, 8 levels",
            "seed 000, h2",
            goes_with="follower_words",
            one_hot=True,
        ),
        Field(
            "reserved",
            7,
            0,
            "1: follower words travel with a tag; 2: the leader decides; 3: both",
            "seed 000, h3",
            reserved=True,
            defined=3,
        ),
    ),
)

# The fields of all devices, the most significant first. Below them are c9 and, on the air, tag and check.
_ACTIONS = tuple(
    Field(bits.name, bits.high, bits.low, bits.meaning, bits.source, needs=bits.needs)
    for bits in sorted(
        (bits for device in DEVICES for bits in device.bits),
        key=lambda bits: bits.low,
        reverse=True,
    )
)

CONTROL = WordFormat(
    "control",
    (
        *_ACTIONS,
        Field("reserved", 10, 1, "0; on the air tag and check", "seed 000, c8", reserved=True),
        Field("parity", 0, 0, "set on the air for an even number of ones", "seed 000, c9"),
    ),
)

_DECIDES = "protocol, section 12"

# A state of a leader that decides: what the leader does until its time is over, or until a condition ends it.
STATE = WordFormat(
    "state",
    (
        Field("flow", 31, 31, "a state; 1 in a flow word", _DECIDES, only=((0, "a state"),)),
        *_ACTIONS[1:],
        Field("until", 10, 7, "the condition that ends the state", _DECIDES, only=UNTIL_CONDITIONS),
        Field("until_not", 6, 6, "it ends when the condition does not hold", _DECIDES, needs="until"),
        Field("until_level", 5, 4, "level of the condition", _DECIDES, needs="until"),
        Field("reserved", 3, 0, "0", _DECIDES, reserved=True),
    ),
)

# A flow word of such a leader: it takes no time.
FLOW = WordFormat(
    "flow",
    (
        Field("flow", 31, 31, "a flow word; 0 in a state", _DECIDES, only=((1, "a flow word"),), default=1),
        Field("op", 30, 28, "what the word does", _DECIDES, only=OPS),
        Field("target", 27, 20, "index of a leader word; tell: of a follower word, 255 in turn", _DECIDES),
        Field("condition", 19, 16, "jump and call: only if this holds", _DECIDES, only=CONDITIONS),
        Field("if_not", 15, 15, "only if the condition does not hold", _DECIDES, needs="condition"),
        Field("level", 14, 13, "level of the condition; count: 0 set, 1 add, 2 take away, 3 random", _DECIDES),
        Field("counter", 12, 11, "which of the four counters", _DECIDES),
        Field("reserved", 10, 9, "0", _DECIDES, reserved=True),
        Field("value", 8, 1, "what a counter or chance is compared with, or changed by", _DECIDES),
        Field("unused", 0, 0, "0", _DECIDES, reserved=True),
    ),
)

DRIVE = WordFormat(
    "drive",
    (
        Field("code", 31, 28, "what the command is", "seed 001", only=((1, "speed and direction"),), default=1),
        Field(
            "angle",
            27,
            20,
            "servo angle in degrees; 90 centre, below right",
            "seed 001",
            maximum=180,
            default=90,
            unit="deg",
        ),
        Field("direction", 19, 19, "1 forward, 0 backward", "seed 001"),
        Field("speed", 18, 11, "PWM duty, 0 to 255", "seed 001"),
        Field("reserved", 10, 0, "0, or a stamp: when the word was sent", "seed 001", reserved=True, defined=2047),
    ),
)

LIGHTS = WordFormat(
    "lights",
    (
        Field("code", 31, 28, "what the command is", "lights", only=((2, "lights and horn"),), default=2),
        Field("head_light", 27, 27, "the head light is on", "lights"),
        Field("horn", 26, 26, "the horn sounds", "lights"),
        Field("reserved", 25, 11, "for extensions", "lights", reserved=True),
        Field("stamp", 10, 0, "0, or a stamp: when the word was sent", "lights"),
    ),
)

# The bits that each bit of the check covers, most significant first.
_CHECK_MASKS = (0x001FFFC0, 0x0FE03FC0, 0x71E3C3C0, 0xB66CCCC0, 0xDAB55540)
# A control word as it is on the air. A wrong check or parity decodes with a warning; followers drop such a frame.
FRAME = WordFormat(
    "frame",
    (
        *_ACTIONS,
        Field("tag", 10, 6, "number of the leader's slot, 1 to 31; 0: a bare word", "tagged words"),
        Field(
            "check",
            5,
            1,
            "computed from bits 31 to 6; 0 in a bare word",
            "tagged words",
            needs="tag",
            parity_masks=_CHECK_MASKS,
        ),
        Field("parity", 0, 0, "computed: makes the number of ones even", "seed 000, c9", parity_masks=(WORD_MASK - 1,)),
    ),
)

FORMATS = (HEADER, CONTROL, STATE, FLOW, DRIVE, LIGHTS, FRAME)


def format_named(name: str) -> WordFormat:
    """Return the WordFormat called ``name``: header, control, state, flow, drive, lights or frame. Raises WordError."""
    for word_format in FORMATS:
        if word_format.name == name:
            return word_format
    raise WordError("format", name, ", ".join(word_format.name for word_format in FORMATS))


def fingerprint(word_format: WordFormat) -> int:
    """Return the CRC-32 of `canonical_text` in UTF-8 (0 to 4294967295).

    Two devices whose formats have the same fingerprint give words the same meaning. The
    fingerprint detects mistakes, not attacks: two different declarations have the same one
    with a probability of 2^-32.
    """
    return crc32(canonical_text(word_format).encode())


def canonical_text(word_format: WordFormat) -> str:
    """Return everything that decides the meaning of a word: a line for the format and one for each field.

    The line of a field holds name, first and last bit, smallest and largest raw value, and
    its unit and rules where it has them. Its meaning, source and default are left out:
    they don't change the word. The meaning of a reserved field is left out too: a device that
    doesn't know it refuses the word, and never reads it in another sense.
    """
    lines = [word_format.name]
    for field in word_format.fields:
        parts = [field.name, str(field.high), str(field.low), str(field.minimum), str(field.maximum)]
        if field.unit:
            parts.append("unit=" + field.unit)
        if field.one_hot:
            parts.append("one-hot")
        if field.only:
            parts.append("only=" + ",".join(str(value) for value in sorted(value for value, _ in field.only)))
        if field.reserved:
            parts.append("reserved")
        if field.goes_with:
            parts.append("goes-with=" + field.goes_with)
        if field.parity_masks:
            parts.append("parities=" + ",".join(f"0x{mask:08X}" for mask in field.parity_masks))
            if field.needs:
                parts.append("needs=" + field.needs)
        lines.append(" ".join(parts))
    return "".join(f"{line}\n" for line in lines)


class Switch(NamedTuple):
    """What a driver switches beside the wheels: one bit of a drive command with a code of its own.

    The car's control, clients, keys, buttons of pages, pins and boards follow from SWITCHES.

    Attributes:
        name: of the bit in ``word_format``, of the table in a pin file, and of the switch's texts.
        word_format: of the command.
        is_held: whether it is on only while its driver holds it, as a horn is; others stay on until the driver leaves.
        key: the letter that switches it, on pages and in terminals.
        supply, terminal: what a computer's pin is wired to, as `motorcade.config.pins` has it of every device.
    """

    name: str
    word_format: WordFormat
    is_held: bool
    key: str
    supply: str
    terminal: str


SWITCHES = (
    Switch("head_light", LIGHTS, False, "l", "5 V, GND", "IN"),
    Switch("horn", LIGHTS, True, "h", "5 V, GND", "IN"),
)

# The formats of drive commands by their code.
_DRIVE_FORMATS = {
    word_format.field("code").default: word_format
    for word_format in (DRIVE, *(switch.word_format for switch in SWITCHES))
}


def switched_by(word: int) -> dict[str, int]:
    """Return what a command without its stamp switches, by name; nothing where it moves the wheels.

    Raises WordError where it is no drive command.
    """
    code = word >> DRIVE.field("code").low
    if code not in _DRIVE_FORMATS:
        known = tuple(word_format.field("code").only[0] for word_format in _DRIVE_FORMATS.values())
        raise WordError("code", code, Field("code", 31, 28, "what the command is", only=known).allowed)
    word_format = _DRIVE_FORMATS[code]
    values = word_format.decode(word, strict=True)
    return {switch.name: getattr(values, switch.name) for switch in SWITCHES if switch.word_format is word_format}


def switch_words(wanted: Mapping[str, int], present: Mapping[str, int]) -> list[int]:
    """Return the commands that switch what is ``wanted``, 0 or 1 by name; others of a command are as in ``present``.

    Raises MotorcadeError: there is no such switch.
    """
    names = [switch.name for switch in SWITCHES]
    for name in wanted:
        if name not in names:
            raise MotorcadeError("no-such-switch", name=name, known=", ".join(names) or "-")
    words = []
    for code, word_format in _DRIVE_FORMATS.items():
        own = [switch.name for switch in SWITCHES if switch.word_format is word_format]
        if not wanted.keys().isdisjoint(own):
            values = {name: int(wanted.get(name, present.get(name, 0))) for name in own}
            words.append(word_format.encode(code=code, **values))
    return words
