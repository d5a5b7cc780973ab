"""The language of the command line: the option --language, or the system's; help and refusals in that language."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Annotated, Any

import typer

from motorcade.errors import MotorcadeError
from motorcade.locales import FIRST, catalogue, command_line_text, languages, system_language, text

HELP_OPTIONS = ("-h", "--help")
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
    """Return the value of --language in ``arguments``; empty where it is missing or unknown."""
    for place, argument in enumerate(arguments):
        name, _, value = argument.partition("=")
        if name == "--language":
            value = value or "".join(arguments[place + 1 : place + 2])
            return value if value in languages() else ""
    return ""
