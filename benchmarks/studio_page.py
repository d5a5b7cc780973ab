"""Measure the studio's page: run it with ``python benchmarks/studio_page.py``.

`edits` says how edits are timed. The heap is measured for a minute, or for ``--heap-minutes`` (the goal is for 10),
each time after a forced collection.

A headless Chromium visits a studio in a process of its own; both share the machine. It draws without a graphics
processor, so it shows fewer pictures than a screen does.
"""

import argparse
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

from certainty import difference_rows, luck_rows
from edits import edit_rows, luck_edit_rows
from playwright.sync_api import Browser, CDPSession, Error, sync_playwright
from rich.console import Console
from rich.markup import escape
from rich.table import Table
from swarm import result

sys.path.append(str(Path(__file__).resolve().parents[1]))
from scripts import chromium
from scripts.studio_process import StudioProcess, build_page, project_link, running_studio

VISITS, TIMED_S = 7, 5.0
# Cars on the stage, and how many pictures a second are wanted at least.
CROWDS = {13: 30, 100: 30, 1_000: 15}
KB_GOAL, WORDS_GOAL_MS, PICTURE_GOAL_MS = 480, 60, 1000 / 30
HEAP_GOAL_MB = 5
LUCK_GOAL_S, LUCK_WORDS_GOAL_MS = 6, 50
SIZES = {(1440, 900): 45, (1366, 768): 45, (1024, 768): 40, (390, 844): 40}
INTERACTIVE = """() => document.querySelector("#mat-play")?.disabled === false
    && document.querySelector("main[data-compiled]") !== null && performance.now()"""
BYTES = """() => [...performance.getEntriesByType("navigation"), ...performance.getEntriesByType("resource")]
    .reduce((sum, { transferSize }) => sum + transferSize, 0)"""
# The page's own work for a picture; the rest of its thread's time is spent waiting for the drawing by the processor.
PAGE_WORK = ("ScriptDuration", "LayoutDuration", "RecalcStyleDuration")
# How many pictures the browser draws: it draws one only when the one before is shown.
DRAWN = """milliseconds => new Promise(done => {
    const begin = performance.now(); let pictures = 0
    const next = now => now - begin < milliseconds ? (pictures++, requestAnimationFrame(next)) : done(pictures)
    requestAnimationFrame(next)
})"""
STAGE_SHARE = """() => { const { width, height } = document.querySelector("#stage").getBoundingClientRect()
    return (100 * width * height) / (innerWidth * innerHeight) }"""

Rows = Iterator[tuple[str, str, str, str]]


def step(direction: str, speed: int) -> dict[str, Any]:
    return {"drive": {"direction": direction, "speed": speed, "seconds": 3}}


FULL: dict[str, Any] = {
    "format": "motorcade-program/1",
    "profile": "classroom",
    "leader": [{"wait": {"seconds": 1}}, *(step(("left", "forward")[k % 2], 1 + k % 3) for k in range(254))],
    "followers": None,
}


def crowd(cars: int) -> dict[str, Any]:
    """A leader and followers that pass its words on, on a mat where they have room."""
    side = max(4, 0.5 * cars**0.5)
    return {
        **FULL,
        "leader": [step("forward", 2), step("left", 1)],
        "followers": {"accept_ir": True, "forward": True, "steps": [step("forward", 1), step("right", 2)]},
        "mat": {
            "format": "motorcade-mat/1",
            "name": "Hall",
            "size_m": [side, side],
            "edge": "wall",
            "crowd": [{"cars": cars, "leaders": 1, "spacing_m": 0.4}],
        },
    }


class Visit:
    """A page in an empty browser profile."""

    def __init__(self, browser: Browser, url: str) -> None:
        self.page = browser.new_context(viewport={"width": 1440, "height": 900}).new_page()
        self.shown = 0
        self.page.on("websocket", lambda line: line.on("framesent", self._count))
        # Without the tour, which would lie over the stage.
        self.page.add_init_script(
            "localStorage['motorcade.settings'] ??= JSON.stringify({ toured: true, level: 'words' })"
        )
        self.page.goto(url)
        self.interactive_ms = self.page.wait_for_function(INTERACTIVE, polling="raf").json_value()

    def _count(self, message: str | bytes) -> None:
        self.shown += "shown" in str(message)


@contextmanager
def visiting(browser: Browser, url: str) -> Iterator[Visit]:
    visit = Visit(browser, url)
    try:
        yield visit
    finally:
        visit.page.context.close()


def rows_or_reason(part: Callable[[], Rows]) -> Rows:
    """The rows of a part; where it can't be measured, a row that says why, so that the other parts go on."""
    try:
        yield from part()
    except (Error, AssertionError) as problem:
        reason = " ".join(str(problem).split()) or type(problem).__name__
        yield f"The rest of this part wasn't measured. {escape(reason)}", "", "", "[red]missed[/]"


def load_rows(browser: Browser, studio: StudioProcess) -> Rows:
    times = []
    for _ in range(VISITS):
        with visiting(browser, studio.url) as visit:
            visit.page.wait_for_load_state("networkidle")
            kilobytes = visit.page.evaluate(BYTES) / 1000
            times.append(visit.interactive_ms)
    yield "first load, compressed", f"{kilobytes:.0f} KB", f"≤ {KB_GOAL} KB", result(kilobytes, KB_GOAL, least=False)
    yield f"time to interactive, {VISITS} visits", f"{median(times):.0f} ms ({min(times):.0f}–{max(times):.0f})", "", ""


def words_rows(browser: Browser, studio: StudioProcess) -> Rows:
    with visiting(browser, project_link(studio.url, FULL)) as visit:
        yield from edit_rows(visit.page, WORDS_GOAL_MS)


def picture_rows(browser: Browser, studio: StudioProcess) -> Rows:
    for cars, goal in CROWDS.items():
        with visiting(browser, project_link(studio.url, crowd(cars))) as visit:
            visit.page.get_by_role("button", name="Play", exact=True).click()
            visit.page.locator(".motorcade-running").first.wait_for()
            tools = visit.page.context.new_cdp_session(visit.page)
            tools.send("Performance.enable")
            before = _so_far(visit, tools)
            drawn = visit.page.evaluate(DRAWN, 1000 * TIMED_S) / TIMED_S
            pictures, busy_s = (now - then for now, then in zip(_so_far(visit, tools), before, strict=True))
        each_ms = 1000 * busy_s / max(1, pictures)
        name = f"pictures a second of {cars:,} cars, without a GPU"
        yield name, f"{drawn:.0f} (moments of the world: {pictures / TIMED_S:.0f})", f"≥ {goal}", result(drawn, goal)
    yield (
        f"a moment of {cars:,} cars: the page's part",
        f"{each_ms:.1f} ms",
        f"≤ {PICTURE_GOAL_MS:.0f} ms",
        result(each_ms, PICTURE_GOAL_MS, least=False),
    )


def _so_far(visit: Visit, tools: CDPSession) -> tuple[int, float]:
    metrics = {each["name"]: each["value"] for each in tools.send("Performance.getMetrics")["metrics"]}
    return visit.shown, sum(metrics[each] for each in PAGE_WORK)


def certainty_rows(browser: Browser, studio: StudioProcess) -> Rows:
    with visiting(browser, studio.url) as visit:
        yield from luck_rows(visit.page, LUCK_GOAL_S, lambda: visit.shown)
        yield from luck_edit_rows(visit.page, LUCK_WORDS_GOAL_MS)


def comparison_rows(browser: Browser, studio: StudioProcess) -> Rows:
    with visiting(browser, project_link(studio.url, crowd(1_000))) as visit:
        yield from difference_rows(visit.page)


def size_rows(browser: Browser, studio: StudioProcess) -> Rows:
    with visiting(browser, studio.url) as visit:
        for (width, height), goal in SIZES.items():
            visit.page.set_viewport_size({"width": width, "height": height})
            share = visit.page.evaluate(STAGE_SHARE)
            yield f"the stage's part of {width} x {height}", f"{share:.0f} %", f"≥ {goal} %", result(share, goal)


def heap_rows(browser: Browser, studio: StudioProcess, minutes: float) -> Rows:
    sizes = []
    with visiting(browser, project_link(studio.url, crowd(100))) as visit:
        visit.page.get_by_role("button", name="Play", exact=True).click()
        tools = visit.page.context.new_cdp_session(visit.page)
        # The first half minute, in which the page fills its caches, doesn't count.
        for wait_s in (30, 60 * minutes):
            visit.page.wait_for_timeout(1000 * wait_s)
            tools.send("HeapProfiler.collectGarbage")
            sizes.append(tools.send("Runtime.getHeapUsage")["usedSize"] / 1e6)
    growth = sizes[-1] - sizes[0]
    name = f"the heap's growth in {minutes:g} min of 100 cars"
    yield (
        name,
        f"{growth:.1f} MB (of {sizes[-1]:.0f})",
        f"≤ {HEAP_GOAL_MB} MB",
        result(growth, HEAP_GOAL_MB, least=False),
    )


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--heap-minutes", type=float, default=1)
    heap_minutes = parser.parse_args().heap_minutes
    path = chromium.find_or_install()
    if path is None:
        sys.exit(f"No browser was found: {chromium.HOW_TO}.")
    build_page()
    table = Table("", "figure", "goal", "result", title="The studio's page")
    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as folder:
        browser = playwright.chromium.launch(executable_path=path)
        with running_studio(Path(folder)) as studio:
            parts = [load_rows, size_rows, words_rows, picture_rows, certainty_rows, comparison_rows]
            parts.append(partial(heap_rows, minutes=heap_minutes))
            for part in parts:
                for row in rows_or_reason(partial(part, browser, studio)):
                    table.add_row(*row)
        browser.close()
    Console().print(table)


if __name__ == "__main__":
    main()
