"""Write a program as Python text, and bring an older text up to date: its comments and everything else stay."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from motorcade.program.blocks import plain
from motorcade.program.model import (
    Followers,
    Program,
    align,
    bare,
    without_ids,
)
from motorcade.program.python_calls import Node, parameters_of
from motorcade.program.python_comments import (
    INDENT,
    LONGEST_LINE,
    Comments,
    comments_of,
    import_of,
    indented,
    nodes,
    with_imports,
)
from motorcade.program.python_functions import functions_text, updated_functions
from motorcade.program.python_reader import VARIABLE, PythonProgram, read_python
from motorcade.program.python_text import name_of, needs_statements, values_of
from motorcade.program.steps import Step


def python_text(program: Program) -> str:
    """Return a program as text that `read_python` and Python itself read.

    It is one call of Program, or functions where the leader decides.
    """
    if needs_statements(program):
        return functions_text(program)
    writer = _Writer(None)
    call = writer.program(program)
    return f"{import_of({name: name for name in writer.used})}\n\n{VARIABLE} = {call}\n"


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
    return with_imports(text, old, writer.used)


@dataclass(slots=True)
class _Item(Comments):
    """A step to write: with its comments, the steps inside it, and its present text where that can stay."""

    step: Step | None = None
    inside: list["_Item"] = field(default_factory=list)
    text: str = ""

    def all_comments(self) -> list[str]:
        """Its comments and those of the steps inside it."""
        return [*self.before, *_comments_in(self.inside), *self.end, *self.behind]

    def has_comments_inside(self) -> bool:
        return bool(self.end or _comments_in(self.inside))


def _comments_in(items: Iterable[_Item]) -> list[str]:
    """Return the comments of items, and of the steps inside them."""
    return [comment for item in items for comment in item.all_comments()]


class _Writer:
    """Writes one program; ``used`` collects the names that its text needs."""

    def __init__(self, old: PythonProgram | None) -> None:
        self.used: set[str] = set()
        self._old = old
        self._nodes: dict[str, Node] = {}
        self._comments: dict[str, Comments] = defaultdict(Comments)
        if old is not None:
            self._nodes = dict(nodes(old.root))
            self._comments = comments_of(old, old.root)

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
            rows += indented(_comments_in(followers), 1)
        if program.profile != parameters_of(Program)[1]["profile"]:
            rows += self._argument("profile", f"profile={program.profile!r}", 1)
        for comments in self._comments.values():
            left += [*comments.before, *comments.behind, *comments.end]
        return self._call(Program.__name__, rows + indented(left, 1), 0)

    def _old_items(self) -> tuple[list[_Item], list[_Item]]:
        """Return the steps of the leader and of the followers in the present text."""
        if self._old is None:
            return [], []
        program = self._old.program
        leader = self._items(program.leader, "leader")
        if program.followers is None:
            return leader, []
        return leader, self._items(program.followers.steps, "followers.steps")

    def _followers(self, followers: Followers, old: list[_Item]) -> str:
        usual = parameters_of(Followers)[1]
        given = {name: getattr(followers, name) for name in usual}
        settings = {name: value for name, value in given.items() if value != usual[name]}
        path = "followers"
        if "followers.steps" in self._nodes:
            path = "followers.steps"
        elif not settings:
            return self._list(old, followers.steps, path, 1)
        rows = self._argument("followers.steps", self._list(old, followers.steps, path, 2), 2)
        for name, value in settings.items():
            rows += self._argument(f"followers.{name}", f"{name}={plain(value)!r}", 2)
        return self._call(Followers.__name__, [*rows, *self._end("followers", 2)], 1)

    def _list(self, old: list[_Item], row: Sequence[Step], path: str, depth: int) -> str:
        """Return steps as a list, one a line; ``path`` is the part with the comments at its end."""
        items, left = _merged(old, row)
        lines = self._lines(items, depth + 1) + indented(left, depth + 1) + self._end(path, depth + 1)
        if not lines:
            return "[]"
        return "\n".join(["[", *lines, INDENT * depth + "]"])

    def _lines(self, items: Iterable[_Item], depth: int) -> list[str]:
        """Return the lines of steps with their comments."""
        return [line for item in items for line in _commented(self._text(item, depth), item, depth)]

    def _text(self, item: _Item, depth: int) -> str:
        """Return a step's text: on one line where that is short enough and no comment stands inside."""
        positional, named, name = self._values(item)
        if not item.has_comments_inside():
            text = self._one_line(item)
            if not item.inside or len(text) + len(INDENT) * depth < LONGEST_LINE:
                return text
        rows = indented([f"{value}," for value in positional], depth + 1)
        rows += self._lines(item.inside, depth + 1)
        rows += indented(item.end, depth + 1)
        rows += indented([f"{value}," for value in named], depth + 1)
        return self._call(name, rows, depth)

    def _one_line(self, item: _Item) -> str:
        if item.text:
            self.used.update(_names_in(item))
            return item.text
        positional, named, name = self._values(item)
        self.used.add(name)
        inside = [self._one_line(step) for step in item.inside]
        return f"{self._called(name)}({', '.join([*positional, *inside, *named])})"

    def _values(self, item: _Item) -> tuple[list[str], list[str], str]:
        """Return a step's values that stand by their position, those that are named, and the step's name."""
        return values_of(item.step)

    def _items(self, row: Sequence[Step], path: str) -> list[_Item]:
        """Return the steps of the present text with their comments."""
        items = []
        for number, step in enumerate(row):
            place = f"{path}[{number}]"
            own = self._comments.pop(place, Comments())
            item = _Item(own.before, own.behind, own.end, step)
            for name, inside in step.lists.items():
                item.inside += self._items(inside, f"{place}.{step.inside_at[name]}")
            if self._old is not None:
                node = self._nodes[place]
                text = self._old.source.text[node.start : node.end]
                # Steps over several lines are written anew.
                if "\n" not in text:
                    item.text = text
            if not item.inside:
                # A comment between the values of a step.
                item.before, item.end = item.before + item.end, []
            items.append(item)
        return items

    def _call(self, name: str, rows: Iterable[str], depth: int) -> str:
        self.used.add(name)
        return "\n".join([f"{self._called(name)}(", *rows, f"{INDENT * depth})"])

    def _called(self, name: str) -> str:
        """Return the name that something of motorcade has in the text."""
        if self._old is None:
            return name
        return self._old.imports.get(name, name)

    def _argument(self, path: str, text: str, depth: int) -> list[str]:
        """Return the lines of an argument with the comments around it."""
        own = self._comments.pop(path, Comments())
        return _commented(text, own, depth) + indented(own.end, depth)

    def _end(self, path: str, depth: int) -> list[str]:
        """Return the comments at the end of a part."""
        own = self._comments[path]
        end, own.end = own.end, []
        return indented(end, depth)


def _merged(old: list[_Item], row: Sequence[Step]) -> tuple[list[_Item], list[str]]:
    """Return the items of a new row, which take over the comments of the old ones, and the comments left at its end.

    The comments of a step that is gone stand before the next one that stayed.
    """
    places = align([item.step for item in old if item.step], row)
    gone = [position for position in range(len(old)) if position not in places]
    items = []
    for step, place in zip(row, places, strict=True):
        if place is None:
            items.append(_Item(step=step, inside=_merged([], step.inside)[0]))
            continue
        before = old[place]
        orphaned = _comments_in(old[position] for position in gone if position < place)
        gone = [position for position in gone if position > place]
        item = _Item([*orphaned, *before.before], before.behind, list(before.end), step)
        item.inside, left = _merged(before.inside, step.inside)
        item.end = left + item.end
        if before.step and without_ids(step) == without_ids(before.step):
            item.text = before.text
        items.append(item)
    return items, _comments_in(old[position] for position in gone)


def _commented(text: str, comments: Comments, depth: int) -> list[str]:
    """Return the lines of a text with the comments before and behind it; one comment fits behind it on its line."""
    line = f"{text},"
    before = list(comments.before)
    if comments.behind:
        line += f"  {comments.behind[0]}"
        before += comments.behind[1:]
    return indented([*before, line], depth)


def _names_in(item: _Item) -> set[str]:
    return {name_of(item.step)}.union(*map(_names_in, item.inside))
