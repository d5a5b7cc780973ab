"""A program and its Python text say the same; comments stay; what isn't a program is a sentence at its line."""

import io
import re
import runpy
import tokenize
from collections import Counter
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from motorcade import (
    Followers,
    Program,
    ProgramError,
    compile_program,
    forward,
    led,
    left,
    repeat,
    together,
    voice,
    wait,
)
from motorcade.locales import languages
from motorcade.program.model import align, bare, with_ids_of
from motorcade.program.python_reader import read_python
from motorcade.program.python_writer import python_text, updated_text
from support.strategies import programs

EXAMPLES = Path(__file__).parents[2] / "examples"
HEAD = "from motorcade import *\n"
COMMENTED = '''"""My parade."""
# at the top
from motorcade import Program, forward, left, repeat, show  # what it needs

program = Program(  # the program
    # of the leader
    leader=[  # in order
        # to the door
        forward(3), left(1, speed=1),  # round the table
        repeat(2,  # twice
            forward(1),  # one
            # the last
        ),
        # until here
    ],  # and again
    # nothing more
)  # outside

if __name__ == "__main__":
    show(program)  # shown
'''


def comments_in(text):
    return Counter(
        each.string for each in tokenize.generate_tokens(io.StringIO(text).readline) if each.string[:1] == "#"
    )


def diagnostics_of(text):
    """What there is to say about a text, which can be said in every language."""
    with pytest.raises(ProgramError) as refused:
        read_python(text)
    for each in refused.value.diagnostics:
        for language in languages():
            assert each.sentence(language)
            assert not re.search(r"{\w+}", each.sentence(language))
    return refused.value.diagnostics


def test_the_text_of_a_program():
    program = Program(
        [forward(3), repeat(2, together(left(1, speed=3), voice()), wait(0.4))], Followers([led(0, 1)], forward=True)
    )
    assert python_text(program) == (
        "from motorcade import Followers, Program, forward, led, left, repeat, together, voice, wait\n"
        "\n"
        "program = Program(\n"
        "    leader=[\n"
        "        forward(3),\n"
        "        repeat(2, together(left(1, speed=3), voice()), wait(0.4)),\n"
        "    ],\n"
        "    followers=Followers(\n"
        "        [\n"
        "            led(0, 1),\n"
        "        ],\n"
        "        forward=True,\n"
        "    ),\n"
        ")\n"
    )


@given(programs())
def test_a_program_is_the_same_after_it_was_text(program):
    read = read_python(python_text(program))
    assert read.program == bare(program)
    assert read.diagnostics == ()


@given(programs())
def test_python_itself_reads_the_text_alike(program):
    space = {}
    exec(python_text(program), space)
    assert space["program"] == bare(program)


def test_a_text_may_name_the_blocks_of_its_steps():
    program = Program([wait(1, id="w"), repeat(2, led(0, 1, id="l"), id="r")])
    text = f'{HEAD}program = Program([wait(1, id="w"), repeat(2, led(0, 1, id="l"), id="r")])'
    assert read_python(text).program == program


@st.composite
def commented_texts(draw):
    """Texts of programs with comments at the ends of some lines and in lines of their own."""
    lines = []
    for number, line in enumerate(python_text(draw(programs())).split("\n")):
        where = draw(st.integers(0, 5))
        if where == 0:
            lines.append(f"{' ' * draw(st.integers(0, 3))}# 注 {number}")
        lines.append(f"{line}  # at {number}" if where in (0, 1) else line)
    return "\n".join(lines)


@given(commented_texts(), programs())
@example(COMMENTED, Program([left(1, speed=1)], [forward(3)]))
@example(COMMENTED, Program([]))
def test_an_edit_of_the_blocks_changes_the_program_and_keeps_every_comment(text, program):
    updated = updated_text(text, program)
    assert read_python(updated).program == bare(program)
    assert read_python(updated).diagnostics == ()
    assert comments_in(updated) == comments_in(text)
    # A text that says it already is not touched.
    assert updated_text(updated, program) == updated


def test_comments_stay_with_their_steps():
    program = Program([repeat(3, led(1, 1), forward(1)), left(1, speed=2), forward(3)], [wait(1)])
    assert (
        updated_text(COMMENTED, program)
        == '''"""My parade."""
# at the top
from motorcade import Program, forward, led, left, repeat, show, wait  # what it needs

program = Program(
    # the program
    # of the leader
    leader=[
        repeat(
            3,
            led(1, 1),
            # twice
            forward(1),  # one
            # the last
        ),
        left(1),  # round the table
        # in order
        # to the door
        forward(3),
        # until here
    ],  # and again
    followers=[
        wait(1),
    ],
    # nothing more
)  # outside

if __name__ == "__main__":
    show(program)  # shown
'''
    )


def test_what_a_step_is_called_and_how_its_numbers_are_written_stays():
    text = "from motorcade import Program as P, forward as go, left\n\nprogram = P([go(1_0.0, 0x3), left(1)])\n"
    changed = updated_text(text, Program([forward(10, speed=3), forward(2)]))
    assert "go(1_0.0, 0x3)" in changed
    assert "go(2)" in changed
    assert changed.startswith("from motorcade import Program as P, forward as go, left\n")


def test_what_is_done_with_a_program_is_not_read():
    text = "from motorcade import Program, show, wait\nprogram = Program([wait(1)])\nprogram.save('x')\nshow(program)\n"
    assert read_python(text).program == Program([wait(1)])
    (only,) = diagnostics_of(text + "wait(1)")
    assert (only.code, only.span.line) == ("python-statement", 5)


def test_a_text_without_an_import_gets_one():
    text = '"""A."""\nprogram = Program([forward(1)])\n'
    (warning,) = {each.code for each in read_python(text).diagnostics}
    assert warning == "python-not-imported"
    assert read_python(updated_text(text, Program([left(1)]))).diagnostics == ()


@given(programs(), programs())
def test_steps_that_stay_keep_their_blocks(before, after):
    known = with_ids_of(bare(after), before)
    assert bare(known) == bare(after)
    # No block is used for two steps.
    assert Counter(each.id for each in known.leader if each.id is not None) <= Counter(
        each.id for each in before.leader
    )
    steps = [forward(number + 1, id=str(number)) for number in range(3)]
    assert [each.id for each in with_ids_of(Program([wait(9), *steps[1:]]), Program(steps)).leader] == [None, "1", "2"]
    # Another step has named the block already.
    named = Program([forward(2), wait(9, id="1")])
    assert [each.id for each in with_ids_of(named, Program(steps)).leader] == [None, "1"]


def test_moved_and_changed_steps_are_found_again():
    old = [forward(1), led(0, 1), left(2), wait(1)]
    assert align(old, [wait(1), forward(1), led(0, 2), left(2)]) == [3, 0, 1, 2]
    # The one old LED is the one that moved; the other is a new step.
    assert align([wait(1), led(0, 1)], [led(0, 1), wait(1), led(2, 1)]) == [1, 0, None]
    assert align(old, []) == []
    assert align([], old) == [None] * 4


@pytest.mark.parametrize("file", sorted(EXAMPLES.glob("*.py")), ids=lambda file: file.stem)
def test_an_example_is_read_as_python_reads_it_or_refused_at_a_line(file):
    text = file.read_text(encoding="utf-8")
    if file.stem in ("dance", "drive_words", "first_run", "polite", "project_file", "ripple"):
        assert all(each.span.line > 1 for each in diagnostics_of(text))
    else:
        assert read_python(text).program == runpy.run_path(str(file))["program"]


@pytest.mark.parametrize(
    ("body", "code", "line", "column"),
    [
        ("program = Program([forward(3)", "not-python", 2, 19),
        ("program = Program([forward(3)，left(1)])", "not-python", 2, 30),
        ("program = Program([forward(3)])\n  x", "not-python", 3, 3),
        ("program = Program([forward(3)])\n\0", "not-python", 3, 1),
        (f"program = Program([forward({'9' * 5000})])", "not-python", 2, 1),
        (f"program = Program([forward({'(' * 500}3{')' * 500})])", "not-python", 2, 225),
        (f"x = {'-' * 50_000}1", "not-python", 1, 1),
        (f"x = {'1+' * 50_000}1", "not-python", 1, 1),
        ("", "python-no-leader", 1, 1),
        ("forward(3)", "python-no-leader", 2, 1),
        ("def Leader(): pass", "python-no-leader", 2, 1),
        ("program = forward(3)", "python-no-program", 2, 11),
        ("program = Program([forward(3)])\nprogram = Program([])", "python-second-program", 3, 1),
        ("program = Program(forward(3))", "python-no-list", 2, 19),
        ("program = Program([forward])", "python-not-a-step", 2, 20),
        ("program = Program([Program([])])", "python-not-a-step", 2, 20),
        ("program = Program([forward(1) for n in range(3)])", "python-loop", 2, 19),
        ("program = Program([])\nfor n in range(3):\n  forward(1)", "python-statement", 3, 1),
        ("program = Program([])\nimport os", "python-import", 3, 1),
        ("program = Program([])\ndef f(): pass", "python-statement", 3, 1),
        ("program = Program([])\nspeed = 3", "python-statement", 3, 1),
        ("program = Program([*[forward(1)]])", "python-not-a-step", 2, 20),
        ("program = Program(*[[]])", "python-star", 2, 19),
        ("program = Program([forward(**{})])", "python-star", 2, 30),
        ("program = Program([forward(1, 2, 3)])", "python-too-many-values", 2, 34),
        ("program = Program([forward(1, sped=2)])", "python-no-such-value", 2, 31),
        ("program = Program([forward(1, seconds=2)])", "python-given-twice", 2, 31),
        ("program = Program([forward(open('x').read())])", "python-no-value", 2, 28),
        ("program = Program([forwad(1)])", "python-unknown-name", 2, 20),
        ("program = Program([__import__('os').abort()])", "python-unknown-name", 2, 20),
        ("program = Program([forward(-1)])", "out-of-range", 2, 28),
        ("program = Program([forward()])", "missing-field", 2, 20),
        ("program = Program([wait(1),\n    repeat(0, led(0, 1))])", "out-of-range", 3, 12),
        ("program = Program([together(repeat(2, wait(1)))])", "unknown-field", 2, 29),
        ("program = Program([], Followers([], tagged='maybe'))", "out-of-range", 2, 44),
        ("program = Program([], profile=5)", "out-of-range", 2, 31),
        ("program = Program()", "missing-field", 2, 11),
        (f"program = Program([{'repeat(2, ' * 40}wait(1){')' * 40}])", "blocks-too-deep", 2, 330),
    ],
)
def test_what_is_no_program_is_told_at_its_place(body, code, line, column):
    (only,) = diagnostics_of(HEAD + body)
    assert (only.code, only.span.line, only.span.column) == (code, line, column)
    assert only.as_dict("zh")["line"] == line


@pytest.mark.parametrize(
    "text", [f"if {'-' * 540}1:\n pass", f"if 0x{'9' * 20_000}:\n pass", f"if {'9' * 20_000}:\n pass"], ids=len
)
def test_python_too_deep_or_with_a_number_too_long_gives_a_sentence(text):
    (only,) = diagnostics_of(text)
    assert only.code == "not-python"


def test_columns_count_characters():
    (only,) = diagnostics_of(HEAD + 'program = Program([led(0, 1, id="红灯", colour=1)])')
    assert (only.span.column, only.span.end_column) == (39, 45)


def test_everything_that_is_wrong_is_told_at_once_but_not_without_end():
    found = diagnostics_of(HEAD + "program = Program([])\n" + "x = 1\n" * 100)
    assert [each.span.line for each in found] == list(range(3, 23))
    found = diagnostics_of(HEAD + "program = Program([nix(1), led(0, 1, colour=2), forward(x)])\nimport os")
    assert [each.span.column for each in found if each.span.line == 2] == [20, 38, 57]
    (only,) = diagnostics_of("#" * 300_000)
    assert only.code == "python-too-long"


def test_what_the_compiler_says_stands_at_the_step():
    read = read_python(HEAD + "program = Program([\n    wait(1),\n    together(led(0, 1),\n        forward(0.5))])")
    (only,) = read.located(compile_program(read.program).diagnostics)
    assert only.code == "duration-not-expressible"
    assert only.span[:2] == (5, 9)
    assert only.place() == "line 5, column 9: "


LITTLE = st.text("()[]=,'\"# \n\t\\-.*:0123abegilmoprPt_注\0\ufeff\r", max_size=40)


@given(st.text(max_size=60) | st.binary(max_size=60) | LITTLE.map(lambda text: HEAD + "program = Program(" + text))
def test_any_text_is_a_program_or_has_its_mistakes_named(text):
    with suppress(ProgramError):
        read_python(text)
        return
    diagnostics_of(text)
