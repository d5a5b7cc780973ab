"""The brain's own functions, made callable from compiled code: no copy, no second version.

Importing this module is enough. Numba then compiles a call of
`motorcade.car.brain.follower_step` from that very function's source.
"""

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from types import FunctionType
from typing import Any

# OpenMP's threads would else spin while they wait, which slows a busy machine many times over.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

import numba
from numba.extending import register_jitable

from motorcade.car import brain, rest
from motorcade.words import infrared, ticks

for _module in (ticks, infrared, brain, rest):
    for _function in list(vars(_module).values()):
        if isinstance(_function, FunctionType) and _function.__module__ == _module.__name__:
            register_jitable(_function)


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
    for module in (ticks, infrared, brain, rest):
        digest.update(Path(str(module.__file__)).read_bytes())
    for path in sources:
        digest.update(path.read_bytes())
    compile_kernel = numba.njit(cache=True, parallel=parallel, error_model="numpy", nogil=True)
    kernel: Callable[..., Any] = compile_kernel(make(f"{digest.hexdigest()}, parallel={parallel}"))
    return kernel
