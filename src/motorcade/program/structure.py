"""Find the steps that the words of a leader that decides come from.

How it works
============

The words are read in order, and each construct is found by the words that `motorcade.program.leader` makes of it: a
loop by the jump that goes back to its first word, a counted one by the word before it too, an ``if`` by the jumps that
leave it, a function by its calls, a long step that a condition ends by the jumps between its states. Jumps in a row
that ask one thing after another become one condition: two jumps to the same place ask 'any', and a jump past the next
one, whose place is behind both, asks for what neither of them does.

A word that is part of no such construct becomes a step `flow`, whose fields are the word's. Whether the steps are right
is not decided here: `motorcade.program.decompiler` compiles them, and names the first word that came out otherwise. The
construct around that word is then read as single words (``plain``).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from motorcade.program.conditions import (
    COMPARISONS,
    All,
    AnyOf,
    Chance,
    Condition,
    Counted,
    Not,
    Sensing,
)
from motorcade.program.flow_steps import (
    ChangeStep,
    DoStep,
    FlowStep,
    IfStep,
    SetStep,
    TellStep,
)
from motorcade.program.fragments import drawn_below
from motorcade.program.parts import lasting, step_in, to_ms
from motorcade.program.reactions import parts_at_once, with_unless
from motorcade.program.steps import (
    AccompanyingStep,
    RepeatStep,
    Step,
    TogetherStep,
    is_deciding,
    own_fields,
)
from motorcade.words.flow import (
    ABOVE,
    ADD,
    ALWAYS,
    CALL,
    CHANCE,
    CONDITIONS,
    COUNT,
    COUNTER,
    IN_TURN,
    JUMP,
    OPS,
    RANDOM,
    RETURN,
    SET,
    TAKE,
    TELL,
)
from motorcade.words.formats import FLOW, STATE

_CONDITION_NAMES = dict(CONDITIONS)
_OP_NAMES = dict(OPS)
_UNTIL_BITS = sum(STATE.field(name).word_mask for name in ("until", "until_not", "until_level"))
# The counters' names; pupils choose better ones.
COUNTER_NAMES = ("a", "b", "c", "d")


class Extent(NamedTuple):
    """The words of one construct, from its first one to the one behind its last."""

    start: int
    end: int


class _Test(NamedTuple):
    """Jumps in a row: where they lead if ``taken`` holds, and the index of the word behind them."""

    taken: Condition
    target: int
    end: int


class Structure:
    """The steps of a leader's words.

    Args:
        words: the leader's words.
        plain: the first words of constructs that are read as single words.
        told: the steps of the follower words that tells may name, by their index.
        own: how many follower words are the followers' own.

    Attributes:
        leader: the leader's steps; ``functions`` those of its functions.
        extents: the constructs that were found.
    """

    def __init__(
        self,
        words: Sequence[int],
        levels_ms: tuple[int, ...],
        plain: frozenset[int],
        told: dict[int, Step],
        own: int,
    ) -> None:
        self.extents: list[Extent] = []
        self.functions: dict[str, tuple[Step, ...]] = {}
        self._words = words
        self._levels_ms = levels_ms
        self._plain = plain
        self._told = told
        self._own = own
        self._values: list[Any] = [FLOW.decode(word) if word >> 31 else None for word in words]
        starts = sorted({values.target for values in self._values if values and values.op == CALL})
        # A function is called from somewhere else, and begins behind the words that are executed first.
        self._names = {start: f"part_{number}" for number, start in enumerate(starts, start=1) if start not in plain}
        self._wraps = not self._names
        ends = [*self._names, len(words)]
        end = ends[0]
        if self._names and end and self._is_jump(end - 1, 0):
            end -= 1
        self.leader = tuple(self._row(0, end))
        for start, behind in zip(self._names, ends[1:], strict=True):
            end = behind
            values = self._values[end - 1]
            if values and values.op == RETURN and end - 1 > start:
                end -= 1
            self.functions[self._names[start]] = tuple(self._row(start, end))
        steps = [*self.leader, *(step for inside in self.functions.values() for step in inside)]
        if not any(map(is_deciding, steps)):
            # Words that begin again at the first one anyway: so a leader that decides nothing is marked as deciding.
            self.leader = (RepeatStep(None, self.leader),)

    def _row(self, start: int, end: int) -> list[Step]:
        steps = []
        at = start
        while at < end:
            step, behind = self._construct(at, end)
            if behind > at + 1:
                self.extents.append(Extent(at, behind))
            steps.append(step)
            at = behind
        return steps

    def _construct(self, at: int, end: int) -> tuple[Step, int]:
        """Return the construct that begins at a word, and the index of the word behind it."""
        if at not in self._plain:
            for find in (self._loop, self._counted, self._ended, self._choice, self._simple):
                found = find(at, end)
                if found:
                    return found
        if self._values[at]:
            return self._flow(at), at + 1
        return self._state(self._words[at]), at + 1

    def _state(self, word: int) -> Step:
        step = step_in(word, self._levels_ms)
        until = self._until(word)
        return replace(step, until=until) if until is not None else step

    def _until(self, word: int) -> Condition | None:
        values = STATE.decode(word)
        if not values.until:
            return None
        made: Condition = Sensing(_CONDITION_NAMES[values.until], values.until_level)
        return Not(made) if values.until_not else made

    def _flow(self, at: int) -> Step:
        values = self._values[at]
        given = {own.name: getattr(values, own.name) for own in own_fields(FlowStep)}
        return FlowStep(**given | {"op": _OP_NAMES[values.op], "condition": _CONDITION_NAMES[values.condition]})

    def _is_jump(self, at: int, target: int | None = None, condition: int = ALWAYS) -> bool:
        values = self._values[at] if at < len(self._words) else None
        if not values or values.op != JUMP or values.condition != condition:
            return False
        return target is None or values.target == target

    def _asked(self, at: int) -> Condition | None:
        """Return the condition of a jump or a call; None where it has none that a program can say."""
        values = self._values[at]
        made: Condition
        if values.condition == COUNTER:
            made = Counted(COUNTER_NAMES[values.counter], COMPARISONS[values.level], values.value)
        elif values.condition == CHANCE:
            percents = [percent for percent in range(1, 100) if drawn_below(percent) == values.value]
            halves = [percent + 0.5 for percent in range(1, 99) if drawn_below(percent + 0.5) == values.value]
            if not percents + halves:
                return None
            made = Chance((percents + halves)[0])
        elif values.condition == ALWAYS:
            return None
        else:
            made = Sensing(_CONDITION_NAMES[values.condition], values.level)
        return Not(made) if values.if_not else made

    def _test(self, at: int, end: int, leads_to: int | None = None) -> _Test | None:
        """Return the longest row of jumps that is one condition; all lead to ``leads_to`` where that is given."""
        found = None
        terms: list[_Test] = []
        begins: list[int] = []
        while at < end and self._values[at] and self._values[at].op == JUMP:
            taken = self._asked(at)
            later = self._values[at:]
            # No condition reaches over a word to which a later one jumps.
            if taken is None or (
                terms and any(values and values.op == JUMP and values.target == at for values in later)
            ):
                break
            terms.append(_Test(taken, self._target(at, end), at + 1))
            begins.append(at)
            at += 1
            while len(terms) > 1 and (merged := _merged(*terms[-2:])):
                terms[-2:] = [merged]
            if len(terms) == 1 and leads_to in (None, terms[0].target):
                found = terms[0]
        return found

    def _target(self, at: int, end: int) -> int:
        """Return where a jump leads. Behind the last word comes the first one, so the first may mean the end."""
        target: int = self._values[at].target
        if target == 0 and self._wraps and not self._is_loop_to_start(at):
            return len(self._words)
        return target

    def _is_loop_to_start(self, at: int) -> bool:
        """Whether a jump to the first word ends a loop there, which a condition at its beginning leaves."""
        if at == 0:
            return True
        return self._values[at].condition == ALWAYS and self._test(0, at, at + 1) is not None

    def _counted(self, at: int, end: int) -> tuple[Step, int] | None:
        """Find a repeat whose turns are counted."""
        found = self._counted_run(at, end)
        if not found:
            return None
        times, begin, behind = found
        if self._leaving(begin, behind):
            return None
        return RepeatStep(times, tuple(self._row(begin, behind - 2))), behind

    def _counted_run(self, at: int, end: int) -> tuple[int, int, int] | None:
        """Return how often the words behind a word are done, the first of them, and the index behind the loop."""
        values = self._values[at]
        if not values or (values.op, values.level) != (COUNT, SET) or values.value < 2 or at in self._plain:
            return None
        for last in range(at + 2, end):
            jump = self._values[last]
            take = self._values[last - 1]
            if not self._is_jump(last, at + 1, COUNTER) or not take:
                continue
            wanted = (values.counter, ABOVE, 0, 0)
            if (jump.counter, jump.level, jump.value, jump.if_not) != wanted:
                continue
            if (take.op, take.level, take.counter, take.value) == (COUNT, TAKE, values.counter, 1):
                return values.value, at + 1, last + 1
        return None

    def _leaving(self, begin: int, behind: int) -> bool:
        """Whether the words of a counted loop are one state that a condition ends, and a jump that leaves the loop."""
        if behind - begin != 4 or self._values[begin] or not self._words[begin] & _UNTIL_BITS:
            return False
        values = self._values[begin + 1]
        return bool(values and values.op == JUMP and self._same_condition(begin, begin + 1, 0))

    def _same_condition(self, state: int, jump: int, is_opposite: int) -> bool:
        """Whether a jump asks what ends a state, or the opposite of it."""
        ending = STATE.decode(self._words[state])
        values = self._values[jump]
        if not values or values.op != JUMP or not ending.until:
            return False
        asked = (values.condition, values.if_not ^ is_opposite, values.level)
        return asked == (ending.until, ending.until_not, ending.until_level)

    def _ended(self, at: int, end: int) -> tuple[Step, int] | None:
        """Find a step that a condition ends and that is more than one word."""
        states: list[int] = []
        here = at
        out: int | None = None
        is_endless = False
        while here < end:
            run = self._counted_run(here, end)
            count = 1
            state = here
            if run and self._leaving(run[1], run[2]):
                count, state, here = run
                target = self._target(state + 1, end)
                if out not in (None, target):
                    return None
                out = target
            else:
                here += 1
            if self._values[state] or not self._words[state] & _UNTIL_BITS:
                return None
            if states and (self._words[states[0]] ^ self._words[state]) & _UNTIL_BITS:
                return None
            states += [state] * count
            if here == out:
                break
            if here < end and self._same_condition(state, here, 1) and self._values[here].target == state:
                here += 1
                is_endless = True
                break
            if count > 1:
                # The jump that leaves the step is inside the loop.
                continue
            if here >= end or not self._same_condition(state, here, 0):
                break
            target = self._target(here, end)
            if out not in (None, target):
                return None
            out = target
            here += 1
        if len(states) + is_endless < 2 or out not in (None, here):
            return None
        return self._long_step(states, is_endless), here

    def _long_step(self, states: list[int], is_endless: bool) -> Step:
        """Return the step of several states; its parts go on from one to the next."""
        made = [parts_at_once(step_in(self._words[state], self._levels_ms)) for state in states]
        until = self._until(self._words[states[0]])
        if len(made[0]) == 1:
            return replace(self._long_part(made[0][0], made, is_endless), until=until)
        parts = []
        for part in made[0]:
            if not isinstance(part, AccompanyingStep):
                part = self._long_part(part, made, is_endless)
            parts.append(part)
        parts = with_unless(parts)
        if len(parts) == 1:
            return replace(parts[0], until=until)
        return TogetherStep(tuple(parts), until=until)

    def _long_part(self, part: Step, made: Sequence[Sequence[Step]], is_endless: bool) -> Step:
        """Return a part with the time for which it goes on through steps; without one where only a condition ends it.

        Args:
            made: the parts of each state in order.
            is_endless: whether the last state goes on until the condition holds.
        """
        total_ms = last_ms = 0
        for parts in made:
            same = [other for other in parts if _is_same(other, part)]
            if not same:
                return lasting(part, total_ms)
            last_ms = to_ms(getattr(same[0], "seconds", None) or 0) or 0
            total_ms += last_ms
        if is_endless and last_ms == self._levels_ms[-1]:
            return lasting(part, None)
        return lasting(part, total_ms)

    def _loop(self, at: int, end: int) -> tuple[Step, int] | None:
        """Find a loop that begins at a word: for ever, or until a condition holds."""
        values = self._values[at]
        if values and values.op == JUMP and values.condition and values.target == at:
            taken = self._asked(at)
            return (RepeatStep(None, (), until=_negated(taken)), at + 1) if taken is not None else None
        backs = [place for place in range(at, end) if self._is_jump(place, at)]
        if at == 0 and self._wraps:
            backs = [place for place in backs if self._is_loop_to_start(place)]
        if not backs:
            return None
        back = backs[-1]
        test = self._test(at, back, back + 1)
        if test:
            return RepeatStep(None, tuple(self._row(test.end, back)), until=test.taken), back + 1
        return RepeatStep(None, tuple(self._row(at, back))), back + 1

    def _choice(self, at: int, end: int) -> tuple[Step, int] | None:
        """Find an if, or a function that is called only where a condition holds."""
        values = self._values[at]
        if not values:
            return None
        if values.op == CALL and values.condition and values.target in self._names:
            asked = self._asked(at)
            return (IfStep(asked, (DoStep(self._names[values.target]),)), at + 1) if asked is not None else None
        test = self._test(at, end)
        if not test or not test.end <= test.target <= end:
            return None
        middle = test.target
        if middle - 1 >= test.end and self._is_jump(middle - 1):
            behind = self._target(middle - 1, end)
            if middle < behind <= end:
                then = self._row(test.end, middle - 1)
                other = self._row(middle, behind)
                return IfStep(_negated(test.taken), tuple(then), tuple(other)), behind
        return IfStep(_negated(test.taken), tuple(self._row(test.end, middle))), middle

    def _simple(self, at: int, end: int) -> tuple[Step, int] | None:
        """Find a word that is a step by itself."""
        values = self._values[at]
        if not values:
            return None
        if values.op == CALL and not values.condition and values.target in self._names:
            return DoStep(self._names[values.target]), at + 1
        if values.op == COUNT:
            name = COUNTER_NAMES[values.counter]
            steps: dict[int, Step] = {
                SET: SetStep(name, values.value),
                ADD: ChangeStep(name, values.value),
                TAKE: ChangeStep(name, -values.value),
                RANDOM: SetStep(name, random=values.value),
            }
            return steps[values.level], at + 1
        if values.op == TELL and values.target == IN_TURN and self._own:
            return TellStep(None), at + 1
        if values.op == TELL and values.target in self._told:
            return TellStep(self._told[values.target]), at + 1
        return None


def _merged(first: _Test, second: _Test) -> _Test | None:
    """Return two rows of jumps, one behind the other, as one; None where they aren't one condition."""
    if first.target == second.target:
        return _Test(AnyOf(_flat(AnyOf, first.taken, second.taken)), second.target, second.end)
    if first.target == second.end:
        return _Test(All(_flat(All, _negated(first.taken), second.taken)), second.target, second.end)
    return None


def _flat(kind: type[All] | type[AnyOf], *conditions: Condition) -> tuple[Condition, ...]:
    parts: list[Condition] = []
    for condition in conditions:
        parts += condition.parts if isinstance(condition, kind) else [condition]
    return tuple(parts)


def _negated(condition: Condition) -> Condition:
    """Return the opposite of a condition, with no not but around single ones."""
    if isinstance(condition, Not):
        return condition.condition
    if isinstance(condition, All):
        return AnyOf(tuple(map(_negated, condition.conditions)))
    if isinstance(condition, AnyOf):
        return All(tuple(map(_negated, condition.conditions)))
    return Not(condition)


def _is_same(some: Step, other: Step) -> bool:
    """Whether two steps are the same but for their seconds."""
    if type(some) is not type(other):
        return False
    names = [own.name for own in own_fields(type(some)) if own.name != "seconds"]
    return all(getattr(some, name) == getattr(other, name) for name in names)
