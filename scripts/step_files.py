"""Write what comes from the declarations of steps: the page's steps.ts, sections of docs/programs.md and api.md."""

import inspect
from dataclasses import Field
from typing import Any

from scripts.typescript import constant

from motorcade.devices import DEVICES
from motorcade.devices.declaration import Block
from motorcade.locales import catalogue
from motorcade.program import steps
from motorcade.program.blocks import SETTINGS_IN_START
from motorcade.program.conditions import SENSES
from motorcade.program.parts import word_fields
from motorcade.program.python_calls import STEP_NAMES
from motorcade.program.steps import (
    COMMON,
    KINDS,
    DrivingStep,
    RepeatStep,
    Step,
    TogetherStep,
    first_value,
    own_fields,
)
from motorcade.words.field import WordFormat
from motorcade.words.flow import CONDITIONS, OPS
from motorcade.words.formats import CONTROL, FLOW, HEADER, STATE

_HEAD = """/** The kinds of steps, and the fields of both kinds of words. Written by scripts/generate.py; don't edit. */
"""
# The blocks that hold others.
_ORDER = {
    "together": Block("order", "M4 6h16M4 12h16M4 18h16M8 3v18"),
    "repeat": Block("order", "M4 11a7 7 0 0 1 12-4.500L19 9M19 4v5h-5M20 13a7 7 0 0 1-12 4.500L5 15M5 20v-5h5"),
}
# The groups of fields that no step fills, where they aren't called as their field.
_GROUPS = {
    "leader_states": "count",
    "follower_words": "count",
    "accept_ir": "infrared",
    "forward": "infrared",
    "until_not": "until",
    "until_level": "until",
    "if_not": "condition",
    "level": "condition",
    "unused": "reserved",
}
_BEGIN = "<!-- This section is written by scripts/generate.py from the declarations in program/steps.py. -->"
_END = "<!-- End of the section. -->"


def step_types() -> str:
    """The kinds of steps as TypeScript."""
    step_kinds = _step_kinds()
    categories = list(dict.fromkeys(kind["category"] for kind in step_kinds))
    hues = {each.kind: device.hue for device in DEVICES for each in device.steps}
    groups = {kind.group: hues[kind.kind] for kind in KINDS.values() if kind.group}
    parts = {
        "STEP_KINDS": step_kinds,
        "CATEGORIES": categories,
        "HAT_IN_START": [name.upper() for name in SETTINGS_IN_START],
        "FORMATS": {each.name: _bits(each) for each in (HEADER, CONTROL, STATE, FLOW)},
        "SENSES": {sense: levels for sense, levels in SENSES.items() if len(levels) > 1},
        "FLOW_OPS": [name for _, name in OPS],
        "FLOW_CONDITIONS": [name for _, name in CONDITIONS],
        "HUES": groups,
        "PYTHON_CALLS": [_call(name, kind) for kind in KINDS.values() for name in kind.names],
        "PYTHON_SETTINGS": [name for name, schema in COMMON.items() if schema["type"] == "boolean"],
    }
    return "\n".join([_HEAD, *(constant(name, value) for name, value in parts.items())])


def _step_kinds() -> list[dict[str, Any]]:
    """The blocks of all kinds of steps, in the order of the page's toolbox.

    ``holds`` says whether other steps stand inside the block. ``group`` and ``sets``, the fields of the word that
    are the same in each step of the kind, are absent where the kind has no bits of a word.
    """
    declared = {each.kind: each.block for device in DEVICES for each in device.steps} | _ORDER
    return [
        {
            "kind": kind.kind,
            "category": declared[kind.kind].drawer,
            "icon": declared[kind.kind].icon,
            "in_start": kind.in_start,
            "accompanies": kind.accompanies,
            "drives": issubclass(kind, DrivingStep),
            "holds": kind in (TogetherStep, RepeatStep),
            "fields": [_input(each) for each in own_fields(kind)],
            **({"group": kind.group, "sets": kind.sets} if kind.group else {}),
        }
        for kind in KINDS.values()
    ]


def _input(field: Field[Any]) -> dict[str, Any]:
    """How a field is edited in its block: a choice, a level, a number or seconds; ``word``, what it fills in a word."""
    name, schema = field.name.upper(), field.metadata["schema"]
    word = {"word": field.metadata["word"]} if "word" in field.metadata else {}
    if field.name == "seconds":
        return {"input": "seconds", "name": name, **word}
    if "enum" in schema:
        least = field.metadata["least"]
        return {"input": "choice", "name": name, **word, "options": list(schema["enum"]), "least": least}
    first = field.metadata["first"]
    if "menu" in field.metadata:
        levels = list(range(schema["minimum"], schema["maximum"] + 1))
        return {
            "input": "level",
            "name": name,
            **word,
            "menu": field.metadata["menu"],
            "levels": levels,
            "first": first,
        }
    return {"input": "number", "name": name, "minimum": schema["minimum"], "first": first}


def _call(name: str, kind: type[Step]) -> dict[str, Any]:
    """A step's name in Python, what it takes, and an example, which gives each parameter without a default."""
    own = {each.name: each.metadata for each in own_fields(kind)}
    parameters: list[dict[str, Any]] = []
    example: list[str] = []
    for each in inspect.signature(getattr(steps, name)).parameters.values():
        if each.kind is each.VAR_POSITIONAL:
            example += ["forward(1)", "led(0, 1)"]
        elif each.kind is each.POSITIONAL_OR_KEYWORD:
            schema = own[each.name]["schema"]
            menu = {"menu": own[each.name]["menu"]} if "menu" in own[each.name] else {}
            least_most = {"least": schema["minimum"], "most": schema["maximum"]}
            parameters.append({"name": each.name, **least_most, **menu})
            if each.default is each.empty or (each.default is None and not kind.accompanies):
                example.append(str(first_value(kind, each.name)))
            elif menu:
                example.append(f"{each.name}={schema['maximum']}")
    return {
        "name": name,
        "kind": kind.kind,
        "signature": f"{name}({_arguments(name)})",
        "parameters": parameters,
        "example": f"{name}({', '.join(example)})",
    }


def _bits(word_format: WordFormat) -> list[dict[str, Any]]:
    """Of each field: its name, its first and its last bit, its group, and what its value means where steps fill it."""
    filled = _word_fields()
    return [
        {"name": each.name, "high": each.high, "low": each.low}
        | filled.get(each.name, {"group": _GROUPS.get(each.name, each.name)})
        for each in word_format.fields
    ]


def _word_fields() -> dict[str, dict[str, Any]]:
    """Of each field of a control word that steps fill: its group, and what its value means."""
    made: dict[str, dict[str, Any]] = {}
    for kind, block in zip(KINDS.values(), _step_kinds(), strict=True):
        meanings = {name: {"meaning": "flag"} for name in word_fields(kind)}
        for field, shown in zip(own_fields(kind), block["fields"], strict=True):
            if "word" in field.metadata:
                meaning = "duration" if shown["input"] == "seconds" else shown["input"]
                more = {key: shown[key] for key in ("options", "menu") if key in shown}
                meanings[field.metadata["word"]] = {"meaning": meaning, **more}
        for name, meaning in meanings.items():
            if made.get(name, {"meaning": "flag"})["meaning"] == "flag":
                made[name] = {"group": kind.group, **meaning}
    return made


def with_steps_table(text: str, language: str) -> str:
    """The documentation page docs/programs.md, ``text``, with its table of steps anew."""
    return _with_section(text, _table(language))


def with_step_names(text: str) -> str:
    """The documentation page docs/api.md, ``text``, with the names of steps anew."""
    names = [name for kind in KINDS.values() for name in kind.names]
    return _with_section(text, "".join(f"::: motorcade.{name}\n" for name in names))


def _with_section(text: str, section: str) -> str:
    before, _, rest = text.partition(_BEGIN)
    _, _, after = rest.partition(_END)
    return f"{before}{_BEGIN}\n\n{section}\n{_END}{after}"


def _table(language: str) -> str:
    texts = catalogue(language)["page"]["tooltips"]
    head = {"en": "| in Python | in a project file | what the car does |", "zh": "| Python | 项目文件 | 小车做什么 |"}
    rows = [head[language], "|---|---|---|"]
    for kind in KINDS.values():
        python = ", ".join(f"`{name}({_arguments(name)})`" for name in kind.names)
        rows.append(f"| {python} | `{_in_json(kind)}` | {texts[kind.kind]} |")
    return "\n".join(rows) + "\n"


def _arguments(name: str) -> str:
    """What stands between a step's brackets in Python, but for what every step takes."""
    parameters = inspect.signature(getattr(steps, name)).parameters.values()
    shown = []
    for each in parameters:
        if each.kind is each.VAR_POSITIONAL:
            shown.append("step, step, …")
        elif each.kind is each.POSITIONAL_OR_KEYWORD:
            needed = each.default is each.empty or (each.default is None and not STEP_NAMES[name].accompanies)
            shown.append(each.name if needed else f"{each.name}={each.default}")
    return ", ".join(shown)


def _in_json(kind: type[Step]) -> str:
    if kind is TogetherStep:
        return f'{{"{kind.kind}": […]}}'
    names = [each.name for each in own_fields(kind)] + ["steps"] * (kind is RepeatStep)
    return f'{{"{kind.kind}": {{' + ", ".join(f'"{name}": …' for name in names) + "}}"
