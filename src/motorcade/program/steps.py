"""The kinds of steps: each is declared here once, with everything that other modules need.

A kind is a frozen dataclass. Each field has a JSON Schema (``schema``) and the field of the control word that its value
goes into (``word``); the class attributes hold the rest. These are made from the declarations: the schema of project
files and the checks (`program.model`), the bits of a word and the step that a word holds (`program.parts`), the blocks
of the page, the colours of a word's bits and the table in docs/programs.md (`scripts/step_files.py`), and the names in
Python. CONTRIBUTING.md lists what else a new kind needs.
"""

from collections.abc import Iterable
from dataclasses import MISSING, dataclass, field, fields
from typing import Any, ClassVar

from motorcade.config.check import Schema, allowed, choice, fits, flag, number, whole
from motorcade.words.formats import CONTROL

LONGEST_S = 86400
SHORTEST_DWELL_S = 0.001
SECONDS = number(0, LONGEST_S)
DIRECTIONS = ("forward", "left", "right", "random")
# What a step of any kind may have.
COMMON: dict[str, Schema] = {"id": {"type": "string"}, "accept_ir": flag(), "forward": flag()}


def _choice(word: str, names: tuple[str, ...]) -> Any:
    """One of ``names``, whose position goes into the field ``word``."""
    return field(metadata={"schema": choice(*names), "word": word})


def _level(word: str, menu: str, first: int = 0) -> Any:
    """A level that goes into the field ``word``; the page offers a menu of levels, of which ``first`` is chosen."""
    bits = CONTROL.field(word)
    return field(metadata={"schema": whole(bits.minimum, bits.maximum), "word": word, "menu": menu, "first": first})


def _seconds(word: str) -> Any:
    """A duration, whose level goes into the field ``word``."""
    return field(metadata={"schema": SECONDS, "word": word})


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """What every step may have.

    Attributes:
        id: the block that it came from.
        accept_ir, forward: for a follower's step only; None takes the setting of the followers' program.
        kind: the kind's name in JSON, in a block's type and in locales.
        names: its names in Python, a class or functions of this module, each with the fields that the name decides.
        category: the category of the page's toolbox that has its block; blocks of one category have one colour.
        group: the part of a control word that it fills; a car has one of each, so two steps of one group can't start
            together.
        hue: the colour of these bits in the page's table of words, in degrees.
        sets: fields of the control word that are the same in every step of the kind.
        in_start: whether the page's first level, with few kinds of blocks, has its block.
        accompanies: the step has a bit of the word but no duration of its own. In a together it lasts as long as the
            steps beside it. Alone it has ``seconds``, for which the car stands still.
    """

    kind: ClassVar[str] = ""
    names: ClassVar[dict[str, dict[str, str]]] = {}
    category: ClassVar[str] = ""
    group: ClassVar[str] = ""
    hue: ClassVar[int] = 0
    sets: ClassVar[dict[str, int]] = {}
    in_start: ClassVar[bool] = False
    accompanies: ClassVar[bool] = False
    id: str | None = None
    accept_ir: bool | None = None
    forward: bool | None = None

    @classmethod
    def of_checked(cls, values: dict[str, Any]) -> "Step":
        """Return a step of values that have been checked already; the constructor would check them again."""
        step = object.__new__(cls)
        for name, default in _DEFAULTS[cls]:
            object.__setattr__(step, name, values.get(name, default))
        return step

    def __post_init__(self) -> None:
        for name, schema in COMMON.items():
            if (value := getattr(self, name)) is not None:
                check_value(self.kind, name, value, schema)
        for each in own_fields(type(self)):
            value = getattr(self, each.name)
            if value is not None or each.default is not None:
                check_value(self.kind, each.name, value, each.metadata["schema"])


def check_value(what: str, name: str, value: object, schema: Schema) -> None:
    """Raise ValueError unless ``value``, which Python code gave ``what`` as ``name``, fits the schema of files."""
    if not fits(value, schema) or (isinstance(value, float) and schema.get("type") == "integer"):
        raise ValueError(f"{what}: {name} is {value!r}; allowed: {allowed(schema)}")


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
    group: ClassVar[str] = "motor"
    hue: ClassVar[int] = 219
    sets: ClassVar[dict[str, int]] = {"motor_enable": 1}
    direction: str = _choice("motor_direction", DIRECTIONS)
    speed: int = _level("motor_speed", "speed", first=2)
    seconds: float = _seconds("motor_duration")


@dataclass(frozen=True, slots=True)
class WaitStep(Step):
    """Stand still for some seconds (c3 at speed 0)."""

    kind: ClassVar[str] = "wait"
    in_start: ClassVar[bool] = True
    names: ClassVar[dict[str, dict[str, str]]] = {"wait": {}}
    category: ClassVar[str] = "drive"
    group: ClassVar[str] = "motor"
    hue: ClassVar[int] = 219
    sets: ClassVar[dict[str, int]] = {"motor_enable": 1, "motor_direction": 0, "motor_speed": 0}
    seconds: float = _seconds("motor_duration")


@dataclass(frozen=True, slots=True)
class LedStep(Step):
    """Light one of the LEDs 0 to 3 for some seconds (c4)."""

    kind: ClassVar[str] = "led"
    in_start: ClassVar[bool] = True
    names: ClassVar[dict[str, dict[str, str]]] = {"led": {}}
    category: ClassVar[str] = "light"
    group: ClassVar[str] = "led"
    hue: ClassVar[int] = 41
    which: int = _level("led_which", "light")
    seconds: float = _seconds("led_duration")


@dataclass(frozen=True, slots=True)
class AvoidStep(Step):
    """Avoid obstacles nearer than radius level 0 to 3 for some seconds (c5)."""

    kind: ClassVar[str] = "avoid"
    names: ClassVar[dict[str, dict[str, str]]] = {"avoid": {}}
    category: ClassVar[str] = "sense"
    group: ClassVar[str] = "avoid"
    hue: ClassVar[int] = 166
    sets: ClassVar[dict[str, int]] = {"avoid_enable": 1}
    radius: int = _level("avoid_radius", "radius")
    seconds: float = _seconds("avoid_duration")


@dataclass(frozen=True, slots=True)
class AccompanyingStep(Step):
    """The base of the kinds that accompany other steps."""

    accompanies: ClassVar[bool] = True
    seconds: float | None = field(default=None, metadata={"schema": SECONDS})


@dataclass(frozen=True, slots=True)
class VoiceStep(AccompanyingStep):
    """Listen for 'stop' and 'go' (c6)."""

    kind: ClassVar[str] = "voice"
    in_start: ClassVar[bool] = True
    names: ClassVar[dict[str, dict[str, str]]] = {"voice": {}}
    category: ClassVar[str] = "sense"
    group: ClassVar[str] = "voice"
    hue: ClassVar[int] = 263
    sets: ClassVar[dict[str, int]] = {"voice": 1}


@dataclass(frozen=True, slots=True)
class PirStep(AccompanyingStep):
    """Stand still while a person is sensed (c7)."""

    kind: ClassVar[str] = "pir"
    names: ClassVar[dict[str, dict[str, str]]] = {"pir": {}}
    category: ClassVar[str] = "sense"
    group: ClassVar[str] = "pir"
    hue: ClassVar[int] = 22
    sets: ClassVar[dict[str, int]] = {"pir": 1}


@dataclass(frozen=True, slots=True)
class TogetherStep(Step):
    """Steps of different groups that start at once; it lasts as long as its longest."""

    kind: ClassVar[str] = "together"
    in_start: ClassVar[bool] = True
    names: ClassVar[dict[str, dict[str, str]]] = {"together": {}}
    category: ClassVar[str] = "order"
    steps: tuple[Step, ...]

    def __post_init__(self) -> None:
        Step.__post_init__(self)
        for part in as_steps(self.steps):
            if part.accept_ir is not None or part.forward is not None:
                raise ValueError("together: accept_ir and forward belong to the whole of it, not to a part")
            if isinstance(part, TogetherStep | RepeatStep):
                raise ValueError(f"together: {part.kind} can't be part of it")
            if isinstance(part, AccompanyingStep) and part.seconds is not None:
                raise ValueError(f"together: {part.kind} lasts as long as the others, so it takes no seconds here")


@dataclass(frozen=True, slots=True)
class RepeatStep(Step):
    """Steps done over and over."""

    kind: ClassVar[str] = "repeat"
    in_start: ClassVar[bool] = True
    names: ClassVar[dict[str, dict[str, str]]] = {"repeat": {}}
    category: ClassVar[str] = "order"
    times: int = field(metadata={"schema": whole(1, 1_000_000_000), "first": 2})
    steps: tuple[Step, ...]

    def __post_init__(self) -> None:
        Step.__post_init__(self)
        as_steps(self.steps)


SIMPLE_KINDS: tuple[type[Step], ...] = (DriveStep, WaitStep, LedStep, AvoidStep, VoiceStep, PirStep)
_ALL_KINDS: tuple[type[Step], ...] = (*SIMPLE_KINDS, RepeatStep, TogetherStep)
KINDS = {kind.kind: kind for kind in _ALL_KINDS}

# The names in Python. Where the class itself reads well, it is the name.
wait = WaitStep
led = LedStep
avoid = AvoidStep
voice = VoiceStep
pir = PirStep


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


def together(*steps: Step, **more: Any) -> TogetherStep:
    """Start these at once."""
    return TogetherStep(steps, **more)


def repeat(times: int, *steps: Step, **more: Any) -> RepeatStep:
    """Do these so many times."""
    return RepeatStep(times, steps, **more)


def as_steps(steps: Iterable[Step]) -> tuple[Step, ...]:
    """Return ``steps`` as a tuple. Raises TypeError, which names what is no step."""
    if isinstance(steps, Step):
        raise TypeError(f"{steps.kind} stands alone; put steps into a list, such as [forward(3), left(1)]")
    made = tuple(steps)
    for position, step in enumerate(made):
        if not isinstance(step, Step):
            raise TypeError(f"step {position + 1} is {step!r}; write forward(3), led(0, 1), together(...) and so on")
    return made


def own_fields(kind: type[Step]) -> tuple[Any, ...]:
    """Return the dataclass fields of a kind that have a schema: all but id, the settings and the steps inside."""
    return _OWN_FIELDS[kind]


def first_value(kind: type[Step], name: str) -> Any:
    """Return the value that a new step of a kind has in a field of its own; an empty list for the steps inside it."""
    for each in own_fields(kind):
        if each.name == name:
            return each.metadata.get("first", each.metadata["schema"].get("enum", (1,))[0])
    return []


_OWN_FIELDS = {kind: tuple(each for each in fields(kind) if "schema" in each.metadata) for kind in _ALL_KINDS}
# None where a field has no default.
_DEFAULTS = {
    kind: tuple((each.name, None if each.default is MISSING else each.default) for each in fields(kind))
    for kind in _ALL_KINDS
}
