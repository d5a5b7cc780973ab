"""What several commands share: their options, and how files become images."""

import json
import locale
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from motorcade.cli.failures import PROGRAM_ERROR, UsageError

if TYPE_CHECKING:
    from motorcade.profile import Profile
    from motorcade.program.compiler import Compiled

Json = Annotated[bool, typer.Option("--json", help="Print JSON, on a terminal too.")]
Language = Annotated[str, typer.Option(help="Language of diagnostics: en or zh. The system's, unless given.")]
ExistingFile = Annotated[Path, typer.Argument(exists=True, dir_okay=False, readable=True)]
Source = Annotated[Path, typer.Argument(metavar="PROJECT|IMAGE", exists=True, dir_okay=False, readable=True)]
Port = Annotated[str, typer.Option("--port", "-p", help="Such as /dev/ttyUSB0, COM3 or socket://127.0.0.1:7000.")]
ProfileOption = Annotated[
    str, typer.Option("--profile", help="What the levels mean: a built-in profile's name, or a .toml file.")
]


def wants_json(as_json: bool) -> bool:
    """Whether to print JSON: asked for, or nobody is looking."""
    return as_json or not sys.stdout.isatty()


def print_json(data: Any) -> None:
    """One JSON document on standard output."""
    print(json.dumps(data, ensure_ascii=False), flush=True)


def tongue(language: str) -> str:
    """``en`` or ``zh``: as asked, or as the system speaks."""
    from motorcade.program.diagnostics import LANGUAGES

    if language and language not in LANGUAGES:
        raise UsageError(f"'{language}' is not one of {', '.join(LANGUAGES)}")
    system = locale.getlocale()[0] or ""
    return language or ("zh" if system.lower().startswith(("zh", "chinese")) else "en")


def profile_named(name: str) -> "Profile":
    """A built-in profile, or the one in a .toml file."""
    from motorcade.profile import load_profile

    return load_profile(name, Path())


def compile_file(project: Path) -> "tuple[Compiled, Profile]":
    """The compiled project in a file, and its cars' profile. Raises ProgramError, ProfileError."""
    from motorcade.profile import load_profile
    from motorcade.program.compiler import compile_program
    from motorcade.program.model import read_program

    program = read_program(project.read_bytes())
    profile = load_profile(program.profile, project.parent)
    return compile_program(program, profile), profile


def image_of(source: Path, language: str) -> "tuple[bytes, Profile]":
    """The image in a file, or compiled from the project in it; diagnostics go to standard error.

    A project's errors end the command.
    """
    from rich.console import Console

    from motorcade.console import print_diagnostics
    from motorcade.profile import built_in_profile
    from motorcade.program.diagnostics import ProgramError, has_errors
    from motorcade.words.image import parse_image_bytes

    if not _is_project(source):
        image = source.read_bytes()
        parse_image_bytes(image)
        return image, built_in_profile("classroom")
    try:
        compiled, profile = compile_file(source)
        diagnostics = compiled.diagnostics
    except ProgramError as problem:
        diagnostics = problem.diagnostics
    print_diagnostics(Console(stderr=True), diagnostics, language)
    if has_errors(diagnostics):
        raise typer.Exit(PROGRAM_ERROR)
    return compiled.image, profile


def write_file(path: Path, data: bytes) -> None:
    """Write ``data``; a path that can't be written is a usage error."""
    try:
        path.write_bytes(data)
    except OSError as problem:
        raise UsageError(f"{path} can't be written: {problem.strerror}") from None


def whole_number(text: str, name: str) -> int:
    """``text`` as an integer: decimal, 0x hex or 0b binary."""
    try:
        return int(text, 0)
    except ValueError:
        raise UsageError(f"{name} is '{text}'; allowed: a whole number, such as 42 or 0x2A") from None


def _is_project(source: Path) -> bool:
    return source.suffix == ".json" or source.read_bytes().lstrip()[:2] in (b'{"', b"{\n", b"{}")
