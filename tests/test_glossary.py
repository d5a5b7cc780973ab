"""Chinese has one word for a thing, on pages, missions, documentation and command line alike."""

import re
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from scripts.site_pages import write_pages

from motorcade import locales

ROOT = Path(__file__).parent.parent
# What isn't said, and what is said in its place. A mirror of packages is 镜像站.
SAID = {
    r"主机": "头车",
    r"从机|跟随车": "跟车",
    r"领队车": "头车",
    r"比特": "位",
    r"计算机": "电脑",
    r"地垫": "场地",
    r"镜像(?!站)": "映像",
    r"附加项": "附加组件",
    r"主板|开发板": "板子",
    r"[0-9}] ?[个台](小车|头车|跟车)(?!码字|状态)": "辆",
}
# Makers read the protocol beside these pages, so they keep its two words, and say so.
OF_THE_PROTOCOL = (r"主机", r"从机|跟随车")
MAKERS = {"build-a-car.zh.md", "exports.zh.md", "seeds.zh.md", "words.zh.md", "write-a-board.zh.md"}
SAYS_SO = "主机就是头车，从机就是跟车"


def sentences(value, place=""):
    """Each text of a catalogue with its place."""
    if not isinstance(value, dict):
        yield place, value
        return
    for key, part in value.items():
        yield from sentences(part, f"{place}.{key}")


@cache
def chinese_texts():
    """Each place and its text; of the pages, lines."""
    texts = list(sentences(locales.catalogue("zh")))
    with TemporaryDirectory() as folder:
        write_pages(Path(folder))
        pages = (*ROOT.glob("docs/**/*.zh.md"), *ROOT.glob("*.zh.md"), *Path(folder).glob("*.zh.md"))
        for path in (*pages, *ROOT.glob("src/motorcade/missions/*/*.toml")):
            lines = path.read_text(encoding="utf-8").splitlines()
            texts += [(f"{path.name}:{number}", line) for number, line in enumerate(lines, 1)]
    return texts


@pytest.mark.parametrize("word", SAID)
def test_one_word_a_thing(word):
    kept = {".meanings"} | MAKERS if word in OF_THE_PROTOCOL else set()
    found = [
        f"{place}: {text}"
        for place, text in chinese_texts()
        if re.search(word, text) and SAYS_SO not in text and not place.startswith(tuple(kept))
    ]
    assert found == [], f"say {SAID[word]}"


def test_a_makers_page_says_what_its_two_words_mean():
    assert {place.partition(":")[0] for place, text in chinese_texts() if SAYS_SO in text} >= MAKERS


def test_no_goal_begins_with_a_number_after_its_own():
    """'1. 7 秒之前' is read as 1.7."""
    goals = [
        (place, text)
        for place, text in chinese_texts()
        if re.match(r"text = \{.*zh = \"[0-9]", text) or (place.startswith(".phrases.goal-") and text[0].isdigit())
    ]
    assert goals == []
