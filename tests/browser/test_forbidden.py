"""What browsers and networks forbid: storage, WebAssembly, WebSockets. No work is lost; a sentence says what to do."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, Playwright, ViewportSize, expect

from motorcade.locales import catalogue
from support.browser_profiles import Profiles, launched, storing
from support.running_studio import started_class
from support.studio_page import DESKTOP
from support.waiting import wait_until

PAGE_TEXTS = catalogue("en")["page"]
NO_ROOM = """Storage.prototype.setItem = () => { throw new DOMException("It is full.", "QuotaExceededError") }"""
FORBIDDEN = """for (const name of ["localStorage", "sessionStorage"]) Object.defineProperty(window, name, {
    get() { throw new DOMException("The operation is insecure.", "SecurityError") }
}); window.BroadcastChannel = function () { throw new DOMException("", "SecurityError") }"""
# Some proxies refuse to pass a WebSocket on, and some answer nothing at all.
REFUSED = """window.WebSocket = class extends EventTarget {
    constructor() { super(); setTimeout(() => this.dispatchEvent(new CloseEvent("close"))) }
    close() {}
}"""
SWALLOWED = "window.WebSocket = class extends EventTarget { close() {} }"


@pytest.fixture
def open_with(profiles: Profiles) -> Iterator[Callable[[str, str], Page]]:
    """Opens an address in a page that runs a script before its own."""
    contexts = []

    def open_with(url: str, script: str) -> Page:
        kept = {"motorcade.settings": '{"toured": true, "level": "words"}', "motorcade.language": "en"}
        size: ViewportSize = {"width": DESKTOP[0], "height": DESKTOP[1]}
        contexts.append(profiles.new_context(storage_state=storing(url, kept), viewport=size, locale="en"))
        page = contexts[-1].new_page()
        # The profile's own storage is filled by a page, too.
        page.add_init_script(script)
        page.goto(url)
        return page

    yield open_with
    for context in contexts:
        profiles.take_back(context)


@pytest.fixture(scope="module")
def class_address(page_built: None, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with started_class(tmp_path_factory.mktemp("class") / "class") as (_, told):
        yield told["addresses"][0]


def asks_who_leaves(page: Page) -> bool:
    """Whether the browser asks before it closes the page."""
    asked: list[str] = []
    page.on("dialog", lambda dialog: (asked.append(dialog.type), dialog.dismiss()))
    other = page.context.new_page()
    page.close(run_before_unload=True)
    # A call lets Playwright hear what has happened.
    wait_until(lambda: other.title() == "" and (asked or page.is_closed()))
    return asked == ["beforeunload"]


@pytest.mark.parametrize("script", [NO_ROOM, FORBIDDEN])
def test_who_leaves_work_that_the_browser_cant_store_is_asked(open_with, studio_of_server, script) -> None:
    page = open_with(studio_of_server.url, script)
    expect(page.locator("#leader-blocks .blocklyBlock").first).to_be_visible()
    skip = page.get_by_role("button", name=PAGE_TEXTS["tour"]["skip"])
    if script == FORBIDDEN:
        skip.click()
    # Settings can be changed as ever.
    page.get_by_role("button", name=PAGE_TEXTS["settings"]["title"]).click()
    page.get_by_role("menuitemradio", name=PAGE_TEXTS["settings"]["dark"]).click()
    expect(page.locator("html[data-theme=dark]")).to_be_attached()
    page.get_by_role("textbox", name=PAGE_TEXTS["project"]["name"]).fill("Only here")
    expect(page.get_by_role("log")).to_contain_text(PAGE_TEXTS["project"]["notStored"])
    assert asks_who_leaves(page)


def test_who_leaves_stored_work_is_not_asked(open_with, studio_of_server) -> None:
    page = open_with(studio_of_server.url, "")
    expect(page.locator("#leader-blocks .blocklyBlock").first).to_be_visible()
    page.get_by_role("textbox", name=PAGE_TEXTS["project"]["name"]).fill("Stored")
    expect(page.get_by_text(PAGE_TEXTS["project"]["unsaved"], exact=True)).to_be_visible()
    assert not asks_who_leaves(page)


@pytest.mark.parametrize("path", ["join", "teacher", "wall", "privacy"])
def test_pages_of_a_class_open_without_storage(open_with, class_address, path) -> None:
    page = open_with(class_address + path, FORBIDDEN)
    expect(page.get_by_role("heading").first).to_be_visible()


@pytest.mark.parametrize("script", [REFUSED, SWALLOWED])
def test_a_studio_without_websockets_says_so(open_with, studio_of_server, script) -> None:
    page = open_with(studio_of_server.url, script)
    host = page.evaluate("location.host")
    text = PAGE_TEXTS["network"]["noSockets"].replace("{{host}}", host)
    expect(page.get_by_role("alert").filter(has_text=text)).to_be_visible()


def test_a_site_without_webassembly_says_so(playwright: Playwright, chromium_path: Path, studio_of_site) -> None:
    with launched(playwright, chromium_path, "--disable-gpu", "--js-flags=--jitless") as browser:
        page = browser.new_page(locale="en")
        page.goto(studio_of_site.url)
        assert page.evaluate("typeof WebAssembly") == "undefined"
        text = PAGE_TEXTS["server"]["noWebAssembly"].replace("{{host}}", page.evaluate("location.host"))
        expect(page.get_by_role("alert").filter(has_text=text)).to_be_visible()
        expect(page.locator("#leader-blocks .blocklyBlock").first).to_be_visible()
