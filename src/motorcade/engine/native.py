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
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motorcade.car.brain import NO_VOICE
from motorcade.engine.backend import BackendName
from motorcade.engine.kernels import KERNELS, ORDER, SET_OUT, SORT, STRIP_PHASES, TURN
from motorcade.engine.linear_memory import LinearArray, LinearMemory, module_arguments
from motorcade.engine.state import MOST_PARTS, Arrays, Buffer

# What `platform.machine()` calls the processors of one kind.
_MACHINES = {"x86_64": "x86_64", "AMD64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64", "ARM64": "aarch64"}
_SUFFIXES = {"linux": ".so", "win32": ".dll", "darwin": ".dylib"}
# What Linux calls that which processors of the level x86-64-v3 have more than those of v2.
_LEVEL_3 = frozenset(("abm", "avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "movbe"))
# With more, threads need not wait for one whose share takes long.
SHARES_A_THREAD = 4
# With few strips, little is done twice at their edges.
STRIPS_A_THREAD = 2
# More wait for one that is free; any number of threads does all the work.
_MOST_THREADS = 256
_INT, _INTS = struct.Struct("<q"), struct.Struct("<5q")


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
    """

    def __init__(self, take: Callable[[int, int], None], strips: int, steps: int) -> None:
        self._take = take
        self._steps = steps
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
        taken, last = self._taken, len(self._taken) - 1
        taken[strip] += 1
        self._left -= 1
        if self._left == 0:
            self._ready.put(None)
        for near in range(max(strip - 1, 0), min(strip + 1, last) + 1):
            step = taken[near]
            # A neighbour that was behind this step has waited for it, or is taking it now.
            if near != strip and step != taken[strip]:
                continue
            if step < self._steps and taken[max(near - 1, 0)] >= step and taken[min(near + 1, last)] >= step:
                self._ready.put(near)


_pool: ThreadPoolExecutor


def _open_pool() -> None:
    """Make the pool of threads anew. They wait without spinning, and a call may ask for any number of them."""
    global _pool
    _pool = ThreadPoolExecutor(_MOST_THREADS, "kernels")


_open_pool()
# A forked process has none of its parent's threads.
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_open_pool)


def _share(work: Callable[[], None], threads: int) -> None:
    """Call ``work`` in each of several threads, of which this is one; return when all of them have ended."""
    helpers = []
    try:
        # While Python ends, a pool takes no work; then fewer threads do all of it.
        with suppress(RuntimeError):
            for _ in range(threads - 1):
                helpers.append(_pool.submit(work))
        work()
    finally:
        wait(helpers)


@lru_cache
def _kernels(path: Path) -> dict[str, Kernel]:
    """Return the kernels of a library, by name. Raises OSError or AttributeError where it can't be loaded."""
    library = ctypes.CDLL(str(path))
    kernels: dict[str, Kernel] = {}
    for name in module_arguments():
        function = getattr(library, name)
        function.argtypes, function.restype = [ctypes.c_char_p], ctypes.c_int
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

    def run(self, threads: int, *arguments: Any) -> None:
        """Call the kernel ``run`` with several threads; ``arguments`` as those of the kernel after its shares."""
        shares = SHARES_A_THREAD * threads
        block = self._block("run", 0, shares, *arguments)
        self._share("run", [_INT.pack(share) + block[_INT.size :] for share in range(shares)], threads)

    def _share(self, name: str, blocks: Sequence[bytes], threads: int) -> None:
        """Call a kernel with each of the blocks of arguments, with several threads."""
        pending, kernel = deque(blocks), self._kernels[name]

        def work() -> None:
            with suppress(IndexError):
                while True:
                    kernel(pending.popleft())

        _share(work, min(threads, len(blocks)))

    def run_large(self, threads: int, first_tick: int, ticks: int, said: int, arrays: Arrays, *arguments: Any) -> None:
        """Step one world by ``run_large``, phase by phase, with several threads.

        Args:
            threads: how many.
            first_tick: the tick to begin with.
            ticks: how many.
            said: what every car hears in the first tick.
            arrays: of the world.
            arguments: those of the kernel from ``seeds`` to ``scratch``.
        """
        kernel, every = self._kernels["run_large"], arrays.rules.sort_every
        rest = self._block("run_large", 0, 0, 0, 0, 0, *arguments, arrays)[5 * _INT.size :]

        def block(share: int, shares: int, phase: int, tick: int) -> bytes:
            return _INTS.pack(share, shares, phase, tick, said if tick == first_tick else NO_VOICE) + rest

        tick, end = first_tick, first_tick + ticks
        while tick < end:
            if tick % every == 0:
                kernel(block(0, 1, ORDER, tick))
                self._share("run_large", [block(share, threads, SORT, tick) for share in range(threads)], threads)
            kernel(block(0, 1, SET_OUT, tick))
            until = tick + 1 if arrays.driven.shape[1] else min(end, tick - tick % every + every)

            def take(strip: int, step: int, began: int = tick) -> None:
                after, phase = divmod(step, len(STRIP_PHASES))
                kernel(block(strip, 1, STRIP_PHASES[phase], began + after))

            steps = (until - tick) * len(STRIP_PHASES)
            wavefront = Wavefront(take, int(arrays.cells.strips[0, MOST_PARTS]), steps)
            _share(wavefront.work, threads)
            kernel(block(0, 1, TURN, until - 1))
            tick = until

    def _call(self, kernel: str, block: bytes) -> None:
        self._kernels[kernel](block)
