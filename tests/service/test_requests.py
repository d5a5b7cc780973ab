"""Requests of the page, without a server."""

import base64
import json
import re
from collections import Counter

import numpy as np
import pytest
from hypothesis import given

from motorcade import Followers, Program, compile_program, forward, led, left, read_program, repeat, wait
from motorcade.errors import MotorcadeError
from motorcade.locales import languages
from motorcade.program.blocks import MOST_IN_A_ROW, blocks_of
from motorcade.program.diagnostics import ProgramError
from motorcade.program.reactions import minding
from motorcade.program.steps import pir, together, voice
from motorcade.server.studio.library import FolderStorage
from motorcade.service.documents import EXAMPLES, open_file, open_text, project_text
from motorcade.service.messages import Capabilities, Project
from motorcade.service.programs import error_answer
from motorcade.service.requests import Context, respond
from motorcade.service.studio_world import mat_from
from support.strategies import programs
from support.studio_programs import blocks

# What a project has beside its blocks where its user chose nothing.
NO_VIEW = {"range_mm": None, "python": None, "level": None, "car": None}
MAT = {"format": "motorcade-mat/1", "name": "a table", "car": [{"at_m": [0, 0], "role": "leader"}]}


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "library"


@pytest.fixture
def context(folder):
    return Context(Capabilities(False, False, False, 100), FolderStorage(folder), list)


@pytest.fixture
def ask(context):
    """Send a request that must be answered; give the answer."""
    return lambda name, message=None: json.loads(respond(name, json.dumps(message or {}).encode(), context))


@pytest.fixture
def refused(context):
    """Send a request, as JSON or bytes, that must be refused in every language; give its HTTP status and its code."""

    def asking(name, message):
        with pytest.raises(MotorcadeError) as refusal:
            respond(name, message if isinstance(message, bytes) else json.dumps(message).encode(), context)
        error = error_answer(refusal.value)
        assert set(error.sentence) == set(languages())
        assert all(error.sentence.values())
        # A message that only a broken page can send is explained in the words of msgspec.
        assert error.code == "bad-message" or not re.search(r"[a-z]{3,} [a-z]{3,}", error.sentence["zh"])
        return refusal.value.http_status, error.code

    return asking


def test_the_image_is_that_of_the_command_line(ask):
    program = Program([forward(3), left(1)], Followers([led(1, 2)]))
    answer = ask("compile", blocks(program.leader, program.followers))
    compiled = compile_program(program)
    assert base64.b64decode(answer["image"]) == compiled.image
    assert [int(word["hex"], 16) for word in answer["words"]] == list(compiled.words)
    assert all(len(word["hex"]) == 8 for word in answer["words"])
    assert [word["part"] for word in answer["words"]] == ["header", "leader", "leader", "followers"]
    assert [answer[key] for key in ("dwell_ms", "states", "follower_words", "most")] == [2000, 2, 1, 255]
    assert answer["tagged"] is False
    assert answer["diagnostics"] == []


def test_a_word_has_its_block_and_a_together_the_blocks_of_its_fields(ask):
    at_once = together(forward(2, id="d"), led(1, 1, id="l"), voice(id="v"), pir(id="p"), id="t")
    answer = ask("compile", blocks([wait(4, id="w"), repeat(2, at_once, id="r")]))
    _, first, second, third, fourth, *_ = answer["words"]
    assert (first["block"], second["block"], third["block"]) == ("w", "w", "t")
    assert "fields_of" not in first
    fields = third["fields_of"]
    assert fields == fourth["fields_of"]
    assert Counter(fields.values()) == {"d": 4, "l": 2, "v": 1, "p": 1}
    assert (fields["motor_speed"], fields["led_which"], fields["voice"], fields["pir"]) == ("d", "l", "v", "p")


def test_the_costliest_block_is_the_one_that_makes_the_most_words(ask):
    answer = ask("compile", blocks([forward(3, id="a"), repeat(9, wait(1), id="b")], [led(0, 3, id="c")]))
    assert answer["costliest"] == {"leader": {"block": "b", "count": 9}, "followers": {"block": "c", "count": 1}}


@pytest.mark.parametrize("count", [MOST_IN_A_ROW, MOST_IN_A_ROW + 1])
def test_a_row_of_blocks_that_is_too_long_has_its_own_error(ask, count):
    below = {"type": "motorcade_wait", "fields": {"SECONDS": 1}}
    for _ in range(count - 1):
        below = {"type": "motorcade_wait", "fields": {"SECONDS": 1}, "next": {"block": below}}
    leader = {"blocks": {"blocks": [{"type": "motorcade_leader", "next": {"block": below}}]}}
    (diagnostic,) = ask("compile", {"leader": leader})["diagnostics"]
    assert diagnostic["code"] == ("too-many-states" if count == MOST_IN_A_ROW else "too-many-in-a-row")
    assert ask("open", ask("save-text", {"leader": leader}))["leader"] == leader


@pytest.mark.parametrize(
    ("name", "body", "code"),
    [
        ("compile", b"", "bad-message"),
        ("compile", b"{", "bad-message"),
        ("compile", b"\xff", "bad-message"),
        ("compile", b'{"leader": {}, "followers": []}', "bad-message"),
        ("compile", b'{"leader": {"\\ud800": 1}}', "bad-message"),
        ("compile", b'{"leader": ' + b'{"a":' * 5000 + b"1" + b"}" * 5001, "message-too-deep"),
        ("open", b'{"text": "{\\"format\\": \\"motorcade-program/1\\"}"}', "missing-field"),
        ("decompile", b'{"image": "!"}', "bad-message"),
        ("decompile", b'{"image": "AAA="}', "image-cut-off"),
        ("decompile", b'{"image": "AAAAAAAAAAA="}', "image-too-long"),
        ("decompile", b'{"image": "AAAA/w=="}', "image-header"),
        ("decompile", b'{"image": "AQAAAAAAAAE="}', "image-word"),
        ("decompile", b'{"image": "AQAAAIAAAAA="}', "not-decompiled"),
    ],
)
def test_an_invalid_message_is_refused_in_every_language(refused, name, body, code):
    assert refused(name, body)[1] == code


@pytest.mark.parametrize(
    ("name", "message", "code"),
    [
        ("nothing", {}, "not-found"),
        ("../compile", {}, "not-found"),
        ("example", {"name": "x"}, "no-example"),
        ("example", {"name": "../square"}, "no-example"),
        ("compile", {"leader": {}, "profile": "../x.toml"}, "no-such-profile"),
        ("projects/read", {"name": "a", "version": 7}, "no-project"),
    ],
)
def test_an_unknown_name_is_refused(refused, name, message, code):
    assert refused(name, message) == (404, code)


@given(programs())
def test_a_program_is_unchanged_after_saving_and_opening(program):
    program = minding(program)
    leader, followers = blocks_of(program)
    text = project_text(Project(leader, followers, program.profile, MAT))
    assert read_program(text) == program
    assert open_text(text) == Project(leader, followers, program.profile, MAT)


def test_a_project_file_stores_the_layout_of_its_blocks(ask):
    own = {"mat": MAT, "range_mm": 700, "python": "# mine\n", "level": "python", "car": None}
    project = {**blocks([wait(1, id="w")]), **own}
    loose = {"type": "motorcade_wait", "id": "loose", "x": 200, "y": 300}
    project["leader"]["blocks"]["blocks"].append(loose)
    text = ask("save-text", project)["text"]
    assert read_program(text) == Program([wait(1, id="w")])
    assert ask("open", {"text": text}) == project


def test_a_program_changed_in_its_file_gets_a_new_layout(ask):
    text = ask("save-text", blocks([wait(1, id="w")], []))["text"]
    changed = ask("open", {"text": text.replace('"seconds": 1', '"seconds": 2')})
    assert changed == {**blocks([wait(2, id="w")], []), "mat": None, **NO_VIEW}


@pytest.mark.parametrize(
    "view",
    [
        {},
        {"leader": 3},
        {"leader": {"blocks": 3}},
        {"leader": {}, "followers": 3},
        {"range_mm": "far", "python": 3, "level": "top", "car": {"speeds_mm_s": [0]}},
    ],
)
def test_an_invalid_view_is_ignored(ask, view):
    document = {**Program([wait(1)]).as_dict(), "view": view}
    opened = ask("open", {"text": json.dumps(document)})
    assert opened == {**blocks([wait(1)]), "mat": None, **NO_VIEW}


def test_blocks_that_are_no_program_yet_are_stored(ask):
    leader = blocks([wait(1)])["leader"]
    leader["blocks"]["blocks"][0]["next"]["block"]["type"] = "motorcade_infrared"
    project = {"leader": leader, "followers": None, "profile": "classroom", "mat": None, **NO_VIEW}
    text = ask("save-text", project)["text"]
    assert read_program(text) == Program([])
    assert ask("open", {"text": text}) == project


def test_an_error_in_a_file_has_its_place(context):
    fast = {"repeat": {"times": 2, "steps": [{"drive": {"direction": "left", "speed": 9, "seconds": 1}}]}}
    text = json.dumps({**Program([]).as_dict(), "leader": [{"fly": {}}, fast]})
    with pytest.raises(ProgramError) as problem:
        respond("open", json.dumps({"text": text}).encode(), context)
    error = error_answer(problem.value)
    first, second = error.sentence["en"].splitlines()
    assert first.startswith("Leader, step 1: 'fly' can't stand here.")
    assert second.startswith("Leader, step 2.1, speed: The value is 9; allowed:")
    assert error.sentence["zh"].splitlines()[1].startswith("头车第 2.1 步的速度：")
    assert error.diagnostics[0].editor == "leader"


def test_an_image_becomes_blocks_that_compile_to_it(ask):
    image = base64.b64encode(compile_program(Program([forward(3), left(1)], [led(1, 2)])).image).decode()
    assert ask("compile", ask("decompile", {"image": image}))["image"] == image


def test_a_profile_has_the_values_of_its_levels(ask):
    profile = next(each for each in ask("profiles") if each["name"] == "classroom")
    assert profile["title"] == {"en": "Classroom car", "zh": "教室小车"}
    assert profile["durations_ms"] == [0, 1000, 2000, 3000]
    assert profile["infrared"]["range_mm"] == 1000
    assert profile["seconds"] == {"least": 0, "step": 1, "most": 765}


@pytest.mark.parametrize("example", EXAMPLES, ids=str)
def test_an_example_compiles_without_diagnostics_and_its_mat_has_the_cars_for_it(ask, example):
    project = ask("example", {"name": example})
    answer = ask("compile", {key: project[key] for key in ("leader", "followers", "profile")})
    assert answer["diagnostics"] == []
    leads = mat_from(project["mat"], most_cars=100).starts.leads
    assert np.flatnonzero(leads).tolist() == [0]
    assert (len(leads) > 1) == (project["followers"] is not None)


def test_each_block_that_a_first_visit_finds_has_an_id(ask):
    """So the page has its words before Python runs."""
    found = ask("opening")
    words = ask("compile", {key: found[key] for key in ("leader", "followers", "profile")})["words"]
    assert all(word["block"] and all(word.get("fields_of", {}).values()) for word in words[1:])


def test_the_gallery_is_in_every_language(ask):
    listed = ask("examples")
    assert [each["id"] for each in listed] == list(EXAMPLES)
    assert all(each[text][language] for each in listed for text in ("title", "about") for language in languages())


# The projects of the library.


def project(seconds):
    return {**blocks([wait(seconds, id="w")], [led(1, 1)]), "mat": MAT, **NO_VIEW, "range_mm": 700}


@pytest.fixture
def save(ask):
    return lambda name, project: ask("projects/write", {"name": name, "project": project})["version"]


def test_a_saved_project_comes_back_unchanged(ask, save):
    name = "我的程序"
    assert [save(name, project(1)), save(name, project(2))] == [1, 2]
    assert ask("projects/read", {"name": name}) == {"name": name, "version": 2, **project(2)}
    assert ask("projects/read", {"name": name, "version": 1}) == {"name": name, "version": 1, **project(1)}
    listed = ask("projects/list")
    assert [(each["name"], each["versions"]) for each in listed] == [(name, 2)]
    versions = ask("projects/history", {"name": name})
    assert [each["version"] for each in versions] == [2, 1]
    assert versions[0]["saved_at"] == listed[0]["saved_at"]
    assert ask("projects/place") == {"stays": True, "problems": []}


def test_a_damaged_version_is_refused_and_the_others_can_be_read(ask, refused, save, folder):
    save("a", project(1))
    save("a", project(2))
    save("b", project(3))
    next(folder.glob("a-*/000002*")).write_bytes(b'{"format": \xff')
    assert refused("projects/read", {"name": "a"}) == (409, "damaged-version")
    assert ask("projects/read", {"name": "a", "version": 1}) == {"name": "a", "version": 1, **project(1)}
    assert sorted(each["name"] for each in ask("projects/list")) == ["a", "b"]
    assert save("a", project(4)) == 3
    assert ask("projects/read", {"name": "a"}) == {"name": "a", "version": 3, **project(4)}


def test_a_project_saved_in_another_window_meanwhile_is_not_replaced(ask, refused):
    def written(base, number):
        return {"name": "a", "project": project(number), "base": base}

    assert ask("projects/write", written(0, 1)) == {"version": 1, "stays": True}
    assert ask("projects/write", written(1, 2))["version"] == 2
    assert refused("projects/write", written(1, 3)) == (409, "saved-elsewhere")
    assert refused("projects/write", written(0, 3)) == (409, "project-exists")
    assert refused("projects/write", written(-1, 3)) == (400, "bad-message")
    assert ask("projects/read", {"name": "a"}) == {"name": "a", "version": 2, **project(2)}


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "not-a-project"),
        ("import os\n", "not-a-project"),
        ("[" * 100_000, "not-a-project"),
        ("42", "not-a-project"),
        ('{"format": ["motorcade-program/1"]}', "not-a-project"),
        ('{"format": "motorcade-program/1", "leader": [', "project-not-whole"),
        ('{"format": "motorcade-program/2", "boats": []}', "newer-project"),
        ('{"format": "motorcade-mat/1"}', "mat-not-project"),
        ('{"format": "motorcade-mission/1"}', "mission-not-project"),
        ('{"format": "motorcade-projects/1"}', "projects-not-project"),
        ('{"format": "motorcade-program/1"}', "program-errors"),
        ("from motorcade import *\nforward(1)", "program-errors"),
    ],
)
def test_a_file_that_is_no_project_is_told_what_it_is(text: str, code: str) -> None:
    with pytest.raises(MotorcadeError) as refused:
        open_file(text)
    assert refused.value.code == code


def test_python_text_is_opened_with_its_comments(ask) -> None:
    text = "from motorcade import *\n\n\ndef leader():\n    forward(2)  # out of the garage\n"
    opened = ask("open", {"text": text})
    assert opened["python"] == text
    assert ask("compile", opened)["words"] == ask("compile", blocks([forward(2)]))["words"]


@pytest.mark.parametrize(
    "text",
    [
        json.dumps(MAT),
        json.dumps({**Program([forward(3)]).as_dict(), "mat": MAT}),
        'format = "motorcade-mat/1"\nname = "a table"\ncar = [{at_m = [0, 0], role = "leader"}]\n',
    ],
)
def test_a_mat_is_opened_from_its_own_file_or_a_projects(ask, text) -> None:
    assert ask("mats/open", {"text": text, "name": "table"}) == MAT


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("size_m = 3", "missing-key"),
        ('{"format": "motorcade-mat/1"', "file-syntax"),
        (json.dumps({**MAT, "car": [{"at_m": [0]}]}), "not-allowed"),
        (json.dumps(Program([forward(3)]).as_dict()), "project-without-mat"),
    ],
)
def test_a_file_without_a_mat_is_told_what_is_wrong(refused, text, code) -> None:
    assert refused("mats/open", {"text": text, "name": "table"})[1] == code
