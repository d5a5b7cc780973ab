"""What the site's page does around its worker: it shows its editor without Python, and Python begins again.

Three journeys of other files go through the site as well; `make soak` takes all of them.
"""

import json
import re
import zlib
from base64 import urlsafe_b64decode
from pathlib import Path
from types import SimpleNamespace

import pytest
from playwright.sync_api import Route, expect
from scripts.try_it import on_page_markdown

from motorcade.program.compiler import compile_program
from motorcade.program.model import read_program
from support.soak import SOAK
from support.studio_programs import EXAMPLE, FOLLOWED

# What is built is compiled in the worker, which sends a file and a stream as well. They share one page: each that is
# opened starts Python.
if not SOAK:
    from tests.browser.test_building import example_words, test_the_documents_example_is_built_with_the_mouse
    from tests.browser.test_projects import test_blocks_and_words_are_exported
    from tests.browser.test_upload import upload_and_read_back

    __all__ = [
        "example_words",
        "test_blocks_and_words_are_exported",
        "test_the_documents_example_is_built_with_the_mouse",
    ]

    def test_a_program_is_uploaded_to_the_virtual_car_and_read_back_as_blocks(show) -> None:
        upload_and_read_back(show(FOLLOWED))


DOCS = Path(__file__).parents[2] / "docs"

WORDS = ["02000000", "65800000", "6a800000"]
# A snapshot of another Python: it has the right length, and wrong content.
DAMAGE = """async () => {
    const cache = await caches.open("motorcade-python")
    for (const key of await cache.keys()) await cache.put(key, new Response(new Uint8Array(1 << 20)))
    return (await cache.keys()).length
}"""


# Once it is stored: a page's policy forbids Playwright to wait for a value.
SNAPSHOT_BYTES = """async () => {
    const cache = await caches.open("motorcade-python")
    for (let tries = 0; tries < 300; tries++) {
        const [key] = await cache.keys()
        if (key) return (await (await cache.match(key)).arrayBuffer()).byteLength
        await new Promise(resolve => setTimeout(resolve, 100))
    }
    return 0
}"""
# The memory with which Pyodide begins, and what it writes before that.
MOST_SNAPSHOT_BYTES = (30 << 20) + 4096


@pytest.fixture(scope="module")
def studio(studio_of_site):
    return studio_of_site


@pytest.mark.soak
def test_python_that_ends_begins_again_and_nothing_is_lost(show) -> None:
    studio = show(EXAMPLE)
    studio.expect_words(WORDS)
    studio.play()
    studio.expect_moving()
    [worker] = studio.page.workers
    worker.evaluate("setTimeout(() => { throw new Error('killed by the test') })")
    studio.forgive("killed by the test")
    banner = studio.page.get_by_role("alert").filter(has_text=studio.say("server.restarting"))
    expect(banner).to_be_visible()
    expect(studio.notices).to_contain_text(studio.say("server.restarted"))
    expect(banner).to_be_hidden()
    studio.expect_words(WORDS)
    # The world begins again, and plays as it did.
    studio.expect_moving()
    assert studio.page.workers != [worker]

    # What the site can't do isn't offered.
    studio.choose_car(0)
    expect(studio.page.get_by_role("link", name=studio.say("mat.drive"))).to_have_count(0)
    studio.open_dialog("upload")
    expect(studio.page.get_by_text(studio.say("upload.virtual"), exact=True)).to_be_visible()
    expect(studio.page.get_by_role("button", name=studio.say("upload.look"))).to_have_count(0)
    studio.page.keyboard.press("Escape")

    # A stored memory of Python that is damaged is forgotten. The world begins again, as it began the last time.
    studio.look_up("swarm")
    seed = studio.page.get_by_role("textbox", name=studio.say("mat.seed"))
    seed.fill("7")
    seed.press("Enter")
    assert studio.page.evaluate(DAMAGE) == 1
    studio.page.reload()
    studio.wait_until_ready()
    expect(studio.clock).to_have_text("0:00.0")
    expect(studio.mat_button("play")).to_be_enabled()
    expect(seed).to_have_value("7")
    studio.expect_words(WORDS)


def test_the_memory_of_python_is_stored_as_large_as_it_begins(show) -> None:
    """Pyodide can't begin with a larger one (its issue 6254): later visits would start slowly, without a word."""
    assert 0 < show(EXAMPLE).page.evaluate(SNAPSHOT_BYTES) <= MOST_SNAPSHOT_BYTES


def links_of_documentation(studio: str) -> list[str]:
    """All links by which the documentation opens the studio with a program, in both languages."""
    found = []
    for path in sorted(DOCS.glob("*.md")):
        page = SimpleNamespace(file=SimpleNamespace(src_uri=path.name))
        text = on_page_markdown(path.read_text(encoding="utf-8"), page, {"extra": {"studio": studio}}, None)
        found += re.findall(rf"\]\(({re.escape(studio)}#project=[^)]+)\)", text)
    return found


def test_links_of_the_documentation_open_their_programs(show) -> None:
    studio = show(EXAMPLE)
    links = links_of_documentation(studio.url)
    assert len(links) >= 20
    for link in links if SOAK else links[:: len(links) - 1]:
        linked = json.loads(zlib.decompress(urlsafe_b64decode(link.partition("=")[2] + "=="), wbits=-zlib.MAX_WBITS))
        studio.page.goto(link)
        # What the link before opened isn't saved.
        studio.page.get_by_role("button", name=studio.say("project.replaceYes")).click()
        expect(studio.name).to_have_value(linked["name"])
        studio.expect_words([f"{word:08x}" for word in compile_program(read_program(linked["text"])).words])


def test_cars_drive_before_python_is_ready_and_go_on_when_it_is(show) -> None:
    page = show(EXAMPLE)
    waiting: list[Route] = []
    # As if nobody had been here, but for Python's memory. The studio would store its work when it is left.
    page.page.goto(f"{page.url}icon.svg")
    page.page.evaluate("localStorage.clear(), sessionStorage.clear()")
    page.page.route("**/python.zip", lambda route: waiting.append(route))
    page.page.goto(page.url)
    drives = re.compile(r"0:0[1-9]\.\d")
    expect(page.clock).to_have_text(drives)
    # Whoever comes back finds the same, as nothing was changed.
    expect(page.block("leader", "follow the line")).to_be_visible()
    page.page.reload()
    expect(page.clock).to_have_text(drives)
    page.mat_button("pause").click()
    expect(page.mat_button("play")).to_be_visible()
    paused = page.clock.inner_text()
    # A tap tells a car's word, another shows its bits; Python knows no more of them than the page.
    card = page.page.locator("#stage").get_by_role("region", name=page.say("mat.car", number=0))
    stage = page.page.get_by_role("application", name=page.say("mat.canvas"))
    # The leader always has a word; which one depends on when the cars were paused.
    for key in ("n", "Enter"):
        stage.press(key)
    expect(card).to_contain_text("follow the line · medium")
    stage.press("Enter")
    expect(card).to_contain_text("motor on: 1, yes (bit 29)")
    page.mat_button("play").click()
    expect(page.clock).not_to_have_text(paused)
    for route in waiting:
        route.continue_()
    # Only Python knows the words of other blocks.
    page.page.get_by_role("button", name="Make your own", exact=True).click()
    page.drag_out("followers", "drive", "drive", below=page.block("followers", "The others"))
    expect(page.page.get_by_text(page.say("tour.choose.text"))).to_be_visible()
    # What a project begins with stands until somebody plays.
    expect(page.mat_button("play")).to_be_enabled()
    expect(page.clock).to_have_text("0:00.0")
    page.play()
    page.expect_moving()
    page.page.unroute_all()


def test_the_editor_is_there_before_python_and_says_what_play_waits_for(show) -> None:
    page = show(EXAMPLE)
    page.page.route("**/python.zip", lambda route: None)
    page.page.reload()
    expect(page.block("leader", "forward")).to_be_visible()
    expect(page.page.locator("#mat-play")).to_be_disabled()
    expect(page.page.locator("#mat-play")).to_have_text(page.say("mat.waits.python"))
    expect(
        page.page.locator("#stage").get_by_role("status").filter(has_text=page.say("server.starting"))
    ).to_be_visible()
    page.page.get_by_role("button", name=page.say("missions.title"), exact=True).click()
    expect(page.dialog("missions.title").get_by_text(page.say("server.starting"))).to_be_visible()
    page.page.unroute_all()
