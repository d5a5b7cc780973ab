"""The language of the command line: the option --language, or the system's."""

import locale
import os
from contextvars import ContextVar
from typing import Annotated, Any

import typer

from motorcade.errors import MotorcadeError
from motorcade.locales import FIRST, catalogue, command_line_text, languages

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


def translated(key: str, **details: Any) -> str:
    """Return a text of the command line in the current language."""
    return command_line_text(key, current_language(), **details)


def resolve_locale(language: str) -> str:
    """Return ``language``, or the system's where it is empty. Raises MotorcadeError: unknown-language."""
    if language and language not in languages():
        raise MotorcadeError("unknown-language", language=language, languages=", ".join(languages()))
    return language or _system_language()


def current_language() -> str:
    """Return the language of --language, or the system's where none is given or it is unknown."""
    language = requested_language.get()
    return language if language in languages() else _system_language()


def _system_language() -> str:
    # The variables count even where the locale that they name isn't installed.
    names = [os.environ.get(name, "") for name in ("LC_ALL", "LC_MESSAGES", "LANG")]
    names.append(locale.getlocale()[0] or "")
    system = next((name for name in names if name.partition(".")[0] not in ("", "C", "POSIX")), "")
    for language in languages():
        # Windows writes 'Chinese (Simplified)_China' where others write 'zh_CN'.
        if system.lower().startswith((language, catalogue(language)["english_name"].lower())):
            return language
    return FIRST
