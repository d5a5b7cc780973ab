"""Read a program that is written as functions, ``leader()``, ``followers()`` and others, and never execute them.

A statement becomes a step: ``if``, ``while``, ``for _ in range(4)``, a counter that is set or changed, a call of a step
or of a function of the text. A name is a counter of the car where it is set more than once, changed by ``+=`` and
``-=``, or set to a random number; any other name has one value, which is worked out while the text is read. So are the
turns of a ``for`` whose variable is used, conditions without a sensor or counter, and functions with parameters, whose
steps stand where they are called.
"""

import ast
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

from motorcade.errors import Phrase
from motorcade.program import flow_steps
from motorcade.program.blocks import MOST_DEEP
from motorcade.program.diagnostics import TEXT, Fix
from motorcade.program.flow_steps import DoStep, IfStep
from motorcade.program.python_calls import (
    FLOW,
    RANDOM,
    TELL,
    CallReader,
    Node,
    negated,
)
from motorcade.program.python_values import STEP_COST, UnknownValueError
from motorcade.program.schema import SETTINGS
from motorcade.program.steps import RepeatStep

LEADER = "leader"
FOLLOWERS = "followers"
_WORDS: dict[type[ast.stmt], str] = {ast.Break: "break", ast.Continue: "continue", ast.Return: "return"}


class StepRow(NamedTuple):
    """Where the steps of some statements go.

    Attributes:
        path: the place of the row in the program's document.
        steps: its steps so far.
        around: the part of the text whose parts they are.
        depth: how many statements are around them.
    """

    path: str
    steps: list[Any]
    around: Node
    depth: int = 0

    @property
    def here(self) -> str:
        """The place of the next step."""
        return f"{self.path}[{len(self.steps)}]"

    def inside(self, name: str) -> "StepRow":
        """Begin the row with that name inside of its last step."""
        node = self.around.parts[-1]
        return StepRow(f"{node.path}.{name}", [], node, self.depth + 1)


class StatementReader(CallReader):
    """Reads steps that are statements.

    Attributes:
        definitions: the functions of the text, by their name.
        is_plain: for each of them, whether each of its statements is one step, so that its comments have a place.
    """

    def __init__(self, data: bytes | str) -> None:
        super().__init__(data)
        self.definitions: dict[str, ast.FunctionDef] = {}
        self.is_plain: dict[str, bool] = {}
        # Where the values of names in the text stand.
        self.value_extents: dict[str, tuple[int, int]] = {}
        self._open: list[str] = []
        self._leads = True
        self._function = ""

    def _define(self, statement: ast.FunctionDef) -> None:
        """Take note of a function. Only the followers' settings are parameters with values."""
        name = statement.name
        arguments = statement.args
        if name in self.definitions:
            self._refuse("python-defined-twice", statement, self.source.without_lines(statement), name=name)
        unusual = (arguments.posonlyargs, arguments.vararg, arguments.kwonlyargs, arguments.kwarg)
        is_plain = not any(unusual) and not statement.decorator_list
        if not is_plain or (name == LEADER and arguments.args):
            self._refuse("python-parameters", statement, name=name)
        for argument in arguments.args:
            if argument.arg in names_in(statement.body, ast.Store):
                self._refuse("python-name-is-bound", statement, name=argument.arg)
        self.definitions[name] = statement

    def definition_extent(self, definition: ast.FunctionDef) -> tuple[int, int]:
        """Return the extent of a function, up to the end of its last line."""
        start, end = self.source.extent(definition)
        behind = self.source.text.find("\n", end)
        return start, behind if behind >= 0 else len(self.source.text)

    def _find_counters(self, statements: Iterable[ast.stmt]) -> None:
        """Find the names that the car counts: those that have more than one value."""
        times: Counter[str] = Counter()
        for statement in statements:
            for node in ast.walk(statement):
                match node:
                    case ast.AugAssign(target=ast.Name(id=name)):
                        self.counters.add(name)
                    case ast.Assign(targets=[ast.Name(id=name)], value=value):
                        times[name] += 1
                        if isinstance(value, ast.Call):
                            self.counters.add(name)
        self.counters |= {name for name, count in times.items() if count > 1}

    def _defined(self, root: Node) -> dict[str, Any]:
        """Return the document of all functions; their parts are added to ``root``."""
        document: dict[str, Any] = {"functions": {}, "followers": None}
        asked: set[str] = set()
        for name, definition in self.definitions.items():
            if name == FOLLOWERS or definition.args.args:
                continue
            path = name if name == LEADER else f"functions.{name}"
            steps = self._body(definition, path, root)
            if name == LEADER:
                document[LEADER] = steps
            else:
                document["functions"][name] = steps
        if FOLLOWERS in self.definitions:
            self._leads = False
            document[FOLLOWERS] = self._followers_of(self.definitions[FOLLOWERS], root)
            asked = {
                call.func.id
                for call in ast.walk(self.definitions[FOLLOWERS])
                if isinstance(call, ast.Call) and isinstance(call.func, ast.Name)
            }
        # A function that only the followers use is none of the leader's.
        done = set(_done_in([document.get(LEADER), document["functions"]]))
        for name in asked - done:
            document["functions"].pop(name, None)
        return document

    def _followers_of(self, definition: ast.FunctionDef, root: Node) -> dict[str, Any]:
        settings: dict[str, Any] = {}
        names = [argument.arg for argument in definition.args.args]
        values = definition.args.defaults
        if len(values) < len(names) or not set(names) <= set(SETTINGS):
            self._refuse("python-parameters", definition, name=FOLLOWERS)
        for name, value in zip(names, values, strict=False):
            self.spans[f"{FOLLOWERS}.{name}"] = self.source.span(value)
            settings[name] = self._value(value)
        if settings.get("dwell_seconds", 0) is None:
            del settings["dwell_seconds"]
        return {**settings, "steps": self._body(definition, f"{FOLLOWERS}.steps", root)}

    def _body(self, definition: ast.FunctionDef, path: str, root: Node) -> list[Any]:
        self._function = definition.name
        self._open = [definition.name]
        self.is_plain[definition.name] = True
        node = self._node(path, definition)
        node.start, node.end = self.definition_extent(definition)
        root.parts.append(node)
        self.spans[path] = self.source.first_line_of(definition)
        row = StepRow(path, [], node)
        self._statements(definition.body, row)
        return row.steps

    def _statements(self, body: Iterable[ast.stmt], row: StepRow) -> None:
        """Append the steps of statements to a row."""
        for statement in body:
            self._reckoner.spend(1)
            if row.depth > MOST_DEEP:
                self._refuse("blocks-too-deep", statement, most=MOST_DEEP)
                return
            self._statement(statement, row)

    def _statement(self, statement: ast.stmt, row: StepRow) -> None:
        match statement:
            case ast.Expr(value=ast.Constant(value=str())) | ast.Pass() | ast.Global():
                pass
            case ast.Expr(value=ast.Call(func=ast.Name(id=name)) as call) if name in self.definitions:
                self._own_call(call, row)
            case ast.Expr(value=value):
                row.steps.append(self._called(value, row))
            case ast.If():
                self._if(statement, row)
            case ast.While(test=test, body=body, orelse=[]):
                until = negated(self._condition(test))
                if until is True:
                    return
                content = {} if until is False else {"until": until}
                self._repeat(statement, content, body, row)
            case ast.For(target=ast.Name(id=name), orelse=[]):
                self._for(statement, name, row)
            case ast.Assign(targets=[ast.Name(id=name)], value=value):
                self._assign(statement, name, value, row)
            case ast.AugAssign(target=ast.Name(id=name), op=ast.Add() | ast.Sub(), value=value):
                by = self._count_of(value)
                if isinstance(statement.op, ast.Sub):
                    by = -by
                content = {"counter": name, "by": by}
                self._compound(statement, {"change": content}, row, value, "by")
            case _:
                self._refuse_statement(statement)

    def _compound(
        self,
        statement: ast.stmt,
        document: dict[str, Any],
        row: StepRow,
        value: ast.expr | None = None,
        field: str = "",
    ) -> None:
        """Append a step that a statement is, and take note of where it stands; ``value`` is that of its ``field``."""
        is_counted_repeat = "times" in document.get(RepeatStep.kind, {})
        if not self._leads and not is_counted_repeat:
            self._refuse("followers-cannot-decide", statement)
        self._reckoner.spend(STEP_COST)
        path = row.here
        self.spans[path] = self.source.first_line_of(statement)
        row.around.parts.append(Node(path, *self.source.extent(statement)))
        if value is not None:
            self.spans[f"{path}.{next(iter(document))}.{field}"] = self.source.span(value)
        row.steps.append(document)

    def _repeat(
        self,
        statement: ast.stmt,
        content: dict[str, Any],
        body: Iterable[ast.stmt],
        row: StepRow,
        times: ast.expr | None = None,
    ) -> None:
        """Append a repeat, and read the statements inside it."""
        self._compound(statement, {RepeatStep.kind: content}, row, times, "times")
        inside = row.inside("repeat.steps")
        content["steps"] = inside.steps
        self._statements(body, inside)

    def _refuse_statement(self, statement: ast.stmt) -> None:
        word = _WORDS.get(type(statement))
        if word:
            self._refuse("python-leaves", statement, word=word)
        elif isinstance(statement, ast.For | ast.While):
            self._refuse("python-for", statement)
        else:
            self._refuse("python-inner-statement", statement)

    def _called(self, value: ast.expr, row: StepRow) -> dict[str, Any]:
        """Return the step of a call that stands as a statement."""
        self._reckoner.spend(STEP_COST)
        if isinstance(value, ast.Call) and isinstance(value.func, ast.Name):
            name = self._known_name(value.func.id)
            if name in (TELL, FLOW):
                return self._flow_call(name, value, row)
        return self._step(value, row.here, row.around, row.depth)

    def _flow_call(self, name: str, call: ast.Call, row: StepRow) -> dict[str, Any]:
        if not self._leads:
            self._refuse("followers-cannot-decide", call)
        self._name_of(call)
        path = row.here
        row.around.parts.append(self._node(path, call))
        self._calls[f"{path}.{name}"] = call
        if name == TELL:
            if len(call.args) != 1 or call.keywords:
                self._refuse("python-tell", call)
                return {}
            (told,) = call.args
            self.spans[f"{path}.tell.step"] = self.source.span(told)
            if isinstance(told, ast.Constant):
                return {TELL: {"step": self._value(told)}}
            return {TELL: {"step": self._step(told, f"{path}.tell.step", Node("", 0, 0), 0)}}
        content = {}
        for key, argument, _ in self._arguments(call, flow_steps.FlowStep):
            self.spans[f"{path}.{name}.{key}"] = self.source.span(argument)
            content[key] = self._value(argument)
        return {FLOW: content}

    def _own_call(self, call: ast.Call, row: StepRow) -> None:
        """Read a call of a function of the text: a step, or the function's own steps where it has parameters."""
        name = call.func.id if isinstance(call.func, ast.Name) else ""
        definition = self.definitions[name]
        if name in (LEADER, FOLLOWERS) or name in self._open[1:] or (name in self._open and definition.args.args):
            self._refuse("recursion", call, name=name)
            return
        if self._leads and not definition.args.args:
            if call.args or call.keywords:
                self._refuse("python-arguments", call, name=name, names=Phrase("nothing"))
            row.around.parts.append(self._node(row.here, call))
            row.steps.append({DoStep.kind: name})
            return
        self.is_plain[self._function] = False
        known = dict(self._reckoner.names)
        values = self._bound(call, definition)
        if values is None:
            return
        self._reckoner.names = known | values
        self._open.append(name)
        self._statements(definition.body, row._replace(around=Node("", 0, 0), depth=row.depth + 1))
        self._open.pop()
        self._reckoner.names = known

    def _bound(self, call: ast.Call, definition: ast.FunctionDef) -> dict[str, Any] | None:
        """Return the values of a function's parameters in a call; None, with an error, where they are others."""
        names = [argument.arg for argument in definition.args.args]
        defaults = definition.args.defaults
        values = dict(zip(names[len(names) - len(defaults) :], defaults, strict=True))
        values |= dict(zip(names, call.args, strict=False))
        values |= {keyword.arg: keyword.value for keyword in call.keywords if keyword.arg in names}
        known = {keyword.arg for keyword in call.keywords} <= set(names)
        if len(call.args) > len(names) or not known or set(values) != set(names):
            self._refuse("python-arguments", call, name=definition.name, names=", ".join(names))
            return None
        return {name: self._value(value) for name, value in values.items()}

    def _if(self, statement: ast.If, row: StepRow) -> None:
        condition = self._condition(statement.test)
        if isinstance(condition, bool):
            self.is_plain[self._function] = False
            self._statements(statement.body if condition else statement.orelse, row)
            return
        content = {"when": condition}
        self._compound(statement, {IfStep.kind: content}, row)
        for name, body in (("then", statement.body), ("else", statement.orelse)):
            inside = row.inside(f"if.{name}")
            content[name] = inside.steps
            self._statements(body, inside)

    def _for(self, statement: ast.For, name: str, row: StepRow) -> None:
        """Read a loop: a repeat, or its turns one by one where its variable, ``name``, is used."""
        is_used = name in names_in(statement.body, ast.Load)
        if name in self.counters or (is_used and name in names_in(statement.body, ast.Store)):
            self._refuse("python-name-is-bound", statement, name=name)
            return
        match statement.iter:
            case ast.Call(func=ast.Name(id="range"), args=[most], keywords=[]) if not is_used:
                times = self._value(most)
                if times != 0:
                    self._repeat(statement, {"times": times}, statement.body, row, most)
                return
        try:
            values = self._reckoner.values(statement.iter)
        except UnknownValueError:
            self._refuse("python-for", statement)
            return
        self.is_plain[self._function] = False
        known = dict(self._reckoner.names)
        for value in values:
            self._reckoner.names[name] = value
            self._statements(statement.body, row._replace(around=Node("", 0, 0)))
        self._reckoner.names = known

    def _assign(self, statement: ast.stmt, name: str, value: ast.expr, row: StepRow) -> None:
        if name not in self.counters:
            self._reckoner.names[name] = self._value(value)
            self.is_plain[self._function] = False
            return
        content: dict[str, Any] = {"counter": name}
        field = "to"
        given = value
        match value:
            case ast.Call(func=ast.Name(id=called), args=[most], keywords=[]) if self._known_name(called) == RANDOM:
                self._name_of(value)
                field = "random"
                given = most
            case ast.BinOp(left=ast.Name(id=same), op=ast.Add() | ast.Sub() as op, right=by) if same == name:
                number = self._count_of(by)
                content["by"] = -number if isinstance(op, ast.Sub) else number
                self._compound(statement, {"change": content}, row, by, "by")
                return
        content[field] = self._count_of(given)
        self._compound(statement, {"set": content}, row, given, field)

    def _count_of(self, value: ast.expr) -> Any:
        """Return a number for a counter."""
        number = self._value(value, "python-no-count")
        return number if isinstance(number, int | float) else 0

    def _read_values(self, assignments: Iterable[tuple[str, ast.Assign]]) -> None:
        """Work out the values that names have for the whole text; counters begin at 0."""
        for name, statement in assignments:
            if name not in self.counters:
                self._reckoner.names[name] = self._value(statement.value)
            elif self._value(statement.value) != 0:
                edit = Fix(TEXT, "0", self.source.span(statement.value))
                self._refuse("python-counter-begins", statement, [edit], name=name)


def names_in(body: Iterable[ast.stmt], used: type[ast.expr_context]) -> set[str]:
    """Return the names that statements read (Load), or give a value (Store)."""
    nodes = (node for part in body for node in ast.walk(part))
    return {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, used)}


def _done_in(document: Any) -> Iterator[str]:
    """Yield the functions that steps in a document do."""
    if isinstance(document, list):
        for part in document:
            yield from _done_in(part)
    if isinstance(document, dict):
        for key, part in document.items():
            if key == DoStep.kind and isinstance(part, str):
                yield part
            yield from _done_in(part)
