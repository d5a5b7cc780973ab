"""Work out values in a program's Python text: numbers and comparisons of numbers, within a budget.

Nothing is executed: the few kinds of expressions that are known are worked out one by one, with small numbers alone.
"""

import ast
import operator
from collections.abc import Callable, Mapping
from math import isfinite
from typing import Any

# What a text may cost: each expression counts once, each step that comes from a loop or a function STEP_COST times.
BUDGET = 100_000
STEP_COST = 50
# Numbers have at most so many bits; durations, levels and counts are far smaller.
_MOST_BITS = 64
_BINARY: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
}
_COMPARED: Mapping[type[ast.cmpop], Callable[[Any, Any], bool]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}
_FUNCTIONS: Mapping[str, Callable[..., Any]] = {"abs": abs, "min": min, "max": max, "round": round}


class UnknownValueError(Exception):
    """An expression has no value that is known while the text is read; ``node`` is the part without one."""

    def __init__(self, node: ast.expr) -> None:
        super().__init__()
        self.node = node


class OverBudgetError(Exception):
    """Working out the text's values takes too long."""


class Reckoner:
    """Works out values; ``names`` are those that are known."""

    def __init__(self) -> None:
        self.names: dict[str, Any] = {}
        self._left = BUDGET

    def spend(self, cost: int) -> None:
        """Take some of the budget. Raises OverBudgetError."""
        self._left -= cost
        if self._left < 0:
            raise OverBudgetError

    def value(self, node: ast.expr) -> Any:
        """Return the value of an expression. Raises UnknownValueError and OverBudgetError."""
        self.spend(1)
        match node:
            case ast.Constant(value=int() | float() | str() | None as value):
                return value
            case ast.Name(id=name) if name in self.names:
                return self.names[name]
            case ast.UnaryOp(op=ast.USub() | ast.UAdd(), operand=operand):
                value = self._number(operand)
                if isinstance(node.op, ast.USub):
                    return -value
                return value
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return not self.value(operand)
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
                return self._combined(node, op, self._number(left), self._number(right))
            case ast.BoolOp(op=ast.And(), values=values):
                return all(self.value(value) for value in values)
            case ast.BoolOp(op=ast.Or(), values=values):
                return any(self.value(value) for value in values)
            case ast.Compare(left=left, ops=ops, comparators=others):
                return self._compared(node, [left, *others], ops)
            case ast.Call(func=ast.Name(id=name), args=[_, *_], keywords=[]) if name in _FUNCTIONS:
                return self._called(node, name, [self._number(argument) for argument in node.args])
        raise UnknownValueError(node)

    def values(self, node: ast.expr) -> list[Any]:
        """Return the values that a loop goes through. Raises as `value` does."""
        match node:
            case ast.Call(func=ast.Name(id="range"), args=arguments, keywords=[]) if 1 <= len(arguments) <= 3:
                numbers = [self.value(argument) for argument in arguments]
                if all(type(number) is int for number in numbers) and (len(numbers) < 3 or numbers[2]):
                    found = range(*numbers)
                    self.spend(min(len(found), BUDGET + 1))
                    return list(found)
            case ast.List(elts=parts) | ast.Tuple(elts=parts):
                return [self.value(part) for part in parts]
        raise UnknownValueError(node)

    def _called(self, node: ast.expr, name: str, values: list[Any]) -> Any:
        try:
            return _FUNCTIONS[name](*values)
        except (TypeError, ValueError, OverflowError):
            raise UnknownValueError(node) from None

    def _number(self, node: ast.expr) -> Any:
        value = self.value(node)
        if not isinstance(value, int | float):
            raise UnknownValueError(node)
        return value

    def _combined(self, node: ast.expr, op: ast.operator, left: Any, right: Any) -> Any:
        if isinstance(op, ast.Pow) and (abs(right) > _MOST_BITS or abs(left) > 1 << _MOST_BITS):
            raise UnknownValueError(node)
        try:
            value = _BINARY[type(op)](left, right)
        except ArithmeticError:
            raise UnknownValueError(node) from None
        is_small = isinstance(value, int) and value.bit_length() <= _MOST_BITS
        if not is_small and not (isinstance(value, float) and isfinite(value)):
            raise UnknownValueError(node)
        return value

    def _compared(self, node: ast.expr, parts: list[ast.expr], ops: list[ast.cmpop]) -> bool:
        values = [self.value(part) for part in parts]
        for left, op, right in zip(values, ops, values[1:], strict=False):
            if type(op) not in _COMPARED:
                raise UnknownValueError(node)
            try:
                if not _COMPARED[type(op)](left, right):
                    return False
            except TypeError:
                raise UnknownValueError(node) from None
        return True
