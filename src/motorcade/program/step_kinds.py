"""The kinds of steps that devices declare.

Written by scripts/generate.py from `motorcade.devices`; don't edit.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

from motorcade.program.step import AccompanyingStep, Step


@dataclass(frozen=True, slots=True)
class DriveStep(Step):
    """Drive or turn for some seconds; speed level 0 stands still, 3 is fastest (c3)."""

    kind: ClassVar[str] = "drive"
    direction: str
    speed: int
    seconds: float


@dataclass(frozen=True, slots=True)
class WaitStep(Step):
    """Stand still for some seconds (c3 at speed 0)."""

    kind: ClassVar[str] = "wait"
    seconds: float


@dataclass(frozen=True, slots=True)
class LedStep(Step):
    """Light one of the LEDs 0 to 3 for some seconds (c4)."""

    kind: ClassVar[str] = "led"
    which: int
    seconds: float


@dataclass(frozen=True, slots=True)
class AvoidStep(Step):
    """Avoid obstacles nearer than radius level 0 to 3 for some seconds (c5)."""

    kind: ClassVar[str] = "avoid"
    radius: int
    seconds: float


@dataclass(frozen=True, slots=True)
class VoiceStep(AccompanyingStep):
    """Listen for 'stop' and 'go' (c6)."""

    kind: ClassVar[str] = "voice"


@dataclass(frozen=True, slots=True)
class PirStep(AccompanyingStep):
    """Stand still while a person is sensed (c7)."""

    kind: ClassVar[str] = "pir"


@dataclass(frozen=True, slots=True)
class FollowLineStep(Step):
    """Drive along a dark line for some seconds (c3 forward with the bit floor)."""

    kind: ClassVar[str] = "follow_line"
    speed: int
    seconds: float


@dataclass(frozen=True, slots=True)
class TurnToLineStep(Step):
    """Turn until a line is under the car, then stand (c3 left or right with the bit floor)."""

    kind: ClassVar[str] = "turn_to_line"
    direction: str
    speed: int
    seconds: float


@dataclass(frozen=True, slots=True)
class StopOnDarkStep(Step):
    """Drive on with random turns, but stand on a dark floor (c3 random with the bit floor)."""

    kind: ClassVar[str] = "stop_on_dark"
    speed: int
    seconds: float


@dataclass(frozen=True, slots=True)
class FloorStep(AccompanyingStep):
    """Mind the floor: what the motor does beside it obeys dark and light (the bit floor)."""

    kind: ClassVar[str] = "floor"


SIMPLE_KINDS: tuple[type[Step], ...] = (
    DriveStep,
    WaitStep,
    LedStep,
    AvoidStep,
    VoiceStep,
    PirStep,
    FollowLineStep,
    TurnToLineStep,
    StopOnDarkStep,
    FloorStep,
)

# Where the class itself reads well, it is the name.
wait = WaitStep
led = LedStep
avoid = AvoidStep
voice = VoiceStep
pir = PirStep
floor = FloorStep


def forward(seconds: float, speed: int = 2, **more: Any) -> DriveStep:
    """Drive straight on."""
    return DriveStep("forward", speed, seconds, **more)


def left(seconds: float, speed: int = 2, **more: Any) -> DriveStep:
    """Turn left on the spot."""
    return DriveStep("left", speed, seconds, **more)


def right(seconds: float, speed: int = 2, **more: Any) -> DriveStep:
    """Turn right on the spot."""
    return DriveStep("right", speed, seconds, **more)


def wander(seconds: float, speed: int = 2, **more: Any) -> DriveStep:
    """Drive on with random turns."""
    return DriveStep("random", speed, seconds, **more)


def follow_line(seconds: float, speed: int = 2, **more: Any) -> FollowLineStep:
    """Drive along a dark line."""
    return FollowLineStep(speed, seconds, **more)


def turn_left_to_line(seconds: float, speed: int = 2, **more: Any) -> TurnToLineStep:
    """Turn left to a line."""
    return TurnToLineStep("left", speed, seconds, **more)


def turn_right_to_line(seconds: float, speed: int = 2, **more: Any) -> TurnToLineStep:
    """Turn right to a line."""
    return TurnToLineStep("right", speed, seconds, **more)


def stop_on_dark(seconds: float, speed: int = 2, **more: Any) -> StopOnDarkStep:
    """Drive on with random turns, but stand on dark."""
    return StopOnDarkStep(speed, seconds, **more)
