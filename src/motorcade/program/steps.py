"""The steps that a program is made of, and the short names to write them with in Python.

Each step's fields and ranges are declared here once; the JSON Schema and the
checks come from these declarations. Sources: seed 000, c3-c7.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, fields
from functools import cache
from typing import Any, ClassVar

from motorcade.words.formats import CONTROL

DIRECTIONS = ("forward", "left", "right", "random")


def _level(field_name: str) -> dict[str, Any]:
    control_field = CONTROL.field(field_name)
    return {"schema": {"type": "integer", "minimum": control_field.minimum, "maximum": control_field.maximum}}


_TYPES = {"boolean": bool, "string": str}
LONGEST_S = 86400
SHORTEST_DWELL_S = 0.001
SECONDS = {"type": "number", "minimum": 0, "maximum": LONGEST_S}


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """What every step may carry.

    Attributes:
        id: the block that it came from.
        accept_ir, forward: for a follower's step only; None takes what the followers' program says.
    """

    kind: ClassVar[str] = ""
    id: str | None = field(default=None, metadata={"schema": {"type": "string"}})
    accept_ir: bool | None = field(default=None, metadata={"schema": {"type": "boolean"}})
    forward: bool | None = field(default=None, metadata={"schema": {"type": "boolean"}})

    def __post_init__(self) -> None:
        own: Any = type(self)
        for name, schema, optional in _declared(own):
            value = getattr(self, name)
            if not (value is None and optional) and not _fits(value, schema):
                raise ValueError(f"{self.kind}: {name} is {value!r}; allowed: {_allowed(schema)}")

    @classmethod
    def own_schemas(cls) -> dict[str, dict[str, Any]]:
        """The JSON Schema of each field that this kind has beyond those of every step."""
        common = {each.name for each in fields(Step)}
        own = [each for each in fields(cls) if each.name not in common and "schema" in each.metadata]
        return {each.name: each.metadata["schema"] for each in own}


@dataclass(frozen=True, slots=True)
class DriveStep(Step):
    """Drive or turn for some seconds; speed level 0 stands still, 3 is fastest (c3)."""

    kind: ClassVar[str] = "drive"
    direction: str = field(metadata={"schema": {"enum": list(DIRECTIONS)}})
    speed: int = field(metadata=_level("motor_speed"))
    seconds: float = field(metadata={"schema": SECONDS})


@dataclass(frozen=True, slots=True)
class WaitStep(Step):
    """Stand still for some seconds (c3 at speed 0)."""

    kind: ClassVar[str] = "wait"
    seconds: float = field(metadata={"schema": SECONDS})


@dataclass(frozen=True, slots=True)
class LedStep(Step):
    """Light one of the LEDs 0 to 3 for some seconds (c4)."""

    kind: ClassVar[str] = "led"
    which: int = field(metadata=_level("led_which"))
    seconds: float = field(metadata={"schema": SECONDS})


@dataclass(frozen=True, slots=True)
class AvoidStep(Step):
    """Avoid obstacles nearer than radius level 0 to 3 for some seconds (c5)."""

    kind: ClassVar[str] = "avoid"
    radius: int = field(metadata=_level("avoid_radius"))
    seconds: float = field(metadata={"schema": SECONDS})


@dataclass(frozen=True, slots=True)
class VoiceStep(Step):
    """Listen for 'stop' and 'go' (c6): as part of a together, or standing still for some seconds."""

    kind: ClassVar[str] = "voice"
    seconds: float | None = field(default=None, metadata={"schema": SECONDS})


@dataclass(frozen=True, slots=True)
class PirStep(Step):
    """Stand still while a person is sensed (c7): as part of a together, or for some seconds."""

    kind: ClassVar[str] = "pir"
    seconds: float | None = field(default=None, metadata={"schema": SECONDS})


@dataclass(frozen=True, slots=True)
class TogetherStep(Step):
    """Steps of different kinds that start at once; lasts as long as its longest."""

    kind: ClassVar[str] = "together"
    steps: tuple[Step, ...]

    def __post_init__(self) -> None:
        Step.__post_init__(self)
        for part in as_steps(self.steps):
            if part.accept_ir is not None or part.forward is not None:
                raise ValueError("together: accept_ir and forward belong to the whole of it, not to a part")
            if isinstance(part, (TogetherStep, RepeatStep)):
                raise ValueError(f"together: {part.kind} can't be part of it")
            if isinstance(part, (VoiceStep, PirStep)) and part.seconds is not None:
                raise ValueError(f"together: {part.kind} lasts as long as the others, so it takes no seconds here")


@dataclass(frozen=True, slots=True)
class RepeatStep(Step):
    """Steps done over and over."""

    kind: ClassVar[str] = "repeat"
    times: int = field(metadata={"schema": {"type": "integer", "minimum": 1, "maximum": 1_000_000_000}})
    steps: tuple[Step, ...]

    def __post_init__(self) -> None:
        Step.__post_init__(self)
        as_steps(self.steps)


SIMPLE_KINDS: tuple[type[Step], ...] = (DriveStep, WaitStep, LedStep, AvoidStep, VoiceStep, PirStep)
ALL_KINDS: tuple[type[Step], ...] = (*SIMPLE_KINDS, TogetherStep, RepeatStep)
KINDS = {kind.kind: kind for kind in ALL_KINDS}


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


def wait(seconds: float, **more: Any) -> WaitStep:
    """Stand still."""
    return WaitStep(seconds, **more)


def led(which: int, seconds: float, **more: Any) -> LedStep:
    """Light LED 0 to 3."""
    return LedStep(which, seconds, **more)


def avoid(radius: int, seconds: float, **more: Any) -> AvoidStep:
    """Keep away from obstacles; radius is level 0 to 3."""
    return AvoidStep(radius, seconds, **more)


def voice(seconds: float | None = None, **more: Any) -> VoiceStep:
    """Listen for 'stop' and 'go'."""
    return VoiceStep(seconds, **more)


def pir(seconds: float | None = None, **more: Any) -> PirStep:
    """Stand still while a person is sensed."""
    return PirStep(seconds, **more)


def together(*steps: Step, **more: Any) -> TogetherStep:
    """Start these at once."""
    return TogetherStep(steps, **more)


def repeat(times: int, *steps: Step, **more: Any) -> RepeatStep:
    """Do these so many times."""
    return RepeatStep(times, steps, **more)


def as_steps(steps: Iterable[Step]) -> tuple[Step, ...]:
    """``steps`` as a tuple. Raises TypeError that names what is no step."""
    if isinstance(steps, Step):
        raise TypeError(f"{steps.kind} stands alone; put steps into a list, such as [forward(3), left(1)]")
    made = tuple(steps)
    for position, step in enumerate(made):
        if not isinstance(step, Step):
            raise TypeError(f"step {position + 1} is {step!r}; write forward(3), led(0, 1), together(...) and so on")
    return made


@cache
def _declared(kind: Any) -> tuple[tuple[str, dict[str, Any], bool], ...]:
    """Each checked field of a kind: its name, its schema, and whether it may be None."""
    checked = [each for each in fields(kind) if "schema" in each.metadata]
    return tuple((each.name, each.metadata["schema"], each.default is None) for each in checked)


def _fits(value: Any, schema: dict[str, Any]) -> bool:
    if "enum" in schema:
        return value in schema["enum"]
    if schema["type"] in _TYPES:
        return isinstance(value, _TYPES[schema["type"]])
    number = (int, float) if schema["type"] == "number" else int
    if not isinstance(value, number) or isinstance(value, bool):
        return False
    return bool(schema["minimum"] <= value <= schema["maximum"])


def _allowed(schema: dict[str, Any]) -> str:
    if "enum" in schema:
        return ", ".join(schema["enum"])
    if schema["type"] in _TYPES:
        return {"boolean": "True or False", "string": "text"}[schema["type"]]
    return f"{schema['minimum']} to {schema['maximum']}"
