"""Translate expressions of integers to C99; `scripts.exports.c_functions` has the rules."""

import ast
from collections.abc import Mapping
from typing import NamedTuple, Protocol, TypeGuard

from motorcade.car.senses import Senses

from .c_source import (
    BYTE,
    CAR,
    IMAGE,
    PREFIX,
    SENSES,
    SHORT,
    SIGNED,
    UNSIGNED,
    WORDS,
    Constant,
    CType,
    Source,
    number,
)

# Of a number in the source, which takes the type of what it is used with.
NUMBER = CType("number")
CONDITION = CType("condition")
SMALL = (SHORT, BYTE)
INTEGERS = (UNSIGNED, SIGNED, *SMALL, NUMBER)
_OPERATORS: dict[type[ast.AST], str] = {
    ast.Mult: "*",
    ast.FloorDiv: "/",
    ast.Mod: "%",
    ast.Add: "+",
    ast.Sub: "-",
    ast.LShift: "<<",
    ast.RShift: ">>",
    ast.BitAnd: "&",
    ast.BitXor: "^",
    ast.BitOr: "|",
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
    ast.And: "&&",
    ast.Or: "||",
}
_ASSOCIATIVE = ("+", "*", "&", "|", "^")
# Where C rounds or shifts a negative number in another way than Python.
_UNSIGNED_ONLY = ("/", "%", "<<", ">>", "&", "|", "^")
# What a computation may change, and what it may read: the memory at an index, or at any (None).
Effects = frozenset[tuple[str, int | None]]
NO_EFFECTS: Effects = frozenset()
ANYTHING: Effects = frozenset({("*", None)})


class Part(NamedTuple):
    """An expression in C; ``operator`` is its outermost operator, empty where it needs no parentheses."""

    text: str
    type: CType
    operator: str = ""
    reads: Effects = NO_EFFECTS
    writes: Effects = NO_EFFECTS


class Function(NamedTuple):
    """The declaration of a function in C, and what a call of it may read and change."""

    c_name: str
    parameters: tuple[tuple[str, CType], ...]
    returns: CType
    reads: Effects = NO_EFFECTS
    writes: Effects = NO_EFFECTS

    def declaration(self) -> str:
        """Return it in C, without the semicolon."""
        listed = ", ".join(each.declares(name) for name, each in self.parameters) or "void"
        return f"{self.returns.declares(self.c_name)}({listed})"


def declared_function(source: Source, node: ast.FunctionDef, c_name: str) -> Function:
    """Return a function as its annotations declare it; a call of it may read and change anything."""
    found = node.args
    if found.vararg or found.kwarg or found.kwonlyargs or found.posonlyargs or found.defaults or node.decorator_list:
        raise source.fault(node, "c-outside")
    parameters = tuple((each.arg, source.type_of(each.annotation, each)) for each in found.args if each.arg != "self")
    return Function(c_name, parameters, source.type_of(node.returns, node), ANYTHING, ANYTHING)


class Program(Protocol):
    """What an expression looks up in the program that it is part of."""

    @property
    def sources(self) -> Mapping[str, Source]:
        """The modules by their short names."""

    def function(self, source: Source, name: str, caller: ast.AST, calling: Source) -> Function:
        """Return the function ``name`` of a module, which ``caller`` in the module ``calling`` calls."""

    def constant(self, source: Source, name: str, node: ast.AST, using: Source) -> int:
        """Return the value of a module's constant, which C will need."""


class Expressions:
    """The expressions of one function.

    Args:
        program: all that is translated together.
        source: the function's module.
        types: the parameters and, as they get known, the local variables.

    Attributes:
        reads, writes: what the expressions that were translated so far may read and change.
    """

    def __init__(self, program: Program, source: Source, types: dict[str, CType]) -> None:
        self._program = program
        self._source = source
        self._types = types
        self.reads: Effects = NO_EFFECTS
        self.writes: Effects = NO_EFFECTS

    def _converted(self, value: Part, wanted: CType, node: ast.AST) -> str:
        """Return ``value`` as what ``wanted`` takes. Raises MotorcadeError where it is of another kind."""
        if value.type != wanted:
            if value.type not in INTEGERS or wanted not in INTEGERS:
                raise self._source.fault(node, "c-outside")
            if SIGNED in (value.type, wanted) and value.type != NUMBER:
                raise self._source.fault(node, "c-mixed")
            if value.type == UNSIGNED or (value.type, wanted) == (SHORT, BYTE):
                # The annotation says that it fits.
                return cast(value, wanted).text
        return value.text

    def _value(self, node: ast.expr) -> Part:
        """Translate an expression whose value is used, or that is a statement of its own."""
        part = self._expression(node)
        self.reads |= part.reads
        self.writes |= part.writes
        if part.type == CONDITION:
            raise self._source.fault(node, "c-outside")
        return part

    def _test(self, node: ast.expr) -> Part:
        """Translate what an if, a while or a conditional expression decides by."""
        part = self._expression(node)
        self.reads |= part.reads
        self.writes |= part.writes
        if part.type not in (*INTEGERS, CONDITION):
            raise self._source.fault(node, "c-outside")
        return part

    def _expression(self, node: ast.expr) -> Part:
        if isinstance(node, ast.Constant) and isinstance(node.value, int) and not isinstance(node.value, bool):
            if node.value >= 1 << 32:
                raise self._source.fault(node, "c-not-32-bits")
            return Part(number(node.value), NUMBER)
        if isinstance(node, (ast.Name, ast.Attribute)):
            return self._named(node)
        if isinstance(node, ast.Subscript):
            return self._subscript(node)
        if isinstance(node, ast.Call):
            return self._call(node)
        if isinstance(node, ast.BinOp):
            return self._binary(node)
        if isinstance(node, ast.Compare):
            return self._comparison(node)
        if isinstance(node, ast.BoolOp):
            return self._either(node)
        if isinstance(node, ast.IfExp):
            test, then, other = self._test(node.test), self._value(node.body), self._value(node.orelse)
            kind = self._common(then, other, node)
            texts = [_inside(each, "?", False) for each in (test, then, other)]
            return self._together(f"{texts[0]} ? {texts[1]} : {texts[2]}", kind, "?", (test, then, other))
        raise self._source.fault(node, "c-outside")

    @staticmethod
    def _together(text: str, kind: CType, operator: str, parts: tuple[Part, ...]) -> Part:
        reads = frozenset(each for part in parts for each in part.reads)
        writes = frozenset(each for part in parts for each in part.writes)
        return Part(text, kind, operator, reads, writes)

    def _named(self, node: ast.Name | ast.Attribute) -> Part:
        """Translate a variable, a constant, or an attribute of the car."""
        if isinstance(node, ast.Name) and node.id in self._types:
            return Part(node.id, self._types[node.id])
        found = self._constant(node)
        if found is not None:
            return found
        if self._is_sense(node):
            return Part(f"{ast.unparse(node.value)}->{node.attr}", UNSIGNED)
        if isinstance(node, ast.Attribute) and (method := self._member(node)) is not None and method.decorator_list:
            kind = self._source.type_of(method.returns, method)
            return Part(f"{self._expression(node.value).text}->{node.attr}", kind)
        raise self._source.fault(node, "c-unknown")

    def _is_sense(self, node: ast.Name | ast.Attribute) -> TypeGuard[ast.Attribute]:
        """Return whether ``node`` is a field of the record of senses that a parameter or variable holds."""
        if not isinstance(node, ast.Attribute) or not isinstance(node.value, ast.Name):
            return False
        return self._types.get(node.value.id) == SENSES and node.attr in Senses._fields

    def _origin(self, node: ast.expr) -> tuple[Source, str] | None:
        """Return the translated module that defines a global name, and the name there."""
        module, name = self._source.name, ""
        if isinstance(node, ast.Name):
            module, name = self._source.imported.get(node.id, (module, node.id))
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            module, name = self._source.imported.get(node.value.id, ("", ""))
            name = "" if name else node.attr
        return (self._program.sources[module], name) if module in self._program.sources and name else None

    def _constant(self, node: ast.expr) -> Part | None:
        origin = self._origin(node)
        if origin is None or origin[1] not in origin[0].constants:
            return None
        self._program.constant(*origin, node, self._source)
        return Part(origin[0].c_name(origin[1]), NUMBER)

    def _member(self, node: ast.Attribute) -> ast.FunctionDef | None:
        """Return the declaration of a member of the car that a parameter stands for."""
        if not isinstance(node.value, ast.Name) or self._types.get(node.value.id) != CAR:
            return None
        members = [each for turn in self._source.protocols.values() for each in turn.body]
        return next((each for each in members if isinstance(each, ast.FunctionDef) and each.name == node.attr), None)

    def _method(self, node: ast.Call) -> Function | None:
        """Return the function in C of a method of the car."""
        method = self._member(node.func) if isinstance(node.func, ast.Attribute) else None
        if method is None or method.decorator_list:
            return None
        return declared_function(self._source, method, f"{PREFIX}_car_{method.name}")

    def _subscript(self, node: ast.Subscript) -> Part:
        sequence, index = self._expression(node.value), self._expression(node.slice)
        if not sequence.type.element or index.type not in (UNSIGNED, *SMALL, NUMBER):
            raise self._source.fault(node, "c-outside")
        element = BYTE if sequence.type.element == BYTE.text else UNSIGNED
        if sequence.type == IMAGE:
            return index._replace(text=f"{PREFIX}_image_word({sequence.text}, {index.text})", type=element, operator="")
        place = (sequence.type.text, self._known(node.slice))
        read = Part(f"{sequence.text}[{index.text}]", element, "", index.reads | {place}, index.writes)
        held = self._held(node.slice)
        if isinstance(node.ctx, ast.Load) and sequence.type == WORDS and held != UNSIGNED:
            return cast(read, held)
        return read

    def _defined(self, node: ast.expr) -> Constant | None:
        """Return the Constant that a name stands for; None for another expression."""
        origin = None if isinstance(node, ast.Name) and node.id in self._types else self._origin(node)
        return origin[0].constants.get(origin[1]) if origin else None

    def _known(self, node: ast.expr) -> int | None:
        """Return the value of a number or a constant; None for another expression."""
        if isinstance(node, ast.Constant) and isinstance(node.value, int):
            return node.value
        defined = self._defined(node)
        return defined.value if defined else None

    def _held(self, node: ast.expr) -> CType:
        """Return the type of the integer that a memory holds at an index."""
        defined = self._defined(node)
        return defined.held if defined else UNSIGNED

    def _call(self, node: ast.Call) -> Part:
        called = self._method(node)
        parts = tuple(self._expression(each) for each in node.args)
        if called is not None:
            parts = (self._expression(node.func.value), *parts)  # type: ignore[attr-defined]
            called = called._replace(parameters=(("car", CAR), *called.parameters))
        else:
            origin = self._origin(node.func)
            if origin is None or origin[1] not in origin[0].functions:
                raise self._source.fault(node, "c-unknown")
            called = self._program.function(*origin, node, self._source)
        if node.keywords or len(parts) != len(called.parameters):
            raise self._source.fault(node, "c-outside")
        self._check_order(node, parts)
        listed = ", ".join(
            self._converted(part, kind, node) for part, (_, kind) in zip(parts, called.parameters, strict=True)
        )
        made = self._together(f"{called.c_name}({listed})", called.returns, "", parts)
        return made._replace(reads=made.reads | called.reads, writes=made.writes | called.writes)

    def _binary(self, node: ast.BinOp) -> Part:
        operator = _OPERATORS.get(type(node.op))
        left, right = self._expression(node.left), self._expression(node.right)
        if operator is None:
            raise self._source.fault(node, "c-outside")
        self._check_order(node, (left, right))
        kind = self._common(left, right, node)
        if kind == SIGNED and operator in _UNSIGNED_ONLY:
            raise self._source.fault(node, "c-signed")
        if operator in ("<<", ">>") and (self._known(node.right) or 0) >= 32:
            raise self._source.fault(node, "c-outside")
        bits = self._bits(node, operator)
        if bits is not None:
            return bits
        if operator in ("<<", ">>"):
            # A shift has the type of what is shifted.
            kind = left.type
        # C computes with small types as int, which may have 16 bits. These operators give nothing larger.
        if kind == NUMBER or (
            kind in SMALL and (operator not in ("&", "|", "^", "/", "%", ">>") or left.type == NUMBER)
        ):
            left, kind = cast(left, UNSIGNED), UNSIGNED
        text = f"{_inside(left, operator, False)} {operator} {_inside(right, operator, True)}"
        return self._together(text, kind, operator, (left, right))

    def _bits(self, node: ast.BinOp, operator: str) -> Part | None:
        """Translate ``word >> AT & MASK``, and the highest byte of a word. Return None for anything else.

        A chip of 8 bits shifts a word bit by bit, so whole bytes are skipped first.
        """
        shift, mask = node, 255
        if operator == "&" and isinstance(node.left, ast.BinOp):
            shift, mask = node.left, self._known(node.right) or 256
        at = self._known(shift.right)
        if not isinstance(shift.op, ast.RShift) or at is None or mask > 255 or (shift is node and at < 24):
            return None
        word, by = self._expression(shift.left), self._expression(shift.right)
        if word.type != UNSIGNED:
            return None
        masked = str(mask) if shift is node else self._expression(node.right).text
        return word._replace(text=f"BITS({word.text}, {by.text}, {masked})", type=BYTE, operator="")

    def _comparison(self, node: ast.Compare) -> Part:
        operands = [node.left, *node.comparators]
        parts = [self._expression(each) for each in operands]
        self._check_order(node, tuple(parts))
        texts = []
        for at, each in enumerate(node.ops):
            operator = _OPERATORS.get(type(each))
            # C would compute an operand in the middle twice.
            if operator is None or (at and not isinstance(operands[at], ast.Name)):
                raise self._source.fault(node, "c-outside")
            self._common(parts[at], parts[at + 1], node)
            texts.append(f"{_inside(parts[at], operator, False)} {operator} {_inside(parts[at + 1], operator, True)}")
        return self._together(" && ".join(texts), CONDITION, "==" if len(texts) == 1 else "&&", tuple(parts))

    def _either(self, node: ast.BoolOp) -> Part:
        operator = _OPERATORS[type(node.op)]
        parts = tuple(self._test(each) for each in node.values)
        text = f" {operator} ".join(_inside(each, operator, False) for each in parts)
        return self._together(text, CONDITION, operator, parts)

    def _common(self, left: Part, right: Part, node: ast.AST) -> CType:
        """Return the type of integers in which two operands meet."""
        kinds = {left.type, right.type}
        if not kinds <= set(INTEGERS):
            raise self._source.fault(node, "c-outside")
        if SIGNED in kinds:
            if not kinds <= {SIGNED, NUMBER}:
                raise self._source.fault(node, "c-mixed")
            return SIGNED
        return next(each for each in (UNSIGNED, *SMALL, NUMBER) if each in kinds)

    def _check_order(self, node: ast.AST, parts: tuple[Part, ...]) -> None:
        """Refuse operands of which one changes what another reads: C may compute them in any order."""
        for at, part in enumerate(parts):
            for other in parts[:at] + parts[at + 1 :]:
                if _meet(part.writes, other.reads | other.writes):
                    raise self._source.fault(node, "c-order")


_PRECEDENCE = (("*", "/", "%"), ("+", "-"), ("<<", ">>"), ("<", "<=", ">", ">=", "==", "!="))


def _inside(part: Part, operator: str, is_right: bool) -> str:
    """Return ``part`` as an operand of ``operator``, in parentheses unless every reader knows what binds tighter."""
    inner = part.operator
    if not inner:
        return part.text
    if inner == operator and (operator in _ASSOCIATIVE or (not is_right and operator in ("-", "&&", "||"))):
        return part.text
    arithmetic = _PRECEDENCE[0] + _PRECEDENCE[1]
    if operator in _PRECEDENCE[3] and inner in arithmetic:
        return part.text
    if operator in _PRECEDENCE[1] and (inner in _PRECEDENCE[0] or (not is_right and inner in _PRECEDENCE[1])):
        return part.text
    if operator in ("&&", "||", "?") and inner in (*_PRECEDENCE[3], *arithmetic):
        return part.text
    return f"({part.text})"


def cast(part: Part, kind: CType) -> Part:
    """Return ``part`` with another type."""
    text = f"({part.text})" if part.operator else part.text
    return part._replace(text=f"({kind.text}){text}", type=kind, operator="")


def _meet(one: Effects, other: Effects) -> bool:
    return any(("*" in (a, b) or a == b) and (i is None or j is None or i == j) for a, i in one for b, j in other)
