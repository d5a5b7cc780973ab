"""Turn an image back into a program that compiles to the same bytes."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import takewhile
from typing import Any

from motorcade.config.profile import Profile, built_in_profile
from motorcade.errors import MotorcadeError
from motorcade.program.compiler import compile_program
from motorcade.program.flow_steps import FlowStep
from motorcade.program.model import Followers, Program, equal_at_start
from motorcade.program.parts import (
    control_word,
    durations_in,
    durations_of,
    lasting,
    parts_of,
    slice_of,
    step_in,
    to_seconds,
)
from motorcade.program.steps import (
    AccompanyingStep,
    Step,
    TogetherStep,
    WaitStep,
)
from motorcade.program.structure import Structure
from motorcade.words.flow import IN_TURN, TELL
from motorcade.words.formats import CONTROL, FLOW, STATE
from motorcade.words.image import Image, parse_image

# How many constructs of a leader may turn out to be none before all its words are read by themselves.
_MOST_TRIES = 40
# The bits of all durations.
_DURATIONS = sum(field.word_mask for field in CONTROL.fields if field.name.endswith("_duration"))


class DecompileError(MotorcadeError):
    """A valid image that no program compiles to; the sentence names the word."""


def decompile(words: Sequence[int], profile: Profile | None = None) -> Program:
    """Return a Program that compiles to these ``words`` (an image, header first).

    Followers' words that the compiler would choose itself become plain steps. All
    others become one step a word, and the program states their dwell. It states whether
    words are tagged only where the compiler would choose otherwise.

    Raises:
        ImageError: the words are no image.
        DecompileError: a word holds what no step can express, such as a leader that accepts infrared.
    """
    profile = profile or built_in_profile("classroom")
    image = parse_image(tuple(words))
    for position, word in enumerate((*image.leader, *image.followers), start=1):
        _check_word(word, position, position <= len(image.leader), bool(image.decides))
    if image.decides:
        return _decide(image, profile, tuple(words))
    leader = [step_in(word, profile.durations_ms) for word in image.leader]
    if not image.followers:
        return Program(leader, None, profile.name)
    # The last guess always compiles to the same words.
    return next(
        program
        for followers in _guessed_followers(image, profile)
        if compile_program(program := Program(leader, followers, profile.name), profile).words == tuple(words)
    )


def _decide(image: Image, profile: Profile, words: tuple[int, ...]) -> Program:
    """Return the program of a leader that decides."""
    own = _own_words(image)
    followers: Followers | None = None
    if image.followers:
        followers = _deciding_followers(image._replace(followers=image.followers[:own]), profile, words)
    plain: frozenset[int] = frozenset()
    for _ in range(_MOST_TRIES):
        program, structure = _structured(image, profile, own, followers, plain)
        made = compile_program(program, profile).words
        if made == words:
            return program
        wrong = equal_at_start(made[1:], words[1:])
        around = [extent for extent in structure.extents if extent.start <= wrong < extent.end]
        if not around or not made:
            break
        innermost = min(around, key=lambda extent: extent.end - extent.start)
        plain |= {innermost.start}
    # Each word by itself always compiles to the same words.
    if image.followers:
        followers = _deciding_followers(image, profile, words)
    program, _ = _structured(image, profile, len(image.followers), followers, frozenset(range(len(image.leader))))
    return program


def _structured(
    image: Image, profile: Profile, own: int, followers: Followers | None, plain: frozenset[int]
) -> tuple[Program, Structure]:
    told = {}
    settings = followers or Followers([])
    for number, word in enumerate(image.followers):
        step = step_in(word, profile.durations_ms)
        told[number] = _with_settings(step, word, settings.accept_ir, settings.forward)
    structure = Structure(image.leader, profile.durations_ms, plain, told, own)
    return Program(structure.leader, followers, profile.name, functions=structure.functions), structure


def _tells_in(image: Image) -> list[Any]:
    """Return the fields of the leader's words that tell the followers something."""
    flows = [FLOW.decode(word) for word in image.leader if word >> 31]
    return [values for values in flows if values.op == TELL]


def _own_words(image: Image) -> int:
    """Return how many of the follower words are not there only because the leader tells them."""
    tells = _tells_in(image)
    count = len(image.followers)
    if not tells:
        return count
    turns = [values.value for values in tells if values.target == IN_TURN]
    if turns:
        return turns[0] or count
    told = list(dict.fromkeys(values.target for values in tells))
    own = count
    while own and own - 1 in told and [place for place in told if place >= own - 1] == [*range(own - 1, count)]:
        own -= 1
    return own


def _deciding_followers(image: Image, profile: Profile, words: tuple[int, ...]) -> Followers | None:
    """Return Followers whose own words are these; None where the compiler has the same settings without them."""
    has_tells = bool(_tells_in(image))
    dwell_ms = profile.dwell_ms[image.dwell_level]
    if not image.followers:
        if dwell_ms == profile.dwell_ms[0]:
            return None
        return Followers([], dwell_seconds=to_seconds(dwell_ms))
    tell: Step = FlowStep("tell", target=IN_TURN)
    first = WaitStep(to_seconds(profile.durations_ms[1]))
    leader: list[Step] = [first, tell] if has_tells else [first]
    dwell = words[0] >> 8 & 255
    for followers in _guessed_followers(image, profile):
        compiled = compile_program(Program(leader, followers, profile.name), profile)
        if not compiled.words or compiled.words[0] >> 8 & 255 != dwell or compiled.tagged != bool(image.tagged):
            continue
        if compiled.words[1 + len(leader) :] == tuple(image.followers):
            return followers
    raise AssertionError("each word by itself compiles to itself")


def _guessed_followers(image: Image, profile: Profile) -> Iterator[Followers]:
    """Yield Followers that the words may come from, the simplest first."""
    for guess in (_counted_down, _driven_through):
        plain = _plain_followers(image, profile, guess)
        yield plain
        yield replace(plain, tagged=bool(image.tagged))
    steps = [step_in(word, profile.durations_ms) for word in image.followers]
    literal = _followers(steps, image.followers, to_seconds(profile.dwell_ms[image.dwell_level]))
    yield literal
    yield replace(literal, tagged=bool(image.tagged))


def _plain_followers(image: Image, profile: Profile, dwells_of: Callable[..., int]) -> Followers:
    """Return steps that the words may come from; ``dwells_of`` guesses how many words belong to the next one."""
    dwell_ms = profile.dwell_ms[image.dwell_level]
    steps: list[Step] = []
    first_words: list[int] = []
    position = 0
    while position < len(image.followers):
        word = image.followers[position]
        dwells = dwells_of(image.followers[position:], dwell_ms, profile)
        step = step_in(word, profile.durations_ms, dwells * dwell_ms)
        if dwells_of is _driven_through and dwells > 1:
            step = lasting(step, dwells * dwell_ms)
        elif image.tagged and max(durations_in(word, profile.durations_ms)) < dwell_ms:
            step = _resting(step, dwell_ms)
        steps.append(step)
        first_words.append(word)
        position += dwells
    return _followers(steps, first_words, None)


def _counted_down(words: Sequence[int], dwell_ms: int, profile: Profile) -> int:
    """Return how many of the first words are the countdown of one step; 1 where they are no countdown."""
    dwells, rest_ms = divmod(max(durations_in(words[0], profile.durations_ms)), dwell_ms)
    if rest_ms or not 1 < dwells <= len(words):
        return 1
    whole = parts_of(step_in(words[0], profile.durations_ms))
    levels = profile.duration_levels
    first = CONTROL.decode(words[0])
    for number, word in enumerate(words[:dwells]):
        left = slice_of(whole, number * dwell_ms, dwell_ms * dwells)
        if any(duration not in levels for duration in durations_of(left)):
            return 1
        if word != control_word(left, levels, first.accept_ir, first.forward):
            return 1
    return dwells


def _driven_through(words: Sequence[int], dwell_ms: int, profile: Profile) -> int:
    """Return how many of the first words do the same, whatever their durations; 1 where one does several things."""

    def goes_on(word: int) -> bool:
        # LED 0 has no bit but its duration: with it a word does two things.
        is_one = not isinstance(step_in(word, profile.durations_ms), TogetherStep)
        return is_one and not (word ^ words[0]) & ~_DURATIONS

    return max(1, len(list(takewhile(goes_on, words))))


def _resting(step: Step, dwell_ms: int) -> Step:
    """Return a step like that of a tagged word shorter than its dwell: parts that stand still last for the dwell."""
    if isinstance(step, WaitStep | AccompanyingStep):
        return lasting(step, dwell_ms)
    if isinstance(step, TogetherStep):
        parts = (lasting(part, dwell_ms) if isinstance(part, WaitStep) else part for part in step.steps)
        return TogetherStep(tuple(parts))
    return step


def _followers(steps: list[Step], words: Sequence[int], dwell_seconds: float | None) -> Followers:
    """Return Followers with the settings of the first word; steps state only settings that differ."""
    first = CONTROL.decode(words[0])
    accept_ir = bool(first.accept_ir)
    forward = bool(first.forward)
    made = [_with_settings(step, word, accept_ir, forward) for step, word in zip(steps, words, strict=True)]
    return Followers(made, accept_ir, forward, dwell_seconds)


def _with_settings(step: Step, word: int, accept_ir: bool, forward: bool) -> Step:
    """Return a step that states the settings of its word where they differ from those of all followers."""
    values = CONTROL.decode(word)
    if values.accept_ir != accept_ir:
        step = replace(step, accept_ir=bool(values.accept_ir))
    if values.forward != forward:
        step = replace(step, forward=bool(values.forward))
    return step


def _check_word(word: int, position: int, leads: bool, decides: bool) -> None:
    if leads and decides:
        if word >> 31:
            return
        word_format = STATE
        values = STATE.decode(word)
    else:
        word_format = CONTROL
        values = CONTROL.decode(word)
        if leads and values.accept_ir:
            raise DecompileError("leader-word-accepts-ir", position=position, word=word)
    if leads and not values.forward:
        raise DecompileError("leader-word-not-forwarded", position=position, word=word)
    if warnings := word_format.warnings(word):
        raise DecompileError("word-without-step", position=position, word=word, warning=warnings[0])
