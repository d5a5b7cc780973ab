"""What every exported file writes of a format and of a field."""

from motorcade.words.field import Field, WordFormat
from motorcade.words.formats import fingerprint

# The beginning of the names of the exported files.
FILE_STEM = "motorcade_words"


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
