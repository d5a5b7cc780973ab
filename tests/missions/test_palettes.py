"""What a mission's texts and solution name is there, by that very name: its blocks, switches, values and lamps."""

import re

import pytest

from motorcade.locales import catalogue, languages
from motorcade.missions.document import missions
from motorcade.program.blocks import SETTINGS_IN_START
from motorcade.program.flow_steps import FLOW_KINDS
from motorcade.program.model import Followers, placed_steps
from motorcade.program.reactions import reactions_of
from motorcade.program.steps import KINDS, own_fields

MISSIONS = {each.id: each for each in missions()}
QUOTED = {"en": r"(?<!\w)'([^']+)'(?!\w)", "zh": "“([^”]+)”"}
LAMPS = {language: catalogue(language)["page"]["levels"]["light"] for language in languages()}


def texts_of(mission, language):
    goals = [goal.text for goal in mission.goals if goal.text]
    zones = [zone.title for zone in mission.zones]
    wordings = [mission.story, mission.learned, *mission.hints, *goals, *zones]
    return [each.sentence(language) for each in wordings]


def parts_of(text):
    """What a block says: each part between its fields, and the whole with … for them."""
    plain = text.replace("\n", " ")
    whole = re.sub(r" ?%\d ?", "…", plain) if re.search(r"[^\x00-\x7f]", plain) else re.sub(r"%\d", "…", plain)
    parts = {part.strip() for each in (plain, *text.split("\n")) for part in re.split(r"%\d", each)}
    return {whole, *parts} - {""}


def hat_of(page, is_start):
    """The names of the switches on the followers' first block."""
    return parts_of(page["startBlocks" if is_start else "blocks"]["followers"])


# The blocks of a leader that decides, by the kind that a mission allows; those of conditions come with 'if'.
DECIDING = {
    "if": [
        *("if", "else", "wait_until", "when_not", "when_all", "when_any"),
        *("when_obstacle", "when_person", "when_voice", "when_floor", "when_chance"),
    ],
    "repeat": ["repeat_until", "forever"],
    "set": ["set", "set_random"],
    "change": ["change"],
    "tell": ["tell", "in_turn"],
    "do": ["define", "do"],
}


# What a drive's block can mind; these kinds have blocks of their own only where something can stand beside them.
MINDED = {"pir", "voice", "avoid", "floor"}


def deciding_names(palette, blocks):
    """The names of these blocks, of what they ask, and of what ends a step."""
    names = set()
    if "if" in palette:
        names |= {*blocks["ends"].values(), *blocks["endsMenu"].values()}
        names |= {asked.strip("'“”") for asked in blocks["asked"].values()}
        for kind in {*palette} & {*DECIDING}:
            names.update(*(parts_of(blocks[block]) for block in DECIDING[kind]))
    return names


def names_in_palette(mission, language):
    """The names of blocks, values and switches that the page shows in a mission, and of the two editors."""
    page, is_start = catalogue(language)["page"], mission.document["level"] == "start"
    blocks = page["startBlocks" if is_start else "blocks"]
    names = {page["editors"]["leader"], page["editors"]["followers"], *hat_of(page, is_start)}
    names |= deciding_names(mission.palette, page["blocks"])
    for kind in MINDED & {*mission.palette}:
        names |= {page["blocks"]["minds"][kind], *page["blocks"]["unless"].values()}
    for kind in [*({*mission.palette} - {each.kind for each in FLOW_KINDS}), *([] if is_start else ["infrared"])]:
        stands_alone = kind not in KINDS or not KINDS[kind].accompanies or "together" in mission.palette
        names |= parts_of(blocks[kind]) if stands_alone else set()
        for field in own_fields(KINDS[kind]) if kind in KINDS else ():
            menu = field.metadata.get("menu")
            names |= {page["blocks"][option] for option in field.metadata["schema"].get("enum", ())}
            names |= set(page["levels"][menu].values()) if menu else set()
            # What the block itself quotes, such as the words that a car listens for.
        names |= set(re.findall(QUOTED[language], blocks[kind]))
    return names


@pytest.mark.parametrize("name", MISSIONS)
def test_the_solution_is_made_of_blocks_and_switches_that_the_page_shows(name):
    mission = MISSIONS[name]
    is_start = mission.document["level"] == "start"
    followers = mission.solution.followers or Followers([])
    steps = [step for _, step in placed_steps(mission.solution)]
    assert {part.kind for step in steps for part in (step, *reactions_of(step))} <= {*mission.palette}
    settings = {
        name for name in ("accept_ir", "forward", "tagged") if getattr(followers, name) != getattr(Followers([]), name)
    }
    assert not is_start or settings <= {*SETTINGS_IN_START}
    assert not is_start or all(step.forward is None and step.accept_ir is None for step in followers.steps)


@pytest.mark.parametrize("language", languages())
@pytest.mark.parametrize("name", MISSIONS)
def test_what_a_text_quotes_is_in_the_palette(name, language):
    mission = MISSIONS[name]
    names = names_in_palette(mission, language)
    told = " ".join(texts_of(mission, language))
    for quoted in re.findall(QUOTED[language], told):
        assert quoted in names or all(word in names for word in quoted.split()), quoted


@pytest.mark.parametrize("language", languages())
@pytest.mark.parametrize("name", MISSIONS)
def test_a_lamp_has_the_name_that_it_has_in_blocks(name, language):
    mission = MISSIONS[name]
    told = texts_of(mission, language)
    for text in told:
        assert not re.search(r"LED|(lamps?|lights?) \d|\d ?号(路)?灯", text)
    named = {which for which, lamp in LAMPS[language].items() if lamp in " ".join(told).lower()}
    assert not named or "led" in mission.palette
    # Pages tell goals with the same text as one.
    leds = {}
    for goal in mission.goals:
        if goal.kind in ("lit", "not-lit") and goal.values["led"] != "off" and goal.text:
            leds.setdefault(goal.text, set()).add(str(goal.values["led"]))
    for text, of_goals in leds.items():
        of_text = {which for which, lamp in LAMPS[language].items() if lamp in text.sentence(language)}
        assert of_text == of_goals


@pytest.mark.parametrize("language", languages())
def test_the_start_hat_has_the_switch_that_the_page_shows(language):
    page = catalogue(language)["page"]
    fields = re.findall(r"%\d", page["startBlocks"]["followers"])
    assert len(fields) == len(SETTINGS_IN_START)
    assert parts_of(page["blocks"]["infrared"]) & hat_of(page, is_start=True) & hat_of(page, is_start=False)
