"""Try a program on many seeds: in how many of them does it meet each goal?

A run on one seed proves little, because infrared is lost at random. `motorcade.missions.watch.ManyRuns` judges some
runs at once, and only whether each goal was met is kept.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from motorcade.config.profile import Profile
from motorcade.engine.simulation import Simulation
from motorcade.mats.model import Mat
from motorcade.missions.model import Mission
from motorcade.missions.watch import ManyRuns, RunWatch, attempt_of

OpenWorlds = Callable[[Mat, Sequence[bytes], Profile, Sequence[int], bool], Simulation]
"""Opens worlds side by side: mat, images, profile, a seed for each, and whether they keep events.

Raises MotorcadeError.
"""

# Runs that go on side by side, and the cars that they may have together.
_RUNS = 20
_MOST_CARS = 4_000
# About so many simulated car-seconds are done in one call, which takes some ten milliseconds.
_WORK = 1_500


class Trial(NamedTuple):
    """One run: its seed, and for each goal whether it was met; a goal that other seeds decide counts as met."""

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
        self._mission = mission
        self._left = list(seeds)
        cars = len(mission.mat.starts)
        runs = max(1, min(_RUNS, len(seeds), _MOST_CARS // cars))
        attempt = attempt_of(mission, image)
        self._kinds = attempt.kinds
        given_seeds = self._next_seeds(runs)
        self._world = open_worlds(mission.mat, [image], mission.profile, given_seeds, attempt.has_events)
        self._runs = ManyRuns(self._world, [attempt] * runs)
        self._call_ms = max(_WORK * 1000 // (cars * runs), self._world.tick_ms)

    @property
    def is_over(self) -> bool:
        """Whether all runs have ended."""
        return not self._left

    def advance(self) -> list[Trial]:
        """Go on for some milliseconds of computing; return the runs that have ended."""
        world = self._world
        left_ms = self._mission.duration_ms - world.now_ms
        # The last tick ends at the end of the mission or after it.
        ticks = -(-min(self._call_ms, left_ms) // world.tick_ms)
        world.run(ticks * world.tick_ms)
        if world.now_ms < self._mission.duration_ms:
            return []
        return self._end()

    def _next_seeds(self, runs: int) -> list[int]:
        """The seeds of the next runs; the worlds that are left over run a seed that nobody asked for."""
        seeds = self._left[:runs]
        return seeds + [0] * (runs - len(seeds))

    def _end(self) -> list[Trial]:
        """Return how the runs ended, and begin the next ones."""
        watches = self._runs.end()
        ended = self._left[: len(watches)]
        self._left = self._left[len(watches) :]
        trials = [Trial(seed, self._met(watch)) for seed, watch in zip(ended, watches, strict=False)]
        if self._left:
            self._world.reset(self._next_seeds(len(watches)))
            self._runs.begin()
        return trials

    def _met(self, watch: RunWatch) -> list[bool]:
        """Which goals a run met, in the mission's order."""
        states = zip(self._kinds, watch.states(), strict=True)
        return [kind.tries_other_seeds or state.progress == "met" for kind, state in states]
