"""Missions for the page: requests, goals while a world is played, and the stars of an owner."""

import json
from copy import deepcopy

import pytest

from motorcade import compile_program
from motorcade.errors import MotorcadeError
from motorcade.locales import languages
from motorcade.missions.check import open_worlds_here
from motorcade.missions.document import built_in_mission, missions
from motorcade.program.blocks import blocks_of
from motorcade.server.studio.library import FolderStorage
from motorcade.service.messages import Capabilities, MissionChoice
from motorcade.service.missions import MissionAttempt, check_attempt
from motorcade.service.programs import error_answer
from motorcade.service.requests import Context, respond
from motorcade.service.world_messages import Goals, Move, Play, Reset, Seek, SetEnvironment, SetWorld, State
from support.session_page import SessionPage, server_world

NAME = "forward-and-stop"


@pytest.fixture
def storage(tmp_path):
    return FolderStorage(tmp_path / "library")


@pytest.fixture
def ask(storage):
    context = Context(Capabilities(False, False, False, 100), storage, list)
    return lambda name, message=None: json.loads(respond(name, json.dumps(message or {}).encode(), context))


def attempt(program, **choice):
    leader, followers = blocks_of(program)
    return {"mission": choice, "leader": leader, "followers": followers}


def test_the_list_has_the_stars_that_a_check_has_earned(ask):
    assert [each["id"] for each in ask("missions")] == [each.id for each in missions()]
    assert {star for each in ask("missions") for star in each["earned"]} == set()
    mission = built_in_mission(NAME)
    checked = ask("missions/check", attempt(mission.near_miss, id=NAME))
    assert (checked["stars"], checked["earned"]) == ([], [])
    assert checked["mistake"] == mission.notes.mistakes[0][0].texts
    assert set(checked["goals"][0]["why"]) == set(languages())
    checked = ask("missions/check", attempt(mission.solution, id=NAME))
    assert (checked["stars"], checked["earned"]) == ([1, 2, 3], [1, 2, 3])
    assert (checked["steps"], checked["mistake"]) == (None, None)
    # Stars are kept: a worse try takes none away.
    assert ask("missions/check", attempt(mission.near_miss, id=NAME))["earned"] == [1, 2, 3]
    assert {each["id"]: each["earned"] for each in ask("missions")}[NAME] == [1, 2, 3]
    assert ask("mission", {"id": NAME})["earned"] == [1, 2, 3]


@pytest.mark.parametrize("name", [each.id for each in missions()])
def test_a_mission_has_what_the_page_needs(ask, name):
    opened = ask("mission", {"id": name})
    # No more than a pupil keeps in mind.
    assert 1 <= len(opened["goals"]) <= 5
    assert (opened["followers"] is not None) == any(
        car["role"] == "follower" for car in opened["mat"]["car"]
    ) or opened["mat"]["crowd"]
    # Its document is a mission of one's own, and its file too.
    own = ask("mission", {"document": opened["document"]})
    notes = ask("missions/notes", {"document": opened["document"]})
    assert all(mistake["hint"] in (None, *opened["hints"]) for mistake in notes["mistakes"])
    assert {**notes, "id": name} == ask("missions/notes", {"id": name})
    assert {**own, "id": name, "next": opened["next"]} == opened
    text = ask("missions/save-text", {"document": opened["document"]})
    assert ask("missions/open", text)["document"] == opened["document"]


def test_stars_of_ones_own_mission_are_not_stored(ask, storage):
    document = ask("mission", {"id": NAME})["document"]
    checked = ask("missions/check", attempt(built_in_mission(NAME).solution, document=document))
    assert (checked["stars"], checked["earned"]) == ([1, 2, 3], [])
    assert storage.stars("") == {}


def test_ones_own_missions_are_kept(ask):
    document = ask("mission", {"id": NAME})["document"]
    assert ask("missions/own") == []
    assert [ask("missions/write", {"name": "Mine", "document": document})["version"] for _ in range(2)] == [1, 1]
    assert [(each["name"], each["versions"]) for each in ask("missions/own")] == [("Mine", 1)]
    assert ask("projects/list") == []
    opened = ask("missions/read", {"name": "Mine"})
    assert (opened["id"], opened["document"]) == ("own", document)
    file = ask("projects/export")
    ask("missions/delete", {"name": "Mine"})
    assert ask("missions/own") == []
    # It comes back with all that was exported.
    assert ask("projects/import", {"text": file["text"]})["left_out"] == []
    assert ask("missions/read", {"name": "Mine"})["document"] == document
    assert ask("projects/list") == []


@pytest.mark.parametrize(
    ("name", "message", "code"),
    [
        ("mission", {"id": "none"}, "no-mission"),
        ("missions/read", {"name": "none"}, "no-project"),
        ("missions/delete", {"name": "none"}, "no-project"),
        ("missions/write", {"name": "a/b", "document": built_in_mission(NAME).document}, "bad-project-name"),
        ("missions/write", {"name": "a", "document": {"format": "motorcade-mission/1"}}, "mission-not-valid"),
        ("mission", {"document": {"format": "motorcade-mission/1"}}, "mission-not-valid"),
        ("missions/open", {"text": "name = 3"}, "not-a-mission"),
        ("missions/open", {"text": '{"format": "motorcade-program/1"}'}, "not-a-mission"),
        ("missions/open", {"text": 'format = "motorcade-mission/1"'}, "mission-not-valid"),
        ("missions/check", {"mission": {"id": NAME}, "leader": {"blocks": 3}}, "program-errors"),
    ],
)
def test_what_is_not_valid_is_refused_with_a_sentence(ask, name, message, code):
    with pytest.raises(MotorcadeError) as caught:
        ask(name, message)
    assert caught.value.code == code
    assert all(caught.value.sentence(language) for language in languages())


def _changed(document, *path, to):
    document = deepcopy(document)
    place = document
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = to
    return document


ZONE = {"name": "home", "centre_m": [1, 1], "radius_m": 0.2}


@pytest.mark.parametrize(
    ("path", "to", "english", "chinese"),
    [
        (("zone", 0, "name"), "", "Zone 1 has no name. Give it one.", "第 1 个区域没有名称。请给它取一个名称。"),
        (("zone",), [ZONE, ZONE], "'Name of the zone' of zone 2 is home", "第 2 个区域的“区域名称”"),
        (("goal", 0, "zone"), "none", "'Zone' of goal 1 is", "第 1 个目标的“区域”"),
        (("goal", 0, "star"), 4, "'For which star' of goal 1 is 4", "第 1 个目标的“哪颗星”"),
        (("goal", 0, "share"), 7, "'Which part of them' of goal 1 is 7", "第 1 个目标的“其中多少”"),
        (("seconds",), 0, "'Seconds' is 0", "“秒数”"),
        (
            ("goal", 0),
            {"kind": "all-by", "goal": 9, "seconds": 1},
            "'Goal number' of goal 1 must",
            "第 1 个目标的“目标编号”",
        ),
        (("goal", 0), {"kind": "stopped-by-voice"}, "Goal 1 needs a voice", "第 1 个目标需要"),
        (("mat", "car"), [{"at_m": [0.5, 0.5]}], "No car on the mat leads", "场地上没有头车"),
    ],
)
def test_a_fault_of_a_draft_is_told_in_the_words_of_its_editor(ask, path, to, english, chinese):
    document = _changed(
        {**built_in_mission(NAME).document, "zone": [ZONE], "goal": [{"kind": "in-zone", "zone": "home"}]}, *path, to=to
    )
    with pytest.raises(MotorcadeError) as caught:
        ask("mission", {"document": document})
    said = error_answer(caught.value).sentence
    assert english in said["en"]
    assert chinese in said["zh"]
    assert "[" not in said["en"]


def test_a_forbidden_kind_of_block_earns_no_star(ask):
    mission = built_in_mission(NAME)
    checked = ask("missions/check", attempt(built_in_mission("lights-on").solution, id=NAME))
    assert checked["stars"] == []
    assert checked["steps"]["en"].startswith("the program uses light, steps at once; allowed are")
    assert checked["steps"]["zh"].startswith("程序用了 灯、同时进行；允许的是 ")
    assert len(checked["goals"]) == len(mission.goals)


@pytest.mark.parametrize(
    "content", [b"", b"[1]", b'{"stars": 3}', b'{"stars": {"x": 3, "y": [1, 9, "2"]}}', b"\xff", b"[" * 3000]
)
def test_a_damaged_file_of_stars_counts_as_far_as_it_is_valid(storage, tmp_path, content):
    (tmp_path / "library").mkdir()
    (tmp_path / "library" / "missions.json").write_bytes(content)
    assert {star for stars in storage.stars("").values() for star in stars} <= {1}
    assert storage.add_stars("", "y", [2])[-1] == 2
    assert 2 in storage.stars("")["y"]
    assert storage.stars("somebody else") == {}


def page_of(mission, program):
    """A page that plays a mission."""
    image = compile_program(program, mission.profile).image
    order = SetWorld(mission.mat_document, image, seed=mission.seeds[0], mission=MissionChoice(mission.id))
    return SessionPage(server_world, order)


def progress(page):
    return [goal.progress for goal in page.last(Goals).goals]


@pytest.mark.parametrize("name", [NAME, "find-your-way", "come-together", "red-light", "two-words", "in-rhythm"])
@pytest.mark.parametrize("which", ["solution", "near_miss"])
def test_a_page_that_plays_comes_to_the_result_of_the_check(name, which):
    mission = built_in_mission(name)
    program = getattr(mission, which)
    page = page_of(mission, program)
    page.send(Play(speed=16))
    page.look(mission.duration_ms / 1000 / 16 + 1)
    assert page.last(Goals).is_over
    assert (page.last(State).t_ms, page.last(State).playing) == (mission.duration_ms, False)
    leader, followers = blocks_of(program)
    checked = check_attempt(MissionAttempt(MissionChoice(name), leader, followers), open_worlds_here)
    for now, result in zip(page.last(Goals).goals, checked.goals, strict=True):
        if result.seed == mission.seeds[0]:
            assert now.progress == ("met" if result.met else "lost")
            assert (now.t_ms, now.why) == (result.t_ms, result.why)


def test_goals_tick_while_the_run_goes_on_and_follow_the_shown_time():
    page = page_of(built_in_mission(NAME), built_in_mission(NAME).solution)
    # Nothing is earned before a car drives.
    assert progress(page) == ["open"] * 3
    page.send(Play())
    page.look(2.3)
    assert progress(page) == ["holds"] * 3
    page.send(Seek(500))
    assert progress(page) == ["open", "holds", "open"]
    assert not page.last(Goals).is_over
    page.send(Seek())
    assert progress(page) == ["holds"] * 3
    page.send(Reset(seed=1))
    assert progress(page) == ["open"] * 3


def test_after_the_end_play_begins_a_run_that_is_judged_again():
    mission = built_in_mission(NAME)
    page = page_of(mission, mission.near_miss)
    page.send(Play(speed=16))
    page.look(mission.duration_ms / 16000 + 1)
    lost = progress(page)
    assert (page.last(State).playing, lost[0]) == (False, "lost")
    page.send(Play(speed=16))
    assert (page.last(State).t_ms, progress(page)) == (0, ["open"] * 3)
    page.look(mission.duration_ms / 16000 + 1)
    assert (page.last(State).t_ms, page.last(State).playing) == (mission.duration_ms, False)
    assert progress(page) == lost


def test_goals_see_each_event_once():
    mission = built_in_mission("follow-me")
    page, seen = page_of(mission, mission.solution), []
    page.session.world.referee.see = lambda t_ms, moment, events, touching_ms: seen.append(events)
    page.send(Play())
    page.look(2)
    assert any(seen)
    assert b"".join(page.session.events()).startswith(b"".join(seen))


OWN_MAT = built_in_mission(NAME).mat_document
NEARER = {**OWN_MAT, "car": [{"at_m": [0.9, 0.5], "role": "leader"}]}
NOISY = {**OWN_MAT, "physics": {"bit_error_rate": 0.1}}


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"mat": built_in_mission("follow-me").mat_document}, "the mat and its cars"),
        ({"mat": NEARER}, "the mat and its cars"),
        ({"mat": NOISY}, "the mat and its cars"),
        ({"range_mm": 3000}, "how far infrared reaches"),
    ],
)
def test_a_world_that_differs_from_the_missions_is_refused(change, what):
    image = compile_program(built_in_mission(NAME).solution).image
    page = SessionPage(server_world)
    with pytest.raises(MotorcadeError, match=f"the mission fixes {what}"):
        page.send(SetWorld(**{"mat": OWN_MAT, "image": image, "mission": MissionChoice(NAME), **change}))


@pytest.mark.parametrize(
    ("change", "what"),
    [
        (SetEnvironment(OWN_MAT, range_mm=3000), "how far infrared reaches"),
        (SetEnvironment(OWN_MAT | {"wall": [{"from_m": [1, 0], "to_m": [1, 1]}]}), "the mat and its cars"),
        (Move(0, 0.9, 0.5), "the mat and its cars"),
    ],
)
def test_what_a_mission_fixes_cannot_be_changed_while_it_is_played(change, what):
    page = page_of(built_in_mission(NAME), built_in_mission(NAME).solution)
    with pytest.raises(MotorcadeError, match=f"the mission fixes {what}"):
        page.send(change)
    # The floor is only a picture.
    page.send(SetEnvironment(OWN_MAT | {"floor": "moon"}))
