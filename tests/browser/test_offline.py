"""The site's service worker: the studio without a network, and a newer build beside the one in use."""

import json
import shutil

import pytest
from playwright.sync_api import Page, expect

from motorcade.browser.site import PAGE, python_zip, site_files, write_site
from motorcade.locales import catalogue
from support.browser_profiles import FEW_PICTURES, WITHOUT_PYTHON, storing
from support.site_server import SiteServer, serving

PAGE_TEXTS = catalogue("en")["page"]
TEXTS = PAGE_TEXTS["site"]
NAME = PAGE_TEXTS["project"]["name"]
AWAY_MS = 61_000
LOOK_MS = 31_000
# Python takes a second or two to start, on a busy machine a minute.
PYTHON_MS = 120_000
TITLE, NEXT_TITLE = "Motorcade", "Next build"
STORED = {"motorcade.language": "en", "motorcade.settings": json.dumps({"toured": True})}
EXPECTED = ("Failed to find a valid digest", "ERR_CONNECTION_REFUSED", "ERR_INTERNET_DISCONNECTED")
# The policy of the page forbids what Playwright's own waiting does.
CONTROLLED = """navigator.serviceWorker.controller
    ? null : new Promise((done) => navigator.serviceWorker.addEventListener("controllerchange", () => done(null)))"""
TRIED = """navigator.serviceWorker.getRegistration().then((it) => it.update()).then(({ installing }) =>
    installing && new Promise((done) => installing.addEventListener("statechange", () => done(installing.state))))"""
# What a page gets that is opened now; to open one would start Python once more.
OPENED_NOW = "fetch(location.href).then((answer) => answer.text())"


@pytest.fixture(scope="module")
def builds(page_built: None, tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, bytes]]:
    """A site, and one of another build: its page has another title, and its Python is other."""
    page = shutil.copytree(PAGE, tmp_path_factory.mktemp("next") / "page")
    text = (page / "site.html").read_text(encoding="utf-8")
    (page / "site.html").write_text(text.replace(f"<title>{TITLE}<", f"<title>{NEXT_TITLE}<"), encoding="utf-8")
    # The same archive, with a comment at its end.
    python = python_zip()
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("motorcade.browser.site.python_zip", lambda: python)
        first = site_files()
        patched.setattr("motorcade.browser.site.python_zip", lambda: python[:-2] + b"\x05\x00other")
        return [first, site_files(page)]


@pytest.fixture
def folder(builds, tmp_path):
    write_site(tmp_path / "site", builds[0])
    return tmp_path / "site"


@pytest.fixture
def server(folder):
    with serving(folder) as server:
        yield server
    assert server.violations == []


@pytest.fixture
def context(browser, server):
    context = browser.new_context(storage_state=storing(server.url, STORED))
    context.add_init_script(FEW_PICTURES)
    faults: list[str] = []
    context.on("console", lambda message: faults.append(message.text) if message.type == "error" else None)
    context.on("weberror", lambda fault: faults.append(str(fault.error)))
    yield context
    context.close()
    # A file with a wrong hash, and a server that is gone, are parts of these tests.
    assert [fault for fault in faults if not any(each in fault for each in EXPECTED)] == []


def visit(context, server: SiteServer) -> Page:
    """A page whose service worker has stored the site."""
    page = context.new_page()
    page.goto(server.url)
    page.evaluate(CONTROLLED)
    return page


def look_for_update(page: Page) -> str:
    """Look for another build, as the page does itself once an hour; the state that its service worker came to."""
    return page.evaluate(TRIED)


def is_whole(page: Page, title: str) -> None:
    """The page shows the studio, of the build with this title."""
    expect(page.get_by_label(NAME)).to_be_visible()
    expect(page.locator("#leader-blocks")).to_be_visible()
    expect(page).to_have_title(title)


def test_builds_follow_each_other_whole_and_the_last_needs_no_network(context, server, folder, builds):
    page = visit(context, server)
    assert_can_be_installed(page)

    # A build that isn't copied whole yet changes nothing.
    write_site(folder, builds[1])
    (python,) = folder.glob("python-*/python.zip")
    python.write_bytes(b"cut off")
    assert look_for_update(page) == "redundant"

    # A whole one waits until the user asks for it.
    write_site(folder, builds[1])
    assert look_for_update(page) == "installed"
    expect(page.get_by_role("log").filter(has_text=TEXTS["update"])).to_be_visible()
    assert f"<title>{TITLE}<" in page.evaluate(OPENED_NOW)
    page.get_by_label(NAME).fill("Mine")
    page.add_init_script(WITHOUT_PYTHON)
    page.get_by_role("button", name=TEXTS["useUpdate"]).click()
    is_whole(page, NEXT_TITLE)
    expect(page.get_by_label(NAME)).to_have_value("Mine")

    server.stop()
    page.close()
    page = context.new_page()
    page.goto(server.url)
    is_whole(page, NEXT_TITLE)
    # Python in the worker has compiled the blocks.
    expect(page.locator("main[data-compiled]")).to_be_attached(timeout=PYTHON_MS)


@pytest.mark.soak
def test_a_newer_build_takes_over_when_no_tab_has_work(context, server, folder, builds):
    pages = [context.new_page(), context.new_page()]
    for page in pages:
        page.clock.install()
        page.goto(server.url)
        page.evaluate(CONTROLLED)
    busy, other = pages
    busy.get_by_label(NAME).fill("Mine")
    expect(busy.get_by_text(PAGE_TEXTS["project"]["unsaved"], exact=True)).to_be_visible()
    write_site(folder, builds[1])
    assert look_for_update(other) == "installed"

    # Nobody is at either page for a minute, but one has unsaved work: not even a wish in the other replaces it.
    for page in pages:
        page.clock.fast_forward(AWAY_MS)
        page.clock.fast_forward(LOOK_MS)
    other.get_by_role("button", name=TEXTS["useUpdate"]).click()
    expect(other.get_by_role("log").filter(has_text=TEXTS["otherTabs"])).to_be_visible()
    expect(busy).to_have_title(TITLE)
    expect(busy.get_by_label(NAME)).to_have_value("Mine")

    expect(busy.locator("main[data-compiled]")).to_be_attached(timeout=PYTHON_MS)
    busy.keyboard.press("Control+s")
    expect(busy.get_by_text(PAGE_TEXTS["project"]["unsaved"], exact=True)).to_be_hidden()
    for page in (busy, other):
        page.clock.fast_forward(AWAY_MS)
    other.clock.fast_forward(LOOK_MS)
    for page in pages:
        expect(page).to_have_title(NEXT_TITLE)


def assert_can_be_installed(page: Page) -> None:
    """Chromium finds nothing that keeps the site from being installed as an app."""
    tools = page.context.new_cdp_session(page)
    assert tools.send("Page.getAppManifest")["errors"] == []
    errors = {each["errorId"] for each in tools.send("Page.getInstallabilityErrors")["installabilityErrors"]}
    # A browser profile of a test is one of these windows.
    assert errors <= {"in-incognito"}
