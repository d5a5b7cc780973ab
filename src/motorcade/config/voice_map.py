"""Voice maps: what a voice module sends for which spoken word, in TOML.

    format = "motorcade-voice/1"
    baud = 9600

    [[word]]
    says = "stop"
    bytes = "AA 01"     # hexadecimal; or text = "stop\\r\\n", sent as UTF-8

Makers and users program such modules themselves, so each sends bytes of its own.
"""

from functools import cache
from itertools import permutations
from pathlib import Path
from typing import Any, NamedTuple

from motorcade.car.board import VOICE_WORDS
from motorcade.config.check import Schema, allowed_as, choice, list_of, load, shown, table, whole
from motorcade.config.files import parse, read_text
from motorcade.errors import MotorcadeError, Phrase

FORMAT = "motorcade-voice/1"
_LONGEST_PATTERN = 64
_MOST_WORDS = 50
_FASTEST_BAUD = 4_000_000


class VoiceMap(NamedTuple):
    """The module's baud rate (8N1), and the bytes it sends for each voice of `motorcade.car.brain`."""

    baud: int
    patterns: tuple[tuple[bytes, int], ...]


@cache
def voice_map_schema() -> Schema:
    """The JSON Schema of a voice map, parsed."""
    word = table(
        ("bytes", "text"),
        says=choice(*(name for name, _ in VOICE_WORDS)),
        bytes=allowed_as("hexadecimal", {"type": "string"}),
        text={"type": "string"},
    )
    words = list_of(word | {"oneOf": [{"required": ["bytes"]}, {"required": ["text"]}]}, 1, _MOST_WORDS)
    return table(format=choice(FORMAT), baud=whole(1, _FASTEST_BAUD), word=words)


def load_voice_map(path: Path) -> VoiceMap:
    """Return the voice map at ``path``. Raises MotorcadeError, which names the file and the key that is wrong."""
    return parse_voice_map(read_text(path, Phrase("voice-map-file", path=path)), path.name)


def parse_voice_map(text: str, file: str) -> VoiceMap:
    """Return the VoiceMap in TOML ``text``; ``file`` is what errors call it. Raises MotorcadeError."""
    values = load(parse(text, "TOML", file), voice_map_schema(), file)
    voices = dict(VOICE_WORDS)
    patterns = tuple(
        (_pattern(word, f"word[{number}]", file), voices[word["says"]]) for number, word in enumerate(values["word"])
    )
    for (inner, _), (outer, _) in permutations(patterns, 2):
        if inner in outer:
            first, second = (each.hex(" ").upper() for each in (inner, outer))
            raise MotorcadeError("pattern-in-another", file=file, inner=first, outer=second)
    return VoiceMap(values["baud"], patterns)


def _pattern(word: dict[str, Any], place: str, file: str) -> bytes:
    key = "text" if "text" in word else "bytes"
    try:
        pattern = word[key].encode() if key == "text" else bytes.fromhex(word[key])
    except ValueError:
        details = {"file": file, "place": f"{place}.{key}", "value": shown(word[key])}
        raise MotorcadeError("not-allowed", **details, allowed=Phrase("hexadecimal")) from None
    if not 1 <= len(pattern) <= _LONGEST_PATTERN:
        length = {"count": len(pattern), "most": _LONGEST_PATTERN}
        raise MotorcadeError("pattern-length", file=file, place=f"{place}.{key}", **length)
    return pattern
