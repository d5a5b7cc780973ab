"""Words of a leader in a row, whose jumps are counted from their own place, and the flow words among them."""

from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import NamedTuple

from motorcade.program.conditions import (
    COMPARISONS,
    AnyOf,
    Chance,
    Condition,
    Counted,
    Not,
    Sensing,
)
from motorcade.program.flow_steps import ChangeStep, FlowStep, SetStep
from motorcade.program.steps import Step, own_fields
from motorcade.words.flow import (
    ABOVE,
    ADD,
    CHANCE,
    CONDITIONS,
    COUNT,
    COUNTER,
    COUNTERS,
    JUMP,
    OPS,
    RANDOM,
    SET,
    TAKE,
)
from motorcade.words.formats import FLOW

CONDITION_NUMBERS = {name: number for number, name in CONDITIONS}
_OPS = {name: op for op, name in OPS}


class ToldStep(NamedTuple):
    """A step that followers are told, and where it stands; None: the followers' own steps in turn."""

    step: Step | None
    path: str
    id: str | None


class Instruction(NamedTuple):
    """A leader word without its target, and the step that it comes from.

    ``to`` is how many words further a jump goes, the name of the function that is called, what a tell tells, or None
    for a word that has no target or has it already.
    """

    word: int
    path: str
    id: str | None
    to: int | str | ToldStep | None = None


class Fragment(NamedTuple):
    """The words of some steps.

    Attributes:
        code: the words; only once each where ``size`` is larger, which is too much for any car.
        size: how many there are.
        counters: how many counters they use beside those of the program.
        falls: whether the car can come to what stands behind them.
        takes_time: whether there is a state among them.
    """

    code: list[Instruction]
    size: int = 0
    counters: int = 0
    falls: bool = True
    takes_time: bool = False


NOTHING = Fragment([])
IN_TURN_STEP = ToldStep(None, "", None)


def drawn_below(percent: float) -> int:
    """Return the value of a word whose draws, 0 to 255, are below it in so many percent."""
    return round(percent * 256 / 100)


@lru_cache(maxsize=4096)
def flow_word(op: int, **values: int) -> int:
    """Return a flow word with these values of its fields."""
    return FLOW.encode(op=op, **{name: int(value) for name, value in values.items()})


def raw_word(step: FlowStep) -> int:
    """Return the word of a step that is one flow word."""
    values = {own.name: getattr(step, own.name) for own in own_fields(FlowStep)}
    return flow_word(**values | {"op": _OPS[step.op], "condition": CONDITION_NUMBERS[step.condition]})


def jump_where(atom: Condition, holds: bool, numbers: Mapping[str, int]) -> int:
    """Return the word that jumps where a condition holds, or where it doesn't."""
    match atom:
        case Counted(name, comparison, value):
            level = COMPARISONS.index(comparison)
            number = numbers[name]
            return flow_word(JUMP, condition=COUNTER, if_not=not holds, level=level, counter=number, value=value)
        case Chance(percent):
            return flow_word(JUMP, condition=CHANCE, if_not=not holds, value=drawn_below(percent))
        case Sensing(sense, level):
            return flow_word(JUMP, condition=CONDITION_NUMBERS[sense], if_not=not holds, level=level)
    raise TypeError(atom)


def jumps_where(
    condition: Condition, holds: bool, numbers: Mapping[str, int], path: str, step_id: str | None
) -> tuple[list[Instruction], list[int]]:
    """Return the jumps that leave where a condition holds (or doesn't), and the positions of those that leave."""
    if isinstance(condition, Not):
        return jumps_where(condition.condition, not holds, numbers, path, step_id)
    if not condition.parts:
        return [Instruction(jump_where(condition, holds, numbers), path, step_id)], [0]
    code: list[Instruction] = []
    exits: list[int] = []
    past: list[int] = []
    for number, part in enumerate(condition.parts, start=1):
        # One that holds decides any, one that doesn't decides all; the others are decided by the last.
        leaves = isinstance(condition, AnyOf) == holds or number == len(condition.parts)
        made, out = jumps_where(part, holds == leaves, numbers, path, step_id)
        places = exits if leaves else past
        places += [len(code) + place for place in out]
        code += made
    aim(code, past, len(code))
    return code, exits


def loop_words(
    times: int, inside: int, path: str, step_id: str | None, size: int
) -> tuple[Instruction, list[Instruction]]:
    """Return the word before ``size`` words that are done some times, and those behind them.

    ``inside`` is how many counters these words use by themselves.
    """
    number = (COUNTERS - 1 - inside) % COUNTERS
    begin = Instruction(flow_word(COUNT, level=SET, counter=number, value=times), path, step_id)
    take = Instruction(flow_word(COUNT, level=TAKE, counter=number, value=1), path, step_id)
    word = flow_word(JUMP, condition=COUNTER, level=ABOVE, counter=number)
    return begin, [take, Instruction(word, path, step_id, -size - 1)]


def count_word(step: SetStep | ChangeStep, numbers: Mapping[str, int]) -> int:
    """Return the word that sets or changes a counter."""
    number = numbers[step.counter]
    if isinstance(step, ChangeStep):
        level = ADD if step.by >= 0 else TAKE
        return flow_word(COUNT, level=level, counter=number, value=abs(step.by))
    if step.to is None:
        return flow_word(COUNT, level=RANDOM, counter=number, value=step.random)
    return flow_word(COUNT, level=SET, counter=number, value=step.to)


def one_word(word: int, path: str, step: Step, to: ToldStep | None = None) -> Fragment:
    """Return the fragment of one flow word."""
    return Fragment([Instruction(word, path, step.id, to)], 1)


def joined(first: Fragment, second: Fragment) -> Fragment:
    """Return two fragments, one behind the other."""
    counters = max(first.counters, second.counters)
    return first._replace(code=first.code + second.code, size=first.size + second.size, counters=counters)


def aim(code: list[Instruction], exits: Iterable[int], target: int) -> None:
    """Let jumps, which stand at the positions ``exits``, go to a position."""
    for place in exits:
        code[place] = code[place]._replace(to=target - place)


def without_last_jump(code: list[Instruction]) -> list[Instruction]:
    """Return the words without a last one that only begins again: behind the last word comes the first one anyway."""
    if len(code) > 1 and code[-1].to == 1 - len(code) and code[-1].word == flow_word(JUMP):
        return code[:-1]
    return code


def calls_in(code: Iterable[Instruction]) -> set[str]:
    """Return the names of the functions that are called."""
    return {instruction.to for instruction in code if isinstance(instruction.to, str)}


def deepest_calls(main: Fragment, functions: Mapping[str, Fragment]) -> list[Instruction]:
    """Return the calls that lead deepest, the first one in the program itself."""
    made: dict[str, list[Instruction]] = {}

    def chain(code: Iterable[Instruction]) -> list[Instruction]:
        longest: list[Instruction] = []
        for instruction in code:
            if isinstance(instruction.to, str):
                if instruction.to not in made:
                    made[instruction.to] = chain(functions[instruction.to].code)
                longest = max(longest, [instruction, *made[instruction.to]], key=len)
        return longest

    return chain(main.code)
