"""The page in Firefox and WebKit: one mission; `make soak` walks through all that a pupil does."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from scripts import debian
from scripts.studio_process import StudioProcess

from motorcade.locales import catalogue
from support.engines import ENGINES, EnginePage

TEXTS = catalogue("en")["page"]
SETTINGS = {"theme": "light", "toured": True, "level": "words"}
READY = (
    "return !!document.querySelector('main[data-compiled]') && !!document.querySelector('#mat-play:not([disabled])')"
)
END, ENTER = "\ue010", "\ue007"


@pytest.fixture(params=ENGINES)
def engine(request: pytest.FixtureRequest, install_lock, tmp_path: Path) -> Iterator[EnginePage]:
    """A page in each of the engines; it reports no error."""
    command, packages, start = ENGINES[request.param]
    with install_lock:
        found = debian.find_or_install(command, *packages)
    if found is None:
        pytest.skip(f"there is no {command}; on Debian: apt-get install {' '.join(packages)}")
    (folder := tmp_path / "profile").mkdir()
    with start(folder) as page:
        page.resize(1440, 900)
        yield page
    assert page.faults == []


def open_studio(page: EnginePage, url: str) -> None:
    """Open the studio as who has been there before, and wait for blocks, words and cars."""
    page.go(url)
    page.store({"motorcade.language": "en", "motorcade.settings": json.dumps(SETTINGS)})
    page.go(url.partition("?")[0])
    page.wait_for(READY)


def play_mission(page: EnginePage) -> None:
    """Flip a bit, and drive sixteen times as fast to the stars."""
    page.click("button", TEXTS["missions"]["title"])
    page.click("[data-mission=flip-the-lamp]")
    page.expect("li[data-progress]")
    page.click("button", TEXTS["mat"]["speed"])
    page.press(END, ENTER)
    # The second word is the followers'.
    page.click("button", "Bit 22", number=1)
    page.click("#mat-play")
    page.wait_for("return document.querySelectorAll('li[data-progress=met]').length === 3")


def test_a_mission_is_passed(engine: EnginePage, studio_of_server: StudioProcess) -> None:
    open_studio(engine, studio_of_server.url)
    play_mission(engine)
