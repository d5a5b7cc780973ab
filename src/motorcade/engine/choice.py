"""Choose what runs the kernels of a world."""

import os
from importlib.util import find_spec

from motorcade.engine.targets import NAMES, InterpretedKernels, Name, Target
from motorcade.errors import MotorcadeError

# WebAssembly addresses 4 GiB. Arrays that grow leave gaps, and the sizes here are estimates.
_MOST_BYTES = 3 << 30


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
    if name == "native":
        from motorcade.engine.native import NativeKernels

        return NativeKernels()
    return InterpretedKernels()


def processors() -> int:
    """How many threads native kernels may use: as Numba has it, and without importing Numba."""
    if "NUMBA_NUM_THREADS" in os.environ:
        return int(os.environ["NUMBA_NUM_THREADS"])
    usable = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else range(os.cpu_count() or 1)
    return max(len(usable), 1)
