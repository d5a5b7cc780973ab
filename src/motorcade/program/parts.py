"""A step as the blocks of a control word, with their durations."""

from typing import NamedTuple

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
from motorcade.program.timing import to_ms
from motorcade.words.formats import CONTROL

_encode = CONTROL.encode
_DIRECTION_OF = {name: number for number, name in enumerate(DIRECTIONS)}


class Motor(NamedTuple):
    """c3: direction 0-3, speed level, how long."""

    direction: int
    speed: int
    duration_ms: int


class Light(NamedTuple):
    """c4: which LED, how long."""

    which: int
    duration_ms: int


class Avoidance(NamedTuple):
    """c5: radius level, how long."""

    radius: int
    duration_ms: int


class Parts(NamedTuple):
    """All that one step does at once."""

    motor: Motor | None = None
    light: Light | None = None
    guard: Avoidance | None = None
    voice: bool = False
    pir: bool = False

    @property
    def durations_ms(self) -> tuple[int, ...]:
        """How long each block that there is lasts."""
        return tuple([block.duration_ms for block in (self.motor, self.light, self.guard) if block is not None])


def parts_of(step: Step) -> Parts:
    """The Parts of a step that is no Repeat, has no two parts of one kind and lasts whole milliseconds."""
    motor = light = guard = None
    voice = pir = False
    for part in step.steps if isinstance(step, TogetherStep) else (step,):
        if isinstance(part, DriveStep):
            motor = Motor(_DIRECTION_OF[part.direction], part.speed, _ms(part.seconds))
        elif isinstance(part, LedStep):
            light = Light(part.which, _ms(part.seconds))
        elif isinstance(part, AvoidStep):
            guard = Avoidance(part.radius, _ms(part.seconds))
        elif isinstance(part, WaitStep):
            motor = Motor(0, 0, _ms(part.seconds))
        elif isinstance(part, (VoiceStep, PirStep)):
            voice = voice or isinstance(part, VoiceStep)
            pir = pir or isinstance(part, PirStep)
            if part.seconds is not None:
                motor = Motor(0, 0, _ms(part.seconds))
    return Parts(motor, light, guard, voice, pir)


def slice_of(parts: Parts, begin_ms: int, length_ms: int) -> Parts:
    """What of ``parts`` falls into the piece that begins at ``begin_ms``.

    A block that is over by then is gone; one that lasts no time is in the first piece.
    """
    motor, light, guard, voice, pir = parts
    if motor is not None:
        left = motor[2] - begin_ms
        motor = Motor(motor[0], motor[1], min(left, length_ms)) if left > 0 or begin_ms == 0 else None
    if light is not None:
        left = light[1] - begin_ms
        light = Light(light[0], min(left, length_ms)) if left > 0 or begin_ms == 0 else None
    if guard is not None:
        left = guard[1] - begin_ms
        guard = Avoidance(guard[0], min(left, length_ms)) if left > 0 or begin_ms == 0 else None
    return Parts(motor, light, guard, voice, pir)


def control_word(parts: Parts, levels: dict[int, int], accept_ir: int, forward: int) -> int:
    """The control word of ``parts``, each duration of which is a key of ``levels`` (ms -> level).

    Raises:
        KeyError: a duration is no level.
    """
    motor, light, guard, voice, pir = parts
    direction = speed = motor_level = which = light_level = radius = guard_level = 0
    if motor is not None:
        direction, speed, motor_level = motor[0], motor[1], levels[motor[2]]
    if light is not None:
        which, light_level = light[0], levels[light[1]]
    if guard is not None:
        radius, guard_level = guard[0], levels[guard[1]]
    return int(
        _encode(
            accept_ir,
            forward,
            0 if motor is None else 1,
            direction,
            speed,
            motor_level,
            which,
            light_level,
            0 if guard is None else 1,
            radius,
            guard_level,
            1 if voice else 0,
            1 if pir else 0,
        )
    )


def _ms(seconds: float) -> int:
    duration_ms = to_ms(seconds)
    if duration_ms is None:
        raise ValueError(f"{seconds} s are no whole milliseconds")
    return duration_ms
