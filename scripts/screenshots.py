"""Make the README's pictures of the studio: docs/studio.png and docs/studio-zh.png."""

import json
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

from playwright.sync_api import Browser, StorageState, ViewportSize, expect, sync_playwright
from scripts import chromium
from scripts.studio_process import ROOT, build_page, project_link, running_studio

from motorcade.locales import catalogue

PICTURES = {"studio.png": ("en", "light", "A parade"), "studio-zh.png": ("zh", "dark", "列队行进")}
SIZE: ViewportSize = {"width": 1440, "height": 900}
# Tenths of a second, to a moment at which leader and followers show what they do.
MOMENT = 57
# After this time the page describes anew what the cars do.
DESCRIBED_AFTER_MS = 10_000
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
    settings = {"theme": theme, "toured": True, "level": "words", "drawer": {"tab": "timeline", "open": True}}
    stored = {"motorcade.language": language, "motorcade.settings": json.dumps(settings)}
    state: StorageState = {
        "cookies": [],
        "origins": [
            {"origin": url.rstrip("/"), "localStorage": [{"name": k, "value": stored[k]} for k in stored]},
        ],
    }
    page = browser.new_context(viewport=SIZE, storage_state=state, reduced_motion="reduce").new_page()
    page.goto(project_link(url, PROJECT, name))
    page.locator("#mat-play:enabled").wait_for()
    texts, drawer = (catalogue(language)["page"][part] for part in ("mat", "drawer"))
    step = page.get_by_role("button", name=texts["step"])
    clock = page.get_by_role("status", name=texts["time"])
    # The project that the link brings begins the run again, maybe after the first steps.
    while (shown := clock.inner_text()) != f"0:{MOMENT / 10:04.1f}":
        step.click()
        with suppress(AssertionError):
            expect(clock).not_to_have_text(shown, timeout=1000)
    page.get_by_role("button", name=drawer["close"]).click()
    page.mouse.move(0, 0)
    page.wait_for_timeout(DESCRIBED_AFTER_MS)
    page.screenshot(path=path)
    page.context.close()


def main() -> None:
    """Make both pictures."""
    browser_path = chromium.find_or_install()
    if browser_path is None:
        sys.exit(f"No browser was found: {chromium.HOW_TO}.")
    build_page()
    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as library:
        browser = playwright.chromium.launch(executable_path=browser_path)
        with running_studio(Path(library)) as studio:
            for name in PICTURES:
                take(browser, studio.url, ROOT / "docs" / name)
        browser.close()


if __name__ == "__main__":
    main()
