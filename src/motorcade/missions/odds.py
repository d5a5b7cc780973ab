"""Try a program on many seeds: in how many of them does it meet each goal?

A run on one seed proves little, because infrared is lost at random. `motorcade.missions.watch` tells one run's goals
moment by moment, with sentences; here a kernel judges many runs at once, and only whether each goal was met is kept.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

from motorcade.car.brain import NO_LED
from motorcade.config.profile import Profile
from motorcade.engine import judging
from motorcade.engine.simulation import Simulation
from motorcade.engine.slots import Slots
from motorcade.engine.state import Buffer
from motorcade.mats.model import Mat
from motorcade.missions.event_goals import SlotWatch
from motorcade.missions.goals import TIMES, GoalWatch, first_off, needed_of
from motorcade.missions.model import Goal, Mission
from motorcade.missions.schema import GOALS, WORKS
from motorcade.missions.scores import Score
from motorcade.missions.watch import EVERY_MS, begun_words, run_to_next, watch_of, with_lists
from motorcade.words.image import parse_image_bytes

OpenWorlds = Callable[[Mat, Sequence[bytes], Profile, Sequence[int], bool], Simulation]
"""Opens worlds side by side: mat, images, profile, a seed for each, and whether they keep events.

Raises MotorcadeError.
"""

# Runs that go on side by side, and the cars that they may have together.
_RUNS, _MOST_CARS = 20, 4_000
# About so many simulated car-seconds are done in one call, which takes some ten milliseconds; and so many moments at
# most, or where Python looks at each of them.
_WORK, _MOST_MOMENTS, _MOST_SLOW_MOMENTS = 1_500, 40, 10
_KINDS = {
    "in-zone": judging.INSIDE,
    "out-of-zone": judging.OUTSIDE,
    "heading": judging.FACES,
    "lit": judging.LIT,
    "not-lit": judging.NOT_LIT,
    "travelled": judging.TRAVELLED,
}


class Trial(NamedTuple):
    """One run: its seed, and for each goal whether it was met; a goal of the kind WORKS counts as met."""

    seed: int
    met: list[bool]


def other_seeds(mission: Mission, count: int) -> list[int]:
    """The first ``count`` seeds that the mission does not name."""
    named = set(mission.seeds)
    return [seed for seed in range(count + len(named)) if seed not in named][:count]


def works(mission: Mission, trial: Trial) -> bool:
    """Whether a run met all goals of the first star."""
    return all(met for goal, met in zip(mission.goals, trial.met, strict=True) if goal.star == 1)


class Odds:
    """Runs a mission on many seeds, a little in each call.

    Args:
        mission: whose goals.
        image: the bytes that the leaders run.
        seeds: of the runs.
        open_worlds: opens their worlds.

    Raises MotorcadeError where the goals take too long, or the world can't be simulated.
    """

    def __init__(self, mission: Mission, image: bytes, seeds: Sequence[int], open_worlds: OpenWorlds) -> None:
        self._mission, self._image, self._left = mission, image, list(seeds)
        cars = len(mission.mat.starts)
        self._runs = max(1, min(_RUNS, len(seeds), _MOST_CARS // cars))
        self._slots = Slots(parse_image_bytes(image), mission.profile, mission.duration_ms)
        self._asked = [number for number, goal in enumerate(mission.goals) if goal.kind in _KINDS]
        watches = self._new_watches()
        self._needs_events = any(isinstance(watch, SlotWatch) for watch in watches.values())
        # The goals that need every moment of every run in Python.
        self._is_slow = any(_needs_moments(mission.goals[number]) for number in watches)
        first = self._left[: self._runs]
        self._world = open_worlds(mission.mat, [image], mission.profile, first, self._needs_events)
        self._questions = self._ask()
        most = _MOST_SLOW_MOMENTS if self._is_slow else _MOST_MOMENTS
        self._moments_a_call = min(max(1, round(_WORK * 1000 / (EVERY_MS * cars * self._runs))), most)
        self._begin(first)

    @property
    def is_over(self) -> bool:
        """Whether all runs have ended."""
        return not self._left

    def advance(self) -> list[Trial]:
        """Go on for some milliseconds of computing; return the runs that have ended."""
        end_ms = self._mission.duration_ms
        for _ in range(self._moments_a_call):
            self._see()
            if self._world.now_ms >= end_ms:
                return self._end()
            run_to_next(self._world, end_ms)
        return []

    def _new_watches(self) -> dict[int, GoalWatch]:
        """The watches of the goals that the kernel doesn't judge, for one run."""
        mission, known = self._mission, dict[str, Score]()
        return {
            number: watch_of(goal, mission, parse_image_bytes(self._image), self._slots, known)
            for number, goal in enumerate(mission.goals)
            if goal.kind not in (*_KINDS, "no-touch", "all-by", WORKS)
        }

    def _ask(self) -> judging.Questions:
        """What the kernel is asked."""
        rows: list[int] = []
        figures: list[float] = []
        corners: list[float] = []
        who: list[int] = []
        for number in self._asked:
            goal = self._mission.goals[number]
            values = goal.values
            zone = self._mission.zone(values["zone"]) if "zone" in values else None
            led = NO_LED if values.get("led") == "off" else values.get("led", 0)
            sides = zone.corners if zone else ()
            needed = needed_of(values["share"], len(goal.cars))
            rows += [_KINDS[goal.kind], TIMES[goal.at], *goal.window_ms, needed, len(who), len(goal.cars)]
            rows += [len(corners), len(sides), led]
            if goal.kind == "heading":
                figures += [values["degrees"], values["tolerance_deg"]]
            else:
                figures += [values.get("least_m", 0.0), values.get("most_m", math.inf)]
            figures += zone.disc if zone else (0.0, 0.0, 0.0)
            corners += [length for corner in sides for length in corner]
            who += goal.cars
        memory = self._world.backend
        return judging.Questions(
            rows=memory.allocate("Questions.rows", Buffer.of("int64", rows, judging.COLUMNS)),
            figures=memory.allocate("Questions.figures", Buffer.of("float64", figures, judging.FIGURES)),
            corners=memory.allocate("Questions.corners", Buffer.of("float64", corners)),
            who=memory.allocate("Questions.who", Buffer.of("int64", who)),
        )

    def _begin(self, seeds: list[int]) -> None:
        """Begin the next runs; the worlds that are left over run a seed that nobody asked for."""
        self._world.reset([*seeds, *[0] * (self._runs - len(seeds))])
        self._watches = [self._new_watches() for _ in range(self._runs)]
        goals = [self._mission.goals[number] for number in self._asked]
        firsts = [0.0 if goal.kind == "travelled" else first_off(goal.at) for goal in goals for _ in goal.cars]
        memory, runs = self._world.backend, self._runs
        since = [0 if goal.at == "always" else -1 for goal in goals] * runs
        self._answers = judging.Answers(
            off=memory.allocate("Answers.off", Buffer.of("float64", firsts * runs, len(firsts), runs)),
            before=memory.zeros("Answers.before", (runs, 2 * len(firsts)), "float32"),
            since=memory.allocate("Answers.since", Buffer.of("int64", since, len(self._asked), runs)),
            where=memory.zeros("Answers.where", (self._world.cars,), "int64"),
            single=memory.zeros("Answers.single", (2,), "float32"),
        )

    def _see(self) -> None:
        """Judge the moment that the runs have come to."""
        self._world.judge(self._questions, self._answers)
        if not self._is_slow:
            return
        for number, watches in enumerate(self._watches):
            moment = with_lists(self._world.snapshot(number).in_single_precision())
            for place, watch in watches.items():
                if _needs_moments(self._mission.goals[place]):
                    watch.see(moment, ())

    def _end(self) -> list[Trial]:
        """Return how the runs ended, and begin the next ones."""
        since = memoryview(self._world.backend.read(self._answers.since)).cast("q").tolist()
        ended, self._left = self._left[: self._runs], self._left[self._runs :]
        count = len(self._asked)
        trials = [
            Trial(seed, self._met(number, since[number * count : (number + 1) * count]))
            for number, seed in enumerate(ended)
        ]
        if self._left:
            self._begin(self._left[: self._runs])
        return trials

    def _met(self, run: int, since: list[int]) -> list[bool]:
        """Which goals a run met, in the mission's order."""
        goals = self._mission.goals
        met = [goal.kind == WORKS for goal in goals]
        for place, number in enumerate(self._asked):
            met[number] = since[place] >= 0
        if self._needs_events:
            begun, moment = begun_words(self._world, run), self._world.snapshot(run)
            for watch in self._watches[run].values():
                if isinstance(watch, SlotWatch):
                    watch.see(moment, begun)
        for number, watch in self._watches[run].items():
            met[number] = watch.state(is_over=True).progress == "met"
        for number, goal in enumerate(goals):
            if goal.kind == "no-touch":
                met[number] = not self._world.totals(run)["touching_ms"]
            elif goal.kind == "all-by":
                met[number] = self._met_by(goal, since, run)
        return met

    def _met_by(self, goal: Goal, since: list[int], run: int) -> bool:
        """Whether another goal was met by some time, and from then on to the end."""
        other = int(goal.values["goal"]) - 1
        if other in self._asked:
            since_ms = since[self._asked.index(other)]
        else:
            state = self._watches[run][other].state(is_over=True)
            since_ms = state.t_ms if state.progress == "met" and state.t_ms is not None else -1
        return bool(0 <= since_ms <= round(goal.values["seconds"] * 1000))


def _needs_moments(goal: Goal) -> bool:
    return goal.kind not in ("heard", "in-step") and not GOALS[goal.kind].is_static
