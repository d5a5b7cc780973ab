"""Turn an image back into a program that compiles to the same bytes."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import takewhile
from typing import Any

from motorcade.config.profile import Profile, built_in_profile
from motorcade.errors import MotorcadeError
from motorcade.program.compiler import compile_program
from motorcade.program.model import Followers, Program
from motorcade.program.parts import (
    control_word,
    durations_in,
    durations_of,
    parts_of,
    slice_of,
    step_in,
    to_seconds,
)
from motorcade.program.steps import AccompanyingStep, Step, TogetherStep, WaitStep
from motorcade.words.formats import CONTROL
from motorcade.words.image import Image, parse_image

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
        _check_word(word, position, leads=position <= len(image.leader))
    leader = [step_in(word, profile.durations_ms) for word in image.leader]
    if not image.followers:
        return Program(leader, None, profile.name)
    # The last guess always compiles to the same words.
    return next(
        program
        for followers in _guessed_followers(image, profile)
        if compile_program(program := Program(leader, followers, profile.name), profile).words == tuple(words)
    )


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
            step = _lasting(step, dwells * dwell_ms)
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
    levels = {duration: level for level, duration in enumerate(profile.durations_ms)}
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


def _lasting(step: Step, duration_ms: int) -> Step:
    """Return the same step, of a kind that has seconds, with another duration."""
    changes: dict[str, Any] = {"seconds": to_seconds(duration_ms)}
    return replace(step, **changes)


def _resting(step: Step, dwell_ms: int) -> Step:
    """Return a step like that of a tagged word shorter than its dwell: parts that stand still last for the dwell."""
    if isinstance(step, WaitStep | AccompanyingStep):
        return _lasting(step, dwell_ms)
    if isinstance(step, TogetherStep):
        parts = (_lasting(part, dwell_ms) if isinstance(part, WaitStep) else part for part in step.steps)
        return TogetherStep(tuple(parts))
    return step


def _followers(steps: list[Step], words: Sequence[int], dwell_seconds: float | None) -> Followers:
    """Return Followers with the settings of the first word; steps state only settings that differ."""
    first = CONTROL.decode(words[0])
    made = []
    for step, word in zip(steps, words, strict=True):
        values = CONTROL.decode(word)
        if values.accept_ir != first.accept_ir:
            step = replace(step, accept_ir=bool(values.accept_ir))
        if values.forward != first.forward:
            step = replace(step, forward=bool(values.forward))
        made.append(step)
    return Followers(made, bool(first.accept_ir), bool(first.forward), dwell_seconds)


def _check_word(word: int, position: int, leads: bool) -> None:
    values = CONTROL.decode(word)
    if leads and values.accept_ir:
        raise DecompileError("leader-word-accepts-ir", position=position, word=word)
    if leads and not values.forward:
        raise DecompileError("leader-word-not-forwarded", position=position, word=word)
    if warnings := CONTROL.warnings(word):
        raise DecompileError("word-without-step", position=position, word=word, warning=warnings[0])
