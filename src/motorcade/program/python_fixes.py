"""Edits that would fix a mistake in a program's Python text."""

import ast
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any

from motorcade.program.diagnostics import TEXT, Fix
from motorcade.program.python_syntax import MOST_TRIED, Source, is_python
from motorcade.program.step import Step, first_value, own_fields

_PACKAGE = "motorcade"


def as_text(value: Any) -> str:
    """Return a value as it is written in Python."""
    return f'"{value}"' if isinstance(value, str) else str(value)


def replacement(source: Source, start: int, end: int, text: str) -> list[Fix]:
    """Return the edit that puts ``text`` in the place of these characters; none where the result is no Python."""
    if len(source.text) > MOST_TRIED or not is_python(source.text[:start] + text + source.text[end:]):
        return []
    return [Fix(TEXT, text, source.span_between(start, end))]


def without_argument(source: Source, call: ast.Call, argument: Any) -> list[Fix]:
    """Return the edit that deletes an argument of a call, with its comma."""
    extents = sorted(source.extent(each) for each in (*call.args, *call.keywords))
    place = extents.index(source.extent(argument))
    start, end = extents[place]
    if place:
        start = extents[place - 1][1]
    elif len(extents) > 1:
        end = extents[1][0]
    return [] if "#" in source.text[start:end] else replacement(source, start, end, "")


def with_argument(source: Source, call: ast.Call, name: str, value: Any) -> list[Fix]:
    """Return the edit that adds a named argument to a call, behind its others."""
    ends = [source.extent(each)[1] for each in (*call.args, *call.keywords)]
    at = max(ends, default=source.extent(call)[1] - 1)
    return replacement(source, at, at, f"{', ' if ends else ''}{name}={as_text(value)}")


def without_lines(source: Source, statement: ast.stmt) -> list[Fix]:
    """Return the edit that deletes the lines of a statement."""
    start, end = source.extent(statement)
    start = source.start_of(source.line_at(start))
    return replacement(source, start, min(end + 1, len(source.text)), "")


def with_line(source: Source, line: str) -> list[Fix]:
    """Return the edit that adds a line at the end."""
    end = len(source.text)
    before = "" if source.text.endswith("\n") or not end else "\n"
    return replacement(source, end, end, f"{before}{line}\n")


def with_imports(source: Source, statement: ast.ImportFrom | None, names: Iterable[str]) -> list[Fix]:
    """Return the edit that imports ``names`` too; ``statement`` is the import that is there."""
    text = ", ".join(names)
    if statement:
        at = source.extent(statement.names[-1])[1]
        return replacement(source, at, at, f", {text}")
    body = source.tree.body
    first = body[1] if isinstance(body[0], ast.Expr) and len(body) > 1 else body[0]
    at = source.start_of(first.lineno)
    return replacement(source, at, at, f"from {_PACKAGE} import {text}\n\n")


def right_import(source: Source, statement: ast.Import | ast.ImportFrom) -> list[Fix]:
    """Return the edit that corrects a misspelt import, or deletes another one."""
    start, end = source.extent(statement)
    module = statement.module if isinstance(statement, ast.ImportFrom) else statement.names[0].name
    if not get_close_matches(module or "", [_PACKAGE], 1):
        return without_lines(source, statement)
    names = ", ".join(ast.unparse(each) for each in statement.names) if isinstance(statement, ast.ImportFrom) else "*"
    return replacement(source, start, end, f"from {_PACKAGE} import {names}")


def as_program(source: Source, statement: ast.stmt, variable: str, name: str) -> list[Fix]:
    """Return the edit that gives a call of ``name``, the program's class, to the variable of the program."""
    match statement:
        case ast.Expr(value=ast.Call(func=ast.Name(id=found)) as call) if found == name:
            start = source.extent(call)[0]
            return replacement(source, start, start, f"{variable} = ")
        case ast.Assign(targets=[ast.Name() as target], value=ast.Call(func=ast.Name(id=found))) if found == name:
            return replacement(source, *source.extent(target), variable)
    return []


def as_list(source: Source, value: ast.expr, names: Iterable[str]) -> list[Fix]:
    """Return the edit that puts a single step into a list."""
    start, end = source.extent(value)
    is_step = isinstance(value, ast.Call) and isinstance(value.func, ast.Name) and value.func.id in names
    return replacement(source, start, end, f"[{source.text[start:end]}]") if is_step else []


def as_step(source: Source, value: ast.expr, kinds: dict[str, type[Step]]) -> list[Fix]:
    """Return the edit that makes a step of its name alone, or of a name that is much like it."""
    if not isinstance(value, ast.Name):
        return []
    for name in get_close_matches(value.id, kinds, 1):
        kind = kinds[name]
        given = {**kind.names[name], "speed": None}
        values = [first_value(kind, each.name) for each in own_fields(kind) if each.name not in given]
        return replacement(source, *source.extent(value), f"{name}({', '.join(map(as_text, values))})")
    return []
