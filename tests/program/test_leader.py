"""A leader that decides: its program as a tree and its words do the same; the fewest words; what is refused."""

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motorcade import (
    Followers,
    Program,
    compile_program,
    decompile,
    follow_line,
    forward,
    led,
    left,
    read_program,
    repeat,
    right,
    together,
    wait,
)
from motorcade.locales import languages
from motorcade.program.conditions import chance, counter, dark, heard, obstacle, person
from motorcade.program.flow_steps import (
    FlowStep,
    change_counter,
    do,
    flow,
    forever,
    if_,
    repeat_until,
    set_counter,
    tell,
)
from motorcade.program.model import placed_steps
from motorcade.program.parts import control_word
from motorcade.words.flow import JUMP, PERSON
from motorcade.words.formats import FLOW
from motorcade.words.image import parse_image
from support.drawn_leaders import DrawnLeader, drawn_image
from support.leader_runs import run_tree, run_words
from support.strategies import CLASSROOM

TICKS = 200
SEEDS = st.integers(0, 1 << 40)
# A program is drawn, compiled and run in milliseconds.
MANY = settings(max_examples=10 * settings().max_examples)
LEVELS = {duration: level for level, duration in enumerate(CLASSROOM.durations_ms)}


def assert_alike(seed):
    """Compile a random program: its tree and its words do the same in a random world."""
    program = DrawnLeader(seed).program
    compiled = compile_program(program, CLASSROOM)
    if any(found.severity == "error" for found in compiled.diagnostics):
        assert {found.code for found in compiled.diagnostics} & {"too-many-states", "no-counter-left"}
        return
    image = parse_image(compiled.words)
    as_tree = run_tree(program, seed, TICKS, CLASSROOM)
    as_words = run_words(image, seed, TICKS, CLASSROOM)
    assert abs(len(as_tree) - len(as_words)) <= TICKS // 10
    for (does, told), seen in zip(as_tree, as_words, strict=False):
        assert (does, told and control_word(told, LEVELS, 1, 0)) == seen


@settings(max_examples=min(10 * settings().max_examples, 2_000))
@given(SEEDS)
def test_a_program_as_a_tree_does_what_its_words_do(seed):
    assert_alike(seed)


@pytest.mark.soak
@pytest.mark.parametrize("part", range(20))
def test_very_many_programs_do_as_trees_what_their_words_do(part):
    for seed in range(part * 10_000, (part + 1) * 10_000):
        assert_alike(seed)


@MANY
@given(SEEDS)
def test_a_program_survives_its_file_and_its_image(seed):
    program = DrawnLeader(seed).program
    assert read_program(program.as_json()) == program
    words = compile_program(program).words
    if words:
        again = decompile(words)
        assert compile_program(again).words == words
        assert read_program(again.as_json()) == again


def test_what_the_compiler_wrote_comes_back_without_single_words():
    programs = [decompile(words) for seed in range(300) if (words := compile_program(DrawnLeader(seed).program).words)]
    plain = [program for program in programs if any(isinstance(step, FlowStep) for _, step in placed_steps(program))]
    assert len(plain) < 6


@MANY
@given(SEEDS)
def test_any_image_of_a_leader_that_decides_comes_back(seed):
    words = drawn_image(seed)
    program = decompile(words)
    assert compile_program(program).words == words
    assert read_program(program.as_json()) == program


DANCE = [left(1), right(1), forward(1), led(0, 2)]
SAMPLES = {
    "a guard dog": (7, Program([wait(until=person()), repeat(3, led(1, 1), wait(1))])),
    "out of a maze": (9, Program([forward(30, until=obstacle(1)), if_(chance(50), [left(1)], [right(1)])])),
    "a sheepdog": (
        7,
        Program(
            [
                if_(person(), [tell(wait(3)), wait(until=~person())], [tell(forward(3))]),
                forward(2, until=person()),
            ]
        ),
    ),
    "three laps": (
        11,
        Program([repeat(3, follow_line(60, until=dark("both")), tell(led(0, 1)), forward(1)), left(3)]),
    ),
    "a dance, four times": (14, Program([do("dance"), left(1)] * 4, functions={"dance": DANCE})),
    "a dance that is done once": (5, Program([do("dance"), left(1)], functions={"dance": DANCE})),
    "a dance where nobody is": (
        11,
        Program(
            [if_(~person(), [do("dance")]), left(1), do("dance"), wait(3), do("dance")], functions={"dance": DANCE}
        ),
    ),
    "for ever": (1, Program([forever(forward(1))])),
    "a wait for two things": (5, Program([repeat_until(person() & obstacle(0), wait(0)), wait(1)])),
    "many turns": (5, Program([repeat(200, forward(1)), flow("tell", target=255)], [wait(1)])),
    "more turns than a counter counts": (8, Program([repeat(1_000, forward(1)), set_counter("laps", 0)])),
}


@pytest.mark.parametrize(("words", "program"), SAMPLES.values(), ids=SAMPLES)
def test_a_program_takes_few_words(words, program):
    assert compile_program(program).leader_states == words


@pytest.mark.parametrize(
    "program",
    [
        Program([wait(until=person()), repeat(3, led(1, 1), wait(1))]),
        Program([forward(until=obstacle(1)), if_(chance(50), [left(1)], [right(1)])]),
        Program([if_(person() & ~dark("left"), [wait(until=~person())]), forward(2, until=heard("go"))]),
        Program(
            [wait(1), repeat_until(counter("a", "above", 2), left(1), change_counter("a", 1)), set_counter("a", 0)]
        ),
        Program([if_(obstacle(0) | person(), [left(7, until=~obstacle(0))], [forever(forward(1))]), wait(1)]),
        Program([do("part_1"), left(1), do("part_1")], functions={"part_1": [*DANCE, forward(2)]}),
        Program([tell("in_turn"), wait(2), tell(led(3, 1)), forward(20, until=person())], [led(0, 1), wait(1)]),
        Program([together(forward(), led(1, 2), until=dark())]),
    ],
)
def test_a_program_comes_back_as_it_was_written(program):
    words = compile_program(program).words
    assert decompile(words) == program


def deep(count):
    """Functions each of which does the next one twice."""
    row = {f"f{number}": [*DANCE * 5, do(f"f{number + 1}"), do(f"f{number + 1}")] for number in range(count)}
    return row | {f"f{count}": DANCE * 2}


WRONG = [
    ([set_counter(name, 1) for name in "abcd"] + [set_counter("e", 1, id="b"), wait(1)], "too-many-counters", "[4]"),
    ([do("dence", id="b")], "unknown-function", "[0]"),
    ([wait(id="b", until=chance(5))], "until-not-sensed", "[0].until"),
    ([wait(id="b", until=counter("a", "is", 5))], "until-not-sensed", "[0].until"),
    ([wait(id="b", until=person() | obstacle())], "until-several", "[0].until"),
    ([wait(1), flow("jump", 5, id="b")], "out-of-range", "[1].flow.target"),
    ([wait(1), flow("jump", 1, "voice", level=3, id="b")], "out-of-range", "[1].flow.level"),
    ([tell(led(0, 8), id="b")], "tell-not-one-word", "[0].tell.step"),
    ([tell(led(0, 0.5), id="b")], "duration-not-expressible", "[0].tell.step"),
    ([wait(id="b")], "missing-field", "[0].wait"),
    ([repeat(9, *[repeat(9, *[repeat(9, wait(1))] * 9)] * 9, id="b"), do("dance")], "too-many-states", "[0]"),
]


def assert_is_said(program, code, path, severity):
    (found,) = [found for found in compile_program(program).diagnostics if found.code == code]
    assert (found.path, found.severity) == (path, severity)
    for language in languages():
        assert not re.search(r"{\w+}", found.sentence(language))
    return found


@pytest.mark.parametrize(("steps", "code", "place"), WRONG)
def test_what_cannot_be_is_said_at_its_step(steps, code, place):
    found = assert_is_said(Program(steps, functions={"dance": DANCE}), code, f"leader{place}", "error")
    assert found.id == "b"


@pytest.mark.parametrize(
    ("program", "code", "path"),
    [
        (Program([do("a")], functions={"a": [do("b")], "b": [wait(1), do("a")]}), "recursion", "functions.a[0]"),
        (Program([do("f0"), do("f0")], functions=deep(9)), "calls-too-deep", "functions.f4[20]"),
        (Program([tell(led(0, 1)), wait(1)], Followers([], tagged=False)), "tell-untagged", "followers.tagged"),
        (Program([tell(), wait(1)]), "nothing-in-turn", "followers.steps"),
        (Program([wait(1), do("forward")], functions={"forward": [wait(1)]}), "name-is-taken", "functions.forward"),
        (Program([wait(1), set_counter("while", 1)]), "name-is-taken", "leader[1]"),
        (Program([wait(1)], [forever(wait(1))]), "followers-cannot-decide", "followers.steps[0]"),
        (Program([wait(1)], [wait(1, until=person())]), "followers-cannot-decide", "followers.steps[0]"),
        (
            Program(
                [*[set_counter(name, 1) for name in "abcd"], repeat(300, wait(1))],
            ),
            "no-counter-left",
            "leader[4]",
        ),
    ],
)
def test_what_no_leader_can_do_is_said(program, code, path):
    assert_is_said(program, code, path, "error")
    assert compile_program(program).words == ()


@pytest.mark.parametrize(
    ("program", "code", "path"),
    [
        (Program([wait(1), forever(change_counter("a"))]), "no-time-passes", "leader[1]"),
        (Program([wait(1), repeat_until(person())]), "no-time-passes", "leader[1]"),
        (Program([set_counter("a", 1)]), "no-time-passes", "leader"),
        (Program([forever(wait(1)), wait(2)]), "never-reached", "leader[1]"),
        (Program([tell(led(0, 1)), wait(0), tell(led(1, 1)), wait(1)]), "tell-too-soon", "leader[0]"),
        (
            Program(
                [do("a"), do("a"), wait(1)], functions={"a": [tell(led(0, 1)), wait(0), *[set_counter("n", 1)] * 9]}
            ),
            "tell-too-soon",
            "functions.a[0]",
        ),
        (Program([tell(led(0, 1)), wait(1)], [wait(1)]), "followers-never-told", "followers.steps"),
    ],
)
def test_what_may_surprise_is_warned_of(program, code, path):
    assert_is_said(program, code, path, "warning")
    assert compile_program(program).words


@pytest.mark.parametrize(
    "program",
    [
        Program([forever(if_(person(), [wait(1)]))]),
        Program([tell(led(0, 1)), if_(person(), [wait(1)]), tell(led(1, 1)), wait(1)]),
        Program([tell(led(0, 1)), wait(2), tell("in_turn"), wait(3)], [wait(1)]),
        Program([repeat_until(person() & obstacle(), wait(0))]),
    ],
)
def test_what_surprises_nobody_is_not_warned_of(program):
    assert compile_program(program).diagnostics == ()


def test_followers_are_told_words_behind_those_of_their_own_steps():
    program = Program(
        [tell(led(1, 2)), wait(2), tell("in_turn"), wait(2), tell(led(0, 1)), wait(1)], [led(0, 1), wait(1)]
    )
    image = parse_image(compile_program(program).words)
    assert (len(image.followers), image.tagged, image.decides) == (3, 1, 1)
    targets = [(word >> 20 & 255, word >> 1 & 255) for word in image.leader if word >> 31]
    assert targets == [(2, 0), (255, 2), (0, 0)]


def test_a_leader_that_decides_nothing_stays_a_leader_of_the_seed():
    program = Program([repeat(3, forward(1), left(1))], [wait(1)])
    assert parse_image(compile_program(program).words).decides == 0


@pytest.mark.parametrize(
    "inside", [[forward(1)], [forward(1), change_counter("laps", 1)], [repeat_until(dark(), left(1))]]
)
def test_a_loop_that_is_the_whole_program_is_asked_again_when_it_is_left(inside):
    """Its last word, a jump to the first one, isn't needed; who leaves the loop goes where it led."""
    compiled = compile_program(Program([repeat_until(person(), *inside)]), CLASSROOM)
    first = FLOW.decode(compiled.words[1])
    assert (first.op, first.condition, first.if_not, first.target) == (JUMP, PERSON, 0, 0)
    assert compile_program(decompile(compiled.words, CLASSROOM), CLASSROOM).words == compiled.words
