"""Write what others need of the devices: places in words, kinds of steps, the record of senses, methods of a board."""

import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from textwrap import indent

from motorcade.devices import DEVICES
from motorcade.devices.declaration import Call, Input, Method, Part, Sense, StepKind
from motorcade.words.field import WordFormat
from motorcade.words.formats import CONTROL, DRIVE, FLOW, FRAME, HEADER, STATE

ROOT = Path(__file__).resolve().parent.parent
_ARDUINO = "firmware/arduino/src/"
_BEGIN, _END = "Written by scripts/generate.py from motorcade.devices; don't edit.", "End of the section."
SENSES: tuple[Sense, ...] = tuple(sense for device in DEVICES for sense in device.senses)
METHODS: dict[str, Method] = {method.name: method for device in DEVICES for method in device.methods}
# The parts that a board reads as bits, by the method that does so.
READ_BY: dict[str, Part] = {part.read_by: part for device in DEVICES for part in device.parts if part.read_by}
# What a method returns, in C++.
_C_TYPES = {"int": "uint32_t", "bool": "bool", "bits": "uint8_t"}


def device_files() -> dict[str, Callable[[], str]]:
    """Return what makes each file, by its path in the repository."""
    return {
        "src/motorcade/__init__.py": partial(_with_section, "src/motorcade/__init__.py", "#", _imports, _lazy_names),
        "src/motorcade/program/steps.py": partial(_with_section, "src/motorcade/program/steps.py", "#", _step_kinds),
        "src/motorcade/words/positions.py": _positions,
        "src/motorcade/car/senses.py": _senses,
        "src/motorcade/car/board.py": partial(_with_section, "src/motorcade/car/board.py", "#", _board_methods),
        f"{_ARDUINO}MotorcadeBoard.h": partial(_with_section, f"{_ARDUINO}MotorcadeBoard.h", "//", _c_methods),
        f"{_ARDUINO}MotorcadeArduino.h": partial(
            _with_section, f"{_ARDUINO}MotorcadeArduino.h", "//", _c_begin, _c_inputs
        ),
        f"{_ARDUINO}MotorcadeSettings.h": partial(_with_section, f"{_ARDUINO}MotorcadeSettings.h", "//", _c_settings),
        f"{_ARDUINO}MotorcadeCar.cpp": partial(_with_section, f"{_ARDUINO}MotorcadeCar.cpp", "//", _c_reading),
    }


def _positions() -> str:
    """Return the module of numbers that a car needs of the formats."""
    control = _lowest_bits(CONTROL, "reserved", "parity")
    state = _lowest_bits(STATE, "flow", "reserved", *(field.name for field in CONTROL.fields))
    flow = _lowest_bits(FLOW, "flow", "reserved", "unused", part_bits=16)
    unused = CONTROL.reserved_mask | CONTROL.field("parity").word_mask
    return formatted(f'''"""Where the fields of words are, as numbers: a car needs no more of the formats.

Portable. Written by scripts/generate.py from `motorcade.words.formats`; don't edit.
"""

# The lowest bit of each field of a control word.
{control}
# The same of what ends a state of a leader that decides.
{state}
# The same of a flow word, in its upper half (up to the condition) or its lower half, of 16 bits each: a chip is slow
# with integers from 2^30 up.
{flow}
# The bits of a control word that are 0 in an image.
UNUSED_BITS = 0x{unused:08X}
# The bits of a frame's check.
CHECK_BITS = 0x{FRAME.field("check").word_mask:08X}
# The largest value of a header's reserved field that has a meaning.
MOST_RESERVED = {HEADER.field("reserved").defined}
# The lowest bit of a drive command's speed, and the command that stands still with its wheels straight.
DRIVE_SPEED_AT = {DRIVE.field("speed").low}
DRIVE_NEUTRAL = 0x{DRIVE.encode(angle=90, direction=1, speed=0):08X}
''')


def _lowest_bits(word_format: WordFormat, *others: str, part_bits: int = 32) -> str:
    """Return a line with the lowest bit of each field in its part of ``part_bits``, except the ``others``."""
    fields = [field for field in word_format.fields if field.name not in others]
    return "\n".join(f"{field.name.upper()}_AT = {field.low % part_bits}" for field in fields)


def _senses() -> str:
    """Return the module of the record of senses."""
    names = [sense.name for sense in SENSES]
    about = "\n".join(f"{sense.name}: {sense.about}." for sense in SENSES)
    nothing = ", ".join(f"{sense.name}={sense.nothing}" for sense in SENSES)
    return formatted(f'''"""What a car senses: a record with a name for each sense.

Portable. Written by scripts/generate.py from `motorcade.devices`; don't edit.
"""

# For the type checker alone: MicroPython has no such module.
MYPY = False
if MYPY:
    from typing import NamedTuple

    class Senses(NamedTuple):
        """What a car senses in a tick.

        Attributes:
{indent(about, " " * 12)}
        """

{indent("".join(f"{name}: int" + chr(10) for name in names), " " * 8)}
else:
    from collections import namedtuple

    Senses = namedtuple("Senses", "{" ".join(names)}")

# What a car without any sensor senses.
NOTHING = Senses({nothing})
''')


def _reading(sense: Sense) -> str:
    method = METHODS[sense.method]
    read = f"self.{method.name}()"
    if sense.only_if:
        return f"{read} if {sense.only_if} else {method.missing}"
    return f"1 if {read} else 0" if method.returns == "bool" else read


def _step_kinds() -> str:
    """Return a dataclass for each kind of step that a device declares, and its names in Python."""
    declared = [step for device in DEVICES for step in device.steps]
    made = list(map(_class, declared))
    kinds = ", ".join(map(_class_name, declared))
    made.append(f"SIMPLE_KINDS: tuple[type[Step], ...] = ({kinds},)\n")
    made.append("# Where the class itself reads well, it is the name.")
    made += [f"{step.kind} = {_class_name(step)}" for step in declared if not step.calls]
    made += [_function(step, call) for step in declared for call in step.calls]
    return formatted("\n".join(made)) + "\n\n"


def formatted(source: str) -> str:
    """Return Python as the project formats it."""
    command = [sys.executable, "-m", "ruff", "format", "--stdin-filename", "made.py", "-"]
    return subprocess.run(command, input=source, capture_output=True, text=True, encoding="utf-8", check=True).stdout


def _class_name(step: StepKind) -> str:
    return "".join(part.title() for part in step.kind.split("_")) + "Step"


def _class(step: StepKind) -> str:
    base = "Step"
    if step.accompanies:
        base = "AccompanyingStep"
    elif any(chosen.bits == "motor_speed" for chosen in step.inputs):
        base = "DrivingStep"
    lines = [
        "@dataclass(frozen=True, slots=True)",
        f"class {_class_name(step)}({base}):",
        f'    """{step.about}"""',
        "",
        *(f"    {each.name}: {_type(each)}{_default(each)}" for each in step.inputs if each.bits),
    ]
    return "\n".join([*lines, "", ""])


def _type(each: Input) -> str:
    return "str" if each.options else "int" if each.menu else "float | None"


def _default(each: Input) -> str:
    """A step that a condition ends may be without seconds."""
    return "" if each.options or each.menu else " = None"


def _function(step: StepKind, call: Call) -> str:
    inputs = {each.name: each for each in step.inputs}
    decided = dict(call.sets)
    parameters = "".join(
        f"{name}: {_type(inputs[name])}{f' = {inputs[name].first}' if inputs[name].first else _default(inputs[name])}, "
        for name in call.order
    )
    given = ", ".join(repr(decided[name]) if name in decided else name for name in inputs)
    name = _class_name(step)
    body = indent(f'"""{call.about}"""\nreturn {name}({given}, **more)\n', "    ")
    return f"\ndef {call.name}({parameters}**more: Any) -> {name}:\n{body}\n"


def step_names() -> list[str]:
    """Return the names in Python of all steps, in the order of the alphabet."""
    kinds = [step for device in DEVICES for step in device.steps]
    names = [call.name for step in kinds for call in step.calls] + [step.kind for step in kinds if not step.calls]
    return sorted([*names, "repeat", "together"])


def _imports() -> str:
    return "if TYPE_CHECKING:\n" + "".join(
        f"    from motorcade.program.steps import {name} as {name}\n" for name in step_names()
    )


def _lazy_names() -> str:
    names = "".join(f'        "{name}",\n' for name in step_names())
    return f'    "motorcade.program.steps": (\n{names}    ),\n'


def _board_methods() -> str:
    made = []
    for method in METHODS.values():
        arguments = "".join(f", {name}: int" for name, _, _ in method.arguments)
        returns = "int" if method.returns == "bits" else method.returns
        about = indent(f'"""{method.about}"""' if "\n" not in method.about else f'"""{method.about}\n"""', "    ")
        result = f"\n    return {method.missing}" if method.missing else ""
        if method.name in READ_BY:
            result = f'\n    return self.read_inputs("{READ_BY[method.name].key}")' + " > 0" * (
                method.returns == "bool"
            )
        made.append(f"def {method.name}(self{arguments}) -> {returns}:\n{about}{result}\n")
    readings = ",\n".join(_reading(sense) for sense in SENSES)
    made.append(f'''def senses(self, looks_mm: int) -> Senses:
    """Read all sensors; with ``looks_mm`` 0 no obstacle matters and the ultrasonic sensor stays off."""
    return Senses(
{indent(readings, " " * 8)},
    )
''')
    return "\n" + "\n".join(indent(each, "    ") for each in made) + "\n"


def _c_methods() -> str:
    lines = []
    for sense in SENSES:
        method = METHODS[sense.method]
        missing = "false" if method.missing == "False" else method.missing
        lines.append(f"  // {method.about.partition(chr(10))[0]}")
        lines.append(f"  virtual {_C_TYPES[method.returns]} {method.name}() {{ return {missing}; }}")
    return "\n".join(lines) + "\n"


def _c_inputs() -> str:
    lines = []
    for name, part in READ_BY.items():
        level = "HIGH, 0"
        if part.active:
            level = f"CAR.{part.key}_{part.active}, CAR.{part.key}_threshold"
        lines.append(f"  {_C_TYPES[METHODS[name].returns]} {name}() override {{")
        reads = [f"read_input(CAR.{part.key}[{place}], {level})" for place in range(len(part.roles))]
        bits = [reads[0], *(f"{read} << {place}" for place, read in enumerate(reads[1:], start=1))]
        lines += ["    return " + " |\n           ".join(bits) + ";", "  }"]
    return "\n".join(lines) + "\n"


def _c_begin() -> str:
    pins = [f"CAR.{part.key}[{place}]" for part in READ_BY.values() for place in range(len(part.roles))]
    return "".join(f"    begin_input({pin}, false);\n" for pin in pins)


def _c_settings() -> str:
    lines = ""
    for part in READ_BY.values():
        lines += f"  uint8_t {part.key}[{len(part.roles)}];\n"
        if part.active:
            lines += f"  uint8_t {part.key}_{part.active};\n  uint8_t {part.key}_threshold;\n"
    return lines


def _c_reading() -> str:
    lines = ["const motorcade_senses *Car::sense(uint32_t looks_mm) {"]
    for sense in SENSES:
        method = METHODS[sense.method]
        read = f"board_.{method.name}()"
        if sense.only_if:
            read = f"{sense.only_if} ? {read} : {method.missing}"
        lines.append(f"  senses_.{sense.name} = {read};")
    return "\n".join([*lines, "  return &senses_;", "}"]) + "\n"


def _with_section(name: str, mark: str, *makes: Callable[[], str]) -> str:
    """Return the file with its sections, each between two marks, anew."""
    done, rest = "", (ROOT / name).read_text(encoding="utf-8")
    for make in makes:
        before, begin, rest = rest.partition(f"{mark} {_BEGIN}\n")
        _, end, rest = rest.partition(f"{mark} {_END}\n")
        if not begin or not end:
            raise SystemExit(f"{name}: the lines '{mark} {_BEGIN}' and '{mark} {_END}' are missing")
        # The mark of the end is indented as that of the beginning is.
        done += f"{before}{begin}{make()}{before[len(before.rstrip(' ')) :]}{end}"
    return done + rest
