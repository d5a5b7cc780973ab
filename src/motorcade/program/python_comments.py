"""Comments and imports of a program's Python text, which stay where the program changes."""

import textwrap
from bisect import bisect_right
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from motorcade.program.python_calls import Node
from motorcade.program.python_reader import PythonProgram
from motorcade.program.python_syntax import Comment, PythonSource

INDENT = "    "
LONGEST_LINE = 100


@dataclass(slots=True)
class Comments:
    """The comments of a part: in the lines before it, behind it on its line, and inside it before its end."""

    before: list[str] = field(default_factory=list)
    behind: list[str] = field(default_factory=list)
    end: list[str] = field(default_factory=list)


def comments_of(old: PythonProgram, root: Node) -> dict[str, Comments]:
    """Return the comments inside a part of a text, by the path of the part that they belong to."""
    found: dict[str, Comments] = defaultdict(Comments)
    for comment in old.source.comments():
        if root.start <= comment.start < root.end:
            _attach(comment, root, old.source, found)
    return found


def _attach(comment: Comment, node: Node, source: PythonSource, found: dict[str, Comments]) -> None:
    parts = node.parts
    number = bisect_right(parts, comment.start, key=lambda part: part.start)
    if number:
        last = parts[number - 1]
        if comment.start < last.end:
            _attach(comment, last, source, found)
            return
        if source.line_at(last.end) == comment.line:
            found[last.path].behind.append(comment.text)
            return
    if number < len(parts):
        found[parts[number].path].before.append(comment.text)
    else:
        found[node.path].end.append(comment.text)


def indented(lines: Iterable[str], depth: int) -> list[str]:
    """Return lines with the spaces of their depth."""
    return [INDENT * depth + line for line in lines]


def nodes(node: Node) -> Iterator[tuple[str, Node]]:
    """Yield a part of a text and those inside it, each with its path."""
    yield node.path, node
    for part in node.parts:
        yield from nodes(part)


def with_imports(text: str, old: PythonProgram, used: set[str]) -> str:
    """Return ``text``, whose call is new, with an import of the names in ``used``."""
    source, statement = old.source, old.imported_at
    missing = {name: name for name in used - set(old.imports)}
    if statement is None:
        at = source.import_place()
        return f"{text[:at]}{import_of({name: name for name in used})}\n\n{text[at:]}"
    if not missing:
        return text
    start, end = source.extent(statement)
    if "#" in text[start:end]:
        return f"{text[:end]}\n{import_of(missing)}{text[end:]}"
    here = {alias.name: alias.asname or alias.name for alias in statement.names}
    return text[:start] + import_of(here | missing) + text[end:]


def import_of(names: dict[str, str]) -> str:
    """Return an import of names, each with its name in the text."""
    imported = ", ".join(name if own == name else f"{name} as {own}" for name, own in sorted(names.items()))
    line = f"from motorcade import {imported}"
    if len(line) <= LONGEST_LINE:
        return line
    rows = textwrap.wrap(f"{imported},", LONGEST_LINE - len(INDENT))
    return "\n".join(["from motorcade import (", *indented(rows, 1), ")"])
