"""A sweep cut into tasks: which runs each worker does at once.

A task is some runs that stand one behind the other in the table, about
`TASK_CAR_STEPS` of work by an estimate from the specification alone. So the
tasks, and with them the table, are the same on every computer, however many
work on it.
"""

import dataclasses
import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motorcade.config.profile import Profile
from motorcade.engine.layout import rules_of
from motorcade.errors import MotorcadeError
from motorcade.experiments.parameters import Parameter, SweepError, Value, mat_with, profile_with
from motorcade.experiments.spec import EMPTY_TABLE, Sweep
from motorcade.mats import Mat, check_mat, formation, open_table

TASK_CAR_STEPS = 150_000_000
# What frames cost, however long a tick is, and what it costs to set up and to measure a car (both in ticks),
# a run and a World.
TICKS_PER_MS = 0.25
START_TICKS = 200
RUN_CAR_STEPS = 2_000
WORLD_CAR_STEPS = 160_000
FOLLOWERS = 5
_NOISE = "physics.wheel_noise"


@dataclass(frozen=True, slots=True)
class Batch:
    """Runs that differ in their seed alone; they share one World. ``values`` are those of the parameters."""

    program: str
    mat_name: str
    values: Mapping[str, Value]
    seeds: Sequence[int]
    image: bytes
    mat: Mat
    profile: Profile


@dataclass(frozen=True, slots=True)
class Task:
    """All that a worker needs: some batches, which begin with run ``first_run``."""

    code: str
    parameters: tuple[Parameter, ...]
    duration_ms: int
    first_run: int
    batches: tuple[Batch, ...]


class Plan:
    """The runs of a sweep, in the order of the table: by program, mat, parameter point and seed.

    Args:
        sweep: what is asked for.
        programs: the image and the cars' profile of each of its programs.
        mats: each of its mats; None stands for the empty table.
        version: of Motorcade.
        progress: called with the number of points looked at, of `Sweep.cells`.

    Raises:
        SweepError: some point can't be; its text says which and why.
    """

    def __init__(
        self,
        sweep: Sweep,
        programs: Sequence[tuple[bytes, Profile]],
        mats: Sequence[Mat | None],
        version: str,
        progress: Callable[[int], None] = lambda done: None,
    ) -> None:
        self.sweep = sweep
        self._programs = programs
        self._mats = mats
        self._version = version
        self.runs = sweep.runs
        self._bounds = self._cut(progress)
        self.tasks = len(self._bounds) - 1

    def task(self, index: int) -> Task:
        """Task ``index``, 0 to ``tasks`` - 1."""
        first, last = self._bounds[index], self._bounds[index + 1]
        batches = tuple(self._batches(first, last))
        return Task(code_hash(), self.sweep.points.parameters, self.sweep.duration_ms, first, batches)

    def task_runs(self, index: int) -> int:
        """How many runs are in task ``index``."""
        return self._bounds[index + 1] - self._bounds[index]

    def task_name(self, index: int) -> str:
        """A name for task ``index`` that nothing else has: a hash of all that its runs depend on, and of its runs."""
        what = f"{self.fingerprint}/{self._bounds[index]}/{self._bounds[index + 1]}"
        return hashlib.sha256(what.encode()).hexdigest()[:32]

    @cached_property
    def fingerprint(self) -> str:
        """A hash of `contents`."""
        return hashlib.sha256(json.dumps(self.contents).encode()).hexdigest()

    @cached_property
    def contents(self) -> dict[str, Any]:
        """All that the runs depend on: each thing's name, and a hash of what is in it."""
        sweep = self.sweep
        return {
            "Motorcade": f"{self._version} {code_hash()}",
            "seconds": str(sweep.duration_ms / 1000),
            "seeds": _hash(sweep.seeds),
            "parameters": _hash(sweep.points),
            **{f"program {name}": _hash(what) for name, what in zip(sweep.programs, self._programs, strict=True)},
            **{f"mat {name}": _hash(what) for name, what in zip(sweep.mats, self._mats, strict=True)},
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
                self._programs[program][0],
                self._mat(program, mat, values),
                profile_with(self._programs[program][1], values),
            )

    def _cell(self, cell: int) -> tuple[int, int, dict[str, Value]]:
        """The program, the mat and the parameters of the runs ``cell`` * seeds and following."""
        rest, point = divmod(cell, self.sweep.points.count)
        program, mat = divmod(rest, len(self.sweep.mats))
        return program, mat, self.sweep.points.at(point)

    def _mat(self, program: int, mat: int, values: Mapping[str, Value]) -> Mat:
        found = self._mats[mat]
        if found is None:
            # The places depend on what the project says, not on what is varied: else two things would vary.
            reach_m = self._programs[program][1].infrared.range_mm / 1000
            found = _empty_table(_followers(values), reach_m)
        return mat_with(found, values)

    def _cut(self, progress: Callable[[int], None]) -> list[int]:
        """Where each task begins, and where the last one ends, after a look at every point."""
        steps = np.empty(self.sweep.cells, dtype=np.int64)
        checked: set[tuple[object, ...]] = set()
        for cell in range(len(steps)):
            steps[cell] = self._steps(cell, checked)
            if cell % 1000 == 0:
                progress(cell)
        done = np.cumsum(np.repeat(steps, len(self.sweep.seeds)))
        task: NDArray[np.int64] = np.maximum(done - 1, 0) // TASK_CAR_STEPS
        return [0, *(np.flatnonzero(np.diff(task)) + 1).tolist(), self.runs]

    def _steps(self, cell: int, checked: set[tuple[object, ...]]) -> int:
        """The car steps of one run of ``cell``, which is checked. Raises SweepError."""
        program, mat, values = self._cell(cell)
        cars, tick_ms = self._size(mat, values)
        ticks, beyond = divmod(self.sweep.duration_ms, tick_ms)
        if beyond:
            seconds = self.sweep.duration_ms / 1000
            raise SweepError(f"{self.place(cell)}: {seconds:g} s are no whole number of ticks of {tick_ms} ms")
        try:
            profile = profile_with(self._programs[program][1], values)
            self._check(program, mat, values, profile, checked)
        except MotorcadeError as problem:
            raise SweepError(f"{self.place(cell)}: {problem}") from None
        steps = cars * (ticks + int(self.sweep.duration_ms * TICKS_PER_MS) + START_TICKS)
        return steps + RUN_CAR_STEPS + WORLD_CAR_STEPS // len(self.sweep.seeds)

    def _check(
        self, program: int, mat: int, values: Mapping[str, Value], profile: Profile, checked: set[tuple[object, ...]]
    ) -> None:
        """Check that the world can be. Raises MotorcadeError.

        What a check looks at is a key of ``checked`` then, so that a grid of what it doesn't look at costs one check.
        """
        cars, tick_ms = self._size(mat, values)
        body_key = program, mat, cars, profile.body
        if body_key not in checked:
            check_mat(self._mat(program, mat, values), profile)
            checked.add(body_key)
        speed_key = mat, tick_ms, values.get(_NOISE), profile
        if speed_key not in checked:
            whole = self._mat(program, mat, values)
            rules_of(
                dataclasses.replace(whole, physics=dataclasses.replace(whole.physics, bit_error_rate=0.0)), profile, ()
            )
            checked.add(speed_key)

    def _size(self, mat: int, values: Mapping[str, Value]) -> tuple[int, int]:
        """How many cars, and how long a tick is in ms."""
        found = self._mats[mat]
        cars = 1 + _followers(values) if found is None else len(found.starts)
        return cars, int(values.get("tick_ms") or (found.tick_ms if found else 1))

    def place(self, cell: int) -> str:
        """What the runs of a cell are, in words."""
        program, mat, values = self._cell(cell)
        return described(self.sweep.programs[program], self.sweep.mats[mat], values)


def described(program: str, mat: str, values: Mapping[str, Value]) -> str:
    """A parameter point in words."""
    names = [program, "the empty table" if mat == EMPTY_TABLE else mat]
    return ", ".join(names + [f"{name} = {'never' if value is None else value}" for name, value in values.items()])


@cache
def code_hash() -> str:
    """A hash of the code that a run's outcome depends on, whatever the ends of its lines."""
    house = Path(__file__).parents[2]
    digest = hashlib.sha256()
    for path in sorted(path for room in ("car", "sim", "words") for path in (house / room).rglob("*.py")):
        digest.update(path.relative_to(house).as_posix().encode() + path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()[:16]


def _followers(values: Mapping[str, Value]) -> int:
    followers = values.get("cars")
    return FOLLOWERS if followers is None else int(followers)


@lru_cache(maxsize=8)
def _empty_table(followers: int, reach_m: float) -> Mat:
    return open_table(formation(followers, reach_m))


def _hash(what: object) -> str:
    return hashlib.sha256(json.dumps(_plain(what)).encode()).hexdigest()


def _plain(what: Any) -> Any:
    """``what`` as JSON takes it: the same for equal things, another for others."""
    if dataclasses.is_dataclass(what):
        return {field.name: _plain(getattr(what, field.name)) for field in dataclasses.fields(what)}
    if isinstance(what, np.ndarray):
        return [str(what.dtype), what.shape, hashlib.sha256(np.ascontiguousarray(what).tobytes()).hexdigest()]
    if isinstance(what, bytes):
        return what.hex()
    if isinstance(what, Mapping):
        return [[_plain(key), _plain(value)] for key, value in what.items()]
    if isinstance(what, range):
        return ["range", what.start, what.stop]
    if isinstance(what, tuple | list):
        return [_plain(each) for each in what]
    return str(what) if isinstance(what, type) else what
