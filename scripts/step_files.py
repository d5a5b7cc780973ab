"""What is made of the steps' declarations: web/src/generated/steps.ts, and the table of steps in docs/programs.md."""

import inspect
import json
from typing import Any

from motorcade.locales import catalogue
from motorcade.program import steps
from motorcade.program.parts import word_fields
from motorcade.program.steps import KINDS, RepeatStep, Step, TogetherStep, own_fields

_HEAD = """/** The kinds of steps: blocks, and bits of a word. Written by scripts/generate.py; don't edit. */
"""
_BEGIN = "<!-- This table is written by scripts/generate.py from the declarations in program/steps.py. -->"
_END = "<!-- End of the table. -->"


def step_types() -> str:
    """The kinds of steps as TypeScript."""
    categories = list(dict.fromkeys(kind.category for kind in KINDS.values()))
    groups = {kind.group: kind.hue for kind in KINDS.values() if kind.group}
    parts = {
        "STEP_KINDS": [_block(kind) for kind in KINDS.values()],
        "CATEGORIES": categories,
        "WORD_FIELDS": _word_fields(),
        "HUES": groups,
    }
    lines = [f"export const {name} = {json.dumps(value, indent=2)} as const;\n" for name, value in parts.items()]
    return "\n".join([_HEAD, *lines])


def _block(kind: type[Step]) -> dict[str, Any]:
    return {
        "kind": kind.kind,
        "category": kind.category,
        "accompanies": kind.accompanies,
        "holds": kind in (TogetherStep, RepeatStep),
        "fields": [_block_field(each) for each in own_fields(kind)],
    }


def _block_field(field: Any) -> dict[str, Any]:
    name, given = field.name.upper(), field.metadata
    if field.name == "seconds":
        return {"input": "seconds", "name": name}
    if "enum" in given["schema"]:
        return {"input": "choice", "name": name, "options": given["schema"]["enum"]}
    if "menu" in given:
        levels = list(range(given["schema"]["minimum"], given["schema"]["maximum"] + 1))
        return {"input": "level", "name": name, "menu": given["menu"], "levels": levels, "first": given["first"]}
    return {"input": "number", "name": name, "minimum": given["schema"]["minimum"], "first": given["first"]}


def _word_fields() -> dict[str, dict[str, Any]]:
    """Of each field of a control word that steps fill: its group, and what its value means."""
    made: dict[str, dict[str, Any]] = {}
    for kind in KINDS.values():
        meanings = {name: {"meaning": "flag"} for name in word_fields(kind)}
        for field in own_fields(kind):
            if "word" in field.metadata:
                block = _block_field(field)
                input_name = block["input"]
                more = {key: block[key] for key in ("options", "menu") if key in block}
                meanings[field.metadata["word"]] = {
                    "meaning": "duration" if input_name == "seconds" else input_name,
                    **more,
                }
        for name, meaning in meanings.items():
            if made.get(name, {"meaning": "flag"})["meaning"] == "flag":
                made[name] = {"group": kind.group, **meaning}
    return made


def with_steps_table(text: str, language: str) -> str:
    """The documentation page ``text`` with its table of steps anew."""
    before, _, rest = text.partition(_BEGIN)
    _, _, after = rest.partition(_END)
    return f"{before}{_BEGIN}\n\n{_table(language)}\n{_END}{after}"


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
            shown.append(each.name if each.default is each.empty else f"{each.name}={each.default}")
    return ", ".join(shown)


def _in_json(kind: type[Step]) -> str:
    if kind is TogetherStep:
        return f'{{"{kind.kind}": […]}}'
    names = [each.name for each in own_fields(kind)] + ["steps"] * (kind is RepeatStep)
    return f'{{"{kind.kind}": {{' + ", ".join(f'"{name}": …' for name in names) + "}}"
