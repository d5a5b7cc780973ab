"""The public interface of the engine on a computer: a world of cars, or many worlds side by side, with NumPy.

It opens what runs the kernels: the library of this computer, else WebAssembly; or plain Python.
"""

import hashlib
import json
import os
from collections.abc import Sequence
from functools import lru_cache, partial
from typing import Any

import numpy as np
import psutil
from numpy.typing import NDArray

from motorcade.config.arguments import instance_of, to_whole
from motorcade.config.profile import Profile, built_in_profile
from motorcade.engine import events as event_rows
from motorcade.engine import layout
from motorcade.engine.backend import NAMES, Backend, BackendArray, BackendName
from motorcade.engine.events import EVENT
from motorcade.engine.moment import COLUMNS, Event, Moment
from motorcade.engine.native import (
    SHARES_A_THREAD,
    SHARES_OF_LONG_SLICES,
    STRIPS_A_THREAD,
    InterpretedKernels,
    NativeKernels,
    library_path,
)
from motorcade.engine.saving import SavableSimulation
from motorcade.engine.simulation import Simulation, checked_images
from motorcade.engine.slices import CALL_S, Slices
from motorcade.engine.state import MOST_PARTS
from motorcade.errors import MotorcadeError
from motorcade.mats import Mat, check_mat, formation, open_table
from motorcade.mats.document import check_things
from motorcade.words.formats import CONTROL
from motorcade.words.image import Image, image_words
from motorcade.words.packing import words_to_bytes

# One thread is faster for a single world of fewer cars.
_LARGE = 20_000
_WHOLE_RUN = 1 << 62
# The cars of many worlds from which on a run has long slices, and how long these are at most.
_UNCACHED = 8_000
_LONG_SLICE_S = 1.5
# WebAssembly addresses 4 GiB. Arrays that grow leave gaps, and the sizes here are estimates.
_MOST_BYTES = 3 << 30
_MOST_THREADS = 1024
_PROOF_MS = 2_000
# Beside the libraries: the digest of each, and of the proof.
DIGESTS = "digests.json"


class World(SavableSimulation):
    """Simulate cars on a mat; attributes as of Simulation.

    Args:
        mat: where the cars start, and what is around them.
        images: the leaders' programs, as the bytes that are uploaded to cars; the mat's k-th leader runs
            ``images[k % len(images)]``.
        profile: what the levels in words mean; default: the built-in profile ``classroom``.
        seeds: one seed for one world, or several for as many worlds side by side. The same seed gives the same run, to
            the last bit, with any number of threads.
        events: whether to keep events for `take_events`.
        threads: how many threads to use; default: one per processor. WebAssembly uses one.
        kernels: what runs the cars, with the same bits: ``"native"`` (machine code), ``"webassembly"``, or
            ``"interpreted"``; default: native, or WebAssembly on a computer that no machine code is for.

    Raises:
        MotorcadeError: an image is damaged, the world can't be simulated, or it doesn't fit into the memory.
    """

    def __init__(
        self,
        mat: Mat,
        images: Sequence[bytes] = (),
        profile: Profile | None = None,
        *,
        seeds: int | Sequence[int] = 0,
        events: bool = False,
        threads: int | None = None,
        kernels: BackendName | None = None,
    ) -> None:
        profile = built_in_profile("classroom") if profile is None else instance_of(Profile, "profile", profile)
        self._check_mat(instance_of(Mat, "mat", mat), profile)
        self._open(mat, checked_images(images), profile, _as_list(seeds), events, threads, kernels)

    def _open(
        self,
        mat: Mat,
        images: Sequence[bytes],
        profile: Profile,
        seeds: Sequence[int],
        events: bool,
        threads: int | None,
        kernels: BackendName | None,
    ) -> None:
        """Make the worlds on a mat that has been checked."""
        self._given_threads = threads
        self._given_kernels = kernels
        self.threads = processors() if threads is None else to_whole("threads", threads, 1, _MOST_THREADS)
        cars = len(mat.starts)
        worlds = len(seeds)
        needed = cars * worlds * layout.BYTES_A_CAR
        _check_memory(cars * worlds, needed)
        backend = open_backend(kernels, needed)
        self._is_large = backend.threaded and worlds == 1 and self.threads > 1 and cars >= _LARGE
        parts = min(STRIPS_A_THREAD * self.threads, MOST_PARTS) if self._is_large else None
        working, self._kept = min(self.threads, worlds), list[NDArray[Any]]()
        self._shares = SHARES_A_THREAD * working
        # Worlds that don't fit into a processor's cache are simulated one after the other for long.
        has_long_slices = backend.threaded and worlds > 1 and cars * worlds >= _UNCACHED and not events
        if has_long_slices:
            self._shares = min(SHARES_OF_LONG_SLICES * working, worlds)
        shares = parts or self._shares
        super().__init__(mat, images, profile, backend, seeds=seeds, events=events, parts=parts, shares=shares)
        if has_long_slices:
            longest_s = min(CALL_S * self._shares / working, _LONG_SLICE_S)
            self._slices = Slices(cars * worlds, longest_s=longest_s)
            self._can_go_back = True

    def _check_mat(self, mat: Mat, profile: Profile | None) -> None:
        """Check what is around the cars and, for cars of a profile, their places."""
        if profile is None:
            check_things(mat)
        else:
            check_mat(mat, profile)

    @property
    def kernels(self) -> BackendName:
        """What runs the cars."""
        return self.backend.name

    @property
    def nbytes(self) -> int:
        """The bytes that all arrays of the world occupy."""
        state = (self.state.rows, self.state.push, self.state.order, self.state.wheels, self.state.program)
        arrays = (
            *state,
            *self._cells,
            *self._around,
            *self._obstacles,
            *self._people,
            *self._voices,
            self._driven,
            self._decisions,
            *self._counters,
        )
        return sum(np.asarray(array).nbytes for array in arrays)

    def reset(self, seeds: int | Sequence[int] | None = None) -> None:
        """Begin again, with other seeds where they are given (as many as there are worlds)."""
        super().reset(None if seeds is None else _as_list(seeds))

    def set_environment(self, mat: Mat, range_mm: int | None = None) -> None:
        """Replace walls, obstacles, people, voices and physics; as `Simulation.set_environment`."""
        self._check_mat(instance_of(Mat, "mat", mat), None)
        super().set_environment(mat, range_mm)

    def snapshot(self, world: int = 0) -> Moment:
        """What the cars of a world show now, and what was counted in it since reset; columns are arrays of NumPy."""
        arrays = super().snapshot(world).map(lambda name, column: np.array(column))
        return arrays.map(lambda name, column: column.view(bool) if COLUMNS[name].packed == "bool" else column)

    def take_events(self) -> NDArray[np.void]:
        """The events since the last call, as an array of EVENT, sorted by time, world and car.

        ``kind`` and ``why`` are indices into KINDS and LOSS_REASONS: state (a leader begins a state), start (a follower
        begins a word), over (the word's length is over, or the condition of a leader's state ended it), flow (a leader
        executed a flow word on its way to a state), frame (a car begins a frame), heard, lost. ``word`` is the control
        word, for a lost frame the bits on the air; ``other`` is the index of a state, the number of a frame's sender,
        or of a flow word its index and, times NEXT_WORD, that of the word that came next. The time of an event may lie
        before the tick that found it.

        Raises:
            MotorcadeError: the world keeps no events.
        """
        parts = [self._events_of(world) for world in range(self.worlds)]
        taken = np.concatenate(parts)
        # Each part is sorted.
        return taken if len(parts) == 1 else taken[np.argsort(taken["t_ms"], kind="stable")]

    def _events_of(self, world: int) -> NDArray[np.void]:
        rows = self.take_rows(world)
        taken = np.zeros(len(rows), EVENT)
        taken["world"] = world
        taken["run"] = self.run_number
        for name in Event._fields:
            taken[name] = rows[:, getattr(event_rows, name.upper())]
        return taken

    def counts(self) -> dict[str, NDArray[np.int64]]:
        """Count what has happened since reset, as `totals`; each array has the shape (worlds,)."""
        totals = [self.totals(world) for world in range(self.worlds)]
        return {name: np.array([counts[name] for counts in totals], np.int64) for name in totals[0]}

    def _contents(self) -> list[tuple[BackendArray, Any]]:
        if not self._can_go_back:
            return super()._contents()
        # New memory each time would take longer than the copy.
        changing = self._changing()
        if [kept.shape for kept in self._kept] != [column.shape for column in changing]:
            self._kept = [np.empty(column.shape, column.dtype) for column in changing]
        for kept, column in zip(self._kept, changing, strict=True):
            np.copyto(kept, column)
        return list(zip(changing, self._kept, strict=True))

    def _longest_slice(self) -> int:
        # What leads a large world can be stopped at any tick.
        return super()._longest_slice() if self._keeps_events or not self._is_large else _WHOLE_RUN

    def _advance(self, until: int) -> None:
        advance = partial(super()._advance, until)
        if self._is_large and isinstance(self.backend, NativeKernels):
            self.backend.lead(advance)
        else:
            advance()

    def _call(self, until: int) -> int:
        backend = self.backend
        moment = (until, self._spoken_at, self._spoken)
        if self._is_large and isinstance(backend, NativeKernels):
            scratch = backend.zeros("scratch", (self.threads, self.cars), "uint32")
            return backend.run_large(self.threads, *moment, self.arrays(), self._seeds, scratch)
        if self.worlds > 1 and isinstance(backend, NativeKernels):
            backend.run(min(self.threads, self.worlds), self._shares, *moment, self._seeds, self.arrays(), self._asked)
            return until
        return super()._call(until)


def open_backend(name: BackendName | None = None, needed_bytes: int = 0) -> Backend:
    """Return what runs one world; for None the library of this computer, or WebAssembly where it can't be used.

    Args:
        name: one of NAMES, or None.
        needed_bytes: the estimated size of the world's arrays.

    Raises:
        MotorcadeError: there is no such backend, its library can't be used, or the world is too large for it.
        ModuleNotFoundError: wasmtime isn't installed.
    """
    if name is not None and (not isinstance(name, str) or name not in NAMES):
        raise MotorcadeError("kernels-unknown", name=name, allowed=", ".join(NAMES))
    if name == "interpreted":
        return InterpretedKernels()
    problem = None if name == "webassembly" else library_problem()
    if problem and name == "native":
        raise problem
    if problem is None and name != "webassembly":
        return NativeKernels()
    if needed_bytes > _MOST_BYTES:
        raise MotorcadeError("world-exceeds-webassembly", needed=needed_bytes / 1e9, most=_MOST_BYTES / 1e9)
    from motorcade.engine.webassembly import WebAssemblyKernels

    return WebAssemblyKernels()


@lru_cache
def library_problem() -> MotorcadeError | None:
    """Return why this computer can't use its library: missing, damaged, not loadable, or wrong; None where it can."""
    path = library_path()
    if not path.exists():
        return MotorcadeError("library-missing", file=path.name)
    digests = json.loads((path.parent / DIGESTS).read_text(encoding="utf-8"))
    # To load a file that was cut off would end the process.
    if hashlib.sha256(path.read_bytes()).hexdigest() != digests[path.name]:
        return MotorcadeError("library-damaged", file=path.name)
    try:
        backend = NativeKernels()
    except (OSError, AttributeError) as problem:
        return MotorcadeError("library-not-loaded", file=path.name, reason=str(problem))
    return None if proof(backend) == digests["proof"] else MotorcadeError("library-differs", file=path.name)


def proof(backend: Backend) -> str:
    """Return a digest of a small world after two seconds: the same for every backend that computes rightly."""
    drives = {"forward": 1, "motor_enable": 1, "motor_duration": 3}
    leader = (CONTROL.encode(**drives, motor_direction=3, motor_speed=3),)
    followers = tuple(CONTROL.encode(accept_ir=1, **drives, motor_direction=k, motor_speed=k) for k in (1, 2, 3))
    image = words_to_bytes(image_words(Image(leader, followers, dwell_level=0, tagged=1)))
    world = Simulation(open_table(formation(12)), [image], None, backend, seeds=(7,))
    world.run(_PROOF_MS)
    digest = hashlib.sha256(repr(sorted(world.totals().items())).encode())
    for column in (world.state.rows, world.state.wheels):
        digest.update(backend.read(column))
    return digest.hexdigest()


def processors() -> int:
    """How many threads a world uses: one for each processor that this process may use."""
    usable = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else range(os.cpu_count() or 1)
    return max(len(usable), 1)


def _check_memory(cars: int, needed: int) -> None:
    free = psutil.virtual_memory().available
    if needed > free:
        raise MotorcadeError("world-exceeds-memory", cars=cars, needed=needed / 1e9, free=free / 1e9)


def _as_list(seeds: Any) -> Sequence[int]:
    """Return the seeds; a single one as a list. Raises MotorcadeError: there are none."""
    if getattr(seeds, "shape", None) == () or isinstance(seeds, str) or not hasattr(seeds, "__len__"):
        return [seeds]
    if not len(seeds):
        raise MotorcadeError("world-without-seeds")
    listed: Sequence[int] = seeds
    return listed
