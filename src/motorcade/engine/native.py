"""Compile the kernels with Numba. Only this module imports Numba, which takes half a second.

Numba compiles a call of `motorcade.car.brain.follower_step` from the source of that function, so there is no second
version of it.
"""

import hashlib
import inspect
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from types import FunctionType
from typing import Any

# Otherwise OpenMP's threads spin while they wait, which slows down a busy machine many times.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

import numba
from numba.core import event, types
from numba.extending import overload_method, register_jitable

from motorcade.car import brain, frames, next_wakeup, step
from motorcade.engine import events, kernels, marking, state
from motorcade.engine.interpreted import HeapArrays, call_interpreted
from motorcade.engine.targets import Name
from motorcade.words import infrared, ticks

# Portable functions, which can't be marked where they stand.
_PLAIN = (ticks, infrared, brain, frames, next_wakeup, step, events)
# Nothing is allocated in a kernel, so its arrays need no reference counts, which would take most of the time.
OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True, "_nrt": False}


def _functions() -> Iterator[FunctionType]:
    yield from marking.FUNCTIONS
    for module in _PLAIN:
        for function in list(vars(module).values()):
            if isinstance(function, FunctionType) and function.__module__ == module.__name__:
                yield function


def _register_method(kind: type, name: str, method: FunctionType) -> None:
    def implementation(self: Any, *arguments: Any) -> FunctionType | None:
        return method if self.instance_class is kind else None

    # Numba looks here for the names of the parameters.
    implementation.__signature__ = inspect.signature(method)  # type: ignore[attr-defined]
    options: dict[str, Any] = {"jit_options": {"forceinline": True}, "strict": False}
    # Numba has one type for all named tuples, which holds the class.
    overload_method(types.NamedTuple, name, **options)(implementation)


for _function in _functions():
    register_jitable(forceinline=True)(_function)
for _class in marking.CLASSES:
    for _name, _method in list(vars(_class).items()):
        if isinstance(_method, FunctionType) and not _name.startswith("_"):
            _register_method(_class, _name, _method)


def compiled(
    make: Callable[[str, Any], Callable[..., Any]], sources: tuple[Path, ...], parallel: bool
) -> Callable[..., Any]:
    """Return a kernel that is compiled at its first call and cached on disk for the next start.

    Numba's cache looks only at the file of the kernel itself. Therefore ``make`` takes a fingerprint of all that is
    compiled into the kernel and returns a function with the fingerprint in its closure, which Numba does look at.

    Args:
        make: returns the kernel for a fingerprint, and for the function that replaces ``range`` in parallel loops.
        sources: the files whose functions the kernel calls, besides those of the engine.
        parallel: whether the kernel's ``prange`` loops use several threads.
    """
    digest = hashlib.sha256()
    files = {Path(function.__code__.co_filename) for function in _functions()}
    for path in (*sorted(files), *sources, *(Path(str(each.__file__)) for each in (kernels, state)), Path(__file__)):
        digest.update(path.read_bytes())
    # With fusion, one part of a world would enter a loop before all parts have left the loop before it.
    options = {**OPTIONS, "cache": True, "parallel": {"fusion": False} if parallel else False}
    function = make(f"{digest.hexdigest()}, parallel={parallel}", numba.prange)
    kernel: Callable[..., Any] = numba.njit(**options)(function)
    return kernel


@lru_cache
def _kernel(name: str, parallel: bool) -> Callable[..., Any]:
    return compiled(kernels.KERNELS[name], (), parallel)


class NativeKernels(HeapArrays):
    """The kernels in machine code: the fastest target, the only one with threads; compiled once on each computer."""

    name: Name = "native"
    threaded = True

    def call(self, kernel: str, threads: int, *arguments: Any) -> None:
        """Call a kernel with at most ``threads`` threads."""
        if kernel in kernels.OF_ONE_CAR:
            call_interpreted(kernel, *arguments)
            return
        before = numba.get_num_threads()
        numba.set_num_threads(min(threads, numba.config.NUMBA_NUM_THREADS))  # type: ignore[attr-defined]  # environment
        try:
            _kernel(kernel, threads > 1 and kernel in kernels.PARALLEL)(*arguments)
        finally:
            numba.set_num_threads(before)


class _Listener(event.Listener):
    def __init__(self, notify: Callable[[], object]) -> None:
        self._notify = notify
        self._notified = False

    def on_start(self, event: object) -> None:
        if not self._notified:
            self._notified = True
            self._notify()

    def on_end(self, event: object) -> None:
        pass


@contextmanager
def on_compiling(notify: Callable[[], object]) -> Iterator[None]:
    """Inside this context, call ``notify`` once if anything has to be compiled, in whichever thread does it.

    Reading kernels from disk takes a moment; compiling them takes some 20 s.
    """
    with event.install_listener("numba:compile", _Listener(notify)):
        yield
