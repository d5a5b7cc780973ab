"""Edits each of which makes Python of a text that is none."""

import ast
import re
import unicodedata
from collections.abc import Iterator
from itertools import islice

from motorcade.program.diagnostics import TEXT, Mend, Span

# Each edit is tried by Python's parser, which takes too long in a longer text.
MOST_TRIED = 20_000
_MOST_TRIES = 20
_CLOSERS = {"(": ")", "[": "]", "{": "}"}
# Signs of a Chinese keyboard that the compatibility form of Unicode leaves as they are.
_PLAIN = {
    "\u3001": ",",
    "\u3002": ".",
    "\u2018": "'",
    "\u2019": "'",
    "\u201c": '"',
    "\u201d": '"',
    "\u3010": "[",
    "\u3011": "]",
}


def syntax_mends(text: str, reason: str, span: Span, sign: str = "") -> tuple[Mend, ...]:
    """Return the edits each of which makes Python of ``text``, which Python's parser refuses at ``span``.

    Args:
        reason: the key of the phrase that says why.
        sign: the character that it is about.
    """
    if len(text) > MOST_TRIED:
        return ()
    lines = text.split("\n")
    start = sum(len(line) + 1 for line in lines[: span.line - 1]) + span.column - 1
    for at, end, new in _candidates(text, reason, start, sign):
        edited = text[:at] + new + text[end:]
        # One of several such characters is mended, although the others are wrong still.
        if reason == "python-bad-character" or is_python(edited):
            return (Mend(TEXT, new, _span_between(lines, at, end)),)
    return ()


def _span_between(lines: list[str], start: int, end: int) -> Span:
    """Return the place of the characters from ``start`` up to ``end``, which are numbered from 0 through all lines."""
    places = []
    for at in (start, end):
        number = 0
        while at > len(lines[number]) and number < len(lines) - 1:
            at -= len(lines[number]) + 1
            number += 1
        places.append((number + 1, at + 1))
    return Span(*places[0], *places[1])


def _candidates(text: str, reason: str, start: int, sign: str) -> Iterator[tuple[int, int, str]]:
    """Yield the edits to try, each as its first character, the one behind its last, and the new text."""
    line_end = text.find("\n", start) if "\n" in text[start:] else len(text)
    last = len(text.rstrip())
    closers = _CLOSERS.get(sign, "")
    match reason:
        case "python-bad-character":
            plain = _PLAIN.get(text[start : start + 1]) or unicodedata.normalize("NFKC", text[start : start + 1])
            if plain.isascii() and plain.isprintable():
                yield start, start + 1, plain
        case "python-no-comma":
            for found in islice(re.finditer(r"(?<=[\w)\]\"'])\s+(?=[\w\"'])", text[start:]), _MOST_TRIES):
                yield start + found.start(), start + found.start(), ","
        case "python-not-closed":
            yield from ((at, at, closers) for at in (line_end, last))
        case "python-other-bracket":
            yield start, start, closers
            yield start, start + 1, closers
            yield start, start + 1, ""
        case "python-not-opened":
            yield start, start + 1, ""
        case "python-open-string":
            code = text[start:line_end].rstrip()
            ends = (len(code.rstrip(")],")), *range(len(code.rstrip(")],")) + 1, len(code) + 1))
            yield from ((start + at, start + at, text[start]) for at in ends)
        case "python-bad-indent":
            first = text.rfind("\n", 0, start) + 1
            yield first, first + len(text[first:line_end]) - len(text[first:line_end].lstrip()), ""
        case "python-bad-number":
            digits = re.match(r"0+(?=\d)", text[start:])
            if digits:
                yield start, start + digits.end(), ""


def is_python(text: str) -> bool:
    """Whether Python's parser takes a text."""
    try:
        ast.parse(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return False
    return True
