"""From an image back to a program that compiles to the same bytes."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from motorcade.config.profile import Profile, built_in_profile
from motorcade.program.compiler import compile_program
from motorcade.program.model import Followers, Program
from motorcade.program.parts import control_word, parts_of, slice_of
from motorcade.program.steps import (
    DIRECTIONS,
    AvoidStep,
    DriveStep,
    LedStep,
    PirStep,
    Step,
    TogetherStep,
    VoiceStep,
    WaitStep,
)
from motorcade.words.formats import CONTROL
from motorcade.words.image import Image, parse_image

# From this bit on: whether a follower listens, and whether it passes the word on.
_SETTINGS_AT = CONTROL.field("forward").low


# The words in braces are filled in per case.
_SENTENCES = {
    "leader-accepts-ir": {
        "en": "word {position} (0x{word:08X}) lets the leader accept infrared, which no leader can",
        "zh": "第 {position} 个码字（0x{word:08X}）让主机接受红外信息，而主机无法这样设置",
    },
    "leader-silent": {
        "en": "word {position} (0x{word:08X}) is a leader's, yet its forward bit is 0",
        "zh": "第 {position} 个码字（0x{word:08X}）属于主机，它的转发位却是 0",
    },
    "says-nothing": {
        "en": "word {position} (0x{word:08X}) says what no step does: {warning}",
        "zh": "第 {position} 个码字（0x{word:08X}）含有任何步骤都不会写入的位：保留位或未启用部分的位不是 0",
    },
}


class DecompileError(ValueError):
    """A valid image that no program compiles to; the sentence names the word.

    Attributes:
        code: short name of the fault, stable.
        figures: what the sentence tells, by name.
    """

    def __init__(self, code: str, **figures: object):
        self.code = code
        self.figures = figures
        super().__init__(self.message("en"))

    def message(self, language: str) -> str:
        """The sentence in ``language`` (en or zh)."""
        return self.sentence(language)

    def sentence(self, language: str = "en") -> str:
        """The sentence in ``language`` (en or zh)."""
        return _SENTENCES[self.code][language].format(**self.figures)


def decompile(words: Sequence[int], profile: Profile | None = None) -> Program:
    """A Program that compiles to these ``words`` (an image, header first).

    Followers' words that the compiler would choose itself become plain steps. Any
    others become one step a word, with their dwell written down.

    Raises:
        ImageError: the words are no image.
        DecompileError: a word holds what no step says, such as a leader that accepts infrared.
    """
    profile = profile or built_in_profile("classroom")
    image = parse_image(tuple(words))
    for position, word in enumerate(image.leader, start=1):
        _check_leader_word(word, position)
    for position, word in enumerate(image.followers, start=1 + len(image.leader)):
        _check_word(word, position)
    leader = [_step(word, profile) for word in image.leader]
    if not image.followers:
        return Program(leader, None, profile.name)
    for guess in (_counted_down, _driven_through):
        plain = Program(leader, _plain_followers(image, profile, guess), profile.name)
        if compile_program(plain, profile).words == tuple(words):
            return plain
    dwell_seconds = _seconds(profile.dwell_ms[image.dwell_level])
    steps = [_step(word, profile) for word in image.followers]
    return Program(leader, _followers(steps, image.followers, dwell_seconds), profile.name)


def _plain_followers(image: Image, profile: Profile, dwells_of: Callable[..., int]) -> Followers:
    """The steps that the words may come from; ``dwells_of`` guesses how many words belong to the next one."""
    dwell_ms = profile.dwell_ms[image.dwell_level]
    steps: list[Step] = []
    first_words: list[int] = []
    position = 0
    while position < len(image.followers):
        word = image.followers[position]
        dwells = dwells_of(image.followers[position:], dwell_ms, profile)
        step = _step(word, profile, dwells * dwell_ms)
        if dwells_of is _driven_through and dwells > 1:
            step = _lasting(step, dwells * dwell_ms)
        steps.append(step)
        first_words.append(word)
        position += dwells
    return _followers(steps, first_words, None)


def _counted_down(words: Sequence[int], dwell_ms: int, profile: Profile) -> int:
    """How many of the first words count one step down; 1 where they count nothing down."""
    length_ms = max(_durations_ms(words[0], profile))
    dwells = length_ms // dwell_ms
    return dwells if length_ms % dwell_ms == 0 and _counts_down(words[:dwells], dwell_ms, profile) else 1


def _driven_through(words: Sequence[int], dwell_ms: int, profile: Profile) -> int:
    """How many of the first words do one and the same thing, however long each says; 1 for several things at once."""
    first = _step(words[0], profile)
    if not isinstance(first, (DriveStep, WaitStep, LedStep, AvoidStep, VoiceStep, PirStep)):
        return 1
    dwells = 1
    for word in words[1:]:
        step = _step(word, profile)
        if type(step) is not type(first) or _lasting(step, 0) != _lasting(first, 0):
            break
        if (word ^ words[0]) >> _SETTINGS_AT:
            break
        dwells += 1
    return dwells


def _counts_down(words: Sequence[int], dwell_ms: int, profile: Profile) -> bool:
    """Whether each of the words, sent for one dwell, says what is left of the first; false for no words."""
    if not words or len(words) * dwell_ms != max(_durations_ms(words[0], profile)):
        return False
    whole = parts_of(_step(words[0], profile))
    levels = {duration: level for level, duration in enumerate(profile.durations_ms)}
    first = CONTROL.decode(words[0])
    for number, word in enumerate(words):
        left = slice_of(whole, number * dwell_ms, dwell_ms * len(words))
        if any(duration not in levels for duration in left.durations_ms):
            return False
        if word != control_word(left, levels, first.accept_ir, first.forward):
            return False
    return True


def _lasting(step: Step, duration_ms: int) -> Step:
    """The same step, of a kind that has seconds, for another time."""
    changes: dict[str, Any] = {"seconds": _seconds(duration_ms)}
    return replace(step, **changes)


def _followers(steps: list[Step], words: Sequence[int], dwell_seconds: float | None) -> Followers:
    """Followers whose common settings are the first step's, and which say where a step differs."""
    first = CONTROL.decode(words[0])
    made = []
    for step, word in zip(steps, words, strict=True):
        values = CONTROL.decode(word)
        accept_ir = None if values.accept_ir == first.accept_ir else bool(values.accept_ir)
        forward = None if values.forward == first.forward else bool(values.forward)
        made.append(replace(step, accept_ir=accept_ir, forward=forward))
    return Followers(made, bool(first.accept_ir), bool(first.forward), dwell_seconds)


def _durations_ms(word: int, profile: Profile) -> tuple[int, int, int]:
    """How long the word's motor, LED and avoidance last; 0 for one that it hasn't."""
    values = CONTROL.decode(word)
    return (
        profile.durations_ms[values.motor_duration],
        profile.durations_ms[values.led_duration],
        profile.durations_ms[values.avoid_duration],
    )


def _step(word: int, profile: Profile, longest_ms: int | None = None) -> Step:
    """The step that ``word`` does, its blocks cut to ``longest_ms``."""
    values = CONTROL.decode(word)
    motor_s, led_s, avoid_s = (
        _seconds(duration if longest_ms is None else min(duration, longest_ms))
        for duration in _durations_ms(word, profile)
    )
    parts: list[Step] = []
    waits = values.motor_enable and values.motor_direction == 0 and values.motor_speed == 0
    if waits:
        parts.append(WaitStep(motor_s))
    elif values.motor_enable:
        parts.append(DriveStep(DIRECTIONS[values.motor_direction], values.motor_speed, motor_s))
    if values.led_which or values.led_duration:
        parts.append(LedStep(values.led_which, led_s))
    if values.avoid_enable:
        parts.append(AvoidStep(values.avoid_radius, avoid_s))
    if len(parts) == 1 and not values.voice and not values.pir:
        return parts[0]
    if len(parts) == 1 and waits and not (values.voice and values.pir):
        return VoiceStep(motor_s) if values.voice else PirStep(motor_s)
    if values.voice:
        parts.append(VoiceStep())
    if values.pir:
        parts.append(PirStep())
    return TogetherStep(tuple(parts))


def _seconds(duration_ms: int) -> float:
    return duration_ms // 1000 if duration_ms % 1000 == 0 else duration_ms / 1000


def _check_leader_word(word: int, position: int) -> None:
    values = CONTROL.decode(word)
    if values.accept_ir:
        raise DecompileError("leader-accepts-ir", position=position, word=word)
    if not values.forward:
        raise DecompileError("leader-silent", position=position, word=word)
    _check_word(word, position)


def _check_word(word: int, position: int) -> None:
    if warnings := CONTROL.warnings(word):
        raise DecompileError("says-nothing", position=position, word=word, warning=warnings[0])
