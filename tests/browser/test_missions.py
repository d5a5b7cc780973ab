"""Missions in the page: the map, goals, hints, stars, and a mission of one's own."""

import re

import pytest
from playwright.sync_api import expect

from motorcade.missions.document import built_in_mission, missions
from support.layout import serious_barriers, wait_for_picture
from support.studio_page import PHONE, SHARED
from support.studio_programs import EXAMPLE


def open_map(studio):
    studio.page.get_by_role("button", name=studio.say("missions.title"), exact=True).press("Enter")
    expect(studio.page.locator("[data-mission]")).to_have_count(len(missions()))


def middle_of(block):
    """Return where the middle of a block's first words is; a block that runs has a glow, which makes it larger."""
    box = block.locator("text").first.bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def play_from_rest(studio, block):
    """Play once two pictures show a block at one place; return that: the drawer closes when the focus leaves it."""
    studio.page.get_by_role("button", name=studio.say("mat.reset")).press("Enter")
    before, place = None, middle_of(block)
    while before != place:
        wait_for_picture(studio.page)
        before, place = place, middle_of(block)
    studio.page.locator("#mat-play").press("Enter")
    return place


def run_to_the_end(studio, progress):
    """Play from the beginning; at the end the goals stand so."""
    studio.page.get_by_role("button", name=studio.say("mat.reset")).press("Enter")
    studio.page.locator("#mat-play").press("Enter")
    expect(studio.page.get_by_role("status").filter(has_text=progress)).to_be_visible()


def test_a_teacher_reads_and_prints_the_notes_of_a_mission(open_page):
    """By keyboard from the map, and by a link of a class's page; on paper nothing else is there."""
    studio = open_page(language="zh", size=PHONE)
    page = studio.page
    open_map(studio)
    page.get_by_role("button", name=studio.say("missions.notes.title")).press("Enter")
    first, second = (built_in_mission(name) for name in ("forward-and-stop", "a-secret"))
    notes = page.get_by_role("dialog")
    expect(notes).to_contain_text(first.notes.say.sentence("zh"))
    notes.locator("[aria-haspopup=listbox]").press("Enter")
    page.get_by_role("option", name=second.name.sentence("zh")).press("Enter")
    expect(notes).to_contain_text(second.notes.mistakes[0][0].sentence("zh"))
    assert serious_barriers(page) == []
    page.emulate_media(media="print")
    expect(page.locator("#stage")).to_be_hidden()
    expect(notes.get_by_role("button")).to_have_count(0)
    expect(notes.locator("canvas")).to_be_visible()
    page.emulate_media(media="screen")
    page.keyboard.press("Escape")
    page.evaluate("location.hash = '#notes=forward-and-stop'")
    expect(notes).to_contain_text(first.notes.aim.sentence("zh"))
    notes.get_by_role("button", name=studio.say("missions.notes.play")).press("Enter")
    expect(page.get_by_role("list", name=studio.say("missions.goals"))).to_be_visible()
    # The task gives its room to the blocks.
    page.get_by_role("button", name=studio.say("missions.toBlocks")).press("Enter")
    expect(page.get_by_role("button", name=studio.say("missions.showTask"))).to_be_visible()


def print_run(studio):
    """On paper are the stage, the name, and the words as they are in the table; nothing else of the page."""
    page = studio.page
    page.get_by_role("button", name=studio.say("run.open")).press("Enter")
    sheet = page.get_by_role("dialog")
    sheet.get_by_label(studio.say("run.name")).fill("<b>小林")
    stage = sheet.get_by_role("img", name=studio.say("run.stage"))
    assert stage.evaluate("(image) => image.decode().then(() => image.naturalWidth)") > 100
    assert serious_barriers(page) == []
    page.emulate_media(media="print")
    expect(page.locator("#stage")).to_be_hidden()
    expect(sheet.get_by_role("button")).to_have_count(0)
    expect(sheet.get_by_text("<b>小林")).to_be_visible()
    # A header, a word of the leader's and one of the followers'.
    expect(sheet.locator("tbody tr")).to_have_count(3)
    page.emulate_media(media="screen")
    page.keyboard.press("Escape")


def test_a_mission_is_played_by_keyboard_until_it_has_all_stars(open_page):
    """Two tries bring a hint; flipping the right bits brings the stars, which the map keeps after a reload."""
    studio = open_page(language="zh")
    page = studio.page
    open_map(studio)
    assert serious_barriers(page) == []
    page.locator("[data-mission=flip-the-lamp]").press("Enter")
    goals = page.locator("li[data-progress]")
    expect(goals).to_have_count(3)
    studio.run_at("16×")
    hint = page.get_by_role("button", name=studio.say("missions.showHint"))
    for _ in range(2):
        expect(hint).to_have_count(0)
        run_to_the_end(studio, built_in_mission("flip-the-lamp").notes.mistakes[2][0].sentence("zh"))
    expect(goals.first).to_contain_text("1 号小车从没亮过绿灯")
    # Who has tried once knows the story: it folds, and can be read again.
    story = page.get_by_text(built_in_mission("flip-the-lamp").document["story"]["zh"])
    expect(story).to_have_count(0)
    page.get_by_role("button", name=studio.say("missions.showStory")).press("Enter")
    expect(story).to_be_visible()
    hint.press("Enter")
    assert serious_barriers(page) == []
    # What is shown rings the car that the sentence names.
    goals.first.get_by_role("button", name=studio.say("missions.watch")).press("Enter")
    studio.look_up("things")
    expect(page.get_by_role("region", name=studio.say("mat.car", number=1))).to_be_visible()
    bits = page.get_by_role("group", name=studio.say("missions.bits")).get_by_role("button")
    # Bits 22 and 21 choose the lamp; the second word is the followers'.
    bits.and_(page.get_by_role("button", name="第 22 位")).nth(1).press(" ")
    run_to_the_end(studio, "两个位能数 0 到 3")
    expect(page.locator("li[data-progress=met]")).to_have_count(3)
    print_run(studio)
    page.reload()
    studio.wait_until_ready()
    open_map(studio)
    expect(page.locator("[data-mission=flip-the-lamp] [data-earned]")).to_have_count(3)


def test_a_mission_of_ones_own_is_written_played_changed_and_deleted(open_own_page):
    studio = open_own_page()
    page = studio.page
    open_map(studio)
    page.get_by_role("button", name="Write a mission").click()
    editor = page.get_by_role("region", name="A mission of your own")
    editor.get_by_label("Name", exact=True).fill("Stay")
    editor.get_by_label("Name of the zone").fill("here")
    left = editor.get_by_label("From left (m)")
    before = float(left.input_value())
    grip = studio.box(page.get_by_role("button", name="Move here (arrow keys, too)"))
    page.mouse.move(grip["x"] + 10, grip["y"] + 10)
    page.mouse.down()
    page.mouse.move(grip["x"] + 110, grip["y"] + 10, steps=3)
    page.mouse.up()
    assert float(left.input_value()) > before + 0.1
    studio.undo()
    expect(left).to_have_value(f"{before:g}")
    page.get_by_role("button", name="Move here (arrow keys, too)").press("ArrowRight")
    page.get_by_role("button", name="Change the size of here").press("Shift+ArrowRight")
    expect(left).to_have_value(f"{before + 0.05:g}")
    expect(editor.get_by_label("Width (m)")).to_have_value("0.41")
    editor.get_by_label("Seconds").fill("2")
    editor.get_by_role("button", name="What is asked").click()
    page.get_by_role("option", name="touch nothing").click()
    assert serious_barriers(page) == []
    editor.get_by_role("button", name="Try it").click()
    expect(page.get_by_role("region", name="Mission: Stay")).to_be_visible()
    studio.run_at("16×")
    run_to_the_end(studio, "★")
    # The mission goes on after a reload.
    page.reload()
    studio.wait_until_ready()
    expect(page.get_by_role("region", name="Mission: Stay")).to_be_visible()
    page.get_by_role("button", name="Change this mission").click()
    expect(editor.get_by_label("Name of the zone")).to_have_value("here")
    editor.get_by_role("button", name="Save", exact=True).click()
    expect(studio.notices).to_contain_text("'Stay' is saved as version 1.")
    page.get_by_role("button", name="Close without saving").click()
    open_map(studio)
    assert serious_barriers(page) == []
    page.get_by_role("button", name="Change Stay").click()
    expect(editor).to_be_visible()
    page.get_by_role("button", name="Close without saving").click()
    open_map(studio)
    page.get_by_role("button", name="Delete Stay").click()
    page.get_by_role("alertdialog").get_by_role("button", name="Delete").click()
    expect(page.get_by_role("button", name="Play Stay")).to_have_count(0)
    # Who leaves a mission has the level of before, also after a reload.
    page.locator("[data-mission=forward-and-stop]").click()
    expect(page.get_by_role("button", name="Level: Start")).to_be_visible()
    page.reload()
    studio.wait_until_ready()
    page.get_by_role("button", name="Leave the mission").click()
    expect(page.get_by_role("button", name="Level: Words")).to_be_visible()


def begin_first_mission(studio):
    """Open it, and put its first block below the hat; return that block."""
    open_map(studio)
    studio.page.locator("[data-mission=forward-and-stop]").press("Enter")
    expect(studio.page.locator("li[data-progress]")).to_have_count(3)
    if studio.page.get_by_role("button", name=studio.say("missions.toBlocks")).is_visible():
        studio.page.get_by_role("button", name=studio.say("missions.toBlocks")).press("Enter")
        # The focus goes there with the next picture, and would close a list that is open by then.
        expect(studio.page.locator("#leader-blocks :focus, #leader-blocks:focus")).to_have_count(1)
    studio.run_at("16×")
    studio.drag_out("leader", "drive", "drive", below=studio.block("leader", studio.say("startBlocks.leader")))
    return studio.block("leader", "drive")


def let_it_wait(studio, drive):
    """Do the first mission: drive 3 s at medium speed, and wait."""
    studio.type_into(studio.field(drive, "1"), "3")
    studio.drag_out("leader", "drive", "wait", below=drive)
    studio.type_into(studio.field(studio.block("leader", "wait"), "1"), "9")


def test_a_failure_is_told_and_played_again_and_no_block_moves(open_page):
    studio = open_page(plain=True, level="start")
    page = studio.page
    drive = begin_first_mission(studio)
    place = play_from_rest(studio, drive)
    goal = page.locator("li[data-progress]").first
    expect(goal).to_contain_text("the program began again at")
    assert middle_of(drive) == place
    # No star is lit, and the moment is played from before it until just behind it.
    expect(page.locator("[data-progress] [data-earned]")).to_have_count(0)
    goal.get_by_role("button", name=studio.say("missions.watch")).press("Enter")
    expect(studio.clock).to_have_attribute("data-past", "true")
    expect(studio.clock).to_have_text("0:04.6")
    # What was said of the run goes with the first edit.
    studio.type_into(studio.field(drive, "1"), "3")
    expect(goal).not_to_contain_text("began again")
    # Its text is longer now.
    assert middle_of(drive)[1] == place[1]


def test_on_a_phone_who_loses_reads_why_and_who_wins_goes_on_and_no_block_moves(open_page):
    studio = open_page(size=PHONE, level="start")
    page = studio.page
    drive = begin_first_mission(studio)
    place = play_from_rest(studio, drive)
    show_task = page.get_by_role("button", name=studio.say("missions.showTask")).filter(has_text=re.compile("."))
    expect(show_task).to_be_in_viewport(ratio=1)
    assert middle_of(drive) == place
    show_task.press("Enter")
    expect(page.locator("li[data-progress=lost]").first).to_contain_text("the program began again at")
    page.get_by_role("button", name=studio.say("missions.toBlocks")).press("Enter")
    # The first edit takes away what was said of the run.
    let_it_wait(studio, drive)
    expect(show_task).to_have_count(0)

    page.get_by_role("button", name=studio.say("editors.largerBlocks")).press("Enter")
    place = play_from_rest(studio, drive)
    learned = built_in_mission("forward-and-stop").learned.sentence()
    outcome = page.get_by_role("status").filter(has_text=learned, visible=True)
    expect(outcome).to_be_in_viewport(ratio=1)
    expect(outcome.locator("[data-earned]").first).to_be_in_viewport(ratio=1)
    # The cars that dance are seen below it, and the blocks are where they were.
    told, bar = studio.box(outcome), studio.box(page.get_by_role("group", name=studio.say("mat.transport")))
    assert told["y"] + told["height"] < bar["y"] - 50
    assert middle_of(drive) == place
    page.get_by_role("button", name=studio.say("missions.next"), exact=True).click()
    name = built_in_mission("round-the-corner").name.sentence()
    expect(page.get_by_role("region", name=studio.say("missions.mission", name=name))).to_be_visible()


@pytest.mark.soak
def test_a_mission_keeps_the_own_project_and_its_bits_alone_change_its_blocks(open_page):
    studio = open_page(project=EXAMPLE)
    page = studio.page
    open_map(studio)
    page.locator("[data-mission=flip-the-lamp]").click()
    expect(page.get_by_text(studio.say("missions.byBits"))).to_be_visible()
    blocks = page.get_by_role("region", name=studio.say("editors.leaderBlocks"), exact=True)
    seconds = studio.box(blocks.locator("text.blocklyText", has_text=re.compile("^3$")))
    page.mouse.click(seconds["x"] + 3, seconds["y"] + 8)
    expect(page.locator(".blocklyHtmlInput")).to_have_count(0)
    expect(studio.editor("leader").get_by_role("treeitem").first).to_be_hidden()
    studio.look_up("swarm")
    expect(page.get_by_text(studio.say("missions.matStays"))).to_be_visible()
    expect(page.get_by_label(studio.say("mat.range"))).to_have_count(0)
    page.reload()
    studio.wait_until_ready()
    page.get_by_role("button", name=studio.say("missions.leave")).click()
    expect(studio.name).to_have_value(SHARED)
    expect(page.get_by_text(studio.say("project.unsaved"), exact=True)).to_be_visible()
    expect(studio.block("leader", "left")).to_be_visible()
    expect(studio.editor("leader").get_by_role("treeitem").first).to_be_visible()


def test_back_leads_from_a_mission_to_the_map_and_not_out_of_the_page(open_page):
    studio = open_page(project=EXAMPLE)
    page = studio.page
    for mission in ("forward-and-stop", "a-secret"):
        open_map(studio)
        page.locator(f"[data-mission={mission}]").press("Enter")
        expect(page.get_by_role("dialog")).to_have_count(0)
        expect(page.get_by_role("list", name=studio.say("missions.goals"))).to_be_visible()
    # One mission after another is one step.
    page.go_back()
    expect(studio.dialog("missions.title")).to_be_visible()
    expect(page.get_by_role("list", name=studio.say("missions.goals"))).to_have_count(0)
    page.keyboard.press("Escape")
    expect(studio.name).to_have_value(SHARED)
    # Who leaves a mission by its own button has gone back as well.
    open_map(studio)
    page.locator("[data-mission=forward-and-stop]").press("Enter")
    page.get_by_role("button", name=studio.say("missions.leave")).press("Enter")
    expect(studio.name).to_have_value(SHARED)
    page.wait_for_function("history.state === null")
