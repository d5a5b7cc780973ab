"""Programs that a search tries: drawn at random from the blocks of a mission, or made from another by small changes."""

from collections.abc import Callable
from dataclasses import replace
from random import Random
from typing import Any

from motorcade.errors import MotorcadeError
from motorcade.missions.model import Mission
from motorcade.program.compiler import compile_program
from motorcade.program.conditions import COMPARISONS, SENSES, Chance, Condition, Counted, Not, Sensing
from motorcade.program.flow_steps import (
    ALL_KINDS,
    ChangeStep,
    DoStep,
    IfStep,
    SetStep,
    TellStep,
)
from motorcade.program.model import Followers, Program
from motorcade.program.reactions import with_unless
from motorcade.program.steps import (
    SIMPLE_KINDS,
    AvoidStep,
    DrivingStep,
    RepeatStep,
    Step,
    TogetherStep,
    own_fields,
)

Steps = tuple[Step, ...]
# Draws a step that stands so many blocks deep.
Draw = Callable[[Random, int], Step]
_SECONDS = (1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 30.0, 60.0)
_TIMES = (2, 3, 4, 5, 6, 8, 10, 20)
# Steps in a list that is drawn, and in one that changes may make.
_MOST_DRAWN = 3
_MOST_CHANGED = 12
# Blocks that decide hold others so deep. There is one counter, which is asked for small numbers, and one function.
_DEEPEST = 2
_COUNTER = "count"
_FUNCTION = "own"
_COUNTS = (0, 1, 2, 3, 4, 5, 8)
# Programs that don't compile are drawn again, and so are those that were tried already.
_TRIES = 40


class ProgramSource:
    """Makes programs of the blocks that a mission offers."""

    def __init__(self, mission: Mission) -> None:
        self._mission = mission
        # The images of programs that were made before.
        self._tried: set[bytes] = set()
        self._has_followers = len(mission.mat.starts.leaders) < len(mission.mat.starts)
        kinds = [ALL_KINDS[kind] for kind in mission.palette]
        self._simple = [kind for kind in kinds if kind in SIMPLE_KINDS]
        # Kinds that do something by themselves are drawn alone.
        self._alone = [kind for kind in self._simple if not kind.accompanies] or self._simple
        self._repeats = RepeatStep in kinds
        self._joins = TogetherStep in kinds
        # A drive minds what has bits of its word beside it.
        drives = any(issubclass(kind, DrivingStep) for kind in self._simple)
        self._minds = drives and any(kind.accompanies or kind is AvoidStep for kind in self._simple)
        # What a leader that decides has besides; as in the page, conditions come with the block 'if'.
        self._asks = IfStep in kinds
        self._counts = ChangeStep in kinds
        self._has_function = DoStep in kinds
        self._deciding: list[type[Step]] = [
            kind for kind in (IfStep, SetStep, ChangeStep, TellStep, DoStep) if kind in kinds
        ]
        if self._asks and self._repeats:
            self._deciding.append(RepeatStep)

    def draw(self, random: Random) -> Program:
        """Draw a program."""

        def drawn() -> Program:
            leader = self._drawn(random, self._leader_step)
            steps = self._drawn(random, self._step)
            followers = None
            if self._has_followers:
                followers = Followers(steps, forward=random.random() < 0.7)
            functions = {}
            if self._has_function:
                functions[_FUNCTION] = self._drawn(random, self._leader_step)
            return Program(leader, followers, self._mission.document["profile"], functions=functions)

        return self._compiled(drawn)

    def change(self, random: Random, program: Program) -> Program:
        """Make another program by one change or a few."""

        def changed() -> Program:
            new = program
            while True:
                new = self._changed(random, new)
                if random.random() < 0.5:
                    return new

        return self._compiled(changed)

    def _compiled(self, make: Callable[[], Program]) -> Program:
        """Make programs until one compiles that was not tried; after many, one that compiles will do."""
        fits = None
        for _ in range(_TRIES):
            try:
                program = make()
                image = compile_program(program, self._mission.profile).image
            except (MotorcadeError, ValueError):
                continue
            fits = program
            if image not in self._tried:
                self._tried.add(image)
                break
        if fits:
            return fits
        followers = None
        if self._has_followers:
            followers = Followers([])
        return Program([], followers, self._mission.document["profile"])

    def _drawn(self, random: Random, draw: Draw) -> Steps:
        return tuple(draw(random, 0) for _ in range(random.randint(1, _MOST_DRAWN)))

    def _leader_step(self, random: Random, depth: int) -> Step:
        """Draw a step of the leader."""
        if not self._deciding:
            return self._step(random, depth)
        if depth < _DEEPEST and random.random() < 0.35:
            return self._deciding_step(random, random.choice(self._deciding), depth)
        step = self._step(random, depth)
        if self._asks and type(step) in SIMPLE_KINDS and random.random() < 0.4:
            return replace(step, until=self._sensing(random), **random.choice(({}, {"seconds": None})))
        return step

    def _deciding_step(self, random: Random, kind: type[Step], depth: int) -> Step:
        """Draw a step of a kind that decides."""

        def steps(least: int) -> Steps:
            return tuple(self._leader_step(random, depth + 1) for _ in range(random.randint(least, 2)))

        if kind is IfStep:
            return IfStep(self._condition(random), steps(1), steps(0))
        if kind is RepeatStep:
            return RepeatStep(None, steps(1), until=self._condition(random))
        if kind is TellStep:
            return TellStep(random.choice((None, self._step(random, depth + 1))))
        if kind is DoStep:
            return DoStep(_FUNCTION)
        if kind is SetStep:
            return SetStep(_COUNTER, random.choice(_COUNTS))
        return ChangeStep(_COUNTER, random.choice((1, 1, 1, -1)))

    def _sensing(self, random: Random) -> Condition:
        """Draw what the leader senses, or its absence."""
        sense = random.choice([*SENSES])
        found = Sensing(sense, random.randrange(len(SENSES[sense])))
        return Not(found) if random.random() < 0.3 else found

    def _condition(self, random: Random) -> Condition:
        """Draw what may be asked between two steps."""
        if self._counts and random.random() < 0.5:
            return Counted(_COUNTER, random.choice(COMPARISONS), random.choice(_COUNTS))
        if random.random() < 0.15:
            return Chance(random.choice((10, 25, 50, 75, 90)))
        return self._sensing(random)

    def _step(self, random: Random, depth: int) -> Step:
        """Draw a step that each car can do; inside another it is no repetition."""
        if self._repeats and not depth and random.random() < 0.15:
            steps = tuple(self._step(random, depth + 1) for _ in range(random.randint(1, 2)))
            return RepeatStep(random.choice(_TIMES), steps)
        if (self._joins or self._minds) and random.random() < 0.3:
            first = self._simple_step(random, random.choice(self._alone), joined=True)
            others = [kind for kind in self._simple if kind.group != first.group]
            if others:
                parts = with_unless([first, self._simple_step(random, random.choice(others), joined=True)])
                if len(parts) == 1:
                    return parts[0]
                if self._joins:
                    return TogetherStep(tuple(parts))
        return self._simple_step(random, random.choice(self._alone))

    def _simple_step(self, random: Random, kind: type[Step], joined: bool = False) -> Step:
        own = own_fields(kind)
        values = {its_field.name: _value(random, its_field) for its_field in own if not (joined and kind.accompanies)}
        return kind(**values)

    def _changed(self, random: Random, program: Program) -> Program:
        if program.functions and random.random() < 0.2:
            name = random.choice([*program.functions])
            steps = self._list_changed(random, program.functions[name], self._leader_step)
            return replace(program, functions={**program.functions, name: steps})
        followers = program.followers
        leaders_part = 0.7 if self._deciding else 0.3
        if followers is None or (program.leader and random.random() < leaders_part):
            return replace(program, leader=self._list_changed(random, program.leader, self._leader_step))
        if random.random() < 0.1:
            return replace(program, followers=replace(followers, forward=not followers.forward))
        steps = self._list_changed(random, tuple(followers.steps), self._step)
        return replace(program, followers=replace(followers, steps=steps))

    def _list_changed(self, random: Random, steps: Steps, draw: Draw, depth: int = 0) -> Steps:
        """Insert, leave out, exchange or move a step, or change a number in one; ``draw`` draws another."""
        at = 0
        if steps:
            at = random.randrange(len(steps))
        what = random.random()
        if not steps or (what < 0.2 and len(steps) < _MOST_CHANGED):
            return (*steps[:at], draw(random, depth), *steps[at:])
        step = steps[at]
        is_block = isinstance(step, (RepeatStep, IfStep))
        if is_block and what < 0.6:
            held, *others = step.lists
            if others:
                held = random.choice([held, *others])
            inside: dict[str, Any] = {held: self._list_changed(random, step.lists[held], draw, depth + 1)}
            return (*steps[:at], replace(step, **inside), *steps[at + 1 :])
        if what < 0.4:
            # A repetition leaves what it repeats.
            rest = step.inside if is_block else ()
            return (*steps[:at], *rest, *steps[at + 1 :])
        if what < 0.5:
            rest = (*steps[:at], *steps[at + 1 :])
            to = random.randint(0, len(rest))
            return (*rest[:to], step, *rest[to:])
        new = self._tweaked(random, step) if what < 0.85 else draw(random, depth)
        return (*steps[:at], new, *steps[at + 1 :])

    def _tweaked(self, random: Random, step: Step) -> Step:
        """Change one field of a step, or of one that it holds, or what it asks."""
        if isinstance(step, IfStep):
            return replace(step, when=self._condition(random))
        if step.until is not None and random.random() < 0.5:
            asked = self._condition if isinstance(step, RepeatStep) else self._sensing
            return replace(step, until=asked(random))
        if isinstance(step, TellStep) and step.step is not None:
            return TellStep(self._tweaked(random, step.step))
        if isinstance(step, TogetherStep):
            at = random.randrange(len(step.steps))
            parts = step.steps
            return TogetherStep((*parts[:at], self._tweaked(random, parts[at]), *parts[at + 1 :]))
        fields = [
            its_field
            for its_field in own_fields(type(step))
            if its_field.name not in ("counter", "function") and getattr(step, its_field.name) is not None
        ]
        if not fields:
            return step
        field = random.choice(fields)
        return replace(step, **{field.name: _value(random, field)})


def _value(random: Random, field: Any) -> Any:
    """Draw a value of a step's field."""
    schema = field.metadata["schema"]
    if "enum" in schema:
        return random.choice(schema["enum"])
    if field.name == "times":
        return random.choice(_TIMES)
    if field.name in ("to", "by"):
        return random.choice(_COUNTS)
    if schema["type"] == "integer":
        return random.randint(schema["minimum"], schema["maximum"])
    return random.choice(_SECONDS)
