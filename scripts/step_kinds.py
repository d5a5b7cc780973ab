"""Write program/step_kinds.py: a dataclass for each kind of step that a device declares, and its names in Python."""

import subprocess
import sys
from textwrap import indent
from typing import Any

from motorcade.devices import DEVICES
from motorcade.devices.declaration import Call, Device, Input, StepKind

_HEAD = '''"""The kinds of steps that devices declare.

Written by scripts/generate.py from `motorcade.devices`; don't edit.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

from motorcade.program.step import AccompanyingStep, Step, chosen, lasting, level

'''


def step_kinds() -> str:
    """Return the source of the module."""
    declared = [(device, step) for device in DEVICES for step in device.steps]
    made = [_HEAD]
    names = ["SIMPLE_KINDS"]
    for device, step in declared:
        made.append(_class(device, step))
        names.append(_class_name(step))
    kinds = ", ".join(_class_name(step) for _, step in declared)
    made.append(
        f"SIMPLE_KINDS: tuple[type[Step], ...] = ({kinds},)\n\n# Where the class itself reads well, it is the name.\n"
    )
    for _, step in declared:
        if not step.calls:
            made.append(f"{step.kind} = {_class_name(step)}\n")
            names.append(step.kind)
    for _, step in declared:
        for call in step.calls:
            made.append(_function(step, call))
            names.append(call.name)
    # Constants, classes and functions, as the linter sorts them.
    order = sorted(names, key=lambda name: (not name.isupper(), name[0].islower(), name))
    made.append(f"__all__ = {order!r}\n")
    return formatted("\n".join(made))


def formatted(source: str) -> str:
    """Return Python as the project formats it."""
    command = [sys.executable, "-m", "ruff", "format", "--stdin-filename", "made.py", "-"]
    return subprocess.run(command, input=source, capture_output=True, text=True, encoding="utf-8", check=True).stdout


def _class_name(step: StepKind) -> str:
    return "".join(part.title() for part in step.kind.split("_")) + "Step"


def _class(device: Device, step: StepKind) -> str:
    calls = {call.name: dict(call.sets) for call in step.calls} or {step.kind: {}}
    attributes: dict[str, tuple[str, Any]] = {"kind": ("str", step.kind)}
    if step.block.in_start:
        attributes["in_start"] = ("bool", True)
    attributes["names"] = ("dict[str, dict[str, str]]", calls)
    attributes["category"] = ("str", step.block.drawer)
    attributes["icon"] = ("str", step.block.icon)
    attributes["group"] = ("str", step.group or device.group)
    attributes["hue"] = ("int", device.hue)
    if step.sets:
        attributes["sets"] = ("dict[str, int]", dict(step.sets))
    base = "AccompanyingStep" if step.accompanies else "Step"
    lines = [
        "@dataclass(frozen=True, slots=True)",
        f"class {_class_name(step)}({base}):",
        f'    """{step.about}"""',
        "",
    ]
    lines += [f"    {name}: ClassVar[{kind}] = {value!r}" for name, (kind, value) in attributes.items()]
    lines += [f"    {each.name}: {_type(each)} = {_field(each)}" for each in step.inputs if each.bits]
    return "\n".join([*lines, "", ""])


def _type(each: Input) -> str:
    return "str" if each.options else "int" if each.menu else "float"


def _field(each: Input) -> str:
    if each.options:
        more = f", least={each.least}" if each.least else ""
        return f"chosen({each.bits!r}, {each.options!r}{more})"
    if each.menu:
        more = "".join(f", {key}={value}" for key, value in (("first", each.first), ("least", each.least)) if value)
        return f"level({each.bits!r}, {each.menu!r}{more})"
    return f"lasting({each.bits!r})"


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
