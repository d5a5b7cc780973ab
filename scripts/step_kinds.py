"""Write program/step_kinds.py: a dataclass for each kind of step that a device declares, and its names in Python."""

import subprocess
import sys
from textwrap import indent

from motorcade.devices import DEVICES
from motorcade.devices.declaration import Call, Input, StepKind

_HEAD = '''"""The kinds of steps that devices declare.

Written by scripts/generate.py from `motorcade.devices`; don't edit.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

from motorcade.program.step import AccompanyingStep, Step

'''


def step_kinds() -> str:
    """Return the source of the module."""
    declared = [step for device in DEVICES for step in device.steps]
    made = [_HEAD, *map(_class, declared)]
    kinds = ", ".join(map(_class_name, declared))
    made.append(f"SIMPLE_KINDS: tuple[type[Step], ...] = ({kinds},)\n")
    made.append("# Where the class itself reads well, it is the name.")
    made += [f"{step.kind} = {_class_name(step)}" for step in declared if not step.calls]
    made += [_function(step, call) for step in declared for call in step.calls]
    return formatted("\n".join(made))


def formatted(source: str) -> str:
    """Return Python as the project formats it."""
    command = [sys.executable, "-m", "ruff", "format", "--stdin-filename", "made.py", "-"]
    return subprocess.run(command, input=source, capture_output=True, text=True, encoding="utf-8", check=True).stdout


def _class_name(step: StepKind) -> str:
    return "".join(part.title() for part in step.kind.split("_")) + "Step"


def _class(step: StepKind) -> str:
    base = "AccompanyingStep" if step.accompanies else "Step"
    lines = [
        "@dataclass(frozen=True, slots=True)",
        f"class {_class_name(step)}({base}):",
        f'    """{step.about}"""',
        "",
        f"    kind: ClassVar[str] = {step.kind!r}",
        *(f"    {each.name}: {_type(each)}" for each in step.inputs if each.bits),
    ]
    return "\n".join([*lines, "", ""])


def _type(each: Input) -> str:
    return "str" if each.options else "int" if each.menu else "float"


def _function(step: StepKind, call: Call) -> str:
    inputs = {each.name: each for each in step.inputs}
    decided = dict(call.sets)
    parameters = "".join(
        f"{name}: {_type(inputs[name])}{f' = {inputs[name].first}' if inputs[name].first else ''}, "
        for name in call.order
    )
    given = ", ".join(repr(decided[name]) if name in decided else name for name in inputs)
    name = _class_name(step)
    body = indent(f'"""{call.about}"""\nreturn {name}({given}, **more)\n', "    ")
    return f"\ndef {call.name}({parameters}**more: Any) -> {name}:\n{body}\n"
