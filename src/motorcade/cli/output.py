"""What commands print, and its language: that of --language, or else the system's."""

import json
import os
import shlex
import sys
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from motorcade.errors import MotorcadeError
from motorcade.locales import languages, system_language, text

if TYPE_CHECKING:
    from rich.console import Console

    from motorcade.program.diagnostics import Diagnostic

# That of --language, empty for none; all threads print notes in it.
_requested = ""


def request_language(language: str) -> None:
    """Take the value of --language, empty for none. Raises MotorcadeError: unknown-language."""
    global _requested
    if language and language not in languages():
        raise MotorcadeError("unknown-language", language=language, languages=", ".join(languages()))
    _requested = language


def current_language() -> str:
    """Return the language of --language, or the system's where none is given."""
    return _requested or system_language()


@contextmanager
def in_language(language: str) -> Iterator[None]:
    """Make ``language`` the current one while the block runs."""
    global _requested
    before, _requested = _requested, language
    try:
        yield
    finally:
        _requested = before


def translated(key: str, **details: Any) -> str:
    """Return a text of the command line in the current language."""
    return text("command_line", key, details, current_language())


def wants_json(as_json: bool) -> bool:
    """Return whether to print JSON: --json is given, or standard output is no terminal."""
    return as_json or sys.stdout is None or not sys.stdout.isatty()


def print_json(data: Any) -> None:
    """Print a JSON document on standard output."""
    print_lines([json.dumps(data, ensure_ascii=False)])


class Rows(NamedTuple):
    """A table, as `motorcade.cli.console.make_table` takes it."""

    columns: Sequence[str]
    rows: Iterable[Iterable[Any]]
    unbroken: Collection[str] = ()
    title: str | None = None


def print_result(data: Any, shown: str | Rows, as_json: bool) -> None:
    """Print ``data`` as JSON; or else a sentence, or a table."""
    if as_json:
        print_json(data)
    elif isinstance(shown, str):
        print_lines([shown])
    else:
        from motorcade.cli.console import make_table, print_table

        print_table(make_table(**shown._asdict()))


def print_lines(lines: Iterable[str]) -> None:
    """Print lines on standard output; it is no error if the reader has closed the pipe."""
    try:
        for line in lines:
            print(line)
        sys.stdout.flush()
    except BrokenPipeError:
        # Python flushes again when it ends, which would print an error.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def print_note(sentence: str) -> None:
    """Print a sentence of the program on standard error."""
    print(f"motorcade: {sentence}", file=sys.stderr)


def print_problem(problem: MotorcadeError | None) -> None:
    """Print on standard error what a command goes on without, such as a log; nothing where there is no problem."""
    if problem:
        print_note(problem.sentence(current_language()))


def print_diagnostics(diagnostics: "Iterable[Diagnostic]", console: "Console | None" = None) -> None:
    """Print each diagnostic in a line, on standard error unless elsewhere: place, severity, code, sentence."""
    from rich.console import Console
    from rich.text import Text

    console = console or Console(stderr=True)
    for each in diagnostics:
        place = each.place(current_language())
        line = Text(f"{place}: " if place else "")
        line.append(translated(each.severity), style="bold red" if each.severity == "error" else "bold yellow")
        line.append(f" {each.code}: {each.sentence(current_language())}")
        console.print(line, soft_wrap=True)


def write_file(path: Path, data: bytes, source: Path | None = None) -> None:
    """Write ``data`` whole or not at all. Raises MotorcadeError where ``path`` is the file ``source``."""
    from motorcade.config.files import replace_file

    if source and path.exists() and path.samefile(source):
        raise MotorcadeError("output-is-input", file=path)
    try:
        replace_file(path, data)
    except OSError as problem:
        raise MotorcadeError("file-not-writable", file=path, reason=problem) from None


def quoted(path: Path) -> str:
    """Return ``path`` as one argument of a command that a user types in this system's shell."""
    if os.name != "nt":
        return shlex.quote(str(path))
    from subprocess import list2cmdline

    return list2cmdline([str(path)])
