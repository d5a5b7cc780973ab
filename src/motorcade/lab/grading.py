"""Grade many runs of a mission side by side, each with a program and a seed of its own. This module needs NumPy."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from motorcade.engine.moment import Moment
from motorcade.engine.world import World
from motorcade.mats import Mat
from motorcade.missions.check import grade_of
from motorcade.missions.model import Mission
from motorcade.missions.schema import GOALS, WORKS
from motorcade.missions.watch import EVERY_MS, MissionWatch, begun_words, run_to_next

# Where cars were is noted so often, in squares of this side.
_VISIT_MS, _SQUARE_M = 1000, 0.25
# Goals that need events of the engine, and columns of a moment beside the positions.
_WITH_EVENTS = ("heard", "in-step")
_BY_POSITION = ("in-zone", "out-of-zone", "travelled", "together", "no-touch", *_WITH_EVENTS)
_BY_SCORE = ("gathered", "covered", "networked", "stopped")
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
    kinds = {goal.kind for goal in mission.goals} - {WORKS}
    mat, with_events = mission.mat, not kinds.isdisjoint(_WITH_EVENTS)
    world = World(mat, images, mission.profile, seeds=list(seeds), events=with_events, threads=1)
    world.assign_images(programs)
    watches = [MissionWatch(mission, images[program]) for program in programs]
    sees_all = watches[0].sees_all
    is_plain = all(kind in (*_BY_POSITION, *_BY_SCORE) or kind == "all-by" or GOALS[kind].is_static for kind in kinds)
    visits = _Visits(mat, world.worlds)
    end_ms, step_ms = mission.duration_ms, EVERY_MS if sees_all else _VISIT_MS
    while True:
        now_ms = world.now_ms
        is_last = now_ms >= end_ms
        positions = _positions_um(world)
        if now_ms % _VISIT_MS < step_ms:
            visits.note(*positions)
        if sees_all or is_last:
            if is_plain:
                moments = _plain_moments(world, positions, "no-touch" in kinds)
            else:
                moments = [world.snapshot(number).in_single_precision() for number in range(world.worlds)]
            for number, (watch, moment) in enumerate(zip(watches, moments, strict=True)):
                watch.see(moment, begun_words(world, number) if with_events else ())
        if is_last:
            break
        run_to_next(world, end_ms, step_ms)
    frames = world.counts()["frames"] * 60_000 / (end_ms * world.cars)
    return [
        Graded(grade_of(mission, watch.grades()), coverage, words)
        for watch, coverage, words in zip(watches, visits.shares(), frames.tolist(), strict=True)
    ]


def _positions_um(world: World) -> _Positions:
    """Where the cars are: x and y, (worlds, cars), by car numbers, in µm."""
    shape = world.worlds, world.cars
    order = np.argsort(np.reshape(world.state.number, shape), axis=1)
    x, y = (np.take_along_axis(np.reshape(each, shape), order, 1) for each in (world.state.x, world.state.y))
    return x, y


def _plain_moments(world: World, positions_um: _Positions, with_touches: bool) -> list[Moment]:
    """Moments with positions, in single precision, and touches alone: to read all columns of many worlds takes long."""
    x_m, y_m = ((each / 1e6).astype(np.float32).tolist() for each in positions_um)
    touching = world.counts()["touching_ms"].tolist() if with_touches else [0] * world.worlds
    nothing: Any = {name: () for name in Moment._fields if name not in ("t_ms", "x_m", "y_m", "counts")}
    now_ms = world.now_ms
    return [
        Moment(t_ms=now_ms, x_m=x, y_m=y, counts={"touching_ms": ms}, **nothing)
        for x, y, ms in zip(x_m, y_m, touching, strict=True)
    ]


class _Visits:
    """The squares of a mat in which cars were. A mat without a size has its cars' box and 2 m around it."""

    def __init__(self, mat: Mat, worlds: int) -> None:
        x_m, y_m = np.asarray(mat.starts.x_m), np.asarray(mat.starts.y_m)
        self._corner_m = (0.0, 0.0) if mat.size_m else (x_m.min() - 2, y_m.min() - 2)
        width, height = mat.size_m or (np.ptp(x_m) + 4, np.ptp(y_m) + 4)
        self._columns, self._rows = (max(int(np.ceil(length / _SQUARE_M)), 1) for length in (width, height))
        self._seen = np.zeros((worlds, self._columns * self._rows), bool)
        self._worlds = np.arange(worlds)[:, None]

    def note(self, x_um: NDArray[np.int32], y_um: NDArray[np.int32]) -> None:
        """Note where the cars are now."""
        column, row = (
            ((each / 1e6 - corner) // _SQUARE_M).astype(int).clip(0, count - 1)
            for each, corner, count in ((x_um, self._corner_m[0], self._columns), (y_um, self._corner_m[1], self._rows))
        )
        self._seen[self._worlds, row * self._columns + column] = True

    def shares(self) -> list[float]:
        """The share of the squares, of each world."""
        shares: list[float] = self._seen.mean(axis=1).tolist()
        return shares
