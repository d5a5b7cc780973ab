"""Options, input, output and language that all commands share.

The language is that of --language, or else the system's; help and refusals are in it too.
"""

import json
import os
import re
import shlex
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import typer

from motorcade.errors import MotorcadeError, Phrase
from motorcade.locales import FIRST, catalogue, command_line_text, languages, system_language, text
from motorcade.outcomes import PROGRAM_ERROR

if TYPE_CHECKING:
    from rich.console import Console

    from motorcade.config.profile import Profile
    from motorcade.fleet.places import Place
    from motorcade.program.diagnostics import Diagnostic

HELP_OPTIONS = ("-h", "--help")
DEFAULT_PROFILE = "classroom"
# A frame has 36 bits; a number with more digits than this is none that anything here takes.
_MOST_OF_A_NUMBER = 80
# A list of cars in the folder where a command runs is read without being named.
_USUAL_LIST = Path("cars.toml")
# The least time for which a command listens for announcements of cars.
_LISTEN_S = 1.5
# That of --language, empty for none; all threads print notes in it.
_requested = ""


def request_language(language: str) -> None:
    """Take the value of --language, empty for none. Raises MotorcadeError: unknown-language."""
    global _requested
    if language and language not in languages():
        raise MotorcadeError("unknown-language", language=language, languages=", ".join(languages()))
    _requested = language


def wants_json(as_json: bool) -> bool:
    """Return whether to print JSON: --json is given, or standard output is no terminal."""
    return as_json or sys.stdout is None or not sys.stdout.isatty()


# Whether to print JSON: where it is asked for; or also where no terminal shows what is printed.
Json = Annotated[bool, typer.Option("--json")]
JsonInPipes = Annotated[bool, typer.Option("--json", callback=wants_json)]
ExistingFile = Annotated[Path, typer.Argument(exists=True, dir_okay=False, readable=True)]
Source = Annotated[Path, typer.Argument(metavar="PROJECT|IMAGE", exists=True, dir_okay=False, readable=True)]
OptionalFile = Annotated[Path | None, typer.Option(exists=True, dir_okay=False)]
Output = Annotated[Path, typer.Option("-o", "--output")]
OptionalOutput = Annotated[Path | None, typer.Option("-o", "--output")]
GpioChip = Annotated[int | None, typer.Option(min=0)]
TcpPortNumber = Annotated[int, typer.Option(min=0, max=65535)]
# The profile of an image. A project names its own, so the option has no default.
ImageProfile = Annotated[str | None, typer.Option("--profile")]
CarNumber = Annotated[int, typer.Option(min=0, max=(1 << 32) - 1)]
InsecureLan = Annotated[bool, typer.Option("--insecure-lan")]
CarList = Annotated[Path | None, typer.Option("--list", exists=True, dir_okay=False)]
Seconds = Annotated[float, typer.Option(min=0.1, max=3600)]
Jobs = Annotated[int, typer.Option(min=0, max=1024)]
Role = Literal["leader", "follower"]


class Search(NamedTuple):
    """Where to look for cars.

    Attributes:
        file: a list, whose places alone are asked; None for ports, the network and the usual list.
        keys: a driver's keys.
        seconds: for how long to look.
    """

    file: Path | None
    keys: Path | None
    seconds: float

    @property
    def listen_s(self) -> float:
        """For how long announcements are awaited."""
        return 0.0 if self.file else min(_LISTEN_S, self.seconds)


def exclude_each_other(**given: Any) -> None:
    """Raise MotorcadeError where more than one of the options is given; each has a name of Python's."""
    names = [f"--{name.replace('_', '-')}" for name, value in given.items() if value]
    if len(names) > 1:
        raise MotorcadeError("options-exclude-each-other", first=names[0], second=names[1])


def listed(file: Path | None) -> "list[Place]":
    """Return the places in a list of cars, or in the usual one where none is named. Raises MotorcadeError."""
    from motorcade.fleet.places import read_list

    file = file or (_USUAL_LIST if _USUAL_LIST.is_file() else None)
    return read_list(file) if file else []


def print_json(data: Any) -> None:
    """Print a JSON document on standard output."""
    print_lines([json.dumps(data, ensure_ascii=False)])


def quoted(path: Path) -> str:
    """Return ``path`` as one argument of a command that a user types in this system's shell."""
    if os.name != "nt":
        return shlex.quote(str(path))
    from subprocess import list2cmdline

    return list2cmdline([str(path)])


def print_result(data: Any, sentence: str, as_json: bool) -> None:
    """Print ``data`` as JSON, or ``sentence``."""
    if as_json:
        print_json(data)
    else:
        print_lines([sentence])


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


def print_problem(problem: MotorcadeError) -> None:
    """Print on standard error what a command goes on without, such as a log."""
    print_note(problem.sentence(current_language()))


def profile_named(name: str) -> "Profile":
    """Return a built-in profile, or the one in a .toml file."""
    from motorcade.config.profile import load_profile

    return load_profile(name, Path())


def image_for(source: Path, profile_name: str | None) -> "tuple[bytes, Profile]":
    """Return the image in a file, or compile the project in it, and the profile, as `image_of`.

    ``profile_name`` is the option --profile. Raises MotorcadeError where a project names another profile.
    """
    image, profile = image_of(source, profile_name or DEFAULT_PROFILE)
    if profile_name and replace(profile_named(profile_name), name=profile.name) != profile:
        raise MotorcadeError("profile-is-the-projects", file=source, profile=profile.name, other=profile_name)
    return image, profile


def image_of(source: Path, profile_name: str, place: str = "") -> "tuple[bytes, Profile]":
    """Return the image in a file, or compile the project in it, and the profile.

    Diagnostics are printed on standard error; errors among them end the command. Raises MotorcadeError for a file that
    is neither; the sentence names ``place``, or else the file.
    ``profile_name`` is the profile of an image; a project names its own.
    """
    from motorcade.program.diagnostics import ProgramError
    from motorcade.program.files import image_in

    try:
        image, profile, diagnostics = image_in(source, profile_name, place)
    except ProgramError as problem:
        print_diagnostics(problem.diagnostics)
        raise typer.Exit(PROGRAM_ERROR) from None
    print_diagnostics(diagnostics)
    return image, profile


def print_diagnostics(diagnostics: "Iterable[Diagnostic]", console: "Console | None" = None) -> None:
    """Print each diagnostic in a line, on standard error unless elsewhere: place, severity, code, sentence."""
    from rich.console import Console
    from rich.text import Text

    console = console or Console(stderr=True)
    for each in diagnostics:
        line = Text()
        place = each.place(current_language())
        line.append(f"{place}: " if place else "")
        style = "bold red" if each.severity == "error" else "bold yellow"
        line.append(translated(each.severity), style=style)
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


def whole_number(text: str, name: str | Phrase) -> int:
    """Return ``text`` as an integer: decimal, 0x hexadecimal or 0b binary. Raises MotorcadeError."""
    for base in (0, 10) if len(text) <= _MOST_OF_A_NUMBER else ():
        try:
            return int(text, base)
        except ValueError:
            continue
    raise MotorcadeError("not-a-whole-number", name=name, text=text[:40])


def translated(key: str, **details: Any) -> str:
    """Return a text of the command line in the current language."""
    return command_line_text(key, current_language(), **details)


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


def translate_help(command: Any) -> None:
    """Give a Typer command, all commands below it, and the frames around their parameters their texts."""
    from typer import rich_utils

    for name in ("arguments", "options", "commands"):
        setattr(rich_utils, f"{name.upper()}_PANEL_TITLE", translated(f"help-{name}"))
    _translate_help(command, "")


def _translate_help(command: Any, path: str) -> None:
    """Give a command and those below it the texts "COMMAND" and "COMMAND.PARAMETER", or ".PARAMETER" for all."""
    known = catalogue(FIRST)["help"]
    command.help = text("help", path or "motorcade", {}, current_language())
    option = command.get_help_option(typer.Context(command, help_option_names=list(HELP_OPTIONS)))
    option.help = translated("help-help")
    for parameter in command.params:
        own = f"{path}.{parameter.name}"
        key = own if own in known else f".{parameter.name}"
        if key in known:
            details = {"languages": " / ".join(languages())}
            parameter.help = text("help", key, details, current_language())
    for name, each in getattr(command, "commands", {}).items():
        _translate_help(each, f"{path} {name}".lstrip())


def usage_sentence(message: str) -> str:
    """Return what Typer says of a wrong command line in the current language; what the catalogue lacks, as it is."""
    for template, sentence in catalogue(current_language()).get("usage", {}).items():
        texts = re.split(r"\{(\w+)\}", template)
        parts = [f"(?P<{part}>.+)" if place % 2 else re.escape(part) for place, part in enumerate(texts)]
        if found := re.fullmatch("".join(parts), message):
            return str(sentence.format(**{name: usage_sentence(value) for name, value in found.groupdict().items()}))
    return message


def language_in(arguments: list[str]) -> str:
    """Return the last value of --language in ``arguments``; empty where it is missing."""
    language = ""
    for place, argument in enumerate(arguments):
        name, _, value = argument.partition("=")
        if name == "--language":
            language = value or "".join(arguments[place + 1 : place + 2])
    return language
