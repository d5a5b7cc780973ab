"""The site's service worker: the studio without a network, and a newer build beside the one in use."""

import shutil

import pytest
from playwright.sync_api import Page, expect

from motorcade.locales import catalogue
from motorcade.site import PAGE, site_files, write_site
from support.site_server import SiteServer, serving

TEXTS = catalogue("en")["page"]["site"]
TITLE, NEXT_TITLE = "Motorcade", "Next build"
# The policy of the page forbids what Playwright's own waiting does.
CONTROLLED = """navigator.serviceWorker.controller
    ? null : new Promise((done) => navigator.serviceWorker.addEventListener("controllerchange", () => done(null)))"""
TRIED = """navigator.serviceWorker.getRegistration().then((it) => it.update()).then(({ installing }) =>
    installing && new Promise((done) => installing.addEventListener("statechange", () => done(installing.state))))"""


@pytest.fixture(scope="module")
def builds(page_built: None, tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, bytes]]:
    """A site, and one of another build: its page has another title, and its Python is other."""
    page = shutil.copytree(PAGE, tmp_path_factory.mktemp("next") / "page")
    text = (page / "site.html").read_text(encoding="utf-8")
    (page / "site.html").write_text(text.replace(f"<title>{TITLE}<", f"<title>{NEXT_TITLE}<"), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("motorcade.site.python_zip", lambda: b"other")
        following = site_files(page)
    return [site_files(), following]


@pytest.fixture
def folder(builds, tmp_path):
    write_site(tmp_path / "site", builds[0])
    return tmp_path / "site"


@pytest.fixture
def server(folder):
    with serving(folder) as server:
        yield server


@pytest.fixture
def context(browser):
    context = browser.new_context()
    context.add_init_script("localStorage.setItem('motorcade.language', 'en')")
    yield context
    context.close()


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
    expect(page.get_by_role("banner")).to_be_visible()
    expect(page).to_have_title(title)


def test_builds_follow_each_other_whole_and_the_last_needs_no_network(context, server, folder, builds):
    page = visit(context, server)
    assert_can_be_installed(page)

    # A build that isn't copied whole yet changes nothing.
    write_site(folder, builds[1])
    (python,) = folder.glob("python-*/python.zip")
    python.write_bytes(b"cut off")
    assert look_for_update(page) == "redundant"
    page.reload()
    is_whole(page, TITLE)

    # It waits until the user asks for it.
    write_site(folder, builds[1])
    assert look_for_update(page) == "installed"
    expect(page.get_by_role("log").filter(has_text=TEXTS["update"])).to_be_visible()
    page.reload()
    is_whole(page, TITLE)
    page.get_by_role("button", name=TEXTS["useUpdate"]).click()
    is_whole(page, NEXT_TITLE)

    server.stop()
    page.reload()
    is_whole(page, NEXT_TITLE)


def assert_can_be_installed(page: Page) -> None:
    """Chromium finds nothing that keeps the site from being installed as an app."""
    tools = page.context.new_cdp_session(page)
    assert tools.send("Page.getAppManifest")["errors"] == []
    errors = {each["errorId"] for each in tools.send("Page.getInstallabilityErrors")["installabilityErrors"]}
    # A browser profile of a test is one of these windows.
    assert errors <= {"in-incognito"}
