"""The kinds of steps of a leader that decides, which no device declares, and their names in Python."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from keyword import kwlist
from typing import Any, ClassVar

from motorcade.config.check import choice, whole
from motorcade.program.conditions import COUNT, NAME, Condition
from motorcade.program.steps import (
    KINDS,
    SIMPLE_KINDS,
    RepeatStep,
    Step,
    TogetherStep,
    as_steps,
)
from motorcade.words.flow import CONDITIONS, OPS


@dataclass(frozen=True, slots=True)
class DecidingStep(Step):
    """The base of the kinds that only a leader that decides can do."""

    decides: ClassVar[bool] = True


@dataclass(frozen=True, slots=True)
class IfStep(DecidingStep):
    """Steps done only where a condition holds, and others where it doesn't."""

    inside_at: ClassVar[dict[str, str]] = {"then": "if.then", "otherwise": "if.else"}
    when: Condition
    then: tuple[Step, ...] = ()
    otherwise: tuple[Step, ...] = ()

    def __post_init__(self) -> None:
        Step.__post_init__(self)
        if not isinstance(self.when, Condition):
            raise ValueError(f"if: when is {self.when!r}; allowed: a condition")
        as_steps(self.then)
        as_steps(self.otherwise)


@dataclass(frozen=True, slots=True)
class SetStep(DecidingStep):
    """Give a counter a value, or a random one from 0 to ``random``."""

    counter: str = field(metadata={"schema": NAME})
    to: int | None = field(default=None, metadata={"schema": COUNT})
    random: int | None = field(default=None, metadata={"schema": COUNT})

    def __post_init__(self) -> None:
        Step.__post_init__(self)
        if (self.to is None) == (self.random is None):
            raise ValueError("set: it has either to or random")


@dataclass(frozen=True, slots=True)
class ChangeStep(DecidingStep):
    """Add to a counter, up to 255, or take away from it, down to 0."""

    counter: str = field(metadata={"schema": NAME})
    by: int = field(default=1, metadata={"schema": whole(-COUNT["maximum"], COUNT["maximum"]), "first": 1})


@dataclass(frozen=True, slots=True)
class TellStep(DecidingStep):
    """Tell the followers one step at once; or, without a step, to go on with their own steps in turn."""

    step: Step | None = None

    def __post_init__(self) -> None:
        Step.__post_init__(self)
        if self.step is not None and type(self.step) not in (*SIMPLE_KINDS, TogetherStep):
            raise ValueError(f"tell: {self.step!r} is no step of a follower")


@dataclass(frozen=True, slots=True)
class DoStep(DecidingStep):
    """Do the steps of one of the program's functions."""

    function: str = field(metadata={"schema": NAME})


def _raw(most: int) -> Any:
    return field(default=0, metadata={"schema": whole(0, most, default=0)})


@dataclass(frozen=True, slots=True)
class FlowStep(DecidingStep):
    """One flow word, whose fields are given as they are: what no other step says."""

    op: str = field(metadata={"schema": choice(*(name for _, name in OPS))})
    target: int = _raw(255)
    condition: str = field(
        default="always", metadata={"schema": choice(*(name for _, name in CONDITIONS), default="always")}
    )
    if_not: int = _raw(1)
    level: int = _raw(3)
    counter: int = _raw(3)
    value: int = _raw(255)


# What the steps and conditions of a program's Python text are called, and what else has a meaning of its own there: no
# counter and no function has such a name.
CONDITION_NAMES = ("obstacle", "person", "heard", "dark", "counter", "chance")
TAKEN = {
    *(name for kind in KINDS.values() for name in kind.names),
    *CONDITION_NAMES,
    *("tell", "flow", "random", "leader", "followers", "profile", "program", "range", "abs", "min", "max", "round"),
    *kwlist,
}
# What a tell says in place of a step: the followers' own steps in turn.
IN_TURN = "in_turn"
FLOW_KINDS: tuple[type[Step], ...] = (IfStep, SetStep, ChangeStep, TellStep, DoStep, FlowStep)
ALL_KINDS: dict[str, type[Step]] = KINDS | {kind.kind: kind for kind in FLOW_KINDS}


def repeat_until(until: Condition, *steps: Step, **more: Any) -> RepeatStep:
    """Do these over and over, until a condition holds before the first of them."""
    return RepeatStep(None, steps, until=until, **more)


def forever(*steps: Step, **more: Any) -> RepeatStep:
    """Do these for ever."""
    return RepeatStep(None, steps, **more)


def if_(when: Condition, then: Iterable[Step], otherwise: Iterable[Step] = (), **more: Any) -> IfStep:
    """Do the steps of one list where a condition holds, else those of another."""
    return IfStep(when, as_steps(then), as_steps(otherwise), **more)


@dataclass(frozen=True, slots=True)
class Random:
    """A value for a counter: a random number from 0 to ``most``."""

    most: int


random = Random


def set_counter(counter: str, to: int | Random, **more: Any) -> SetStep:
    """Give a counter a value: 0 to 255, or a random one."""
    if isinstance(to, Random):
        return SetStep(counter, random=to.most, **more)
    return SetStep(counter, to, **more)


def change_counter(counter: str, by: int = 1, **more: Any) -> ChangeStep:
    """Add to a counter, or take away from it."""
    return ChangeStep(counter, by, **more)


def tell(step: Step | str = IN_TURN, **more: Any) -> TellStep:
    """Tell the followers one step at once; or, with 'in_turn', to go on with their own steps in turn."""
    if step == IN_TURN:
        return TellStep(None, **more)
    if not isinstance(step, Step):
        raise ValueError(f"tell: {step!r} is no step of a follower")
    return TellStep(step, **more)


def do(function: str, **more: Any) -> DoStep:
    """Do the steps of a function of the program."""
    return DoStep(function, **more)


flow = FlowStep


def conditions_of(step: Step) -> list[Condition]:
    """Return the conditions that a step has."""
    named = (getattr(step, name, None) for name in ("when", "unless", "until"))
    return [condition for condition in named if condition is not None]
