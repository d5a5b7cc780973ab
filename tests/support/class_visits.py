"""The pages of a class in real browsers: the teacher's and the pupils', each in a browser profile of its own."""

import json
from collections.abc import Callable
from contextlib import ExitStack, contextmanager, suppress
from itertools import pairwise
from urllib.parse import urlsplit

from playwright.sync_api import Browser, Locator, Page, ViewportSize, expect
from scripts.studio_process import free_port

from motorcade.locales import catalogue
from support.browser_profiles import FEW_PICTURES, Watched, storing
from support.class_page import PASSWORD
from support.layout import Windows, serious_barriers
from support.running_studio import started_class
from support.studio_page import PATIENCE_MS
from support.waiting import wait_until

# No car's picture on a projector is longer.
CAR_PX = 40
SIZES = ((1440, 900), (1366, 768), (1024, 768), (390, 844))


class ClassVisit(Watched):
    """One browser profile in the class."""

    def __init__(self, browser: Browser, base: str, *, language="en", theme="light", size=(1024, 768), **options):
        kept = {"motorcade.language": language, "motorcade.settings": json.dumps({"theme": theme, "toured": True})}
        viewport: ViewportSize = {"width": size[0], "height": size[1]}
        state = storing(base, kept)
        context = browser.new_context(viewport=viewport, storage_state=state, service_workers="block", **options)
        context.add_init_script(FEW_PICTURES)
        super().__init__(context, base)
        context.set_default_timeout(PATIENCE_MS)
        self.base = base
        self.texts = catalogue(language)["page"]
        self.page = context.new_page()

    def say(self, key: str, **values) -> str:
        """A text of the pages, in this visit's language: ``class.code``, ``pupil.frozen``."""
        text = self.texts
        for part in key.split("."):
            text = text[part]
        for name, value in values.items():
            text = text.replace(f"{{{{{name}}}}}", str(value))
        return text

    def button(self, key: str, page: Page | None = None, **values) -> Locator:
        return (page or self.page).get_by_role("button", name=self.say(key, **values), exact=True)

    def open(self, path: str) -> Page:
        """Another page of the same browser."""
        page = self.context.new_page()
        page.goto(self.base + path)
        return page

    def close_windows(self) -> None:
        """Close all pages but the first."""
        for page in self.context.pages:
            if page is not self.page:
                page.close()

    # A pupil.

    def join(self, name: str, code: str, link: str = "") -> None:
        """Come in by the QR code, and wait for the studio; then open a link to a project."""
        self.page.goto(f"{self.base}join#{code}")
        self.page.get_by_label(self.say("class.nickname")).fill(name)
        self.button("class.comeIn").click()
        self.button("class.goOn").click()
        self.wait_for_studio()
        if link:
            self.page.evaluate("link => { location.hash = new URL(link).hash }", link)

    def wait_for_studio(self) -> None:
        expect(self.page.locator("#mat-play")).to_be_enabled(timeout=PATIENCE_MS)
        expect(self.bar).to_be_visible()

    @property
    def bar(self) -> Locator:
        return self.page.get_by_role("region", name=self.say("pupil.title"), exact=True)

    # The teacher.

    def sign_in(self, address: str) -> None:
        """Set the first password at the address that the command printed."""
        self.page.goto(address)
        self.page.get_by_label(self.say("class.password")).fill(PASSWORD)
        self.button("class.setPassword").click()
        expect(self.button("class.freeze")).to_be_visible()

    def part(self, name: str) -> Locator:
        """Show a part of the teacher's page."""
        self.page.get_by_role("navigation").get_by_role("button", name=self.say(f"class.{name}")).click()
        return self.page.get_by_role("main")

    def row(self, pupil: str) -> Locator:
        """A pupil in the teacher's list."""
        return self.page.get_by_role("main").get_by_role("listitem").filter(has_text=pupil)


class ClassRoom:
    """A class in a process, its teacher, and the browsers of its pupils; ``start`` starts a server at a port."""

    teacher: ClassVisit

    def __init__(self, browser: Browser, start: Callable):
        self._start = start
        self.process, told = start(free_port())
        self.browser, self.told = browser, told
        self.base, self.code = told["addresses"][0], told["code"]
        self.visits: list[ClassVisit] = []

    def visit(self, **options) -> ClassVisit:
        self.visits.append(ClassVisit(self.browser, self.base, **options))
        return self.visits[-1]

    def pupil(self, name: str, link: str = "", sleeps: bool = False, **options) -> ClassVisit:
        """A visit of a pupil who is in, and has opened a link to a project; ``sleeps``: the page's clock can be set."""
        visit = self.visit(**options)
        if sleeps:
            visit.page.clock.install()
        visit.join(name, self.code, link)
        return visit

    def kill(self) -> None:
        """End the server at once, as a power cut does."""
        self.process.kill()
        self.process.wait()

    def start_again(self) -> None:
        """Start the server at the same address, and wait until it says so."""
        self.process, _ = self._start(urlsplit(self.base).port)

    def close(self) -> None:
        """End all visits. Raises AssertionError where a page reported an error."""
        for visit in self.visits:
            visit.context.close()
        assert [fault for visit in self.visits for fault in visit.faults] == []


@contextmanager
def class_room(browser: Browser, folder, *more: str):
    """A class with a teacher, whose page is open; ``more`` are further options of the command."""
    with ExitStack() as stack:
        room = ClassRoom(browser, lambda port: stack.enter_context(started_class(folder, port, *more)))
        room.teacher = room.visit(size=(1440, 900))
        room.teacher.sign_in(room.told["teacher"])
        yield room
        room.close()


# A picture of a canvas: whether it shows a car, and what, as short text.
DRAWN = """canvas => {
  const { data, width } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const leader = getComputedStyle(canvas).getPropertyValue("--leader").trim();
  const [r, g, b] = [1, 3, 5].map(at => parseInt(leader.slice(at, at + 2), 16));
  const columns = new Set();
  for (let at = 0; at < data.length; at += 4)
    if (data[at] === r && data[at + 1] === g && data[at + 2] === b) columns.add((at / 4) % width);
  return [...columns].sort((one, other) => one - other);
}"""


def leaders_in(canvas: Locator) -> int:
    """How many leaders a canvas shows, none above or close to another; a star and a face lie over a car's colour."""
    columns = canvas.evaluate(DRAWN)
    return sum(column - before > CAR_PX for before, column in pairwise([-CAR_PX - 1, *columns]))


def expect_leaders(canvas: Locator, count: int) -> None:
    """Wait until a canvas shows so many leaders."""
    expect(canvas).to_be_visible()
    wait_until(lambda: leaders_in(canvas) == count)


def assert_clear(page) -> None:
    """Everybody can use the page, and it fits into its window."""
    assert serious_barriers(page) == [], page.url
    assert Windows(page).faults(page.url) == []


def expect_drafts(room, names: dict[str, str]) -> None:
    """Wait until the server holds drafts of these names, by pupils' ids."""

    def name_of(pupil: str) -> str | None:
        asked = room.teacher.context.request.post(f"{room.base}api/teacher/project", data={"pupil": pupil, "name": ""})
        return asked.json().get("name")

    wait_until(lambda: {pupil: name_of(pupil) for pupil in names} == names)


def expect_cover(visit: ClassVisit, text: str) -> None:
    """The whole page is covered, and nothing takes the cover away."""
    cover = visit.page.get_by_role("dialog", name=visit.say(text), exact=True)
    cover.wait_for()
    visit.page.keyboard.press("Escape")
    box, size = cover.bounding_box(), visit.page.viewport_size
    assert box
    assert size
    assert (box["width"], box["height"]) == (size["width"], size["height"])


def steer(page: Page, shows: Locator) -> None:
    """Hold a key until the page shows something: a car that stopped by itself wants the key to be let go."""
    page.get_by_role("status").first.wait_for()
    for _ in range(5):
        page.keyboard.down("ArrowUp")
        with suppress(AssertionError):
            expect(shows.first).to_be_visible(timeout=3000)
            page.keyboard.up("ArrowUp")
            return
        page.keyboard.up("ArrowUp")
    expect(shows.first).to_be_visible()


def tab_to(page: Page, thing: Locator) -> None:
    """Press Tab until a thing has the focus."""
    for _ in range(60):
        if thing.and_(page.locator(":focus")).count():
            return
        page.keyboard.press("Tab")
    raise AssertionError(f"Tab does not lead to {thing}")
