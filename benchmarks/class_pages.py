"""Pupils of `benchmarks/class.py` whose pages are real: headless Chromium, which draws without a graphics processor."""

import asyncio
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from edits import EDIT_TIMES, NOTE_EDITS
from playwright.async_api import Page, async_playwright
from studio_page import FULL, INTERACTIVE, crowd

sys.path.append(str(Path(__file__).resolve().parents[1]))
from scripts import chromium
from scripts.studio_process import build_page, project_link

SIZE = {"width": 1024, "height": 768}
PATIENCE_MS = 180_000


class PupilsPage:
    """A pupil's page; counted since `reset`: the moments of the world that it has drawn, and its edits."""

    def __init__(self, page: Page, cars: int) -> None:
        self._page = page
        self._project = {**crowd(cars), "leader": [{"wait": {"seconds": 1}}, *FULL["leader"][1:4]]}
        self._before = 0
        self.pictures = 0
        # The page confirms each moment when it has drawn it.
        page.on("websocket", lambda line: line.on("framesent", self._count))

    def _count(self, message: str | bytes) -> None:
        self.pictures += '"shown"' in str(message)

    async def join(self, base: str, code: str, name: str) -> None:
        """Come in as a pupil does, and play a world."""
        page = self._page
        await page.goto(f"{base}join#{code}")
        await page.get_by_label("Your nickname").fill(name)
        await page.get_by_role("button", name="Come in", exact=True).click()
        await page.get_by_role("button", name="Go on", exact=True).click()
        await page.wait_for_function(INTERACTIVE)
        await page.evaluate("link => { location.hash = new URL(link).hash }", project_link(base, self._project, name))
        # The words that an edit is waited for.
        await page.get_by_role("tab", name="Words", exact=True).click()
        await page.locator(".blocklyBlockCanvas .blocklyDraggable").filter(has_text="wait").last.wait_for()
        await page.evaluate(NOTE_EDITS)
        await page.get_by_role("button", name="Play", exact=True).click()

    async def edit(self, every_s: float) -> None:
        """Change a number of a block again and again."""
        block = self._page.locator(".blocklyBlockCanvas .blocklyDraggable").filter(has_text="wait").last
        field = block.locator(":scope > .blocklyNumberField")
        for edit in range(10**6):
            await field.click(force=True)
            await self._page.keyboard.type("23"[edit % 2])
            await self._page.keyboard.press("Enter")
            await asyncio.sleep(every_s)

    async def reset(self) -> None:
        self._before = len((await self._page.evaluate(EDIT_TIMES))["words"])
        self.pictures = 0

    async def edits_ms(self) -> list[float]:
        """How long each edit took, from the key to the words in the page."""
        return list((await self._page.evaluate(EDIT_TIMES))["words"])[self._before :]


def prepare() -> Path:
    """Build the page where it is old; return the browser's path."""
    build_page()
    path = chromium.find_or_install()
    if path is None:
        raise SystemExit(f"there is no browser; {chromium.HOW_TO}")
    return path


@asynccontextmanager
async def pupils_pages(path: Path, count: int, cars: int, base: str, code: str) -> AsyncIterator[list[PupilsPage]]:
    """So many pages of pupils with running worlds, each in a browser profile of its own."""
    async with async_playwright() as playwright:
        options = ["--disable-gpu", "--disable-software-rasterizer"]
        browser = await playwright.chromium.launch(executable_path=path, args=options)
        pages = []
        for number in range(count):
            context = await browser.new_context(viewport=SIZE, locale="en")  # type: ignore[arg-type]
            context.set_default_timeout(PATIENCE_MS)
            page = await context.new_page()
            await page.add_init_script(
                "localStorage['motorcade.settings'] ??= JSON.stringify({ toured: true, level: 'words' })"
            )
            pages.append(PupilsPage(page, cars))
            await pages[-1].join(base, code, f"page {number + 1}")
        yield pages
        await browser.close()
