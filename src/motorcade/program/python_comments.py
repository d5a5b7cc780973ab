"""Comments, steps and imports of a program's Python text, which stay where the program changes."""

import textwrap
from bisect import bisect_right
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from motorcade.program.model import align, without_ids
from motorcade.program.python_calls import Node
from motorcade.program.python_reader import PythonProgram
from motorcade.program.python_syntax import Comment, PythonSource
from motorcade.program.steps import Step

INDENT = "    "
LONGEST_LINE = 100


@dataclass(slots=True)
class Comments:
    """The comments of a part: in the lines before it, behind it on its line, and inside it before its end."""

    before: list[str] = field(default_factory=list)
    behind: list[str] = field(default_factory=list)
    end: list[str] = field(default_factory=list)


@dataclass(slots=True, kw_only=True)
class WrittenStep(Comments):
    """A step to write, with its comments, the steps inside it by list, and its present text where that can stay."""

    step: Step
    lists: dict[str, list["WrittenStep"]] = field(default_factory=dict)
    text: str = ""

    def inside(self) -> list["WrittenStep"]:
        """Return the steps inside it."""
        return [item for row in self.lists.values() for item in row]

    def comments_inside(self) -> list[str]:
        """Return the comments of the steps inside it, and those before its end."""
        return [*comments_in(self.inside()), *self.end]


def comments_in(items: Iterable[WrittenStep]) -> list[str]:
    """Return the comments of items, and of the steps inside them."""
    found = []
    for item in items:
        found += [*item.before, *item.comments_inside(), *item.behind]
    return found


def items_of(
    row: Sequence[Step], path: str, old: PythonProgram, places: dict[str, Node], comments: dict[str, Comments]
) -> list[WrittenStep]:
    """Return the steps that stand at ``path`` of a text, with their comments, which are taken out of ``comments``.

    ``places`` are the parts of the text by their paths.
    """
    items = []
    for number, step in enumerate(row):
        place = f"{path}[{number}]"
        own = comments.pop(place, Comments())
        item = WrittenStep(own.before, own.behind, own.end, step=step)
        for name, inside in step.lists.items():
            item.lists[name] = items_of(inside, f"{place}.{step.inside_at[name]}", old, places, comments)
        # The steps of a function with parameters have no place of their own.
        if place in places:
            text = old.source.text[places[place].start : places[place].end]
            # Steps over several lines are written anew.
            if "\n" not in text:
                item.text = text
        if not item.inside():
            # A comment between the values of a step.
            item.before = item.before + item.end
            item.end = []
        items.append(item)
    return items


def merged(old: Sequence[WrittenStep], row: Sequence[Step]) -> tuple[list[WrittenStep], list[str]]:
    """Return the items of a new row, which take over the comments of the old ones, and the comments left at its end.

    The comments of a step that is gone stand before the next one that stayed.
    """
    places = align([item.step for item in old], row)
    gone = [position for position in range(len(old)) if position not in places]
    items = []
    for step, place in zip(row, places, strict=True):
        before = WrittenStep(step=step)
        orphaned: list[str] = []
        if place is not None:
            before = old[place]
            orphaned = comments_in(old[position] for position in gone if position < place)
            gone = [position for position in gone if position > place]
        item = WrittenStep([*orphaned, *before.before], before.behind, step=step)
        lost = dict(before.lists)
        for name, inside in step.lists.items():
            item.lists[name], left = merged(lost.pop(name, []), inside)
            item.end += left
        for lost_row in lost.values():
            item.end += comments_in(lost_row)
        item.end += before.end
        if without_ids(step) == without_ids(before.step):
            item.text = before.text
        items.append(item)
    return items, comments_in(old[position] for position in gone)


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
    source = old.source
    statement = old.imported_at
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
