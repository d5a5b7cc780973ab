"""Several tabs of one browser, by plain HTTP, where browsers have no locks: each keeps its own work and cars."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, BrowserContext, Locator, Page, Playwright, expect
from scripts.studio_process import project_link

from motorcade.browser.site import site_files, write_site
from motorcade.locales import catalogue
from support.browser_profiles import FEW_PICTURES, WITHOUT_PYTHON, launched, storing
from support.class_visits import ClassVisit
from support.running_studio import started, started_class
from support.site_server import serving
from support.studio_programs import EXAMPLE
from support.waiting import wait_until

TEXTS = catalogue("en")["page"]
# For a browser it is another computer, so nothing there is a secure context.
OTHER_HOST = "10.0.0.7"
MAPPED = f"--host-resolver-rules=MAP {OTHER_HOST} 127.0.0.1,MAP * ~NOTFOUND,EXCLUDE 127.0.0.1"
STORED = "text => Object.values(localStorage).some(work => work.includes(text))"
# A browser copies a tab's storage into one that the tab opens, as into a duplicate.
DUPLICATE = "() => void window.open(location.href)"


@pytest.fixture(scope="module")
def http_browser(playwright: Playwright, chromium_path: Path) -> Iterator[Browser]:
    """A browser for which the pages at `OTHER_HOST` come from elsewhere."""
    with launched(playwright, chromium_path, "--disable-gpu", "--disable-software-rasterizer", MAPPED) as browser:
        yield browser


def elsewhere(url: str) -> str:
    return url.replace(urlsplit(url).hostname or "", OTHER_HOST)


def visit(browser: Browser, url: str, prepare: Callable[[BrowserContext], object] = lambda _: None) -> Page:
    """Open an address in a profile that has seen the tour."""
    kept = {"motorcade.language": "en", "motorcade.settings": '{"toured": true, "level": "words"}'}
    context = browser.new_context(storage_state=storing(url, kept))
    context.add_init_script(FEW_PICTURES)
    prepare(context)
    page = context.new_page()
    page.goto(url)
    return page


@contextmanager
def site_tab(browser: Browser, folder: Path) -> Iterator[Page]:
    write_site(folder, site_files())
    with serving(folder) as site:
        yield visit(browser, elsewhere(site.url), lambda context: context.add_init_script(WITHOUT_PYTHON))


@contextmanager
def studio_tab(browser: Browser, folder: Path) -> Iterator[Page]:
    with started(folder, "--host", "0.0.0.0", "--insecure-lan") as studio:
        yield visit(browser, elsewhere(studio.url))


@contextmanager
def class_tab(browser: Browser, folder: Path) -> Iterator[Page]:
    with started_class(folder) as (_, told):
        pupil = ClassVisit(browser, elsewhere(told["addresses"][0]))
        pupil.join("Mia", told["code"])
        yield pupil.page


SHELLS: dict[str, Callable] = {"site": site_tab, "studio": studio_tab, "class": class_tab}


def in_shells(wanted: str) -> pytest.MarkDecorator:
    """Run a test in all shells, whose pages share the code that is tested; in those but ``wanted`` by `make soak`."""
    waiting = {name: [] if name == wanted else [pytest.mark.soak] for name in SHELLS}
    return pytest.mark.parametrize(
        "tab", [pytest.param(name, marks=marks) for name, marks in waiting.items()], indirect=True
    )


@pytest.fixture
def tab(request: pytest.FixtureRequest, http_browser: Browser, page_built: None, tmp_path: Path) -> Iterator[Page]:
    with SHELLS[request.param](http_browser, tmp_path / "kept") as page:
        yield ready(page)
        page.context.close()


def ready(page: Page) -> Page:
    """Wait for the blocks; a site's Python isn't waited for."""
    expect(page.locator("#leader-blocks .blocklyBlock").first).to_be_visible()
    return page


def name_of(page: Page) -> Locator:
    return page.get_by_role("textbox", name=TEXTS["project"]["name"])


def work_on(page: Page, name: str) -> None:
    """Change what the tab shows, and wait until the browser has stored it."""
    name_of(page).fill(name)
    wait_until(lambda: page.evaluate(STORED, f'"name":"{name}"'))


def expect_work(page: Page, name: str) -> None:
    """The tab shows this, also after a reload."""
    expect(name_of(page)).to_have_value(name)
    page.reload()
    expect(name_of(page)).to_have_value(name)


def another_tab(context: BrowserContext, url: str) -> Page:
    page = context.new_page()
    page.goto(url)
    return ready(page)


def duplicate_of(page: Page) -> Page:
    with page.context.expect_page() as opened:
        page.evaluate(DUPLICATE)
    return ready(opened.value)


@in_shells("class")
def test_tabs_keep_their_own_work_without_locks_and_a_closed_ones_is_found_again(tab) -> None:
    assert not tab.evaluate("'locks' in navigator")
    work_on(tab, "First")
    other = another_tab(tab.context, tab.url)
    work_on(other, "Second")
    work_on(tab, "First, changed")
    expect_work(other, "Second")
    expect_work(tab, "First, changed")
    other.close()
    expect_work(another_tab(tab.context, tab.url), "Second")


@in_shells("site")
def test_a_duplicated_tab_begins_with_the_same_work_and_keeps_its_own_from_then_on(tab) -> None:
    work_on(tab, "Original")
    copy = duplicate_of(tab)
    expect(name_of(copy)).to_have_value("Original")
    work_on(copy, "Copy")
    work_on(tab, "Original, changed")
    expect_work(copy, "Copy")
    expect_work(tab, "Original, changed")


@pytest.mark.parametrize("tab", ["studio"], indirect=True)
def test_a_duplicated_tab_has_cars_of_its_own(tab) -> None:
    copy = duplicate_of(tab)
    for page in (copy, tab):
        page.locator("#mat-play").click()
        expect(page.locator("#mat-play")).to_have_text(TEXTS["mat"]["pause"])
    for page in (copy, tab):
        expect(page.get_by_role("button", name=TEXTS["mat"]["comeBack"])).to_have_count(0)


@pytest.mark.parametrize("tab", ["studio"], indirect=True)
def test_blocks_are_pasted_in_another_tab_and_a_paste_of_nothing_says_what_to_do(tab) -> None:
    address = tab.url
    paste_into(other := another_tab(tab.context, address))
    expect(other.get_by_role("log")).to_contain_text(TEXTS["clipboard"]["empty"])
    tab.evaluate("link => { location.hash = new URL(link).hash }", project_link(address, EXAMPLE))
    expect(blocks_of(tab)).to_have_count(3)
    # The block's own outline, below its icon.
    blocks_of(tab).last.locator(":scope > .blocklyPath").first.click(position={"x": 4, "y": 20}, force=True)
    tab.keyboard.press("ControlOrMeta+c")
    paste_into(other)
    expect(blocks_of(other)).to_have_count(2)
    # A tab that is opened afterwards has them too.
    paste_into(third := another_tab(tab.context, address))
    expect(blocks_of(third)).to_have_count(2)


def blocks_of(page: Page) -> Locator:
    return page.locator("#leader-blocks .blocklyBlockCanvas .blocklyBlock")


def paste_into(page: Page) -> None:
    blocks_of(page).first.locator(":scope > .blocklyPath").first.click(position={"x": 4, "y": 20}, force=True)
    page.keyboard.press("ControlOrMeta+v")
