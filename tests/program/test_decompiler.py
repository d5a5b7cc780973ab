"""From words back to a program that says the same."""

import re

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from motorcade import (
    Followers,
    Program,
    compile_program,
    decompile,
    forward,
    heard,
    led,
    left,
    obstacle,
    person,
    pir,
    read_program,
    together,
    turn_left_to_line,
    voice,
    wait,
    wander,
)
from motorcade.config.profile import Profile
from motorcade.errors import MotorcadeError
from motorcade.words.formats import CONTROL
from motorcade.words.image import Image, image_words, parse_image
from support.strategies import BRISK, CLASSROOM, programs
from support.strategies import words as control_words

PROFILES = st.sampled_from([CLASSROOM, BRISK])


@st.composite
def images(draw: st.DrawFn) -> tuple[int, ...]:
    leader = draw(st.lists(control_words(leads=True), max_size=5))
    few = draw(st.lists(control_words(), min_size=1, max_size=3))
    followers = draw(st.lists(st.sampled_from(few) | control_words(), max_size=8))
    tagged = draw(st.integers(0, 1)) if followers else 0
    return image_words(Image(leader, followers, draw(st.integers(0, 7)) if followers else -1, tagged))


def assert_comes_back(words: tuple[int, ...], profile: Profile = CLASSROOM) -> Program:
    program = decompile(words, profile)
    compiled = compile_program(program, profile)
    assert [each for each in compiled.diagnostics if each.severity == "error"] == []
    assert compiled.words == words
    assert read_program(program.as_json()) == program
    return program


@given(st.data(), PROFILES)
def test_a_compiled_program_comes_back_as_one_that_compiles_to_the_same_words(
    data: st.DataObject, profile: Profile
) -> None:
    compiled = compile_program(data.draw(programs(profile)), profile)
    assume(compiled.words)
    assert_comes_back(compiled.words, profile)


@given(images(), PROFILES)
def test_any_valid_image_comes_back_as_a_program_that_compiles_to_it(words: tuple[int, ...], profile: Profile) -> None:
    assert_comes_back(words, profile)


@pytest.mark.parametrize("word", [0xA5800000, 0x80000000, 0x00000000, 0xFFFFF000])
@pytest.mark.parametrize(("level", "tagged"), [(0, 0), (7, 1)])
def test_the_largest_image_comes_back(word: int, level: int, tagged: int) -> None:
    assert_comes_back(image_words(Image([0x7FFFF000] * 255, [word] * 255, level, tagged)))


@pytest.mark.parametrize(
    "program",
    [
        Program([forward(3), left(1, speed=1), together(forward(2), led(1, 1))]),
        Program([led(0, 2), voice(3)], [forward(3), led(2, 3)]),
        Program([], Followers([forward(3), led(0, 1), together(left(2, unless=heard()), led(1, 1))], forward=True)),
        Program([forward(3, unless=person()), wander(2, unless=obstacle(1) | heard()), turn_left_to_line(1)]),
        Program([], Followers([led(0, 3), led(1, 2, accept_ir=True), forward(1, forward=True)], accept_ir=False)),
        Program([], Followers([led(0, 3), led(0, 3)], tagged=True)),
        Program([], Followers([forward(4), together(forward(1), led(0, 1))], tagged=True)),
        Program([], Followers([led(0, 3), led(1, 3)], forward=True, tagged=False)),
        Program([], Followers([led(0, 3)], forward=True, tagged=True)),
        Program([], Followers([wait(8), together(wait(8), led(1, 2)), pir(8)], tagged=True)),
    ],
)
def test_a_plain_program_comes_back_as_it_was_written(program: Program) -> None:
    assert assert_comes_back(compile_program(program).words) == program


def test_words_that_no_compiler_would_choose_keep_their_dwell() -> None:
    short = CONTROL.encode(accept_ir=1, led_which=1, led_duration=1)
    for tagged, how in ((0, "auto"), (1, True)):
        program = assert_comes_back(image_words(Image([], [short, short], 7, tagged)))
        assert program.followers == Followers([led(1, 1), led(1, 1)], dwell_seconds=8, tagged=how)


@pytest.mark.parametrize(
    ("leader", "followers", "position", "said"),
    [
        ([0x40000000, 0xC0000000], [], 2, "accept"),
        ([0x20000000], [], 1, "forward"),
        ([0x40800000], [], 1, "motor"),
        ([0x40000000, 0x40010000], [], 2, "avoid"),
        ([0x40000000], [0x80000000, 0x98000000], 3, "motor"),
        ([], [0x80004000], 1, "avoid"),
    ],
)
def test_a_word_that_no_step_says_is_named(leader: list[int], followers: list[int], position: int, said: str) -> None:
    words = image_words(Image(leader, followers, 0 if followers else -1, 0))
    name = f"word {position} (0x{words[position]:08X})"
    with pytest.raises(MotorcadeError, match=re.escape(name) + f".*{said}"):
        decompile(words)


@given(st.lists(st.integers(0, 0xFFFFFFFF), max_size=4), st.lists(st.integers(0, 0xFFFFFFFF), max_size=4))
def test_any_image_comes_back_or_has_its_word_named(leader: list[int], followers: list[int]) -> None:
    """The rest of each word is kept, only what no image may hold (reserved bits, parity) is taken off."""
    unused = CONTROL.reserved_mask | 1
    words = image_words(
        Image([word & ~unused for word in leader], [word & ~unused for word in followers], 3 if followers else -1, 0)
    )
    assert parse_image(words)
    try:
        assert_comes_back(words)
    except MotorcadeError as error:
        assert re.match(r"word [1-8] \(0x[0-9A-F]{8}\) ", str(error))  # noqa: PT017
