"""What a drive minds: the words of what stood beside it, in blocks, Python and files; what it can't mind is said."""

from dataclasses import replace

import pytest

from motorcade import (
    Followers,
    Program,
    avoid,
    chance,
    compile_program,
    dark,
    decompile,
    follow_line,
    forward,
    heard,
    led,
    left,
    obstacle,
    person,
    pir,
    repeat,
    together,
    voice,
    wander,
)
from motorcade.program.blocks import blocks_of
from motorcade.program.model import bare
from motorcade.program.python_reader import read_python
from motorcade.program.python_writer import python_text, updated_text
from motorcade.program.reactions import minding
from motorcade.program.steps import floor
from motorcade.service.documents import open_text, whole_program

# Each drive, and the steps of the same words that older projects have.
SAME = [
    (forward(3, unless=person()), together(forward(3), pir())),
    (follow_line(7, unless=heard() | person()), together(follow_line(7), voice(), pir())),
    (left(4, unless=obstacle(2)), together(left(4), avoid(2, 4))),
    (wander(2, unless=dark()), together(wander(2), floor())),
    (wander(2, unless=dark() | person()), together(wander(2), floor(), pir())),
    (
        together(forward(5, unless=obstacle(0) | person()), led(1, 2)),
        together(forward(5), avoid(0, 5), pir(), led(1, 2)),
    ),
    (forward(unless=person(), until=obstacle(1)), together(forward(), pir(), until=obstacle(1))),
    (forward(9, unless=obstacle(3), until=heard()), together(forward(9), avoid(3, 9), until=heard())),
]


@pytest.mark.parametrize(("drive", "beside"), SAME)
def test_a_drive_has_the_words_of_what_stood_beside_it_and_opens_instead_of_it(drive, beside):
    words = compile_program(Program([drive])).words
    assert words
    assert compile_program(Program([beside])).words == words
    assert minding(Program([beside])) == Program([drive])
    assert bare(whole_program(open_text(Program([beside]).as_json()))) == Program([drive])


def test_what_avoids_for_another_time_stays_beside_its_drive():
    apart = Program([together(forward(3), avoid(1, 2))])
    assert minding(apart) == apart
    assert decompile(compile_program(apart).words).leader == apart.leader


def test_blocks_of_an_older_project_keep_their_places_and_their_followers_mind_too():
    old = Program([repeat(2, together(forward(3), pir()))], Followers([together(forward(2), voice())]))
    leader, followers = blocks_of(old)
    loose = {"type": "motorcade_together", "x": 300, "y": 9}
    leader["blocks"]["blocks"].append({**loose, "icons": {"comment": {"text": "later"}}})
    opened = open_text(replace(old, beside={"view": {"leader": leader, "followers": followers}}).as_json())
    assert bare(whole_program(opened)) == minding(old)
    assert opened.leader["blocks"]["blocks"][1]["icons"] == {"comment": {"text": "later"}}


def test_python_writes_it_as_python_reads_it():
    program = Program([forward(3, unless=person() | heard())], [wander(2, unless=dark())])
    text = python_text(program)
    names = {}
    exec(text, names)
    assert names["program"] == read_python(text).program == program
    changed = Program([forward(3, unless=person() | heard()), left(1, unless=obstacle(2))])
    after = updated_text(text, changed)
    assert read_python(after).program == changed
    assert after.startswith("from motorcade import Program, dark, forward, heard, left, obstacle, person, wander\n")
    assert "unless=person() or chance(50)" in python_text(Program([forward(3, unless=person() | chance(50))]))


@pytest.mark.parametrize(
    ("step", "code", "path"),
    [
        (forward(3, unless=dark()), "unless-dark", "leader[0].drive.unless"),
        (wander(3, unless=dark("both")), "unless-not-minded", "leader[0].drive.unless"),
        (forward(3, unless=heard("go")), "unless-not-minded", "leader[0].drive.unless"),
        (follow_line(3, unless=~person()), "unless-not-minded", "leader[0].follow_line.unless"),
        (forward(3, unless=obstacle(0) | obstacle(2)), "unless-twice", "leader[0].drive.unless"),
        (together(left(1, unless=chance(5)), pir()), "unless-not-minded", "leader[0].together[0].drive.unless"),
        (together(left(1, unless=person()), pir()), "parallel-conflict", "leader[0].together[1]"),
    ],
)
def test_what_a_drive_cannot_mind_is_said_at_its_place(step, code, path):
    compiled = compile_program(Program([step]))
    assert [(problem.code, problem.path) for problem in compiled.diagnostics] == [(code, path)]
    assert not compiled.words


@pytest.mark.parametrize("value", ["3", "True"])
def test_text_that_is_no_condition_is_told_what_is_one(value):
    with pytest.raises(Exception, match="person"):
        read_python(f"from motorcade import *\nprogram = Program([forward(3, unless={value})])")
