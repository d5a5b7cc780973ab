"""The Python text and the blocks follow each other; a wrong block is corrected; each level shows its blocks whole."""

import pytest
from playwright.sync_api import expect

from motorcade import (
    Followers,
    Program,
    avoid,
    forward,
    led,
    left,
    person,
    pir,
    repeat,
    together,
    voice,
    wait,
    wander,
)

PROGRAM = Program([forward(3), left(1)]).as_dict()
# No block is wider, so that it is whole beside the drawers of a small tablet and of a phone.
WIDEST_PX = 260
LEAST_TYPE_PX = 16
PASTE = """(place, text) => {
    const clipboardData = new DataTransfer()
    clipboardData.setData("text/plain", text)
    place.dispatchEvent(new ClipboardEvent("paste", { clipboardData, bubbles: true, cancelable: true }))
}"""
# Each measurement of a text lets the browser lay out all blocks anew.
COUNT_MEASUREMENTS = """() => {
    const { getComputedStyle } = window
    window.measured = 0
    window.getComputedStyle = (element, ...more) => {
        if (element instanceof SVGTextElement) window.measured += 1
        return getComputedStyle(element, ...more)
    }
}"""
# Blockly tells of new blocks behind the next picture, and draws them again in the one after that.
DRAWN_AGAIN = "() => new Promise(done => requestAnimationFrame(() => setTimeout(() => requestAnimationFrame(done))))"
SIZES = """() => [...document.querySelectorAll('.blocklyDraggable')]
    .map(block => [block.textContent, block.querySelector(':scope > .blocklyPath').getBBox().width,
        [...block.querySelectorAll('text')].map(text => parseFloat(getComputedStyle(text).fontSize))])"""


def test_the_text_and_the_blocks_follow_each_other(show) -> None:
    studio = show(PROGRAM, level="python")
    studio.look_up("python")
    text = studio.page.get_by_role("textbox", name=studio.say("python.text"))
    expect(text).to_contain_text("forward(3),")
    # An edit of the text changes the blocks, and their words.
    text.get_by_text("left(1)").click()
    studio.page.keyboard.press("End")
    for typed in ("  # round", "Enter", "wait(2),"):
        studio.page.keyboard.press(typed) if typed == "Enter" else studio.page.keyboard.type(typed)
    expect(studio.block("leader", "wait")).to_be_visible()
    # An edit of the blocks changes the text, which keeps its comment.
    studio.type_into(studio.field(studio.block("leader", "forward"), "3"), "5")
    expect(text).to_contain_text("forward(5),")
    expect(text).to_contain_text("left(1),  # round")
    studio.undo()
    expect(text).to_contain_text("forward(3),")
    # A mistake is told at its line, and the blocks stay.
    text.get_by_text("wait(2)").click()
    studio.page.keyboard.press("Home")
    studio.page.keyboard.type("x")
    expect(studio.page.get_by_role("status").filter(has_text="Did you mean 'wait'?")).to_be_visible()
    expect(studio.block("leader", "wait")).to_be_visible()
    # It is told with the drawer closed, too, and leads back to the text.
    studio.page.get_by_role("button", name=studio.say("drawer.close")).click()
    studio.diagnostics.get_by_role("button", name="Did you mean 'wait'?").click()
    studio.page.get_by_role("button", name=studio.say("python.writeAnew")).click()
    expect(text).to_contain_text("wait(2),")


def test_what_fits_is_listed_beside_the_text_and_while_typing(show) -> None:
    studio = show(PROGRAM, level="python")
    studio.look_up("python")
    functions = studio.page.get_by_role("group").filter(has_text=studio.say("python.functions"))
    expect(functions).to_contain_text("led(which, seconds)")
    text = studio.page.get_by_role("textbox", name=studio.say("python.text"))
    keyboard, offers = studio.page.keyboard, studio.page.get_by_role("listbox", name=studio.say("python.completions"))
    text.get_by_text("left(1)").click()
    keyboard.press("End")
    # Nothing is in Enter's way at the end of a line; a name is chosen by the keyboard, a value by the mouse.
    keyboard.press("Enter")
    keyboard.type("le")
    expect(offers.get_by_role("option")).to_have_count(3)
    keyboard.press("ArrowDown")
    expect(offers.get_by_role("option", name="left(seconds")).to_have_attribute("aria-selected", "true")
    keyboard.press("ArrowUp")
    expect(offers.get_by_role("option", name="led")).to_have_attribute("aria-selected", "true")
    keyboard.press("Enter")
    offers.get_by_role("option", name=studio.say("levels.light.2")).click()
    keyboard.type(", ")
    expect(offers.get_by_role("option", name="seconds=")).to_be_visible()
    keyboard.press("Escape")
    expect(offers).to_have_count(0)
    keyboard.type("1")
    expect(text).to_contain_text("led(2, 1)")
    expect(studio.block("leader", "light")).to_be_visible()
    keyboard.press("Tab")
    expect(text).not_to_be_focused()


def test_a_wrong_block_says_what_would_fix_it_and_keeps_the_cars_from_driving(show) -> None:
    studio = show(Program([wait(1), forward(1.5)]).as_dict())
    studio.expect_words(["01000000", "60800000"])
    studio.play()
    expect(studio.notices).to_contain_text("1.5 s can't be made")
    studio.page.get_by_role("note").get_by_role("button", name="make it 2 s").click()
    expect(studio.diagnostics).to_have_count(0)
    studio.expect_words(["02000000", "60800000", "65000000"])


@pytest.mark.parametrize("language", [pytest.param("en", marks=pytest.mark.soak), "zh"])
def test_blocks_are_roomy_and_narrow_on_every_level(open_page, language) -> None:
    together_all = together(wait(3), led(3, 3), avoid(3, 3), voice(), pir())
    steps = [
        forward(3, speed=3),
        left(3, speed=3, unless=person()),
        wait(765),
        avoid(0, 30),
        voice(1),
        pir(1),
        repeat(999, led(0, 1), wander(3)),
        together_all,
    ]
    followers = Followers([forward(1, accept_ir=False, forward=True)])
    studio = open_page(project=Program(steps, followers).as_dict(), language=language)
    for level in ("words", "start"):
        if level == "start":
            named = studio.say("level.button", level=studio.say("level.words"))
            studio.choose(named, item=studio.say("level.start"), exact=False)
            expect(studio.page.get_by_role("tab", name=studio.say("drawer.words"))).to_have_count(0)
        studio.page.get_by_role("radio", name=studio.say("editors.followers"), exact=True).click()
        blocks = studio.page.evaluate(SIZES)
        assert len(blocks) == 20
        for kind, width, sizes in blocks:
            assert width <= WIDEST_PX, kind
            assert min(sizes) >= LEAST_TYPE_PX, kind


def test_a_long_text_is_pasted_without_measuring_each_block(show) -> None:
    studio = show(PROGRAM, level="python")
    studio.look_up("python")
    text = studio.page.get_by_role("textbox", name=studio.say("python.text"))
    expect(text).to_contain_text("left(1)")
    text.focus()
    studio.page.keyboard.press("ControlOrMeta+a")
    studio.page.evaluate(COUNT_MEASUREMENTS)
    # As a slow tablet, where pictures are far apart.
    processor = studio.context.new_cdp_session(studio.page)
    processor.send("Emulation.setCPUThrottlingRate", {"rate": 5})
    steps = ", ".join(["forward(3)", "left(1)"] * 40)
    text.evaluate(PASTE, f"program = Program([{steps}], Followers([{steps}]))")
    for editor in ("leader", "followers"):
        blocks = studio.page.locator(f"#{editor}-blocks .blocklyBlockCanvas .blocklyBlock")
        expect(blocks).to_have_count(81)
    studio.page.evaluate(DRAWN_AGAIN)
    assert 0 < studio.page.evaluate("measured") <= 40
    processor.detach()
