"""Grade many runs of a mission side by side, each with a program and a seed of its own. This module needs NumPy."""

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
        starts_m = np.asarray([mat.starts.x_m, mat.starts.y_m])
        if mat.size_m:
            corner_m, size_m = np.zeros(2), np.asarray(mat.size_m)
        else:
            corner_m, size_m = starts_m.min(axis=1) - 2, np.ptp(starts_m, axis=1) + 4
        # A row for x, a row for y. Whole numbers take a third of the time.
        self._corner_um = np.rint(corner_m * 1e6).astype(int)[:, None]
        self._counts = np.maximum(np.ceil(size_m / _SQUARE_M).astype(int), 1)[:, None]
        self._seen = np.zeros((worlds, self._counts.prod()), bool)
        self._world_of_car = np.repeat(np.arange(worlds), len(mat.starts))

    def note(self, world: World) -> None:
        """Note where the cars are now."""
        squares = (np.asarray([world.state.x, world.state.y], int) - self._corner_um) // _SQUARE_UM
        column, row = np.minimum(np.maximum(squares, 0), self._counts - 1)
        self._seen[self._world_of_car, row * self._counts[0] + column] = True

    def shares(self) -> list[float]:
        """The share of the squares, of each world."""
        shares: list[float] = self._seen.mean(axis=1).tolist()
        return shares
