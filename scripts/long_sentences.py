"""List the longest sentences that a user reads: ``python -m scripts.long_sentences``.

It reads the documentation, the READMEs, CONTRIBUTING, SECURITY and the texts in locales/. A sentence should
have at most 35 words, in Chinese at most 70 characters; the list says which are longer, and where. It is no rule.
"""

import argparse
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parents[1]
LOCALES = ROOT / "src" / "motorcade" / "locales"
MOST = {"en": 35, "zh": 70}
_CHINESE = re.compile(r"[\u3400-\u9fff]")
# What counts as one: a Chinese character, or a word, a name or a number in other letters.
_COUNTED = re.compile(r"[\u3400-\u9fff]|[^\W\u3400-\u9fff][^\s\u3000-\u9fff\uff00-\uffef]*")
_END = re.compile(r"(?<=[.!?])['\")*]*\s+|(?<=[。！？])")
# What stands in a page but isn't read as part of a sentence, or is read as one word.
_NOT_READ = re.compile(r"^( *)```.*?^\1```$|<!--.*?-->|^#[^\n]*$|\{ [^}]* \}", re.MULTILINE | re.DOTALL)
_ONE_WORD = re.compile(r"`[^`]*`|\{+[\w ,.:]*\}+")
_LINK = re.compile(r"!?\[([^]]*)\]\([^)]*\)")
# Where a new thought begins: a paragraph, an item of a list, a cell of a table.
_APART = re.compile(r"\n\s*\n|\n\s*(?:[-*]|\d+\.)\s|\s*\|\s*|\n(?=!!!|\?\?\?)")


class Sentence(NamedTuple):
    """A sentence: what it is more than allowed, its length in words or Chinese characters, and where it stands."""

    over: int
    length: int
    place: str
    text: str


def sentences() -> list[Sentence]:
    """Return all of them, those that are most too long first."""
    found = [sentence for place, text in _texts() for sentence in _split(place, text)]
    return sorted(found, reverse=True)


def _texts() -> Iterator[tuple[str, str]]:
    for page in (*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md"))):
        text = _NOT_READ.sub("\n\n", page.read_text(encoding="utf-8"))
        if page.name != "CHANGELOG.md":
            yield str(page.relative_to(ROOT)), text
    for file in sorted(LOCALES.glob("*.json")):
        yield from _values(file.name, json.loads(file.read_text(encoding="utf-8")))


def _values(place: str, value: Any) -> Iterator[tuple[str, str]]:
    if isinstance(value, dict):
        for key, below in value.items():
            yield from _values(f"{place} {key}", below)
    elif isinstance(value, str):
        yield place, value


def _split(place: str, text: str) -> Iterator[Sentence]:
    for part in _APART.split(_LINK.sub(r"\1", _ONE_WORD.sub("x", text))):
        for sentence in _END.split(" ".join(part.split())):
            length = len(_COUNTED.findall(sentence))
            language = "zh" if _CHINESE.search(sentence) else "en"
            yield Sentence(length - MOST[language], length, place, sentence)


def main() -> None:
    """Print the list."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=69, help="how many to list")
    count = parser.parse_args().count
    found = sentences()
    for sentence in found[:count]:
        print(f"{sentence.length:4} {sentence.place}: {sentence.text}")
    print(f"{sum(sentence.over > 0 for sentence in found)} of {len(found)} sentences are too long.")


if __name__ == "__main__":
    main()
