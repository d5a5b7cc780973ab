"""Check a program against a mission: simulate it on every seed, count the stars, and know a usual mistake.

A run's way of going wrong is told by the sentences about the first star's goals. Of several mistakes in the mission's
notes that go wrong in the same way, the one counts whose program is most alike. `scripts/usual_mistakes.py` runs the
programs of the notes, and makes mistakes.json.
"""

import json
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from functools import cache, reduce
from importlib import resources
from itertools import chain
from statistics import fmean
from typing import Any, NamedTuple, Self

from motorcade.config.profile import Profile
from motorcade.engine.moment import Event, Moment
from motorcade.engine.simulation import Simulation
from motorcade.errors import Phrase
from motorcade.mats.model import Mat
from motorcade.missions.goal import MOST_UNMET, GoalState, needed_of
from motorcade.missions.model import Goal, Mission
from motorcade.missions.odds import Odds, OpenWorlds, Trial, other_seeds, works
from motorcade.missions.schema import GOALS
from motorcade.missions.watch import MissionWatch, begun_words, run_to_next
from motorcade.program.compiler import compile_program
from motorcade.program.decompiler import DecompileError, decompile
from motorcade.program.model import Program, placed_steps
from motorcade.program.reactions import reactions_of
from motorcade.words.packing import bytes_to_words

# The kind of the result for steps that the mission does not allow.
STEPS = "steps"
# Programs that differ by a larger part of the settings are no longer the same mistake.
_MOST_DIFFERENT = 0.5


class Sight(NamedTuple):
    """What one world of a mission shows at a moment: the seed, the moment, and the words begun since the one before."""

    seed: int
    moment: Moment
    begun: Sequence[Event]


class GoalResult(NamedTuple):
    """The result of one goal on all seeds.

    Attributes:
        kind: the goal's kind, or STEPS.
        star: the star that it is for.
        met: whether it was met on every seed.
        seed: the seed that ``t_ms`` and ``why`` are about: the first on which it was lost, else the first.
        t_ms: when it was met; where it is lost, a moment at which one can see why.
        why: a phrase with numbers.
        cars: the cars that ``why`` is about, where it is not met.
        grade: how near the runs came to it, 0 to 1, the mean of all seeds; 1 only where it is met.
    """

    kind: str
    star: int
    met: bool
    seed: int
    t_ms: int
    why: Phrase
    cars: tuple[int, ...] = ()
    grade: float = 0.0

    def to_dict(self, language: str) -> dict[str, Any]:
        """The result for JSON."""
        return {**self._asdict(), "why": self.why.sentence(language)}


class Result(NamedTuple):
    """What a program earned.

    Attributes:
        stars: each star from 1 to 3 that it has.
        grade: the mean of `grade_of` over the seeds, 0 to 1; 0 where it has steps that are not allowed.
    """

    stars: frozenset[int]
    goals: list[GoalResult]
    grade: float

    def to_dict(self, language: str) -> dict[str, Any]:
        """The result for JSON."""
        return {"stars": len(self.stars), "grade": self.grade, "goals": [goal.to_dict(language) for goal in self.goals]}


def open_worlds_here(
    mat: Mat, images: Sequence[bytes], profile: Profile, seeds: Sequence[int], events: bool
) -> Simulation:
    """Open worlds with the engine of this computer."""
    from motorcade.engine.world import World

    return World(mat, images, profile, seeds=seeds, events=events, threads=1)


Look = Callable[[Sight], None]
"""Is shown each moment of a check's runs."""


# An image doesn't say which steps its program has: the kinds that may make the same words as another one does.
_SAME_WORDS = {
    "repeat": {"if", "do", "set", "change", "tell"},
    "if": {"repeat", "do"},
    "flow": {"if", "repeat", "do"},
    "wait": {"drive"},
    "follow_line": {"floor"},
    "turn_to_line": {"floor"},
}


def check_image(mission: Mission, image: bytes, look: Look | None = None) -> Result:
    """Check an image, whose words may come from several steps. Raises MotorcadeError where it can't be simulated."""
    return _check(mission, image, image_steps(mission, image), open_worlds_here, look)


def image_steps(mission: Mission, image: bytes) -> GoalResult | None:
    """The result for the kinds of steps that an image's words may come from; None where no steps say them."""
    allowed = set(mission.document.get("steps") or ())
    known = {kind for kind, others in _SAME_WORDS.items() if others & allowed}
    with suppress(DecompileError):
        return program_steps(mission, decompile(bytes_to_words(image)), known)
    return None


def check_program(
    mission: Mission, program: Program, open_worlds: OpenWorlds = open_worlds_here, look: Look | None = None
) -> Result:
    """Check a program, compiled for the mission's cars. Raises ProgramError where it has errors."""
    image = compile_program(program, mission.profile).image
    return _check(mission, image, program_steps(mission, program), open_worlds, look)


def _check(
    mission: Mission, image: bytes, steps: GoalResult | None, open_worlds: OpenWorlds, look: Look | None
) -> Result:
    watches = {seed: MissionWatch(mission, image) for seed in mission.seeds}
    for sight in watched(open_worlds(mission.mat, [image], mission.profile, mission.seeds, True), mission):
        watches[sight.seed].see(sight.moment, sight.begun)
        if look:
            look(sight)
    states = {seed: watch.states() for seed, watch in watches.items()}
    grades = [watch.grades() for watch in watches.values()]
    means = [fmean(of_goal) for of_goal in zip(*grades, strict=True)]
    results = []
    for number, (goal, mean) in enumerate(zip(mission.goals, means, strict=True)):
        if GOALS[goal.kind].tries_other_seeds:
            results.append(_tried(mission, goal, image, open_worlds))
        else:
            results.append(_worst(mission, number, states, mean))
    grade = fmean(grade_of(mission, of_run) for of_run in grades)
    if steps is not None:
        results.insert(0, steps)
        grade *= steps.grade
    return Result(stars_of((goal.star, goal.met) for goal in results), results, grade)


def _tried(mission: Mission, goal: Goal, image: bytes, open_worlds: OpenWorlds) -> GoalResult:
    """The result of a goal that other seeds decide: in how many of their runs the first star's goals are met."""
    odds = Odds(mission, image, other_seeds(mission, goal.values["seeds"]), open_worlds)
    trials: list[Trial] = []
    while not odds.is_over:
        trials += odds.advance()
    failed = [trial.seed for trial in trials if not works(mission, trial)]
    done = len(trials) - len(failed)
    count = len(trials)
    why = Phrase("goal-works-count", done=done, count=count)
    seed = [*failed, mission.seeds[0]][0]
    met = done >= needed_of(goal.values["share"], count)
    grade = 1.0
    if not met:
        grade = min(done / count / goal.values["share"], MOST_UNMET)
    return GoalResult(goal.kind, goal.star, met, seed, 0, why, grade=grade)


def _worst(mission: Mission, number: int, states: dict[int, list[GoalState]], grade: float) -> GoalResult:
    goal = mission.goals[number]
    seed = next((seed for seed, found in states.items() if found[number].progress != "met"), mission.seeds[0])
    state = states[seed][number]
    met = state.progress == "met"
    return GoalResult(goal.kind, goal.star, met, seed, state.t_ms or 0, state.why, state.cars, grade)


def grade_of(mission: Mission, grades: Iterable[float]) -> float:
    """The grade of a run of a mission, 0 to 1; exactly 1 where all goals are met that a single run decides.

    A star's grade is the mean of its goals', and all stars count alike. As the others are worth nothing without the
    first, theirs are multiplied by its grade.

    Args:
        grades: of the mission's goals, in the order of the file.
    """
    stars: dict[int, list[float]] = {}
    for goal, grade in zip(mission.goals, grades, strict=True):
        if not GOALS[goal.kind].tries_other_seeds:
            stars.setdefault(goal.star, []).append(grade)
    means = {star: fmean(of_star) for star, of_star in stars.items()}
    first = means.pop(1)
    return fmean([first, *(mean * first for mean in means.values())])


def stars_of(goals: Iterable[tuple[int, bool]]) -> frozenset[int]:
    """The stars whose goals are all met; none without the first. Of each goal its star, and whether it is met."""
    known = list(goals)
    earned = {star for star, _ in known} - {star for star, met in known if not met}
    if 1 not in earned:
        return frozenset()
    return frozenset(earned)


def own_stars(mission: Mission, trials: Sequence[Trial]) -> list[int]:
    """The stars of a program by its runs on the mission's own seeds.

    Stars whose goals other seeds decide are not among them. An image doesn't say which steps its program has.
    """
    goals = [(goal.star, not GOALS[goal.kind].tries_other_seeds) for goal in mission.goals]
    for trial in trials:
        goals += [(goal.star, met) for goal, met in zip(mission.goals, trial.met, strict=True)]
    return sorted(stars_of(goals))


def program_steps(mission: Mission, program: Program, known: Iterable[str] = ()) -> GoalResult | None:
    """The result for the kinds of steps that a program uses, but for those ``known``; None where all are allowed."""
    allowed = mission.document.get("steps")
    if allowed is None:
        return None
    used = {beside.kind for _, step in placed_steps(program) for beside in (step, *reactions_of(step))}
    others = sorted(used.difference(allowed, known))
    if others:
        why = Phrase("goal-steps-not-allowed", used=_listed(others), allowed=_listed(allowed))
    else:
        why = Phrase("goal-steps-allowed", allowed=_listed(allowed))
    return GoalResult(STEPS, 1, not others, mission.seeds[0], 0, why, grade=float(not others))


def _listed(kinds: Iterable[str]) -> Phrase:
    """The names of kinds of steps, one after another."""
    names = (Phrase(f"step-{kind}") for kind in kinds)
    return reduce(lambda first, second: Phrase("listed", first=first, second=second), names)


def watched(world: Simulation, mission: Mission) -> Iterator[Sight]:
    """Run worlds of a mission to its end, and show each of them as `motorcade.missions.watch` needs it.

    Raises:
        MotorcadeError: a world can't be simulated.
    """
    end_ms = mission.duration_ms
    begun: list[list[Event]] = [[] for _ in world.seeds]
    while True:
        for number, seed in enumerate(world.seeds):
            yield Sight(seed, world.snapshot(number).in_single_precision(), begun[number])
        if world.now_ms >= end_ms:
            return
        run_to_next(world, end_ms)
        begun = [begun_words(world, number) for number in range(world.worlds)]


class Mistake(NamedTuple):
    """How a program fails.

    Attributes:
        lost: of each goal of the first star the key of its sentence; empty where it is met.
        settings: its steps' settings, and those of the followers, each with the kinds of steps around it.
    """

    lost: list[str]
    settings: list[str]

    @classmethod
    def of(cls, result: Result, program: Program) -> Self:
        """How the program failed that has this result."""
        lost = ["" if goal.met else _key(goal.why) for goal in result.goals if goal.star == 1]
        document = program.as_dict()
        settings = (_settings(document[part] or [], part) for part in ("leader", "followers"))
        return cls(lost, sorted(chain(*settings)))

    def differs_by(self, other: "Mistake") -> int:
        """By how many settings the programs differ."""
        one = Counter(self.settings)
        two = Counter(other.settings)
        return ((one - two) + (two - one)).total()

    def is_like(self, known: "Mistake") -> bool:
        """Whether a program fails as one that is known, and is much the same."""
        return self.lost == known.lost and self.differs_by(known) <= _MOST_DIFFERENT * len(known.settings)


def _settings(node: Any, place: str) -> Iterator[str]:
    """Each value of a part of a program's document, after the keys that lead to it."""
    if isinstance(node, dict):
        for key, value in node.items():
            # Blocks of a page have ids of their own.
            if key != "id":
                yield from _settings(value, f"{place} {key}")
    elif isinstance(node, list):
        for item in node:
            yield from _settings(item, place)
    else:
        yield f"{place} {node}"


def _key(why: Phrase) -> str:
    """The key of a sentence, and of the one that it holds."""
    inner = why.details.get("what")
    if isinstance(inner, Phrase):
        return f"{why.key} {inner.key}"
    return why.key


def usual_mistake(mission: Mission, result: Result, program: Program) -> int | None:
    """Return the number of the mistake in the mission's notes, from 0; None where it is none of them."""
    if 1 in result.stars:
        return None
    mistake = Mistake.of(result, program)
    alike = [
        (mistake.differs_by(known), number)
        for number, known in enumerate(_usual_mistakes().get(mission.id, []))
        if mistake.is_like(known)
    ]
    if not alike:
        return None
    return min(alike)[1]


@cache
def _usual_mistakes() -> dict[str, list[Mistake]]:
    """Of each mission that comes with Motorcade how the programs of its notes fail, in their order."""
    text = (resources.files("motorcade.missions") / "mistakes.json").read_text(encoding="utf-8")
    return {name: [Mistake(*mistake) for mistake in mistakes] for name, mistakes in json.loads(text).items()}
