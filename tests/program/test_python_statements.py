"""A program written as functions: read both ways, with its comments, and never executed."""

import io
import random
import time
import tokenize
from collections import Counter
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motorcade import Followers, Program, ProgramError, compile_program, follow_line, forward, led, left, right, wait
from motorcade.locales import languages
from motorcade.program.conditions import counter, dark, heard, obstacle, person
from motorcade.program.flow_steps import change_counter, do, forever, if_, repeat_until, set_counter, tell
from motorcade.program.flow_steps import random as any_number
from motorcade.program.model import bare
from motorcade.program.python_reader import read_python
from motorcade.program.python_writer import python_text, updated_text
from motorcade.program.steps import repeat, together
from support.command_line import run
from support.drawn_leaders import DrawnLeader

HEAD = "from motorcade import *\n"
ISSUE = """from motorcade import *

laps = 0

def dance():
    left(1)
    right(1)

def leader():
    while laps < 3:
        follow_line(until=dark("both"))
        laps += 1
        tell(together(led(1, 2), wait(2)))
    if obstacle(1) or not person():
        dance()
    else:
        for _ in range(4):
            forward(1, until=heard("stop"))

def followers():
    forward(4)
"""
PROGRAM = Program(
    [
        repeat_until(
            ~counter("laps", "below", 3),
            follow_line(until=dark("both")),
            change_counter("laps", 1),
            tell(together(led(1, 2), wait(2))),
        ),
        if_(obstacle(1) | ~person(), [do("dance")], [repeat(4, forward(1, until=heard("stop")))]),
    ],
    [forward(4)],
    functions={"dance": [left(1), right(1)]},
)


def comments_in(text):
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    return Counter(token.string for token in tokens if token.type == tokenize.COMMENT)


def leader_of(body):
    return read_python(f"{HEAD}{body}").program.leader


def test_the_text_of_the_issue_is_read_and_written():
    assert read_python(ISSUE).program == PROGRAM
    assert read_python(python_text(PROGRAM)).program == PROGRAM
    assert read_python(ISSUE).diagnostics == ()


@settings(max_examples=5 * settings().max_examples)
@given(st.integers(0, 1 << 40))
def test_any_leader_that_decides_survives_its_text_and_python_takes_it(seed):
    program = DrawnLeader(seed).program
    text = python_text(program)
    read = read_python(text)
    assert read.diagnostics == ()
    assert compile_program(read.program).words == compile_program(program).words
    exec(compile(text, "text", "exec"), {})


@settings(max_examples=2 * settings().max_examples)
@given(st.integers(0, 1 << 40))
def test_an_edit_keeps_every_comment(seed):
    draws = random.Random(seed)
    lines = []
    for number, line in enumerate(python_text(DrawnLeader(seed).program).split("\n")):
        if draws.random() < 0.2:
            lines.append(f"{' ' * draws.randrange(4)}# 注 {number}")
        lines.append(f"{line}  # at {number}" if line and draws.random() < 0.2 else line)
    text = "\n".join(lines)
    read = read_python(text).program
    for program in (DrawnLeader(seed + 1).program, replace(read, leader=(*read.leader, wait(1)))):
        updated = updated_text(text, program)
        assert compile_program(read_python(updated).program).words == compile_program(program).words
        assert comments_in(updated) == comments_in(text)
    assert updated_text(text, read) == text


def test_a_function_that_stays_keeps_its_text():
    text = f"{ISSUE}# the end\n".replace("left(1)", "left(1_0 - 9)  # slowly")
    changed = replace(PROGRAM, leader=(wait(1), *PROGRAM.leader))
    updated = updated_text(text, changed)
    assert "    left(1_0 - 9)  # slowly\n" in updated
    assert "def leader():\n    wait(1)\n    while laps < 3:\n" in updated
    assert updated.endswith("def followers():\n    forward(4)\n# the end\n")


def test_comments_between_the_parts_of_a_step_stay_where_its_function_changes():
    text = f"{HEAD}def leader():\n    while True:\n        together(\n            forward(2),  # go\n"
    text += "            # and shine\n            led(1, 2),\n        )\n"
    changed = Program([forever(together(forward(2), led(1, 2)), wait(1))])
    updated = updated_text(text, changed)
    assert read_python(updated).program == changed
    assert comments_in(updated) == comments_in(text)


def test_a_list_becomes_functions_where_the_leader_decides():
    text = f"{HEAD}# mine\nprogram = Program([wait(1)])\n"
    updated = updated_text(text, Program([wait(1), forever(forward(1))]))
    assert read_python(updated).program == Program([wait(1), forever(forward(1))])
    assert comments_in(updated) == comments_in(text)


@pytest.mark.parametrize(
    ("body", "steps"),
    [
        ("def leader():\n for i in range(3): forward(i + 1)", [forward(1), forward(2), forward(3)]),
        (
            "def leader():\n for i in range(2):\n  for _ in range(3): led(i, 1)",
            [repeat(3, led(0, 1)), repeat(3, led(1, 1))],
        ),
        ("T = 2 ** 3 // 4\ndef leader(): forward(T * 1.5)", [forward(3)]),
        (
            "def go(n, speed=1): forward(n, speed)\ndef leader():\n go(1)\n go(speed=3, n=2)",
            [forward(1, 1), forward(2, 3)],
        ),
        ("def leader():\n for x in [3, 1]:\n  if x > 2: led(x, 1)\n  else: wait(x)", [led(3, 1), wait(1)]),
        ("def leader():\n while True: wait(1)", [forever(wait(1))]),
        ("def leader():\n while False: wait(1)\n left(1)", [left(1)]),
        ("n = 0\ndef leader():\n n = random(4)\n n -= 2", [set_counter("n", any_number(4)), change_counter("n", -2)]),
        (
            "n = 0\ndef leader():\n n = n + 3\n if 3 >= n: wait(1)",
            [change_counter("n", 3), if_(~counter("n", "above", 3), [wait(1)])],
        ),
        ("def leader():\n wait(until=not person())\n tell('in_turn')\n pass", [wait(until=~person()), tell()]),
        ('def leader():\n "What it does."\n left(1)', [left(1)]),
        (
            "def leader():\n if person(): left(1)\n elif dark(): right(1)",
            [if_(person(), [left(1)], [if_(dark(), [right(1)])])],
        ),
    ],
)
def test_what_a_text_says(body, steps):
    assert leader_of(body) == tuple(steps)


def test_followers_have_settings_and_functions_of_their_own():
    text = "def blink(n): led(n, 1)\ndef pause(): wait(1)\ndef leader(): pass\n"
    text += "def followers(forward=True, tagged=False):\n blink(2)\n pause()\nprofile = 'classroom'\n"
    program = read_python(HEAD + text).program
    assert program == Program([], Followers([led(2, 1), wait(1)], forward=True, tagged=False))
    changed = replace(program, leader=(forever(wait(1)),))
    assert read_python(python_text(changed)).program == changed


@pytest.mark.parametrize(
    ("body", "code", "line"),
    [
        ("n = 0\ndef leader():\n n += 1\n forward(n)", "python-counted", 5),
        ("def leader():\n while True:\n  if person(): break", "python-leaves", 4),
        ("def leader():\n return", "python-leaves", 3),
        ("n = 3\ndef leader(): n += 1", "python-counter-begins", 2),
        ("n = 0\ndef leader(): n += 0.5\ndef f(): n *= 2", "python-inner-statement", 4),
        ("n = 0\ndef leader():\n n += wait(1)", "python-no-count", 4),
        ("def leader():\n if forward(1): wait(1)", "python-no-condition", 3),
        ("def leader():\n while wait: pass", "python-no-condition", 3),
        ("def leader():\n for x in y: pass", "python-for", 3),
        ("def leader():\n for _ in range(2): pass\n else: pass", "python-for", 3),
        ("def leader(n): wait(n)", "python-parameters", 2),
        ("def f(*n): pass\ndef leader(): pass", "python-parameters", 2),
        ("def f(n): wait(n)\ndef leader():\n f()", "python-arguments", 4),
        ("def leader():\n for i in (1, 2):\n  for i in (1, 2): forward(i)\n  left(i)", "python-name-is-bound", 3),
        ("def leader():\n for i in (1, 2):\n  if person(): i = 3\n  forward(i)", "python-name-is-bound", 3),
        ("n = 0\ndef leader():\n for n in range(3): wait(1)\n n += 1", "python-name-is-bound", 4),
        ("def f(n):\n n += 1\n forward(n)\ndef leader(): f(1)", "python-name-is-bound", 2),
        ("def f(): pass\ndef leader(): f(1)", "python-arguments", 3),
        ("def leader(): tell()", "python-tell", 2),
        ("def leader(): tell(forward)", "python-not-a-step", 2),
        ("def leader(): pass\ndef leader(): pass", "python-defined-twice", 3),
        ("def f(n): f(n)\ndef leader(): f(1)", "recursion", 2),
        ("def leader(): leader()", "recursion", 2),
        ("def leader(): pass\nopen('x')", "python-statement-outside", 3),
        ("def leader(): pass\nleader()", "python-called-outside", 3),
        ("def leader(): pass\nimport os", "python-import", 3),
        ("def leader(): pass\nprogram = Program([])", "python-statement-outside", 3),
        ("def leader(): pass\ndef followers():\n while person(): wait(1)", "followers-cannot-decide", 4),
        ("def leader():\n forward(open('x'))", "python-no-value", 3),
        ("def leader():\n forward(9 ** 9 ** 9)", "python-no-value", 3),
        ("def leader():\n wait(until=chance(500))", "out-of-range", 3),
        ("def leader():\n forward()", "missing-field", 3),
    ],
)
def test_what_is_refused_is_told_at_its_line(body, code, line):
    with pytest.raises(ProgramError) as refused:
        read_python(HEAD + body)
    found = refused.value.diagnostics[0]
    assert (found.code, found.span.line) == (code, line)
    assert all("{" not in found.sentence(language) for language in languages())


@pytest.mark.parametrize(
    "body",
    [
        "for i in range(10 ** 9): forward(i)",
        "for i in range(99):\n  for j in range(99):\n   for k in range(99): forward(i + j + k)",
        "f(1)",
    ],
)
def test_a_text_that_costs_too_much_is_refused_soon(body):
    text = "".join(f"def f{n}(x):\n f{n + 1}(x)\n f{n + 1}(x)\n" for n in range(40))
    began = time.thread_time()
    with pytest.raises(ProgramError) as refused:
        read_python(f"{HEAD}{text}def f40(x): wait(x)\ndef f(x): f0(x)\ndef leader():\n {body}\n")
    assert {found.code for found in refused.value.diagnostics} <= {"python-too-much", "blocks-too-deep"}
    assert time.thread_time() - began < 5


def test_the_command_line_takes_such_a_file(tmp_path):
    file = tmp_path / "laps.py"
    file.write_text(ISSUE, encoding="utf-8")
    image = tmp_path / "laps.image"
    assert run("compile", file, "-o", image).code == 0
    again = run("decompile", image, "--python").out
    assert compile_program(read_python(again).program).words == compile_program(bare(PROGRAM)).words
