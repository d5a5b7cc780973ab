"""Which steps of a changed program are which steps of the program before."""

from collections import defaultdict, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from difflib import SequenceMatcher
from functools import cache
from typing import Any

from motorcade.program.model import Program
from motorcade.program.step import Step
from motorcade.program.steps import RepeatStep, TogetherStep

# Of old and new steps that are compared step by step: 200 with 200.
_MOST_PAIRS = 40_000


def align(old: Sequence[Step], new: Sequence[Step]) -> list[int | None]:
    """Return for each new step the position of the old step that it is or comes from; None where it is a new one.

    Equal steps in the same order belong together; then equal steps that were moved; then steps of one kind. Ids are not
    compared.
    """
    ours, theirs = [without_ids(each) for each in old], [without_ids(each) for each in new]
    start = 0
    while start < min(len(ours), len(theirs)) and ours[start] == theirs[start]:
        start += 1
    found: list[int | None] = [*range(start), *[None] * (len(new) - start)]
    groups = []
    # The comparison of many equal steps takes their number to the third: longer rows are compared as a whole.
    is_short = len(ours) * len(theirs) <= _MOST_PAIRS
    matcher = SequenceMatcher(None, ours[start:], theirs[start:], autojunk=False)
    whole = [("replace", 0, len(ours) - start, 0, len(theirs) - start)]
    for tag, a, a_end, b, b_end in matcher.get_opcodes() if is_short else whole:
        if tag == "equal":
            found[start + b : start + b_end] = range(start + a, start + a_end)
        else:
            groups.append((range(start + a, start + a_end), range(start + b, start + b_end)))
    left = {position for before, _ in groups for position in before}

    def take(before: Iterable[int], after: Iterable[int], key: Callable[[Step], object]) -> None:
        """Give each new step the first old step that is left and has the same key."""
        waiting: dict[object, deque[int]] = defaultdict(deque)
        for position in before:
            if position in left:
                waiting[key(ours[position])].append(position)
        for position in after:
            same = waiting[key(theirs[position])]
            if found[position] is None and same:
                left.discard(same[0])
                found[position] = same.popleft()

    take(sorted(left), (each for _, after in groups for each in after), lambda step: step)
    # First those that changed where they stand, then those that changed and moved.
    for before, after in (*groups, (range(len(old)), range(len(new)))):
        take(before, after, lambda step: step.kind)
    return found


@cache
def without_ids(step: Step) -> Step:
    """Return a step, and the steps inside it, without the blocks that they came from."""
    if isinstance(step, TogetherStep | RepeatStep):
        return replace(step, id=None, steps=tuple(without_ids(each) for each in step.steps))
    return replace(step, id=None) if step.id is not None else step


def with_ids_of(program: Program, before: Program) -> Program:
    """Return ``program`` with the ids that its steps have in ``before``; steps with an id of their own keep it."""
    taken = set(_ids(program.leader)) | set(_ids(program.followers.steps if program.followers else ()))
    leader = _steps_with_ids(program.leader, before.leader, taken)
    followers = program.followers
    if followers and before.followers:
        followers = replace(followers, steps=_steps_with_ids(followers.steps, before.followers.steps, taken))
    return Program(leader, followers, program.profile)


def _steps_with_ids(steps: Sequence[Step], before: Sequence[Step], taken: set[str]) -> list[Step]:
    made = []
    for step, position in zip(steps, align(before, steps), strict=True):
        old = None if position is None else before[position]
        changes: dict[str, Any] = {}
        if old and old.id is not None and step.id is None and old.id not in taken:
            changes["id"] = old.id
        if isinstance(step, TogetherStep | RepeatStep):
            inside = old.steps if isinstance(old, TogetherStep | RepeatStep) else ()
            changes["steps"] = tuple(_steps_with_ids(step.steps, inside, taken))
        made.append(replace(step, **changes) if changes else step)
    return made


def _ids(steps: Sequence[Step]) -> Iterator[str]:
    for step in steps:
        if step.id is not None:
            yield step.id
        if isinstance(step, TogetherStep | RepeatStep):
            yield from _ids(step.steps)
