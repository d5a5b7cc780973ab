"""What a car minds while it drives: the conditions of a drive's ``unless``, and the steps that they are in its word.

A person or 'stop' holds the wheels, an obstacle turns the car away, and dark floor holds a random drive. All are bits
of the drive's own word: followers mind them, too, and the word's clock runs on.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from motorcade.program.conditions import Condition, Sensing, alternatives, any_of
from motorcade.program.diagnostics import Diagnostic, error
from motorcade.program.flow_steps import TellStep
from motorcade.program.model import Program
from motorcade.program.steps import (
    SIMPLE_KINDS,
    DrivingStep,
    Step,
    TogetherStep,
    own_fields,
)

# By what a condition senses: the kind of step with its bits.
_KINDS = {kind.minds: kind for kind in SIMPLE_KINDS if kind.minds}


def reactions_of(step: Step) -> list[Step]:
    """Return the steps that start together with a drive for what it can mind; none for other steps."""
    if not isinstance(step, DrivingStep) or step.unless is None:
        return []
    minded = alternatives(step.unless)
    return [_reaction(condition, step) for condition in minded if not _fault(condition, step)]


def parts_at_once(step: Step) -> list[Step]:
    """Return the steps that start together in a step's word, each thing that a drive minds as one of them."""
    parts: Sequence[Any] = (step,)
    if isinstance(step, TogetherStep):
        parts = step.steps
    made: list[Step] = []
    for part in parts:
        minded = reactions_of(part)
        made.append(replace(part, unless=None) if minded else part)
        made += minded
    return made


def _reaction(condition: Any, drive: Any) -> Step:
    kind: Any = _KINDS[condition.sense]
    if kind.accompanies:
        return kind()  # type: ignore[no-any-return]
    return kind(condition.level, drive.seconds)  # type: ignore[no-any-return]


def wrong_reactions(step: Step, path: str, step_id: str | None) -> Iterator[Diagnostic]:
    """Yield what is wrong with what a step minds; ``path`` is the step's, ``step_id`` that of the block at fault."""
    if not isinstance(step, DrivingStep) or step.unless is None:
        return
    minded = set()
    for condition in alternatives(step.unless):
        code = _fault(condition, step)
        sense = getattr(condition, "sense", "")
        if not code and sense in minded:
            code = "unless-twice"
        if code:
            yield error(code, f"{path}.{step.kind}.unless", step_id)
        minded.add(sense)


def _fault(condition: Condition, drive: DrivingStep) -> str:
    """Return the code of the error where a drive can't mind a condition, else nothing."""
    if not isinstance(condition, Sensing):
        return "unless-not-minded"
    kind = _KINDS.get(condition.sense)
    # Only the first level of what has no other field has a bit: 'stop', and dark floor on a side.
    if kind is None or (kind.accompanies and condition.level):
        return "unless-not-minded"
    if condition.sense == "floor" and getattr(drive, "direction", "") != "random":
        return "unless-dark"
    return ""


def with_unless(steps: Sequence[Step]) -> list[Step]:
    """Return steps that start together; what a drive among them can mind becomes its ``unless``."""
    drives = [step for step in steps if isinstance(step, DrivingStep)]
    if len(drives) != 1 or drives[0].unless is not None:
        return list(steps)
    minded = []
    left: list[Step] = []
    for step in steps:
        condition = _condition_of(step, drives[0])
        if condition is not None:
            minded.append(condition)
        else:
            left.append(step)
    if minded:
        left[left.index(drives[0])] = replace(drives[0], unless=any_of(minded))
    return left


def _condition_of(step: Step, drive: Any) -> Condition | None:
    """Return the condition that a drive minds by a step beside it."""
    if not step.minds:
        return None
    condition = Sensing(step.minds)
    if not step.accompanies:
        level, _ = own_fields(type(step))
        condition = Sensing(step.minds, getattr(step, level.name))
    lasts_as_long = step.accompanies or getattr(step, "seconds", None) == drive.seconds
    return condition if lasts_as_long and not _fault(condition, drive) else None


def minding(program: Program) -> Program:
    """Return a program of the same words in which drives mind what stood beside them in a together."""
    return program.with_rows(lambda steps, _: _minding(steps))


def _minding(steps: Sequence[Step]) -> list[Step]:
    made = []
    for step in steps:
        if isinstance(step, TogetherStep):
            made.append(_joined(step, with_unless(step.steps)))
            continue
        changes: dict[str, Any] = {name: tuple(_minding(inside)) for name, inside in step.lists.items()}
        if isinstance(step, TellStep) and step.step:
            (changes["step"],) = _minding([step.step])
        made.append(replace(step, **changes))
    return made


def _joined(together: TogetherStep, parts: Sequence[Step]) -> Step:
    """Return a together with other parts; a drive that is its only part, and minds something, stands alone."""
    alone = parts[0] if len(parts) == 1 else None
    if not isinstance(alone, DrivingStep) or len(together.steps) == 1:
        return replace(together, steps=tuple(parts))
    return replace(
        alone,
        id=together.id or alone.id,
        accept_ir=together.accept_ir,
        forward=together.forward,
        until=together.until,
    )
