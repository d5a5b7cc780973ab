"""Change one place of a module, as a mistake of somebody who writes it would: a condition, a bound, or an order.

A change is made in the syntax tree of the module, and a module that is changed is compiled in place of its file when it
is imported (`ChangedModule`). Nothing is written to the disk, so children of one process try many changes.
"""

import ast
import sys
from collections.abc import Callable, Iterator
from functools import partial
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import spec_from_loader
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

_OTHER: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
}
# A bound that is as much larger holds nobody up any more.
_FACTOR = 10
_SIMPLE = (ast.Expr, ast.Assign, ast.AugAssign)


class Change(NamedTuple):
    """A change of one place.

    Attributes:
        line: its number.
        kind: ``condition``, ``bound`` or ``order``.
        what: the code before and after; of a constant also the statement in which it stands, since many are alike.
        apply: makes the change in the tree.
        is_of_constant: whether a number or a truth value is another one.
    """

    line: int
    kind: str
    what: str
    apply: Callable[[], None]
    is_of_constant: bool = False


def changes_of(tree: ast.Module) -> Iterator[Change]:
    """Yield all changes of a module, in the order of its lines."""
    found = list(_found(tree))
    within = _statements(tree)
    for change in sorted(found, key=lambda change: (change.line, change.kind, change.what)):
        if change.is_of_constant:
            change = change._replace(what=f"{change.what} in {_brief(within[change.line])}")
        yield change


def _statements(tree: ast.Module) -> dict[int, ast.stmt]:
    """Return by its number the innermost statement of each line."""
    within: dict[int, ast.stmt] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.stmt):
            # Those that stand in others come behind them. Decorators stand before the line of what they decorate.
            first = min(each.lineno for each in (node, *getattr(node, "decorator_list", ())))
            within |= dict.fromkeys(range(first, (node.end_lineno or first) + 1), node)
    return within


def _found(tree: ast.Module) -> Iterator[Change]:
    left_out = set(_annotations(tree))
    for node in ast.walk(tree):
        if node in left_out:
            continue
        if isinstance(node, ast.Compare) and len(node.ops) == 1:
            yield _compared(node)
        for field, value in ast.iter_fields(node):
            if isinstance(value, ast.expr) and value not in left_out:
                yield from _replaced(node, field, value)
            elif isinstance(value, list):
                yield from _in_list(node, field, value, left_out)


def _annotations(tree: ast.Module) -> Iterator[ast.AST]:
    """Yield what no program executes, and what only describes data."""
    for node in ast.walk(tree):
        hints: list[ast.AST | None] = []
        if isinstance(node, ast.AnnAssign):
            hints = [node.annotation]
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            hints = [node.returns]
        elif isinstance(node, ast.arg):
            hints = [node.annotation]
        elif isinstance(node, ast.JoinedStr) or _is_for_types(node):
            hints = [node]
        for hint in hints:
            if hint:
                yield from ast.walk(hint)


def _is_for_types(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"


def _compared(node: ast.Compare) -> Change:
    before, other = ast.unparse(node), _OTHER[type(node.ops[0])]()

    def apply() -> None:
        node.ops = [other]

    after = ast.unparse(ast.Compare(node.left, [other], node.comparators))
    return Change(node.lineno, "condition", f"{before} -> {after}", apply)


def _replaced(node: ast.AST, field: str, value: ast.expr) -> Iterator[Change]:
    for kind, after in _others(value, isinstance(node, ast.If | ast.While | ast.IfExp) and field == "test"):
        yield _replacing(kind, value, after, partial(setattr, node, field, after))


def _in_list(node: ast.AST, field: str, values: list[Any], left_out: set[ast.AST]) -> Iterator[Change]:
    for at, value in enumerate(values):
        if isinstance(value, ast.expr) and value not in left_out:
            for kind, after in _others(value, False):
                yield _replacing(kind, value, after, partial(values.__setitem__, at, after))
        elif isinstance(value, ast.stmt) and value not in left_out:
            if _is_deed(value):
                nothing = ast.copy_location(ast.Pass(), value)
                yield _replacing("order", value, nothing, partial(values.__setitem__, at, nothing))
            following = values[at + 1] if at + 1 < len(values) else None
            if (
                following is not None
                and not isinstance(node, ast.Module | ast.ClassDef)
                and _may_swap(value, following)
            ):
                what = f"{_brief(value)} <-> {_brief(following)}"
                yield Change(value.lineno, "order", what, partial(_swap, values, at))


def _replacing(kind: str, before: ast.AST, after: ast.AST, apply: Callable[[], None]) -> Change:
    what = f"{_brief(before)} -> {_brief(after)}"
    return Change(getattr(before, "lineno", 0), kind, what, apply, isinstance(before, ast.Constant))


def _brief(node: ast.AST) -> str:
    text = " ".join(ast.unparse(node).split())
    return text if len(text) < 120 else text[:117] + "..."


def _swap(values: list[Any], at: int) -> None:
    values[at], values[at + 1] = values[at + 1], values[at]


def _may_swap(first: ast.stmt, second: ast.stmt) -> bool:
    """Whether two statements do something each, and the second one runs also without the first."""
    if not (isinstance(first, _SIMPLE) and isinstance(second, _SIMPLE)):
        return False
    if not all(any(isinstance(node, ast.Call) for node in ast.walk(each)) for each in (first, second)):
        return False
    named = {node.id for node in ast.walk(first) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    return not any(isinstance(node, ast.Name) and node.id in named for node in ast.walk(second))


def _is_deed(node: ast.stmt) -> bool:
    """Whether a statement does something that the code behind it doesn't need for a value."""
    if isinstance(node, ast.Expr):
        return isinstance(node.value, ast.Call | ast.Await)
    return isinstance(node, ast.Raise) and node.exc is not None


def _others(value: ast.expr, is_test: bool) -> Iterator[tuple[str, ast.expr]]:
    """Yield what may stand in the place of an expression, and of which kind that change is."""
    if isinstance(value, ast.BoolOp):
        other = ast.Or() if isinstance(value.op, ast.And) else ast.And()
        yield "condition", ast.copy_location(ast.BoolOp(other, value.values), value)
        for at in range(len(value.values)):
            rest = value.values[:at] + value.values[at + 1 :]
            less = rest[0] if len(rest) == 1 else ast.BoolOp(value.op, rest)
            yield "condition", ast.copy_location(less, value)
    elif isinstance(value, ast.UnaryOp) and isinstance(value.op, ast.Not):
        yield "condition", value.operand
    elif isinstance(value, ast.Constant) and isinstance(value.value, bool):
        yield "condition", ast.copy_location(ast.Constant(not value.value), value)
    elif isinstance(value, ast.Constant) and isinstance(value.value, int | float):
        number = value.value * _FACTOR if value.value > 1 else value.value + 1
        yield "bound", ast.copy_location(ast.Constant(number), value)
    elif is_test and not isinstance(value, ast.Compare):
        yield "condition", ast.copy_location(ast.UnaryOp(ast.Not(), value), value)


def changed(file: Path, number: int) -> tuple[ast.Module, Change]:
    """The tree of a file with its ``number``-th change."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    change = list(changes_of(tree))[number]
    change.apply()
    return ast.fix_missing_locations(tree), change


class ChangedModule(MetaPathFinder, Loader):
    """Import one module from a tree in place of its file."""

    def __init__(self, name: str, file: Path, tree: ast.Module) -> None:
        self._name, self._file = name, file
        self._code = compile(tree, str(file), "exec")

    def install(self) -> None:
        """Let the next import of the module find this one; the caller has forgotten earlier ones."""
        sys.meta_path.insert(0, self)

    def find_spec(self, name: str, path: object, target: object = None) -> ModuleSpec | None:
        if name != self._name:
            return None
        is_package = self._file.name == "__init__.py"
        return spec_from_loader(name, self, origin=str(self._file), is_package=is_package)

    def create_module(self, spec: ModuleSpec) -> None:
        return None

    def exec_module(self, module: ModuleType) -> None:
        module.__file__ = str(self._file)
        exec(self._code, module.__dict__)
