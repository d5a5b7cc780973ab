"""What commands print: JSON where --json is given; and its language: that of --language, or else the system's.

What is printed may hold what a car, a server or a file's name says. A terminal obeys some characters, and some change
the order of others; here, where text leaves the program, `plain` replaces them, and none is read as Rich's markup.
"""

import json
import os
import re
import shlex
import sys
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from motorcade.errors import MotorcadeError, Phrase
from motorcade.locales import languages, system_language, text

if TYPE_CHECKING:
    from rich.console import Console, RenderableType
    from rich.table import Table
    from rich.text import Text

    from motorcade.program.diagnostics import Diagnostic

# Of a line in characters: wider than any table.
_UNBROKEN_WIDTH = 10_000
# What a terminal obeys (C0 and C1 but for tab and line feed), what ends a line or turns its direction, and half
# surrogate pairs, which stand for the bytes of a file's name that are no UTF-8.
_OBEYED = re.compile("[\0-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")

_STYLES = {"error": "bold red", "warning": "bold yellow"}

# That of --language, empty for none; all threads print notes in it.
_requested = ""
# Whether --json is given, to the command or to one above it. Everything else is for people, in pipes too.
_is_json = False


def request_language(language: str) -> None:
    """Take the value of --language, empty for none. Raises MotorcadeError: unknown-language."""
    global _requested
    if language and language not in languages():
        raise MotorcadeError("unknown-language", language=language, languages=", ".join(languages()))
    _requested = language


def request_json(is_wanted: bool) -> None:
    """Take --json; without it what commands print is for people."""
    global _is_json
    _is_json = is_wanted


def wants_json() -> bool:
    """Return whether --json is given."""
    return _is_json


def current_language() -> str:
    """Return the language of --language, or the system's where none is given."""
    return _requested or system_language()


@contextmanager
def in_language(language: str) -> Iterator[None]:
    """Make ``language`` the current one while the block runs."""
    global _requested
    before = _requested
    _requested = language
    try:
        yield
    finally:
        _requested = before


def translated(key: str, **details: Any) -> str:
    """Return a text of the command line in the current language."""
    return text("command_line", key, details, current_language())


def sentence_of(said: "MotorcadeError | Phrase | Diagnostic") -> str:
    """Return what an error, a phrase or a diagnostic says, in the user's language."""
    return said.sentence(current_language())


def is_shown_on_terminal() -> bool:
    """Return whether standard output is a terminal, and no pipe or file."""
    return sys.stdout is not None and sys.stdout.isatty()


def plain(text: str) -> str:
    """Return text for a terminal; a replacement character stands for each that a terminal would obey."""
    return _OBEYED.sub("\N{REPLACEMENT CHARACTER}", text)


def print_json(data: Any) -> None:
    """Print a JSON document on standard output; what a terminal would obey is there as an escape of JSON."""
    print_lines([json_text(data)])


def json_text(data: Any) -> str:
    """Return a JSON document in one line that no terminal obeys."""
    return _OBEYED.sub(lambda found: f"\\u{ord(found[0]):04x}", json.dumps(data, ensure_ascii=False))


def make_table(
    columns: Sequence[str],
    rows: Iterable[Iterable[Any]],
    *,
    right: Collection[str] = (),
    unbroken: Collection[str] = (),
    **style: Any,
) -> "Table":
    """Make a table whose headings are the texts "column-…" of the catalogue. Only a terminal gets frames.

    Args:
        columns: the names of the headings.
        rows: a cell for each column: a styled text, or anything whose text is shown, a dash for None.
        right: the columns of numbers, at whose right edge their cells stand.
        unbroken: the columns whose cells stay on one line.
        style: what else Rich's table takes, such as a title.
    """
    from rich.table import Table

    if not is_shown_on_terminal():
        style |= {"box": None, "pad_edge": False}
    for name in ("title", "caption"):
        if style.get(name) is not None:
            style[name] = _as_text(style[name])
    table = Table(title_justify="left", caption_justify="left", **style)
    for name in columns:
        heading = translated(f"column-{name}")
        table.add_column(heading, justify="right" if name in right else "left", no_wrap=name in unbroken)
    for row in rows:
        table.add_row(*("–" if value is None else _as_text(value) for value in row))
    return table


def _as_text(shown: Any) -> "Text":
    """Return a text for Rich that is no markup, whoever wrote it, with the styles of one that has some."""
    from rich.text import Text

    if not isinstance(shown, Text):
        return Text(plain(str(shown)))
    text = shown.copy()
    text.plain = plain(text.plain)
    return text


def print_table(table: "RenderableType") -> None:
    """Print what Rich draws on standard output; into a pipe or file without colours, and no line of it is broken."""
    from rich.console import Console

    if is_shown_on_terminal():
        console = Console()
    else:
        console = Console(width=_UNBROKEN_WIDTH, color_system=None)
    with console.capture() as drawn:
        console.print(table)
    _print_drawn(line.rstrip() for line in drawn.get().removesuffix("\n").split("\n"))


class Rows(NamedTuple):
    """A table, as `make_table` takes it."""

    columns: Sequence[str]
    rows: Iterable[Iterable[Any]]
    unbroken: Collection[str] = ()
    title: str | None = None


def print_result(data: Any, shown: str | Rows) -> None:
    """Print ``data`` as JSON where that is wanted; or else a sentence, or a table."""
    if wants_json():
        print_json(data)
    elif isinstance(shown, str):
        print_lines([shown])
    else:
        print_table(make_table(**shown._asdict()))


def print_lines(lines: Iterable[str]) -> None:
    """Print lines on standard output; it is no error if the reader has closed the pipe."""
    _print_drawn(map(plain, lines))


def _print_drawn(lines: Iterable[str]) -> None:
    try:
        for line in lines:
            print(line)
        sys.stdout.flush()
    except BrokenPipeError:
        # Python flushes again when it ends, which would print an error.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def print_note(sentence: str) -> None:
    """Print a sentence of the program on standard error."""
    print(f"motorcade: {plain(sentence)}", file=sys.stderr)


def print_problem(problem: MotorcadeError | None) -> None:
    """Print on standard error what a command goes on without, such as a log; nothing where there is no problem."""
    if problem:
        print_note(sentence_of(problem))


def print_diagnostics(diagnostics: "Iterable[Diagnostic]", console: "Console | None" = None) -> None:
    """Print each diagnostic in a line, on standard error unless elsewhere: place, severity, code, sentence."""
    from rich.console import Console
    from rich.text import Text

    console = console or Console(stderr=True)
    for diagnostic in diagnostics:
        line = Text(diagnostic.place(current_language()))
        line.append(translated(diagnostic.severity), style=_STYLES[diagnostic.severity])
        line.append(f" {diagnostic.code}: {sentence_of(diagnostic)}")
        console.print(_as_text(line), soft_wrap=True)


def quoted(path: Path) -> str:
    """Return ``path`` as one argument of a command that a user types in this system's shell."""
    if os.name != "nt":
        return shlex.quote(str(path))
    from subprocess import list2cmdline

    return list2cmdline([str(path)])
