"""Browsers, and their profiles, which visits use one after another: so the page's code is compiled once."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, BrowserContext, Playwright, StorageState, ViewportSize

# No host name but the studio's own resolves, as on a computer without a network.
OFFLINE = "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1"

# Chromium takes a file that a test answers with for one of the internet, whose pages may not open a WebSocket here.
LOCAL = "--disable-features=LocalNetworkAccessChecks"

# A test opens a page for seconds: what the compiler's optimiser costs, a fifth of an opening, never comes back.
UNOPTIMISED = "--js-flags=--no-maglev --no-opt"


@contextmanager
def launched(playwright: Playwright, path: Path, *options: str) -> Iterator[Browser]:
    """Chromium for the length of a ``with`` block, without a network."""
    browser = playwright.chromium.launch(executable_path=path, args=[OFFLINE, LOCAL, UNOPTIMISED, *options])
    yield browser
    browser.close()


class Profiles:
    """Profiles of one browser; a visit gets one without traces of the visits before, except for cached files."""

    def __init__(self, browser: Browser) -> None:
        self._browser = browser
        self._free: dict[str, list[BrowserContext]] = {}
        self._kinds: dict[BrowserContext, str] = {}

    def new_context(self, *, storage_state: StorageState, viewport: ViewportSize, **options: Any) -> BrowserContext:
        """A profile with these options, as Playwright's `Browser.new_context` makes one; pages set their own size."""
        kind = repr(sorted(options.items()))
        if free := self._free.setdefault(kind, []):
            free[-1].set_storage_state(storage_state)
            return free.pop()
        context = self._browser.new_context(storage_state=storage_state, viewport=viewport, **options)
        self._kinds[context] = kind
        return context

    def take_back(self, context: BrowserContext) -> None:
        """Close the pages of a visit that is over; another one may have its profile."""
        for page in context.pages:
            page.close()
        context.unroute_all()
        self._free[self._kinds[context]].append(context)
