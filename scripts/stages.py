"""Walk through the stages of all missions and examples, and say what is wrong: ``python -m scripts.stages``.

Each is opened in both languages at five sizes of the window. Before anything drives, all cars are whole on the stage,
none is shorter than 24 px where there are at most 200, each outline is closed, and nothing of the page is covered or
cut off. A few are looked at in the other themes too, where text has the contrast that axe asks for.
``--pictures FOLDER`` keeps a picture of each, ``--only NAME`` opens one mission or example.

The page says nothing about its canvas. A script that runs before the page's own notes what the painter draws there: a
car is a square picture around its own middle, and a line along the edge of what was filled is an outline.
"""

import argparse
import json
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from playwright.sync_api import Browser, Page, StorageState, WebSocket, sync_playwright
from scripts import chromium
from scripts.studio_process import ROOT, build_page, running_studio

from motorcade.locales import catalogue
from motorcade.service.documents import examples
from motorcade.service.missions import list_missions

sys.path.append(str(ROOT / "tests"))
from support.layout import Windows, serious_barriers, wait_for_picture

SIZES = ((390, 844), (768, 1024), (1024, 768), (1366, 768), (1920, 1080))
LANGUAGES = ("en", "zh")
OTHER_THEMES = ("dark", "contrast")
# Missions and examples that are looked at in the other themes: a plain floor, zones, a road, many cars.
THEMED = ("forward-and-stop", "zebra-crossing", "a-hundred-cars", "town")
# No car is shorter where there are at most so many, as web/src/mat/camera.ts has it.
LEAST_PX, FEW_CARS = 24, 200
# A rounded position may lie so far outside.
SLACK_PX = 1
# The camera stands when so many pictures in a row, so far apart, are the same.
RESTS, REST_MS, PATIENCE_MS = 4, 120, 20_000

NOTES = """() => {
  const own = CanvasRenderingContext2D.prototype
  const wrap = (name, act) => {
    const plain = own[name]
    own[name] = function (...all) { act(this, all); return plain.apply(this, all) }
  }
  window.stage = { cars: [], open: new Set() }
  let drawn = [], filled = new Set(), paths = new WeakMap()
  const isStage = ({ canvas }) => canvas.closest("#stage") !== null
  const pathOf = g => paths.get(g) ?? paths.set(g, []).get(g)
  // A path that is given is none of the canvas's own.
  const ownPath = (g, [given]) => given instanceof Path2D ? [] : pathOf(g)
  const name = way => way.map(point => point.map(part => part.toFixed(3)).join()).sort().join(" ")
  wrap("drawImage", (g, all) => {
    if (!isStage(g)) return
    if (all.length === 3) { window.stage.cars = drawn; drawn = []; return }
    const [, x, y, side] = all
    if (x === -side / 2 && y === -side / 2) { const { e, f } = g.getTransform(); drawn.push([e, f, side]) }
  })
  wrap("beginPath", g => { paths.set(g, []) })
  wrap("moveTo", (g, [x, y]) => pathOf(g).push({ way: [[x, y]], closed: false }))
  wrap("lineTo", (g, [x, y]) => pathOf(g).at(-1)?.way.push([x, y]))
  wrap("closePath", g => { if (pathOf(g).length) pathOf(g).at(-1).closed = true })
  wrap("fill", (g, all) => ownPath(g, all).forEach(({ way }) => filled.add(name(way))))
  wrap("stroke", (g, all) => ownPath(g, all).forEach(({ way, closed }) => {
    const ends = [way[0], way.at(-1)]
    const meets = Math.hypot(ends[0][0] - ends[1][0], ends[0][1] - ends[1][1]) < 1e-6
    if (way.length > 2 && !closed && !meets && filled.has(name(way))) window.stage.open.add(name(way))
  }))
}"""
CARS = """() => {
  const { width, height } = document.querySelector("#stage canvas")
  return [window.stage.cars, width, height]
}"""
TAKE_OPEN = "() => { const found = [...window.stage.open]; window.stage.open.clear(); return found }"


@dataclass(frozen=True)
class Stage:
    """What is opened: a mission, or an example by its titles."""

    name: str
    titles: dict[str, str] | None = None


def stages() -> list[Stage]:
    """All missions and examples."""
    missions = [Stage(entry.id) for entry in list_missions({})]
    return missions + [Stage(example.id, dict(example.title)) for example in examples()]


class Visit:
    """A page of the studio in one language and theme; it counts the cars of the world that it shows."""

    def __init__(self, browser: Browser, url: str, language: str, theme: str) -> None:
        kept = {"motorcade.language": language, "motorcade.settings": json.dumps({"theme": theme, "toured": True})}
        storage = [{"name": name, "value": value} for name, value in kept.items()]
        origin = url.partition("/?")[0].rstrip("/")
        state: StorageState = {"cookies": [], "origins": [{"origin": origin, "localStorage": storage}]}  # type: ignore[typeddict-item]
        self._context = browser.new_context(storage_state=state, reduced_motion="reduce")
        self._context.set_default_timeout(PATIENCE_MS)
        self._context.add_init_script(f"({NOTES})()")
        self.page = self._context.new_page()
        self.page.on("websocket", self._listen)
        self._language, self._theme = language, theme
        self._texts = catalogue(language)["page"]
        self._cars = self._worlds = 0
        self.page.goto(url)
        self.page.locator("#mat-play:enabled").wait_for()

    def _listen(self, socket: WebSocket) -> None:
        socket.on("framereceived", self._hear)

    def _hear(self, message: str | bytes) -> None:
        if isinstance(message, str) and '"hello"' in message:
            self._cars = json.loads(message).get("cars", 0)
            self._worlds += 1

    def open(self, stage: Stage) -> None:
        """Open a mission or an example, in a large window, and wait for its world."""
        before = self._worlds
        self.page.set_viewport_size({"width": 1366, "height": 768})
        if stage.titles is None:
            self.page.get_by_role("button", name=self._texts["missions"]["title"], exact=True).first.click()
            self.page.locator(f"[data-mission='{stage.name}']").click()
        else:
            self.page.get_by_role("button", name=self._texts["menu"]["project"], exact=True).click()
            self.page.get_by_role("menuitem", name=self._texts["menu"]["examples"], exact=True).click()
            self.page.get_by_role("dialog").get_by_role("button", name=stage.titles[self._language]).click()
        self.page.get_by_role("dialog").wait_for(state="detached")
        for _ in range(PATIENCE_MS // REST_MS):
            if self._worlds > before:
                break
            self.page.wait_for_timeout(REST_MS)
        self.page.locator("#mat-play:enabled").wait_for()

    def faults(self, stage: Stage, size: tuple[int, int]) -> Iterator[str]:
        """What is wrong with the stage that is open, in a window of a size."""
        windows = Windows(self.page, (size,))
        self.page.set_viewport_size({"width": size[0], "height": size[1]})
        cars, width, height = self._at_rest()
        if not cars or len(cars) != self._cars:
            yield f"{len(cars)} of {self._cars} cars are drawn"
        outside = [side for x, y, side in cars if not _is_inside(x, y, side / 2, width, height)]
        if outside:
            yield f"{len(outside)} of {len(cars)} cars are not in view"
        shortest = min((side for _, _, side in cars), default=LEAST_PX)
        if len(cars) <= FEW_CARS and shortest < LEAST_PX - SLACK_PX:
            yield f"a car is {shortest:.0f} px long"
        for outline in self.page.evaluate(TAKE_OPEN):
            yield f"an outline is open: {outline}"
        yield from windows.faults("the page")
        if self._theme != "light":
            yield from serious_barriers(self.page)

    def _at_rest(self) -> tuple[list[tuple[float, float, float]], float, float]:
        """The cars on the canvas, with its width and height, once the camera stands."""
        rests, seen = 0, self.page.evaluate(CARS)
        for _ in range(PATIENCE_MS // REST_MS):
            self.page.wait_for_timeout(REST_MS)
            wait_for_picture(self.page)
            before, seen = seen, self.page.evaluate(CARS)
            rests = rests + 1 if seen == before and len(seen[0]) == self._cars else 0
            if rests == RESTS:
                break
        return seen[0], seen[1], seen[2]

    def close(self) -> None:
        self._context.close()


def _is_inside(x: float, y: float, half: float, width: float, height: float) -> bool:
    least = half - SLACK_PX
    return least <= x <= width - least and least <= y <= height - least


def walk(browser: Browser, url: str, wanted: list[Stage], folder: Path | None) -> Iterator[str]:
    """Look at all stages; gives what is wrong, each with where."""
    for language in LANGUAGES:
        for theme in ("light", *OTHER_THEMES):
            chosen = [stage for stage in wanted if theme == "light" or stage.name in THEMED]
            yield from _walk_in(browser, url, chosen, language, theme, folder)


def _walk_in(
    browser: Browser, url: str, wanted: list[Stage], language: str, theme: str, folder: Path | None
) -> Iterator[str]:
    for stage in wanted:
        with visiting(browser, url, language, theme) as visit:
            visit.open(stage)
            for size in SIZES:
                where = f"{stage.name} {language} {theme} {size[0]}×{size[1]}"
                yield from (f"{where}: {fault}" for fault in visit.faults(stage, size))
                if folder:
                    _keep(visit.page, folder / f"{where.replace(' ', '-')}.png")


@contextmanager
def visiting(browser: Browser, url: str, language: str, theme: str) -> Iterator[Visit]:
    """A visit for the length of a ``with`` block."""
    visit = Visit(browser, url, language, theme)
    try:
        yield visit
    finally:
        visit.close()


def _keep(page: Page, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=path)


def main() -> None:
    """Walk, print what is wrong, and end with 1 where something is."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pictures", type=Path, help="a folder for a picture of each")
    parser.add_argument("--only", help="the name of one mission or example")
    given = parser.parse_args()
    path = chromium.find_or_install()
    if path is None:
        sys.exit(f"No browser was found: {chromium.HOW_TO}.")
    build_page()
    wanted = [stage for stage in stages() if given.only in (None, stage.name)]
    count = 0
    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as library:
        browser = playwright.chromium.launch(executable_path=path, args=["--disable-gpu"])
        with running_studio(Path(library)) as studio:
            for fault in walk(browser, studio.url, wanted, given.pictures):
                print(fault, flush=True)
                count += 1
        browser.close()
    print(f"{len(wanted)} stages, {count} faults")
    sys.exit(1 if count else 0)


if __name__ == "__main__":
    main()
