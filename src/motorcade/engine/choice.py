"""Choose what runs the kernels of a world; let native kernels take over from WebAssembly where that is worth it."""

import atexit
import gc
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from importlib.util import find_spec
from typing import Literal

from motorcade.engine.interpreted import InterpretedKernels
from motorcade.engine.targets import NAMES, Name, Target
from motorcade.errors import MotorcadeError

# WebAssembly addresses 4 GiB. Arrays that grow leave gaps, and the sizes here are estimates.
_MOST_BYTES = 3 << 30
Kind = Literal["one", "many", "large"]
"""One world in one thread, worlds side by side, or one world in several threads: each has kernels of its own."""

# Numba is imported and compiles in a process of its own, as it would delay the other threads of this one.
_CHILD = """
from motorcade.engine import choice
choice.follow_parent()
from motorcade.engine.world import compile_native
compile_native({kind!r}, {threads})
"""


def open_target(name: Name | None, needed_bytes: int) -> Target:
    """Return a target for one world; for None WebAssembly, or the native kernels where that can't hold the world.

    Args:
        name: one of NAMES, or None.
        needed_bytes: the estimated size of the world's arrays.

    Raises:
        MotorcadeError: there is no such target, or the world is too large for WebAssembly.
        ModuleNotFoundError: the library that the target needs isn't installed.
    """
    if name is not None and name not in NAMES:
        raise MotorcadeError("kernels-unknown", name=name, allowed=", ".join(NAMES))
    if name is None:
        fits = needed_bytes <= _MOST_BYTES and (find_spec("wasmtime") or not find_spec("numba"))
        name = "webassembly" if fits else "native"
    if name == "webassembly":
        if needed_bytes > _MOST_BYTES:
            raise MotorcadeError("world-exceeds-webassembly", needed=needed_bytes / 1e9, most=_MOST_BYTES / 1e9)
        from motorcade.engine.webassembly import WebAssemblyKernels

        return WebAssemblyKernels()
    return _native() if name == "native" else InterpretedKernels()


def _native() -> Target:
    from motorcade.engine.native import NativeKernels

    return NativeKernels()


def processors() -> int:
    """How many threads native kernels may use: as Numba has it, and without importing Numba."""
    if "NUMBA_NUM_THREADS" in os.environ:
        return int(os.environ["NUMBA_NUM_THREADS"])
    usable = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else range(os.cpu_count() or 1)
    return max(len(usable), 1)


def compile_in_child(kind: Kind, threads: int) -> bool:
    """Compile native kernels in a process of low priority, which ends with this one; return whether it succeeded."""
    # What Windows alone has; elsewhere the child lowers its own priority.
    flags = getattr(subprocess, "BELOW_NORMAL_PRIORITY_CLASS", 0) | getattr(subprocess, "CREATE_NO_WINDOW", 0)
    quiet = subprocess.DEVNULL
    command = [sys.executable, "-c", _CHILD.format(kind=kind, threads=threads)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=quiet, stderr=quiet, creationflags=flags) as child:
        atexit.register(child.kill)
        try:
            return child.wait() == 0
        finally:
            atexit.unregister(child.kill)


def follow_parent() -> None:
    """Give this process a low priority, and end it when its parent ends, which then closes our standard input."""
    if hasattr(os, "nice"):
        os.nice(10)

    def wait() -> None:
        sys.stdin.read()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


@contextmanager
def _garbage_kept() -> Iterator[None]:
    """Collect no cyclic garbage inside, and none of what is there afterwards.

    A collection stops all threads, for 0.1 s with as many objects as Numba makes.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        if was_enabled:
            gc.enable()


class Takeover:
    """Native kernels for the worlds of one kind, made ready in the background.

    Args:
        compile_native: compiles the kernels elsewhere, into Numba's cache; returns whether it succeeded.
        load: calls each kernel once, in a thread of this process, so that it is loaded from there.

    Attributes:
        native: the kernels, once they are ready.
        is_over: whether they are ready, or will never be: then WebAssembly goes on.
    """

    def __init__(self, compile_native: Callable[[], bool], load: Callable[[], None]) -> None:
        self.native: Target | None = None
        self.is_over = False
        self._compile_native = compile_native
        self._load = load
        self._thread = threading.Thread(target=self._make_ready, name="native kernels", daemon=True)
        self._thread.start()

    def wait(self) -> None:
        """Wait until it is over."""
        self._thread.join()

    def _make_ready(self) -> None:
        try:
            # Whatever fails here, WebAssembly gives the same results.
            with suppress(Exception):
                if self._compile_native():
                    with _garbage_kept():
                        self._load()
                    self.native = _native()
        finally:
            self.is_over = True


class Background:
    """Makes native kernels ready for the worlds of this process, while WebAssembly runs them.

    Args:
        compile_native: as `compile_in_child`.
        worth_car_steps: from so many car-steps on, in all worlds together, native kernels are worth the half minute of
            compiling; the default takes WebAssembly some 5 s.
        slice_car_steps: the most car-steps of a call while native kernels are made ready, so that they can take over
            soon; the default takes some 0.2 s.

    Attributes:
        takeovers: those that have begun, by the kind of their worlds.
    """

    def __init__(
        self,
        compile_native: Callable[[Kind, int], bool] = compile_in_child,
        worth_car_steps: int = 60_000_000,
        slice_car_steps: int = 2_000_000,
    ) -> None:
        self.takeovers: dict[Kind, Takeover] = {}
        self.slice_car_steps = slice_car_steps
        self._compile_native = compile_native
        self._left_car_steps = worth_car_steps

    def takeover(self, kind: Kind, threads: int, load: Callable[[Kind, int], None], car_steps: int) -> Takeover | None:
        """Return the takeover for worlds of a kind; None where it isn't worth it for ``car_steps`` more."""
        takeover = self.takeovers.get(kind)
        if takeover is None and car_steps >= self._left_car_steps:
            compile_native = partial(self._compile_native, kind, threads)
            takeover = self.takeovers[kind] = Takeover(compile_native, partial(load, kind, threads))
        return takeover

    def count(self, car_steps: int) -> None:
        """Note that so many car-steps were done."""
        self._left_car_steps -= car_steps


# The one of this process.
background = Background()


class KernelChoice:
    """What runs the kernels of one world, now and later.

    Args:
        name: one of NAMES, or None.
        needed_bytes: the estimated size of the world's arrays.
        kind: the kind of the world.
        threads: how many threads step it.
        load: as of `Takeover`, for worlds of a kind and a number of threads.

    Attributes:
        memory: allocates the arrays. They stay where they are when other kernels take over.
        now: runs the next call.

    Raises:
        MotorcadeError, ModuleNotFoundError: as of `open_target`.
    """

    def __init__(
        self, name: Name | None, needed_bytes: int, kind: Kind, threads: int, load: Callable[[Kind, int], None]
    ) -> None:
        self.memory = self.now = open_target(name, needed_bytes)
        self._may_change = name is None and self.now.name == "webassembly"
        self._kind: Kind = kind
        self._threads = threads
        self._load = load

    def begin(self, car_steps: int) -> int:
        """Let native kernels take over if they are ready; return how many car-steps the next call may have at most.

        Args:
            car_steps: how many are left of the present run.
        """
        if not self._may_change:
            return car_steps
        takeover = background.takeover(self._kind, self._threads, self._load, car_steps)
        if takeover is None:
            background.count(car_steps)
            return car_steps
        if takeover.is_over:
            self.now, self._may_change = takeover.native or self.now, False
            return car_steps
        return background.slice_car_steps
