"""Formats that are exported together, and the names that a format of a user's own can't have."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from motorcade.errors import MotorcadeError
from motorcade.locales import catalogue
from motorcade.words.field import Field, WordFormat
from motorcade.words.formats import FORMATS, fingerprint

LONGEST = 40
# Each part begins with a letter: Kaitai joins the parts, and both a_1 and a1 would become a1.
_NAME = re.compile(r"[a-z][a-z0-9]*(_[a-z][a-z0-9]*)*")

_C = """
alignas alignof and and_eq asm auto bitand bitor bool break case catch char class compl complex concept const
const_cast consteval constexpr constinit continue decltype default delete do double dynamic_cast else enum explicit
export extern false float for friend goto if imaginary inline int long mutable namespace new noexcept noreturn not
not_eq nullptr operator or or_eq private protected public register reinterpret_cast requires restrict return short
signed sizeof static static_assert static_cast struct switch template this thread_local throw true try typedef typeid
typename typeof typeof_unqual union unsigned using virtual void volatile wchar_t while xor xor_eq
"""
# Compilers, Windows and Qt define these words as macros.
_C_MACROS = "emit errno far interface linux near signals slots small stderr stdin stdout unix"
_LUA = """
and break do else elseif end false for function goto if in local nil not or repeat return then true until while
"""
_PYTHON = """
and as assert async await break class continue def del elif else except finally for from global if import in is lambda
nonlocal not or pass raise return try while with yield
"""
_JAVASCRIPT = """
arguments await break case catch class const constructor continue debugger default delete do else enum eval export
extends false finally for function if implements import in instanceof interface let new null package private protected
prototype public return static super switch this throw true try typeof var void while with yield
"""
_KAITAI = "close from_bytes from_file from_io"
# The dissector has filters with these names besides those of the fields.
_WIRESHARK = "refused warning word"
_TAKEN = {
    "C": _C,
    "C (headers define it)": _C_MACROS,
    "Lua": _LUA,
    "Python": _PYTHON,
    "JavaScript": _JAVASCRIPT,
    "Kaitai": _KAITAI,
    "the Wireshark dissector": _WIRESHARK,
}
_LANGUAGES_OF = {word: language for language, words in reversed(_TAKEN.items()) for word in words.split()}


def check_name(name: str) -> None:
    """Raise MotorcadeError where ``name`` can't be a field's or a format's name in every exported language."""
    if not _NAME.fullmatch(name) or len(name) > LONGEST:
        raise MotorcadeError("no-identifier", name=name[:60], longest=LONGEST)
    if name in _LANGUAGES_OF:
        raise MotorcadeError("reserved-name", name=name, owner=_LANGUAGES_OF[name])


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
