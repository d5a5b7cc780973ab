"""Grade many runs of a mission side by side, each with a program and a seed of its own. This module needs NumPy."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from motorcade.engine.world import World
from motorcade.mats import Mat
from motorcade.missions.check import grade_of
from motorcade.missions.model import Mission
from motorcade.missions.watch import ManyRuns, attempt_of, run_to_next

# Where cars were is noted so often, in squares of this side.
_VISIT_MS = 1000
_SQUARE_M = 0.25
_SQUARE_UM = round(_SQUARE_M * 1e6)


class Graded(NamedTuple):
    """The outcome of one run.

    Attributes:
        grade: that of the mission, 0 to 1; see `motorcade.missions.check.grade_of`.
        coverage: the share of the mat's squares of 0.25 m in which a car was, looked at every second, 0 to 1.
        words: frames that a car sends in a minute, the mean of all cars.
    """

    grade: float
    coverage: float
    words: float


def grade_runs(
    mission: Mission, images: Sequence[bytes], programs: Sequence[int], seeds: Sequence[int]
) -> list[Graded]:
    """Simulate a mission in a world for each run, and return the outcomes. Grades are those of `check_program`.

    Args:
        images: at most 255 programs.
        programs: the index of the image that the leaders of each run have.
        seeds: of each run.

    Raises MotorcadeError.
    """
    attempts = [attempt_of(mission, image) for image in images]
    with_events = attempts[0].has_events
    world = World(mission.mat, images, mission.profile, seeds=list(seeds), events=with_events, threads=1)
    world.assign_images(programs)
    runs = ManyRuns(world, [attempts[program] for program in programs])
    visits = _Visits(mission.mat, world.worlds)
    end_ms = mission.duration_ms
    while True:
        if world.now_ms % _VISIT_MS < world.tick_ms:
            visits.note(world)
        if world.now_ms >= end_ms:
            break
        run_to_next(world, end_ms, _VISIT_MS)
    frames = world.counts()["frames"] * 60_000 / (end_ms * world.cars)
    return [
        Graded(grade_of(mission, watch.grades()), coverage, words)
        for watch, coverage, words in zip(runs.end(), visits.shares(), frames.tolist(), strict=True)
    ]


class _Visits:
    """The squares of a mat in which cars were. A mat without a size has its cars' box and 2 m around it."""

    def __init__(self, mat: Mat, worlds: int) -> None:
        x_m = np.asarray(mat.starts.x_m)
        y_m = np.asarray(mat.starts.y_m)
        corner_m = (0.0, 0.0)
        if mat.size_m:
            size_m = mat.size_m
        else:
            corner_m = (x_m.min() - 2, y_m.min() - 2)
            size_m = (np.ptp(x_m) + 4, np.ptp(y_m) + 4)
        self._corner_um = [round(length * 1e6) for length in corner_m]
        self._columns, self._rows = (max(math.ceil(length / _SQUARE_M), 1) for length in size_m)
        self._seen = np.zeros((worlds, self._columns * self._rows), bool)
        # Of each car the first square of its world.
        self._first = np.repeat(np.arange(worlds) * self._seen.shape[1], len(x_m))

    def note(self, world: World) -> None:
        """Note where the cars are now."""
        places = zip((world.state.x, world.state.y), self._corner_um, (self._columns, self._rows), strict=True)
        column, row = (
            # Whole numbers take a third of the time.
            np.minimum(np.maximum(np.subtract(at_um, corner_um, dtype=np.int64) // _SQUARE_UM, 0), count - 1)
            for at_um, corner_um, count in places
        )
        self._seen.reshape(-1)[self._first + row * self._columns + column] = True

    def shares(self) -> list[float]:
        """The share of the squares, of each world."""
        shares: list[float] = self._seen.mean(axis=1).tolist()
        return shares
