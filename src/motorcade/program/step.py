"""What all kinds of steps have, and what their fields are.

A kind is a frozen dataclass. Each of its own fields has a JSON Schema (``schema``) and the field of the control word
that its value goes into (``word``); the class attributes hold the rest. `program.step_kinds` has the kinds that devices
declare, which take all this from `motorcade.devices`; `program.steps` adds those that hold other steps. These are made
from the classes: the schema of project files and the checks (`program.model`), the bits of a word and the step that a
word holds (`program.parts`), the blocks of the page and the table in docs/programs.md (`scripts/step_files.py`).
"""

from dataclasses import MISSING, dataclass, field, fields
from typing import Any, ClassVar

from motorcade.config.check import Schema, allowed, choice, fits, flag, number, whole
from motorcade.devices import DEVICES
from motorcade.devices.declaration import Input
from motorcade.words.formats import CONTROL

LONGEST_S = 86400
SHORTEST_DWELL_S = 0.001
SECONDS = number(0, LONGEST_S)
# What a step of any kind may have.
COMMON: dict[str, Schema] = {"id": {"type": "string"}, "accept_ir": flag(), "forward": flag()}


_DECLARED = {each.kind: (device, each) for device in DEVICES for each in device.steps}


def _field_of(each: Input) -> Any:
    """The field of a dataclass for what is chosen in a step."""
    if each.options:
        return field(metadata={"schema": choice(*each.options), "word": each.bits, "least": each.least})
    if not each.menu:
        return field(metadata={"schema": SECONDS, "word": each.bits})
    schema = whole(each.least, CONTROL.field(each.bits).maximum)
    about = {"word": each.bits, "menu": each.menu, "first": each.first, "least": each.least}
    return field(metadata={"schema": schema, **about})


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """What every step may have.

    Attributes:
        id: the block that it came from.
        accept_ir, forward: for a follower's step only; None takes the setting of the followers' program.
        kind: the kind's name in JSON, in a block's type and in locales.
        names: its names in Python, a class or functions of this module, each with the fields that the name decides.
        category: the category of the page's toolbox that has its block; blocks of one category have one colour.
        icon: the path of its block's icon, in a square of 24.
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
    icon: ClassVar[str] = ""
    group: ClassVar[str] = ""
    hue: ClassVar[int] = 0
    sets: ClassVar[dict[str, int]] = {}
    in_start: ClassVar[bool] = False
    accompanies: ClassVar[bool] = False
    id: str | None = None
    accept_ir: bool | None = None
    forward: bool | None = None

    def __init_subclass__(cls) -> None:
        """Give a kind that a device declares its attributes, and its fields their schemas."""
        # A dataclass with slots is made twice; the second time its fields are done.
        if cls.kind not in _DECLARED or "__dataclass_fields__" in vars(cls):
            return
        device, declared = _DECLARED[cls.kind]
        cls.names = {call.name: dict(call.sets) for call in declared.calls} or {cls.kind: {}}
        cls.category, cls.icon, cls.in_start = declared.block.drawer, declared.block.icon, declared.block.in_start
        cls.group, cls.hue, cls.sets = declared.group or device.group, device.hue, dict(declared.sets)
        for each in declared.inputs:
            if each.bits:
                setattr(cls, each.name, _field_of(each))

    @classmethod
    def of_checked(cls, values: dict[str, Any]) -> "Step":
        """Return a step of values that have been checked already; the constructor would check them again."""
        step = object.__new__(cls)
        for name, default in _defaults_of(cls):
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
class AccompanyingStep(Step):
    """The base of the kinds that accompany other steps."""

    accompanies: ClassVar[bool] = True
    seconds: float | None = field(default=None, metadata={"schema": SECONDS})


_own_fields: dict[type[Step], tuple[Any, ...]] = {}
_defaults: dict[type[Step], tuple[tuple[str, Any], ...]] = {}


def own_fields(kind: type[Step]) -> tuple[Any, ...]:
    """Return the dataclass fields of a kind that have a schema: all but id, the settings and the steps inside."""
    if kind not in _own_fields:
        _own_fields[kind] = tuple(each for each in fields(kind) if "schema" in each.metadata)
    return _own_fields[kind]


def first_value(kind: type[Step], name: str) -> Any:
    """Return the value that a new step of a kind has in a field of its own; an empty list for the steps inside it."""
    for each in own_fields(kind):
        if each.name == name:
            return each.metadata.get("first", each.metadata["schema"].get("enum", (1,))[0])
    return []


def _defaults_of(kind: type[Step]) -> tuple[tuple[str, Any], ...]:
    """Return the name and the default of each field; None where a field has no default."""
    if kind not in _defaults:
        made = ((each.name, None if each.default is MISSING else each.default) for each in fields(kind))
        _defaults[kind] = tuple(made)
    return _defaults[kind]
