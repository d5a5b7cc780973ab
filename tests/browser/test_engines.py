"""The page in Firefox and WebKit: one mission; `make soak` drags blocks, goes offline, joins a class and drives."""

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urljoin

import pytest
from filelock import FileLock
from scripts import debian
from scripts.studio_process import StudioProcess

from motorcade.browser.site import site_files, write_site
from motorcade.locales import catalogue
from support.engines import ENGINES, EnginePage
from support.running_studio import started_class
from support.site_server import serving
from support.soak import SOAK

TEXTS = catalogue("en")["page"]
KEPT = {
    "motorcade.language": "en",
    "motorcade.settings": json.dumps({"theme": "light", "toured": True, "level": "words", "userName": ""}),
}
READY = "return document.querySelectorAll('main[data-compiled], #mat-play:not([disabled])').length === 2"
END, ENTER = "\ue010", "\ue007"
# Whether the hat's text ends within the hat.
WHOLE = """const [hat] = document.querySelectorAll(".blocklyDraggable");
    const right = (part) => hat.querySelector(part).getBoundingClientRect().right;
    return right(".blocklyText") < right(".blocklyPath");"""
CONTROLLED = "return !!navigator.serviceWorker.controller"


@pytest.fixture(params=[pytest.param(name, marks=[pytest.mark.soak] * (name != "webkit")) for name in ENGINES])
def engine(request: pytest.FixtureRequest, install_lock: FileLock, tmp_path: Path) -> Iterator[EnginePage]:
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


def open_page(page: EnginePage, url: str) -> None:
    """Open a page as who has been there before."""
    page.go(url)
    base = url.partition("?")[0]
    # What is kept is written where no page would overwrite it when it is left.
    page.go(urljoin(base, "icon.svg"))
    page.store(KEPT)
    page.go(base)


def open_studio(page: EnginePage, url: str) -> None:
    """Open the studio, and wait for blocks, words and cars."""
    open_page(page, url)
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
    engine.wait_for(WHOLE)
    play_mission(engine)


LEADER = f"section[aria-label='{TEXTS['editors']['leader']}']"
PROGRAM = f'[aria-label="{TEXTS["editors"]["leaderBlocks"]}"]'
WORDS = "return document.querySelector('[role=grid]')?.textContent.match(/[0-9A-F]{8}/g)?.join(' ') === a[0]"


def drag_out(page: EnginePage, block: str, below: str, by: str) -> None:
    """Drag a block out of the drawer 'Drive', and drop it below the lowest block that has such a text."""
    page.click(f"{LEADER} [role=treeitem]", TEXTS["drawers"]["drive"], by=by)
    left, top, _, height = page.box(f"{LEADER} [role=option]", block)
    below_left, below_top, _, below_height = page.box(f"{PROGRAM} .blocklyDraggable", below, number=-1)
    x, y = below_left + 12, below_top + below_height + height / 2
    start = (left + 12, top + height / 2)
    page.drag([start, (start[0] + 40, start[1] + 10), (x + 30, y + 30), (x + 5, y + 5), (x, y)], by=by)


class TestWalk:
    """Blocks by hand, a mission without a network, a class, and a car that is driven."""

    __test__ = SOAK

    @pytest.mark.parametrize("by", ["mouse", "touch"])
    def test_blocks_are_dragged_and_become_words(
        self, engine: EnginePage, studio_of_server: StudioProcess, by: str
    ) -> None:
        if by == "touch" and not engine.has_touch:
            pytest.skip("its driver takes a finger for a mouse")
        open_studio(engine, studio_of_server.url)
        drag_out(engine, "drive, forward", TEXTS["editors"]["leader"], by)
        drag_out(engine, "wait, 1", "forward", by)
        engine.click("[role=tab]", TEXTS["drawer"]["words"])
        engine.wait_for(WORDS, "02000000 64800000 60800000")

    def test_the_site_needs_no_network_later(self, engine: EnginePage, page_built: None, tmp_path: Path) -> None:
        write_site(tmp_path / "site", site_files())
        with serving(tmp_path / "site") as site:
            open_page(engine, site.url)
            engine.wait_for(CONTROLLED)
        engine.go(site.url)
        engine.wait_for(READY)
        play_mission(engine)

    def test_a_pupil_joins_a_class(self, engine: EnginePage, page_built: None, tmp_path: Path) -> None:
        with started_class(tmp_path / "class") as (_, told):
            base = told["addresses"][0]
            open_page(engine, base)
            engine.go(f"{base}join#{told['code']}")
            engine.click("input", TEXTS["class"]["nickname"])
            engine.press(*"Mia")
            engine.click("button", TEXTS["class"]["comeIn"])
            engine.click("button", TEXTS["class"]["goOn"])
            engine.wait_for(READY)
            engine.expect(f"[aria-label='{TEXTS['pupil']['title']}']")

    def test_a_car_is_driven_by_keys(self, engine: EnginePage, page_built: None) -> None:
        command = [sys.executable, "-m", "motorcade", "drive", "serve", "--port", "0", "--web", "0", "--json"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, encoding="utf-8") as process:
            assert process.stdout
            try:
                open_page(engine, json.loads(process.stdout.readline())["url"])
                engine.expect("[role=status]", TEXTS["remote"]["ready"])
                engine.hold("w")
                engine.expect("[role=status]", TEXTS["remote"]["moving"])
                engine.release("w")
                engine.expect("[role=status]", TEXTS["remote"]["ready"])
            finally:
                process.kill()
