"""Translate functions of integers to C99: the Python that a car's brain is written in, and nothing else.

The type of a parameter comes from its annotation: ``int`` is 0 to 2^32 - 1 and wraps there, ``int32`` may be negative,
and the two don't mix. A local variable without an annotation has the type of what is first assigned to it. What has no
counterpart in C with the same meaning is refused with file and line. docs/adr/0005 has the reasons.
"""

import ast

from .c_expressions import ANYTHING, NUMBER, SMALL, Expressions, Function, cast, declared_function
from .c_source import BYTES, NOTHING, SIGNED, UNSIGNED, WORDS, Source, in_comment

_INDENT = "    "
# The words of C and C++ that Python doesn't reserve, too.
_RESERVED = """
asm auto bool case catch char const default delete do double enum explicit extern false float friend goto inline int
int32_t long mutable namespace new operator private protected public register restrict short signed sizeof static struct
switch template this throw true typedef typename uint32_t uint8_t union unsigned using virtual void volatile
"""


class Program:
    """All that is translated together.

    Args:
        sources: the modules, in the order in which C gets them.
        supplied: the names of the modules whose functions C gets by other means.

    Attributes:
        bodies: the definition of each translated function, by (module, name).
        constants: the (module, name) of all constants that translated functions use.
    """

    def __init__(self, sources: tuple[Source, ...], supplied: frozenset[str] = frozenset()) -> None:
        self.sources = {source.name: source for source in sources}
        self.bodies: dict[tuple[str, str], list[str]] = {}
        self.constants: set[tuple[str, str]] = set()
        self._supplied = supplied
        self._functions: dict[tuple[str, str], Function | None] = {}

    def function(self, source: Source, name: str, caller: ast.AST, calling: Source) -> Function:
        """Return the function ``name`` of a module; translate it first where that is still to be done."""
        key = (source.name, name)
        if key not in self._functions:
            self._functions[key] = None
            self._functions[key] = self._translated(source, source.functions[name])
        found = self._functions[key]
        if found is None:
            raise calling.fault(caller, "c-recursion")
        return found

    def _translated(self, source: Source, node: ast.FunctionDef) -> Function:
        declared = declared_function(source, node, source.c_name(node.name))
        if source.name in self._supplied:
            return declared
        body = _Body(self, source, node, declared)
        self.bodies[source.name, node.name] = body.lines()
        return declared._replace(reads=body.reads, writes=body.writes)

    def constant(self, source: Source, name: str, node: ast.AST, using: Source) -> int:
        """Return the value of a module's constant, which C will need."""
        value = source.constants[name].value
        if not 0 <= value < 1 << 32:
            raise using.fault(node, "c-not-32-bits")
        self.constants.add((source.name, name))
        return value


def comment(lines: list[str], indent: str = "") -> list[str]:
    """Return a comment in C."""
    if len(lines) < 2:
        return [f"{indent}/* {line} */" for line in lines]
    return [f"{indent}/* {lines[0]}", *(f"{indent} * {line}".rstrip() for line in lines[1:]), f"{indent} */"]


def documented(node: ast.FunctionDef) -> list[str]:
    """Return the docstring of a function as a comment in C."""
    return comment(in_comment(ast.get_docstring(node) or "").replace("``", "`").splitlines())


class _Body(Expressions):
    """The translation of one function's body."""

    def __init__(self, program: Program, source: Source, node: ast.FunctionDef, declared: Function) -> None:
        super().__init__(program, source, dict(declared.parameters))
        self._node = node
        self._declared = declared
        self._names = [each.id for each in ast.walk(node) if isinstance(each, ast.Name)]
        self._hoisted: list[str] = []
        self._annotated = {name for name, _ in declared.parameters}

    def lines(self) -> list[str]:
        """Return the definition, line by line."""
        for name, _ in self._declared.parameters:
            self._check_name(name, self._node)
        body = self._block(self._node.body, _INDENT)
        if self._declared.returns != NOTHING and not _always_returns(self._node.body):
            raise self._source.fault(self._node, "c-no-return")
        unused = [f"{_INDENT}(void){name};" for name, _ in self._declared.parameters if name not in self._names]
        return [self._declared.declaration(), "{", *self._hoisted, *unused, *body, "}"]

    def _check_name(self, name: str, node: ast.AST) -> None:
        if name in _RESERVED.split():
            raise self._source.fault(node, "c-reserved", name=name)

    # Statements

    def _block(self, statements: list[ast.stmt], indent: str) -> list[str]:
        lines: list[str] = []
        for at, each in enumerate(statements):
            if (
                isinstance(each, ast.Expr)
                and isinstance(each.value, ast.Constant)
                and isinstance(each.value.value, str)
            ):
                continue
            lines += comment(self._source.comment_above(each), indent)
            lines += self._statement(each, statements[at:], indent)
        return lines

    def _statement(self, node: ast.stmt, rest: list[ast.stmt], indent: str) -> list[str]:
        if isinstance(node, (ast.Assign, ast.AnnAssign)):
            return self._assignment(node, rest, indent)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            return [f"{indent}{self._value(node.value).text};"]
        if isinstance(node, ast.Return):
            return self._return(node, indent)
        if isinstance(node, ast.If):
            return self._if(node, indent)
        if isinstance(node, ast.While) and not node.orelse:
            return [
                f"{indent}while ({self._test(node.test).text}) {{",
                *self._block(node.body, indent + _INDENT),
                f"{indent}}}",
            ]
        if isinstance(node, ast.For) and isinstance(node.target, ast.Name) and not node.orelse:
            return self._for(node, node.target.id, indent)
        raise self._source.fault(node, "c-outside")

    def _assignment(self, node: ast.Assign | ast.AnnAssign, rest: list[ast.stmt], indent: str) -> list[str]:
        target = node.target if isinstance(node, ast.AnnAssign) else node.targets[0]
        if node.value is None or (isinstance(node, ast.Assign) and len(node.targets) > 1):
            raise self._source.fault(node, "c-outside")
        value = self._value(node.value)
        if isinstance(target, ast.Subscript) and isinstance(node, ast.Assign):
            place = self._subscript(target)
            if self._expression(target.value).type not in (WORDS, BYTES):
                raise self._source.fault(node, "c-outside")
            self.writes |= place.reads
            return [f"{indent}{place.text} = {self._converted(value, place.type, node)};"]
        if not isinstance(target, ast.Name):
            raise self._source.fault(node, "c-outside")
        name = target.id
        if isinstance(node, ast.AnnAssign):
            wanted = self._source.type_of(node.annotation, node)
            self._annotated.add(name)
            if value.type != NUMBER and SIGNED in (value.type, wanted) and value.type != wanted:
                # The annotation asks for it.
                value = cast(value, wanted)
        else:
            wanted = self._types.get(name) or (UNSIGNED if value.type == NUMBER else value.type)
        text = self._converted(value, wanted, node)
        if name in self._types:
            if self._types[name] != wanted:
                raise self._source.fault(node, "c-mixed")
            if wanted in SMALL and value.type not in (wanted, NUMBER) and name not in self._annotated:
                raise self._source.fault(node, "c-wider")
            return [f"{indent}{name} = {text};"]
        self._check_name(name, node)
        if wanted == NOTHING:
            raise self._source.fault(node, "c-outside")
        self._types[name] = wanted
        if self._is_only_in(name, rest):
            return [f"{indent}{wanted.declares(name)} = {text};"]
        self._hoisted.append(f"{_INDENT}{wanted.declares(name)};")
        return [f"{indent}{name} = {text};"]

    def _is_only_in(self, name: str, statements: list[ast.stmt]) -> bool:
        here = [each for statement in statements for each in ast.walk(statement) if isinstance(each, ast.Name)]
        return self._names.count(name) == [each.id for each in here].count(name)

    def _return(self, node: ast.Return, indent: str) -> list[str]:
        if node.value is None:
            if self._declared.returns != NOTHING:
                raise self._source.fault(node, "c-no-return")
            return [f"{indent}return;"]
        value = self._value(node.value)
        if self._declared.returns == NOTHING and value.type == NOTHING:
            return [f"{indent}{value.text};", f"{indent}return;"]
        return [f"{indent}return {self._converted(value, self._declared.returns, node)};"]

    def _if(self, node: ast.If, indent: str) -> list[str]:
        lines = [f"{indent}if ({self._test(node.test).text}) {{", *self._block(node.body, indent + _INDENT)]
        if len(node.orelse) == 1 and isinstance(node.orelse[0], ast.If):
            nested = self._if(node.orelse[0], indent)
            return [*lines, f"{indent}}} else {nested[0].lstrip()}", *nested[1:]]
        if node.orelse:
            lines += [f"{indent}}} else {{", *self._block(node.orelse, indent + _INDENT)]
        return [*lines, f"{indent}}}"]

    def _for(self, node: ast.For, name: str, indent: str) -> list[str]:
        call = node.iter
        assigned = [
            each.id for each in ast.walk(node) if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store)
        ]
        if not isinstance(call, ast.Call) or not self._is_only_in(name, [node]) or assigned.count(name) > 1:
            raise self._source.fault(node, "c-outside")
        self._check_name(name, node)
        self._types[name] = UNSIGNED
        if isinstance(call.func, ast.Name) and call.func.id == "range" and len(call.args) == 1 and not call.keywords:
            end = self._value(call.args[0])
            text = self._converted(end, UNSIGNED, node)
            lines = []
            if end.type != NUMBER or end.operator:
                # Python computes it once, before the loop.
                lines = [f"{indent}const uint32_t {name}_end = {text};"]
                text = f"{name}_end"
            lines.append(f"{indent}for (uint32_t {name} = 0; {name} < {text}; {name}++) {{")
        else:
            method = self._method(call)
            if method is None or call.args:
                raise self._source.fault(node, "c-outside")
            self.reads |= ANYTHING
            self.writes |= ANYTHING
            # A compiler that can't see that the method sets it would warn.
            lines = [f"{indent}uint32_t {name} = 0;"]
            lines.append(f"{indent}while ({method.c_name}({ast.unparse(call.func).partition('.')[0]}, &{name})) {{")
        lines += self._block(node.body, indent + _INDENT)
        del self._types[name]
        return [*lines, f"{indent}}}"]


def _always_returns(statements: list[ast.stmt]) -> bool:
    last = statements[-1]
    if isinstance(last, ast.If):
        return bool(last.orelse) and _always_returns(last.body) and _always_returns(last.orelse)
    return isinstance(last, ast.Return)
