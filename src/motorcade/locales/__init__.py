"""Every sentence that a person reads: one JSON file a language, read by command line, servers and page alike.

A file has these parts:

- ``language``: what the language calls itself.
- ``errors``: the sentence of each code of `motorcade.errors.MotorcadeError` and of each diagnostic of a program.
- ``phrases``: parts of sentences, by key.
- ``command_line``: what commands print beside errors.
- ``meanings``: what each field of Motorcade's words means.
- ``english_name``: what the language is called in English, as Windows names its languages.
- ``page``: the texts of the page; ``page.errors`` replaces a sentence of ``errors`` that speaks of the command line.

Braces are filled as by ``str.format``; the page's own texts have double braces, as i18next wants them.
"""

import json
import os
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent
# What a sentence falls back to, and what comes first in lists.
FIRST = "en"


@cache
def languages() -> tuple[str, ...]:
    """The languages that there are, English first: a file each."""
    names = sorted(file.stem for file in _folder().glob("*.json"))
    return (FIRST, *(name for name in names if name != FIRST))


@cache
def catalogue(language: str) -> dict[str, Any]:
    """The whole file of a language. Raises OSError where there is none."""
    document: dict[str, Any] = json.loads((_folder() / f"{language}.json").read_text(encoding="utf-8"))
    return document


def text(part: str, key: str, details: Mapping[str, Any], language: str) -> str:
    """The text ``key`` in a part of the catalogue, its braces filled; in English where ``language`` hasn't got it."""
    for each in (language, FIRST):
        if each in languages() and key in (texts := catalogue(each).get(part, {})):
            return str(texts[key]).format(**{name: _told(value, each) for name, value in details.items()})
    raise KeyError(f"locales/{FIRST}.json has no {part}.{key}")


def error_sentence(code: str, details: Mapping[str, Any], language: str, audience: str = "") -> str:
    """The sentence of an error; see `motorcade.errors.MotorcadeError.sentence`."""
    if audience and code in catalogue(FIRST).get(audience, {}).get("errors", {}):
        for each in (language, FIRST):
            if sentence := catalogue(each).get(audience, {}).get("errors", {}).get(code):
                return str(sentence).format(**{name: _told(value, each) for name, value in details.items()})
    return text("errors", code, details, language)


def command_line_text(key: str, language: str, **details: Any) -> str:
    """A text of the command line, its braces filled."""
    return text("command_line", key, details, language)


def _told(value: Any, language: str) -> Any:
    """A detail in the sentence's language."""
    return value.sentence(language) if hasattr(value, "sentence") else value


def _folder() -> Path:
    # Who translates, and a test, may keep the files elsewhere.
    return Path(os.environ.get("MOTORCADE_LOCALES") or FOLDER)
