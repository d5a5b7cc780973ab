"""Every sentence that a person reads: one JSON file a language, read by command line, servers and page alike.

A file has these parts:

- ``language``: the name of the language in itself.
- ``english_name``: its name in English, which Windows uses.
- ``errors``: the sentence of each code of `motorcade.errors.MotorcadeError` and of each diagnostic of a program.
- ``phrases``: parts of sentences, by key.
- ``system``: why the system refuses something, by the name of its error's number.
- ``command_line``: what commands print besides errors.
- ``usage``: what Typer says of a wrong command line, by its own English sentence.
- ``help``: the help of each command and, behind a full stop, of its parameters; ``.name`` is for all commands.
- ``meanings``: what each field of Motorcade's words means.
- ``page``: the texts of the page; ``page.errors`` replaces a sentence of ``errors`` that speaks of the command line.

``str.format`` fills the braces; the page's own texts have double braces, which the page fills. ``{cars:car|cars}`` is
the form of a noun or a verb beside a whole number: the first one where the number is 1.
"""

import errno
import json
import locale
import os
from collections.abc import Mapping, Sequence
from functools import cache
from numbers import Integral
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent
# The language of texts that another language lacks; the first in lists.
FIRST = "en"
# Of a number in a sentence: Python writes none of more than 4,300 digits, and nobody reads one of fifty.
_MOST_BITS = 160


@cache
def languages() -> tuple[str, ...]:
    """Return the languages that have a file, English first."""
    names = sorted(file.stem for file in _folder().glob("*.json"))
    return (FIRST, *(name for name in names if name != FIRST))


@cache
def catalogue(language: str) -> dict[str, Any]:
    """Return the whole file of a language. Raises OSError where there is none."""
    document: dict[str, Any] = json.loads((_folder() / f"{language}.json").read_text(encoding="utf-8"))
    return document


def text(part: str, key: str, details: Mapping[str, Any], language: str) -> str:
    """Return a text of the catalogue with its details; in English where ``language`` doesn't have it."""
    return _filled([(part, key)], details, language)


def error_sentence(code: str, details: Mapping[str, Any], language: str, audience: str = "") -> str:
    """Return the sentence of an error; see `motorcade.errors.MotorcadeError.sentence`."""
    own = [(audience, "errors", code)] if audience else []
    return _filled([*own, ("errors", code)], details, language, audience)


def _filled(paths: Sequence[Sequence[str]], details: Mapping[str, Any], language: str, audience: str = "") -> str:
    """Return the text at the first of some paths where there is one, in ``language`` or else in English."""
    for path in paths:
        for tried in (language, FIRST):
            found: Any = catalogue(tried) if tried in languages() else {}
            for key in path:
                found = found.get(key, {})
            if isinstance(found, str):
                return found.format(**{name: _told(value, tried, audience) for name, value in details.items()})
    raise KeyError(f"locales/{FIRST}.json has no {'.'.join(paths[-1])}")


def page_text(path: Sequence[str], language: str) -> str:
    """Return a text of the page by its keys; an empty one where there is none."""
    found: Any = catalogue(language)["page"]
    for key in path:
        found = found.get(key, "") if isinstance(found, dict) else ""
    return found if isinstance(found, str) else ""


def system_language() -> str:
    """Return the language that this computer is set to; English where there is no file of it."""
    # The variables count even where the locale that they name isn't installed.
    names = [os.environ.get(name, "") for name in ("LC_ALL", "LC_MESSAGES", "LANG")]
    names.append(locale.getlocale()[0] or "")
    system = next((name for name in names if name.partition(".")[0] not in ("", "C", "POSIX")), "")
    for language in languages():
        # Windows writes 'Chinese (Simplified)_China' where others write 'zh_CN'.
        if system.lower().startswith((language, catalogue(language)["english_name"].lower())):
            return language
    return FIRST


class _Count(int):
    """A whole number in a sentence, which chooses the form of what stands beside it."""

    def __format__(self, how: str) -> str:
        one, divider, other = how.partition("|")
        if not divider:
            return super().__format__(how)
        return one if self == 1 else other


def _told(value: Any, language: str, audience: str) -> Any:
    """Return a detail in the language of its sentence; an error inside it is for the same audience."""
    if isinstance(value, int) and value.bit_length() > _MOST_BITS:
        return f"{'-' if value < 0 else ''}2^{value.bit_length() - 1}"
    if isinstance(value, Integral) and not isinstance(value, bool):
        return _Count(value)
    if audience and hasattr(value, "code"):
        return value.sentence(language, audience)
    if isinstance(value, OSError):
        return _refusal(value, language)
    return value.sentence(language) if hasattr(value, "sentence") else value


def _refusal(problem: OSError, language: str) -> str:
    """Return why the system refuses something: in its own words where the catalogue doesn't know the error."""
    # By name, since systems number them differently; Windows has names of its own for those of sockets, and TLS numbers
    # its errors otherwise (they alone have a library).
    number = 0 if hasattr(problem, "library") else problem.errno or 0
    name = errno.errorcode.get(number, "").removeprefix("WSA")
    known = catalogue(language).get("system", {}).get(name)
    return str(known or problem.strerror or problem) or type(problem).__name__


def _folder() -> Path:
    # Translators and tests may keep the files elsewhere.
    return Path(os.environ.get("MOTORCADE_LOCALES") or FOLDER)
