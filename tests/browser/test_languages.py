"""Each language is complete: no text of another one, and no key in place of a text; nothing keeps people out."""

import json
import os
import re
from collections.abc import Iterator
from pathlib import Path

import hatch_build
import pytest
from playwright.sync_api import expect
from scripts.studio_process import ROOT, running_studio

from motorcade.locales import catalogue
from support.layout import serious_barriers
from support.soak import SOAK
from support.studio_page import SHARED, StudioPage
from support.studio_programs import FOLLOWED, FURNISHED, TOO_LONG

LATIN = re.compile(r"[A-Za-z]{2,}")
CHINESE = re.compile(r"[\u3000-\u303f\u4e00-\u9fff\uff00-\uffef]+")
# Written the same in Chinese: names, kinds of files, and keys.
IN_EVERY_LANGUAGE = {SHARED, "Motorcade", "English", "中文", "LED", "CSV", "GIF", "MP", "SVG", "PNG"}
KEYS = {
    "Alt",
    "Backspace",
    "Control",
    "Ctrl",
    "Delete",
    "Down",
    "Enter",
    "Esc",
    "Menu",
    "Page",
    "Shift",
    "Space",
    "Tab",
}
# The snapshot's structure, and what isn't text: addresses, ports, places in a file, words in hexadecimal.
ROLE, STATE = re.compile(r"^\s*- '?/?[a-z]+", re.MULTILINE), re.compile(r"\[[a-z]+(=\w+)?\]")
FOREIGN = re.compile(r"^\s*- /url:.*$|http://\S+|/dev/\S+( n/a)?|\w+\[\d+\]|\b[0-9A-F]{8}\b", re.MULTILINE)


def visible_text(studio: StudioPage) -> str:
    """All text of the page, for the eye or a screen reader."""
    text = studio.page.locator("body").aria_snapshot()
    for structure in (FOREIGN, ROLE, STATE):
        text = structure.sub(" ", text)
    return text


def open_everything(studio: StudioPage) -> Iterator[bool]:
    """Open each part of the page that has texts, one after another; say whether it has more than texts."""
    keys = studio.page.keyboard
    studio.play()
    expect(studio.page.get_by_text(studio.say("mat.account.leaders.forward", count=1))).to_be_visible()
    studio.mat_button("pause").click()
    yield True
    for panel in ("swarm", "things", "timeline"):
        studio.look_up(panel)
        if panel == "things":
            studio.page.get_by_role("option", name=studio.say("mat.things.person")).click()
        yield True
    for menu in ("menu.project", "settings.title"):
        studio.page.get_by_role("button", name=studio.say(menu), exact=True).click()
        yield False
        keys.press("Escape")
    for dialog in ("upload", "library", "examples", "share", "help"):
        studio.open_dialog(dialog)
        yield True
        keys.press("Escape")
        expect(studio.page.get_by_role("dialog")).to_have_count(0)
    for drawer in ("drive", "light", "sense", "order", "infrared"):
        studio.editor("followers").get_by_role("treeitem", name=studio.say(f"drawers.{drawer}")).click()
        yield False


def text_keys(texts: dict, before: str = "") -> Iterator[str]:
    for key, text in texts.items():
        if isinstance(text, dict):
            yield from text_keys(text, f"{before}{key}.")
        else:
            yield before + key


def assert_complete(studio: StudioPage, other: re.Pattern[str]) -> None:
    """No text in the other language's letters, and no key in place of a text."""
    text = visible_text(studio)
    assert set(other.findall(text)) - IN_EVERY_LANGUAGE - KEYS == set()
    names = set(text_keys(catalogue("en")["page"]))
    assert set(re.findall(r"[a-z]\w*(?:\.\w+)+", text)) & names == set()


@pytest.mark.parametrize(
    ("language", "theme"), [("en", "light"), ("zh", "dark"), ("zh", "contrast")] if SOAK else [("zh", "contrast")]
)
def test_all_that_a_page_shows_is_in_one_language_and_has_no_barriers(open_page, language, theme) -> None:
    studio = open_page(language=language, theme=theme, project=FURNISHED)
    other = {"zh": LATIN, "en": CHINESE}[language]
    for has_more in open_everything(studio):
        assert_complete(studio, other)
        assert not has_more or serious_barriers(studio.page) == []
    studio.page.keyboard.press("Escape")
    studio.take(TOO_LONG)
    expect(studio.diagnostics).not_to_have_count(0)
    assert_complete(studio, other)


def test_the_language_changes_at_once_and_is_remembered(open_page) -> None:
    studio = open_page(project=FOLLOWED)
    studio.pick(studio.field(studio.block("leader", "left"), "left"), "right")
    studio.choose("Language and colours", item="中文")
    editor = studio.page.get_by_role("region", name="头车", exact=True)
    expect(editor).to_contain_text("前进")
    # An edit of before is undone and done again.
    for button, direction in (("撤销", "左转"), ("重做", "右转")):
        studio.page.get_by_role("button", name=button).click()
        expect(editor).to_contain_text(direction)
    expect(studio.page.get_by_role("tab", name="码字", exact=True)).to_be_visible()
    studio.page.reload()
    expect(editor).to_contain_text("前进")
    expect(studio.page.locator("html")).to_have_attribute("lang", re.compile("^zh"))


def marked(texts: dict | str) -> dict | str:
    """The same texts, each between marks."""
    if isinstance(texts, str):
        return f"«{texts}»"
    return {key: marked(text) for key, text in texts.items()}


@pytest.fixture
def locales_with_a_third(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with English, Chinese and one more file, which page and server read in this test."""
    folder = tmp_path / "locales"
    folder.mkdir()
    for language in ("en", "zh"):
        (folder / f"{language}.json").write_text(json.dumps(catalogue(language)), encoding="utf-8")
    third = {**marked(catalogue("en")), "language": "Esperanto"}
    (folder / "eo.json").write_text(json.dumps(third), encoding="utf-8")
    monkeypatch.setenv("MOTORCADE_LOCALES", str(folder))
    return folder


@pytest.mark.soak
def test_a_third_language_is_one_file(browser, page_built, locales_with_a_third, tmp_path) -> None:
    build = tmp_path / "page"
    hatch_build.npm_run(ROOT, "build", "--outDir", str(build))
    with running_studio(tmp_path / "library", environment={**os.environ}) as process:
        studio = StudioPage.open(browser, process.url, project=FOLLOWED, build=build)
        studio.choose("Language and colours", item="Esperanto")
        expect(studio.page.locator("html")).to_have_attribute("lang", "eo")
        expect(studio.page.get_by_role("tab", name="«Words»", exact=True)).to_be_visible()
        expect(studio.page.get_by_role("region", name="«Leader»", exact=True)).to_contain_text("«drive")
        # A refusal of the server is shown in the language too.
        studio.forgive("400 (Bad Request)")
        studio.page.get_by_role("textbox", name="«Project name»").fill(" . ")
        studio.choose("«Project»", item="«Save to the library»")
        refusal = f"«{catalogue('en')['errors']['bad-project-name'].partition('{')[0]}"
        expect(studio.page.get_by_role("log", name="«Messages»")).to_contain_text(refusal)
        studio.context.close()
        assert studio.faults == []
