"""Errors and warnings of a program, each with a stable code and its place in the project file."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any, Literal, NamedTuple

from motorcade.errors import MotorcadeError, Phrase
from motorcade.locales import error_sentence

Severity = Literal["error", "warning"]


class Span(NamedTuple):
    """A part of a text, from its first character to the one behind its last; lines and columns count from 1."""

    line: int
    column: int
    end_line: int
    end_column: int


class Fix(NamedTuple):
    """One value, or one edit, that would fix what is wrong.

    Attributes:
        field: the field of the step (of the followers' settings where the diagnostic is about these, or where only
            they have such a field) that would have the value; `TEXT` where the value would replace a text; `DELETE`
            and `BEHIND`, which have no value, where the step would be deleted, or stand behind the step around it.
        value: None for the choice of the compiler.
        span: the text that the value would replace; None for the text at the diagnostic's span.
    """

    field: str
    value: float | str | None = None
    span: Span | None = None


TEXT = "text"
DELETE = "delete"
BEHIND = "behind"


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """An error or a warning.

    Attributes:
        code: the key of the sentence, below "errors" in `locales/<language>.json`; stable. The sentences of
            leader-accepts-ir and too-many-states have the wording of seed 000 (c1 2.1.1 and h1 1.0.1, whose 并行 is an
            erratum for 串行).
        severity: error or warning; a program with an error has no words.
        path: the place in the JSON, such as ``leader[2].together[0]``.
        id: the step's id (the block it came from), where it has one.
        details: the values for the sentence's placeholders, by name.
        span: its place in the Python text that the program was read from; None for a program from elsewhere.
        fixes: values each of which would fix it.
    """

    code: str
    severity: Severity
    path: str
    id: str | None = None
    details: dict[str, Any] = field(default_factory=dict)
    span: Span | None = None
    fixes: tuple[Fix, ...] = ()

    def at(self, span: Span | None) -> "Diagnostic":
        """Return the same with its place in a text."""
        return replace(self, span=span)

    def with_fixes(self, *fixes: Fix) -> "Diagnostic":
        """Return the same with values that would fix it."""
        return replace(self, fixes=fixes)

    def sentence(self, language: str = "en", audience: str = "") -> str:
        """The sentence in one of `motorcade.locales.languages()`, for an ``audience`` as in `MotorcadeError`."""
        return error_sentence(self.code, self.details, language, audience)

    def place(self, language: str = "en") -> str:
        """The place for a reader, as it stands before a sentence: line and column of a text, else the path; or none."""
        place = self.path
        if self.span:
            place = Phrase("line-and-column", line=self.span.line, column=self.span.column).sentence(language)
        return place and Phrase("at-place", place=place).sentence(language)

    def as_dict(self, language: str = "en") -> dict[str, Any]:
        """The diagnostic for JSON."""
        document: dict[str, Any] = {
            "code": self.code,
            "severity": self.severity,
            "message": self.sentence(language),
            "path": self.path,
            "id": self.id,
        }
        if self.span is not None:
            document |= {"line": self.span.line, "column": self.span.column}
        return document


def error(code: str, path: str, step_id: str | None = None, **details: Any) -> Diagnostic:
    """Return a Diagnostic that stops the program from being compiled."""
    return Diagnostic(code, "error", path, step_id, details)


def warning(code: str, path: str, step_id: str | None = None, **details: Any) -> Diagnostic:
    """Return a Diagnostic of something that compiles but may not be what the user means."""
    return Diagnostic(code, "warning", path, step_id, details)


def has_errors(diagnostics: Iterable[Diagnostic]) -> bool:
    """Whether any of them is an error."""
    return any(diagnostic.severity == "error" for diagnostic in diagnostics)


class _Problems(tuple[Diagnostic, ...]):
    __slots__ = ()

    def sentence(self, language: str = "en") -> str:
        return "; ".join(problem.place(language) + problem.sentence(language) for problem in self)

    __str__ = sentence


class ProgramError(MotorcadeError):
    """A program that can't be read or compiled; ``diagnostics`` holds the reasons."""

    def __init__(self, diagnostics: Iterable[Diagnostic]):
        self.diagnostics: tuple[Diagnostic, ...] = _Problems(diagnostics)
        super().__init__("program-errors", problems=self.diagnostics)


class NotJsonError(ProgramError):
    """A text that isn't even JSON, so it is no project file."""
