"""Every state of the studio fits every window: nothing is cut off, covered or out of reach."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import expect

from support.layout import FEW, SIZES, Windows, wait_for_picture
from support.studio_page import StudioPage
from support.studio_programs import FOLLOWED, FURNISHED

LEVELS = {"words": ("words", "timeline"), "python": ("python",)}
DIALOGS = ("upload", "library", "examples", "share", "help")


def show_level(studio: StudioPage, level: str) -> None:
    studio.page.locator("header").get_by_role("button", name=studio.say("level.button", level="")).click()
    studio.page.get_by_role("menuitemradio").filter(has_text=studio.say(f"level.{level}About")).click()


def close_drawer(studio: StudioPage) -> None:
    studio.page.get_by_role("button", name=studio.say("drawer.close"), exact=True).click()


def states(studio: StudioPage) -> Iterator[str]:
    """Show each state of the page in turn."""
    page = studio.page
    tour = page.get_by_role("complementary").get_by_role("button")
    yield "welcome"
    for step in ("drag", "play"):
        tour.last.click()
        yield f"tour, {step}"
    tour.first.click()
    yield "a project that is not saved"
    for panel in ("swarm", "things"):
        studio.look_up(panel)
        yield panel
    for level, panels in LEVELS.items():
        show_level(studio, level)
        for panel in panels:
            studio.look_up(panel)
            yield f"{panel} at level {level}"
    close_drawer(studio)
    for mission, panel in (("forward-and-stop", "swarm"), ("flip-the-lamp", "words")):
        page.get_by_role("button", name=studio.say("missions.title"), exact=True).click()
        expect(page.locator(f"[data-mission={mission}]")).to_be_visible()
        yield "map of missions"
        page.locator(f"[data-mission={mission}]").click()
        task = page.get_by_role("list", name=studio.say("missions.goals"))
        expect(task.or_(page.get_by_role("alertdialog"))).to_be_visible()
        if page.get_by_role("alertdialog").count():
            yield "question"
            page.get_by_role("alertdialog").get_by_role("button").last.click()
        expect(task).to_be_visible()
        for bits in page.get_by_role("group", name=studio.say("missions.bits")).all():
            expect(bits.get_by_role("button").last).to_be_in_viewport()
        yield mission
        studio.look_up(panel)
        yield f"{mission} with {panel}"
        close_drawer(studio)
    for menu in ("menu.project", "settings.title"):
        page.get_by_role("button", name=studio.say(menu), exact=True).click()
        yield menu
        page.keyboard.press("Escape")
    for name in DIALOGS:
        studio.open_dialog(name)
        yield name
        page.keyboard.press("Escape")
        expect(page.get_by_role("dialog")).to_have_count(0)


@pytest.mark.parametrize(("language", "theme"), [pytest.param("en", "light", marks=pytest.mark.soak), ("zh", "dark")])
def test_every_state_fits_every_window(open_page, language, theme) -> None:
    studio = open_page(size=FEW[-1], plain=True, tour=True, level="start", language=language, theme=theme)
    windows = Windows(studio.page)
    assert [fault for state in states(studio) for fault in windows.faults(state)] == []


def test_a_long_number_shows_whole_and_a_notice_covers_no_control_and_goes_with_its_cause(open_page) -> None:
    studio = open_page(size=SIZES[-1], plain=True, project=FURNISHED)
    studio.look_up("things")
    studio.page.get_by_role("option", name=studio.say("mat.things.person")).click()
    coordinate = studio.page.get_by_role("tabpanel").get_by_role("textbox").nth(2)
    coordinate.fill("99999999999")
    coordinate.press("Tab")
    expect(coordinate).to_have_value("100,000")
    assert Windows(studio.page).faults("a long number") == []
    close_drawer(studio)
    studio.page.get_by_role("radio", name=studio.say("editors.followers"), exact=True).click()
    studio.page.get_by_role("button", name=studio.say("editors.leaderOnly"), exact=True).click()
    expect(studio.notices).to_contain_text(studio.say("editors.dropped"))
    assert Windows(studio.page).faults("notice") == []
    studio.undo()
    expect(studio.notices).not_to_contain_text(studio.say("editors.dropped"))


def test_the_smallest_phone_shows_each_tool_whole(open_page) -> None:
    """320 px are also a window of 1,280 px at 400 %, as WCAG 1.4.10 asks for."""
    studio = open_page(size=(320, 568), level="start")
    tools = studio.page.locator("header").get_by_role("button").all()
    assert len(tools) == 6
    for tool in tools:
        expect(tool).to_be_in_viewport(ratio=1)
    studio.page.set_viewport_size({"width": 360, "height": 640})
    studio.play()
    expect(studio.mat_button("pause")).to_be_visible()
    assert studio.box(studio.mat_button("pause"))["y"] == studio.box(studio.mat_button("fullScreen"))["y"]


def test_the_stage_alone_is_no_wider_than_the_smallest_phone(open_page) -> None:
    """What lies out of sight below it takes no part. Pages on an iPhone can't ask for the whole screen."""
    studio = open_page(size=(320, 568), level="start")
    studio.page.evaluate("() => { Element.prototype.requestFullscreen = undefined }")
    studio.mat_button("fullScreen").click()
    expect(studio.page.locator("[data-alone]").first).to_be_visible()
    assert studio.page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")


def test_the_program_is_back_in_its_place_after_a_block_was_dropped(open_page) -> None:
    studio = open_page(size=(1024, 768), plain=True, level="start")
    hat = studio.block("leader", "Again and again")
    before = studio.box(hat)["x"]
    studio.drag_out("leader", "drive", "drive", below=hat)
    expect(hat).to_contain_text("forward")
    expect(studio.editor("leader").get_by_role("option")).to_have_count(0)
    # The outline of what has the focus belongs to the box.
    assert studio.box(hat)["x"] == pytest.approx(before, abs=10)


def test_the_bits_beside_blocks_are_apart_cover_none_and_are_drawn_where_they_are_seen(open_page) -> None:
    studio = open_page(plain=True, project=FOLLOWED, language="zh", theme="dark")
    for width, height in SIZES:
        studio.page.set_viewport_size({"width": width, "height": height})
        wait_for_picture(studio.page)
        wait_for_picture(studio.page)
        bits = studio.page.evaluate(_BITS)
        assert bits["faults"] == [], f"{width}×{height}"
        assert bits["words"] == 2, f"{width}×{height}"
    # Of a long program those are drawn that are seen.
    steps = [{"drive": {"direction": "left", "speed": 1 + k % 3, "seconds": 3}} for k in range(100)]
    studio.take({**FOLLOWED, "leader": steps})
    studio.page.set_viewport_size({"width": SIZES[2][0], "height": SIZES[2][1]})
    for scrolled in (0, 2000, 9000):
        studio.editor("leader").hover()
        studio.page.mouse.wheel(0, scrolled)
        wait_for_picture(studio.page)
        wait_for_picture(studio.page)
        bits = studio.page.evaluate(_BITS)
        assert bits["faults"] == [], scrolled
        assert bits["seen"] > 1, scrolled
        # The others would cost each edit a picture.
        assert bits["words"] < 30, scrolled
        assert bits["painted"] < 30, scrolled


# How many words the leader's blocks have beside them, how many of those are seen, how many blocks are painted, and what
# is wrong: digits, words and blocks that lie over one another, and blocks in view that are not painted.
_BITS = """() => {
  const host = document.querySelector("#leader-blocks"), view = host.getBoundingClientRect(), faults = [];
  const shared = (a, b, [from, to]) => Math.min(a[to], b[to]) - Math.max(a[from], b[from]);
  const over = (a, b) => shared(a, b, ["left", "right"]) > 0.5 && shared(a, b, ["top", "bottom"]) > 0.5;
  // Without the knob at the lower left.
  const body = (block) => {
    const { left, top, right, bottom } = block.getBoundingClientRect();
    return { left, top, right, bottom: bottom - 10 };
  };
  const words = [...host.querySelectorAll(".blocklyBlockCanvas > g[aria-hidden=true] > g")];
  const boxes = words.map((word) => word.getBoundingClientRect());
  const blocks = [...host.querySelectorAll(".blocklyBlockCanvas .blocklyDraggable > .blocklyPath")];
  for (const [k, box] of boxes.entries()) {
    if (box.left < view.left || box.right > view.right) faults.push(`word ${k} is cut off`);
    if (boxes.some((other, j) => j > k && over(box, other))) faults.push(`word ${k} lies over the next`);
    if (blocks.some((block) => over(box, body(block)))) faults.push(`word ${k} lies over a block`);
    const digits = [...words[k].querySelectorAll("text")].flatMap((text) =>
      [...text.textContent].map((_, at) => text.getExtentOfChar(at)).map(({ x, y, width }) => ({ x, y, width })));
    digits.sort((a, b) => a.y - b.y || a.x - b.x);
    const close = digits.filter(({ x, y, width }, at) => digits[at + 1]?.y === y && digits[at + 1].x < x + width);
    if (close.length) faults.push(`${close.length} digits of word ${k} lie over the next`);
    if (digits.length !== 32) faults.push(`word ${k} has ${digits.length} bits`);
  }
  const seen = boxes.filter(({ top, bottom }) => top < view.bottom && bottom > view.top).length;
  const isPainted = (block) => {
    const field = block.parentNode.querySelector(":scope > .blocklyField > *");
    return getComputedStyle(block).fill !== "none" && (!field || getComputedStyle(field).visibility === "visible");
  };
  const painted = blocks.filter(isPainted).length;
  for (const block of blocks.filter((each) => over(view, each.getBoundingClientRect()) && !isPainted(each)))
    faults.push(`${block.ariaLabel} is in view and not painted`);
  return { words: words.length, seen, painted, faults };
}"""
