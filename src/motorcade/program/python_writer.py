"""Write a program as Python text, and bring an older text up to date: its comments and everything else stay."""

from collections import defaultdict
from collections.abc import Iterable, Sequence

from motorcade.program.blocks import plain
from motorcade.program.model import Followers, Program, bare
from motorcade.program.python_calls import Node, parameters_of
from motorcade.program.python_comments import (
    INDENT,
    LONGEST_LINE,
    Comments,
    WrittenStep,
    comments_in,
    comments_of,
    import_of,
    indented,
    items_of,
    merged,
    nodes,
    with_imports,
)
from motorcade.program.python_functions import functions_text, updated_functions
from motorcade.program.python_reader import VARIABLE, PythonProgram, read_python
from motorcade.program.python_text import StatementTexts, name_of, needs_statements, settings_of, values_of
from motorcade.program.steps import Step


def python_text(program: Program) -> str:
    """Return a program as text that `read_python` and Python itself read.

    It is one call of Program, or functions where the leader decides.
    """
    if needs_statements(program):
        return functions_text(program)
    writer = _Writer(None)
    call = writer.program(program)
    return f"{import_of({name: name for name in writer.texts.used})}\n\n{VARIABLE} = {call}\n"


def updated_text(text: str | PythonProgram, program: Program) -> str:
    """Return ``text``, changed so that it makes ``program``; every comment stays.

    A text that makes the program already, apart from ids, is returned as it is. Raises ProgramError where it can't be
    read.
    """
    old = text
    if isinstance(old, str):
        old = read_python(old)
    if bare(old.program) == bare(program):
        return old.source.text
    if old.is_statements or needs_statements(program):
        return updated_functions(old, program)
    writer = _Writer(old)
    call = writer.program(program)
    text = old.source.text[: old.root.start] + call + old.source.text[old.root.end :]
    return with_imports(text, old, writer.texts.used)


class _Writer:
    """Writes one program; ``texts`` collects the names that its text needs."""

    def __init__(self, old: PythonProgram | None) -> None:
        self._old = old
        self._nodes: dict[str, Node] = {}
        self._comments: dict[str, Comments] = defaultdict(Comments)
        imports: dict[str, str] = {}
        if old is not None:
            imports = old.imports
            self._nodes = dict(nodes(old.root))
            self._comments = comments_of(old, old.root)
        self.texts = StatementTexts(imports)

    def program(self, program: Program) -> str:
        """Return the call of Program, over several lines."""
        leader, followers = self._old_items()
        steps_text = self._list(leader, program.leader, "leader", 1)
        rows = self._argument("leader", f"leader={steps_text}", 1)
        left: list[str] = []
        if program.followers is not None:
            followers_text = self._followers(program.followers, followers)
            rows += self._argument("followers", f"followers={followers_text}", 1)
        else:
            rows += indented(comments_in(followers), 1)
        if program.profile != parameters_of(Program)[1]["profile"]:
            rows += self._argument("profile", f"profile={program.profile!r}", 1)
        for comments in self._comments.values():
            left += [*comments.before, *comments.behind, *comments.end]
        return self._call(Program.__name__, rows + indented(left, 1), 0)

    def _old_items(self) -> tuple[list[WrittenStep], list[WrittenStep]]:
        """Return the steps of the leader and of the followers in the present text."""
        if self._old is None:
            return [], []
        program = self._old.program
        leader = items_of(program.leader, "leader", self._old, self._nodes, self._comments)
        if program.followers is None:
            return leader, []
        steps = program.followers.steps
        return leader, items_of(steps, "followers.steps", self._old, self._nodes, self._comments)

    def _followers(self, followers: Followers, old: list[WrittenStep]) -> str:
        settings = settings_of(followers)
        path = "followers"
        if "followers.steps" in self._nodes:
            path = "followers.steps"
        elif not settings:
            return self._list(old, followers.steps, path, 1)
        rows = self._argument("followers.steps", self._list(old, followers.steps, path, 2), 2)
        for name, value in settings.items():
            rows += self._argument(f"followers.{name}", f"{name}={plain(value)!r}", 2)
        return self._call(Followers.__name__, [*rows, *self._end("followers", 2)], 1)

    def _list(self, old: list[WrittenStep], row: Sequence[Step], path: str, depth: int) -> str:
        """Return steps as a list, one a line; ``path`` is the part with the comments at its end."""
        items, left = merged(old, row)
        lines = self._lines(items, depth + 1) + indented(left, depth + 1) + self._end(path, depth + 1)
        if not lines:
            return "[]"
        return "\n".join(["[", *lines, INDENT * depth + "]"])

    def _lines(self, items: Iterable[WrittenStep], depth: int) -> list[str]:
        """Return the lines of steps with their comments."""
        return [line for item in items for line in _commented(self._text(item, depth), item, depth)]

    def _text(self, item: WrittenStep, depth: int) -> str:
        """Return a step's text: on one line where that is short enough and no comment stands inside."""
        inside = item.inside()
        if not item.comments_inside():
            text = self._one_line(item)
            if not inside or len(text) + len(INDENT) * depth < LONGEST_LINE:
                return text
        positional, named = values_of(item.step)
        rows = indented([f"{value}," for value in positional], depth + 1)
        rows += self._lines(inside, depth + 1)
        rows += indented(item.end, depth + 1)
        rows += indented([f"{value}," for value in named], depth + 1)
        return self._call(name_of(item.step), rows, depth)

    def _one_line(self, item: WrittenStep) -> str:
        if item.text:
            # The text stays; only the names that it needs are of interest.
            self.texts.call(item.step)
            return item.text
        return self.texts.call_around(item.step, map(self._one_line, item.inside()))

    def _call(self, name: str, rows: Iterable[str], depth: int) -> str:
        return "\n".join([f"{self.texts.name(name)}(", *rows, f"{INDENT * depth})"])

    def _argument(self, path: str, text: str, depth: int) -> list[str]:
        """Return the lines of an argument with the comments around it."""
        own = self._comments.pop(path, Comments())
        return _commented(text, own, depth) + indented(own.end, depth)

    def _end(self, path: str, depth: int) -> list[str]:
        """Return the comments at the end of a part."""
        own = self._comments[path]
        end = own.end
        own.end = []
        return indented(end, depth)


def _commented(text: str, comments: Comments, depth: int) -> list[str]:
    """Return the lines of a text with the comments before and behind it; one comment fits behind it on its line."""
    line = f"{text},"
    before = list(comments.before)
    if comments.behind:
        line += f"  {comments.behind[0]}"
        before += comments.behind[1:]
    return indented([*before, line], depth)
