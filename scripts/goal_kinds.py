"""Write the kinds of goals for the page's editor of missions: the text of web/src/generated/goals.ts."""

from typing import Any

from scripts.typescript import constant

from motorcade.config.check import Schema
from motorcade.missions.goal import GROUPS, TIMES
from motorcade.missions.schema import GOALS

_HEAD = """/** The kinds of a mission's goals, and the keys of each. Written by scripts/generate.py; don't edit. */
"""
# Keys with an input of their own; all others are numbers.
_OWN = ("who", "zone", "at", "led")


def goal_kinds() -> str:
    """The kinds of goals as TypeScript."""
    kinds = {
        kind: [_field(name, schema, name in known.optional) for name, schema in known.fields.items()]
        for kind, known in GOALS.items()
    }
    parts = {"GOAL_KINDS": kinds, "GROUPS": GROUPS, "TIMES": TIMES}
    return "\n".join([_HEAD, *(constant(name, value) for name, value in parts.items())])


def _field(name: str, schema: Schema, is_optional: bool) -> dict[str, Any]:
    """A key of a goal. ``first`` is what a new goal of the editor has: the default, or the allowed number next to 1."""
    field: dict[str, Any] = {"name": name, "input": name if name in _OWN else "number"}
    if not is_optional or name == "least_m":
        if "default" in schema:
            field["first"] = schema["default"]
        elif name == "led":
            field["first"] = 0
        elif field["input"] == "number":
            field["first"] = max(schema["minimum"], min(1, schema["maximum"]))
    if field["input"] == "number":
        field |= {"least": schema["minimum"], "most": schema["maximum"], "whole": schema["type"] == "integer"}
    return field
