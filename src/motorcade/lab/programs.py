"""Programs that a search tries: drawn at random from the blocks of a mission, or made from another by small changes."""

from collections.abc import Callable
from dataclasses import replace
from random import Random
from typing import Any

from motorcade.errors import MotorcadeError
from motorcade.missions.model import Mission
from motorcade.program.compiler import compile_program
from motorcade.program.model import Followers, Program
from motorcade.program.steps import KINDS, RepeatStep, Step, TogetherStep, own_fields

Steps = tuple[Step, ...]
_SECONDS = (1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 30.0, 60.0)
_TIMES = (2, 3, 4, 5, 6, 8, 10, 20)
# Steps in a list that is drawn, and in one that changes may make.
_MOST_DRAWN = 3
_MOST_CHANGED = 12
# Programs that don't compile are drawn again, and so are those that were tried already.
_TRIES = 40


class ProgramSource:
    """Makes programs of the blocks that a mission offers."""

    def __init__(self, mission: Mission) -> None:
        self._mission = mission
        # The images of programs that were made before.
        self._tried: set[bytes] = set()
        self._has_followers = len(mission.mat.starts.leaders) < len(mission.mat.starts)
        kinds = [KINDS[kind] for kind in mission.palette]
        self._simple = [kind for kind in kinds if kind not in (RepeatStep, TogetherStep)]
        # Kinds that do something by themselves are drawn alone.
        self._alone = [kind for kind in self._simple if not kind.accompanies] or self._simple
        self._repeats = RepeatStep in kinds
        self._joins = TogetherStep in kinds

    def draw(self, random: Random) -> Program:
        """Draw a program."""

        def drawn() -> Program:
            lists = [tuple(self._step(random) for _ in range(random.randint(1, _MOST_DRAWN))) for _ in range(2)]
            followers = None
            if self._has_followers:
                followers = Followers(lists[1], forward=random.random() < 0.7)
            return Program(lists[0], followers, self._mission.document["profile"])

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

    def _step(self, random: Random, inside: bool = False) -> Step:
        """Draw a step; ``inside`` another it is no repetition."""
        if self._repeats and not inside and random.random() < 0.15:
            steps = tuple(self._step(random, inside=True) for _ in range(random.randint(1, 2)))
            return RepeatStep(random.choice(_TIMES), steps)
        if self._joins and random.random() < 0.3:
            first = self._simple_step(random, random.choice(self._alone), joined=True)
            others = [kind for kind in self._simple if kind.group != first.group]
            if others:
                return TogetherStep((first, self._simple_step(random, random.choice(others), joined=True)))
        return self._simple_step(random, random.choice(self._alone))

    def _simple_step(self, random: Random, kind: type[Step], joined: bool = False) -> Step:
        own = own_fields(kind)
        values = {its_field.name: _value(random, its_field) for its_field in own if not (joined and kind.accompanies)}
        return kind(**values)

    def _changed(self, random: Random, program: Program) -> Program:
        followers = program.followers
        if followers is None or (program.leader and random.random() < 0.3):
            return Program(self._list_changed(random, program.leader), followers, program.profile)
        if random.random() < 0.1:
            return Program(program.leader, replace(followers, forward=not followers.forward), program.profile)
        steps = self._list_changed(random, tuple(followers.steps))
        return Program(program.leader, replace(followers, steps=steps), program.profile)

    def _list_changed(self, random: Random, steps: Steps, inside: bool = False) -> Steps:
        """Insert, leave out, exchange or move a step, or change a number in one."""
        at = 0
        if steps:
            at = random.randrange(len(steps))
        what = random.random()
        if not steps or (what < 0.2 and len(steps) < _MOST_CHANGED):
            return (*steps[:at], self._step(random, inside), *steps[at:])
        step = steps[at]
        if isinstance(step, RepeatStep) and what < 0.6:
            return (*steps[:at], replace(step, steps=self._list_changed(random, step.steps, True)), *steps[at + 1 :])
        if what < 0.4:
            # A repetition leaves what it repeats.
            rest: Steps = ()
            if isinstance(step, RepeatStep):
                rest = step.steps
            return (*steps[:at], *rest, *steps[at + 1 :])
        if what < 0.5:
            others = [*steps[:at], *steps[at + 1 :]]
            others.insert(random.randint(0, len(others)), step)
            return tuple(others)
        new = self._tweaked(random, step) if what < 0.85 else self._step(random, inside)
        return (*steps[:at], new, *steps[at + 1 :])

    def _tweaked(self, random: Random, step: Step) -> Step:
        """Change one field of a step, or of one that it holds."""
        if isinstance(step, TogetherStep):
            at = random.randrange(len(step.steps))
            parts = step.steps
            return TogetherStep((*parts[:at], self._tweaked(random, parts[at]), *parts[at + 1 :]))
        fields = [its_field for its_field in own_fields(type(step)) if getattr(step, its_field.name) is not None]
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
    if schema["type"] == "integer":
        return random.randint(schema["minimum"], schema["maximum"])
    return random.choice(_SECONDS)
