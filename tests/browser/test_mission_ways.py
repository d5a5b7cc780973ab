"""The whole way of three missions, one of each path: by mouse, by keyboard and by touch, on four sizes of page."""

from itertools import pairwise, product
from typing import Any, ClassVar, NamedTuple

import pytest
from playwright.sync_api import Locator, expect

from motorcade.missions.document import missions
from support.barriers import serious_barriers, wait_for_picture
from support.soak import SOAK
from support.studio_page import PHONE, StudioPage

SIZES = ((1440, 900), (1366, 768), (1024, 768), PHONE)
LANGUAGES = ("zh", "en")
# More keys than the page has places for the focus.
MOST_KEYS = 90


class Step(NamedTuple):
    """A block, by its place in the drawer, and what its fields are set to: an option's place in its list, or seconds.

    Attributes:
        block: 0 for 'drive', 1 for 'wait'.
        fields: by the field's place in the block.
    """

    block: int
    fields: dict[int, int | str]


DRIVE, WAIT = 0, 1
SPEED, DRIVE_SECONDS, WAIT_SECONDS = 1, 2, 0
FAST = 3


class Hands:
    """Use a page with the mouse."""

    options: ClassVar[dict[str, Any]] = {}

    def __init__(self, studio: StudioPage) -> None:
        self.studio, self.page = studio, studio.page

    def press(self, thing: Locator) -> None:
        thing.click()

    def build(self, editor: str, steps: list[Step]) -> None:
        """Put the steps under the first block of a program."""
        if editor == "followers":
            self.press(self.page.get_by_role("radio", name=self.studio.say("editors.followers"), exact=True))
        blocks = self.page.get_by_role("region", name=self.studio.say(f"editors.{editor}Blocks"), exact=True)
        above = blocks.locator(".blocklyBlockCanvas .blocklyDraggable").first
        for count, step in enumerate(steps, start=1):
            # The first drawer has 'drive' and 'wait' in all of these missions.
            self.press(self.studio.editor(editor).get_by_role("treeitem").first)
            option = self.studio.editor(editor).get_by_role("option").nth(step.block)
            self.drag(option, above)
            expect(blocks.locator(".blocklyBlockCanvas .blocklyDraggable")).to_have_count(count + 1)
            above = blocks.locator(".blocklyBlockCanvas .blocklyDraggable").last
            for place, value in step.fields.items():
                field = above.locator(':scope > [role="button"]').nth(place)
                self.press(field)
                if isinstance(value, int):
                    self.press(self.page.locator(".blocklyDropDownDiv").get_by_role("option").nth(value))
                else:
                    self.page.keyboard.type(value)
                    self.page.keyboard.press("Enter")

    def drag(self, option: Locator, above: Locator) -> None:
        """Drag a block out of the drawer and drop it below another."""
        taken, place = self.studio.box(option), self.studio.box(above)
        x, y = place["x"] + 12, place["y"] + place["height"] + taken["height"] / 2
        self.move([(taken["x"] + 12, taken["y"] + taken["height"] / 2), (x + 30, y + 30), (x, y)])

    def move(self, points: list[tuple[float, float]]) -> None:
        mouse = self.page.mouse
        mouse.move(*points[0])
        mouse.down()
        for x, y in points[1:]:
            mouse.move(x, y, steps=4)
        mouse.up()


class Fingers(Hands):
    """Use a page with a finger."""

    options: ClassVar[dict[str, Any]] = {"has_touch": True}

    def press(self, thing: Locator) -> None:
        thing.tap()

    def move(self, points: list[tuple[float, float]]) -> None:
        session = self.page.context.new_cdp_session(self.page)

        def touch(kind: str, *points: tuple[float, float]) -> None:
            session.send(
                "Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": y} for x, y in points]}
            )

        touch("touchStart", points[0])
        for (x0, y0), (x1, y1) in pairwise(points):
            for part in (0.25, 0.5, 0.75, 1):
                touch("touchMove", (x0 + (x1 - x0) * part, y0 + (y1 - y0) * part))
        touch("touchEnd")


class Keys(Hands):
    """Use a page by its keyboard alone."""

    def reach(self, thing: Locator, key: str = "Tab") -> None:
        """Press a key until this element has the focus."""
        for _ in range(MOST_KEYS):
            if thing.evaluate_all("all => all.includes(document.activeElement)"):
                return
            self.page.keyboard.press(key)
        pytest.fail(f"{key} never led to {thing}")

    def press(self, thing: Locator) -> None:
        thing.first.wait_for()
        self.reach(thing)
        self.page.keyboard.press("Enter")

    def build(self, editor: str, steps: list[Step]) -> None:
        keyboard = self.page.keyboard
        studio = self.studio
        if editor == "followers":
            self.reach(self.page.get_by_role("radio", name=studio.say("editors.leader"), exact=True))
            keyboard.press("ArrowRight")
            keyboard.press("Enter")
        blocks = self.page.get_by_role("region", name=studio.say(f"editors.{editor}Blocks"), exact=True)
        self.reach(blocks.locator(".blocklyBlockCanvas [role=figure]").first)
        for count, step in enumerate(steps, start=1):
            keyboard.press("t")
            self.reach(studio.editor(editor).get_by_role("option").first, "ArrowRight")
            for _ in range(step.block):
                keyboard.press("ArrowDown")
            keyboard.press("Enter")
            wait_for_picture(self.page)
            keyboard.press("Enter")
            expect(blocks.locator(".blocklyBlockCanvas .blocklyDraggable")).to_have_count(count + 1)
            block = blocks.locator(".blocklyBlockCanvas .blocklyDraggable").last
            # Blockly moves the focus there a moment after the block.
            expect(block.locator(":scope:focus, :focus")).to_have_count(1)
            for place, value in step.fields.items():
                self.reach(block.locator(':scope > [role="button"]').nth(place), "ArrowRight")
                keyboard.press("Enter")
                if isinstance(value, int):
                    keyboard.press("Home")
                    for _ in range(value):
                        keyboard.press("ArrowDown")
                else:
                    keyboard.type(value)
                keyboard.press("Enter")


def forward_and_stop(hands: Hands) -> None:
    hands.build("leader", [Step(DRIVE, {SPEED: FAST, DRIVE_SECONDS: "2"}), Step(WAIT, {WAIT_SECONDS: "6"})])


def follow_me(hands: Hands) -> None:
    hands.build("leader", [Step(WAIT, {WAIT_SECONDS: "3"})])
    hands.build("followers", [Step(DRIVE, {DRIVE_SECONDS: "3"}), Step(WAIT, {WAIT_SECONDS: "3"})])


def flip_the_lamp(hands: Hands) -> None:
    bits = hands.page.get_by_role("group", name=hands.studio.say("missions.bits"))
    # Bits 22 and 21 of the followers' word choose the lamp.
    name = hands.studio.say("missions.bit", bit=22, title="", value="").partition(",")[0].partition("，")[0]
    hands.press(bits.get_by_role("button", name=name).nth(1))


WAYS = {"forward-and-stop": forward_and_stop, "follow-me": follow_me, "flip-the-lamp": flip_the_lamp}
KINDS = {"mouse": Hands, "keyboard": Keys, "touch": Fingers}
# Other tests use the mouse, and `test_missions.py` the keyboard; `make soak` takes all together.
FEW = (("forward-and-stop", "touch", PHONE, "zh"),)
ALL = tuple(product(WAYS, KINDS, SIZES, LANGUAGES))


@pytest.mark.parametrize(
    ("mission", "kind", "size", "language"),
    ALL if SOAK else FEW,
    ids=lambda value: f"{value[0]}x{value[1]}" if isinstance(value, tuple) else value,
)
def test_a_mission_is_played_until_it_has_all_stars(open_page, mission, kind, size, language):
    use = KINDS[kind]
    # What keeps people out is the same for mouse and finger.
    looks = SOAK or use is Keys
    studio = open_page(size=size, language=language, level="start", plain=True, **use.options)
    page, hands = studio.page, use(studio)
    hands.press(page.get_by_role("button", name=studio.say("missions.title"), exact=True))
    expect(page.locator("[data-mission]")).to_have_count(len(missions()))
    assert not looks or serious_barriers(page) == []
    hands.press(page.locator(f"[data-mission={mission}]"))
    expect(page.locator("li[data-progress]")).to_have_count(3)
    assert not looks or serious_barriers(page) == []
    to_blocks = page.get_by_role("button", name=studio.say("missions.toBlocks"))
    if mission != "flip-the-lamp" and to_blocks.is_visible():
        hands.press(to_blocks)
    WAYS[mission](hands)
    assert not looks or serious_barriers(page) == []
    expect(page.locator("main[data-compiled]")).to_be_attached()
    hands.press(page.locator("#mat-play"))
    expect(page.locator("li[data-progress=met]")).to_have_count(3)
    hands.press(page.get_by_role("button", name=studio.say("missions.next")))
    expect(page.locator(f"[data-mission={mission}] [data-earned]")).to_have_count(3)
    assert not looks or serious_barriers(page) == []
