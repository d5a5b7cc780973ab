"""Print values and interfaces as TypeScript: on one line where they fit, otherwise one entry a line."""

import json
from collections.abc import Iterable
from typing import Any

# A line of a value is at most so long.
_WIDTH = 118


def literal(value: Any, before: int = 0, depth: int = 0) -> str:
    """Return the value as an expression.

    Args:
        value: what JSON can hold.
        before: how many characters stand before it on its line.
        depth: how many steps its line is indented.
    """
    flat = json.dumps(value)
    if not isinstance(value, dict | list | tuple) or before + len(flat) + (1 if depth else 10) <= _WIDTH:
        return flat
    indent = "  " * (depth + 1)
    if isinstance(value, dict):
        entries = [(f"{json.dumps(key)}: ", each) for key, each in value.items()]
    else:
        entries = [("", each) for each in value]
    lines = [f"{indent}{key}{literal(each, len(indent) + len(key), depth + 1)}," for key, each in entries]
    begin, end = "{}" if isinstance(value, dict) else "[]"
    return "\n".join([begin, *lines, "  " * depth + end])


def constant(name: str, value: Any, kind: str = "") -> str:
    """Return the declaration of a constant; one without a type is as narrow as its value."""
    begin = f"export const {name}{f': {kind}' if kind else ''} = "
    return f"{begin}{literal(value, len(begin))}{'' if kind or isinstance(value, int) else ' as const'};\n"


def interface(name: str, fields: Iterable[str]) -> str:
    """Return the declaration of an interface of these fields."""
    listed = list(fields)
    flat = f"export interface {name} {{ {'; '.join(listed)} }}"
    if len(flat) > _WIDTH:
        lines = "".join(f"  {each};\n" for each in listed)
        flat = f"export interface {name} {{\n{lines}}}"
    return f"{flat}\n"
