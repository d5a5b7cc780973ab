"""Run the kernels on arrays of NumPy: in machine code, or as plain Python.

Machine code is in a shared library of this kind of computer, compiled before Motorcade is installed.
``scripts/engine_module.py`` makes the libraries and engine.wasm from the same code, so the arguments of the kernels are
those of engine.wasm. A call lets go of Python's lock.
"""

import ctypes
import os
import platform
import struct
import sys
import threading
from _thread import start_new_thread
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motorcade.car.brain import NO_VOICE
from motorcade.engine.backend import BackendName
from motorcade.engine.events import TICK
from motorcade.engine.kernels import KERNELS, ORDER, SET_OUT, SORT, STRIP_PHASES, TURN
from motorcade.engine.linear_memory import LinearArray, LinearMemory, module_arguments
from motorcade.engine.state import MOST_PARTS, Arrays, Buffer

# What `platform.machine()` calls the processors of one kind.
_MACHINES = {"x86_64": "x86_64", "AMD64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64", "ARM64": "aarch64"}
_SUFFIXES = {"linux": ".so", "win32": ".dll", "darwin": ".dylib"}
# What Linux calls that which processors of the level x86-64-v3 have more than those of v2.
_LEVEL_3 = frozenset(("abm", "avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "movbe"))
# With more, threads need not wait for one whose share takes long. A share of a long slice has to be short, too.
SHARES_A_THREAD = 4
SHARES_OF_LONG_SLICES = 64
# With few strips, little is done twice at their edges.
STRIPS_A_THREAD = 2
# More wait for one that is free; any number of threads does all the work.
_MOST_THREADS = 256
_WAIT_S = 0.05
_INT = struct.Struct("<q")
_INTS = struct.Struct("<5q")


def as_array(contents: Buffer) -> NDArray[Any]:
    """Return a buffer as an array of NumPy, without a copy."""
    return np.asarray(contents.items).view(contents.dtype).reshape(contents.shape)


class NumpyArrays:
    """Arrays of NumPy, where it allocates them; addresses count from ``_base``."""

    _base = 0

    def zeros(self, slot: str, shape: tuple[int, ...], dtype: str) -> NDArray[Any]:
        """Return an array of zeros."""
        return np.zeros(shape, dtype)

    def allocate(self, slot: str, contents: Buffer) -> NDArray[Any]:
        """Return the contents as an array, without a copy."""
        return as_array(contents)

    def read(self, array: NDArray[Any]) -> bytes:
        """Return the contents of an array."""
        return array.tobytes()

    def write(self, array: NDArray[Any], contents: bytes) -> None:
        """Replace the contents of an array."""
        array[...] = np.frombuffer(contents, array.dtype).reshape(array.shape)

    def clear(self, array: NDArray[Any]) -> None:
        """Fill an array with zeros."""
        array[...] = 0

    def _describe(self, value: Any) -> LinearArray | None:
        if not isinstance(value, np.ndarray):
            return None
        address = value.__array_interface__["data"][0] - self._base
        return LinearArray(_name_of(value.dtype), value.shape, value.strides, address)


class InterpretedKernels(NumpyArrays):
    """The kernels as plain Python: some hundred times slower than native ones, for a debugger and for comparison."""

    name: BackendName = "interpreted"
    threaded = False
    interruptible = True

    def join(self) -> None:
        """Wait for nothing: calls have one thread."""

    def call(self, kernel: str, *arguments: Any) -> None:
        """Call a kernel."""
        # Compiled integers wrap around silently, so NumPy's have to.
        with np.errstate(over="ignore"):
            KERNELS[kernel](*arguments)


def library_path() -> Path:
    """Return where the library for this system, processor and Python is, whether or not there is one."""
    machine = _MACHINES.get(platform.machine(), platform.machine())
    # A 32-bit Python may run on a 64-bit system.
    bits = "" if sys.maxsize > 2**32 else "-32"
    level = "-v3" if (sys.platform, machine, bits) == ("linux", "x86_64", "") and _has_level_3() else ""
    name = f"{sys.platform}-{machine}{bits}{level}{_SUFFIXES.get(sys.platform, '')}"
    return Path(__file__).parent / "libraries" / name


@lru_cache
def _has_level_3() -> bool:
    """Whether the processor is of the level x86-64-v3, as Linux lists what it has."""
    with Path("/proc/cpuinfo").open(encoding="utf-8") as listed:
        flags = next((line.split() for line in listed if line.startswith("flags")), [])
    return _LEVEL_3.issubset(flags)


Kernel = Callable[[bytes], int]
"""Takes the block of its arguments."""


class Wavefront:
    """Steps of the strips of a world. A strip takes its next step when its neighbours have taken the one before.

    So no thread waits for the slowest strip, and neighbours are never more than one step apart.

    Args:
        take: takes a step of a strip; both are numbers from 0 on.
        strips: how many there are.
        steps: how many each takes.
        unit: of so many steps, only all or none may be taken.
        is_stopped: whether no strip is to take a unit any more that none has begun.

    Attributes:
        steps: how many each has taken, after `work`.
    """

    def __init__(
        self, take: Callable[[int, int], None], strips: int, steps: int, unit: int, is_stopped: Callable[[], bool]
    ) -> None:
        self._take = take
        self.steps = steps
        self._unit = unit
        self._is_stopped = is_stopped
        self._taken = [0] * strips
        self._left = strips * steps
        self._lock = threading.Lock()
        self._ready: SimpleQueue[int | None] = SimpleQueue()
        for strip in range(strips):
            self._ready.put(strip)

    def work(self) -> None:
        """Take steps until all are taken, or another thread has been interrupted. Several threads call it."""
        try:
            while (strip := self._ready.get()) is not None:
                self._take(strip, self._taken[strip])
                with self._lock:
                    self._end_of(strip)
        finally:
            # Each thread that ends lets another one end.
            self._ready.put(None)

    def _end_of(self, strip: int) -> None:
        taken = self._taken
        last = len(self._taken) - 1
        taken[strip] += 1
        self._left -= 1
        if self._is_stopped():
            # The strip that is farthest may be in its next step already.
            begun = max(taken) + 1
            steps = min(-(-begun // self._unit) * self._unit, self.steps)
            self._left -= (self.steps - steps) * len(taken)
            self.steps = steps
        if self._left == 0:
            self._ready.put(None)
        for near in range(max(strip - 1, 0), min(strip + 1, last) + 1):
            step = taken[near]
            # A neighbour that was behind this step has waited for it, or is taking it now.
            if near != strip and step != taken[strip]:
                continue
            if step < self.steps and taken[max(near - 1, 0)] >= step and taken[min(near + 1, last)] >= step:
                self._ready.put(near)


class Pool:
    """Threads that wait for work without spinning, as many as were ever needed at once.

    Whoever asks for work may be interrupted at any line. So it uses nothing but what is one step of the interpreter:
    Python's own pool has locks that an exception may leave locked.
    """

    def __init__(self) -> None:
        self._tasks: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._lock = threading.Lock()
        self._threads = self._busy = 0

    def call(self, task: Callable[[], None]) -> None:
        """Let a thread call ``task``. Raises RuntimeError: Python ends, and there is none."""
        if self._busy + self._tasks.qsize() >= self._threads < _MOST_THREADS:
            try:
                start_new_thread(self._work, ())
                self._threads += 1
            except RuntimeError:
                if not self._threads:
                    raise
        self._tasks.put(task)

    def _work(self) -> None:
        while True:
            task = self._tasks.get()
            with self._lock:
                self._busy += 1
            task()
            # What it holds may be large.
            del task
            with self._lock:
                self._busy -= 1


_pool: Pool


def _open_pool() -> None:
    """Make the pool of threads anew; a call may ask for any number of them."""
    global _pool
    _pool = Pool()


_open_pool()
# A forked process has none of its parent's threads.
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_open_pool)


def _do_nothing() -> None:
    """Stand for work that has been done."""


class Crew:
    """Threads of the pool that do some work.

    Python raises KeyboardInterrupt, and what other handlers of signals raise, in the main thread alone. So these
    threads end what they have begun, and the main thread can wait for that however often it is interrupted. They alone
    take the lock.

    Args:
        work: what each of them calls.
    """

    def __init__(self, work: Callable[[], None]) -> None:
        self._work = work
        self._lock = threading.Lock()
        self._ends: SimpleQueue[None] = SimpleQueue()
        self._working = 0
        self._has_ended = False
        self._is_closed = False
        self._problem: BaseException | None = None

    def call(self, threads: int) -> None:
        """Let so many threads begin. Raises RuntimeError: Python ends, and there is none."""
        for _ in range(threads):
            _pool.call(self._begin)

    def _begin(self) -> None:
        with self._lock:
            self._working += 1
        # After it counts: whoever closed the crew before this line waits for this thread, which does nothing.
        if not self._is_closed:
            try:
                self._work()
            except BaseException as problem:  # noqa: BLE001 - the thread that waits raises it
                self._problem = problem
        with self._lock:
            self._working, self._has_ended = self._working - 1, True
        self._ends.put(None)

    def wait(self) -> None:
        """Wait until a thread has ended; raise what it raised."""
        while not self._has_ended:
            self._wait_for_an_end()
        if self._problem:
            raise self._problem

    def close(self) -> None:
        """Let no more threads begin, and wait until those that have begun end."""
        # Without the lock: an exception may break off this thread where it leaves a `with`, and would keep it locked.
        self._is_closed = True
        while self._working:
            self._wait_for_an_end()
        # The work may hold the world that holds its crew, and a world's memory is to be free at once.
        self._work = _do_nothing

    def _wait_for_an_end(self) -> None:
        # On Windows nothing interrupts a wait without an end.
        with suppress(Empty):
            self._ends.get(timeout=_WAIT_S)


def _share(work: Callable[[], None], threads: int, crew: Crew) -> None:
    """Do ``work``, the crew's, in several threads, of which this is one; return when all of them have ended."""
    try:
        # While Python ends, fewer threads do all of the work.
        with suppress(RuntimeError):
            crew.call(threads - 1)
        work()
    finally:
        crew.close()


@lru_cache
def _kernels(path: Path) -> dict[str, Kernel]:
    """Return the kernels of a library, by name. Raises OSError or AttributeError where it can't be loaded."""
    library = ctypes.CDLL(str(path))
    kernels: dict[str, Kernel] = {}
    for name in module_arguments():
        function = getattr(library, name)
        function.argtypes = [ctypes.c_char_p]
        function.restype = ctypes.c_int
        kernels[name] = function
    return kernels


@lru_cache
def _name_of(dtype: "np.dtype[Any]") -> str:
    """NumPy makes the name anew each time, which takes longer than all else of a description."""
    return dtype.name


class NativeKernels(NumpyArrays, LinearMemory):
    """The kernels of this computer's library. Raises OSError where it can't be loaded."""

    name: BackendName = "native"
    threaded = True

    def __init__(self) -> None:
        # Arrays may be anywhere.
        super().__init__(module_arguments(), 1 << 63)
        self._kernels = _kernels(library_path())
        # Who works on the arrays, besides the thread that calls.
        self._crew = Crew(_do_nothing)
        self._is_stopped = False

    def join(self) -> None:
        """Wait until no other thread works on the arrays, after an exception broke off `run` or `lead`."""
        self._is_stopped = True
        self._crew.close()

    def run(self, threads: int, shares: int, *arguments: Any) -> None:
        """Call the kernel ``run`` for each share, with several threads; ``arguments`` as those after its shares."""
        block = self._block("run", 0, shares, *arguments)
        work = self._call_each("run", [_INT.pack(share) + block[_INT.size :] for share in range(shares)])
        self._crew = Crew(work)
        _share(work, threads, self._crew)

    def _call_each(self, name: str, blocks: Sequence[bytes]) -> Callable[[], None]:
        """Return what calls a kernel with each of the blocks of arguments; several threads may share it."""
        pending = deque(blocks)
        kernel = self._kernels[name]

        def work() -> None:
            try:
                with suppress(IndexError):
                    while True:
                        kernel(pending.popleft())
            finally:
                # Where an exception broke off this thread, the others end, too.
                pending.clear()

        return work

    def lead(self, work: Callable[[], None]) -> None:
        """Let another thread do ``work``, which calls `run_large`; an exception that comes here stops it soon."""
        self._is_stopped = False
        self._crew = Crew(work)
        try:
            self._crew.call(1)
        except RuntimeError:
            work()
        else:
            self._crew.wait()
            self._crew.close()

    def run_large(self, threads: int, until: int, said_at: int, said: int, arrays: Arrays, *arguments: Any) -> int:
        """Step one world by ``run_large``, phase by phase, with several threads.

        Args:
            threads: how many.
            until: the tick to come to.
            said_at: the tick in which every car hears ``said``.
            said: a voice command, or NO_VOICE.
            arrays: of the world.
            arguments: those of the kernel from ``seeds`` to ``scratch``.

        Returns:
            The tick that it has come to: an earlier one where `join` stops it.
        """
        kernel = self._kernels["run_large"]
        every = arrays.rules.sort_every
        rest = self._block("run_large", 0, 0, 0, 0, 0, *arguments, arrays)[5 * _INT.size :]

        def block(share: int, shares: int, phase: int, tick: int) -> bytes:
            return _INTS.pack(share, shares, phase, tick, said if tick == said_at else NO_VOICE) + rest

        tick = int(arrays.counters.counts[0, TICK])
        counts = arrays.counters.counts
        while tick < until and not self._is_stopped:
            if tick % every == 0:
                kernel(block(0, 1, ORDER, tick))
                sort = self._call_each("run_large", [block(share, threads, SORT, tick) for share in range(threads)])
                _share(sort, threads, Crew(sort))
            kernel(block(0, 1, SET_OUT, tick))
            end = tick + 1 if arrays.driven.shape[1] else min(until, tick - tick % every + every)

            def take(strip: int, step: int, began: int = tick) -> None:
                after, phase = divmod(step, len(STRIP_PHASES))
                kernel(block(strip, 1, STRIP_PHASES[phase], began + after))

            steps = (end - tick) * len(STRIP_PHASES)
            strips = int(arrays.cells.strips[0, MOST_PARTS])
            wavefront = Wavefront(take, strips, steps, len(STRIP_PHASES), lambda: self._is_stopped)
            _share(wavefront.work, threads, Crew(wavefront.work))
            tick += wavefront.steps // len(STRIP_PHASES)
            kernel(block(0, 1, TURN, tick - 1))
            counts[:, TICK] = tick
        return tick

    def _call(self, kernel: str, block: bytes) -> None:
        self._kernels[kernel](block)
