"""What several commands share: their options, and how files become images."""

import json
import locale
import os
import sys
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from motorcade.errors import MotorcadeError, Phrase
from motorcade.locales import FIRST, catalogue, languages
from motorcade.outcomes import PROGRAM_ERROR

if TYPE_CHECKING:
    from rich.console import RenderableType

    from motorcade.config.profile import Profile
    from motorcade.program.compiler import Compiled

_MOST_BYTES = 1 << 24

Json = Annotated[bool, typer.Option("--json", help="Print JSON, on a terminal too.")]
# The value of --language, for the sentence that is printed when the command fails.
requested_language: ContextVar[str] = ContextVar("requested_language", default="")


def _remember(language: str) -> str:
    requested_language.set(language)
    return language


Language = Annotated[
    str,
    typer.Option(
        help=f"Language of diagnostics: {' or '.join(languages())}. The system's, unless given.", callback=_remember
    ),
]
ExistingFile = Annotated[Path, typer.Argument(exists=True, dir_okay=False, readable=True)]
Source = Annotated[Path, typer.Argument(metavar="PROJECT|IMAGE", exists=True, dir_okay=False, readable=True)]
ProfileOption = Annotated[
    str, typer.Option("--profile", help="What the levels mean: a built-in profile's name, or a .toml file.")
]


def wants_json(as_json: bool) -> bool:
    """Whether to print JSON: asked for, or nobody is looking."""
    return as_json or sys.stdout is None or not sys.stdout.isatty()


def print_json(data: Any) -> None:
    """One JSON document on standard output."""
    print_text(json.dumps(data, ensure_ascii=False) + "\n")


def print_table(table: "RenderableType") -> None:
    """What Rich draws, on standard output."""
    from rich.console import Console

    console = Console()
    with console.capture() as drawn:
        console.print(table)
    print_text(drawn.get())


def print_text(text: str) -> None:
    """Text on standard output; a reader that has left already is no error."""
    try:
        print(text, end="", flush=True)
    except BrokenPipeError:
        # Python flushes once more when it ends, and would complain then.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def resolve_locale(language: str) -> str:
    """``language``, or the system's language where it is empty. Raises MotorcadeError: unknown-language."""
    if language and language not in languages():
        raise MotorcadeError("unknown-language", language=language, languages=", ".join(languages()))
    return language or _system_language()


def current_language() -> str:
    """The language of --language, or the system's where none is given or it is unknown."""
    language = requested_language.get()
    return language if language in languages() else _system_language()


def _system_language() -> str:
    # The variables count even where the locale that they name isn't installed.
    names = [os.environ.get(name, "") for name in ("LC_ALL", "LC_MESSAGES", "LANG")]
    names.append(locale.getlocale()[0] or "")
    system = next((name for name in names if name and not name.startswith(("C", "POSIX"))), "")
    for language in languages():
        # Windows writes 'Chinese (Simplified)_China' where others write 'zh_CN'.
        if system.lower().startswith((language, catalogue(language)["english_name"].lower())):
            return language
    return FIRST


def profile_named(name: str) -> "Profile":
    """A built-in profile, or the one in a .toml file."""
    from motorcade.config.profile import load_profile

    return load_profile(name, Path())


def compile_project(data: bytes, folder: Path) -> "tuple[Compiled, Profile]":
    """The compiled project of a file in ``folder``, and its cars' profile. Raises ProgramError."""
    from motorcade.config.profile import load_profile
    from motorcade.errors import MotorcadeError
    from motorcade.program.compiler import compile_program
    from motorcade.program.diagnostics import ProgramError, error
    from motorcade.program.model import read_program

    program = read_program(data)
    try:
        profile = load_profile(program.profile, folder)
    except MotorcadeError as problem:
        raise ProgramError([error("bad-profile", "profile", reason=problem)]) from None
    return compile_program(program, profile), profile


def image_of(source: Path, profile_name: str, language: str) -> "tuple[bytes, Profile]":
    """The image in a file, or compiled from the project in it; diagnostics go to standard error.

    ``profile_name`` is for an image; a project names its own. A project's errors end the command.
    """
    from rich.console import Console

    from motorcade.cli.console import print_diagnostics
    from motorcade.program.diagnostics import ProgramError, has_errors
    from motorcade.words.image import parse_image_bytes

    data = read_file(source)
    if not _is_project(source, data):
        parse_image_bytes(data)
        return data, profile_named(profile_name)
    try:
        compiled, profile = compile_project(data, source.parent)
        diagnostics = compiled.diagnostics
    except ProgramError as problem:
        diagnostics = problem.diagnostics
    print_diagnostics(Console(stderr=True), diagnostics, language)
    if has_errors(diagnostics):
        raise typer.Exit(PROGRAM_ERROR)
    return compiled.image, profile


def words_in(source: Path) -> tuple[int, ...]:
    """The words in an image file. Raises ImageError, or MotorcadeError where it is a project."""
    from motorcade.words.image import bytes_to_words

    data = read_file(source)
    if _is_project(source, data):
        raise MotorcadeError("project-is-no-image", file=source)
    return bytes_to_words(data)


def read_file(path: Path) -> bytes:
    """The bytes of a file, of which no project or image has more than 16 MiB."""
    with path.open("rb") as file:
        data = file.read(_MOST_BYTES + 1)
    if len(data) > _MOST_BYTES:
        raise MotorcadeError("file-too-large", file=path, mebibytes=_MOST_BYTES >> 20)
    return data


def write_file(path: Path, data: bytes, source: Path | None = None) -> None:
    """Write ``data``, whole or not at all, but never over ``source``."""
    from motorcade.config.files import replace_file

    if source and path.exists() and path.samefile(source):
        raise MotorcadeError("output-is-input", file=path)
    try:
        replace_file(path, data)
    except OSError as problem:
        raise MotorcadeError("file-not-writable", file=path, reason=problem.strerror) from None


def whole_number(text: str, name: str | Phrase) -> int:
    """``text`` as an integer: decimal, 0x hex or 0b binary."""
    for base in (0, 10):
        try:
            return int(text, base)
        except ValueError:
            continue
    raise MotorcadeError("not-a-whole-number", name=name, text=text[:40])


def _is_project(source: Path, data: bytes) -> bool:
    from motorcade.words.image import ImageError, parse_image_bytes

    if source.suffix == ".json":
        return True
    try:
        parse_image_bytes(data)
    except ImageError:
        return data.removeprefix(b"\xef\xbb\xbf").lstrip()[:1] == b"{"
    return False
