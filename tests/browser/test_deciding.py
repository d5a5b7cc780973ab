"""Programs of a leader that decides are built from an empty page, and their bits lead to conditions."""

import re

import pytest
from playwright.sync_api import expect

from motorcade.program.compiler import compile_program
from motorcade.program.model import program_from_dict
from support.hands import Keyboard, Pointer
from support.soak import SOAK
from support.studio_programs import EMPTY

FOLLOWED = {**EMPTY, "followers": {"forward": True, "steps": []}}
# Wait until a person is near, then light up.
GUARDS = ["03000002", "61800100", "80028000", "40080000"]


# The leader meets somebody, and then the followers wait until nobody is there any more.
SHEEPDOG = {
    **EMPTY,
    "leader": [
        {"drive": {"direction": "forward", "speed": 2}, "until": {"person": {}}},
        {"tell": {"step": {"wait": {"seconds": 1}}}},
        {"wait": {}, "until": {"not": {"person": {}}}},
    ],
}
DRIVE = {"drive": {"direction": "forward", "speed": 2, "seconds": 3}}
STOPS, NEAREST = "A0800000", 8
MET = {"en": "somebody was near", "zh": "附近有人"}
# Mouse and finger build below.
HANDS = [("keyboard", "zh")]
MORE_HANDS = [("mouse", "en"), ("mouse", "zh"), ("touch", "en"), ("touch", "zh"), ("keyboard", "en")]


@pytest.mark.parametrize(("hand", "language"), [*HANDS, *(MORE_HANDS if SOAK else [])])
def test_a_sheepdog_is_built_from_an_empty_page_and_stops_its_followers(open_page, hand, language) -> None:
    studio = open_page(language=language, size=(1366, 900), has_touch=hand == "touch")
    pupil = Keyboard(studio) if hand == "keyboard" else Pointer(studio)
    pupil.insert("drive", "drive", "after", "leader")
    pupil.end_by_condition("drive")
    pupil.insert("decide", "when_person", "gap", "drive")
    pupil.insert("tell", "tell", "after", "drive")
    pupil.insert("drive", "wait", "inside", "tell")
    pupil.insert("decide", "wait_until", "after", "tell")
    pupil.insert("decide", "when_not", "gap", "wait_until")
    pupil.insert("decide", "when_person", "gap", "when_not")
    words = compile_program(program_from_dict(SHEEPDOG)).words
    studio.expect_words([f"{word:08x}" for word in words])
    pupil.press(studio.mat_button("play"))
    studio.expect_moving()
    # Somebody comes.
    pupil.press(studio.mat_button("pause"))
    pupil.put_person()
    pupil.press(studio.mat_button("play"))
    studio.choose_car(0)
    leader = studio.page.get_by_role("region", name=studio.say("mat.car", number=0))
    expect(leader).to_contain_text(MET[language])
    # The one behind the leader hears it without others' help.
    studio.choose_car(NEAREST)
    follower = studio.page.get_by_role("region", name=studio.say("mat.car", number=NEAREST))
    expect(follower).to_contain_text(STOPS)


def test_a_guard_dog_is_built_with_the_mouse(show) -> None:
    studio = show(EMPTY)
    studio.drag_out("leader", "decide", "wait until", below=studio.hat("leader"))
    wait = studio.block("leader", "wait until")
    studio.drag_into("decide", "a person is near", wait)
    studio.drag_out("leader", "light", "light up", below=wait)
    studio.expect_words(GUARDS)
    # It shines until somebody says 'stop', and not for one second.
    light = studio.block("leader", "light up")
    light.click(position={"x": 14, "y": 14})
    studio.field(light, "+").click()
    studio.page.get_by_role("option", name=studio.say("blocks.endsMenu.until"), exact=True).click()
    studio.drag_into("decide", "somebody says", light)
    studio.expect_words(["04000002", "61800100", "80028000", "40180180", "80238000"])


def test_a_sheepdog_is_built_with_the_mouse(show) -> None:
    studio = show(FOLLOWED)
    studio.drag_out("leader", "decide", "if", below=studio.hat("leader"))
    asks = studio.block("leader", "if")
    studio.drag_into("decide", "a person is near", asks)
    studio.drag_into("tell", "tell the followers", asks, row=0)
    tells = studio.block("leader", "tell the followers")
    studio.drag_into("drive", "wait", tells, row=0)
    studio.drag_out("leader", "drive", "drive", below=asks)
    # What they are told is a word of theirs.
    studio.expect_words(["03010103", "80228000", "c0000000", "64800000", "e0800000"])


@pytest.mark.parametrize("language", ["en", pytest.param("zh", marks=pytest.mark.soak)])
def test_bits_of_a_condition_light_up_with_it_and_lead_to_it(show, language) -> None:
    turns = {"drive": {"direction": "left", "speed": 2}, "until": {"not": {"obstacle": 1}}}
    studio = show({**EMPTY, "leader": [turns]}, language)
    until = studio.words_table.locator('[data-field="until"]')
    until.click()
    lit = studio.words_table.locator("[data-lit]")
    fields = ["until", "until_not", "until_level", "condition", "if_not", "level", "counter", "value"]
    expect(lit).to_have_count(len(fields))
    assert lit.evaluate_all("all => all.map(field => field.dataset.field)") == fields
    studio.block("leader", studio.say("blocks.drive").split(" ")[0]).click(position={"x": 14, "y": 14})
    expect(studio.words_table.locator('[data-lit][data-field="motor_speed"]')).to_have_count(1)


COUNTS = {
    **EMPTY,
    "leader": [
        {
            "if": {
                "when": {"person": {}},
                # A car that turned would no longer see the person after two turns.
                "then": [{"led": {"which": 1, "seconds": 1}}],
                "else": [{"wait": {"seconds": 1}}],
            }
        },
        {"change": {"counter": "laps", "by": 1}},
    ],
    "mat": {
        "format": "motorcade-mat/1",
        "name": "Somebody comes",
        "size_m": [4, 3],
        "car": [{"at_m": [1, 1.5], "role": "leader"}],
        "person": [{"path": [[0, 0.1, 0.1], [2, 0.1, 0.1], [2.1, 2, 1.5], [600, 2, 1.5]]}],
    },
}


def test_while_it_runs_blocks_table_and_timeline_show_what_the_leader_decides(open_page) -> None:
    studio = open_page(project=COUNTS)
    marked = studio.page.locator("path.motorcade-met"), studio.page.locator("path.motorcade-taken")
    for paths in marked:
        expect(paths).to_have_count(0)
    studio.play()
    # The taken branch glows with its 'if', and then the condition and the other branch.
    lights, waits = studio.block("leader", "light"), studio.block("leader", "wait")
    expect(waits.locator(":scope > path.motorcade-taken")).to_have_count(1)
    expect(studio.block("leader", "a person is near").locator(":scope > path.motorcade-met")).to_have_count(1)
    expect(lights.locator(":scope > path.motorcade-taken")).to_have_count(1)
    expect(waits.locator(":scope > path.motorcade-taken")).to_have_count(0)
    studio.look_up("words")
    counters = studio.page.get_by_role("list", name=studio.say("words.counters"))
    expect(counters).to_have_text(re.compile(r"laps [1-9]"))
    expect(studio.words_table).to_contain_text("laps + 1")
    expect(studio.words_table.locator("[data-met]").first).to_have_attribute("data-field", "condition")
    studio.mat_button("pause").click()
    studio.choose_car(0)
    studio.look_up("timeline")
    jump = studio.page.get_by_role("button", name=studio.say("timeline.jump"))
    jump.click()
    studio.page.get_by_role("option", name=studio.say("timeline.kinds.decision"), exact=True).click()
    studio.page.get_by_role("button", name=studio.say("timeline.previous"), exact=True).click()
    timeline = studio.page.get_by_role("region", name=studio.say("timeline.title"))
    expect(timeline).to_contain_text(re.compile(r"car 0 · if not a person: go to word \d · no", re.IGNORECASE))


def test_the_run_stops_when_a_condition_of_the_leader_is_met(open_page) -> None:
    studio = open_page(project=COUNTS)
    studio.block("leader", "a person is near").click(button="right", position={"x": 14, "y": 14})
    studio.page.get_by_role("menuitem", name=studio.say("stops.whenMet")).click()
    studio.play()
    stopped = studio.page.get_by_text(re.compile("Stopped at 0:02.*car 0: somebody was near", re.IGNORECASE))
    expect(stopped).to_be_visible()
    expect(studio.mat_button("play")).to_be_visible()


@pytest.mark.parametrize("touches", [pytest.param(False, marks=pytest.mark.soak), True], ids=["mouse", "touch"])
def test_a_drive_minds_what_is_chosen_in_its_block_and_what_its_drawer_offers(open_page, touches) -> None:
    studio = open_page(project={**EMPTY, "leader": [DRIVE]}, has_touch=touches)
    drive = studio.block("leader", studio.say("blocks.forward"))
    studio.press(drive, position={"x": 14, "y": 14})
    studio.press(studio.field(drive, studio.say("blocks.ends.time")))
    studio.press(studio.page.get_by_role("option", name=studio.say("blocks.minds.pir"), exact=True))
    studio.expect_words(["01000000", "65801000"])
    # The first block of its kind in the drawer minds a person, too.
    studio.press(studio.editor("leader").get_by_role("treeitem", name=studio.say("drawers.sense"), exact=True))
    offered = studio.editor("leader").get_by_role("option", name=studio.say("blocks.forward")).first
    expect(offered).to_have_accessible_name(re.compile(studio.say("blocks.unless.holds")))
    studio.press(offered, position={"x": 12, "y": 12})
    studio.expect_words(["02000000", "65801000", "64801000"])
    studio.undo()
    studio.undo()
    studio.expect_words(["01000000", "65800000"])
