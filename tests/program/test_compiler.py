"""From steps to words: as few as can be, each from its step, and a sentence for all that can't be."""

import json
import re
from dataclasses import replace
from itertools import accumulate, pairwise, product

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from motorcade import (
    Followers,
    Program,
    ProgramError,
    avoid,
    compile_program,
    forward,
    led,
    pir,
    read_program,
    repeat,
    together,
    voice,
    wait,
)
from motorcade.config.profile import Profile
from motorcade.locales import languages
from motorcade.program.compiler import Compiled
from motorcade.program.steps import LedStep, Step
from motorcade.words.formats import CONTROL
from support.strategies import BRISK, CLASSROOM, rows, sums
from support.timelines import length_ms, unrolled

MOST_TRIED = 6


@st.composite
def odd_profiles(draw: st.DrawFn) -> Profile:
    """Cars whose levels don't fit each other as nicely as 1, 2 and 3."""
    tenths = draw(st.lists(st.integers(1, 12), min_size=3, max_size=3, unique=True).map(sorted))
    return replace(CLASSROOM, durations_ms=(0, *(100 * tenth for tenth in tenths)))


def fewest_states(durations_ms: list[int], levels_ms: tuple[int, ...]) -> int | None:
    """By trying all rows of up to MOST_TRIED states: how many hold blocks of these durations; None for none."""
    for count in range(1, MOST_TRIED + 1):
        for lengths_ms in product(levels_ms[1:], repeat=count):
            states = list(pairwise(accumulate(lengths_ms, initial=0)))
            if states[-1][1] == max(durations_ms) and all(
                duration - begin in levels_ms
                for duration in durations_ms
                for begin, end in states
                if begin < duration < end
            ):
                return count
    return None


@given(st.data())
def test_a_leaders_step_takes_the_fewest_states_that_can_hold_it(data: st.DataObject) -> None:
    profile = data.draw(odd_profiles())
    lengths_s = [data.draw(sums(profile, least=1)), data.draw(sums(profile)), data.draw(sums(profile))]
    step = together(forward(lengths_s[0]), led(1, lengths_s[1]), avoid(2, lengths_s[2]))
    compiled = compile_program(Program([step]), profile)
    fewest = fewest_states([round(length * 1000) for length in lengths_s], profile.durations_ms)
    if fewest is not None:
        assert compiled.leader_states == fewest
    elif compiled.words:
        assert compiled.leader_states > MOST_TRIED
    else:
        assert [each.code for each in compiled.diagnostics] == ["duration-not-expressible"]


def fields(compiled: Compiled, *names: str) -> list[tuple[int, ...]]:
    return [tuple(getattr(CONTROL.decode(word), name) for name in names) for word in compiled.words[1:]]


def test_a_block_that_ends_inside_a_long_step_ends_there_and_is_gone() -> None:
    compiled = compile_program(Program([together(forward(5), led(2, 2), voice(), pir())]))
    lit = fields(compiled, "motor_duration", "led_which", "led_duration", "voice", "pir")
    assert lit == [(3, 2, 2, 1, 1), (2, 0, 0, 1, 1)]


@given(rows(sums(BRISK), least=1))
def test_a_row_takes_as_many_states_as_its_steps_and_each_word_comes_from_its_step(steps: list[Step]) -> None:
    compiled = compile_program(Program(steps), BRISK)
    places = []
    for path, step in unrolled(steps, "leader"):
        places += [(path, step.id)] * compile_program(Program([step]), BRISK).leader_states
    assert list(compiled.origins) == [("", None), *places]
    assert compiled.leader_states == len(places)


@given(rows(sums(BRISK, least=1), least=1))
def test_followers_words_come_from_their_steps_in_order(steps: list[Step]) -> None:
    compiled = compile_program(Program([], steps), BRISK)
    assume(compiled.words)
    places = [place for place, _ in compiled.origins[1:]]
    expected = [path for path, _ in unrolled(steps, "followers.steps")]
    once = [place for place, before in zip(places, [None, *places], strict=False) if place != before]
    assert once == [place for place, before in zip(expected, [None, *expected], strict=False) if place != before]
    total_ms = sum(length_ms(step, BRISK.idle_state_ms) for _, step in unrolled(steps, ""))
    assert compiled.dwell_ms * compiled.follower_words == total_ms


def test_an_origin_names_the_block() -> None:
    program = Program([repeat(2, wait(1, id="w")), led(0, 4, id="l")], [together(wait(2), led(0, 1), id="t")])
    assert compile_program(program).origins == (
        ("", None),
        *[("leader[0].repeat.steps[0]", "w")] * 2,
        *[("leader[1]", "l")] * 2,
        ("followers.steps[0]", "t"),
    )


@pytest.mark.parametrize(
    ("steps", "dwell_ms", "count"),
    [
        ([wait(3)], 3000, 1),
        ([wait(2), led(0, 4)], 2000, 3),
        ([wait(2), led(0, 3)], 1000, 5),
        ([led(0, 3), led(1, 3), led(0, 6)], 1000, 12),  # 3 s after 3 s of the same LED would wait for a repeat
        ([led(0, 3), led(1, 3), led(2, 3)], 3000, 3),
        ([repeat(2, led(0, 2), led(1, 2))], 2000, 4),
        ([wait(765)], 3000, 255),
    ],
)
def test_followers_get_the_longest_dwell_that_keeps_step(steps: list[Step], dwell_ms: int, count: int) -> None:
    compiled = compile_program(Program([], steps))
    assert (compiled.dwell_ms, compiled.follower_words) == (dwell_ms, count)


@pytest.mark.parametrize(
    ("steps", "dwell_ms", "count"),
    [
        ([led(0, 3)], 3000, 1),
        ([led(0, 3), led(0, 3)], 3000, 2),
        ([repeat(100, led(0, 3))], 3000, 100),
        ([wait(2), led(0, 4)], 2000, 3),
        ([wait(2), led(0, 3)], 1000, 5),
        ([forward(6)], 3000, 2),
        ([wait(8)], 8000, 1),  # the longest duration is 3 s, and after it the car stands still
        ([pir(8)], 8000, 1),
        ([voice(8)], 2000, 4),  # 'go' has to be listened for all the time
        ([together(wait(8), led(1, 2)), wait(16)], 8000, 3),
        ([wait(8, accept_ir=False)], 2000, 4),  # deaf for 8 s
        ([wait(765)], 5000, 153),
        ([wait(800)], 8000, 100),
    ],
)
def test_tagged_words_are_as_few_as_can_be(steps: list[Step], dwell_ms: int, count: int) -> None:
    compiled = compile_program(Program([], Followers(steps, tagged=True)))
    assert (compiled.dwell_ms, compiled.follower_words, compiled.tagged) == (dwell_ms, count, True)
    assert compiled.words[0] & 0xFF == 1


@given(rows(sums(BRISK, least=1), least=1))
def test_tagged_words_are_never_more_than_bare_ones_and_have_the_longest_dwell(steps: list[Step]) -> None:
    compiled = compile_program(Program([], Followers(steps, tagged=True)), BRISK)
    bare = compile_program(Program([], Followers(steps, tagged=False)), BRISK)
    assert bare.words == () or compiled.follower_words <= bare.follower_words
    lengths_ms = {length_ms(step, BRISK.idle_state_ms) for _, step in unrolled(steps, "")}
    if all(isinstance(step, LedStep) for _, step in unrolled(steps, "")):
        fitting = [dwell for dwell in BRISK.dwell_ms if all(length % dwell == 0 for length in lengths_ms)]
        assert compiled.dwell_ms == max(dwell for dwell in fitting if dwell <= BRISK.durations_ms[-1])


AUTO_TAGGED = [
    (Followers([led(0, 1), led(1, 1)]), False),
    (Followers([led(0, 3)], forward=True), False),
    (Followers([led(0, 1), led(1, 1)], forward=True), True),
    (Followers([led(0, 3), led(0, 3)], forward=True), True),
    (Followers([repeat(2, led(0, 3))], forward=True), True),
    (Followers([repeat(1, led(0, 3))], forward=True), False),
    (Followers([led(0, 1), repeat(2, led(1, 1, forward=True))]), True),
    (Followers([led(0, 4)], forward=True), True),
    (Followers([led(0, 1)], forward=True, dwell_seconds=2), False),
    (Followers([led(0, 1), led(0, 1)], forward=True, dwell_seconds=2), True),
    (Followers([repeat(85, led(0, 3), led(1, 3), led(0, 3))], forward=True), True),
    (Followers([], forward=True), False),
]


@pytest.mark.parametrize(("followers", "tagged"), AUTO_TAGGED)
def test_words_are_tagged_by_themselves_where_one_of_several_is_passed_on(followers: Followers, tagged: bool) -> None:
    compiled = compile_program(Program([wait(1)], followers))
    assert compiled.tagged is tagged
    assert compiled.words[0] & 0xFF == tagged
    assert compiled.words == compile_program(Program([wait(1)], replace(followers, tagged=tagged))).words


def test_settings_of_a_step_win_over_those_of_all_and_a_repeat_hands_them_down() -> None:
    deaf = repeat(2, led(0, 1), led(1, 1, accept_ir=True), accept_ir=False)
    compiled = compile_program(Program([], Followers([deaf, led(2, 1), led(3, 1, forward=False)], forward=True)))
    assert fields(compiled, "accept_ir", "forward") == [(0, 1), (1, 1), (0, 1), (1, 1), (1, 1), (1, 0)]


LEADER, FOLLOWERS = "leader[0]", "followers.steps[0]"


def follower(*steps: Step, **settings: object) -> Program:
    return Program([wait(1)], Followers(steps, **settings))


@pytest.mark.parametrize(
    ("program", "code", "path", "said"),
    [
        (Program([wait(1, accept_ir=True, id="b")]), "leader-accepts-ir", LEADER, "infrared"),
        (Program([wait(1, forward=True, id="b")]), "unknown-field", "leader[0].forward", "forward"),
        (Program([voice(id="b")]), "missing-field", "leader[0].voice", "seconds"),
        (Program([wait(1), repeat(300, wait(6), id="b")]), "too-many-states", "leader[1]", "601 states.*600 of"),
        (Program([wait(1000, id="b"), wait(1)]), "too-many-states", LEADER, "335 states.*334 of"),
        (Program([repeat(10**9, repeat(10**9, led(0, 1)), id="b")]), "too-many-states", LEADER, f"{10**18} states"),
        (Program([wait(0.5, id="b")]), "duration-not-expressible", LEADER, "0.5 s.*: 0 s or 1 s"),
        (Program([wait(1000.25, id="b")]), "duration-not-expressible", LEADER, "1000.25 s.*: 1000 s or 1001 s"),
        (Program([together(led(0, 1.5, id="b"))]), "duration-not-expressible", "leader[0].together[0]", "1 s or 2 s"),
        (
            Program([together(wait(1), forward(1), id="b")]),
            "parallel-conflict",
            "leader[0].together[1]",
            "waiting and driving",
        ),
        (Program([together(led(0, 1), led(1, 1, id="b"))]), "parallel-conflict", "leader[0].together[1]", "light"),
        (follower(repeat(10**9, wait(2), led(0, 2), id="b")), "too-many-words", FOLLOWERS, "2000000000 words"),
        (follower(wait(900, id="b")), "too-many-words", FOLLOWERS, "300 words"),
        (follower(repeat(300, led(0, 3), id="b"), dwell_seconds=1), "too-many-words", FOLLOWERS, "300 words"),
        (follower(wait(0, id="b")), "dwell-not-expressible", FOLLOWERS, "1, 2, 3, 4, 5, 6, 7, 8 s"),
        (follower(wait(4, id="b"), dwell_seconds=2), "dwell-not-expressible", FOLLOWERS, "4 s"),
        (follower(wait(1), dwell_seconds=9), "dwell-not-expressible", "followers.dwell_seconds", "9 s"),
    ],
)
def test_what_cannot_be_is_said_with_its_place_and_block(program: Program, code: str, path: str, said: str) -> None:
    compiled = compile_program(program)
    (diagnostic,) = compiled.diagnostics
    assert (diagnostic.code, diagnostic.severity, diagnostic.path) == (code, "error", path)
    assert diagnostic.id == (None if path == "followers.dwell_seconds" else "b")
    assert re.search(said, diagnostic.sentence("en"))
    assert not re.search(r"{\w+}", "".join(diagnostic.sentence(language) for language in languages()))
    assert compiled.words == ()
    with pytest.raises(ProgramError, match=re.escape(diagnostic.sentence("en"))):
        _ = compiled.image


@pytest.mark.parametrize(
    ("program", "code", "path"),
    [
        (Program([]), "empty-program", "leader"),
        (Program([repeat(3)]), "empty-program", "leader"),
        (follower(), "empty-program", "followers.steps"),
        (follower(led(0, 3, accept_ir=False), wait(1)), "deaf-followers", FOLLOWERS),
        (follower(led(0, 2, accept_ir=False), wait(1)), "deaf-followers", FOLLOWERS),
        (follower(led(0, 3, accept_ir=False), wait(2), dwell_seconds=1), "deaf-followers", FOLLOWERS),
        (follower(led(0, 3, accept_ir=False), wait(1), tagged=True), "deaf-followers", FOLLOWERS),
        (follower(led(0, 1), led(1, 1), forward=True, tagged=False), "echo", FOLLOWERS),
        (follower(led(0, 1), led(1, 1, forward=True), tagged=False), "echo", "followers.steps[1]"),
    ],
)
def test_what_may_surprise_is_warned_of(program: Program, code: str, path: str) -> None:
    compiled = compile_program(program)
    assert [(each.code, each.severity, each.path) for each in compiled.diagnostics] == [(code, "warning", path)]
    assert not re.search(r"{\w+}", "".join(compiled.diagnostics[0].sentence(language) for language in languages()))
    assert compiled.words
    assert compiled.image


@pytest.mark.parametrize(
    "program",
    [
        follower(led(0, 3, accept_ir=False), led(1, 3)),  # deaf for just as long as the word is sent
        follower(led(0, 1), forward=True),
        follower(led(0, 1), led(1, 1), forward=True),
        follower(led(0, 1), led(1, 1, forward=True), tagged=True),
        Program([wait(1, accept_ir=False)]),
        Program([wait(0), led(0, 0), together()]),
        Program([], Followers([wait(1)])),
    ],
)
def test_what_surprises_nobody_is_not_warned_of(program: Program) -> None:
    assert compile_program(program).diagnostics == ()


@pytest.mark.parametrize(
    "steps",
    [[repeat(3, led(0, 3))], [wait(5)], [repeat(4, forward(2))], [wait(7), wait(1)], [led(0, 1), wait(1), led(0, 1)]],
)
def test_no_word_of_followers_is_followed_by_itself(steps: list[Step]) -> None:
    words = compile_program(Program([], steps)).words[1:]
    assert all(word != following for word, following in zip(words, (*words[1:], words[0]), strict=True))


@given(odd_profiles(), st.integers(1, 3000))
def test_a_duration_that_cannot_be_is_said_with_its_neighbours(profile: Profile, duration_ms: int) -> None:
    reached = {0}
    for candidate in range(1, 6001):
        if any(candidate - level in reached for level in profile.durations_ms[1:]):
            reached.add(candidate)
    below, above = max(x for x in reached if x <= duration_ms), min(x for x in reached if x >= duration_ms)
    compiled = compile_program(Program([wait(duration_ms / 1000)]), profile)
    assert bool(compiled.words) == (below == above)
    if below != above:
        assert compiled.diagnostics[0].sentence().endswith(f"{below / 1000:g} s or {above / 1000:g} s.")


@pytest.mark.parametrize(
    ("steps", "place", "said"),
    [
        ([led(0, 0.4), led(1, 0.6)], "", "in common"),
        ([together(forward(1), led(1, 0.4))], "[0]", "this step lasts 1 s"),
    ],
)
def test_steps_that_no_dwell_fits_are_said_with_the_reason(steps: list[Step], place: str, said: str) -> None:
    profile = replace(CLASSROOM, durations_ms=(0, 400, 600, 1000), dwell_ms=(400, 600, *CLASSROOM.dwell_ms[2:]))
    (diagnostic,) = compile_program(Program([wait(1)], steps), profile).diagnostics
    assert (diagnostic.code, diagnostic.path) == ("dwell-not-expressible", f"followers.steps{place}")
    assert said in diagnostic.sentence()
    assert "0.4, 0.6" in diagnostic.sentence("zh")


@pytest.mark.parametrize(
    ("step", "nearest"),
    [
        (together(forward(8), led(1, 7)), "7 s or 10 s"),
        (together(forward(10), led(1, 7), avoid(1, 8)), "7 s"),  # however long it is, 7 s and 8 s don't go together
    ],
)
def test_blocks_that_cannot_go_together_are_said_with_a_length_that_could(step: Step, nearest: str) -> None:
    profile = replace(CLASSROOM, durations_ms=(0, 3000, 5000, 7000))
    (diagnostic,) = compile_program(Program([step]), profile).diagnostics
    assert diagnostic.code == "duration-not-expressible"
    assert diagnostic.sentence().endswith(f"nearest that can: {nearest}.")


def test_a_repeat_beyond_all_counting_is_answered() -> None:
    """Each count can be printed (Python prints 4,300 digits), their product can't."""
    step: object = {"wait": {"seconds": 1}}
    for _ in range(2):
        step = {"repeat": {"times": 10**4000, "steps": [step]}}
    text = json.dumps({"format": "motorcade-program/1", "leader": [step]})
    try:
        diagnostics = compile_program(read_program(text)).diagnostics
    except ProgramError as error:
        diagnostics = error.diagnostics
    assert diagnostics
    assert all(each.sentence(language) for each in diagnostics for language in languages())


def test_words_that_only_a_shorter_dwell_can_say_are_counted_as_they_are() -> None:
    profile = replace(CLASSROOM, durations_ms=(0, 1000, 2500, 3000))
    steps = [together(forward(3), led(1, 2)), together(forward(3), led(2, 2))] * 50
    (diagnostic,) = compile_program(Program([wait(1)], steps), profile).diagnostics
    assert diagnostic.code == "too-many-words"
    assert re.search("300 words.* makes 3 of them", diagnostic.sentence())
