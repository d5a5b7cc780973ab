"""The syntax of a program's Python text: its tree, the places of its nodes, and edits that would fix a mistake.

The text is parsed by `ast` and never executed.
"""

import ast
import io
import re
import tokenize
import unicodedata
import warnings
from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator
from difflib import get_close_matches
from itertools import accumulate, islice
from typing import Any, NamedTuple

from motorcade.config.files import decoded
from motorcade.errors import Phrase
from motorcade.program.diagnostics import TEXT, Fix, ProgramError, Span, error
from motorcade.program.steps import Step, first_value, own_fields

_PACKAGE = "motorcade"
# More than any program that fits into a car, with comments, needs; Python reads it within a second.
MOST_CHARACTERS = 200_000
# The levels of its tree, and the bits of a number in it: blocks have at most a tenth of both.
_MOST_LEVELS = 150
_MOST_BITS = 1024
# Each edit that may correct a text is tried by Python's parser, which takes too long in a longer text.
_MOST_TRIED = 20_000
_MOST_TRIES = 20
_CLOSERS = {"(": ")", "[": "]", "{": "}"}
# Signs of a Chinese keyboard that the compatibility form of Unicode leaves as they are.
_PLAIN = dict(zip("\u3001\u3002\u2018\u2019\u201c\u201d\u3010\u3011", ",.''\"\"[]", strict=True))
# The beginnings of the messages of Python's parser, and the phrase for each; groups become its details.
_REASONS = tuple(
    (re.compile(pattern, re.DOTALL), key)
    for pattern, key in (
        (r"'(?P<sign>.)' was never closed", "python-not-closed"),
        (r"unmatched '(?P<sign>.)'", "python-not-opened"),
        (
            r"closing parenthesis '(?P<sign>.)' does not match opening parenthesis '(?P<opened>.)'",
            "python-other-bracket",
        ),
        (r"invalid syntax\. Perhaps you forgot a comma", "python-no-comma"),
        (r"invalid character '(?P<sign>.)'", "python-bad-character"),
        (r"invalid non-printable character (?P<sign>\S+)", "python-bad-character"),
        (r"unterminated (triple-quoted )?(f-)?string literal", "python-open-string"),
        (r"unexpected indent|unindent does not match|inconsistent use of tabs", "python-bad-indent"),
        (r"expected an indented block", "python-no-indent"),
        (r"expected '(?P<sign>.)'", "python-expected"),
        (r"positional argument follows keyword argument", "python-order-of-values"),
        (r"keyword argument repeated", "python-same-name"),
        (r"Exceeds the limit|invalid (\w+ )?decimal literal|leading zeros", "python-bad-number"),
        (r"unexpected EOF", "python-ends-early"),
        (r"too many nested parentheses", "too-deep"),
    )
)

# Before 3.11.4, Python's parser blames the number in front of a sign that it can't take.
_FOREIGN_SIGN = re.compile(r"([\w.]+)([^\w\s\x00-\x7f])")


class Comment(NamedTuple):
    """A comment, from its ``#`` on."""

    line: int
    start: int
    text: str


class PythonSource:
    """A text, its syntax tree, the places of its nodes, and edits that would correct it."""

    def __init__(self, data: bytes | str) -> None:
        """Parse a text. Raises ProgramError where it is no Python, or too long."""
        try:
            if isinstance(data, bytes):
                data = decoded(data)
            text = data.removeprefix("\ufeff")
            text.encode()
        except UnicodeError:
            raise _not_python(Phrase("not-text"), 1, 1) from None
        self.text = re.sub("\r\n?", "\n", text)
        if len(self.text) > MOST_CHARACTERS:
            raise ProgramError([error("python-too-long", "", most=MOST_CHARACTERS)])
        self._lines = self.text.split("\n")
        # For lines with other characters than ASCII: the byte at which each character begins.
        self._columns: dict[int, array[int]] = {}
        self._starts = list(accumulate((len(line) + 1 for line in self._lines), initial=0))
        self.tree = self._parsed()

    def span(self, node: Any) -> Span:
        """The place of a node in the text."""
        return self.span_between(*self.extent(node))

    def span_between(self, start: int, end: int) -> Span:
        """The place of the characters from the one with the number ``start`` up to ``end``."""
        return Span(*self._place(start), *self._place(end))

    def extent(self, node: Any) -> tuple[int, int]:
        """The number of a node's first character, and of the one behind its last."""
        return (
            self._offset(node.lineno, node.col_offset),
            self._offset(node.end_lineno, node.end_col_offset),
        )

    def first_line_of(self, node: Any) -> Span:
        """The place of a node up to the end of its first line."""
        start, end = self.extent(node)
        return self.span_between(start, min(end, self._starts[self.line_at(start)] - 1))

    def line_at(self, offset: int) -> int:
        """The line, from 1, of a character."""
        return self._place(offset)[0]

    def start_of(self, line: int) -> int:
        """The number of the first character of a line."""
        return self._starts[line - 1]

    def import_place(self) -> int:
        """The number of the character before which an import belongs: behind the docstring."""
        body = self.tree.body
        if isinstance(body[0], ast.Expr) and len(body) > 1:
            return self.start_of(body[1].lineno)
        return self.start_of(body[0].lineno)

    def comments(self) -> list[Comment]:
        """All comments of the text, in their order."""
        tokens = tokenize.generate_tokens(io.StringIO(self.text).readline)
        return [
            Comment(token.start[0], self._starts[token.start[0] - 1] + token.start[1], token.string)
            for token in tokens
            if token.type == tokenize.COMMENT
        ]

    def _offset(self, line: int, byte_column: int) -> int:
        """Python's parser counts columns in bytes of UTF-8."""
        column = byte_column
        if not self._lines[line - 1].isascii():
            if line not in self._columns:
                sizes = (len(character.encode()) for character in self._lines[line - 1])
                self._columns[line] = array("I", accumulate(sizes, initial=0))
            column = bisect_left(self._columns[line], byte_column)
        return self._starts[line - 1] + column

    def _place(self, offset: int) -> tuple[int, int]:
        line = min(bisect_right(self._starts, offset), len(self._lines))
        return line, offset - self._starts[line - 1] + 1

    def _parsed(self) -> ast.Module:
        """Return the text's tree. Raises ProgramError, with the edit that would help where there is one."""
        text = self.text
        if "\0" in text:
            before = text[: text.index("\0")]
            raise _not_python(Phrase("python-null-byte"), before.count("\n") + 1, len(before) - before.rfind("\n"))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return _checked(ast.parse(text))
        except SyntaxError as problem:
            reason = _reason_of(problem.msg or "")
            line = max(1, problem.lineno or 1)
            column = max(1, problem.offset or 1)
            if isinstance(problem, IndentationError) and line <= text.count("\n") + 1:
                # Python's versions name different columns.
                code = text.split("\n")[line - 1]
                column = len(code) - len(code.lstrip()) + 1
            blamed = _FOREIGN_SIGN.match(text, self.start_of(line) + column - 1)
            if blamed and reason.key == "python-bad-number":
                reason = Phrase("python-bad-character", sign=blamed[2])
                column = column + len(blamed[1])
            sign = reason.details.get("opened") or reason.details.get("sign", "")
            start = self.start_of(line) + column - 1
            raise _not_python(reason, line, column, self._syntax_fixes(reason.key, start, sign)) from None
        except (RecursionError, MemoryError):
            raise _not_python(Phrase("too-deep"), 1, 1) from None

    def _syntax_fixes(self, reason: str, start: int, sign: str) -> Iterator[Fix]:
        """Yield the edit that makes Python of a text, which Python's parser refuses at the character ``start``.

        Args:
            reason: the key of the phrase that says why.
            sign: the character that it is about.
        """
        text = self.text
        if len(text) > _MOST_TRIED:
            return
        for at, end, new in _candidates(text, reason, start, sign):
            # One of several such characters is corrected, although the others are wrong still.
            if reason == "python-bad-character" or _is_python(text[:at] + new + text[end:]):
                yield Fix(TEXT, new, self.span_between(at, end))
                return

    def replacement(self, start: int, end: int, text: str) -> list[Fix]:
        """Return the edit that puts ``text`` in the place of these characters; none where the result is no Python."""
        if len(self.text) > _MOST_TRIED or not _is_python(self.text[:start] + text + self.text[end:]):
            return []
        return [Fix(TEXT, text, self.span_between(start, end))]

    def without_argument(self, call: ast.Call, argument: Any) -> list[Fix]:
        """Return the edit that deletes an argument of a call, with its comma."""
        extents = sorted(map(self.extent, [*call.args, *call.keywords]))
        place = extents.index(self.extent(argument))
        start, end = extents[place]
        if place:
            start = extents[place - 1][1]
        elif len(extents) > 1:
            end = extents[1][0]
        if "#" in self.text[start:end]:
            return []
        return self.replacement(start, end, "")

    def with_argument(self, call: ast.Call, name: str, value: Any) -> list[Fix]:
        """Return the edit that adds a named argument to a call, behind its others."""
        text = f"{name}={as_text(value)}"
        arguments = [*call.args, *call.keywords]
        if not arguments:
            at = self.extent(call)[1] - 1
            return self.replacement(at, at, text)
        at = max(self.extent(argument)[1] for argument in arguments)
        return self.replacement(at, at, f", {text}")

    def without_lines(self, statement: ast.stmt) -> list[Fix]:
        """Return the edit that deletes the lines of a statement."""
        start, end = self.extent(statement)
        start = self.start_of(self.line_at(start))
        return self.replacement(start, min(end + 1, len(self.text)), "")

    def with_imports(self, statement: ast.ImportFrom | None, names: Iterable[str]) -> list[Fix]:
        """Return the edit that imports ``names`` too; ``statement`` is the import that is there."""
        text = ", ".join(names)
        if statement:
            at = self.extent(statement.names[-1])[1]
            return self.replacement(at, at, f", {text}")
        at = self.import_place()
        return self.replacement(at, at, f"from {_PACKAGE} import {text}\n\n")

    def right_statement(self, statement: ast.stmt, variable: str) -> list[Fix]:
        """Return the edit that corrects a statement which has no place in the text; none where it stays unclear.

        A misspelt import is corrected, another one deleted; a call of Program is given to the program's ``variable``.
        """
        match statement:
            case ast.Import() | ast.ImportFrom():
                names = "*"
                module = statement.names[0].name
                if isinstance(statement, ast.ImportFrom):
                    names = ", ".join(map(ast.unparse, statement.names))
                    module = statement.module or ""
                if not get_close_matches(module, [_PACKAGE], 1):
                    return self.without_lines(statement)
                return self.replacement(*self.extent(statement), f"from {_PACKAGE} import {names}")
            case ast.Expr(value=ast.Call(func=ast.Name(id="Program"))):
                start, _ = self.extent(statement)
                return self.replacement(start, start, f"{variable} = ")
            case ast.Assign(targets=[ast.Name() as target], value=ast.Call(func=ast.Name(id="Program"))):
                return self.replacement(*self.extent(target), variable)
        return []

    def as_list(self, value: ast.expr, names: Iterable[str]) -> list[Fix]:
        """Return the edit that puts a single step into a list."""
        start, end = self.extent(value)
        is_step = isinstance(value, ast.Call) and isinstance(value.func, ast.Name) and value.func.id in names
        if not is_step:
            return []
        return self.replacement(start, end, f"[{self.text[start:end]}]")

    def as_step(self, value: ast.expr, kinds: dict[str, type[Step]]) -> list[Fix]:
        """Return the edit that makes a step of its name alone, or of a name that is much like it."""
        if not isinstance(value, ast.Name):
            return []
        for name in get_close_matches(value.id, kinds, 1):
            kind = kinds[name]
            given = {**kind.names[name], "speed": None}
            wanted = [own.name for own in own_fields(kind) if own.name not in given]
            values = ", ".join(as_text(first_value(kind, parameter)) for parameter in wanted)
            return self.replacement(*self.extent(value), f"{name}({values})")
        return []


def _reason_of(message: str) -> Phrase:
    """Return the phrase for what Python's parser says."""
    for pattern, key in _REASONS:
        if match := pattern.match(message):
            return Phrase(key, **match.groupdict())
    return Phrase("python-mistake")


def _checked(tree: ast.Module) -> ast.Module:
    """Return a tree that is safe to walk and to write. Raises RecursionError, or SyntaxError for a number too long."""
    level: list[ast.AST] = [tree]
    for _ in range(_MOST_LEVELS):
        for node in level:
            if isinstance(node, ast.Constant) and isinstance(node.value, int) and node.value.bit_length() > _MOST_BITS:
                end = node.end_lineno, node.end_col_offset
                raise SyntaxError("Exceeds the limit", ("", node.lineno, node.col_offset + 1, "", *end))
        level = [child for node in level for child in ast.iter_child_nodes(node)]
        if not level:
            return tree
    raise RecursionError


def _not_python(reason: Phrase, line: int, column: int, fixes: Iterable[Fix] = ()) -> ProgramError:
    problem = error("not-python", "", reason=reason).at(Span(line, column, line, column + 1))
    return ProgramError([problem.with_fixes(*fixes)])


def _candidates(text: str, reason: str, start: int, sign: str) -> Iterator[tuple[int, int, str]]:
    """Yield the edits to try, each as its first character, the one behind its last, and the new text."""
    closers = _CLOSERS.get(sign, "")
    match reason:
        case "python-bad-character":
            plain = _PLAIN.get(text[start : start + 1]) or unicodedata.normalize("NFKC", text[start : start + 1])
            if plain.isascii() and plain.isprintable():
                yield start, start + 1, plain
        case "python-no-comma":
            for found in islice(re.finditer(r"(?<=[\w)\]\"'])\s+(?=[\w\"'])", text[start:]), _MOST_TRIES):
                yield start + found.start(), start + found.start(), ","
        case "python-not-closed":
            line, _, _ = text[start:].partition("\n")
            for at in (start + len(line), len(text.rstrip())):
                yield at, at, closers
        case "python-other-bracket":
            yield start, start, closers
        case "python-not-opened":
            yield start, start + 1, ""


def _is_python(text: str) -> bool:
    """Whether Python's parser takes a text."""
    try:
        ast.parse(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return False
    return True


def as_text(value: Any) -> str:
    """Return a value as it is written in Python."""
    if isinstance(value, str):
        return f'"{value}"'
    return str(value)
