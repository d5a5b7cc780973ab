"""Programs are built by mouse and keyboard, compiled to words, and refused with the documents' own sentences."""

import json
from pathlib import Path

import pytest
from playwright.sync_api import expect

from support.command_line import data
from support.hands import DRAWN
from support.layout import serious_barriers
from support.studio_page import StudioPage
from support.studio_programs import EMPTY, EXAMPLE, LIT, SHELTERED, TOO_LONG
from support.waiting import wait_until

NO_INFRARED = {"en": "A leader can't be set to accept infrared.", "zh": "无法设置头车接受红外信息"}
COLOUR = "element => getComputedStyle(element).backgroundColor"
TOO_MANY = {"en": "The serial modules in use are more than 255", "zh": "所用的串行模块数目已经大于255"}

IN_BOTH = pytest.mark.parametrize("language", ["zh", pytest.param("en", marks=pytest.mark.soak)])


@pytest.fixture
def example_words(tmp_path: Path) -> list[str]:
    """What the command line makes of the documents' example."""
    path = tmp_path / "example.motorcade.json"
    path.write_text(json.dumps(EXAMPLE), encoding="utf-8")
    return [f"{word:08x}" for word in data("compile", path, "--json")["words"]]


def test_the_documents_example_is_built_with_the_mouse(show, example_words) -> None:
    studio = show(EMPTY)
    studio.drag_out("leader", "drive", "drive", below=studio.hat("leader"))
    first = studio.block("leader", "forward")
    studio.type_into(studio.field(first, "1"), "3")
    studio.drag_out("leader", "drive", "drive", below=first)
    studio.pick(studio.field(studio.block("leader", "forward"), "forward"), "left")
    studio.pick(studio.field(studio.block("leader", "left"), "60°"), "30°")
    studio.expect_words(example_words)


def test_the_documents_example_is_built_by_keyboard_alone(open_page, example_words) -> None:
    studio = open_page()
    press_until_at(studio, "Tab", "link", "Skip to the blocks")
    studio.page.keyboard.press("Enter")
    insert_first_block(studio)
    type_seconds(studio, "3")
    insert_first_block(studio)
    for arrow, field in (("ArrowDown", "dropdown: forward"), ("ArrowUp", "dropdown: 2 ·")):
        press_until_at(studio, "ArrowRight", "button", field)
        for key in ("Enter", arrow, "Enter"):
            studio.page.keyboard.press(key)
    studio.expect_words(example_words)


@pytest.mark.soak
def test_the_program_stays_in_view_beside_an_open_drawer(show) -> None:
    studio = show(EXAMPLE)
    first, drawer = studio.block("leader", "left"), studio.editor("leader").get_by_role("treeitem", name="Drive")
    before = studio.box(first)
    drawer.click()
    option = studio.editor("leader").get_by_role("option").first
    expect(option).to_be_visible()
    # The workspace scrolls in the pictures that follow.
    wait_until(lambda: studio.box(first)["x"] > studio.box(option)["x"] + studio.box(option)["width"])
    studio.page.keyboard.press("Escape")
    expect(studio.editor("leader").get_by_role("option")).to_have_count(0)
    # The outline of what has the focus belongs to the box.
    wait_until(lambda: abs(studio.box(first)["x"] - before["x"]) <= 10)


@pytest.mark.soak
def test_blocks_that_are_tapped_go_to_the_end_of_the_program(open_page) -> None:
    studio = open_page()
    for drawer, block in (("drive", "wait"), ("drive", "wait"), ("order", "repeat")):
        studio.editor("leader").get_by_role("treeitem", name=studio.say(f"drawers.{drawer}")).click()
        option = studio.editor("leader").get_by_role("option", name=block).first
        # Beside its fields, which a tap would open.
        option.click(position={"x": 12, "y": 12})
        expect(option).to_have_count(0)
    studio.expect_words(["02000000", "60800000", "60800000"])
    # Without its empty block.
    studio.undo()
    studio.undo()
    studio.expect_words(["01000000", "60800000"])


@pytest.mark.soak
def test_the_first_block_that_comes_by_keyboard_hangs_under_the_hat(open_page) -> None:
    studio = open_page()
    press_until_at(studio, "Tab", "treeitem", "Drive")
    for key in ("ArrowRight", "Enter"):
        studio.page.keyboard.press(key)
    expect(studio.editor("leader").get_by_role("status")).to_contain_text("after Leader")
    studio.page.keyboard.press("Enter")
    studio.expect_words(["01000000", "64800000"])


def test_an_undo_while_the_arrow_keys_move_a_block_ends_the_move_alone(open_page) -> None:
    """Blockly alone fails to take the block away, and it stays for ever."""
    studio = open_page()
    studio.drag_out("leader", "drive", "drive", below=studio.hat("leader"))
    studio.expect_words(["01000000", "64800000"])
    status = studio.editor("leader").get_by_role("status")
    studio.page.keyboard.press("m")
    expect(status).to_contain_text("Moving")
    studio.page.keyboard.press("Control+z")
    expect(status).to_contain_text("Canceled")
    studio.expect_words(["01000000", "64800000"])
    # Blockly may tell of the move and of its end as one edit more.
    studio.page.keyboard.press("Control+z")
    studio.page.keyboard.press("Control+z")
    studio.expect_words(["00000000"])


def press_until_at(studio: StudioPage, key: str, role: str, name: str) -> None:
    """Press a key until this element has the focus."""
    wanted = studio.page.get_by_role(role, name=name)
    for _ in range(30):
        studio.page.keyboard.press(key)
        if wanted.evaluate_all("all => all.includes(document.activeElement)"):
            return
    pytest.fail(f"{key} never led to the {role} {name!r}")


def insert_first_block(studio: StudioPage) -> None:
    """Move the first drawer's first block to the end of the program."""
    studio.page.keyboard.press("t")
    press_until_at(studio, "ArrowRight", "option", "drive")
    studio.page.keyboard.press("Enter")
    status = studio.editor("leader").get_by_role("status")
    expect(status).to_contain_text("Moving")
    # Blockly moves the focus to the new block when it has drawn it.
    studio.page.evaluate(DRAWN)
    while " after " not in (place := status.inner_text()):
        studio.page.keyboard.press("ArrowUp")
        expect(status).not_to_have_text(place)
    studio.page.keyboard.press("Enter")
    studio.page.evaluate(DRAWN)


def type_seconds(studio: StudioPage, seconds: str) -> None:
    press_until_at(studio, "ArrowRight", "button", "Edit number")
    studio.page.keyboard.press("Enter")
    studio.page.keyboard.type(seconds)
    studio.page.keyboard.press("Enter")


def test_a_block_that_is_not_attached_looks_so_and_a_sentence_says_so(show) -> None:
    studio = show(EMPTY)
    studio.drag_out("leader", "drive", "drive", below=studio.hat("leader"))
    loose = studio.page.locator("g.motorcade-loose")
    expect(loose).to_have_count(0)
    sentence = studio.page.get_by_text(studio.say("editors.loose"))
    expect(sentence).to_have_count(0)
    block = studio.box(studio.block("leader", "drive"))
    mouse = studio.page.mouse
    mouse.move(block["x"] + 12, block["y"] + block["height"] / 2)
    mouse.down()
    mouse.move(block["x"] + 60, block["y"] + 160, steps=6)
    expect(loose).to_have_count(0)
    mouse.up()
    expect(loose).to_have_count(1)
    expect(sentence).to_be_visible()
    studio.undo()
    expect(loose).to_have_count(0)
    expect(sentence).to_have_count(0)


def test_a_block_highlights_its_bits_and_bits_select_their_block(show) -> None:
    studio = show(project=LIT)
    studio.block("leader", "light up").click(position={"x": 12, "y": 12})
    lit = studio.words_table.locator("[data-lit]")
    expect(lit).to_have_count(2)
    for bits in ("22–21", "20–19"):
        expect(lit.and_(studio.words_table.get_by_label(bits))).to_have_count(1)
    studio.words_table.get_by_role("gridcell", name="200 mm/s").click()
    expect(studio.block("leader", "forward")).to_contain_class("blocklySelected")
    expect(studio.block("leader", "light up")).not_to_contain_class("blocklySelected")
    expect(lit.and_(studio.words_table.get_by_label("28–27"))).to_have_count(1)


@IN_BOTH
def test_more_states_than_a_car_holds_are_refused(show, language) -> None:
    studio = show(language=language, project=TOO_LONG)
    expect(studio.diagnostics).to_contain_text([TOO_MANY[language]])
    # The sentence is a link to the block that needs most states, which shows it too.
    studio.diagnostics.get_by_role("button").first.click()
    costly = studio.block("leader", "128")
    expect(costly).to_contain_class("blocklySelected")
    expect(costly.locator(":scope > .blocklyIconGroup")).to_be_visible()
    # Where the system chooses the colours, the bar still says that there are too many.
    studio.page.emulate_media(forced_colors="active")
    bar = studio.page.get_by_role("meter").first.locator("span:has(> span)")
    colours = [part.evaluate(COLOUR) for part in (bar, bar.locator("> span"))]
    studio.page.emulate_media(forced_colors="none")
    assert colours[0] != colours[1]
    assert serious_barriers(studio.page) == []


@IN_BOTH
def test_blocks_are_copied_between_the_editors_but_for_a_leaders_infrared(show, language) -> None:
    studio = show(language=language, project=SHELTERED)
    block = studio.block("followers", studio.say("blocks.infrared").partition(" ")[0])
    block.click(position={"x": 12, "y": 12})
    studio.page.keyboard.press("Control+c")
    studio.hat("leader").click(position={"x": 12, "y": 30})
    studio.page.keyboard.press("Control+v")
    expect(studio.notices).to_contain_text(NO_INFRARED[language])
    studio.expect_words(["02010200", "65800000", "6a800000", "35000000"])
    studio.block("leader", studio.say("blocks.left")).click(position={"x": 12, "y": 12})
    studio.page.keyboard.press("Control+c")
    block.click(position={"x": 12, "y": 12})
    studio.page.keyboard.press("Control+v")
    expect(studio.block("followers", studio.say("blocks.left"))).to_be_visible()
