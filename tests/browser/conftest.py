"""A real studio and a real browser. A page fails its test if it reports an error or requests another host."""

from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from filelock import FileLock
from playwright.sync_api import Browser, Error, Playwright, sync_playwright
from scripts import chromium
from scripts.studio_process import StudioProcess, build_page, running_studio

from motorcade.browser.site import site_files, write_site
from support.browser_profiles import Profiles, launched
from support.site_server import SiteServer, serving
from support.studio_page import StudioPage

OpenPage = Callable[..., StudioPage]
Studio = StudioProcess | SiteServer

# What only a server has, and the tests that need it.
SERVER_ALONE = {
    "a server that ends and comes back": ("test_work_continues_after_the_server_crashed_and_came_back",),
    "a build of its own": ("test_a_third_language_is_one_file",),
    "the page that drives the cars of a world": ("test_the_leader_of_a_swarm_is_driven_while_its_followers_hear_it",),
}
# So many lines of what a page shows when its test fails, from its top and from its end, where dialogs and notices are.
TOP_LINES, END_LINES = 25, 15


@pytest.fixture(scope="session")
def chromium_path(install_lock: FileLock) -> Path:
    with install_lock:
        found = chromium.find_or_install_for_tests()
    if found is None:
        pytest.skip(f"there is no browser; {chromium.HOW_TO}")
    return found


# The synchronous Playwright holds an event loop while it lives, so it may not outlive this folder and meet other tests.
@pytest.fixture(scope="package")
def playwright() -> Iterator[Playwright]:
    with sync_playwright() as playwright:
        yield playwright


@pytest.fixture(scope="package")
def browser(playwright: Playwright, chromium_path: Path) -> Iterator[Browser]:
    # Without a graphics processor, as on old computers.
    with launched(playwright, chromium_path, "--disable-gpu", "--disable-software-rasterizer") as browser:
        yield browser


@pytest.fixture(scope="package")
def profiles(browser: Browser) -> Profiles:
    return Profiles(browser)


@pytest.fixture(scope="session")
def page_built(chromium_path: Path, page_lock: FileLock) -> None:
    with page_lock:
        build_page()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[Any]) -> Generator[None, Any, Any]:
    """Add to a failure what each open page showed, without which one on another machine can't be understood."""
    report = yield
    if call.excinfo is not None and call.when != "teardown":
        for context in getattr(getattr(item, "funcargs", {}).get("browser"), "contexts", ()):
            for page in context.pages:
                try:
                    shown = page.locator("body").aria_snapshot(timeout=5000).splitlines()
                except Error as error:
                    shown = [f"didn't answer: {error.message.splitlines()[0]}"]
                if len(shown) > TOP_LINES + END_LINES:
                    shown[TOP_LINES:-END_LINES] = ["…"]
                report.sections.append((f"page {page.url}", "\n".join(shown)))
    return report


def shells_of(test: str) -> list[str]:
    """The shells of the studio against which a test runs, by the function's name.

    `make soak` runs all tests of the page against a server and a site, except those that need what a site hasn't.
    `make test` runs them against the server, and three of them in `test_site.py`, which knows the site alone, as
    `test_offline.py` and `test_same_bits.py` do.
    """
    # Not above: conftest.py imports this file before pytest chooses the profile.
    from support.soak import SOAK

    if any(test in tests for tests in SERVER_ALONE.values()):
        return ["server"]
    return ["server", "site"] if SOAK else ["server"]


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Run each test of the studio's page against the shells that `shells_of` lists for it."""
    if "shell" in metafunc.fixturenames:
        metafunc.parametrize("shell", shells_of(metafunc.function.__name__), scope="session")


@pytest.fixture(scope="session")
def studio_of_server(page_built: None, tmp_path_factory: pytest.TempPathFactory) -> Iterator[StudioProcess]:
    with running_studio(tmp_path_factory.mktemp("library")) as studio:
        yield studio


@pytest.fixture(scope="session")
def studio_of_site(page_built: None, tmp_path_factory: pytest.TempPathFactory) -> Iterator[SiteServer]:
    """The studio as static files; what a page stores is in its own browser profile."""
    folder = tmp_path_factory.mktemp("site") / "site"
    write_site(folder, site_files())
    with serving(folder) as site:
        yield site
        assert violations(site) == []


@pytest.fixture(scope="session")
def studio(shell: str, request: pytest.FixtureRequest) -> Studio:
    """One studio for all tests that don't change it."""
    found: Studio = request.getfixturevalue(f"studio_of_{shell}")
    return found


@pytest.fixture
def own_studio(shell: str, request: pytest.FixtureRequest, page_built: None, tmp_path: Path) -> Iterator[Studio]:
    """A studio with an empty library; a test may kill a server."""
    if shell == "site":
        yield request.getfixturevalue("studio_of_site")
        return
    with running_studio(tmp_path / "library") as studio:
        yield studio


def violations(studio: Studio) -> list[str]:
    """What pages and workers of a site wanted to do against its policy; a page's console tells of its own too."""
    return studio.violations if isinstance(studio, SiteServer) else []


@contextmanager
def visitors(profiles: Profiles, studio: Studio) -> Iterator[OpenPage]:
    """Opens pages, each in a browser profile of its own, and checks their faults at the end of the test."""
    opened: list[StudioPage] = []

    def open_page(**wishes: Any) -> StudioPage:
        opened.append(StudioPage.open(profiles, studio.url, **wishes))
        return opened[-1]

    yield open_page
    for page in opened:
        page.leave(profiles)
    assert [fault for page in opened for fault in page.faults] + violations(studio) == []


@pytest.fixture
def open_page(profiles: Profiles, studio: Studio) -> Iterator[OpenPage]:
    """Opens pages of the shared studio."""
    with visitors(profiles, studio) as open_page:
        yield open_page


@pytest.fixture
def open_own_page(profiles: Profiles, own_studio: Studio) -> Iterator[OpenPage]:
    """Opens pages of the test's own studio."""
    with visitors(profiles, own_studio) as open_page:
        yield open_page


@pytest.fixture(scope="module")
def shown_pages(profiles: Profiles, studio: Studio) -> Iterator[dict[str, StudioPage]]:
    """The pages of ``show``, by how they were opened."""
    pages: dict[str, StudioPage] = {}
    yield pages
    for page in pages.values():
        page.leave(profiles)


@pytest.fixture
def show(profiles: Profiles, studio: Studio, shown_pages: dict[str, StudioPage]) -> Iterator[OpenPage]:
    """Shows a project in a page that a module's tests use one after another, for tests that leave no traces."""

    def show_in(project: dict[str, Any], language: str = "en", level: str = "words") -> StudioPage:
        page = shown_pages.get(language + level)
        if page is None:
            page = StudioPage.open(profiles, studio.url, project=project, language=language, level=level)
            shown_pages[language + level] = page
        else:
            page.take(project)
        return page

    yield show_in
    faults = [page.faults.pop() for page in shown_pages.values() for _ in page.faults[:]]
    assert faults + violations(studio) == []
