"""Browsers, and their profiles, which visits use one after another: so the page's code is compiled once."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from playwright.sync_api import (
    Browser,
    BrowserContext,
    ConsoleMessage,
    Playwright,
    Request,
    StorageState,
    ViewportSize,
    WebError,
)

# No host name but the studio's own resolves, as on a computer without a network.
OFFLINE = "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1"

# Chromium takes a file that a test answers with for one of the internet, whose pages may not open a WebSocket here.
LOCAL = "--disable-features=LocalNetworkAccessChecks"

# A test opens a page for seconds: what the compiler's optimiser costs, a fifth of an opening, never comes back.
UNOPTIMISED = "--js-flags=--no-maglev --no-opt"

# A page draws 15 pictures a second in place of 60: without a graphics processor they would be a third of its work, and
# only tests of drawing look at so many.
FEW_PICTURES = """(() => {
    const ask = requestAnimationFrame, waiting = new Map()
    let last = 0
    window.requestAnimationFrame = (draw) => {
        const id = ++last
        waiting.set(id, setTimeout(() => ask((now) => waiting.delete(id) && draw(now)), 50))
        return id
    }
    window.cancelAnimationFrame = (id) => {
        clearTimeout(waiting.get(id))
        waiting.delete(id)
    }
})()"""

# For tests of what a site's page does around Python, which takes seconds of a processor to start.
WITHOUT_PYTHON = """(() => {
    const post = Worker.prototype.postMessage
    Worker.prototype.postMessage = function (message, ...more) {
        if (message.is !== "start") post.call(this, message, ...more)
    }
})()"""


@contextmanager
def launched(playwright: Playwright, path: Path, *options: str) -> Iterator[Browser]:
    """Chromium for the length of a ``with`` block, without a network."""
    browser = playwright.chromium.launch(executable_path=path, args=[OFFLINE, LOCAL, UNOPTIMISED, *options])
    yield browser
    browser.close()


class Profiles:
    """Profiles of one browser; a visit gets one without traces of the visits before, except for cached files.

    Args:
        browser: whose profiles they are.
        few_pictures: let pages draw 15 pictures a second in place of 60.
    """

    def __init__(self, browser: Browser, *, few_pictures: bool = True) -> None:
        self._browser = browser
        self._few_pictures = few_pictures
        self._free: dict[str, list[BrowserContext]] = {}
        self._kinds: dict[BrowserContext, str] = {}

    def new_context(self, *, storage_state: StorageState, viewport: ViewportSize, **options: Any) -> BrowserContext:
        """A profile with these options, as Playwright's `Browser.new_context` makes one; pages set their own size."""
        kind = repr(sorted(options.items()))
        if free := self._free.setdefault(kind, []):
            free[-1].set_storage_state(storage_state)
            return free.pop()
        context = self._browser.new_context(storage_state=storage_state, viewport=viewport, **options)
        if self._few_pictures:
            context.add_init_script(FEW_PICTURES)
        self._kinds[context] = kind
        return context

    def take_back(self, context: BrowserContext) -> None:
        """Close the pages of a visit that is over; another one may have its profile."""
        for page in context.pages:
            page.close()
        context.unroute_all()
        self._free[self._kinds[context]].append(context)


def storing(address: str, kept: dict[str, str]) -> StorageState:
    """A profile that has stored these values for the pages at an address."""
    values: Any = [{"name": name, "value": value} for name, value in kept.items()]
    return {
        "cookies": [],
        "origins": [{"origin": "{0.scheme}://{0.netloc}".format(urlsplit(address)), "localStorage": values}],
    }


class Watched:
    """A profile. ``faults`` lists errors of its pages and requests to other hosts, which no test may cause."""

    def __init__(self, context: BrowserContext, base: str) -> None:
        self.context = context
        self.faults: list[str] = []
        self._forgiven: list[str] = []
        self._host = urlsplit(base).netloc
        context.on("console", self._hear)
        context.on("weberror", self._hear_problem)
        context.on("request", self._check_host)

    def look_away(self) -> None:
        """Watch no longer."""
        self.context.remove_listener("console", self._hear)
        self.context.remove_listener("weberror", self._hear_problem)
        self.context.remove_listener("request", self._check_host)

    def forgive(self, *parts: str) -> None:
        """Expect errors on the console that contain one of these texts."""
        self._forgiven += parts

    def _hear(self, message: ConsoleMessage) -> None:
        if message.type == "error":
            self._blame(message.text)

    def _hear_problem(self, problem: WebError) -> None:
        self._blame(problem.error.stack or problem.error.message)

    def _blame(self, text: str) -> None:
        if not any(part in text for part in self._forgiven):
            self.faults.append(text)

    def _check_host(self, request: Request) -> None:
        self._check_url(request.url)

    def _check_url(self, url: str) -> None:
        if urlsplit(url).scheme not in ("data", "blob") and urlsplit(url).netloc != self._host:
            self.faults.append(f"asks another host: {url}")
