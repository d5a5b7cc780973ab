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
from motorcade.config.pin_sentences import NO_TEXT
from motorcade.errors import Sentences, ToldError

FORMAT = "motorcade-voice/1"
# The words in braces are filled in per case: {where} is the file and the table in it.
_SENTENCES: Sentences = {
    "unreadable": {
        "en": "the voice map {where} can't be read: {reason}",
        "zh": "无法读取语音对照文件 {where}：{reason}",
    },
    "no-toml": {
        "en": "the voice map {where} is not TOML: {reason}",
        "zh": "语音对照文件 {where} 不是 TOML：{reason}",
    },
    "unknown-key": {
        "en": "{where}: '{key}' is not known; known are {known}",
        "zh": "{where}：没有 '{key}' 这一项；可用的有 {known}",
    },
    "format": {
        "en": "{where}: format is {value}; it has to be '{format}'",
        "zh": "{where}：format 是 {value}；应为 '{format}'",
    },
    "baud": {
        "en": "{where}: baud is {value}; allowed: a whole number, as a rule 9600 or 115200",
        "zh": "{where}：baud 是 {value}；应为整数，通常是 9600 或 115200",
    },
    "words": {
        "en": "{where}: 1 to {most} tables [[word]] are needed, each with says and bytes or text",
        "zh": "{where}：需要 1 到 {most} 个 [[word]] 表，各有 says 以及 bytes 或 text",
    },
    "part-of-another": {
        "en": "{where}: {inner} is part of {outer}, so the two can't be told apart; choose other bytes",
        "zh": "{where}：{inner} 是 {outer} 的一部分，无法区分两者；请换用其他字节",
    },
    "no-table": {
        "en": "{where} is {value}; it has to be a table [[word]]",
        "zh": "{where} 是 {value}；应为 [[word]] 表",
    },
    "says": {
        "en": "{where}: says is {value}; allowed: {known}",
        "zh": "{where}：says 是 {value}；可用的有 {known}",
    },
    "bytes-or-text": {
        "en": "{where}: either bytes or text says what the module sends",
        "zh": "{where}：模块发送的内容用 bytes 或 text 之一来写",
    },
    "no-text": {
        "en": "{where}: text is {value}; allowed: text in quotes",
        "zh": "{where}：text 是 {value}；应为引号中的文本",
    },
    "no-bytes": {
        "en": '{where}: bytes is {value}; allowed: hexadecimal in quotes, such as "AA 01"',
        "zh": '{where}：bytes 是 {value}；应为引号中的十六进制数，例如 "AA 01"',
    },
    "length": {
        "en": "{where}: {key} has {count} bytes; allowed: 1 to {most}",
        "zh": "{where}：{key} 有 {count} 个字节；允许 1 到 {most} 个",
    },
}
_LONGEST_PATTERN = 64
_MOST_WORDS = 50
_FASTEST_BAUD = 4_000_000


class VoiceError(ToldError, ValueError):
    """A voice map that isn't there, isn't TOML or can't be."""

    SENTENCES = _SENTENCES


class VoiceMap(NamedTuple):
    """The module's baud rate (8N1), and the bytes it sends for each voice of `motorcade.car.brain`."""

    baud: int
    patterns: tuple[tuple[bytes, int], ...]


def load_voice_map(path: Path) -> VoiceMap:
    """The voice map at ``path``. Raises VoiceError, whose sentence names the file and the key at fault."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        raise VoiceError("unreadable", where=path, reason=getattr(error, "strerror", None) or NO_TEXT) from None
    return parse_voice_map(text, path.name)


def parse_voice_map(text: str, where: str) -> VoiceMap:
    """The VoiceMap in TOML ``text``; ``where`` is the file's name for the sentences. Raises VoiceError."""
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise VoiceError("no-toml", where=where, reason=error) from None
    _check_keys(table, ("format", "baud", "word"), where)
    if table.get("format") != FORMAT:
        raise VoiceError("format", where=where, value=repr(table.get("format")), format=FORMAT)
    baud = table.get("baud")
    if type(baud) is not int or not 1 <= baud <= _FASTEST_BAUD:
        raise VoiceError("baud", where=where, value=repr(baud))
    words = table.get("word")
    if not isinstance(words, list) or not 1 <= len(words) <= _MOST_WORDS:
        raise VoiceError("words", where=where, most=_MOST_WORDS)
    patterns = tuple(_word(word, f"{where}, word[{number}]") for number, word in enumerate(words))
    for (inner, _), (outer, _) in permutations(patterns, 2):
        if inner in outer:
            first, second = (each.hex(" ").upper() for each in (inner, outer))
            raise VoiceError("part-of-another", where=where, inner=first, outer=second)
    return VoiceMap(baud, patterns)


def _word(word: Any, where: str) -> tuple[bytes, int]:
    if not isinstance(word, dict):
        raise VoiceError("no-table", where=where, value=repr(word))
    _check_keys(word, ("says", "bytes", "text"), where)
    voices = dict(WORDS)
    says = word.get("says")
    if not isinstance(says, str) or says not in voices:
        raise VoiceError("says", where=where, value=repr(says), known=", ".join(voices))
    return _pattern(word, where), voices[says]


def _pattern(word: dict[str, Any], where: str) -> bytes:
    if ("bytes" in word) == ("text" in word):
        raise VoiceError("bytes-or-text", where=where)
    if "text" in word:
        key, pattern = "text", word["text"]
        if not isinstance(pattern, str):
            raise VoiceError("no-text", where=where, value=repr(pattern))
        pattern = pattern.encode()
    else:
        key, value = "bytes", word["bytes"]
        try:
            pattern = bytes.fromhex(value)
        except (ValueError, TypeError):
            raise VoiceError("no-bytes", where=where, value=repr(value)) from None
    if not 1 <= len(pattern) <= _LONGEST_PATTERN:
        raise VoiceError("length", where=where, key=key, count=len(pattern), most=_LONGEST_PATTERN)
    return pattern


def _check_keys(table: dict[str, Any], known: tuple[str, ...], where: str) -> None:
    if unknown := [key for key in table if key not in known]:
        raise VoiceError("unknown-key", where=where, key=unknown[0], known=", ".join(known))
