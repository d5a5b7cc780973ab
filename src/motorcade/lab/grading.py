"""Grade many runs of a mission side by side, each with a program and a seed of its own. This module needs NumPy."""

from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from motorcade.engine.moment import Moment
from motorcade.engine.world import World
from motorcade.mats import Mat
from motorcade.missions.check import grade_of
from motorcade.missions.goal import EVERY_MS
from motorcade.missions.model import Mission
from motorcade.missions.watch import ManyRuns, attempt_of, run_to_next

# Where cars were is noted so often, in squares of this side.
_VISIT_MS = 1000
_SQUARE_M = 0.25
# x and y of all cars.
_Positions = tuple[NDArray[np.int32], NDArray[np.int32]]


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
    kinds = attempts[0].kinds
    with_events = any(kind.has_events for kind in kinds)
    world = World(mission.mat, images, mission.profile, seeds=list(seeds), events=with_events, threads=1)
    world.assign_images(programs)
    is_plain = all(kind.reads_positions_alone for kind in kinds)
    moments = partial(_plain_moments, world) if is_plain else None
    runs = ManyRuns(world, [attempts[program] for program in programs], moments)
    visits = _Visits(mission.mat, world.worlds)
    end_ms = mission.duration_ms
    step_ms = EVERY_MS if runs.sees_all else _VISIT_MS
    while True:
        is_last = world.now_ms >= end_ms
        if world.now_ms % _VISIT_MS < step_ms:
            visits.note(*_positions_um(world))
        if runs.sees_all or is_last:
            runs.see()
        if is_last:
            break
        run_to_next(world, end_ms, step_ms)
    frames = world.counts()["frames"] * 60_000 / (end_ms * world.cars)
    return [
        Graded(grade_of(mission, watch.grades()), coverage, words)
        for watch, coverage, words in zip(runs.end(), visits.shares(), frames.tolist(), strict=True)
    ]


def _positions_um(world: World) -> _Positions:
    """Where the cars are: x and y, (worlds, cars), by car numbers, in µm."""
    shape = world.worlds, world.cars
    order = np.argsort(np.reshape(world.state.number, shape), axis=1)
    x, y = (np.take_along_axis(np.reshape(column, shape), order, 1) for column in (world.state.x, world.state.y))
    return x, y


def _plain_moments(world: World) -> list[Moment]:
    """Moments with positions, in single precision, and touches alone: to read all columns of many worlds takes long."""
    x_m, y_m = ((places_um / 1e6).astype(np.float32).tolist() for places_um in _positions_um(world))
    touching_ms = world.counts()["touching_ms"].tolist()
    nothing: Any = {name: () for name in Moment._fields if name not in ("t_ms", "x_m", "y_m", "counts")}
    now_ms = world.now_ms
    return [
        Moment(t_ms=now_ms, x_m=x, y_m=y, counts={"touching_ms": ms}, **nothing)
        for x, y, ms in zip(x_m, y_m, touching_ms, strict=True)
    ]


class _Visits:
    """The squares of a mat in which cars were. A mat without a size has its cars' box and 2 m around it."""

    def __init__(self, mat: Mat, worlds: int) -> None:
        x_m = np.asarray(mat.starts.x_m)
        y_m = np.asarray(mat.starts.y_m)
        if mat.size_m:
            self._corner_m = (0.0, 0.0)
            size_m = mat.size_m
        else:
            self._corner_m = (x_m.min() - 2, y_m.min() - 2)
            size_m = (np.ptp(x_m) + 4, np.ptp(y_m) + 4)
        self._columns, self._rows = (max(int(np.ceil(length / _SQUARE_M)), 1) for length in size_m)
        self._seen = np.zeros((worlds, self._columns * self._rows), bool)
        self._worlds = np.arange(worlds)[:, None]

    def note(self, x_um: NDArray[np.int32], y_um: NDArray[np.int32]) -> None:
        """Note where the cars are now."""
        column, row = (
            ((places_um / 1e6 - corner) // _SQUARE_M).astype(int).clip(0, count - 1)
            for places_um, corner, count in (
                (x_um, self._corner_m[0], self._columns),
                (y_um, self._corner_m[1], self._rows),
            )
        )
        self._seen[self._worlds, row * self._columns + column] = True

    def shares(self) -> list[float]:
        """The share of the squares, of each world."""
        shares: list[float] = self._seen.mean(axis=1).tolist()
        return shares
