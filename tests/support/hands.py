"""How a pupil builds a leader's program on the page: by mouse, with a finger, or by keyboard alone."""

import re
from typing import Literal, Protocol

import pytest
from playwright.sync_api import Locator, expect

from support.studio_page import StudioPage

Place = Literal["after", "inside", "gap"]
# The role and the name of what has the focus.
DRAWN = "() => new Promise(drawn => requestAnimationFrame(() => requestAnimationFrame(drawn)))"
FOCUSED = """() => {
    const { activeElement: focused, body } = document
    if (focused === body) return [null, ""]
    return [focused.getAttribute("role"), focused.getAttribute("aria-label") ?? focused.textContent]
}"""


class Hand(Protocol):
    """Does what a pupil does."""

    def insert(self, drawer: str, block: str, place: Place, holder: str) -> None:
        """Take a block out of a drawer, and put it after the lowest block of a kind, into its row, or into its gap.

        Blocks have the keys of their texts.
        """

    def end_by_condition(self, block: str) -> None:
        """Let a condition end the lowest block of a kind, in place of its seconds."""

    def put_person(self) -> None:
        """Put a person onto the mat, where the leader drives to."""

    def press(self, button: Locator) -> None:
        """Press a button."""


def text_of(studio: StudioPage, block: str) -> str:
    """The text at the beginning of a block."""
    return re.split(r"[\n%]", studio.say(f"blocks.{block}"))[0].strip()


class Pointer:
    """A mouse, or a finger where the page's profile has touch."""

    def __init__(self, studio: StudioPage) -> None:
        self._studio = studio

    def insert(self, drawer: str, block: str, place: Place, holder: str) -> None:
        studio = self._studio
        at = studio.hat("leader") if holder == "leader" else studio.block("leader", text_of(studio, holder))
        if place == "after":
            studio.drag_out("leader", drawer, text_of(studio, block), below=at)
        else:
            studio.drag_into(drawer, text_of(studio, block), at, 0 if place == "inside" else None)

    def end_by_condition(self, block: str) -> None:
        studio = self._studio
        made = studio.block("leader", text_of(studio, block))
        studio.press(made, position={"x": 14, "y": 14})
        studio.press(studio.field(made, studio.say("blocks.ends.time")))
        studio.press(studio.page.get_by_role("option", name=studio.say("blocks.endsMenu.until"), exact=True))

    def put_person(self) -> None:
        studio = self._studio
        studio.drag_onto_stage(_person(studio), 0.93, 0.5)

    def press(self, button: Locator) -> None:
        self._studio.press(button)


class Keyboard:
    """The keyboard alone."""

    def __init__(self, studio: StudioPage) -> None:
        self._studio = studio
        self._until_at("Tab", studio.say("app.skipBlocks"))
        self._press("Enter")

    def insert(self, drawer: str, block: str, place: Place, holder: str) -> None:
        studio = self._studio
        self._press("t")
        self._until_at("ArrowDown", studio.say(f"drawers.{drawer}"), "treeitem")
        self._press("ArrowRight")
        self._until_at("ArrowDown", text_of(studio, block), "option")
        self._press("Enter")
        status = studio.editor("leader").get_by_role("status")
        key = {"after": "AFTER", "inside": "INSIDE", "gap": "TO"}[place]
        before, _, behind = studio.say(f"blockly.ANNOUNCE_MOVE_{key}").partition("%1")[2].partition("%2")
        there = re.compile(f"{re.escape(before.strip())}\\s*{re.escape(text_of(studio, holder))}.*{re.escape(behind)}")
        for _ in range(40):
            told = status.inner_text()
            if there.search(told):
                self._press("Enter")
                return
            self._press("ArrowDown")
            # Blockly tells the same place anew with another space behind it.
            expect(status).not_to_have_text(told, use_inner_text=True)
        pytest.fail(f"the arrows never led {place} {holder}")

    def end_by_condition(self, block: str) -> None:
        studio = self._studio
        # Its field comes when the page has heard that the block is chosen.
        ends = studio.field(studio.block("leader", text_of(studio, block)), studio.say("blocks.ends.time"))
        expect(ends).to_be_visible()
        self._until_at("ArrowRight", studio.say("blocks.endsMenu.time"), "button")
        self._press("Enter")
        option = studio.page.get_by_role("option", name=studio.say("blocks.endsMenu.until"), exact=True)
        expect(option).to_be_visible()
        self._press("ArrowDown")
        self._press("Enter")
        expect(option).to_have_count(0)

    def put_person(self) -> None:
        _person(self._studio).press("Enter")
        # It stands in the middle, behind the leader.
        for _ in range(24):
            self._press("ArrowRight")

    def press(self, button: Locator) -> None:
        button.press("Enter")

    def _press(self, key: str) -> None:
        self._studio.page.keyboard.press(key)
        # Blockly moves the focus when it has drawn.
        self._studio.page.evaluate(DRAWN)

    def _until_at(self, key: str, name: str, role: str | None = None) -> None:
        """Press a key until something with this role and name has the focus."""
        for _ in range(60):
            has, label = self._studio.page.evaluate(FOCUSED)
            if name in label and role in (None, has):
                return
            self._press(key)
        pytest.fail(f"{key} never led to {name!r}")


def _person(studio: StudioPage) -> Locator:
    studio.look_up("things")
    person = studio.say("mat.things.person")
    return studio.page.get_by_role("button", name=studio.say("mat.add", what=person), exact=True)
