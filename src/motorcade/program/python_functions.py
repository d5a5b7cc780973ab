"""Write a program as functions, ``leader()``, ``followers()`` and others, and bring such a text up to date.

A function whose steps are the same keeps its text. Another one is written anew: its comments stay with the steps that
stay. Where a statement was several steps, such as a loop whose variable is used, all comments of the
function come first in it. If anything else of the text is in the way of the new program, the whole program is written
anew, below the comments.
"""

import ast
from collections.abc import Iterator, Sequence

from motorcade.program.diagnostics import ProgramError
from motorcade.program.flow_steps import IfStep
from motorcade.program.model import Program, bare, without_ids
from motorcade.program.python_calls import parameters_of
from motorcade.program.python_comments import (
    WrittenStep,
    comments_of,
    import_of,
    indented,
    items_of,
    merged,
    nodes,
    with_imports,
)
from motorcade.program.python_reader import PROFILE, PythonProgram, read_python
from motorcade.program.python_statements import FOLLOWERS, LEADER
from motorcade.program.python_text import (
    StatementTexts,
    asked_counters,
    changed_counters,
    is_statement,
    settings_of,
    statement_lists,
)
from motorcade.program.steps import Step

Steps = Sequence[Step]


def functions_text(program: Program) -> str:
    """Return a program as the text of functions."""
    texts = StatementTexts({}, asked_counters(program))
    parts = [f"{name} = 0\n" for name in changed_counters(program)]
    if program.profile != parameters_of(Program)[1]["profile"]:
        parts.insert(0, f'{PROFILE} = "{program.profile}"\n')
    definitions = [
        "\n".join([head, *_lines(merged([], steps)[0], texts, 1)]) for head, steps in _definitions(program).values()
    ]
    imports = import_of({name: name for name in texts.used})
    head = f"{imports}\n" if texts.used else ""
    return "\n\n".join(["\n".join([head, *parts]).rstrip("\n"), *definitions]).lstrip("\n").rstrip("\n") + "\n"


def updated_functions(old: PythonProgram, program: Program) -> str:
    """Return the text of a program, changed so that it makes another one; every comment stays."""
    if old.is_statements:
        text = _Updater(old, program).text()
        try:
            if bare(read_python(text).program) == bare(program):
                return text
        except ProgramError:
            pass
    comments = "\n".join(comment.text for comment in old.source.comments())
    text = functions_text(program)
    return f"{comments}\n{text}" if comments else text


def _definitions(program: Program) -> dict[str, tuple[str, Steps]]:
    """Return the functions of a program by their name: the first line of each, and its steps."""
    found: dict[str, tuple[str, Steps]] = {name: (f"def {name}():", steps) for name, steps in program.functions.items()}
    found[LEADER] = (f"def {LEADER}():", program.leader)
    if program.followers:
        settings = settings_of(program.followers)
        values = ", ".join(f"{name}={value!r}".replace("'", '"') for name, value in settings.items())
        found[FOLLOWERS] = (f"def {FOLLOWERS}({values}):", program.followers.steps)
    return found


class _Updater:
    """Changes one text."""

    def __init__(self, old: PythonProgram, program: Program) -> None:
        self._old = old
        self._program = program
        self._texts = StatementTexts(old.imports, asked_counters(program))
        self._nodes = dict(nodes(old.root))

    def text(self) -> str:
        """Return the new text."""
        source = self._old.source
        before = _definitions(self._old.program)
        after = _definitions(self._program)
        edits: list[tuple[int, int, str]] = []
        added = []
        for name, (head, steps) in after.items():
            definition = self._old.definitions.get(name)
            if definition is None:
                lines = _lines(merged([], steps)[0], self._texts, 1)
                added.append("\n".join([head, *lines]) + "\n\n\n")
                continue
            old_head, old_steps = before.get(name, ("", ()))
            if head == old_head and list(map(without_ids, steps)) == list(map(without_ids, old_steps)):
                continue
            start, end = self._old.definition_extent(definition)
            edits.append((start, end, self._definition(name, head, old_steps, steps, start, end)))
        for name, definition in self._old.definitions.items():
            if name not in after and name in before:
                start, end = self._old.definition_extent(definition)
                edits.append((start, end, "\n".join(self._comments_between(start, end))))
        start, _ = source.extent(self._old.definitions[LEADER])
        edits.append((start, start, "".join(added)))
        edits.append(self._values())
        text = source.text
        # Of two edits at one place, the one that only adds comes first in the text.
        for start, end, new in sorted(edits, reverse=True):
            text = text[:start] + new + text[end:]
        return with_imports(text, self._old, self._texts.used)

    def _values(self) -> tuple[int, int, str]:
        """Return the edit that adds the counters, and the profile, that the text doesn't name yet."""
        source = self._old.source
        tree = self._old.source.tree
        first = min(statement.lineno for statement in self._old.definitions.values())
        before = [statement for statement in tree.body if statement.lineno < first]
        lines = [f"{name} = 0" for name in changed_counters(self._program) if name not in self._old.counters]
        if self._program.profile != self._old.program.profile:
            place = self._old.value_extents.get(PROFILE)
            if place:
                return (*place, f'"{self._program.profile}"') if not lines else (*place, "")
            lines.insert(0, f'{PROFILE} = "{self._program.profile}"')
        at = source.start_of(first)
        if before:
            end = source.extent(before[-1])[1]
            at = source.text.find("\n", end) + 1 or len(source.text)
        return at, at, "".join(f"{line}\n" for line in lines)

    def _definition(self, name: str, head: str, old: Steps, steps: Steps, start: int, end: int) -> str:
        """Return the new text of a function."""
        path = {LEADER: LEADER, FOLLOWERS: f"{FOLLOWERS}.steps"}.get(name, f"functions.{name}")
        lines = [head]
        definition = self._old.definitions[name]
        docstring = definition.body[0]
        if ast.get_docstring(definition, clean=False) is not None:
            first, last = self._old.source.extent(docstring)
            lines += indented([self._old.source.text[first:last]], 1)
        if not self._old.is_plain[name]:
            lines += indented(self._comments_between(start, end), 1)
            return "\n".join([*lines, *_lines(merged([], steps)[0], self._texts, 1)])
        comments = comments_of(self._old, self._nodes[path])
        written, left = merged(items_of(old, path, self._old, self._nodes, comments), steps)
        own = comments[path]
        lines += _lines(written, self._texts, 1)
        lines += indented([*left, *own.before, *own.behind, *own.end], 1)
        return "\n".join(lines)

    def _comments_between(self, start: int, end: int) -> list[str]:
        return [comment.text for comment in self._old.source.comments() if start <= comment.start < end]


def _lines(row: Sequence[WrittenStep], texts: StatementTexts, depth: int) -> list[str]:
    """Return the lines of steps with their comments; of none, ``pass``."""
    if not row:
        return indented(["pass"], depth)
    return [line for item in row for line in _statement(item, texts, depth)]


def _statement(item: WrittenStep, texts: StatementTexts, depth: int, before: str = "") -> Iterator[str]:
    """Yield the lines of one step; ``before`` is put before the word if."""
    step = item.step
    head = before + texts.head(step)
    comments = [*item.before, *item.behind[1:]]
    if not is_statement(step):
        head = item.text or head
        comments += item.comments_inside()
    if item.behind:
        head += f"  {item.behind[0]}"
    yield from indented([*comments, head], depth)
    if not is_statement(step):
        return
    for name, line in statement_lists(step):
        inside = item.lists[name]
        if line and len(inside) == 1 and isinstance(inside[0].step, IfStep) and not inside[0].before:
            yield from _statement(inside[0], texts, depth, "el")
            continue
        if line:
            yield from indented([line], depth)
        yield from _lines(inside, texts, depth + 1)
    yield from indented(item.end, depth + 1)
