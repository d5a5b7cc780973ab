"""Make a car's modules shorter and faster for a chip, and join them; they do the same.

MicroPython looks a global name up each time that it is used, and one of another module twice. Therefore each integer
constant takes the place of its name, and goes itself; a shift by 0 and an added 0 go with it. Docstrings, annotations
and what only a type checker reads go too, since a chip keeps names and texts in its memory.

A constant is a name in capitals that its module binds once, outside of functions, to a number made of numbers and
other constants.

A chip needs 6 ms to find a file, and looks for each module under four names. Therefore all are in one file in the end.
"""

import ast
import operator
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import PurePosixPath
from typing import Any

from motorcade.imports import FOR_TYPES

_OPERATORS: dict[type[ast.operator], Callable[[int, int], int]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.FloorDiv: operator.floordiv,
    ast.LShift: operator.lshift,
    ast.RShift: operator.rshift,
    ast.BitOr: operator.or_,
    ast.BitAnd: operator.and_,
    ast.BitXor: operator.xor,
}
# rp2.asm_pio empties the names of a function's module for a moment, in which an interrupt would miss its own.
_ALONE = b"asm_pio"
# A number in decimal digits, which takes less than a name.
_Constants = dict[str, int]


def shortened(files: Mapping[str, bytes], folder: str) -> dict[str, bytes]:
    """Return ``files`` (path and bytes) with each module under ``folder`` shortened.

    Args:
        files: all modules of a program: another that imports a constant of theirs would not find it.
        folder: the one that is searched for modules.
    """
    modules = {
        _dotted(path, folder): _Module(ast.parse(data), path)
        for path, data in files.items()
        if path.startswith(f"{folder}/") and path.endswith(".py")
    }
    for module in modules.values():
        module.read(modules)
    for module in modules.values():
        # Put numbers in the place of names, and leave out what a chip doesn't need.
        _Shortening(module, modules).visit(module.tree)
    taken = {name for module in modules.values() for name in module.taken()}
    found = dict(files)
    for name, module in modules.items():
        module.leave_out_unused(name, taken)
        found[module.path] = _text(module.tree)
    return found


def joined(files: Mapping[str, bytes], folder: str, main: str) -> dict[str, bytes]:
    """Return ``files`` (path and bytes) with the modules under ``folder`` joined in the one at the path ``main``.

    Its own names stay. The modules import each other in no circle, have no two classes of one name and no ``global``.
    """
    others = dict(files)
    trees = {}
    for path, data in files.items():
        if path.startswith(f"{folder}/") and path.endswith(".py") and _ALONE not in data:
            trees[_dotted(path, folder)] = ast.parse(others.pop(path))
    join = _Join(trees, _dotted(main, folder))
    for name in trees:
        join.add(name)
    return {main: _text(ast.Module(join.body, [])), **others}


class _Join:
    """The module that others become; ``names`` says what each name of an added one is called there."""

    def __init__(self, trees: dict[str, ast.Module], main: str) -> None:
        self.trees = trees
        self.names: dict[str, dict[str, str]] = {}
        self.body: list[ast.stmt] = []
        self._main = main

    def add(self, name: str) -> None:
        """Add a module, after those that it imports."""
        if name in self.names:
            return
        own = self.names[name] = {}
        body = self.trees[name].body
        for statement in body:
            match statement:
                case ast.FunctionDef(name=function):
                    bound = [function]
                case ast.ClassDef():
                    # Each has a name of its own, which messages show.
                    bound = []
                case _:
                    bound = _bound(statement)
            if name != self._main:
                own |= {old: f"{old}_{len(self.names)}" for old in bound}
        renaming = _Renaming(self, own)
        for statement in body:
            if isinstance(statement, ast.FunctionDef):
                statement.name = own.get(statement.name, statement.name)
            self.body.append(renaming.visit(statement))


class _Renaming(ast.NodeTransformer):
    """Gives the names in a module those that they have in the join."""

    def __init__(self, join: _Join, own: dict[str, str]) -> None:
        self._join = join
        self._own = own
        self._modules: dict[str, str] = {}

    def visit_ImportFrom(self, node: ast.ImportFrom) -> ast.stmt:
        for alias in node.names:
            name = alias.asname or alias.name
            dotted = f"{node.module}.{alias.name}"
            if dotted in self._join.trees:
                self._join.add(dotted)
                self._modules[name] = dotted
            elif node.module in self._join.trees:
                self._join.add(node.module)
                self._own[name] = self._join.names[node.module].get(alias.name, alias.name)
            else:
                return node
        return ast.Pass()

    def visit_Name(self, node: ast.Name) -> ast.expr:
        node.id = self._own.get(node.id, node.id)
        return node

    def visit_arg(self, node: ast.arg) -> ast.arg:
        node.arg = self._own.get(node.arg, node.arg)
        return node

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        if isinstance(node.value, ast.Name) and node.value.id in self._modules:
            return ast.Name(self._join.names[self._modules[node.value.id]].get(node.attr, node.attr))
        return self.generic_visit(node)


class _Module:
    """A module, and which of its names mean a number or another module.

    Attributes:
        constants: those that it defines.
        numbers: these, and those that it imports by their names.
        others: the dotted name of each module that a name means.
    """

    def __init__(self, tree: ast.Module, path: str) -> None:
        self.tree = tree
        self.path = path
        self.constants: _Constants = {}
        self.numbers: _Constants = {}
        self.others: dict[str, str] = {}
        self._bound = Counter(_bound(tree))
        self._is_read = False

    def read(self, modules: "Mapping[str, _Module]") -> None:
        """Find what its names mean; the modules that it imports come first."""
        if self._is_read:
            return
        self._is_read = True
        for statement in self.tree.body:
            if isinstance(statement, ast.ImportFrom):
                self._import(statement, modules)
            target = _target(statement)
            if target is None or not target.isupper() or self._bound[target] > 1:
                continue
            number = self._number(statement.value, modules)  # type: ignore[attr-defined]
            if number is not None:
                self.constants[target] = self.numbers[target] = number

    def _import(self, statement: ast.ImportFrom, modules: "Mapping[str, _Module]") -> None:
        for alias in statement.names:
            name = alias.asname or alias.name
            if self._bound[name]:
                # A function has its own of this name.
                continue
            dotted = f"{statement.module}.{alias.name}"
            source = modules.get(str(statement.module))
            if dotted in modules:
                modules[dotted].read(modules)
                self.others[name] = dotted
            elif source:
                source.read(modules)
                if alias.name in source.constants:
                    self.numbers[name] = source.constants[alias.name]

    def _number(self, node: ast.expr | None, modules: "Mapping[str, _Module]") -> int | None:
        """The value of an expression; None where it is no number made of numbers."""
        match node:
            case ast.Constant(value=int() as value) if not isinstance(value, bool):
                return value
            case ast.Name(id=name):
                return self.numbers.get(name)
            case ast.Attribute(value=ast.Name(id=name), attr=attribute) if name in self.others:
                return modules[self.others[name]].constants.get(attribute)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                number = self._number(operand, modules)
                return None if number is None else -number
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
                numbers = self._number(left, modules), self._number(right, modules)
                if None not in numbers:
                    return _OPERATORS[type(op)](*numbers)  # type: ignore[arg-type]
        return None

    def taken(self) -> set[str]:
        """What it takes from other modules: dotted names that it imports, and names of attributes."""
        names = set()
        for node in ast.walk(self.tree):
            match node:
                case ast.ImportFrom():
                    names |= {f"{node.module}.{alias.name}" for alias in node.names}
                case ast.Attribute(attr=name):
                    names.add(name)
        return names

    def leave_out_unused(self, own: str, taken: set[str]) -> None:
        """Leave out constants, unless another module takes them."""
        gone = {name for name in self.constants if name not in taken and f"{own}.{name}" not in taken}
        self.tree.body = [statement for statement in self.tree.body if _target(statement) not in gone]


class _Shortening(ast.NodeTransformer):
    """Changes the tree of one module."""

    def __init__(self, module: _Module, modules: Mapping[str, _Module]) -> None:
        self._module = module
        self._modules = modules

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.AST:
        self.generic_visit(node)
        node.body = node.body or [ast.Pass()]
        return node

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        node.returns = None
        self.generic_visit(node)
        node.body = node.body or [ast.Pass()]
        return node

    def visit_Expr(self, node: ast.Expr) -> ast.AST | None:
        if isinstance(node.value, ast.Constant):
            return None
        return self.generic_visit(node)

    def visit_arg(self, node: ast.arg) -> ast.AST:
        node.annotation = None
        return node

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST | None:
        if node.value is None:
            return None
        return self.visit_Assign(ast.copy_location(ast.Assign([node.target], node.value), node))

    def visit_Assign(self, node: ast.Assign) -> ast.AST | None:
        if _target(node) in FOR_TYPES:
            return None
        return self.generic_visit(node)

    def visit_If(self, node: ast.If) -> Any:
        if isinstance(node.test, ast.Name) and node.test.id in FOR_TYPES:
            return [self.visit(statement) for statement in node.orelse]
        return self.generic_visit(node)

    def visit_ImportFrom(self, node: ast.ImportFrom) -> ast.AST | None:
        node.names = [alias for alias in node.names if (alias.asname or alias.name) not in self._module.numbers]
        return node if node.names else None

    def visit_Name(self, node: ast.Name) -> ast.AST:
        return self._replaced(node)

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        replaced = self._replaced(node)
        return self.generic_visit(node) if replaced is node else replaced

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        self.generic_visit(node)
        match node:
            case ast.BinOp(op=ast.Add(), left=ast.Constant(value=0), right=other):
                return other
            case ast.BinOp(op=ast.Add() | ast.RShift(), left=other, right=ast.Constant(value=0)):
                return other
        return node

    def _replaced(self, node: ast.Name | ast.Attribute) -> ast.expr:
        if not isinstance(node.ctx, ast.Load):
            return node
        number = self._module._number(node, self._modules)
        if number is None:
            return node
        if number < 0:
            return ast.UnaryOp(ast.USub(), ast.Constant(-number))
        return ast.Constant(number)


def _dotted(path: str, folder: str) -> str:
    parts = PurePosixPath(path).relative_to(folder).with_suffix("").parts
    if parts[-1] == "__init__":
        parts = parts[:-1]
    return ".".join(parts)


def _text(tree: ast.Module) -> bytes:
    for node in ast.walk(tree):
        match node:
            case ast.Assign(targets=[ast.Tuple()], value=ast.Tuple(elts=[_, _, *_] as parts)):
                # With brackets around ``c, d`` in ``a, b = c, d`` MicroPython makes a tuple.
                node.value = ast.Name(", ".join(map(ast.unparse, parts)))
    return ast.unparse(tree).encode()


def _target(statement: ast.stmt) -> str | None:
    """The name that a statement binds, and nothing else."""
    match statement:
        case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
            return name
    return None


def _bound(tree: ast.AST) -> list[str]:
    """Each name as often as it is bound anywhere, also in functions and as an argument."""
    names = []
    for node in ast.walk(tree):
        match node:
            case ast.Name(id=name, ctx=ast.Store()) | ast.arg(arg=name):
                names.append(name)
            case ast.Global(names=declared):
                names += declared
    return names
