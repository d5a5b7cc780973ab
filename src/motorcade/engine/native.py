"""Compile the engine with Numba, and make the portable functions callable from compiled code.

To import this module is enough for the second: Numba then compiles a call of `motorcade.car.brain.follower_step` from
the source of that function, so there is no second version of it.
"""

import hashlib
import inspect
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar

# Otherwise OpenMP's threads spin while they wait, which slows down a busy machine many times.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

import numba
from numba.core import event, types
from numba.extending import overload_method, register_jitable

from motorcade.car import brain, frames, next_wakeup, step
from motorcade.engine import events
from motorcade.words import infrared, ticks

# Decorator for functions that kernels call. They are inlined, because a call would copy the description of each array.
in_kernel = register_jitable(forceinline=True)

Class = TypeVar("Class", bound=type)
_PLAIN = (ticks, infrared, brain, frames, next_wakeup, step, events)
for _module in _PLAIN:
    for _function in list(vars(_module).values()):
        if isinstance(_function, FunctionType) and _function.__module__ == _module.__name__:
            in_kernel(_function)


def methods_in_kernel(kind: Class) -> Class:
    """Decorate a named tuple class: make its methods callable from compiled code."""
    for name, method in list(vars(kind).items()):
        if isinstance(method, FunctionType) and not name.startswith("_"):
            _register_method(kind, name, method)
    return kind


def _register_method(kind: type, name: str, method: FunctionType) -> None:
    def implementation(self: Any, *arguments: Any) -> FunctionType | None:
        return method if self.instance_class is kind else None

    # Numba looks here for the names of the parameters.
    implementation.__signature__ = inspect.signature(method)  # type: ignore[attr-defined]
    options: dict[str, Any] = {"jit_options": {"forceinline": True}, "strict": False}
    # Numba has one type for all named tuples, which holds the class.
    overload_method(types.NamedTuple, name, **options)(implementation)


def compiled(
    make: Callable[[str], Callable[..., Any]], sources: tuple[Path, ...], parallel: bool
) -> Callable[..., Any]:
    """Return a kernel that is compiled at its first call and cached on disk for the next start.

    Numba's cache looks only at the file of the kernel itself. Therefore ``make`` takes a fingerprint of all that is
    compiled into the kernel and returns a function with the fingerprint in its closure, which Numba does look at.

    Args:
        make: returns the kernel for a fingerprint.
        sources: the files whose functions the kernel calls, besides the portable ones.
        parallel: whether the kernel's ``prange`` loops use several threads.
    """
    digest = hashlib.sha256()
    for path in (*(Path(str(module.__file__)) for module in _PLAIN), *sources, Path(__file__)):
        digest.update(path.read_bytes())
    # Nothing is allocated in a kernel, so its arrays need no reference counts, which would take most of the time.
    # With fusion, one part of a world would enter a loop before all parts have left the loop before it.
    loops = {"fusion": False} if parallel else False
    options: dict[str, Any] = {"cache": True, "parallel": loops, "error_model": "numpy", "nogil": True, "_nrt": False}
    kernel: Callable[..., Any] = numba.njit(**options)(make(f"{digest.hexdigest()}, parallel={parallel}"))
    return kernel


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
