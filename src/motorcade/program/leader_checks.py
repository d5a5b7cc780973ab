"""What is wrong, or may surprise, with the words of a leader that decides; and the numbers of its counters."""

from collections.abc import Iterable, Iterator, Mapping, Sequence

from motorcade.config.profile import Profile
from motorcade.errors import Phrase
from motorcade.program.conditions import counters_in
from motorcade.program.diagnostics import (
    Diagnostic,
    Fix,
    error,
    warning,
)
from motorcade.program.flow_steps import (
    TAKEN,
    ChangeStep,
    FlowStep,
    SetStep,
    conditions_of,
)
from motorcade.program.fragments import CONDITION_NUMBERS, Instruction, raw_word
from motorcade.program.parts import length_ms
from motorcade.program.steps import Step
from motorcade.words.flow import (
    BAD_COUNT,
    BAD_LEVEL,
    CALL,
    COUNT,
    COUNTER,
    COUNTERS,
    JUMP,
    RETURN,
    TAGGED,
    TELL,
    highest_level,
    word_fault,
)
from motorcade.words.formats import FLOW
from motorcade.words.packing import pack

# A leader remembers so many calls.
DEEPEST_CALL = 4
_OP_AT = FLOW.field("op").low
_TELL_BITS = FLOW.encode(op=TELL) >> _OP_AT
_COUNTER_AT = FLOW.field("counter").low
_COUNTER_MASK = FLOW.field("counter").raw_mask
_COUNTING = FLOW.field("flow").word_mask | FLOW.field("op").word_mask
_ASKING = FLOW.field("flow").word_mask | FLOW.field("condition").word_mask
_COUNT_BITS = FLOW.encode(op=COUNT)
_COUNTER_BITS = FLOW.encode(op=JUMP, condition=COUNTER)
# The part of the time after which cars forget that a told word stays at least.
_SLOT_SHARE = 15
# How far it is looked for a tell that comes too soon.
_MOST_LOOKED = 200


class CounterNumbers:
    """The numbers of a program's counters.

    Attributes:
        numbers: by their names, as the compiler uses them.
        names: by their numbers in the words, once `in_order` has given them.
        spare: how many counters are left for repeats.
        problems: errors, for more counters than a car has.
    """

    def __init__(self, steps: Iterable[tuple[str, Step]]) -> None:
        self.numbers: dict[str, int] = {}
        self.names: dict[int, str] = {}
        self.problems: list[Diagnostic] = []
        steps = list(steps)
        flow = [step for _, step in steps if isinstance(step, FlowStep)]
        raw = {step.counter for step in flow if step.op == "count" or step.condition == "counter"}
        for path, step in steps:
            names = [name for condition in conditions_of(step) for name in counters_in(condition)]
            if isinstance(step, SetStep | ChangeStep):
                names.append(step.counter)
            for name in names:
                if name in TAKEN:
                    self.problems.append(error("name-is-taken", path, step.id, name=name))
                    self.numbers.setdefault(name, 0)
                elif name not in self.numbers:
                    self._number(name, raw, path, step)
        self.spare = COUNTERS - 1 - max([*raw, *self.numbers.values()], default=-1)

    def _number(self, name: str, raw: set[int], path: str, step: Step) -> None:
        free = [number for number in range(COUNTERS) if number not in raw | {*self.numbers.values()}]
        if free:
            self.numbers[name] = free[0]
            return
        known = list(self.numbers)
        problem = error("too-many-counters", path, step.id, most=COUNTERS, name=name, known=", ".join(known))
        if isinstance(step, SetStep | ChangeStep):
            problem = problem.with_fixes(*(Fix("counter", other) for other in known[:1]))
        self.problems.append(problem)
        self.numbers[name] = 0

    def in_order(self, code: Iterable[Instruction]) -> dict[int, int]:
        """Return the words with the program's counters, each with the same word in which they count up from 0.

        So the same words come from a program, whatever its counters are called.
        """
        given = sorted(self.numbers.values())
        numbers: dict[int, int] = {}
        changed: dict[int, int] = {}
        for word, _, _, _ in code:
            number = word >> _COUNTER_AT & _COUNTER_MASK
            if number in given and (word & _COUNTING == _COUNT_BITS or word & _ASKING == _COUNTER_BITS):
                if number not in numbers:
                    numbers[number] = given[len(numbers)]
                changed[word] = word ^ (number ^ numbers[number]) << _COUNTER_AT
        self.names = {numbers[number]: name for name, number in self.numbers.items() if number in numbers}
        return changed


def wrong_flow_steps(
    steps: Iterable[tuple[str, FlowStep]], leader_words: int, follower_words: int
) -> Iterator[Diagnostic]:
    """Yield an error for each word that is given as it is and that no image with so many words can have."""
    for path, step in steps:
        first, second, third, fourth = pack(raw_word(step))
        fault = word_fault(first, second, third, fourth, leader_words, follower_words, TAGGED)
        if not fault:
            continue
        name = "target"
        most = leader_words - 1
        if fault == BAD_LEVEL:
            name = "level"
            most = highest_level(CONDITION_NUMBERS[step.condition])
        elif fault == BAD_COUNT:
            name = "value"
            most = follower_words
        elif step.op == "tell":
            most = follower_words - 1
        allowed = Phrase("values-from-to", minimum=0, maximum=most)
        problem = error("out-of-range", f"{path}.flow.{name}", step.id, value=getattr(step, name), allowed=allowed)
        yield problem.with_fixes(Fix(name, max(0, most)))


def timeless_loops(loops: Mapping[str, str | None], origins: Sequence[tuple[str, str | None]]) -> Iterator[Diagnostic]:
    """Yield a warning for each loop in which no time passes, with its last word; ``loops`` are their paths and ids."""
    for path, step_id in loops.items():
        words = [number for number, (origin, _) in enumerate(origins, start=1) if f"{origin}.".startswith(f"{path}.")]
        yield warning("no-time-passes", path, step_id, word=max(words, default=len(origins)))


def hurried_tells(
    words: Sequence[int], origins: Sequence[tuple[str, str | None]], profile: Profile
) -> Iterator[Diagnostic]:
    """Yield a warning for each tell behind which the next one always comes before followers could hear it."""
    least_ms = profile.infrared.forget_ms / _SLOT_SHARE
    hurried = {}
    for number, word in enumerate(words):
        if word >> _OP_AT == _TELL_BITS and _is_hurried(words, number, least_ms, profile):
            path, step_id = origins[number]
            hurried[path] = step_id
    for path, step_id in hurried.items():
        yield warning("tell-too-soon", path, step_id, seconds=f"{least_ms / 1000:.2g}")


def _is_hurried(words: Sequence[int], tell: int, least_ms: float, profile: Profile) -> bool:
    """Whether each way from a tell comes to another one in less than ``least_ms``."""
    # The ways that are left to go: the next word, the places to return to, the time that passed.
    ways: list[tuple[int, tuple[int, ...], int]] = [(tell + 1, (), 0)]
    for _ in range(_MOST_LOOKED):
        if not ways:
            return True
        number, calls, passed_ms = ways.pop()
        number %= len(words)
        word = words[number]
        if word >> 31 == 0:
            passed_ms += length_ms(word, profile)
            if passed_ms >= least_ms:
                return False
            ways.append((number + 1, calls, passed_ms))
            continue
        values = FLOW.decode(word)
        if values.op == RETURN:
            *calls_left, target = calls or (0,)
            ways.append((target, tuple(calls_left), passed_ms))
        if values.op == COUNT or (values.op in (JUMP, CALL) and values.condition):
            ways.append((number + 1, calls, passed_ms))
        if values.op == JUMP:
            ways.append((values.target, calls, passed_ms))
        elif values.op == CALL:
            ways.append((values.target, (*calls, number + 1)[-DEEPEST_CALL:], passed_ms))
    return False
