"""What the blocks of a program mean, written from their definition alone: the oracle for compiler and cars."""

from collections.abc import Iterator, Sequence

from motorcade.devices.motor import DIRECTIONS
from motorcade.program.steps import (
    DriveStep,
    FollowLineStep,
    LedStep,
    RepeatStep,
    Step,
    TogetherStep,
    TurnToLineStep,
)
from support.plain_world import PlainWorld

STILL = (0, 0)
DARK = 4
RANDOM = DIRECTIONS.index("random")

_DRIVES = (DriveStep, FollowLineStep, TurnToLineStep)
# Where the floor has no marks, these drive in one direction.
_ON_LIGHT: dict[type[Step], str] = {FollowLineStep: "forward"}

# What a car does at one moment: (direction, speed level) of its wheels, and the LED that is lit.
Moment = tuple[tuple[int, int], int]


def unrolled(steps: Sequence[Step], path: str) -> Iterator[tuple[str, Step]]:
    """The steps in the order of execution, each with its place."""
    for position, step in enumerate(steps):
        place = f"{path}[{position}]"
        if isinstance(step, RepeatStep):
            for _ in range(step.times or 1):
                yield from unrolled(step.steps, f"{place}.repeat.steps")
        else:
            yield place, step


def length_ms(step: Step, idle_ms: int) -> int:
    """How long a step lasts: as long as its longest part."""
    return max((_ms(part) for part in _parts(step)), default=0) or idle_ms


def moments(steps: Sequence[Step], idle_ms: int) -> list[Moment]:
    """What the blocks of one round mean, millisecond by millisecond."""
    shown: list[Moment] = []
    for _, step in unrolled(steps, ""):
        drive = next((part for part in _parts(step) if isinstance(part, _DRIVES) and part.speed), None)
        led = next((part for part in _parts(step) if isinstance(part, LedStep)), None)
        for at_ms in range(length_ms(step, idle_ms)):
            wheels, lit = STILL, DARK
            if drive is not None and at_ms < _ms(drive):
                wheels = DIRECTIONS.index(_ON_LIGHT.get(type(drive)) or getattr(drive, "direction", "")), drive.speed
            if led is not None and at_ms < _ms(led):
                lit = led.which
            shown.append((wheels, lit))
    return shown


def watch(world: PlainWorld, car: int, ticks: int) -> list[Moment]:
    """What a car of the plain world does in each tick."""
    shown = []
    for _ in range(ticks):
        world.step()
        board = world.boards[car]
        shown.append(((board.direction, board.speed_level), board.led))
    return shown


def agrees(shown: tuple[int, int], said: tuple[int, int]) -> bool:
    """Whether the wheels do what a block says; a random direction may be any direction."""
    return shown == said or (said[0] == RANDOM and shown[1] == said[1] and shown[0] != RANDOM)


def _parts(step: Step) -> Sequence[Step]:
    return step.steps if isinstance(step, TogetherStep) else (step,)


def _ms(step: Step) -> int:
    return round((getattr(step, "seconds", None) or 0) * 1000)
