"""A page sees what a leader decides: why it does what it does, which branch it took, what it counts and finds now."""

import pytest

from motorcade.engine.events import FLOW, OVER
from motorcade.engine.moment import unpack_events
from motorcade.program.compiler import compile_program
from motorcade.program.model import program_from_dict
from motorcade.service.world_messages import (
    CarDetails,
    Decisions,
    Play,
    Reset,
    Seek,
    SetEnvironment,
    SetWorld,
    Speak,
    StepWorld,
    StopCondition,
    Stopped,
    StopWhen,
    Watch,
)
from support.session_page import SessionPage, server_world, site_world

TICK_MS = 10
FORWARD, LEFT, RIGHT = (
    {"drive": {"direction": direction, "speed": 1, "seconds": 1}} for direction in ("forward", "left", "right")
)
LIGHT, STAND = {"led": {"which": 1, "seconds": 1}}, {"wait": {"seconds": 1}}
NEAR = {"disc": [{"centre_m": [0.26, 0], "radius_m": 0.05}]}
SOMEBODY = {"person": [{"path": [[0, 0.4, 0], [100, 0.4, 0]]}]}
LINE = {"line": [{"points_m": [[0, 0.02], [4, 0.02]]}]}
SOMEBODY_LATER = {"person": [{"path": [[0, 9, 0], [2, 9, 0], [2.01, 0.4, 0], [99, 0.4, 0]]}]}


def mat_with(**things):
    car = {"at_m": [0, 0], "heading_deg": 0, "role": "leader"}
    return {"format": "motorcade-mat/1", "name": "Table", "tick_ms": TICK_MS, "car": [car], **things}


def page_of(leader, *, followers=None, make_world=server_world, named=True, **things):
    document = {"format": "motorcade-program/1", "profile": "classroom", "leader": leader, "followers": followers}
    compiled = compile_program(program_from_dict(document))
    counters = list(compiled.counters) if named else []
    page = SessionPage(make_world, SetWorld(mat_with(**things), compiled.image, counters=counters))
    page.words = compiled.words
    return page


def go(page, seconds):
    for _ in range(round(seconds * 10)):
        page.send(StepWorld(100 // TICK_MS))


def reason(page):
    page.send(Watch(0))
    return page.last(CarDetails).why.sentence


def branching(condition):
    return [{"if": {"when": condition, "then": [LEFT], "else": [RIGHT]}}]


BRANCHES = {
    "something near": ({"obstacle": 1}, NEAR, "left", "something was nearer than 20 cm"),
    "nothing near": ({"obstacle": 1}, {}, "right", "nothing was nearer than 20 cm"),
    "not, nothing near": ({"not": {"obstacle": 3}}, {}, "left", "nothing was nearer than 40 cm"),
    "somebody": ({"person": {}}, SOMEBODY, "left", "somebody was near"),
    "nobody": ({"person": {}}, {}, "right", "nobody was near"),
    "no voice": ({"voice": "go"}, {}, "right", "nobody said 'go'"),
    "dark": ({"floor": "left"}, LINE, "left", "the floor was dark under the left sensor"),
    "light": ({"floor": "both"}, {}, "right", "the floor was not dark under both sensors"),
    "count": ({"counter": "laps", "below": 3}, {}, "left", "laps was below 3"),
    "no count": ({"counter": "laps", "is": 3}, {}, "right", "laps was not 3"),
    "all": ({"all": [{"person": {}}, {"obstacle": 1}]}, SOMEBODY, "right", "nothing was nearer than 20 cm"),
}


@pytest.mark.parametrize("make_world", [server_world, site_world])
@pytest.mark.parametrize("name", BRANCHES)
def test_why_names_the_condition_that_a_leader_went_by(name, make_world):
    condition, things, way, because = BRANCHES[name]
    page = page_of(branching(condition), make_world=make_world, **things)
    go(page, 0.5)
    assert reason(page)["en"] == f"It turns {way}, because {because} at 0.0 s."
    assert "{" not in reason(page)["zh"]


def test_why_names_the_condition_that_ended_a_state_and_when():
    page = page_of([{"wait": {}, "until": {"person": {}}}, LIGHT], **SOMEBODY_LATER)
    go(page, 1)
    assert reason(page)["en"] == "This car leads. It does what its own blocks say."
    go(page, 1.5)
    assert reason(page)["en"] == "It lights up, because somebody was near at 2.0 s."


def test_why_speaks_of_no_counter_that_the_compiler_added():
    steps = [{"repeat": {"times": 100, "steps": [FORWARD, LEFT, RIGHT, LIGHT]}}]
    page = page_of([{"if": {"when": {"person": {}}, "then": [STAND]}}, {"set": {"counter": "laps", "to": 1}}, *steps])
    go(page, 0.5)
    assert "laps" not in reason(page)["en"]
    go(page, 4)
    assert reason(page)["en"] == "This car leads. It does what its own blocks say."


def test_a_leader_whose_words_take_no_time_is_told_so_and_fills_no_timeline():
    page = page_of([{"repeat": {"steps": [{"if": {"when": {"person": {}}, "then": [LIGHT]}}]}}])
    go(page, 0.5)
    assert reason(page)["en"].startswith("It stands still: it goes through its blocks again and again")
    rows = b"".join(page.session.events())
    assert [event for event in unpack_events(rows) if event.kind in (FLOW, OVER)] == []
    page.send(SetEnvironment(mat_with(**SOMEBODY)))
    go(page, 0.2)
    assert reason(page)["en"] == "It lights up, because somebody was near at 0.5 s."


def test_the_way_to_a_state_has_the_words_of_its_branch():
    page = page_of([{"if": {"when": {"person": {}}, "then": [LIGHT], "else": [STAND]}}], **SOMEBODY_LATER)
    go(page, 0.5)
    way = page.last(Decisions).leaders[0].path
    assert page.words[way[-1]] >> 31 == 0
    assert page.words[way[-1]] == page.session.world.simulation.snapshot().word[0]
    go(page, 3)
    assert page.last(Decisions).leaders[0].path[-1] != way[-1]


def test_what_a_condition_finds_now_is_told_while_another_state_runs():
    page = page_of([*branching({"not": {"obstacle": 1}}), STAND])
    go(page, 0.5)
    assert page.last(Decisions).leaders[0].holds == []
    page.send(SetEnvironment(mat_with(**NEAR)))
    go(page, 0.1)
    (found,) = page.last(Decisions).leaders[0].holds
    # The word asks for an obstacle, whatever has to be.
    assert page.words[found] >> 16 & 15 == 1
    page.send(SetEnvironment(mat_with()))
    go(page, 0.1)
    assert page.last(Decisions).leaders[0].holds == []


def test_a_voice_is_found_from_when_it_is_heard_to_the_end_of_the_state():
    page = page_of([STAND, {"if": {"when": {"voice": "go"}, "then": [LIGHT]}}])
    go(page, 0.2)
    page.send(Speak("go"))
    go(page, 0.2)
    assert len(page.last(Decisions).leaders[0].holds) == 1
    go(page, 0.8)
    assert reason(page)["en"] == "It lights up, because somebody said 'go' at 1.0 s."
    assert page.last(Decisions).leaders[0].holds == []


def test_counters_are_told_and_the_past_has_those_of_its_time():
    page = page_of([STAND, {"change": {"counter": "laps", "by": 2}}])
    go(page, 3.5)
    assert page.last(Decisions).leaders[0].counters == [6, 0, 0, 0]
    page.send(Seek(1500))
    assert page.last(Decisions).leaders[0].counters == [2, 0, 0, 0]
    page.send(Seek(None))
    assert page.last(Decisions).leaders[0].counters == [6, 0, 0, 0]
    page.send(Reset())
    assert page.last(Decisions).leaders[0].counters == [0, 0, 0, 0]


def test_a_counter_without_a_name_has_a_number():
    page = page_of([{"if": {"when": {"counter": "n", "is": 0}, "then": [LEFT]}}], named=False)
    go(page, 0.5)
    assert reason(page)["en"] == "It turns left, because counter 1 was 0 at 0.0 s."
    assert reason(page)["zh"] == "它左转，因为：计数器 1 是 0（第 0.0 秒）。"


def test_a_leader_that_does_not_decide_tells_nothing():
    page = page_of([FORWARD, LEFT])
    go(page, 1.5)
    assert page.take(Decisions) == []


def test_a_page_that_connects_again_is_told():
    page = page_of(branching({"person": {}}))
    go(page, 0.5)
    told = page.last(Decisions)
    page.answers.clear()
    page.answers += page.session.connect()
    assert page.last(Decisions) == told


def test_the_world_stops_when_a_condition_of_the_leader_begins_to_be_met():
    page = page_of([STAND, {"if": {"when": {"person": {}}, "then": [LIGHT]}}], **SOMEBODY_LATER)
    asks = next(index for index, word in enumerate(page.words) if index and word >> 31)
    page.send(StopWhen([StopCondition("condition", words=[asks])]))
    page.send(Play(4))
    page.look(2)
    (stopped,) = page.take(Stopped)
    assert 2000 <= stopped.t_ms <= 2040
    assert stopped.why["en"] == "car 0: somebody was near."
    # It goes on, although the person stays.
    page.send(Play(4))
    page.look(0.5)
    assert page.take(Stopped) == []
