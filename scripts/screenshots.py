"""Make the pictures of the README: docs/stage.gif, which moves, docs/studio.png and docs/studio-zh.png."""

import io
import json
import sys
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import Browser, Page, StorageState, ViewportSize, expect, sync_playwright
from scripts import chromium
from scripts.studio_process import ROOT, build_page, project_link, running_studio

from motorcade.locales import catalogue
from motorcade.service.documents import opening, project_text

PICTURES = {"studio.png": ("en", "light", "A parade"), "studio-zh.png": ("zh", "dark", "列队行进")}
SIZE: ViewportSize = {"width": 1440, "height": 900}
# Tenths of a second, to a moment at which leader and followers show what they do.
MOMENT = 57
# After this time the page describes anew what the cars do.
DESCRIBED_AFTER_MS = 10_000
# The stage that moves: when it is taken, in tenths of a second of the run, and what its pictures have.
BEGIN_TENTHS, END_TENTHS, EVERY_TENTHS = 10, 130, 2
MOVING_WIDTH, MOVING_COLOURS, MOVING_FRAME_MS = 640, 128, 100
WITHOUT_BUTTONS = "[role=application] ~ *, [role=application] button, [role=group] { visibility: hidden }"
PROJECT = {
    "format": "motorcade-program/1",
    "profile": "classroom",
    "leader": [
        {"drive": {"direction": "forward", "speed": 2, "seconds": 3}},
        {"drive": {"direction": "left", "speed": 1, "seconds": 1}},
    ],
    "followers": {
        "accept_ir": True,
        "forward": False,
        "steps": [
            {
                "together": [
                    {"drive": {"direction": "forward", "speed": 1, "seconds": 2}},
                    {"led": {"which": 1, "seconds": 2}},
                ]
            },
            {"drive": {"direction": "right", "speed": 2, "seconds": 1}},
        ],
    },
    "mat": {
        "format": "motorcade-mat/1",
        "name": "Classroom floor",
        "size_m": [3.6, 2.8],
        "edge": "wall",
        "car": [{"at_m": [1.3, 1.3], "role": "leader"}],
        "crowd": [{"cars": 9, "corner_m": [0.9, 0.5], "size_m": [2.0, 2.0], "spacing_m": 0.5}],
    },
}


def take(browser: Browser, url: str, path: Path) -> None:
    """Take one picture. The run is stepped through, so that it is the same each time."""
    language, theme, name = PICTURES[path.name]
    drawer = catalogue(language)["page"]["drawer"]
    page = _opened(browser, url, PROJECT, name, language, theme)
    _step_to(page, language, MOMENT)
    page.get_by_role("button", name=drawer["close"]).click()
    page.mouse.move(0, 0)
    page.wait_for_timeout(DESCRIBED_AFTER_MS)
    page.screenshot(path=path)
    page.context.close()


def take_moving(browser: Browser, url: str, path: Path) -> None:
    """Take the stage of the town that a newcomer finds, picture by picture, and make one that moves."""
    page = _opened(browser, url, project_text(opening()), "Town", "en", "light")
    stage = page.get_by_role("application", name=catalogue("en")["page"]["mat"]["canvas"])
    pictures = []
    for moment in range(BEGIN_TENTHS, END_TENTHS, EVERY_TENTHS):
        _step_to(page, "en", moment)
        picture = Image.open(io.BytesIO(stage.screenshot(style=WITHOUT_BUTTONS))).convert("RGB")
        height = round(picture.height * MOVING_WIDTH / picture.width)
        pictures.append(picture.resize((MOVING_WIDTH, height), Image.Resampling.LANCZOS))
    # One table of colours for all pictures, so that what stands still is the same in each.
    several = pictures[:: len(pictures) // 4]
    together = Image.new("RGB", (MOVING_WIDTH, sum(picture.height for picture in several)))
    for row, picture in enumerate(several):
        together.paste(picture, (0, row * picture.height))
    colours = together.quantize(MOVING_COLOURS)
    frames = [picture.quantize(palette=colours, dither=Image.Dither.NONE) for picture in pictures]
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=MOVING_FRAME_MS, loop=0, optimize=True)
    page.context.close()


def _opened(browser: Browser, url: str, project: dict[str, Any] | str, name: str, language: str, theme: str) -> Page:
    """Return a page of the studio that shows a project, with the words and the timeline."""
    settings = {"theme": theme, "toured": True, "level": "words", "drawer": {"tab": "timeline", "open": True}}
    stored = {"motorcade.language": language, "motorcade.settings": json.dumps(settings)}
    state: StorageState = {
        "cookies": [],
        "origins": [
            {"origin": url.rstrip("/"), "localStorage": [{"name": k, "value": stored[k]} for k in stored]},
        ],
    }
    page = browser.new_context(viewport=SIZE, storage_state=state, reduced_motion="reduce").new_page()
    page.goto(project_link(url, project, name))
    page.locator("#mat-play:enabled").wait_for()
    expect(page.get_by_role("textbox", name=catalogue(language)["page"]["project"]["name"])).to_have_value(
        name, timeout=60_000
    )
    return page


def _step_to(page: Page, language: str, tenths: int) -> None:
    """Step to a moment, in tenths of a second."""
    texts = catalogue(language)["page"]["mat"]
    step = page.get_by_role("button", name=texts["step"])
    clock = page.get_by_role("status", name=texts["time"])
    # The project that a link brings begins the run again, maybe after the first steps.
    while (shown := clock.inner_text()) != f"0:{tenths / 10:04.1f}":
        step.click()
        with suppress(AssertionError):
            expect(clock).not_to_have_text(shown, timeout=1000)


def main() -> None:
    """Make all pictures."""
    browser_path = chromium.find_or_install()
    if browser_path is None:
        sys.exit(f"No browser was found: {chromium.HOW_TO}.")
    build_page()
    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as library:
        browser = playwright.chromium.launch(executable_path=browser_path)
        with running_studio(Path(library)) as studio:
            take_moving(browser, studio.url, ROOT / "docs" / "stage.gif")
            for name in PICTURES:
                take(browser, studio.url, ROOT / "docs" / name)
        browser.close()


if __name__ == "__main__":
    main()
