"""Compile the leader's steps to its words: states, and the flow words of a leader that decides.

How it works
============

Each step becomes a *fragment*: words in a row whose jumps are counted from their own place. So a fragment may be
repeated, and put behind or into another, as it is. Targets become the indices of words at the very end, and so do the
places of functions and of the words that followers are told.

The fewest words win:

- A repeat is unrolled, or counted by a counter that the program does not use. Counters are given from the last one
  down: a loop takes the one below those of the loops inside it, so that loops around a call are never in the way of
  the function. ``spare`` says how many of them the fragment may use.
- A function's steps stand where it is called, if that takes no more words than a call; else the function stands behind
  the program, with a return.
- A step that a condition ends is cut into states as any step is. Behind each of them but the last a jump leaves the
  step where the condition holds; equal states in a row may be counted. Where the step has no seconds, a jump goes back
  to its last state for as long as the condition does not hold.

A program without any step that decides has states alone, as any car knows them: there a repeat is always unrolled.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from itertools import groupby

from motorcade.config.profile import Profile
from motorcade.program.conditions import (
    Condition,
    Sensing,
    without_double_not,
)
from motorcade.program.diagnostics import (
    DELETE,
    Diagnostic,
    Fix,
    error,
    warning,
)
from motorcade.program.expansion import Expander, Item
from motorcade.program.flow_steps import TAKEN, ChangeStep, DoStep, FlowStep, IfStep, SetStep, TellStep
from motorcade.program.fragments import (
    CONDITION_NUMBERS,
    IN_TURN_STEP,
    NOTHING,
    Fragment,
    Instruction,
    ToldStep,
    aim,
    calls_in,
    count_word,
    deepest_calls,
    flow_word,
    joined,
    jump_where,
    jumps_where,
    loop_words,
    one_word,
    raw_word,
    without_last_jump,
)
from motorcade.program.leader_checks import (
    DEEPEST_CALL,
    CounterNumbers,
    hurried_tells,
    timeless_loops,
    wrong_flow_steps,
)
from motorcade.program.model import Program, placed_steps, without_ids
from motorcade.program.parts import ENDLESS_MS, MOST_PIECES, control_word, cut, slice_of
from motorcade.program.steps import RepeatStep, Step, is_deciding, walk
from motorcade.words.flow import (
    CALL,
    COUNTERS,
    JUMP,
    MOST_COUNT,
    RETURN,
    TELL,
)
from motorcade.words.formats import FLOW, STATE

_TARGET_AT = FLOW.field("target").low
_UNTIL_AT, _NOT_AT, _LEVEL_AT = (STATE.field(name).low for name in ("until", "until_not", "until_level"))
_IF_NOT = FLOW.field("if_not").word_mask
# States in a row, with the jumps behind them, are counted where they are more words than this.
_COUNTED_RUN = 5


class Leader:
    """The leader's words.

    Attributes:
        words: the words; none where there are errors.
        origins: the path and id of the step that each comes from.
        count: how many words there are, also where they are too many.
        decides: whether the leader decides.
        diagnostics: what is wrong with its steps; ``remarks`` are found when the words are made.
        inexpressible: the steps that no sum of levels can express, by their place.
        told: what it tells its followers; ``has_tells`` is true also where a word is given as it is.
    """

    def __init__(self, program: Program, profile: Profile) -> None:
        self.words: list[int] = []
        self.origins: list[tuple[str, str | None]] = []
        self.diagnostics: list[Diagnostic] = []
        self._program = program
        self._profile = profile
        self._expander = Expander(profile)
        self._levels_ms = profile.durations_ms
        self._levels = profile.duration_levels
        self._states: dict[tuple[str, bool], Fragment] = {}
        self._made: dict[tuple[str, int], Fragment] = {}
        self.inexpressible: dict[str, Item] = {}
        self._found: dict[tuple[str, str], Diagnostic] = {}
        # Repeats that would be fewer words if there were a counter left.
        self._uncounted: dict[tuple[str, str], Diagnostic] = {}
        self._timeless: dict[str, str | None] = {}
        self._called: frozenset[str] = frozenset()
        self._settled: set[str] = set()
        self._open: list[str] = []
        steps = list(placed_steps(replace(program, followers=None)))
        for path, step in steps:
            self._expander.check_settings(step, path)
        self._flow_steps: list[tuple[str, FlowStep]] = [
            (path, step) for path, step in steps if isinstance(step, FlowStep)
        ]
        self.decides = any(is_deciding(step) for _, step in steps)
        self._counters = CounterNumbers(steps if self.decides else ())
        self._numbers = self._counters.numbers
        self._spare = self._counters.spare
        for name in program.functions:
            if name in TAKEN or name in self._numbers:
                self._find(error("name-is-taken", f"functions.{name}", name=name))
        self._main, self._functions = self._fewest_words(steps)
        self.count = self._size_of(self._main, self._functions)
        if self.count > MOST_PIECES:
            self._found |= self._uncounted
        self.diagnostics = [*self._expander.diagnostics, *self._counters.problems, *self._found.values()]
        self.remarks: list[Diagnostic] = []
        code, _ = self._laid_out()
        self.told = list(dict.fromkeys(instruction.to for instruction in code if isinstance(instruction.to, ToldStep)))
        self.has_tells = bool(self.told) or any(step.op == "tell" for _, step in self._flow_steps)

    @property
    def counters(self) -> tuple[str, ...]:
        """The names of the counters in the finished words, by their numbers; "" for one without a name."""
        names = self._counters.names
        return tuple(names.get(number, "") for number in range(COUNTERS)) if names else ()

    def costs(self) -> list[int]:
        """How many words each step of the leader takes, in its order."""
        return [self._step(step, f"leader[{number}]", 0).size for number, step in enumerate(self._program.leader)]

    def finish(self, targets: Mapping[ToldStep, int], follower_words: int) -> None:
        """Set the words, and warn of what may surprise.

        Args:
            targets: for each step that is told the bits that name its word in a tell.
            follower_words: how many follower words there are.
        """
        code, places = self._laid_out()
        counters = self._counters.in_order(code)
        for number, (word, path, step_id, to) in enumerate(code):
            bits = 0
            word = counters.get(word, word)
            if isinstance(to, int):
                # Behind the last word comes the first one; a last jump to it may be gone.
                target = number + to if number + to < len(code) else 0
                bits = target << _TARGET_AT
            elif isinstance(to, str):
                bits = places[to] << _TARGET_AT
            elif to:
                bits = targets[to]
            self.words.append(word | bits)
            self.origins.append((path, step_id))
        if self.decides:
            timeless = dict(self._timeless)
            if not self._main.takes_time and self._main.falls and self.words:
                timeless["leader"] = None
            self.remarks = [
                *wrong_flow_steps(self._flow_steps, len(self.words), follower_words),
                *timeless_loops(timeless, self.origins),
                *hurried_tells(self.words, self.origins, self._profile),
            ]

    def _find(self, problem: Diagnostic) -> None:
        # A function is compiled for each place where its steps stand.
        self._found.setdefault((problem.code, problem.path), problem)

    def _fewest_words(self, steps: Iterable[tuple[str, Step]]) -> tuple[Fragment, dict[str, Fragment]]:
        """Return the leader's fragment and those of the functions that are called."""
        self._sites = Counter(step.function for _, step in steps if isinstance(step, DoStep))
        for name in self._program.functions:
            self._settle(name)
        best = self._compiled()
        for name in sorted(self._called):
            if len(deepest_calls(*best)) <= DEEPEST_CALL:
                return best
            # A function whose steps stand where it is called is no call.
            self._called -= {name}
            tried = self._compiled()
            if self._size_of(*tried) <= MOST_PIECES:
                best = tried
            else:
                self._called |= {name}
        calls = deepest_calls(*best)
        if len(calls) > DEEPEST_CALL:
            deepest = calls[DEEPEST_CALL]
            self._find(error("calls-too-deep", deepest.path, deepest.id, most=DEEPEST_CALL, depth=len(calls)))
        return best

    def _settle(self, name: str) -> None:
        """Decide whether a function is called, after those that it does itself."""
        if name in self._settled or name not in self._program.functions:
            return
        self._settled.add(name)
        for _, step in walk(self._program.functions[name], ""):
            if isinstance(step, DoStep):
                self._settle(step.function)
        size = self._function(name, self._spare).size
        count = self._sites[name]
        if count * size > count + size + 1:
            self._called |= {name}

    def _compiled(self) -> tuple[Fragment, dict[str, Fragment]]:
        self._made.clear()
        functions = {name: self._function(name, self._spare) for name in self._program.functions}
        main = self._row(self._program.leader, "leader", self._spare)
        used: set[str] = set()
        found = calls_in(main.code)
        while found - used:
            name = (found - used).pop()
            used.add(name)
            found |= calls_in(functions[name].code)
        return main, {name: made for name, made in functions.items() if name in used}

    def _size_of(self, main: Fragment, functions: dict[str, Fragment]) -> int:
        if not functions and main.size == len(main.code):
            return len(without_last_jump(main.code))
        size = main.size + (main.falls and bool(functions))
        return size + sum(function.size + function.falls for function in functions.values())

    def _laid_out(self) -> tuple[list[Instruction], dict[str, int]]:
        """Return all words in their order, and the index of each function's first one."""
        main = self._main
        if not self._functions:
            return without_last_jump(main.code), {}
        code = list(main.code)
        if main.falls:
            code.append(Instruction(flow_word(JUMP), "leader", None))
        places = {}
        for name, function in self._functions.items():
            places[name] = len(code)
            code += function.code
            if function.falls:
                code.append(Instruction(flow_word(RETURN), f"functions.{name}", None))
        return code, places

    def _function(self, name: str, spare: int) -> Fragment:
        """Return the steps of a function, which are made once for each number of spare counters."""
        key = name, spare
        if key not in self._made:
            self._open.append(name)
            self._made[key] = self._row(self._program.functions[name], f"functions.{name}", spare)
            self._open.pop()
        return self._made[key]

    def _row(self, steps: Sequence[Step], path: str, spare: int) -> Fragment:
        code: list[Instruction] = []
        size = counters = 0
        falls = True
        takes_time = False
        for number, step in enumerate(steps):
            here = f"{path}[{number}]"
            made = self._step(step, here, spare)
            if not falls and made.code:
                self._find(warning("never-reached", here, step.id).with_fixes(Fix(DELETE)))
            if size <= MOST_PIECES:
                code += made.code
            size += made.size
            counters = max(counters, made.counters)
            falls = falls and made.falls
            takes_time = takes_time or made.takes_time
        return Fragment(code, size, counters, falls, takes_time)

    def _step(self, step: Step, path: str, spare: int) -> Fragment:
        match step:
            case RepeatStep():
                return self._repeat(step, path, spare)
            case IfStep():
                return self._if(step, path, spare)
            case DoStep():
                return self._do(step, path, spare)
            case SetStep() | ChangeStep():
                return one_word(count_word(step, self._numbers), path, step)
            case TellStep():
                return self._tell(step, path)
            case FlowStep():
                return one_word(raw_word(step), path, step)
        key = path, step.until is not None and spare > 0
        if key not in self._states:
            self._states[key] = self._timed(step, path, spare)
        return self._states[key]

    def _timed(self, step: Step, path: str, spare: int) -> Fragment:
        """Return the states of a step that takes time by itself."""
        item = self._expander.item(step, path, accept_ir=False, forward=True)
        if item is None:
            return NOTHING
        if step.until is not None:
            return self._ended(step.until, item, spare)
        if item.total_ms > MOST_PIECES * self._levels_ms[-1]:
            return self._too_long(item.total_ms)
        pieces = cut(item.durations_ms, self._levels_ms[1:], self._levels_ms)
        if pieces is None:
            self.inexpressible[path] = item
            return Fragment([], 1, takes_time=True)
        code = [Instruction(word, path, step.id) for word in self._words(item, pieces)]
        return Fragment(code, len(code), takes_time=True)

    def _too_long(self, total_ms: int) -> Fragment:
        """Return a fragment of at least as many states as a duration takes that no image can hold."""
        return Fragment([], -(-total_ms // self._levels_ms[-1]), takes_time=True)

    def _words(self, item: Item, pieces: Sequence[int]) -> list[int]:
        """Return the words of an item that is cut into pieces; an item of 0 s has none, and takes one word."""
        words = []
        begin_ms = 0
        for length_ms in pieces or (0,):
            parts = item.parts
            if item.total_ms > length_ms > 0:
                parts = slice_of(parts, begin_ms, length_ms)
            words.append(control_word(parts, self._levels, 0, 1))
            begin_ms += length_ms
        return words

    def _ended(self, until: Condition, item: Item, spare: int) -> Fragment:
        """Return the states of a step that a condition ends, with the jumps that leave it early."""
        atom, holds = without_double_not(until)
        if not isinstance(atom, Sensing):
            wrong = "until-several" if atom.parts else "until-not-sensed"
            self._find(error(wrong, f"{item.path}.until", item.id))
            return NOTHING
        bits = CONDITION_NUMBERS[atom.sense] << _UNTIL_AT | (not holds) << _NOT_AT | atom.level << _LEVEL_AT
        longest_ms = self._levels_ms[-1]
        finite = tuple(duration_ms for duration_ms in item.durations_ms if duration_ms < ENDLESS_MS)
        is_endless = len(finite) < len(item.durations_ms)
        if max(finite, default=0) > MOST_PIECES * longest_ms:
            return self._too_long(max(finite))
        pieces = cut(finite, self._levels_ms[1:], self._levels_ms)
        if pieces is None:
            self.inexpressible[item.path] = item._replace(durations_ms=finite, total_ms=max(finite))
            return Fragment([], 1, takes_time=True)
        if is_endless:
            pieces = (*pieces, longest_ms)
        code: list[Instruction] = []
        exits: list[int] = []
        leaves = Instruction(jump_where(atom, holds, self._numbers), item.path, item.id)
        stays = leaves._replace(word=leaves.word ^ _IF_NOT, to=-1)
        words = [word | bits for word in self._words(item, pieces)]
        counters = done = 0
        for word, run in groupby(words):
            count = len(list(run))
            done += count
            state = Instruction(word, item.path, item.id)
            is_last = done == len(words)
            if count * 2 - is_last > _COUNTED_RUN and spare:
                counters = 1
                begin, end = loop_words(count, 0, item.path, item.id, 2)
                code += [begin, state, leaves, *end]
                exits.append(len(code) - len(end) - 1)
                count = 0
            for _ in range(count):
                exits.append(len(code) + 1)
                code += [state, leaves]
        if is_endless:
            code[-1] = stays
            exits.pop()
        elif exits[-1] == len(code) - 1:
            code.pop()
            exits.pop()
        aim(code, exits, len(code))
        return Fragment(code, len(code), counters, takes_time=True)

    def _repeat(self, step: RepeatStep, path: str, spare: int) -> Fragment:
        """Return a loop: for ever, until a condition holds, or a number of times."""
        inside = f"{path}.repeat.steps"
        body = self._row(step.steps, inside, spare)
        if step.times is None:
            if not body.takes_time:
                self._timeless[path] = step.id
            return self._loop_until(step, body, path)
        size = body.size * step.times
        if step.times == 1 or not body.size or not body.falls:
            return body
        if self.decides:
            if body.counters == spare > 0:
                counted = self._counted(self._row(step.steps, inside, spare - 1), step.times, path, step.id)
            else:
                counted = self._counted(body, step.times, path, step.id)
            if counted.size < size and counted.counters <= spare:
                return counted
            if counted.size < size:
                problem = error("no-counter-left", path, step.id, most=COUNTERS)
                self._uncounted["no-counter-left", path] = problem.with_fixes(Fix("times", 1))
        code = body.code
        if size <= MOST_PIECES:
            code = code * step.times
        return body._replace(code=code, size=size)

    def _loop_until(self, step: RepeatStep, body: Fragment, path: str) -> Fragment:
        """Return a loop that ends where the step's condition holds; one without a condition never ends."""
        back = Instruction(flow_word(JUMP), path, step.id)
        if step.until is None:
            code = list(body.code)
            if body.falls:
                code.append(back._replace(to=-len(code)))
            return body._replace(code=code, size=body.size + body.falls, falls=False)
        if not body.code:
            code, exits = jumps_where(step.until, False, self._numbers, path, step.id)
            aim(code, exits, 0)
            return Fragment(code, len(code))
        test, exits = jumps_where(step.until, True, self._numbers, path, step.id)
        code = [*test, *body.code]
        if body.falls:
            code.append(back._replace(to=-len(code)))
        aim(code, exits, len(code))
        return body._replace(code=code, size=len(test) + body.size + body.falls, falls=True)

    def _counted(self, body: Fragment, times: int, path: str, step_id: str | None) -> Fragment:
        """Return a fragment that is done some times; above 255 times by loops inside loops."""
        if times > MOST_COUNT:
            inner = max(number for number in range(1, MOST_COUNT + 1) if times % number == 0)
            if times // inner <= MOST_COUNT:
                return self._counted(self._counted(body, inner, path, step_id), times // inner, path, step_id)
            outer, rest = divmod(times, MOST_COUNT)
            made = self._counted(self._counted(body, MOST_COUNT, path, step_id), outer, path, step_id)
            if rest:
                made = joined(made, self._counted(body, rest, path, step_id))
            return made
        if times == 1:
            return body
        begin, end = loop_words(times, body.counters, path, step_id, body.size)
        return body._replace(code=[begin, *body.code, *end], size=body.size + 3, counters=body.counters + 1)

    def _if(self, step: IfStep, path: str, spare: int) -> Fragment:
        then = self._row(step.then, f"{path}.if.then", spare)
        other = self._row(step.otherwise, f"{path}.if.else", spare)
        if not then.size and not other.size:
            return NOTHING
        test, exits = jumps_where(step.when, not then.size, self._numbers, path, step.id)
        called, _, _, to = then.code[0] if then.code else test[0]
        if len(test) == len(then.code) == 1 and not other.size and isinstance(to, str) and called == flow_word(CALL):
            word = test[0].word ^ flow_word(JUMP) ^ flow_word(CALL) ^ _IF_NOT
            return then._replace(code=[then.code[0]._replace(word=word)], falls=True)
        code = [*test, *then.code]
        size = len(test) + then.size + other.size
        if then.size and other.size and then.falls:
            code.append(Instruction(flow_word(JUMP), path, step.id, len(other.code) + 1))
            size += 1
        if then.size:
            aim(code, exits, len(code))
        code += other.code
        if not then.size:
            aim(code, exits, len(code))
        counters = max(then.counters, other.counters)
        return Fragment(code, size, counters, then.falls or other.falls, then.takes_time or other.takes_time)

    def _do(self, step: DoStep, path: str, spare: int) -> Fragment:
        name = step.function
        if name not in self._program.functions:
            problem = error("unknown-function", path, step.id, name=name)
            known = get_close_matches(name, self._program.functions, 1)
            self._find(problem.with_fixes(*(Fix("function", other) for other in known)))
            return NOTHING
        if name in self._open:
            # Each function of a circle does itself; one of them is enough.
            problem = error("recursion", path, step.id, name=name).with_fixes(Fix(DELETE))
            self._found.setdefault(("recursion", ""), problem)
            return NOTHING
        made = self._function(name, spare)
        if name not in self._called:
            return made
        return made._replace(code=[Instruction(flow_word(CALL), path, step.id, name)], size=1)

    def _tell(self, step: TellStep, path: str) -> Fragment:
        told = IN_TURN_STEP
        if step.step:
            told = ToldStep(without_ids(step.step), f"{path}.tell.step", step.step.id or step.id)
        return one_word(flow_word(TELL), path, step, told)
