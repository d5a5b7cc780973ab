"""Divide a sweep into tasks.

A task is a number of runs that follow each other in the table, about `TASK_CAR_STEPS` of work by an estimate from the
specification alone. So the tasks, and the table, are the same on every computer and with any number of workers.
"""

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from motorcade.config.profile import Profile
from motorcade.engine.layout import rules_of
from motorcade.errors import InputError, MotorcadeError, Phrase
from motorcade.lab.spec import EMPTY_TABLE, NEVER, Sweep, Value, mat_with, profile_with
from motorcade.mats import Mat, check_mat, formation, open_table

TASK_CAR_STEPS = 150_000_000
# The cost of frames, whatever the length of a tick; of creating and measuring a car (in ticks); of a run; of a World.
TICKS_PER_MS = 0.25
START_TICKS = 200
RUN_CAR_STEPS = 2_000
WORLD_CAR_STEPS = 160_000
FOLLOWERS = 5
_NOISE = "physics.wheel_noise"
CAR_BYTES = 8  # of a car in a digest
# All digests of a sweep together take at most so many bytes, unless its runs have none then; a run has at most so many.
MOST_BYTES = 1 << 24
MOST_CHECKPOINTS = 1000

# The packages that a run's outcome depends on.
_HASHED = ("car", "config", "devices", "engine", "lab", "mats", "words")
# The digests of the engine's libraries, which stand for what was compiled.
_LIBRARIES = "engine/libraries/digests.json"


@dataclass(frozen=True, slots=True)
class Batch:
    """Runs that differ only in their seeds and share one World; ``values`` are those of the parameters."""

    program: str
    mat_name: str
    values: Mapping[str, Value]
    seeds: Sequence[int]
    image: bytes
    mat: Mat
    profile: Profile


@dataclass(frozen=True, slots=True)
class Task:
    """All that a worker needs: batches, of which the first begins with run ``first_run``.

    ``checkpoints`` is how often in a run the cars' digests are taken; 0: never.
    """

    code: str
    parameters: tuple[str, ...]
    duration_ms: int
    first_run: int
    batches: tuple[Batch, ...]
    checkpoints: int = 0


class Plan:
    """The runs of a sweep, in the order of the table: by program, mat, parameter point and seed.

    Args:
        sweep: the specification.
        programs: the image and the cars' profile of each of its programs.
        mats: each of its mats; None for the empty table.
        version: of Motorcade.
        progress: called with the number of points that were checked, of `Sweep.cells`.
        with_digests: whether the table has digests of the runs: `motorcade.lab.task.car_digests`.

    Raises:
        MotorcadeError: a point is not valid; the error tells which and why.
    """

    def __init__(
        self,
        sweep: Sweep,
        programs: Sequence[tuple[bytes, Profile]],
        mats: Sequence[Mat | None],
        version: str,
        progress: Callable[[int], None] = lambda done: None,
        *,
        with_digests: bool = False,
    ) -> None:
        self.sweep = sweep
        self.programs = programs
        self.mats = mats
        self._version = version
        self.runs = sweep.runs
        bounds, cars = self._divide(progress)
        self._ranges = list(pairwise(bounds))
        self.checkpoints = 0
        if with_digests:
            most = MOST_BYTES // (cars * CAR_BYTES)
            self.checkpoints = min(max(most, 1), MOST_CHECKPOINTS)

    @property
    def tasks(self) -> int:
        """The number of tasks."""
        return len(self._ranges)

    def of_runs(self, runs: Sequence[int]) -> "Plan":
        """Return a plan whose tasks are single runs of this one."""
        some = copy(self)
        some._ranges = [(run, run + 1) for run in runs]
        some.runs = len(runs)
        return some

    def task(self, index: int) -> Task:
        """Task ``index``, 0 to ``tasks`` - 1."""
        first, last = self._ranges[index]
        batches = tuple(self._batches(first, last))
        sweep = self.sweep
        return Task(code_hash(), sweep.points.parameters, sweep.duration_ms, first, batches, self.checkpoints)

    def task_runs(self, index: int) -> int:
        """The number of runs in task ``index``."""
        first, last = self._ranges[index]
        return last - first

    def task_name(self, index: int) -> str:
        """A unique name of task ``index``: a hash of all that its runs depend on, and of the numbers of its runs."""
        first, last = self._ranges[index]
        what = f"{self.fingerprint}/{first}/{last}"
        return hashlib.sha256(what.encode()).hexdigest()[:32]

    @cached_property
    def fingerprint(self) -> str:
        """A hash of `contents`."""
        return hashlib.sha256(json.dumps(self.contents).encode()).hexdigest()

    @cached_property
    def contents(self) -> dict[str, Any]:
        """All that the runs depend on: the name of each, and a hash of its content."""
        sweep = self.sweep
        return {
            "Motorcade": f"{self._version} {code_hash()}",
            "seconds": str(sweep.duration_ms / 1000),
            "seeds": _hash(sweep.seeds),
            "parameters": _hash(sweep.points),
            **({"digests": str(self.checkpoints)} if self.checkpoints else {}),
            **{f"program {name}": _hash(what) for name, what in zip(sweep.programs, self.programs, strict=True)},
            **{f"mat {name}": _hash(what) for name, what in zip(sweep.mats, self.mats, strict=True)},
        }

    def _batches(self, first: int, last: int) -> Iterator[Batch]:
        seeds = self.sweep.seeds
        for cell in range(first // len(seeds), (last - 1) // len(seeds) + 1):
            begin = cell * len(seeds)
            some = seeds[max(first - begin, 0) : min(last - begin, len(seeds))]
            program, mat, values = self._cell(cell)
            yield Batch(
                self.sweep.programs[program],
                self.sweep.mats[mat],
                values,
                some,
                self.programs[program][0],
                self._mat(program, mat, values),
                profile_with(self.programs[program][1], values),
            )

    def _cell(self, cell: int) -> tuple[int, int, dict[str, Value]]:
        """The program, the mat and the parameters of the runs ``cell`` * seeds and following."""
        rest, point = divmod(cell, self.sweep.points.count)
        program, mat = divmod(rest, len(self.sweep.mats))
        return program, mat, self.sweep.points.at(point)

    def _mat(self, program: int, mat: int, values: Mapping[str, Value]) -> Mat:
        found = self.mats[mat]
        if found is None:
            # The range of the project's own profile, not of a varied one: else the places would vary too.
            reach_m = self.programs[program][1].infrared.range_mm / 1000
            found = _empty_table(_followers(values), reach_m)
        return mat_with(found, values)

    def _divide(self, progress: Callable[[int], None]) -> tuple[list[int], int]:
        """The first run of each task, and the end of the last one, after a check of every point; all runs' cars."""
        steps = np.empty(self.sweep.cells, dtype=np.int64)
        cars = 0
        checked: set[tuple[object, ...]] = set()
        for cell in range(len(steps)):
            steps[cell], some = self._steps(cell, checked)
            cars += some * len(self.sweep.seeds)
            if cell % 1000 == 0:
                progress(cell)
        done = np.cumsum(np.repeat(steps, len(self.sweep.seeds)))
        task: NDArray[np.int64] = np.maximum(done - 1, 0) // TASK_CAR_STEPS
        return [0, *(np.flatnonzero(np.diff(task)) + 1).tolist(), self.runs], cars

    def _steps(self, cell: int, checked: set[tuple[object, ...]]) -> tuple[int, int]:
        """Check ``cell``, and estimate the car steps and count the cars of one of its runs. Raises MotorcadeError."""
        program, mat, values = self._cell(cell)
        cars, tick_ms = self._size(mat, values)
        ticks, beyond = divmod(self.sweep.duration_ms, tick_ms)
        if beyond:
            seconds = self.sweep.duration_ms / 1000
            raise InputError("seconds-not-in-ticks", point=self.place(cell), seconds=seconds, tick_ms=tick_ms)
        try:
            self._check(program, mat, values, checked)
        except MotorcadeError as problem:
            raise MotorcadeError("sweep-point-fails", point=self.place(cell), reason=problem) from None
        steps = cars * (ticks + int(self.sweep.duration_ms * TICKS_PER_MS) + START_TICKS)
        return steps + RUN_CAR_STEPS + WORLD_CAR_STEPS // len(self.sweep.seeds), cars

    def _check(self, program: int, mat: int, values: Mapping[str, Value], checked: set[tuple[object, ...]]) -> None:
        """Check that the simulator can run the world. Raises MotorcadeError.

        ``checked`` gets a key of all that a check depends on, so that a grid of other parameters costs one check.
        """
        cars, tick_ms = self._size(mat, values)
        profile = profile_with(self.programs[program][1], values)
        body_key = program, mat, cars, profile.body
        if body_key not in checked:
            check_mat(self._mat(program, mat, values), profile)
            checked.add(body_key)
        speed_key = mat, tick_ms, values.get(_NOISE), profile
        if speed_key not in checked:
            # The key has no rate of bit errors: any is fine.
            whole = mat_with(self._mat(program, mat, values), {"physics.bit_error_rate": 0.0})
            rules_of(whole, profile, ())
            checked.add(speed_key)

    def _size(self, mat: int, values: Mapping[str, Value]) -> tuple[int, int]:
        """The number of cars, and the tick in ms."""
        found = self.mats[mat]
        cars = 1 + _followers(values)
        tick_ms = 1
        if found is not None:
            cars = len(found.starts)
            tick_ms = found.tick_ms
        return cars, int(values.get("tick_ms") or tick_ms)

    def tick_ms(self, cell: int) -> int:
        """The tick of the runs ``cell`` * seeds and following."""
        _, mat, values = self._cell(cell)
        return self._size(mat, values)[1]

    def place(self, cell: int) -> Phrase:
        """Name the program, the mat and the parameters of a cell."""
        program, mat, values = self._cell(cell)
        return describe(self.sweep.programs[program], self.sweep.mats[mat], values)


def describe(program: str, mat: str, values: Mapping[str, Value]) -> Phrase:
    """Name a program, a mat and parameters."""
    place: Phrase | str = mat
    if mat == EMPTY_TABLE:
        place = Phrase("the-empty-table")
    texts = [f", {name} = {NEVER if value is None else value}" for name, value in values.items()]
    return Phrase("sweep-point", program=program, mat=place, values="".join(texts))


@cache
def code_hash(more: tuple[str, ...] = ()) -> str:
    """A hash of the code that a run's outcome depends on, with line ends that don't differ between systems.

    Args:
        more: packages on which what is done with it depends besides.
    """
    root = Path(__file__).parents[1]
    digest = hashlib.sha256()
    sources = [path for package in (*_HASHED, *more) for path in (root / package).rglob("*.py")]
    for path in sorted([*sources, root / _LIBRARIES]):
        digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()[:16]


def _followers(values: Mapping[str, Value]) -> int:
    followers = values.get("cars")
    if followers is None:
        return FOLLOWERS
    return int(followers)


@lru_cache(maxsize=8)
def _empty_table(followers: int, reach_m: float) -> Mat:
    return open_table(formation(followers, reach_m))


def _hash(what: object) -> str:
    # JSON has all but ranges, of which their text says everything.
    return hashlib.sha256(msgspec.json.encode(what, enc_hook=str)).hexdigest()
