"""Read a program from Python text without executing it.

The text may hold what Motorcade's own examples hold: a docstring, comments, ``from motorcade import ...`` and one
``program = Program(...)`` whose steps and values are written out. What is done with the program, by calls such as
``program.save(...)`` and ``show(program)`` and in a block ``if __name__ == "__main__":``, is not read. Everything else
is an error at its line. Names, their arguments and their defaults come from `motorcade.program.steps` and
`motorcade.program.model`; values are checked against the schema of project files.
"""

import ast
import inspect
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any

from motorcade.config.check import shown
from motorcade.errors import Phrase
from motorcade.program import python_syntax as fixes
from motorcade.program import steps
from motorcade.program.blocks import MOST_DEEP
from motorcade.program.diagnostics import TEXT, Diagnostic, Fix, ProgramError, Span, error, warning
from motorcade.program.model import Followers, Program, program_from_dict
from motorcade.program.python_syntax import PythonSource
from motorcade.program.schema import FORMAT
from motorcade.program.steps import COMMON, KINDS, SIMPLE_KINDS, RepeatStep, Step, TogetherStep

# The kind behind each name of a step.
STEP_NAMES: dict[str, type[Step]] = {name: kind for kind in KINDS.values() for name in kind.names}
_SIMPLE = {name: kind for name, kind in STEP_NAMES.items() if kind in SIMPLE_KINDS}
_NAMES = (Program.__name__, Followers.__name__, *STEP_NAMES)
# The variable that holds the program.
VARIABLE = "program"
# Later errors are often consequences of the first ones.
_MOST_ERRORS = 20
_LONGEST_NAME = 40
_LOOPS = (ast.For, ast.AsyncFor, ast.While, ast.ListComp, ast.GeneratorExp, ast.SetComp, ast.DictComp)
# Statements that have no place in the text; of all others, one sentence says so.
_STATEMENTS: tuple[tuple[tuple[type[ast.AST], ...], str], ...] = (
    (_LOOPS, "python-loop"),
    ((ast.Import, ast.ImportFrom), "python-import"),
    ((ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef), "python-function"),
    ((ast.Assign, ast.AnnAssign, ast.AugAssign), "python-other-variable"),
)


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


class _TooManyErrorsError(Exception):
    pass


def read_python(data: bytes | str) -> "PythonProgram":
    """Return the program in Python text. Raises ProgramError; its diagnostics name lines and columns."""
    return PythonProgram(data)


class PythonProgram:
    """A program that is read from Python text.

    Attributes:
        source: the text.
        program: what it says.
        root: where its parts stand.
        imports: the names imported from motorcade, each with the name that it has in the text.
        imported_at: the last import of them; None where there is none.
        spans: the places of steps and values, by their path.
        diagnostics: warnings.
    """

    def __init__(self, data: bytes | str) -> None:
        self.source = PythonSource(data)
        self.imports: dict[str, str] = {}
        self.imported_at: ast.ImportFrom | None = None
        self.spans: dict[str, Span] = {}
        self._errors: list[Diagnostic] = []
        self._used: dict[str, Any] = {}
        # The calls whose arguments stand at each path of the document.
        self._calls: dict[str, ast.Call] = {}
        self.root, document = self._read()
        try:
            self.program = program_from_dict(document)
        except ProgramError as problem:
            raise ProgramError(list(map(self._in_text, problem.diagnostics))[:_MOST_ERRORS]) from None
        self.diagnostics = tuple(self._warnings())

    def located(self, diagnostics: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
        """Return diagnostics of this program with their places in the text."""
        return tuple(problem.at(self._span_of(problem.path)) for problem in diagnostics)

    def _span_of(self, path: str) -> Span | None:
        """Return the place of ``path``, or else of the innermost part around it that has one."""
        while path and path not in self.spans:
            path = path[: max(path.rfind("."), path.rfind("["), 0)]
        return self.spans.get(path)

    def _read(self) -> tuple[Node, dict[str, Any]]:
        """Return where the program's parts stand, and its document as in a project file. Raises ProgramError."""
        with suppress(_TooManyErrorsError):
            call = self._program_call()
            read = call and self._document_of(call)
            if read and not self._errors:
                return read
        raise ProgramError(sorted(self._errors, key=lambda problem: problem.span or (0,)))

    def _in_text(self, diagnostic: Diagnostic) -> Diagnostic:
        """Return a diagnostic of the document with its place in the text, and with edits of the text that fix it."""
        path, found = diagnostic.path, []
        for fix in diagnostic.fixes:
            at = path
            if diagnostic.code == "missing-field":
                at = f"{path}.{fix.field}"
            if at in self.spans:
                found.append(Fix(TEXT, fixes.as_text(fix.value), self.spans[at]))
            elif path in self._calls:
                found += fixes.with_argument(self.source, self._calls[path], fix.field, fix.value)
        if diagnostic.code == "missing-field" and not diagnostic.fixes and path in self._calls:
            # The only values without a first one are lists of steps.
            found = fixes.with_argument(self.source, self._calls[path], diagnostic.details["name"], [])
        return diagnostic.at(self._span_of(path)).with_fixes(*found)

    def _warnings(self) -> Iterator[Diagnostic]:
        """Yield a warning for each name that isn't imported, at its first use."""
        missing = [name for name in self._used if name not in self.imports]
        if not missing:
            return
        more = fixes.with_imports(self.source, self.imported_at, sorted(missing))
        for name in missing:
            span = self.source.span(self._used[name])
            yield warning("python-not-imported", "", name=name).at(span).with_fixes(*more)

    def _program_call(self) -> ast.Call | None:
        """Return the call of Program, the only one among the statements; None, with an error, where there is none."""
        found: ast.Call | None = None
        for statement in self.source.tree.body:
            match statement:
                case ast.Expr(value=ast.Constant(value=str())):
                    pass
                case ast.ImportFrom(module="motorcade", level=0):
                    self._import(statement)
                case ast.If() if ast.unparse(statement.test) == "__name__ == '__main__'":
                    pass
                case ast.Assign(targets=[ast.Name(id="program")], value=ast.Call() as call):
                    if found:
                        deleted = fixes.without_lines(self.source, statement)
                        self._refuse("python-second-program", statement, deleted)
                    found = call
                case ast.Expr(value=ast.Call(func=func)) if found and self._uses_the_program(func):
                    pass
                case _:
                    codes = [code for kinds, code in _STATEMENTS if isinstance(statement, kinds)]
                    code = (codes or ["python-statement"])[0]
                    edits = fixes.right_statement(self.source, statement, VARIABLE)
                    self._refuse(code, statement, edits, name=VARIABLE)
        if not found and not self._errors:
            self._add(error("python-no-program", "").at(Span(1, 1, 1, 2)))
        return found

    def _uses_the_program(self, function: ast.expr) -> bool:
        """Whether a call is one of the program's own, such as save, or of something else that motorcade offers."""
        if isinstance(function, ast.Attribute):
            return isinstance(function.value, ast.Name) and function.value.id == VARIABLE
        names = [name for name, own in self.imports.items() if own == getattr(function, "id", None)]
        return bool(names) and names[0] not in _NAMES

    def _import(self, statement: ast.ImportFrom) -> None:
        self.imported_at = statement
        for alias in statement.names:
            if alias.name == "*":
                self.imports |= {name: name for name in _NAMES}
            else:
                self.imports[alias.name] = alias.asname or alias.name

    def _document_of(self, call: ast.Call) -> tuple[Node, dict[str, Any]] | None:
        """Return where the parts of a call of Program stand, and its document; None, with an error, of another call."""
        name = self._name_of(call)
        if name != Program.__name__:
            if name is not None:
                self._refuse("python-no-program", call)
            return None
        root = self._node("", call)
        return root, {"format": FORMAT, **self._values(call, Program, root)}

    def _values(self, call: ast.Call, what: Callable[..., Any], node: Node) -> dict[str, Any]:
        """Return the arguments of a call of Program or Followers by name; their parts are added to its ``node``."""
        self._calls[node.path] = call
        values: dict[str, Any] = {}
        for name, value, around in self._arguments(call, what):
            part = self._node(f"{node.path}.{name}".removeprefix("."), around)
            node.parts.append(part)
            if name == "followers":
                values[name] = self._followers(value, part)
            elif name in ("leader", "steps"):
                values[name] = self._row(value, part.path, part)
            else:
                self.spans[part.path] = self.source.span(value)
                values[name] = self._value(value)
        return values

    def _followers(self, value: ast.expr, node: Node) -> Any:
        if isinstance(value, ast.Constant) and value.value is None:
            return None
        if not isinstance(value, ast.Call):
            return {"steps": self._row(value, "followers.steps", node)}
        if self._name_of(value) != Followers.__name__:
            self._refuse("python-no-list", value, fixes.as_list(self.source, value, STEP_NAMES))
            return None
        document = self._values(value, Followers, node)
        # None stands for the choice of the compiler, for which a document has no value.
        if document.get("dwell_seconds", 0) is None:
            del document["dwell_seconds"]
        return document

    def _row(self, value: ast.expr, path: str, node: Node) -> list[Any]:
        if not isinstance(value, ast.List | ast.Tuple):
            listed = fixes.as_list(self.source, value, STEP_NAMES)
            self._refuse_value("python-no-list", value, listed)
            return []
        self.spans[path] = self.source.span(value)
        return self._steps(value.elts, path, node, 0)

    def _steps(self, nodes: Iterable[ast.expr], path: str, around: Node, depth: int) -> list[Any]:
        return [self._step(node, f"{path}[{number}]", around, depth) for number, node in enumerate(nodes)]

    def _step(self, value: ast.expr, path: str, around: Node, depth: int) -> dict[str, Any]:
        if not isinstance(value, ast.Call):
            called = fixes.as_step(self.source, value, _SIMPLE)
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
        for key, argument, _ in self._arguments(value, getattr(steps, name), inside):
            target, at = content, f"{path}.{kind.kind}.{key}"
            if key in COMMON:
                target, at = common, f"{path}.{key}"
            given = self._value(argument)
            if given is not None:
                target[key] = given
            self.spans[at] = self.source.span(argument)
        if kind is TogetherStep:
            return {kind.kind: self._steps(inside, f"{path}.{kind.kind}", node, depth + 1), **common}
        if kind is RepeatStep:
            content["steps"] = self._steps(inside, f"{path}.{kind.kind}.steps", node, depth + 1)
        return {kind.kind: content, **common}

    def _arguments(
        self, call: ast.Call, what: Callable[..., Any], inside: list[ast.expr] | None = None
    ) -> Iterator[tuple[str, ast.expr, Any]]:
        """Yield each argument of a call, and of those with a default that are absent none: name, value, place.

        The steps inside a step are appended to ``inside``.
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
                deleted = fixes.without_argument(self.source, call, value)
                function = ast.unparse(call.func)
                self._refuse("python-too-many-values", value, deleted, name=function, names=", ".join(names))
        allowed = list(names)
        if inside is not None:
            allowed += COMMON
        for keyword in call.keywords:
            if keyword.arg is None:
                self._refuse("python-star", keyword.value)
            elif keyword.arg not in allowed:
                start = self.source.span(keyword)
                span = Span(start.line, start.column, start.line, start.column + len(keyword.arg))
                function = ast.unparse(call.func)
                deleted = fixes.without_argument(self.source, call, keyword)
                self._refuse_name("python-no-such-value", span, keyword.arg, allowed, deleted, function=function)
            elif keyword.arg in seen:
                deleted = fixes.without_argument(self.source, call, keyword)
                self._refuse("python-given-twice", keyword, deleted, name=keyword.arg)
            else:
                seen.add(keyword.arg)
                yield keyword.arg, keyword.value, keyword
        for name, default in defaults.items():
            if name not in seen and default is not None and inside is not None:
                yield name, ast.copy_location(ast.Constant(default), call.func), call

    def _value(self, node: ast.expr) -> Any:
        with suppress(ValueError, TypeError):
            value = ast.literal_eval(node)
            if value is None or isinstance(value, int | float | str):
                return value
        self._refuse("python-no-value", node)
        return None

    def _name_of(self, call: ast.Call) -> str | None:
        """Return the name in motorcade of what is called; None, with an error, where it is none."""
        if isinstance(call.func, ast.Name):
            for name, own in self.imports.items():
                if own == call.func.id and name in _NAMES:
                    return name
            if call.func.id in _NAMES:
                self._used.setdefault(call.func.id, call.func)
                return call.func.id
        self._refuse_name("python-unknown-name", self.source.span(call.func), ast.unparse(call.func), _NAMES)
        return None

    def _refuse(self, code: str, node: Any, edits: Iterable[Fix] = (), **details: Any) -> None:
        # A whole loop or function would be red; its first line is enough.
        self._add(error(code, "", **details).at(self.source.first_line_of(node)).with_fixes(*edits))

    def _refuse_value(self, code: str, value: ast.expr, edits: Iterable[Fix]) -> None:
        """Refuse what is no list or no step; of a loop, say so."""
        if isinstance(value, _LOOPS):
            code = "python-loop"
        self._refuse(code, value, edits)

    def _refuse_name(
        self, code: str, span: Span, name: str, known: Iterable[str], edits: Sequence[Fix] = (), **details: Any
    ) -> None:
        """Refuse a name, and propose the known one that is most like it; where there is none, ``edits``."""
        found = get_close_matches(name.rpartition(".")[2][:_LONGEST_NAME], list(known), 1)
        hint = Phrase("python-known-names", names=", ".join(known))
        if found:
            hint = Phrase("python-did-you-mean", name=found[0])
            edits = [Fix(TEXT, found[0])]
        self._add(error(code, "", name=_short(name), hint=hint, **details).at(span).with_fixes(*edits))

    def _add(self, problem: Diagnostic) -> None:
        self._errors.append(problem)
        if len(self._errors) >= _MOST_ERRORS:
            raise _TooManyErrorsError

    def _node(self, path: str, node: Any) -> Node:
        self.spans.setdefault(path, self.source.span(node))
        return Node(path, *self.source.extent(node))


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


def _short(text: str) -> Any:
    return str(shown(text))[1:-1]
