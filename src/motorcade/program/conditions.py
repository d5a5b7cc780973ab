"""Conditions of a leader that decides: what ends a step or a repetition, and what an ``if`` asks.

A condition asks one sense, one counter or chance, or it is made of others by not, all and any. Python code may also
write ``~``, ``&`` and ``|`` between conditions.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from motorcade.config.check import Schema, allowed_as, choice, list_of, number, table, whole
from motorcade.config.check import allowed as allowed_by
from motorcade.config.check import fits as fits_schema
from motorcade.words.flow import MOST_COUNT

# The name of a counter or a function: one that Python takes too.
NAME: Schema = allowed_as(
    "program-name", {"type": "string", "pattern": r"^[^\W\d]\w*$", "minLength": 1, "maxLength": 40}
)
COUNT = whole(0, MOST_COUNT)
PERCENT = number(1, 99)
# Wherever a condition stands in a project file.
CONDITION: Schema = {"$ref": "#/$defs/condition"}
# The senses that a condition may ask, each with what its levels are called; None: it has no level.
SENSES: dict[str, tuple[Any, ...]] = {
    "obstacle": (0, 1, 2, 3),
    "person": ({},),
    "voice": ("stop", "go"),
    "floor": ("either", "left", "right", "both"),
}
COMPARISONS = ("is", "below", "above")
_SCHEMAS: dict[str, Schema] = {
    "obstacle": whole(0, 3),
    "person": table(),
    "voice": choice(*SENSES["voice"]),
    "floor": choice(*SENSES["floor"]),
}


class Condition:
    """What holds or doesn't hold at a moment."""

    __slots__ = ()

    def __invert__(self) -> "Condition":
        return Not(self)

    def __and__(self, other: "Condition") -> "Condition":
        return All((self, other))

    def __or__(self, other: "Condition") -> "Condition":
        return AnyOf((self, other))

    def __bool__(self) -> bool:
        raise TypeError("a condition is asked by the car; write ~, & and | in place of not, and, or")

    @property
    def parts(self) -> tuple["Condition", ...]:
        """The conditions that it is made of."""
        return ()


@dataclass(frozen=True, slots=True)
class Sensing(Condition):
    """One of SENSES finds something; ``level`` is the index of what it has to find."""

    sense: str
    level: int = 0

    def __post_init__(self) -> None:
        if self.sense not in SENSES or self.level not in range(len(SENSES[self.sense])):
            raise ValueError(f"{self.sense}: there is no level {self.level!r}")


@dataclass(frozen=True, slots=True)
class Counted(Condition):
    """A counter is, is below or is above a number."""

    counter: str
    comparison: str
    number: int

    def __post_init__(self) -> None:
        if not fits_schema(self.counter, NAME) or self.comparison not in COMPARISONS:
            raise ValueError(f"counter: {self.counter!r} {self.comparison!r} can't be asked")
        if not fits_schema(self.number, COUNT):
            raise ValueError(f"counter: the number is {self.number!r}; allowed: {allowed_by(COUNT)}")


@dataclass(frozen=True, slots=True)
class Chance(Condition):
    """A draw succeeds, which it does in so many of a hundred times."""

    percent: float

    def __post_init__(self) -> None:
        if not fits_schema(self.percent, PERCENT):
            raise ValueError(f"chance: percent is {self.percent!r}; allowed: {allowed_by(PERCENT)}")


@dataclass(frozen=True, slots=True)
class Not(Condition):
    """Another condition doesn't hold."""

    condition: Condition

    @property
    def parts(self) -> tuple[Condition, ...]:
        """The one condition."""
        return (self.condition,)


@dataclass(frozen=True, slots=True)
class _Several(Condition):
    """Some conditions, which are asked in order until it is decided."""

    conditions: tuple[Condition, ...]

    @property
    def parts(self) -> tuple[Condition, ...]:
        """The conditions."""
        return self.conditions


class All(_Several):
    """Each of some conditions holds; they are asked in order, up to the first that doesn't."""

    __slots__ = ()


class AnyOf(_Several):
    """At least one of some conditions holds; they are asked in order, up to the first that does."""

    __slots__ = ()


def obstacle(level: int = 1) -> Condition:
    """Something is nearer than the radius of a level, 0 to 3."""
    return Sensing("obstacle", level)


def person() -> Condition:
    """The PIR sensor detects a person."""
    return Sensing("person")


def heard(command: str = "stop") -> Condition:
    """A voice has said 'stop' or 'go' since the last state began."""
    return Sensing("voice", _level("voice", command))


def dark(where: str = "either") -> Condition:
    """The floor is dark under either sensor, the left one, the right one or both."""
    return Sensing("floor", _level("floor", where))


def counter(name: str, comparison: str, value: int) -> Condition:
    """A counter 'is', is 'below' or is 'above' a number, 0 to 255."""
    return Counted(name, comparison, value)


def chance(percent: float) -> Condition:
    """A draw succeeds: in 1 to 99 of a hundred times."""
    return Chance(percent)


def _level(sense: str, name: str) -> int:
    if name not in SENSES[sense]:
        raise ValueError(f"{sense}: {name!r} is unknown; allowed: {', '.join(SENSES[sense])}")
    return SENSES[sense].index(name)


def condition_schema() -> Schema:
    """Return the schema that CONDITION refers to."""
    several = list_of(CONDITION, 1)
    kinds = {**_SCHEMAS, "counter": NAME, "chance": PERCENT, "not": CONDITION, "all": several, "any": several}
    kinds |= dict.fromkeys(COMPARISONS, COUNT)
    return {
        "type": "object",
        "properties": kinds,
        "oneOf": [{"required": [kind]} for kind in kinds if kind != "counter"],
        "dependentRequired": {comparison: ["counter"] for comparison in COMPARISONS},
        "additionalProperties": False,
    }


def condition_of(document: dict[str, Any]) -> Condition:
    """Return the condition of a document that fits the schema."""
    for sense, levels in SENSES.items():
        if sense in document:
            return Sensing(sense, levels.index(document[sense]))
    if "counter" in document:
        comparison = next(name for name in COMPARISONS if name in document)
        return Counted(document["counter"], comparison, document[comparison])
    if "chance" in document:
        return Chance(document["chance"])
    if "not" in document:
        return Not(condition_of(document["not"]))
    if "all" in document:
        return All(tuple(map(condition_of, document["all"])))
    return AnyOf(tuple(map(condition_of, document["any"])))


def condition_document(condition: Condition) -> dict[str, Any]:
    """Return a condition for JSON."""
    match condition:
        case Sensing(sense, level):
            return {sense: SENSES[sense][level]}
        case Counted(name, comparison, value):
            return {"counter": name, comparison: value}
        case Chance(percent):
            return {"chance": percent}
        case Not(inner):
            return {"not": condition_document(inner)}
        case All(conditions):
            return {"all": list(map(condition_document, conditions))}
    return {"any": list(map(condition_document, condition.parts))}


def atoms(condition: Condition) -> Iterator[Condition]:
    """Yield the conditions that a condition is made of and that are made of no others, in order."""
    if not condition.parts:
        yield condition
    for part in condition.parts:
        yield from atoms(part)


def alternatives(condition: Condition) -> Iterator[Condition]:
    """Yield the conditions that ``any`` joins, also one inside another; of another condition, itself."""
    if not isinstance(condition, AnyOf):
        yield condition
        return
    for part in condition.parts:
        yield from alternatives(part)


def any_of(conditions: Sequence[Condition]) -> Condition:
    """Return the condition that one of some holds; of one, that condition."""
    if len(conditions) == 1:
        return conditions[0]
    return AnyOf(tuple(conditions))


def counters_in(condition: Condition) -> Sequence[str]:
    """Return the names of the counters that a condition asks."""
    return [atom.counter for atom in atoms(condition) if isinstance(atom, Counted)]


def without_double_not(condition: Condition) -> tuple[Condition, bool]:
    """Return the condition inside all nots around it, and whether it must hold."""
    holds = True
    while isinstance(condition, Not):
        condition = condition.condition
        holds = not holds
    return condition, holds
