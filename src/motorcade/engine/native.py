"""The brain's own functions, made callable from compiled code: no copy, no second version.

Importing this module is enough. Numba then compiles a call of
`motorcade.car.brain.follower_step` from that very function's source.
"""

import hashlib
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FunctionType
from typing import Any

# OpenMP's threads would else spin while they wait, which slows a busy machine many times over.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

import numba
from numba.core import event
from numba.extending import register_jitable

from motorcade.car import brain
from motorcade.car import next_wakeup as rest
from motorcade.words import infrared, ticks

# For functions that kernels call. Inlined, since a call would copy each array's description.
in_kernel = register_jitable(forceinline=True)

_BRAIN = (ticks, infrared, brain, rest)
for _module in _BRAIN:
    for _function in list(vars(_module).values()):
        if isinstance(_function, FunctionType) and _function.__module__ == _module.__name__:
            in_kernel(_function)


def compiled(
    make: Callable[[str], Callable[..., Any]], sources: tuple[Path, ...], parallel: bool
) -> Callable[..., Any]:
    """A kernel compiled at its first call, and kept on disk for the next start.

    Numba's cache looks at the kernel's own file alone. So ``make`` takes a
    fingerprint of all that is compiled into the kernel, and gives a function that
    holds it in its closure, which Numba does look at.

    Args:
        make: gives the kernel for a fingerprint.
        sources: the files whose functions the kernel calls, beside the brain's.
        parallel: whether the kernel's ``prange`` loops use several threads.
    """
    digest = hashlib.sha256()
    for path in (*(Path(str(module.__file__)) for module in _BRAIN), *sources, Path(__file__)):
        digest.update(path.read_bytes())
    # Nothing is allocated in a kernel, so its arrays need no counting of references, which takes most of the time.
    # Fused, one part would enter a loop before all have left the one before it.
    loops = {"fusion": False} if parallel else False
    options: dict[str, Any] = {"cache": True, "parallel": loops, "error_model": "numpy", "nogil": True, "_nrt": False}
    kernel: Callable[..., Any] = numba.njit(**options)(make(f"{digest.hexdigest()}, parallel={parallel}"))
    return kernel


class _Listener(event.Listener):
    def __init__(self, tell: Callable[[], object]) -> None:
        self._tell = tell
        self._told = False

    def on_start(self, event: object) -> None:
        if not self._told:
            self._told = True
            self._tell()

    def on_end(self, event: object) -> None:
        pass


@contextmanager
def telling(tell: Callable[[], object]) -> Iterator[None]:
    """Inside, ``tell`` is called once if anything has to be compiled, by whichever thread does it.

    Kernels that are read from disk take a moment; compiling them takes some 20 s.
    """
    with event.install_listener("numba:compile", _Listener(tell)):
        yield
