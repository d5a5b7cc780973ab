"""The kinds of steps that devices declare.

Written by scripts/generate.py from `motorcade.devices`; don't edit.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

from motorcade.program.step import AccompanyingStep, Step, chosen, lasting, level


@dataclass(frozen=True, slots=True)
class DriveStep(Step):
    """Drive or turn for some seconds; speed level 0 stands still, 3 is fastest (c3)."""

    kind: ClassVar[str] = "drive"
    in_start: ClassVar[bool] = True
    names: ClassVar[dict[str, dict[str, str]]] = {
        "forward": {"direction": "forward"},
        "left": {"direction": "left"},
        "right": {"direction": "right"},
        "wander": {"direction": "random"},
    }
    category: ClassVar[str] = "drive"
    icon: ClassVar[str] = "M4 15v-3l3-5h8l4 5h1v3zM7 15a2 2 0 1 0 0 4 2 2 0 0 0 0-4ZM17 15a2 2 0 1 0 0 4 2 2 0 0 0 0-4Z"
    group: ClassVar[str] = "motor"
    hue: ClassVar[int] = 219
    sets: ClassVar[dict[str, int]] = {"motor_enable": 1}
    direction: str = chosen("motor_direction", ("forward", "left", "right", "random"))
    speed: int = level("motor_speed", "speed", first=2)
    seconds: float = lasting("motor_duration")


@dataclass(frozen=True, slots=True)
class WaitStep(Step):
    """Stand still for some seconds (c3 at speed 0)."""

    kind: ClassVar[str] = "wait"
    in_start: ClassVar[bool] = True
    names: ClassVar[dict[str, dict[str, str]]] = {"wait": {}}
    category: ClassVar[str] = "drive"
    icon: ClassVar[str] = "M7 3h10M7 21h10M8 3c0 5 8 5 8 9s-8 4-8 9M16 3c0 5-8 5-8 9s8 4 8 9"
    group: ClassVar[str] = "motor"
    hue: ClassVar[int] = 219
    sets: ClassVar[dict[str, int]] = {"motor_enable": 1, "motor_direction": 0, "motor_speed": 0}
    seconds: float = lasting("motor_duration")


@dataclass(frozen=True, slots=True)
class LedStep(Step):
    """Light one of the LEDs 0 to 3 for some seconds (c4)."""

    kind: ClassVar[str] = "led"
    in_start: ClassVar[bool] = True
    names: ClassVar[dict[str, dict[str, str]]] = {"led": {}}
    category: ClassVar[str] = "light"
    icon: ClassVar[str] = "M9 18h6M10 21h4M12 3a6 6 0 0 0-3.500 10.900V16h7v-2.100A6 6 0 0 0 12 3Z"
    group: ClassVar[str] = "led"
    hue: ClassVar[int] = 41
    which: int = level("led_which", "light")
    seconds: float = lasting("led_duration")


@dataclass(frozen=True, slots=True)
class AvoidStep(Step):
    """Avoid obstacles nearer than radius level 0 to 3 for some seconds (c5)."""

    kind: ClassVar[str] = "avoid"
    names: ClassVar[dict[str, dict[str, str]]] = {"avoid": {}}
    category: ClassVar[str] = "sense"
    icon: ClassVar[str] = "M12 3l8 3v6c0 5-4 8-8 9-4-1-8-4-8-9V6zM9 9l6 6M15 9l-6 6"
    group: ClassVar[str] = "avoid"
    hue: ClassVar[int] = 166
    sets: ClassVar[dict[str, int]] = {"avoid_enable": 1}
    radius: int = level("avoid_radius", "radius")
    seconds: float = lasting("avoid_duration")


@dataclass(frozen=True, slots=True)
class VoiceStep(AccompanyingStep):
    """Listen for 'stop' and 'go' (c6)."""

    kind: ClassVar[str] = "voice"
    in_start: ClassVar[bool] = True
    names: ClassVar[dict[str, dict[str, str]]] = {"voice": {}}
    category: ClassVar[str] = "sense"
    icon: ClassVar[str] = "M12 3a3 3 0 0 0-3 3v6a3 3 0 0 0 6 0V6a3 3 0 0 0-3-3ZM6 11a6 6 0 0 0 12 0M12 17v4M9 21h6"
    group: ClassVar[str] = "voice"
    hue: ClassVar[int] = 263
    sets: ClassVar[dict[str, int]] = {"voice": 1}


@dataclass(frozen=True, slots=True)
class PirStep(AccompanyingStep):
    """Stand still while a person is sensed (c7)."""

    kind: ClassVar[str] = "pir"
    names: ClassVar[dict[str, dict[str, str]]] = {"pir": {}}
    category: ClassVar[str] = "sense"
    icon: ClassVar[str] = "M12 4a3 3 0 1 0 0 6 3 3 0 0 0 0-6ZM5.500 20a6.500 6.500 0 0 1 13 0"
    group: ClassVar[str] = "pir"
    hue: ClassVar[int] = 22
    sets: ClassVar[dict[str, int]] = {"pir": 1}


@dataclass(frozen=True, slots=True)
class FollowLineStep(Step):
    """Drive along a dark line for some seconds (c3 forward with the bit floor)."""

    kind: ClassVar[str] = "follow_line"
    names: ClassVar[dict[str, dict[str, str]]] = {"follow_line": {}}
    category: ClassVar[str] = "sense"
    icon: ClassVar[str] = "M5 21c0-7 14-7 14-13V3M9 3h10M9 21H1"
    group: ClassVar[str] = "motor"
    hue: ClassVar[int] = 95
    sets: ClassVar[dict[str, int]] = {"motor_enable": 1, "motor_direction": 0, "floor": 1}
    speed: int = level("motor_speed", "speed", first=2, least=1)
    seconds: float = lasting("motor_duration")


@dataclass(frozen=True, slots=True)
class TurnToLineStep(Step):
    """Turn until a line is under the car, then stand (c3 left or right with the bit floor)."""

    kind: ClassVar[str] = "turn_to_line"
    names: ClassVar[dict[str, dict[str, str]]] = {
        "turn_left_to_line": {"direction": "left"},
        "turn_right_to_line": {"direction": "right"},
    }
    category: ClassVar[str] = "sense"
    icon: ClassVar[str] = "M6 21V9a5 5 0 0 1 10 0v2M12 8l4 4 4-4M3 21h18"
    group: ClassVar[str] = "motor"
    hue: ClassVar[int] = 95
    sets: ClassVar[dict[str, int]] = {"motor_enable": 1, "floor": 1}
    direction: str = chosen("motor_direction", ("left", "right"), least=1)
    speed: int = level("motor_speed", "speed", first=2, least=1)
    seconds: float = lasting("motor_duration")


@dataclass(frozen=True, slots=True)
class StopOnDarkStep(Step):
    """Drive on with random turns, but stand on a dark floor (c3 random with the bit floor)."""

    kind: ClassVar[str] = "stop_on_dark"
    names: ClassVar[dict[str, dict[str, str]]] = {"stop_on_dark": {}}
    category: ClassVar[str] = "sense"
    icon: ClassVar[str] = "M4 8h10l6 4-6 4H4zM12 21a9 3 0 0 1 0-6"
    group: ClassVar[str] = "motor"
    hue: ClassVar[int] = 95
    sets: ClassVar[dict[str, int]] = {"motor_enable": 1, "motor_direction": 3, "floor": 1}
    speed: int = level("motor_speed", "speed", first=2, least=1)
    seconds: float = lasting("motor_duration")


@dataclass(frozen=True, slots=True)
class FloorStep(AccompanyingStep):
    """Mind the floor: what the motor does beside it obeys dark and light (the bit floor)."""

    kind: ClassVar[str] = "floor"
    names: ClassVar[dict[str, dict[str, str]]] = {"floor": {}}
    category: ClassVar[str] = "sense"
    icon: ClassVar[str] = "M4 20h16M8 4v9M16 4v9M6 13h4M14 13h4"
    group: ClassVar[str] = "floor"
    hue: ClassVar[int] = 95
    sets: ClassVar[dict[str, int]] = {"floor": 1}


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


__all__ = [
    "SIMPLE_KINDS",
    "AvoidStep",
    "DriveStep",
    "FloorStep",
    "FollowLineStep",
    "LedStep",
    "PirStep",
    "StopOnDarkStep",
    "TurnToLineStep",
    "VoiceStep",
    "WaitStep",
    "avoid",
    "floor",
    "follow_line",
    "forward",
    "led",
    "left",
    "pir",
    "right",
    "stop_on_dark",
    "turn_left_to_line",
    "turn_right_to_line",
    "voice",
    "wait",
    "wander",
]
