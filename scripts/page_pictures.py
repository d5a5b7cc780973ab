"""Make the pictures of the documentation's pages in docs/pictures: ``python -m scripts.page_pictures [PART]...``.

The parts are blocks, mats, missions, studio, lessons, class and remote; all where none is named. Each picture is taken
in both languages, but for those of mats and missions, which have no text.
"""

import faulthandler
import io
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
from PIL import Image
from playwright.sync_api import Browser, Locator, Page, Route, StorageState, expect, sync_playwright
from scripts import chromium
from scripts.blocks_page import SAMPLES, sample_project
from scripts.screenshots import PROJECT
from scripts.studio_process import ROOT, StudioProcess, build_page, project_link, running_studio

from motorcade.locales import catalogue
from motorcade.missions.document import built_in_mission, missions
from motorcade.program.model import Program
from motorcade.service.documents import example, open_mat, project_of, project_text
from motorcade.service.messages import MissionChoice
from motorcade.service.missions import open_mission

sys.path.append(str(ROOT / "tests"))
from support.class_visits import class_room

FOLDER = ROOT / "docs" / "pictures"
# The end of a name in each language, as MkDocs finds it.
LANGUAGES = {"en": "", "zh": ".zh"}
SIZE = (1180, 760)
THUMBNAIL_PX, THUMBNAIL_QUALITY, QUALITY = 200, 60, 72
PATIENCE_MS = 120_000
# The missions of the lessons alone play for six minutes.
MOST_PART_S = 1800
# The longest mission of a lesson whose end is shown lasts so long.
RUN_MS = 26_000
# The missions of the lessons that are shown at work: the name of the picture, the mission, which of its programs.
LESSONS = (
    ("first-lesson-task", "forward-and-stop", None),
    ("first-lesson-solved", "forward-and-stop", "solution"),
    ("first-lesson-mistake", "round-the-corner", "near_miss"),
    ("first-lesson-corner", "round-the-corner", "solution"),
    ("second-lesson-everybody", "follow-me", "solution"),
    ("second-lesson-mistake", "pass-it-on", "near_miss"),
    ("third-lesson-crossing", "zebra-crossing", "solution"),
    ("third-lesson-dark", "home-on-the-dark", "solution"),
)


class Camera:
    """A browser at a studio that takes pictures of its pages."""

    def __init__(self, browser: Browser, url: str) -> None:
        self._browser, self._url = browser, url

    @contextmanager
    def page(
        self,
        language: str,
        project: dict[str, Any] | str | None = None,
        work: dict[str, Any] | None = None,
        **chosen: Any,
    ) -> Iterator[Page]:
        """A page of the studio, with a project, or with work as its last visit left it; ``chosen`` are its settings."""
        settings = {"theme": "light", "toured": True, "level": "words"} | chosen
        stored = {"motorcade.language": language, "motorcade.settings": json.dumps(settings)}
        if work:
            stored["motorcade.autosave.1"] = json.dumps(work)
        entries = [{"name": name, "value": value} for name, value in stored.items()]
        origin = self._url.partition("/?")[0].rstrip("/")
        state: StorageState = {"cookies": [], "origins": [{"origin": origin, "localStorage": entries}]}  # type: ignore[typeddict-item]
        size = {"width": SIZE[0], "height": SIZE[1]}
        context = self._browser.new_context(viewport=size, storage_state=state, reduced_motion="reduce")  # type: ignore[arg-type]
        context.set_default_timeout(PATIENCE_MS)
        page = context.new_page()
        page.goto(project_link(self._url, project, "Shown") if project else self._url)
        page.locator("main[data-compiled]").wait_for(state="attached")
        page.locator("#mat-play:enabled").wait_for()
        yield page
        context.close()


def keep(shown: Page | Locator, name: str, width: int | None = None, quality: int = QUALITY, **more: Any) -> None:
    """Store a picture of a page or of a part of it, at most ``width`` pixels wide."""
    picture = Image.open(io.BytesIO(shown.screenshot(timeout=PATIENCE_MS, **more))).convert("RGB")
    if width and picture.width > width:
        picture = picture.resize((width, round(picture.height * width / picture.width)), Image.Resampling.LANCZOS)
    path = FOLDER / f"{name}.webp"
    path.parent.mkdir(parents=True, exist_ok=True)
    picture.save(path, quality=quality, method=6)
    print(f"{path.relative_to(ROOT)}: {path.stat().st_size:,} bytes", flush=True)


def take_blocks(camera: Camera) -> None:
    """Each block of the page of blocks, alone."""
    for language, ending in LANGUAGES.items():
        for samples in SAMPLES.values():
            for name, step in samples.items():
                with camera.page(language, sample_project(step)) as page:
                    block = page.locator(".blocklyDraggable .blocklyDraggable").first
                    block.wait_for()
                    keep(block, f"blocks/{name}{ending}", animations="disabled")


def take_mats(camera: Camera) -> None:
    """The mats of examples/mats, small: in place of a mission's, since the page shows those whole."""
    for path in sorted((ROOT / "examples" / "mats").iterdir()):
        mat = msgspec.to_builtins(open_mat(path.read_text(encoding="utf-8"), path.stem))
        with camera.page("en") as page:
            page.route("**/api/missions/notes", partial(_answer_with, mat))
            page.evaluate("location.hash = '#notes=forward-and-stop'")
            picture = page.get_by_role("dialog").locator("canvas").first
            picture.wait_for()
            page.wait_for_timeout(500)
            keep(picture, f"mats/{path.stem}", THUMBNAIL_PX, THUMBNAIL_QUALITY)


def _answer_with(mat: dict[str, Any], route: Route) -> None:
    route.fulfill(json=route.fetch().json() | {"mat": mat, "zones": []})


def take_missions(camera: Camera) -> None:
    """The mats of all missions, small."""
    with camera.page("en") as page:
        for mission in missions():
            page.evaluate("id => { location.hash = `#notes=${id}` }", mission.id)
            dialog = page.get_by_role("dialog")
            expect(dialog).to_contain_text(mission.name.sentence("en"))
            keep(dialog.locator("canvas").first, f"missions/{mission.id}", THUMBNAIL_PX, THUMBNAIL_QUALITY)


def take_studio(camera: Camera) -> None:
    """The map of missions, blocks beside their Python, and what can be put on a mat."""
    for language, ending in LANGUAGES.items():
        texts = catalogue(language)["page"]
        with camera.page(language) as page:
            page.get_by_role("button", name=texts["missions"]["title"], exact=True).first.click()
            expect(page.locator("[data-mission]")).to_have_count(len(missions()))
            page.wait_for_timeout(1000)
            keep(page, f"missions{ending}", 1000)
        with camera.page(
            language, project_text(example("parade")), level="python", drawer={"tab": "python", "open": True}
        ) as page:
            page.wait_for_timeout(1000)
            keep(page, f"programs{ending}", 1000)
        with camera.page(language, PROJECT, level="start", drawer={"tab": "things", "open": True}) as page:
            page.wait_for_timeout(1000)
            keep(page, f"mats{ending}", 1000)


def take_lessons(camera: Camera) -> None:
    """Missions of the lessons: as they begin, or with a program and after a run of it."""
    # The first, which nobody has solved yet, comes before all others in both languages.
    for name, mission, program in LESSONS:
        for language, ending in LANGUAGES.items():
            work = mission_at_work(mission, program, language)
            with camera.page(language, work=work, level=built_in_mission(mission).document["level"]) as page:
                if program:
                    play(page)
                page.wait_for_timeout(1500)
                keep(page, f"{name}{ending}", 1000)


def mission_at_work(mission_id: str, program: str | None, language: str) -> dict[str, Any]:
    """What a browser stores of a mission that is played: with one of its programs, or as it begins."""
    mission = open_mission(MissionChoice(id=mission_id), {})
    given: Program | None = getattr(built_in_mission(mission_id), program) if program else None
    blocks = project_of(given) if given else mission
    shown = msgspec.to_builtins(
        {"leader": blocks.leader, "followers": blocks.followers, "profile": mission.profile, "mat": mission.mat}
    )
    name = mission.name[language]
    more = {"name": name, "range_mm": None, "mission": {"id": mission_id}, "kept": None, "attempts": {}}
    return {**shown, **more, "parkedFollowers": None, "unsaved": False, "at": time.time() * 1000}


def play(page: Page) -> None:
    """Let the cars of a mission drive until most of it is over."""
    page.locator("#mat-play").click()
    page.wait_for_timeout(RUN_MS)


def take_class(camera: Camera, browser: Browser) -> None:
    """How a class looks to its teacher, and how a pupil comes in."""
    for language, ending in LANGUAGES.items():
        names = {"en": ("Mia", "Leo", "Ada"), "zh": ("小明", "小红", "阿强")}[language]
        with tempfile.TemporaryDirectory() as folder, class_room(browser, Path(folder) / "class") as room:
            teacher = room.visit(size=SIZE, language=language)
            teacher.context.add_cookies(room.teacher.context.cookies())
            newcomer = room.visit(size=(390, 700), language=language)
            newcomer.page.goto(f"{room.base}join#{room.code}")
            newcomer.page.get_by_label(newcomer.say("class.nickname")).fill(names[0])
            keep(newcomer.page, f"first-lesson-join{ending}", 390)
            for name in names:
                link = project_link(room.base, project_text(example("parade")), "A parade")
                room.pupil(name, link, language=language)
            teacher.page.goto(f"{room.base}teacher")
            for name in names:
                expect(teacher.row(name)).to_be_visible()
            teacher.page.wait_for_timeout(3000)
            keep(teacher.page, f"class{ending}", 1000)
            teacher.part("handOut")
            teacher.page.wait_for_timeout(1000)
            keep(teacher.page, f"first-lesson-hand-out{ending}", 1000)


def take_remote(browser: Browser) -> None:
    """The page of a car that is driven."""
    command = [sys.executable, "-m", "motorcade", "drive", "serve", "--port", "0", "--web", "0", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, encoding="utf-8") as process:
        assert process.stdout
        url = json.loads(process.stdout.readline())["url"]
        for language, ending in LANGUAGES.items():
            stored = {
                "motorcade.language": language,
                "motorcade.settings": json.dumps({"theme": "light", "userName": ""}),
            }
            entries = [{"name": name, "value": value} for name, value in stored.items()]
            origin = url.partition("/?")[0].rstrip("/")
            state: StorageState = {"cookies": [], "origins": [{"origin": origin, "localStorage": entries}]}  # type: ignore[typeddict-item]
            page = browser.new_context(viewport={"width": 1000, "height": 640}, storage_state=state).new_page()
            page.goto(url)
            expect(page.get_by_role("status")).not_to_be_empty()
            page.keyboard.down("ArrowUp")
            page.wait_for_timeout(1500)
            keep(page, f"remote{ending}")
            page.context.close()
        process.kill()


@contextmanager
def ended_when_late(part: str, studio: StudioProcess) -> Iterator[None]:
    """End all where a part takes too long: Playwright waits for ever for a browser that hangs."""

    def end() -> None:
        print(f"The part {part} takes more than {MOST_PART_S} s. It waits here:", file=sys.stderr, flush=True)
        faulthandler.dump_traceback()
        studio.kill()
        os._exit(1)

    timer = threading.Timer(MOST_PART_S, end)
    timer.daemon = True
    timer.start()
    yield
    timer.cancel()


def main() -> None:
    """Make the parts that are named, or all."""
    browser_path = chromium.find_or_install()
    if browser_path is None:
        sys.exit(f"No browser was found: {chromium.HOW_TO}.")
    build_page()
    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as library:
        browser = playwright.chromium.launch(executable_path=browser_path)
        with running_studio(Path(library)) as studio:
            camera = Camera(browser, studio.url)
            parts: dict[str, Callable[[], None]] = {
                "blocks": lambda: take_blocks(camera),
                "mats": lambda: take_mats(camera),
                "missions": lambda: take_missions(camera),
                "studio": lambda: take_studio(camera),
                "lessons": lambda: take_lessons(camera),
                "class": lambda: take_class(camera, browser),
                "remote": lambda: take_remote(browser),
            }
            for name in sys.argv[1:] or parts:
                with ended_when_late(name, studio):
                    parts[name]()
        browser.close()


if __name__ == "__main__":
    main()
