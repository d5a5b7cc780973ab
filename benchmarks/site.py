"""Measure the studio as a site: run it with ``python benchmarks/site.py``.

A headless Chromium visits the site's files, which a plain web server of this process serves. All share the machine.
"""

import gzip
import sys
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from statistics import median

from certainty import difference_rows, luck_rows
from edits import edit_rows, luck_edit_rows
from playwright.sync_api import Browser, BrowserContext, Page, sync_playwright
from rich.console import Console
from rich.table import Table
from studio_page import DRAWN, FULL, INTERACTIVE, crowd, rows_or_reason
from swarm import result

from motorcade.browser.site import site_files, write_site

sys.path.append(str(Path(__file__).resolve().parents[1]))
sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))
from scripts import chromium
from scripts.studio_process import build_page, project_link

from support.site_server import serving

VISITS, TIMED_S, FOLLOWERS = 5, 5.0, 1_000
LUCK_GOAL_S, LUCK_WORDS_GOAL_MS = 12, 50
MB_GOAL, DRIVE_GOAL_S, SECOND_VISIT_GOAL_S, WORDS_GOAL_MS, PICTURES_GOAL, RATE_GOAL = 12, 1, 3, 100, 25, 0.95
# When a condition became true, in ms since the visit began, as the page itself notes it with each picture. Cars drive
# before the blocks are there: whoever waits for one after the other measures the later one twice. The page's mark says
# that a picture is drawn in which cars have driven for a tenth of a second.
NOTES = """window.noted = {}
window.shown = 0
const look = () => {
    const mark = performance.getEntriesByName("motorcade: drawn")[0]
    if (mark) noted.driven ??= mark.startTime
    if (document.querySelector(".blocklyDraggable")) noted.editor ??= performance.now()
    if (!noted.driven || !noted.editor) requestAnimationFrame(look)
}
requestAnimationFrame(look)
"""
# Counts what the page acknowledges: pictures that came from the worker and were taken; and notes when Python is ready.
COUNT = """const post = Worker.prototype.postMessage
Worker.prototype.postMessage = function (message, ...rest) {
    if (message.is === "start") {
        const note = ({ data }) => data.is === "ready" && (noted.python ??= performance.now())
        this.addEventListener("message", note)
    }
    if (typeof message.data === "string" && message.data.includes('"shown"')) window.shown += 1
    return post.call(this, message, ...rest)
}"""
EDITOR, DRIVEN, PYTHON = (f"() => window.noted?.{each}" for each in ("editor", "driven", "python"))
SETTINGS = "localStorage['motorcade.settings'] ??= JSON.stringify({ toured: %s, level: 'words' })"

Rows = Iterator[tuple[str, str, str, str]]


def visitor(browser: Browser, is_new: bool = False) -> BrowserContext:
    """An empty browser profile; without the page's policy, which forbids how Playwright waits for values.

    Args:
        browser: makes the profile.
        is_new: whether the page finds somebody who has not been shown around.
    """
    context = browser.new_context(viewport={"width": 1440, "height": 900}, bypass_csp=True)
    context.add_init_script(SETTINGS % ("false" if is_new else "true"))
    context.add_init_script(NOTES + COUNT)
    return context


def seconds(page: Page, condition: str) -> float:
    """When a condition became true, in s since the visit began."""
    return float(page.wait_for_function(condition, polling="raf", timeout=120_000).json_value()) / 1000


def size_rows(files: dict[str, bytes]) -> Rows:
    packed = (".png", ".zip", ".whl")
    sent = sum(len(data if name.endswith(packed) else gzip.compress(data, 6)) for name, data in files.items()) / 1e6
    yield "all files, compressed by gzip", f"{sent:.1f} MB", f"≤ {MB_GOAL} MB", result(sent, MB_GOAL, least=False)


def start_rows(browser: Browser, url: str) -> Rows:
    times: dict[tuple[str, str], list[float]] = {}
    conditions = {"the editor is usable": EDITOR, "cars drive": DRIVEN, "Python is ready": PYTHON}
    for _ in range(VISITS):
        with visitor(browser, is_new=True) as context:
            for visit in ("first", "second"):
                page = context.new_page()
                page.goto(url)
                for what, condition in conditions.items():
                    times.setdefault((visit, what), []).append(seconds(page, condition))
                # The snapshot, and the files for use without a network, are stored after the start.
                page.wait_for_timeout(3000)
                page.close()
    goals = {
        ("first", "cars drive"): DRIVE_GOAL_S,
        ("second", "cars drive"): DRIVE_GOAL_S,
        ("second", "the editor is usable"): SECOND_VISIT_GOAL_S,
    }
    for key, each in times.items():
        goal = goals.get(key)
        figure = f"{median(each):.2f} s ({min(each):.2f}–{max(each):.2f})"
        outcome = result(max(each), goal, least=False) if goal else ""
        yield f"{key[0]} visit: {key[1]}", figure, f"≤ {goal} s" if goal else "", outcome


def words_rows(browser: Browser, url: str) -> Rows:
    with visitor(browser) as context:
        page = context.new_page()
        page.goto(project_link(url, FULL))
        seconds(page, INTERACTIVE)
        yield from edit_rows(page, WORDS_GOAL_MS)


def picture_rows(browser: Browser, url: str) -> Rows:
    with visitor(browser) as context:
        page = context.new_page()
        page.goto(project_link(url, crowd(FOLLOWERS + 1)))
        seconds(page, INTERACTIVE)
        page.get_by_role("button", name="Play", exact=True).click()
        page.locator(".motorcade-running").first.wait_for(timeout=120_000)
        clock = page.get_by_role("status", name="Time")
        before, shown = _minutes(clock.inner_text()), page.evaluate("shown")
        page.evaluate(DRAWN, 1000 * TIMED_S)
        pictures = (page.evaluate("shown") - shown) / TIMED_S
        rate = (_minutes(clock.inner_text()) - before) / TIMED_S
    name = f"{FOLLOWERS:,} followers"
    yield f"{name}: pictures a second", f"{pictures:.0f}", f"≥ {PICTURES_GOAL}", result(pictures, PICTURES_GOAL)
    yield f"{name}: simulated seconds in a real one", f"{rate:.2f}", f"≥ {RATE_GOAL}", result(rate, RATE_GOAL)


def certainty_rows(browser: Browser, url: str) -> Rows:
    with visitor(browser) as context:
        page = context.new_page()
        page.goto(url)
        seconds(page, INTERACTIVE)
        seconds(page, PYTHON)
        yield from luck_rows(page, LUCK_GOAL_S, lambda: int(page.evaluate("shown")))
        yield from luck_edit_rows(page, LUCK_WORDS_GOAL_MS)


def comparison_rows(browser: Browser, url: str) -> Rows:
    with visitor(browser) as context:
        page = context.new_page()
        page.goto(project_link(url, crowd(FOLLOWERS)))
        seconds(page, INTERACTIVE)
        seconds(page, PYTHON)
        yield from difference_rows(page)


def _minutes(text: str) -> float:
    """The seconds of a time such as 1:02.5."""
    minutes, rest = text.split(":")
    return 60 * int(minutes) + float(rest)


def main() -> None:
    path = chromium.find_or_install()
    if path is None:
        sys.exit(f"No browser was found: {chromium.HOW_TO}.")
    build_page()
    files = site_files()
    table = Table("", "figure", "goal", "result", title="The studio as a site")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        write_site(Path(folder) / "site", files)
        browser = playwright.chromium.launch(executable_path=path, args=["--disable-gpu"])
        with serving(Path(folder) / "site") as server:
            visits = (start_rows, words_rows, picture_rows, certainty_rows, comparison_rows)
            for part in (partial(size_rows, files), *(partial(visit, browser, server.url) for visit in visits)):
                for row in rows_or_reason(part):
                    table.add_row(*row)
        browser.close()
    Console().print(table)


if __name__ == "__main__":
    main()
