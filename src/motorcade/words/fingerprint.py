"""A fingerprint of a word format: two ends that name the same one mean the same by a word.

Portable: a car works out its own. It is a CRC-32, which cars have for uploads
anyway: no protection from malice, and of two declarations that differ by accident
one pair in 2^32 goes unnoticed.
"""

from binascii import crc32

from motorcade.words.field import WordFormat


def fingerprint(word_format: WordFormat) -> int:
    """The CRC-32 of `canonical_text` in UTF-8: 0 to 4294967295."""
    return crc32(canonical_text(word_format).encode())


def canonical_text(word_format: WordFormat) -> str:
    """All that decides what a word says, a line for the format and one for each field.

    A field's line holds name, first and last bit, smallest and largest raw value, and,
    where it has them, its unit and rules. What is only said about a field
    (its meaning, source, default) isn't there: other phrases make no other word.
    """
    lines = [word_format.name]
    for field in word_format.fields:
        parts = [field.name, str(field.high), str(field.low), str(field.minimum), str(field.maximum)]
        if field.unit:
            parts.append("unit=" + field.unit)
        if field.one_hot:
            parts.append("one-hot")
        if field.only:
            parts.append("only=" + ",".join([str(value) for value in sorted([value for value, _ in field.only])]))
        if field.reserved:
            parts.append("reserved")
        if field.goes_with:
            parts.append("goes-with=" + field.goes_with)
        lines.append(" ".join(parts))
    return "".join([line + "\n" for line in lines])
