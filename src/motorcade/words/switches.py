"""What a driver switches beside the wheels: each switch is one bit of a drive command with a code of its own.

The car's control, clients, keys, buttons of pages, pins and boards follow from SWITCHES.
"""

from collections import namedtuple

from motorcade.errors import MotorcadeError
from motorcade.words.field import Field, Values, WordError, WordFormat
from motorcade.words.formats import DRIVE, LIGHTS

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Mapping

# name: of the bit in ``word_format``, of the table in a pin file, and of the switch's texts.
# is_held: whether it is on only while its driver holds it, as a horn is; others stay on until their driver leaves.
# key: the letter that switches it, on pages and in terminals.
# supply, terminal: what a computer's pin is wired to, as `motorcade.config.pins` has it of every device.
Switch = namedtuple("Switch", ("name", "word_format", "is_held", "key", "supply", "terminal"))

SWITCHES = (
    Switch("head_light", LIGHTS, False, "l", "5 V, GND", "IN"),
    Switch("horn", LIGHTS, True, "h", "5 V, GND", "IN"),
)

# The formats of drive commands by their code.
_FORMATS: "dict[int, WordFormat]" = {
    each.field("code").only[0][0]: each for each in [DRIVE] + [switch.word_format for switch in SWITCHES]
}
_CODES = Values(only=tuple([each.field("code").only[0] for each in _FORMATS.values()]))
_CODE = Field("code", DRIVE.field("code").high, DRIVE.field("code").low, "what the command is", values=_CODES)


def format_of(word: int) -> WordFormat:
    """Return the format of a drive command, by its code. Raises WordError where there is no such code."""
    code = word >> _CODE.low
    if code not in _FORMATS:
        raise WordError("code", code, _CODE.allowed)
    return _FORMATS[code]


def switched_by(word: int) -> "dict[str, int]":
    """Return what a command without its stamp switches, by name; nothing where it moves the wheels.

    Raises WordError where it is no drive command.
    """
    word_format = format_of(word)
    values = word_format.decode(word, strict=True)
    return {each.name: getattr(values, each.name) for each in SWITCHES if each.word_format is word_format}


def switch_words(wanted: "Mapping[str, int]", present: "Mapping[str, int]") -> "list[int]":
    """Return the commands that switch what is ``wanted``, 0 or 1 by name; others of a command are as in ``present``.

    Raises MotorcadeError: there is no such switch.
    """
    names = [each.name for each in SWITCHES]
    for name in wanted:
        if name not in names:
            raise MotorcadeError("no-such-switch", name=name, known=", ".join(names) or "-")
    words = []
    for code, word_format in _FORMATS.items():
        own = [each.name for each in SWITCHES if each.word_format is word_format]
        if set(own) & set(wanted):
            values = {name: int(wanted.get(name, present.get(name, 0))) for name in own}
            words.append(word_format.encode(code=code, **values))
    return words
