"""The language of the command line: the option --language, or the system's; and the help in that language."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Annotated, Any

import typer

from motorcade.errors import MotorcadeError
from motorcade.locales import FIRST, catalogue, command_line_text, languages, system_language, text

_requested: ContextVar[str] = ContextVar("requested_language", default="")


def request_language(language: str) -> str:
    """Take the value of --language, empty for none. Raises MotorcadeError: unknown-language."""
    if language and language not in languages():
        raise MotorcadeError("unknown-language", language=language, languages=", ".join(languages()))
    _requested.set(language)
    return language


Language = Annotated[str, typer.Option(callback=request_language)]


def translated(key: str, **details: Any) -> str:
    """Return a text of the command line in the current language."""
    return command_line_text(key, current_language(), **details)


def current_language() -> str:
    """Return the language of --language, or the system's where none is given."""
    return _requested.get() or system_language()


@contextmanager
def in_language(language: str) -> Iterator[None]:
    """Make ``language`` the current one while the block runs."""
    token = _requested.set(language)
    try:
        yield
    finally:
        _requested.reset(token)


def translate_help(command: Any, path: str = "") -> None:
    """Give a Typer command, and all commands below it, their help: the texts "COMMAND" and "COMMAND.PARAMETER".

    A text ".PARAMETER" is for all commands that have none of their own.
    """
    known = catalogue(FIRST)["help"]
    command.help = text("help", path or "motorcade", {}, current_language())
    for parameter in command.params:
        own = f"{path}.{parameter.name}"
        key = own if own in known else f".{parameter.name}"
        if key in known:
            details = {"languages": " / ".join(languages())}
            parameter.help = text("help", key, details, current_language())
    for name, each in getattr(command, "commands", {}).items():
        translate_help(each, f"{path} {name}".lstrip())


def language_in(arguments: list[str]) -> str:
    """Return the value of --language in ``arguments``; empty where it is missing or unknown."""
    for place, argument in enumerate(arguments):
        name, _, value = argument.partition("=")
        if name == "--language":
            value = value or "".join(arguments[place + 1 : place + 2])
            return value if value in languages() else ""
    return ""
