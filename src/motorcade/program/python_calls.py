"""Read steps and conditions that are written as calls in a program's Python text, and never execute them."""

import ast
import inspect
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cache
from typing import Any

from motorcade.config.check import shown
from motorcade.errors import Phrase
from motorcade.program import conditions, steps
from motorcade.program.blocks import MOST_DEEP
from motorcade.program.diagnostics import (
    TEXT,
    Diagnostic,
    Fix,
    Span,
    error,
)
from motorcade.program.flow_steps import CONDITION_NAMES
from motorcade.program.python_syntax import PythonSource
from motorcade.program.python_values import Reckoner, UnknownValueError
from motorcade.program.steps import (
    COMMON,
    KINDS,
    SIMPLE_KINDS,
    DrivingStep,
    RepeatStep,
    Step,
    TogetherStep,
)

# The kind behind each name of a step.
STEP_NAMES: dict[str, type[Step]] = {name: kind for kind in KINDS.values() for name in kind.names}
_SIMPLE = {name: kind for name, kind in STEP_NAMES.items() if kind in SIMPLE_KINDS}
# What the text may call besides: the steps of a leader that decides, and conditions.
TELL = "tell"
FLOW = "flow"
RANDOM = "random"
PROGRAM = "Program"
FOLLOWERS = "Followers"
NAMES = (PROGRAM, FOLLOWERS, *STEP_NAMES, TELL, FLOW, RANDOM, *CONDITION_NAMES)
# Later errors are often consequences of the first ones.
MOST_ERRORS = 20
_LONGEST_NAME = 40
UNTIL = "until"
UNLESS = "unless"
# What a comparison of a counter asks, and whether it has to hold; the same where the number is on the left.
_COMPARISONS: dict[type[ast.cmpop], tuple[str, bool]] = {
    ast.Eq: ("is", True),
    ast.NotEq: ("is", False),
    ast.Lt: ("below", True),
    ast.GtE: ("below", False),
    ast.Gt: ("above", True),
    ast.LtE: ("above", False),
}
_TURNED = {
    **_COMPARISONS,
    ast.Lt: _COMPARISONS[ast.Gt],
    ast.Gt: _COMPARISONS[ast.Lt],
    ast.LtE: _COMPARISONS[ast.GtE],
    ast.GtE: _COMPARISONS[ast.LtE],
}
_SENSES = {"heard": "voice", "dark": "floor"}
_COMPREHENSIONS = (ast.ListComp, ast.GeneratorExp, ast.SetComp, ast.DictComp)


@dataclass(slots=True)
class Node:
    """A part of the program in its text.

    Attributes:
        path: its place in the program's document: "" for the whole, ``leader``, ``leader[0]``, ``followers.forward``.
        start, end: the numbers of its first character, and of the one behind its last.
        parts: the parts inside it, in the order of the text.
    """

    path: str
    start: int
    end: int
    parts: list["Node"] = field(default_factory=list)


class TooManyErrorsError(Exception):
    """There are so many errors that no more are looked for."""


class CallReader:
    """Reads steps that are calls.

    Attributes:
        source: the text.
        imports: the names imported from motorcade, each with the name that it has in the text.
        counters: the counters of the car, by the names that they have in the text.
        spans: the places of steps and values, by their path.
    """

    def __init__(self, data: bytes | str) -> None:
        self.source = PythonSource(data)
        self.imports: dict[str, str] = {}
        self.spans: dict[str, Span] = {}
        self._errors: list[Diagnostic] = []
        self._used: dict[str, Any] = {}
        self._reckoner = Reckoner()
        self.counters: set[str] = set()
        # The calls whose arguments stand at each path of the document.
        self._calls: dict[str, ast.Call] = {}

    def _row(self, value: ast.expr, path: str, node: Node) -> list[Any]:
        if not isinstance(value, ast.List | ast.Tuple):
            listed = self.source.as_list(value, STEP_NAMES)
            self._refuse_value("python-no-list", value, listed)
            return []
        self.spans[path] = self.source.span(value)
        return self._steps(value.elts, path, node, 0)

    def _steps(self, nodes: Iterable[ast.expr], path: str, around: Node, depth: int) -> list[Any]:
        return [self._step(node, f"{path}[{number}]", around, depth) for number, node in enumerate(nodes)]

    def _step(self, value: ast.expr, path: str, around: Node, depth: int) -> dict[str, Any]:
        if not isinstance(value, ast.Call):
            called = self.source.as_step(value, _SIMPLE)
            self._refuse_value("python-not-a-step", value, called)
            return {}
        name = self._name_of(value)
        if name not in STEP_NAMES:
            if name is not None:
                self._refuse("python-not-a-step", value)
            return {}
        if depth > MOST_DEEP:
            self._refuse("blocks-too-deep", value, most=MOST_DEEP)
            return {}
        node = self._node(path, value)
        around.parts.append(node)
        kind = STEP_NAMES[name]
        self._calls[f"{path}.{kind.kind}"] = value
        content: dict[str, Any] = dict(kind.names[name])
        common: dict[str, Any] = {}
        inside: list[ast.expr] = []
        named = [*COMMON, UNTIL]
        if issubclass(kind, DrivingStep):
            named.append(UNLESS)
        for key, argument, _ in self._arguments(value, getattr(steps, name), inside, named):
            target = content
            at = f"{path}.{kind.kind}.{key}"
            if key in COMMON or key == UNTIL:
                target = common
                at = f"{path}.{key}"
            if key in (UNTIL, UNLESS):
                given = self._condition(argument)
                if isinstance(given, bool):
                    self._refuse("python-no-condition", argument)
            else:
                given = self._value(argument)
            if given is not None:
                target[key] = given
            self.spans[at] = self.source.span(argument)
        if kind is TogetherStep:
            return {kind.kind: self._steps(inside, f"{path}.{kind.kind}", node, depth + 1), **common}
        if kind is RepeatStep:
            if "times" not in content:
                more = self.source.with_argument(value, "times", 2)
                self._refuse("missing-field", value, more, name="times")
            content["steps"] = self._steps(inside, f"{path}.{kind.kind}.steps", node, depth + 1)
        return {kind.kind: content, **common}

    def _arguments(
        self,
        call: ast.Call,
        what: Callable[..., Any],
        inside: list[ast.expr] | None = None,
        named: Sequence[str] = (),
    ) -> Iterator[tuple[str, ast.expr, Any]]:
        """Yield each argument of a call, and of those with a default that are absent none: name, value, place.

        The steps inside a step are appended to ``inside``; ``named`` are arguments that have no position.
        """
        names, defaults, takes_steps = parameters_of(what)
        seen: set[str] = set()
        for number, value in enumerate(call.args):
            if isinstance(value, ast.Starred):
                self._refuse("python-star", value)
            elif number < len(names) and not (takes_steps and isinstance(value, ast.Call)):
                seen.add(names[number])
                yield names[number], value, value
            elif takes_steps and inside is not None:
                inside.append(value)
            else:
                deleted = self.source.without_argument(call, value)
                function = ast.unparse(call.func)
                self._refuse("python-too-many-values", value, deleted, name=function, names=", ".join(names))
        allowed = [*names, *named]
        for keyword in call.keywords:
            if keyword.arg is None:
                self._refuse("python-star", keyword.value)
            elif keyword.arg not in allowed:
                start = self.source.span(keyword)
                span = Span(start.line, start.column, start.line, start.column + len(keyword.arg))
                function = ast.unparse(call.func)
                deleted = self.source.without_argument(call, keyword)
                self._refuse_name("python-no-such-value", span, keyword.arg, allowed, deleted, function=function)
            elif keyword.arg in seen:
                deleted = self.source.without_argument(call, keyword)
                self._refuse("python-given-twice", keyword, deleted, name=keyword.arg)
            else:
                seen.add(keyword.arg)
                yield keyword.arg, keyword.value, keyword
        for name, default in defaults.items():
            if name not in seen and default is not None and inside is not None:
                yield name, ast.copy_location(ast.Constant(default), call.func), call

    def _value(self, node: ast.expr, code: str = "python-no-value") -> Any:
        """Return a value that is known while the text is read; None, with an error of this code, for another one."""
        try:
            return self._reckoner.value(node)
        except UnknownValueError as problem:
            if isinstance(problem.node, ast.Name) and problem.node.id in self.counters:
                self._refuse("python-counted", problem.node, name=problem.node.id)
            else:
                self._refuse(code, node)
        return None

    def _condition(self, node: ast.expr) -> Any:
        """Return the document of a condition; True or False where it is known while the text is read."""
        try:
            return bool(self._reckoner.value(node))
        except UnknownValueError:
            pass
        match node:
            case ast.BoolOp(op=op, values=values):
                return _joined(isinstance(op, ast.Or), [self._condition(value) for value in values])
            case ast.BinOp(left=left, op=ast.BitAnd() | ast.BitOr() as sign, right=right):
                return _joined(isinstance(sign, ast.BitOr), [self._condition(left), self._condition(right)])
            case ast.UnaryOp(op=ast.Not() | ast.Invert(), operand=operand):
                return negated(self._condition(operand))
            case ast.Name(id=name) if name in self.counters:
                return {"not": {"counter": name, "is": 0}}
            case ast.Compare(left=left, ops=ops, comparators=others):
                parts = [left, *others]
                pairs = zip(parts, ops, others, strict=False)
                return _joined(False, [self._comparison(node, *pair) for pair in pairs])
            case ast.Call(func=ast.Name(id=name)) if self._known_name(name) in CONDITION_NAMES:
                return self._asked(node)
        self._refuse("python-no-condition", node)
        return {"person": {}}

    def _comparison(self, node: ast.expr, left: ast.expr, op: ast.cmpop, right: ast.expr) -> Any:
        """Return the document of a counter that is compared with a number, on either side."""
        signs = _COMPARISONS
        if isinstance(right, ast.Name) and right.id in self.counters:
            left, right, signs = right, left, _TURNED
        if not isinstance(left, ast.Name) or left.id not in self.counters or type(op) not in signs:
            self._refuse("python-no-condition", node)
            return {"person": {}}
        comparison, holds = signs[type(op)]
        asked = {"counter": left.id, comparison: self._value(right)}
        return asked if holds else {"not": asked}

    def _asked(self, call: ast.Call) -> dict[str, Any]:
        """Return the document of a call that asks something."""
        name = self._name_of(call) or ""
        values = dict(parameters_of(getattr(conditions, name))[1])
        for key, argument, _ in self._arguments(call, getattr(conditions, name)):
            values[key] = self._value(argument)
        match name:
            case "person":
                return {"person": {}}
            case "counter":
                return {"counter": values.get("name"), str(values.get("comparison")): values.get("value")}
        return {_SENSES.get(name, name): next(iter(values.values()), None)}

    def _known_name(self, own: str) -> str | None:
        """Return the name in motorcade of a name in the text."""
        for name, given in self.imports.items():
            if given == own and name in NAMES:
                return name
        return own if own in NAMES else None

    def _name_of(self, call: ast.Call) -> str | None:
        """Return the name in motorcade of what is called; None, with an error, where it is none."""
        if isinstance(call.func, ast.Name):
            name = self._known_name(call.func.id)
            if name == call.func.id:
                self._used.setdefault(name, call.func)
            if name:
                return name
        self._refuse_name("python-unknown-name", self.source.span(call.func), ast.unparse(call.func), NAMES)
        return None

    def _refuse(self, code: str, node: Any, edits: Iterable[Fix] = (), **details: Any) -> None:
        # A whole loop or function would be red; its first line is enough.
        self._add(error(code, "", **details).at(self.source.first_line_of(node)).with_fixes(*edits))

    def _refuse_value(self, code: str, value: ast.expr, edits: Iterable[Fix]) -> None:
        """Refuse what is no list or no step; of a loop, say so."""
        if isinstance(value, _COMPREHENSIONS):
            code = "python-loop"
        self._refuse(code, value, edits)

    def _refuse_name(
        self, code: str, span: Span, name: str, known: Iterable[str], edits: Sequence[Fix] = (), **details: Any
    ) -> None:
        """Refuse a name, and propose the known one that is most like it; where there is none, ``edits``."""
        # 'print' is not meant to be 'right', which is as like it as the usual 0.6.
        found = get_close_matches(name.rpartition(".")[2][:_LONGEST_NAME], list(known), 1, 0.65)
        hint = Phrase("python-known-names", names=", ".join(known))
        if found:
            hint = Phrase("python-did-you-mean", name=found[0])
            edits = [Fix(TEXT, found[0])]
        self._add(error(code, "", name=str(shown(name))[1:-1], hint=hint, **details).at(span).with_fixes(*edits))

    def _add(self, problem: Diagnostic) -> None:
        # A line of a loop is read once a turn.
        if any((found.code, found.span) == (problem.code, problem.span) for found in self._errors):
            return
        self._errors.append(problem)
        if len(self._errors) >= MOST_ERRORS:
            raise TooManyErrorsError

    def _node(self, path: str, node: Any) -> Node:
        self.spans.setdefault(path, self.source.span(node))
        return Node(path, *self.source.extent(node))


def negated(condition: Any) -> Any:
    """Return the document of the opposite of a condition."""
    if isinstance(condition, bool):
        return not condition
    if set(condition) == {"not"}:
        return condition["not"]
    return {"not": condition}


def _joined(is_any: bool, parts: list[Any]) -> Any:
    """Return the document of conditions of which any, or all, have to hold; some may be known."""
    if is_any in parts:
        return is_any
    left = [part for part in parts if not isinstance(part, bool)]
    if len(left) < 2:
        return left[0] if left else not is_any
    return {"any" if is_any else "all": left}


@cache
def parameters_of(what: Callable[..., Any]) -> tuple[list[str], dict[str, Any], bool]:
    """Return the names that a step's arguments have in order, those with a default, and whether steps follow them."""
    parameters = inspect.signature(what).parameters.values()
    names = []
    defaults = {}
    takes_steps = False
    for parameter in parameters:
        if parameter.kind is parameter.VAR_POSITIONAL:
            takes_steps = True
        if parameter.kind is not parameter.POSITIONAL_OR_KEYWORD:
            continue
        names.append(parameter.name)
        if parameter.default is not parameter.empty:
            defaults[parameter.name] = parameter.default
    return names, defaults, takes_steps
