"""Driving by hand: keys, touch, the emergency stop, a hidden page, and cars of a studio's world."""

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from motorcade.locales import catalogue
from support.browser_profiles import FEW_PICTURES, Watched, storing
from support.layout import Windows, serious_barriers
from support.soak import SOAK
from support.studio_page import DESKTOP, PATIENCE_MS, PHONE, StudioPage
from support.studio_programs import FOLLOWED

_TRIES = 20
HIDE = """() => {
    Object.defineProperty(document, "hidden", { value: true, configurable: true });
    document.dispatchEvent(new Event("visibilitychange"));
}"""


class Remote(Watched):
    """The remote's page: what it shows by role and name."""

    def __init__(self, page: Page, base: str, language: str = "en") -> None:
        super().__init__(page.context, base)
        self.page = page
        self._texts = catalogue(language)["page"]["remote"]

    def say(self, key: str) -> str:
        return str(self._texts[key])

    def button(self, key: str) -> Locator:
        return self.page.get_by_role("button", name=self.say(key))

    def expect_state(self, *keys: str) -> None:
        """What the car does is one of these."""
        either = self.page.get_by_role("status").filter(has_text=self.say(keys[0]))
        for key in keys[1:]:
            either = either.or_(self.page.get_by_role("status").filter(has_text=self.say(key)))
        expect(either).to_be_visible()

    def drive_by(
        self, press: Callable[[], object], release: Callable[[], object], shows: Locator | None = None
    ) -> None:
        """Press something until the car drives: one that stopped by itself on a busy machine wants it to be let go."""
        drives = shows or self.page.get_by_role("status").filter(has_text=self.say("moving"))
        for _ in range(_TRIES):
            press()
            with suppress(AssertionError):
                expect(drives).to_be_visible(timeout=3000)
                return
            release()
        raise AssertionError("the car never drives")

    def hold(self, key: str, shows: Locator | None = None) -> None:
        self.drive_by(lambda: self.page.keyboard.down(key), lambda: self.page.keyboard.up(key), shows)

    def cars_that(self, key: str, *names: str) -> Locator:
        """The list of cars while each of these is said to do so."""
        listed = self.page.get_by_role("region", name=self.say("cars"))
        for name in names:
            does = self.page.get_by_text(self.say(key), exact=True)
            each = self.page.get_by_role("listitem").filter(has_text=name).filter(has=does)
            listed = listed.filter(has=each)
        return listed

    def expect_standing(self) -> None:
        """The car stands; on a busy machine it may have stopped by itself before the page could say so."""
        self.expect_state("ready", "standing", "failsafe")


@pytest.fixture(scope="module")
def car_url(page_built: None) -> Iterator[str]:
    """The page of a simulated car of its own."""
    command = [sys.executable, "-m", "motorcade", "drive", "serve", "--port", "0", "--web", "0", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, encoding="utf-8") as process:
        assert process.stdout
        yield json.loads(process.stdout.readline())["url"]
        process.kill()


@pytest.fixture
def open_at(browser: Browser) -> Iterator[Callable[..., Remote]]:
    """Opens a page, each in a browser profile of its own, and looks at what it met when the test is over."""
    opened: list[Remote] = []

    def open_page(
        url: str,
        language: str = "en",
        theme: str = "light",
        size: tuple[int, int] = DESKTOP,
        asks: bool = False,
        **options: object,
    ) -> Remote:
        kept = {
            "motorcade.settings": json.dumps({"theme": theme} | ({} if asks else {"userName": ""})),
            "motorcade.language": language,
        }
        viewport = {"width": size[0], "height": size[1]}
        context = browser.new_context(viewport=viewport, storage_state=storing(url, kept), **options)
        context.set_default_timeout(PATIENCE_MS)
        context.add_init_script(FEW_PICTURES)
        opened.append(remote := Remote(context.new_page(), url, language))
        remote.page.goto(url)
        expect(remote.page.get_by_role("status")).not_to_be_empty()
        return remote

    yield open_page
    for remote in opened:
        remote.context.close()
    assert [fault for remote in opened for fault in remote.faults] == []


@pytest.fixture
def drive(open_at: Callable[..., Remote], car_url: str) -> Callable[..., Remote]:
    """Opens the page of the simulated car."""
    return partial(open_at, car_url)


def test_keys_drive_and_a_released_key_or_a_hidden_page_stops(drive) -> None:
    remote = drive()
    camera = remote.page.get_by_role("img", name="What Car sees")
    before = camera.screenshot()
    for key in ("ArrowUp", "s"):
        remote.hold(key)
        remote.page.keyboard.up(key)
        remote.expect_standing()
    assert camera.screenshot() != before
    remote.hold("ArrowUp")
    remote.page.evaluate(HIDE)
    remote.expect_standing()


def test_a_light_stays_on_and_a_horn_sounds_while_it_is_held(drive) -> None:
    remote = drive()
    light, horn = remote.button("switch_head_light"), remote.button("switch_horn")
    # Who switches drives: the car takes the light once it has its driver.
    remote.drive_by(light.click, lambda: None, remote.page.locator("button[aria-pressed=true]"))
    expect(light).to_have_attribute("aria-pressed", "true")
    horn.focus()
    for press, lift in (
        (partial(horn.dispatch_event, "pointerdown"), partial(horn.dispatch_event, "pointerup")),
        (partial(remote.page.keyboard.down, "Enter"), partial(remote.page.keyboard.up, "Enter")),
        (partial(remote.page.keyboard.down, "h"), partial(remote.page.keyboard.up, "h")),
    ):
        press()
        expect(horn).to_have_attribute("aria-pressed", "true")
        lift()
        expect(horn).to_have_attribute("aria-pressed", "false")
    expect(light).to_have_attribute("aria-pressed", "true")
    light.click()
    expect(light).to_have_attribute("aria-pressed", "false")


def test_the_emergency_stop_holds_until_it_is_lifted(drive) -> None:
    driver, watcher = drive(), drive("zh")
    driver.hold("w")
    expect(watcher.page.get_by_text(watcher.say("othersDrive"))).to_be_visible()
    watcher.page.keyboard.press("Space")
    driver.expect_state("stopped")
    watcher.expect_state("stopped")
    driver.page.keyboard.up("w")
    driver.button("clear").click()
    driver.hold("w")
    driver.page.keyboard.up("w")
    driver.expect_standing()
    # Who only watched gets the wheel by asking for it.
    watcher.button("request").click()
    expect(watcher.button("release")).to_be_visible()


def test_the_page_asks_for_a_name_once_and_others_see_who_drives(drive) -> None:
    driver, watcher = drive(size=PHONE, asks=True), drive()
    asked = driver.page.get_by_label(driver.say("yourName"))
    asked.fill("<b>小林")
    driver.button("keepName").click()
    expect(driver.page.get_by_text("emoji and other signs may not")).to_be_visible()
    expect(asked).not_to_be_visible()
    driver.page.locator("summary").click()
    asked.fill("小林")
    driver.button("keepName").click()
    driver.page.locator("summary").click()
    # The keys steer unless a field has the focus.
    driver.page.get_by_role("heading").click()
    driver.hold("w")
    expect(watcher.page.get_by_text("小林 drives")).to_be_visible()
    driver.page.keyboard.up("w")
    driver.page.reload()
    expect(driver.page.get_by_role("status")).not_to_be_empty()
    expect(driver.page.get_by_label(driver.say("yourName"))).not_to_be_visible()


def test_a_finger_on_a_phone_drives(drive) -> None:
    remote = drive(size=PHONE, has_touch=True, is_mobile=True)
    pad = remote.page.get_by_role("application", name=remote.say("stick"))
    pad.scroll_into_view_if_needed()
    box = pad.bounding_box()
    assert box
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    finger = remote.page.context.new_cdp_session(remote.page)

    def touch(kind: str, *places: tuple[float, float]) -> None:
        points = [{"x": x, "y": y} for x, y in places]
        finger.send("Input.dispatchTouchEvent", {"type": f"touch{kind}", "touchPoints": points})

    def push() -> None:
        touch("Start", (x, y))
        touch("Move", (x + 20, y - 60))

    remote.drive_by(push, lambda: touch("End"))
    touch("End")
    remote.expect_standing()
    assert remote.page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")


@pytest.mark.parametrize(
    ("language", "theme", "size"),
    [("en", "light", PHONE), ("zh", "dark", DESKTOP), ("zh", "contrast", PHONE)]
    if SOAK
    else [("zh", "contrast", PHONE)],
)
def test_the_page_has_no_barriers(drive, language, theme, size) -> None:
    remote = drive(language, theme, size)
    assert Windows(remote.page).faults("drive") == []
    # The emergency stop covers nothing: what doesn't fit is scrolled above it.
    box = "getBoundingClientRect()"
    assert remote.button("stop").evaluate(f"stop => stop.previousElementSibling.{box}.bottom <= stop.{box}.top")
    remote.page.locator("summary").click()
    assert serious_barriers(remote.page) == []


def test_the_leader_of_a_swarm_is_driven_while_its_followers_hear_it(open_page) -> None:
    studio: StudioPage = open_page(project=FOLLOWED)
    studio.choose_car(0)
    with studio.context.expect_page() as opened:
        studio.page.get_by_role("link", name="Drive by hand").click()
    remote = Remote(opened.value, studio.url)
    remote.expect_state("program")
    remote.button("start").click()
    expect(remote.button("start")).to_be_hidden()
    remote.page.get_by_label(remote.say("addCar")).select_option("1")
    both = studio.page.get_by_text("The leader is driven by hand; 1 follower is driven by hand")
    remote.hold("ArrowUp", both)
    remote.page.get_by_role("button", name="Leave Follower 1").click()
    # It listens to its leader, who goes on sending while it is driven: not once it has stopped by itself. In a circle
    # the leader stays near, however long that takes.
    remote.page.keyboard.down("ArrowLeft")
    remote.hold("ArrowUp", studio.page.locator("#followers-blocks .motorcade-running", has_text="right").last)
    for key in ("ArrowUp", "ArrowLeft"):
        remote.page.keyboard.up(key)
    remote.button("resume").click()
    remote.expect_state("program")
    remote.hold("ArrowUp", remote.cars_that("moving", "Leader 0"))
    assert remote.faults == []
    # Whom everybody has left the studio's page tells to go on.
    remote.page.close()
    held = studio.page.get_by_text("Driven by hand; the program waits: 0, 1")
    expect(held).to_be_visible()
    # The last push of the closed page may still be on its way, and take the car once more.
    goes_on = studio.page.get_by_role("button", name="Let its program drive")
    remote.drive_by(goes_on.click, lambda: None, studio.page.get_by_text("Driven by hand; the program waits: 1"))
    expect(held).to_be_hidden()
