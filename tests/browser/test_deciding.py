"""Programs of a leader that decides are built from an empty page, and their bits lead to conditions."""

import pytest
from playwright.sync_api import expect

from support.studio_programs import EMPTY

FOLLOWED = {**EMPTY, "followers": {"forward": True, "steps": []}}
# Wait until a person is near, then light up.
GUARDS = ["03000002", "61800100", "80028000", "40080000"]


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


@pytest.mark.parametrize(("language", "theme"), [("en", "light"), ("zh", "dark")])
def test_bits_of_a_condition_light_up_with_it_and_lead_to_it(open_page, language, theme) -> None:
    turns = {"drive": {"direction": "left", "speed": 2}, "until": {"not": {"obstacle": 1}}}
    studio = open_page(project={**EMPTY, "leader": [turns]}, language=language, theme=theme)
    until = studio.words_table.locator('[data-field="until"]')
    until.click()
    lit = studio.words_table.locator("[data-lit]")
    fields = ["until", "until_not", "until_level", "condition", "if_not", "level", "counter", "value"]
    expect(lit).to_have_count(len(fields))
    assert lit.evaluate_all("all => all.map(field => field.dataset.field)") == fields
    studio.block("leader", studio.say("blocks.drive").split(" ")[0]).click(position={"x": 14, "y": 14})
    expect(studio.words_table.locator('[data-lit][data-field="motor_speed"]')).to_have_count(1)
