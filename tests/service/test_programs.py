"""What the page asks about programs, over HTTP."""

import base64
import json
import re
from collections import Counter
from string import Formatter

import pytest
from hypothesis import given
from starlette.testclient import TestClient

from motorcade import CONTROL, Followers, Program, compile_program, forward, led, left, read_program, repeat, wait
from motorcade.config.profile import built_in_profile
from motorcade.program.blocks import MOST_IN_A_ROW, blocks_of
from motorcade.program.diagnostics import LANGUAGES
from motorcade.program.steps import pir, together, voice
from motorcade.server.studio.app import make_app
from motorcade.server.studio.settings import Settings
from motorcade.service.documents import Project, opened, project_text
from motorcade.service.errors import MESSAGES
from motorcade.service.gallery import EXAMPLES
from support.strategies import programs

MAT = {"format": "motorcade-mat/1", "name": "a table", "car": [{"at_m": [0, 0], "role": "leader"}]}


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    empty = tmp_path_factory.mktemp("studio")
    app = make_app(Settings(library=empty, page=empty, most_cars=100, requests_a_second=10_000))
    return TestClient(app, base_url="http://127.0.0.1:7700")


@pytest.fixture
def ask(page):
    """Asks and gives the answer's JSON, which must be fine."""

    def asking(path, message=None):
        answer = page.get(path) if message is None else page.post(path, json=message)
        assert answer.status_code == 200, answer.text
        return answer.json()

    return asking


@pytest.fixture
def refused(page):
    """Asks for what can't be and gives the error's status and code; it must be said in every language."""

    def asking(path, message=None, **more):
        answer = page.post(path, json=message, **more) if message is not None or more else page.get(path)
        error = answer.json()["error"]
        assert set(error["message"]) == set(LANGUAGES)
        assert all(error["message"].values())
        # What only a broken page can send is told as the reader of messages puts it.
        assert error["code"] == "bad-message" or not re.search(r"[a-z]{3,} [a-z]{3,}", error["message"]["zh"])
        return answer.status_code, error["code"]

    return asking


def blocks(leader, followers=None):
    """What the page sends for a program."""
    leader, followers = blocks_of(Program(leader, followers))
    return {"leader": leader, "followers": followers, "profile": "classroom"}


def test_compiling_gives_the_image_that_the_command_line_gives(ask):
    program = Program([forward(3), left(1)], Followers([led(1, 2)]))
    answer = ask("/api/compile", blocks(program.leader, program.followers))
    compiled = compile_program(program)
    assert base64.b64decode(answer["image"]) == compiled.image
    assert [int(word["hex"], 16) for word in answer["words"]] == list(compiled.words)
    assert all(len(word["hex"]) == 8 for word in answer["words"])
    assert [word["part"] for word in answer["words"]] == ["header", "leader", "leader", "followers"]
    assert [answer[key] for key in ("dwell_ms", "states", "follower_words", "most")] == [2000, 2, 1, 255]
    assert answer["diagnostics"] == []


def test_the_values_of_a_word_are_its_bits(ask):
    formats = ask("/api/formats")
    for word in ask("/api/compile", blocks([forward(3)], [led(1, 2)]))["words"]:
        fields = formats["header" if word["part"] == "header" else "control"]
        assert sum(word["values"][field["name"]] << field["low"] for field in fields) == int(word["hex"], 16)


def test_a_word_names_the_block_that_it_comes_from_and_a_together_those_of_its_fields(ask):
    at_once = together(forward(2, id="d"), led(1, 1, id="l"), voice(id="v"), pir(id="p"), id="t")
    answer = ask("/api/compile", blocks([wait(4, id="w"), repeat(2, at_once, id="r")]))
    _, first, second, third, fourth, *_ = answer["words"]
    assert (first["block"], second["block"], third["block"]) == ("w", "w", "t")
    assert "fields_of" not in first
    fields = third["fields_of"]
    assert fields == fourth["fields_of"]
    assert Counter(fields.values()) == {"d": 4, "l": 2, "v": 1, "p": 1}
    assert (fields["motor_speed"], fields["led_which"], fields["voice"], fields["pir"]) == ("d", "l", "v", "p")


def test_the_timeline_says_when_each_word_runs(ask):
    program = [forward(3), led(0, 0), left(1)], [led(1, 2), led(2, 2)]
    timeline = ask("/api/compile", blocks(*program))["timeline"]
    spans = {part: [(span["word"], span["begin_ms"], span["end_ms"]) for span in timeline[part]] for part in timeline}
    idle_ms = built_in_profile("classroom").idle_state_ms
    assert spans["leader"] == [(1, 0, 3000), (2, 3000, 3000 + idle_ms), (3, 3000 + idle_ms, 4000 + idle_ms)]
    assert spans["followers"] == [(4, 0, 2000), (5, 2000, 4000)]


def test_the_costliest_block_is_the_one_that_makes_the_most_words(ask):
    answer = ask("/api/compile", blocks([forward(3, id="a"), repeat(9, wait(1), id="b")], [led(0, 3, id="c")]))
    assert answer["costliest"] == {"leader": {"block": "b", "count": 9}, "followers": {"block": "c", "count": 1}}


def test_too_many_states_still_have_a_costliest_block(ask):
    answer = ask("/api/compile", blocks([wait(3, id="a"), repeat(400, wait(1), id="b")]))
    assert (answer["states"], answer["image"], answer["words"]) == (401, None, [])
    assert answer["costliest"]["leader"] == {"block": "b", "count": 400}
    (said,) = answer["diagnostics"]
    assert (said["code"], said["severity"]) == ("too-many-states", "error")
    # The page leads to the block, and nobody there knows a place in a file.
    assert not any("leader[" in sentence for sentence in said["message"].values())
    assert (said["block"], said["editor"]) == ("b", "leader")


def test_a_diagnostic_says_which_editor_and_block_it_is_about(ask):
    said = ask("/api/compile", blocks([], [wait(0.5, id="half")]))["diagnostics"]
    assert [(each["code"], each["editor"], each["block"]) for each in said] == [
        ("empty-program", "leader", None),
        ("duration-not-expressible", "followers", "half"),
    ]
    assert all(set(each["message"]) == set(LANGUAGES) for each in said)


def test_blocks_that_no_program_says_are_diagnostics_too(ask):
    answer = ask("/api/compile", {"leader": {"blocks": {"blocks": [{"type": "motorcade_leader", "next": 3}]}}})
    assert (answer["image"], [each["code"] for each in answer["diagnostics"]]) == (None, ["bad-blocks"])


@pytest.mark.parametrize("count", [MOST_IN_A_ROW, MOST_IN_A_ROW + 1])
def test_the_longest_row_of_blocks_still_gets_its_own_sentence(ask, count):
    below = {"type": "motorcade_wait", "fields": {"SECONDS": 1}}
    for _ in range(count - 1):
        below = {"type": "motorcade_wait", "fields": {"SECONDS": 1}, "next": {"block": below}}
    leader = {"blocks": {"blocks": [{"type": "motorcade_leader", "next": {"block": below}}]}}
    (said,) = ask("/api/compile", {"leader": leader})["diagnostics"]
    assert said["code"] == ("too-many-states" if count == MOST_IN_A_ROW else "too-many-in-a-row")
    assert ask("/api/open", ask("/api/project", {"leader": leader}))["leader"] == leader


@pytest.mark.parametrize(
    ("path", "body", "code"),
    [
        ("/api/compile", b"", "bad-message"),
        ("/api/compile", b"{", "bad-message"),
        ("/api/compile", b"\xff", "bad-message"),
        ("/api/compile", b"[]", "bad-message"),
        ("/api/compile", b"{}", "bad-message"),
        ("/api/compile", b'{"leader": "x"}', "bad-message"),
        ("/api/compile", b'{"leader": {}, "followers": []}', "bad-message"),
        ("/api/compile", b'{"leader": {"\\ud800": 1}}', "bad-message"),
        ("/api/compile", b'{"leader": ' + b'{"a":' * 5000 + b"1" + b"}" * 5001, "too-deep"),
        ("/api/compile", b'{"leader": {}, "profile": "../x.toml"}', "unknown-profile"),
        ("/api/open", b'{"text": 3}', "bad-message"),
        ("/api/open", b'{"text": "{"}', "not-json"),
        ("/api/open", b'{"text": "[]"}', "out-of-range"),
        ("/api/open", b'{"text": "{\\"format\\": \\"motorcade-program/1\\"}"}', "missing-field"),
        ("/api/decompile", b'{"image": "!"}', "bad-message"),
        ("/api/decompile", b'{"image": ""}', "image-cut-off"),
        ("/api/decompile", b'{"image": "AAA="}', "image-cut-off"),
        ("/api/decompile", b'{"image": "AAAAAAAAAAA="}', "image-too-long"),
        ("/api/decompile", b'{"image": "AAAA/w=="}', "image-header"),
        ("/api/decompile", b'{"image": "AQAAAAAAAAE="}', "image-word"),
        ("/api/decompile", b'{"image": "AQAAAIAAAAA="}', "not-decompiled"),
        ("/api/mat", b'{"mat": {}}', "bad-mat"),
        ("/api/mat", b'{"mat": 3}', "bad-message"),
    ],
)
def test_what_makes_no_sense_is_refused_in_a_sentence(refused, path, body, code):
    assert refused(path, content=body)[1] == code


@pytest.mark.parametrize(
    ("path", "message", "status", "code"),
    [
        ("/api/nothing", None, 404, "not-found"),
        ("/nothing", None, 404, "not-found"),
        ("/api/formats", {}, 405, "bad-request"),
        ("/api/profile?name=x", None, 404, "unknown-profile"),
        ("/api/examples/x", None, 404, "no-example"),
    ],
)
def test_an_address_that_is_none(refused, path, message, status, code):
    assert refused(path, message) == (status, code)


def test_a_fault_of_ours_is_a_sentence_and_no_traceback(page, monkeypatch):
    monkeypatch.setattr("motorcade.service.compiling.compile_program", lambda *these: 1 / 0)
    careful = TestClient(page.app, base_url=page.base_url, raise_server_exceptions=False)
    answer = careful.post("/api/compile", json=blocks([]))
    assert (answer.status_code, answer.json()["error"]["code"]) == (500, "internal")
    assert "ZeroDivisionError" not in answer.text


@given(programs())
def test_a_program_is_the_same_after_it_was_a_project_file(program):
    leader, followers = blocks_of(program)
    text = project_text(Project(leader, followers, program.profile, MAT))
    assert read_program(text) == program
    assert opened(text) == Project(leader, followers, program.profile, MAT)


def test_a_project_file_keeps_how_its_blocks_look(ask):
    project = {**blocks([wait(1, id="w")]), "mat": MAT, "range_mm": 700}
    loose = {"type": "motorcade_wait", "id": "loose", "x": 200, "y": 300}
    project["leader"]["blocks"]["blocks"].append(loose)
    text = ask("/api/project", project)["text"]
    assert read_program(text) == Program([wait(1, id="w")])
    assert ask("/api/open", {"text": text}) == project


def test_a_program_that_was_changed_by_hand_is_laid_out_anew(ask):
    text = ask("/api/project", blocks([wait(1, id="w")], []))["text"]
    changed = ask("/api/open", {"text": text.replace('"seconds": 1', '"seconds": 2')})
    assert changed == {**blocks([wait(2, id="w")], []), "mat": None, "range_mm": None}


@pytest.mark.parametrize(
    "view", [{}, {"leader": 3}, {"leader": {"blocks": 3}}, {"leader": {}, "followers": 3}, {"range_mm": "far"}]
)
def test_a_damaged_view_harms_no_program(ask, view):
    document = {**Program([wait(1)]).as_dict(), "view": view}
    opened = ask("/api/open", {"text": json.dumps(document)})
    assert (opened["leader"], opened["range_mm"]) == (blocks([wait(1)])["leader"], None)


def test_blocks_that_no_program_says_yet_are_kept_as_they_are(ask):
    leader = blocks([wait(1)])["leader"]
    leader["blocks"]["blocks"][0]["next"]["block"]["type"] = "motorcade_infrared"
    project = {"leader": leader, "followers": None, "profile": "classroom", "mat": None, "range_mm": None}
    text = ask("/api/project", project)["text"]
    assert read_program(text) == Program([])
    assert ask("/api/open", {"text": text}) == project


def test_an_error_in_a_file_says_where(page):
    answer = page.post("/api/open", json={"text": json.dumps({**Program([]).as_dict(), "leader": [{"fly": {}}]})})
    assert answer.status_code == 400
    assert answer.json()["error"]["message"]["en"].startswith("leader[0].fly: 'fly' can't stand here.")
    assert answer.json()["error"]["diagnostics"][0]["editor"] == "leader"


def test_an_image_becomes_blocks_that_compile_to_it(ask):
    image = base64.b64encode(compile_program(Program([forward(3), left(1)], [led(1, 2)])).image).decode()
    assert ask("/api/compile", ask("/api/decompile", {"image": image}))["image"] == image


def test_a_mat_is_checked(ask, refused):
    assert ask("/api/mat", {"mat": MAT}) == {"cars": 1, "leads": [0]}
    crowd = [{"cars": 100, "corner_m": [0, 0], "size_m": [9, 9]}]
    assert refused("/api/mat", {"mat": {**MAT, "crowd": crowd}}) == (400, "too-many-cars")
    # Not even looked for places.
    assert refused("/api/mat", {"mat": {**MAT, "crowd": [{**crowd[0], "cars": 1e300}]}}) == (400, "too-many-cars")


def test_formats_name_every_bit_in_every_language(ask):
    for fields in ask("/api/formats").values():
        bits = [bit for field in fields for bit in range(field["low"], field["high"] + 1)]
        assert sorted(bits) == list(range(32))
        assert all(field["title"][language] for field in fields for language in LANGUAGES)


def test_a_profile_says_what_its_levels_mean(ask):
    profile = ask("/api/profile?name=classroom")
    assert profile["durations_ms"] == [0, 1000, 2000, 3000]
    assert profile["infrared"]["range_mm"] == 1000
    assert profile["seconds"] == {"least": 0, "step": 1, "most": 765}


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.id)
def test_an_example_compiles_without_a_word_and_its_mat_has_cars_for_it(ask, example):
    project = ask(f"/api/examples/{example.id}")
    answer = ask("/api/compile", {key: project[key] for key in ("leader", "followers", "profile")})
    assert answer["diagnostics"] == []
    cars = ask("/api/mat", {"mat": project["mat"]})
    assert cars["leads"] == [0]
    assert (cars["cars"] > 1) == (project["followers"] is not None)


def test_the_gallery_is_in_every_language(ask):
    listed = ask("/api/examples")
    assert [each["id"] for each in listed] == [example.id for example in EXAMPLES]
    assert all(each[text][language] for each in listed for text in ("title", "about") for language in LANGUAGES)


@pytest.mark.parametrize("code", MESSAGES)
def test_every_error_has_its_sentence_with_the_same_figures_in_every_language(code):
    names = [{name for _, name, _, _ in Formatter().parse(MESSAGES[code][language]) if name} for language in LANGUAGES]
    assert names[0] == names[1]


def test_reserved_bits_and_parity_are_shown_too(ask):
    names = [field["name"] for field in ask("/api/formats")["control"]]
    assert names == [field.name for field in CONTROL.fields]
