"""What a voice module sends for which word: a TOML file, read once and checked.

    format = "motorcade-voice/1"
    baud = 9600

    [[word]]
    says = "stop"
    bytes = "AA 01"     # hexadecimal; or text = "stop\\r\\n", sent as UTF-8

Such modules are programmed by their makers or users, so each answers in bytes of its own.
"""

import tomllib
from itertools import permutations
from pathlib import Path
from typing import Any, NamedTuple

from motorcade.boards.voice import WORDS

FORMAT = "motorcade-voice/1"
_LONGEST_PATTERN = 64
_MOST_WORDS = 50
_FASTEST_BAUD = 4_000_000


class VoiceError(ValueError):
    """A voice map that isn't there, isn't TOML or can't be."""


class VoiceMap(NamedTuple):
    """The module's baud rate (8N1), and the bytes it sends for each voice of `motorcade.car.brain`."""

    baud: int
    patterns: tuple[tuple[bytes, int], ...]


def load_voice_map(path: Path) -> VoiceMap:
    """The voice map at ``path``. Raises VoiceError, whose sentence names the file and the key at fault."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it is no text"
        raise VoiceError(f"the voice map {path} can't be read: {reason}") from None
    return parse_voice_map(text, path.name)


def parse_voice_map(text: str, where: str) -> VoiceMap:
    """The VoiceMap in TOML ``text``; ``where`` is the file's name for the sentences. Raises VoiceError."""
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise VoiceError(f"the voice map {where} is not TOML: {error}") from None
    _check_keys(table, ("format", "baud", "word"), where)
    if table.get("format") != FORMAT:
        raise VoiceError(f"{where}: format is {table.get('format')!r}; it has to be {FORMAT!r}")
    baud = table.get("baud")
    if type(baud) is not int or not 1 <= baud <= _FASTEST_BAUD:
        raise VoiceError(f"{where}: baud is {baud!r}; allowed: a whole number, as a rule 9600 or 115200")
    words = table.get("word")
    if not isinstance(words, list) or not 1 <= len(words) <= _MOST_WORDS:
        raise VoiceError(f"{where}: 1 to {_MOST_WORDS} tables [[word]] are needed, each with says and bytes or text")
    patterns = tuple(_word(word, f"{where}, word[{number}]") for number, word in enumerate(words))
    for (inner, _), (outer, _) in permutations(patterns, 2):
        if inner in outer:
            raise VoiceError(
                f"{where}: {inner.hex(' ').upper()} is part of {outer.hex(' ').upper()}, "
                "so the two can't be told apart; choose other bytes"
            )
    return VoiceMap(baud, patterns)


def _word(word: Any, where: str) -> tuple[bytes, int]:
    if not isinstance(word, dict):
        raise VoiceError(f"{where} is {word!r}; it has to be a table [[word]]")
    _check_keys(word, ("says", "bytes", "text"), where)
    voices = dict(WORDS)
    says = word.get("says")
    if not isinstance(says, str) or says not in voices:
        raise VoiceError(f"{where}: says is {says!r}; allowed: {', '.join(voices)}")
    return _pattern(word, where), voices[says]


def _pattern(word: dict[str, Any], where: str) -> bytes:
    if ("bytes" in word) == ("text" in word):
        raise VoiceError(f"{where}: either bytes or text says what the module sends")
    if "text" in word:
        key, pattern = "text", word["text"]
        if not isinstance(pattern, str):
            raise VoiceError(f"{where}: text is {pattern!r}; allowed: text in quotes")
        pattern = pattern.encode()
    else:
        key, value = "bytes", word["bytes"]
        try:
            pattern = bytes.fromhex(value)
        except (ValueError, TypeError):
            raise VoiceError(f'{where}: bytes is {value!r}; allowed: hexadecimal in quotes, such as "AA 01"') from None
    if not 1 <= len(pattern) <= _LONGEST_PATTERN:
        raise VoiceError(f"{where}: {key} has {len(pattern)} bytes; allowed: 1 to {_LONGEST_PATTERN}")
    return pattern


def _check_keys(table: dict[str, Any], known: tuple[str, ...], where: str) -> None:
    if unknown := [key for key in table if key not in known]:
        raise VoiceError(f"{where}: '{unknown[0]}' is not known; known are {', '.join(known)}")
