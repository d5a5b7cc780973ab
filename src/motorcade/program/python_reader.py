"""Read a program from Python text without executing it.

The text may hold what pupils write: ``def leader():`` with statements, ``def followers():`` and functions of their own
(`motorcade.program.python_statements`); or what the authors of libraries write: one ``program = Program(...)`` whose
steps and values are written out. In both there may be a docstring, comments, ``from motorcade import ...``, and a block
``if __name__ == "__main__":``, which is not read. Everything else is an error at its line. Names, their arguments and
their defaults come from `motorcade.program.steps` and `motorcade.program.model`; values are checked against the schema
of project files.
"""

import ast
import textwrap
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from motorcade.program.diagnostics import (
    TEXT,
    Diagnostic,
    Fix,
    ProgramError,
    Span,
    error,
    warning,
)
from motorcade.program.model import Followers, Program, program_from_dict
from motorcade.program.python_calls import (
    MOST_ERRORS,
    NAMES,
    STEP_NAMES,
    Node,
    TooManyErrorsError,
)
from motorcade.program.python_statements import LEADER, StatementReader, names_in
from motorcade.program.python_syntax import as_text
from motorcade.program.python_values import OverBudgetError
from motorcade.program.schema import FORMAT

# The variable that holds the program; that of the profile, where the program is written as functions.
VARIABLE = "program"
PROFILE = "profile"


def read_python(data: bytes | str) -> "PythonProgram":
    """Return the program in Python text. Raises ProgramError; its diagnostics name lines and columns."""
    return PythonProgram(data)


class PythonProgram(StatementReader):
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
        super().__init__(data)
        self.imported_at: ast.ImportFrom | None = None
        self.root, document = self._read()
        try:
            self.program = program_from_dict(document)
        except ProgramError as problem:
            raise ProgramError(list(map(self._in_text, problem.diagnostics))[:MOST_ERRORS]) from None
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
        try:
            statements = list(self._own_statements())
            names = names_in(statements, ast.expr_context)
            functions = [statement.name for statement in statements if isinstance(statement, ast.FunctionDef)]
            # Whether the program is written as functions.
            self.is_statements = LEADER in functions or names.isdisjoint((VARIABLE, Program.__name__))
            if self.is_statements:
                read: Any = self._functions(statements)
            else:
                call = self._program_call(statements)
                read = call and self._document_of(call)
            if read and not self._errors:
                return read  # type: ignore[no-any-return]
        except TooManyErrorsError:
            pass
        except OverBudgetError:
            definition = self.definitions.get(self._function, self.source.tree)
            self._errors.append(error("python-too-much", "").at(self.source.first_line_of(definition)))
        raise ProgramError(sorted(self._errors, key=lambda problem: problem.span or (0,)))

    def _in_text(self, diagnostic: Diagnostic) -> Diagnostic:
        """Return a diagnostic of the document with its place in the text, and with edits of the text that fix it."""
        path = diagnostic.path
        found = []
        for fix in diagnostic.fixes:
            at = path
            if diagnostic.code == "missing-field":
                at = f"{path}.{fix.field}"
            if at in self.spans:
                found.append(Fix(TEXT, as_text(fix.value), self.spans[at]))
            elif path in self._calls:
                found += self.source.with_argument(self._calls[path], fix.field, fix.value)
        if diagnostic.code == "missing-field" and not diagnostic.fixes and path in self._calls:
            # The only values without a first one are lists of steps.
            found = self.source.with_argument(self._calls[path], diagnostic.details["name"], [])
        return diagnostic.at(self._span_of(path)).with_fixes(*found)

    def _warnings(self) -> Iterator[Diagnostic]:
        """Yield a warning for each name that isn't imported, at its first use."""
        missing = [name for name in self._used if name not in self.imports]
        if not missing:
            return
        more = self.source.with_imports(self.imported_at, sorted(missing))
        for name in missing:
            span = self.source.span(self._used[name])
            yield warning("python-not-imported", "", name=name).at(span).with_fixes(*more)

    def _own_statements(self) -> Iterator[ast.stmt]:
        """Yield the statements but texts about the program, imports, and what only Python executes."""
        for statement in self.source.tree.body:
            match statement:
                case ast.Expr(value=ast.Constant(value=str())):
                    pass
                case ast.ImportFrom(module="motorcade", level=0):
                    self._import(statement)
                case ast.Import() | ast.ImportFrom():
                    self._refuse("python-import", statement, self.source.right_statement(statement, VARIABLE))
                case ast.If() if ast.unparse(statement.test) == "__name__ == '__main__'":
                    pass
                case _:
                    yield statement

    def _functions(self, statements: list[ast.stmt]) -> tuple[Node, dict[str, Any]] | None:
        """Return where the parts of a program that is written as functions stand, and its document.

        None, with an error, where the leader has no function.
        """
        document: dict[str, Any] = {"format": FORMAT}
        assigned: list[tuple[str, ast.Assign]] = []
        bodies: list[ast.stmt] = []
        outside: list[ast.stmt] = []
        for statement in statements:
            match statement:
                case ast.Assign(targets=[ast.Name(id="profile")], value=value):
                    self.spans[PROFILE] = self.source.span(value)
                    self.value_extents[PROFILE] = self.source.extent(value)
                    document[PROFILE] = self._value(value)
                case ast.Assign(targets=[ast.Name(id=name)]) if name != VARIABLE:
                    assigned.append((name, statement))
                    bodies.append(statement)
                case ast.FunctionDef():
                    self._define(statement)
                    bodies.append(statement)
                case _:
                    outside.append(statement)
        if LEADER not in self.definitions:
            self._refuse_without_leader(outside)
            return None
        for statement in outside:
            code = "python-statement-outside"
            if self.definitions.keys() & names_in([statement], ast.Load):
                code = "python-called-outside"
            self._refuse(code, statement, self.source.without_lines(statement))
        self._find_counters(bodies)
        root = Node("", 0, len(self.source.text))
        self._read_values(assigned)
        return root, document | self._defined(root)

    def _refuse_without_leader(self, outside: list[ast.stmt]) -> None:
        """Refuse a text without a function of the leader; where statements stand outside together, they become one."""
        body = self.source.tree.body
        edits: list[Fix] = []
        place = Span(1, 1, 1, 2)
        for statement in [*outside, *self.definitions.values()][:1]:
            place = self.source.first_line_of(statement)
            if outside and body[body.index(statement) :][: len(outside)] == outside:
                start, end = self.source.start_of(place.line), self.source.extent(outside[-1])[1]
                steps = textwrap.indent(self.source.text[start:end], "    ")
                edits = self.source.replacement(start, end, f"def {LEADER}():\n{steps}")
        self._add(error("python-no-leader", "").at(place).with_fixes(*edits))

    def _program_call(self, statements: list[ast.stmt]) -> ast.Call | None:
        """Return the call of Program, the only one among the statements, or None with an error."""
        found: ast.Call | None = None
        for statement in statements:
            match statement:
                case ast.Assign(targets=[ast.Name(id="program")], value=ast.Call() as call):
                    if found:
                        deleted = self.source.without_lines(statement)
                        self._refuse("python-second-program", statement, deleted)
                    found = call
                case ast.Expr(value=ast.Call(func=func)) if found and self._uses_the_program(func):
                    pass
                case _:
                    self._refuse("python-statement", statement, self.source.right_statement(statement, VARIABLE))
        return found

    def _uses_the_program(self, function: ast.expr) -> bool:
        """Whether a call is one of the program's own, such as save, or of something else that motorcade offers."""
        if isinstance(function, ast.Attribute):
            return isinstance(function.value, ast.Name) and function.value.id == VARIABLE
        names = [name for name, own in self.imports.items() if own == getattr(function, "id", None)]
        return bool(names) and names[0] not in NAMES

    def _import(self, statement: ast.ImportFrom) -> None:
        self.imported_at = statement
        for alias in statement.names:
            if alias.name == "*":
                self.imports |= {name: name for name in NAMES}
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
            self._refuse("python-no-list", value, self.source.as_list(value, STEP_NAMES))
            return None
        document = self._values(value, Followers, node)
        # None stands for the choice of the compiler, for which a document has no value.
        if document.get("dwell_seconds", 0) is None:
            del document["dwell_seconds"]
        return document
