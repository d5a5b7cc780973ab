"""All kinds of steps: those that devices declare, and those that hold other steps.

A kind is a frozen dataclass. Each of its own fields has a JSON Schema (``schema``) and the field of the control word
that its value goes into (``word``); the class attributes hold the rest. The kinds that devices declare take all this
from `motorcade.devices`. These are made from the classes: the schema of project files and the checks (`program.model`),
the bits of a word and the step that a word holds (`program.parts`), the blocks of the page and the table in
docs/programs.md (`scripts/step_files.py`).
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar

from motorcade.config.arguments import plain
from motorcade.config.check import Schema, allowed, choice, fits, flag, number, whole
from motorcade.devices import DEVICES
from motorcade.devices.declaration import Input
from motorcade.program.conditions import Condition, alternatives, any_of
from motorcade.words.formats import CONTROL

LONGEST_S = 86400
SHORTEST_DWELL_S = 0.001
SECONDS = number(0, LONGEST_S)
# What a step of any kind may have.
COMMON: dict[str, Schema] = {"id": {"type": "string"}, "accept_ir": flag(), "forward": flag()}


_DECLARED = {step.kind: (device, step) for device in DEVICES for step in device.steps}


def _field_of(chosen: Input) -> Any:
    """The field of a dataclass for what is chosen in a step."""
    about: dict[str, Any] = {"word": chosen.bits}
    if chosen.options:
        about |= {"schema": choice(*chosen.options), "least": chosen.least}
    elif chosen.menu:
        schema = whole(chosen.least, CONTROL.field(chosen.bits).maximum)
        about |= {"schema": schema, "menu": chosen.menu, "first": chosen.first, "least": chosen.least}
    else:
        return field(default=None, metadata={**about, "schema": SECONDS})
    return field(metadata=about)


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """What every step may have.

    Attributes:
        id: the block that it came from.
        accept_ir, forward: for a follower's step only; None takes the setting of the followers' program.
        until: the condition that ends a leader's step early, or the repetitions of a repeat.
        kind: the kind's name in JSON, in a block's type and in locales: ``follow_line`` for the class FollowLineStep.
        names: its names in Python, a class or functions of this module, each with the fields that the name decides.
        group: the part of a control word that it fills; a car has one of each, so two steps of one group can't start
            together.
        sets: fields of the control word that are the same in every step of the kind.
        in_start: whether the page's first level, with few kinds of blocks, has its block.
        inside_at: the names of its lists of steps, each with where that stands below the step's own place.
        decides: the kind is for a leader that decides, and its block holds no seconds.
        minds: what a drive senses that has the step's bits in its word, as a condition of its ``unless``.
        accompanies: the step has a bit of the word but no duration of its own. In a together it lasts as long as the
            steps beside it. Alone it has ``seconds``, for which the car stands still.
    """

    kind: ClassVar[str] = ""
    names: ClassVar[dict[str, dict[str, str]]] = {}
    group: ClassVar[str] = ""
    sets: ClassVar[dict[str, int]] = {}
    in_start: ClassVar[bool] = False
    inside_at: ClassVar[dict[str, str]] = {}
    decides: ClassVar[bool] = False
    minds: ClassVar[str] = ""
    accompanies: ClassVar[bool] = False
    id: str | None = None
    accept_ir: bool | None = None
    forward: bool | None = None
    until: Condition | None = None

    def __init_subclass__(cls) -> None:
        """Name the kind, and give one that a device declares its attributes, and its fields their schemas."""
        # A dataclass with slots is made twice; the second time all is done.
        if "__dataclass_fields__" in vars(cls):
            return
        cls.kind = re.sub("(?<=[a-z])(?=[A-Z])", "_", cls.__name__.removesuffix("Step")).lower()
        cls.names = {cls.kind: {}}
        if cls.kind not in _DECLARED:
            return
        device, declared = _DECLARED[cls.kind]
        cls.names = {call.name: dict(call.sets) for call in declared.calls} or cls.names
        cls.group = declared.group or device.group
        cls.sets = dict(declared.sets)
        cls.in_start = declared.block.in_start
        cls.minds = declared.minds
        for chosen in declared.inputs:
            if chosen.bits:
                setattr(cls, chosen.name, _field_of(chosen))

    @property
    def lists(self) -> dict[str, tuple["Step", ...]]:
        """Its lists of steps, by their names."""
        return {name: getattr(self, name) for name in self.inside_at}

    @property
    def inside(self) -> tuple["Step", ...]:
        """The steps inside it; none in a step that holds none."""
        return tuple(step for steps in self.lists.values() for step in steps)

    @classmethod
    def of_checked(cls, values: dict[str, Any]) -> "Step":
        """Return a step of values that fit already: to check a large program again takes a fifth of its time."""
        step = object.__new__(cls)
        for name, default in _values_of(cls):
            object.__setattr__(step, name, values.get(name, default))
        return step

    def __post_init__(self) -> None:
        for name, schema in COMMON.items():
            if getattr(self, name) is not None:
                check_field(self, self.kind, name, schema)
        for own in own_fields(type(self)):
            if getattr(self, own.name) is not None or own.default is not None:
                check_field(self, self.kind, own.name, own.metadata["schema"])
        if self.until is not None and (self.decides or not isinstance(self.until, Condition)):
            raise ValueError(f"{self.kind}: until is {self.until!r}; allowed: a condition, where the step takes time")


def check_field(made: object, what: str, name: str, schema: Schema) -> None:
    """Check what Python code gave for a field of ``made``, and keep it as Python's own number where it is one.

    Raises ValueError, which says ``what`` was made, unless it fits the schema of files.
    """
    given = getattr(made, name)
    value = plain(given)
    if isinstance(value, float) and value.is_integer() and schema.get("type") == "integer":
        value = int(value)
    if not fits(value, schema):
        raise ValueError(f"{what}: {name} is {given!r}; allowed: {allowed(schema)}")
    object.__setattr__(made, name, value)


@dataclass(frozen=True, slots=True)
class AccompanyingStep(Step):
    """The base of the kinds that accompany other steps."""

    accompanies: ClassVar[bool] = True
    seconds: float | None = field(default=None, metadata={"schema": SECONDS})


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivingStep(Step):
    """The base of the kinds that drive.

    Attributes:
        unless: what the car minds while it drives: one condition, or several joined by any. A person or 'stop' holds
            its wheels, an obstacle turns it away, and dark floor holds a random drive.
    """

    unless: Condition | None = None

    def __post_init__(self) -> None:
        Step.__post_init__(self)
        if self.unless is None:
            return
        if not isinstance(self.unless, Condition):
            raise ValueError(f"{self.kind}: unless is {self.unless!r}; allowed: a condition")
        object.__setattr__(self, "unless", any_of(list(alternatives(self.unless))))


def own_fields(kind: type[Step]) -> tuple[Any, ...]:
    """Return the dataclass fields of a kind that have a schema: all but id, the settings and the steps inside."""
    if kind not in _OWN_FIELDS:
        _OWN_FIELDS[kind] = tuple(own for own in fields(kind) if "schema" in own.metadata)
    return _OWN_FIELDS[kind]


def first_value(kind: type[Step], name: str) -> Any:
    """Return the value that a new step of a kind has in a field of its own; an empty list for the steps inside it."""
    for own in own_fields(kind):
        if own.name == name:
            first, *_ = own.metadata["schema"].get("enum", (1,))
            return own.metadata.get("first", first)
    return []


# What is asked of each kind again and again, once it was asked.
_OWN_FIELDS: dict[type[Step], tuple[Any, ...]] = {}
_VALUES: dict[type[Step], list[tuple[str, Any]]] = {}


def _values_of(kind: type[Step]) -> list[tuple[str, Any]]:
    """Return the fields of a kind with their defaults."""
    if kind not in _VALUES:
        _VALUES[kind] = [(own.name, own.default) for own in fields(kind)]
    return _VALUES[kind]


# Written by scripts/generate.py from motorcade.devices; don't edit.
@dataclass(frozen=True, slots=True)
class DriveStep(DrivingStep):
    """Drive or turn for some seconds; speed level 0 stands still, 3 is fastest (c3)."""

    direction: str
    speed: int
    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class WaitStep(Step):
    """Stand still for some seconds (c3 at speed 0)."""

    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class LedStep(Step):
    """Light one of the LEDs 0 to 3 for some seconds (c4)."""

    which: int
    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class AvoidStep(Step):
    """Avoid obstacles nearer than radius level 0 to 3 for some seconds (c5)."""

    radius: int
    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class VoiceStep(AccompanyingStep):
    """Listen for 'stop' and 'go' (c6)."""


@dataclass(frozen=True, slots=True)
class PirStep(AccompanyingStep):
    """Stand still while a person is sensed (c7)."""


@dataclass(frozen=True, slots=True)
class FollowLineStep(DrivingStep):
    """Drive along a dark line for some seconds (c3 forward with the bit floor)."""

    speed: int
    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class TurnToLineStep(DrivingStep):
    """Turn until a line is under the car, then stand (c3 left or right with the bit floor)."""

    direction: str
    speed: int
    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class FloorStep(AccompanyingStep):
    """Mind the floor: what the motor does beside it obeys dark and light (the bit floor)."""


SIMPLE_KINDS: tuple[type[Step], ...] = (
    DriveStep,
    WaitStep,
    LedStep,
    AvoidStep,
    VoiceStep,
    PirStep,
    FollowLineStep,
    TurnToLineStep,
    FloorStep,
)

# Where the class itself reads well, it is the name.
wait = WaitStep
led = LedStep
avoid = AvoidStep
voice = VoiceStep
pir = PirStep
floor = FloorStep


def forward(seconds: float | None = None, speed: int = 2, **more: Any) -> DriveStep:
    """Drive straight on."""
    return DriveStep("forward", speed, seconds, **more)


def left(seconds: float | None = None, speed: int = 2, **more: Any) -> DriveStep:
    """Turn left on the spot."""
    return DriveStep("left", speed, seconds, **more)


def right(seconds: float | None = None, speed: int = 2, **more: Any) -> DriveStep:
    """Turn right on the spot."""
    return DriveStep("right", speed, seconds, **more)


def wander(seconds: float | None = None, speed: int = 2, **more: Any) -> DriveStep:
    """Drive on with random turns."""
    return DriveStep("random", speed, seconds, **more)


def follow_line(seconds: float | None = None, speed: int = 2, **more: Any) -> FollowLineStep:
    """Drive along a dark line."""
    return FollowLineStep(speed, seconds, **more)


def turn_left_to_line(seconds: float | None = None, speed: int = 2, **more: Any) -> TurnToLineStep:
    """Turn left to a line."""
    return TurnToLineStep("left", speed, seconds, **more)


def turn_right_to_line(seconds: float | None = None, speed: int = 2, **more: Any) -> TurnToLineStep:
    """Turn right to a line."""
    return TurnToLineStep("right", speed, seconds, **more)


# End of the section.


@dataclass(frozen=True, slots=True)
class TogetherStep(Step):
    """Steps of different groups that start at once; it lasts as long as its longest."""

    in_start: ClassVar[bool] = True
    inside_at: ClassVar[dict[str, str]] = {"steps": "together"}
    steps: tuple[Step, ...]

    def __post_init__(self) -> None:
        Step.__post_init__(self)
        for part in as_steps(self.steps):
            if part.accept_ir is not None or part.forward is not None or part.until is not None:
                raise ValueError("together: accept_ir, forward and until belong to the whole of it, not to a part")
            if type(part) not in SIMPLE_KINDS:
                raise ValueError(f"together: {part.kind} can't be part of it")
            if isinstance(part, AccompanyingStep) and part.seconds is not None:
                raise ValueError(f"together: {part.kind} lasts as long as the others, so it takes no seconds here")


@dataclass(frozen=True, slots=True)
class RepeatStep(Step):
    """Steps done over and over: so many times, until a condition holds, or for ever where neither is given."""

    in_start: ClassVar[bool] = True
    inside_at: ClassVar[dict[str, str]] = {"steps": "repeat.steps"}
    times: int | None = field(default=None, metadata={"schema": whole(1, 1_000_000_000), "first": 2})
    steps: tuple[Step, ...] = ()

    def __post_init__(self) -> None:
        Step.__post_init__(self)
        as_steps(self.steps)
        if self.times is not None and self.until is not None:
            raise ValueError("repeat: it has times or until, not both")


KINDS: dict[str, type[Step]] = {kind.kind: kind for kind in SIMPLE_KINDS}
KINDS |= {RepeatStep.kind: RepeatStep, TogetherStep.kind: TogetherStep}


def together(*steps: Step, **more: Any) -> TogetherStep:
    """Start these at once."""
    return TogetherStep(steps, **more)


def repeat(times: int, *steps: Step, **more: Any) -> RepeatStep:
    """Do these so many times."""
    return RepeatStep(times, steps, **more)


def as_steps(steps: Iterable[Step]) -> tuple[Step, ...]:
    """Return ``steps`` as a tuple. Raises TypeError, which names what is no step."""
    if not isinstance(steps, Iterable):
        # A single step, or no step at all.
        alone = getattr(steps, "kind", steps)
        raise TypeError(f"{alone} stands alone; put steps into a list, such as [forward(3), left(1)]")
    made = tuple(steps)
    for position, step in enumerate(made):
        if not isinstance(step, Step):
            raise TypeError(f"step {position + 1} is {step!r}; write forward(3), led(0, 1), together(...) and so on")
    return made


def walk(steps: Iterable[Step], path: str) -> Iterator[tuple[str, Step]]:
    """Yield each step, and then the steps inside it, with its place in the program; ``path`` is that of ``steps``."""
    for position, step in enumerate(steps):
        here = f"{path}[{position}]"
        yield here, step
        for name, inner in step.lists.items():
            yield from walk(inner, f"{here}.{step.inside_at[name]}")


def is_deciding(step: Step) -> bool:
    """Whether only a leader that decides can do a step."""
    return step.decides or step.until is not None or (isinstance(step, RepeatStep) and step.times is None)
