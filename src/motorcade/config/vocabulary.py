"""Formats that are exported together, and the names that a format of a user's own can't have."""

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import resources

from motorcade.errors import MotorcadeError
from motorcade.locales import catalogue
from motorcade.words.field import Field, WordFormat
from motorcade.words.formats import FORMATS, fingerprint

LONGEST = 40
# Each part begins with a letter: Kaitai joins the parts, and both a_1 and a1 would become a1.
_NAME = re.compile(r"[a-z][a-z0-9]*(_[a-z][a-z0-9]*)*")


@cache
def _reserving() -> dict[str, str]:
    """The language or tool that reserves each name."""
    names = tomllib.loads((resources.files(__package__) / "reserved_names.toml").read_text(encoding="utf-8"))
    return {word: owner for owner, words in reversed(names.items()) for word in words.split()}


def check_name(name: str) -> None:
    """Raise MotorcadeError where ``name`` can't be a field's or a format's name in every exported language."""
    if not _NAME.fullmatch(name) or len(name) > LONGEST:
        raise MotorcadeError("no-identifier", name=name[:60], longest=LONGEST)
    if owner := _reserving().get(name):
        raise MotorcadeError("reserved-name", name=name, owner=owner)


@dataclass(frozen=True, slots=True)
class Vocabulary:
    """Formats that one export describes.

    Attributes:
        name: an identifier, part of the names of the exported files.
        formats: at least one.
        meanings: of a user's own format, by language: what a field means, by the names of format and field.
    """

    name: str
    formats: tuple[WordFormat, ...]
    meanings: Mapping[str, Mapping[tuple[str, str], str]] = field(default_factory=dict)

    @property
    def file_stem(self) -> str:
        """The beginning of the names of the exported files."""
        return f"motorcade_{self.name}"

    @property
    def has_images(self) -> bool:
        """Whether these formats make images: a header, and control words after it."""
        return {"header", "control"} <= {word_format.name for word_format in self.formats}

    def meaning(self, word_format: WordFormat, of: Field, language: str) -> str:
        """What a field means, in ``language``; as it is declared where there is no translation."""
        own = self.meanings.get(language, {}).get((word_format.name, of.name))
        return own or catalogue(language).get("meanings", {}).get(f"{word_format.name}.{of.name}") or of.meaning


MOTORCADE = Vocabulary("words", FORMATS)


def fingerprint_text(word_format: WordFormat) -> str:
    """Return the fingerprint as every export writes it: ``0x`` and 8 digits."""
    return f"0x{fingerprint(word_format):08X}"


def field_notes(of: Field) -> str:
    """Return a line that describes a field, without its name and bits, in English."""
    notes = [of.meaning]
    if of.unit:
        notes.append(f"in {of.unit}")
    if of.reserved:
        notes.append(str(of.reserved_allowed) if of.defined else "written 0")
    else:
        notes.append(str(of.allowed))
    if of.goes_with:
        notes.append(f"0 exactly where {of.goes_with} is 0")
    if of.needs and not of.parity_masks:
        notes.append(f"no effect unless {of.needs} is 1")
    return "; ".join(notes)
