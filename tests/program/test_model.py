"""A program, its project file, and what is said about a file that is none."""

import dataclasses
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from motorcade import (
    Followers,
    MotorcadeError,
    Program,
    ProgramError,
    compile_program,
    forward,
    led,
    left,
    load_profile,
    pir,
    read_program,
    repeat,
    right,
    together,
    voice,
    wait,
)
from motorcade.locales import languages
from motorcade.program.steps import DriveStep
from support.strategies import CLASSROOM, JSON, damaged_documents, programs

EXAMPLE = """
{"format": "motorcade-program/1",
 "profile": "classroom",
 "leader": [
   {"drive": {"direction": "forward", "speed": 2, "seconds": 3}},
   {"drive": {"direction": "left", "speed": 1, "seconds": 1}},
   {"together": [{"drive": {"direction": "forward", "speed": 3, "seconds": 2}}, {"led": {"which": 1, "seconds": 1}}]},
   {"repeat": {"times": 2, "steps": [{"wait": {"seconds": 1}}, {"led": {"which": 0, "seconds": 1}}]}}],
 "followers": {"accept_ir": true, "forward": false,
   "steps": [{"drive": {"direction": "right", "speed": 2, "seconds": 2}}]}}
"""
TOWN = Path(__file__).parents[2] / "src" / "motorcade" / "service" / "gallery" / "town.motorcade.json"
IN_PYTHON = Program(
    [forward(3), left(1, speed=1), together(forward(2, speed=3), led(1, 1)), repeat(2, wait(1), led(0, 1))],
    Followers([right(2)]),
)


def test_the_example_of_the_protocol_reads() -> None:
    assert read_program(EXAMPLE) == IN_PYTHON
    assert read_program(EXAMPLE.encode()) == IN_PYTHON
    assert read_program(b"\xef\xbb\xbf" + EXAMPLE.encode()) == IN_PYTHON


def test_the_example_of_the_protocol_compiles_to_words_worked_out_by_hand() -> None:
    #            accept, forward, motor: enable direction speed duration, led: which duration, avoid ..., parity
    wait_1_s = 0b0_1_1_00_00_01_00_00_0_00_00_0_0_00000000000_0
    led_0_for_1_s = 0b0_1_0_00_00_00_00_01_0_00_00_0_0_00000000000_0
    assert compile_program(read_program(EXAMPLE)).words == (
        0b00000111_00000001_00000010_00000000,  # 7 states, 1 word, each sent for 2 s: level 1
        0b0_1_1_00_10_11_00_00_0_00_00_0_0_00000000000_0,
        0b0_1_1_01_01_01_00_00_0_00_00_0_0_00000000000_0,
        0b0_1_1_00_11_10_01_01_0_00_00_0_0_00000000000_0,
        *(wait_1_s, led_0_for_1_s, wait_1_s, led_0_for_1_s),
        0b1_0_1_10_10_10_00_00_0_00_00_0_0_00000000000_0,
    )


@given(programs())
def test_a_program_survives_its_project_file(program: Program) -> None:
    assert read_program(program.as_json()) == program
    assert read_program(program.as_json().encode()) == program


def test_a_program_is_saved_as_utf_8(tmp_path: Any) -> None:
    file = tmp_path / "舞.motorcade.json"
    program = Program([led(0, 1, id="积木")])
    program.save(file)
    assert "积木" in file.read_text(encoding="utf-8")
    assert read_program(file.read_bytes()) == program


UNKNOWN, MISSING, RANGE = "unknown-field", "missing-field", "out-of-range"
FOLLOWERS = '{"format": "motorcade-program/1", "leader": [], "followers": {"steps": [], %s}}'


def assert_is_said(document: str, code: str, path: str, step_id: str | None) -> None:
    with pytest.raises(ProgramError) as caught:
        read_program(document)
    assert (code, path, step_id) in [(each.code, each.path, each.id) for each in caught.value.diagnostics]


@pytest.mark.parametrize(
    ("document", "code", "path"),
    [
        ("7", RANGE, ""),
        ('{"leader": []}', MISSING, ""),
        ('{"format": "motorcade-program/1"}', MISSING, ""),
        ('{"format": "motorcade-program/2", "leader": []}', RANGE, "format"),
        ('{"format": "motorcade-program/1", "leader": [5]}', RANGE, "leader[0]"),
        ('{"format": "motorcade-program/1", "leader": [{}]}', MISSING, "leader[0]"),
        ('{"format": "motorcade-program/1", "leader": [], "colour": 1}', UNKNOWN, "colour"),
        ('{"format": "motorcade-program/1", "leader": [], "followers": {}}', MISSING, "followers"),
        ('{"format": "motorcade-program/1", "leader": [], "view": []}', RANGE, "view"),
        (FOLLOWERS % '"accept_ir": "yes"', RANGE, "followers.accept_ir"),
        (FOLLOWERS % '"dwell_seconds": -1', RANGE, "followers.dwell_seconds"),
        (FOLLOWERS % '"tagged": "maybe"', RANGE, "followers.tagged"),
        (FOLLOWERS % '"speed": 1', UNKNOWN, "followers.speed"),
    ],
)
def test_a_wrong_document_is_named_with_its_place(document: str, code: str, path: str) -> None:
    assert_is_said(document, code, path, None)


@pytest.mark.parametrize(
    ("content", "code", "place", "step_id"),
    [
        ('"id": "b"', MISSING, "", "b"),
        ('"id": "b", "fly": {}', UNKNOWN, ".fly", "b"),
        ('"id": "b", "wait": {"seconds": 1}, "pir": {"seconds": 1}', "several-kinds", "", "b"),
        ('"id": 5, "wait": {"seconds": 1}', RANGE, ".id", None),
        ('"id": "b", "wait": {}', MISSING, ".wait", "b"),
        ('"id": "b", "wait": {"seconds": -1}', RANGE, ".wait.seconds", "b"),
        ('"id": "b", "wait": {"seconds": 1, "speed": 1}', UNKNOWN, ".wait.speed", "b"),
        ('"id": "b", "together": [{"id": "c", "repeat": {"times": 1}}]', UNKNOWN, ".together[0].repeat", "c"),
        ('"together": [{"id": "c", "voice": {"seconds": 1}}]', UNKNOWN, ".together[0].voice.seconds", "c"),
        ('"id": "b", "repeat": {"times": 1.5, "steps": []}', RANGE, ".repeat.times", "b"),
        ('"repeat": {"times": 1, "steps": [{"id": "c", "led": {}}]}', MISSING, ".repeat.steps[0].led", "c"),
    ],
)
def test_a_wrong_step_is_named_with_its_place_and_id(content: str, code: str, place: str, step_id: str | None) -> None:
    wait_1_s, step = '{"wait": {"seconds": 1}}', f"{{{content}}}"
    leads = f'{{"format": "motorcade-program/1", "leader": [{wait_1_s}, {step}]}}'
    assert_is_said(leads, code, f"leader[1]{place}", step_id)
    follows = f'{{"format": "motorcade-program/1", "leader": [], "followers": {{"steps": [{step}]}}}}'
    assert_is_said(follows, code, f"followers.steps[0]{place}", step_id)


def test_what_stands_beside_a_program_is_not_looked_into() -> None:
    row: dict[str, Any] = {}
    for _ in range(400):
        row = {"next": {"block": row}}
    program = Program([wait(1)])
    document = {**program.as_dict(), "mat": {"anything": [1, {"forward": 2}]}, "view": {"leader": row}}
    assert read_program(json.dumps(document)) == program


def test_a_project_that_is_read_and_saved_keeps_its_mat_and_the_places_of_its_blocks(tmp_path: Path) -> None:
    project = json.loads(TOWN.read_text(encoding="utf-8"))
    read_program(TOWN.read_bytes()).save(tmp_path / "again.motorcade.json")
    assert json.loads((tmp_path / "again.motorcade.json").read_text(encoding="utf-8")) == project
    longer = read_program(json.dumps(project))
    dataclasses.replace(longer, leader=(*longer.leader, wait(1))).save(tmp_path / "longer.motorcade.json")
    saved = json.loads((tmp_path / "longer.motorcade.json").read_text(encoding="utf-8"))
    assert (saved["mat"], len(saved["leader"])) == (project["mat"], len(project["leader"]) + 1)


@pytest.mark.parametrize("old", ["motorcade-program", "leader", "wait", "an id"])
def test_half_a_character_which_no_file_can_hold_is_refused(old: str) -> None:
    document = '{"format": "motorcade-program/1", "leader": [{"id": "an id", "wait": {"seconds": 1}}]}'
    with pytest.raises(ProgramError):
        read_program(document.replace(old, r"\ud800"))


def test_a_leader_has_no_forward_to_set_and_all_that_is_wrong_is_said_at_once() -> None:
    document = '{"format": "motorcade-program/1", "leader": [{"id": "b", "wait": {"seconds": -1}, "forward": true}]}'
    assert_is_said(document, UNKNOWN, "leader[0].forward", "b")
    assert_is_said(document, RANGE, "leader[0].wait.seconds", "b")


@given(damaged_documents())
def test_a_damaged_document_is_a_program_or_has_its_faults_named(document: object) -> None:
    try:
        said = compile_program(read_program(json.dumps(document)), CLASSROOM).diagnostics
    except ProgramError as error:
        said = error.diagnostics
    for diagnostic in said:
        assert all(diagnostic.sentence(language) for language in languages())


@given(JSON)
def test_any_other_json_has_its_faults_named(document: object) -> None:
    with pytest.raises(ProgramError):
        read_program(json.dumps(document))


@given(st.binary(max_size=50) | st.text(max_size=50))
@example("[" * 100_000)
@example("[" * 200 + "]" * 200)
def test_any_bytes_are_a_program_or_have_their_faults_named(data: bytes | str) -> None:
    with pytest.raises(ProgramError):
        read_program(data)


NAN = float("nan")


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: forward(-1), "seconds is -1"),
        (lambda: forward(NAN), "seconds is nan"),
        (lambda: left(1, speed=4), "speed is 4; allowed: a whole number from 0 to 3"),
        (lambda: DriveStep("up", 1, 1), "direction is 'up'"),
        (lambda: repeat(1.5, wait(1)), "times is 1.5"),
        (lambda: together(together()), "together"),
        (lambda: together(voice(1)), "voice"),
        (lambda: together(forward(1), pir(seconds=1)), "pir"),
        (lambda: together(forward(1, accept_ir=False)), "accept_ir"),
        (lambda: Followers([wait(1)], forward=None), "forward is None; allowed: true or false"),
        (lambda: Followers([wait(1)], dwell_seconds=NAN), "dwell_seconds"),
    ],
)
def test_python_refuses_a_wrong_value_with_a_sentence(make: Callable[[], object], said: str) -> None:
    with pytest.raises(ValueError, match=re.escape(said)):
        make()


@pytest.mark.parametrize("make", [lambda each: Program([each]), together, lambda each: repeat(2, each), Followers])
def test_python_refuses_what_is_no_step(make: Callable[[object], object]) -> None:
    with pytest.raises((TypeError, ValueError), match="step 1 is 'wait'"):
        make("wait" if make is not Followers else ["wait"])


@pytest.mark.parametrize("make", [Program, Followers, lambda each: Program([forward(1)], each)])
@pytest.mark.parametrize("steps", [forward(1), 3, print])
def test_python_says_that_steps_come_in_a_list(make: Callable[[object], object], steps: object) -> None:
    with pytest.raises(TypeError, match="put steps into a list"):
        make(steps)


@pytest.mark.parametrize(
    ("give", "said"),
    [
        (lambda: compile_program([forward(1)]), "program is [DriveStep"),  # type: ignore[arg-type]
        (lambda: compile_program(Program([forward(1)]), "classroom"), "profile is 'classroom'; allowed: Profile"),  # type: ignore[arg-type]
        (lambda: read_program(Path("parade.json")), "allowed: bytes, str"),  # type: ignore[arg-type]
        (lambda: load_profile(Path("mine.toml")), "allowed: str"),  # type: ignore[arg-type]
    ],
)
def test_python_names_an_argument_of_another_kind(give: Callable[[], object], said: str) -> None:
    with pytest.raises(MotorcadeError, match=re.escape(said)):
        give()
