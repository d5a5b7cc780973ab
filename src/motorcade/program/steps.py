"""All kinds of steps: those that devices declare, and those that hold other steps."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, ClassVar

from motorcade.config.check import whole
from motorcade.program.step import AccompanyingStep, Step
from motorcade.program.step_kinds import *  # noqa: F403
from motorcade.program.step_kinds import SIMPLE_KINDS


@dataclass(frozen=True, slots=True)
class TogetherStep(Step):
    """Steps of different groups that start at once; it lasts as long as its longest."""

    kind: ClassVar[str] = "together"
    in_start: ClassVar[bool] = True
    names: ClassVar[dict[str, dict[str, str]]] = {"together": {}}
    category: ClassVar[str] = "order"
    icon: ClassVar[str] = "M4 6h16M4 12h16M4 18h16M8 3v18"
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
    icon: ClassVar[str] = "M4 11a7 7 0 0 1 12-4.500L19 9M19 4v5h-5M20 13a7 7 0 0 1-12 4.500L5 15M5 20v-5h5"
    times: int = field(metadata={"schema": whole(1, 1_000_000_000), "first": 2})
    steps: tuple[Step, ...]

    def __post_init__(self) -> None:
        Step.__post_init__(self)
        as_steps(self.steps)


_ALL_KINDS: tuple[type[Step], ...] = (*SIMPLE_KINDS, RepeatStep, TogetherStep)
KINDS = {kind.kind: kind for kind in _ALL_KINDS}


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
