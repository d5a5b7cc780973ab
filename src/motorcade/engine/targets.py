"""What runs the kernels of a world. All targets give the same bits; `motorcade.engine.choice` picks one."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any, Literal, Protocol, TypeVar, get_args

import numpy as np
from numpy.typing import DTypeLike, NDArray

from motorcade.engine.kernels import KERNELS
from motorcade.engine.state import Buffer, People, Rules, Voices

Name = Literal["native", "webassembly", "interpreted"]
Figures = TypeVar("Figures", People, Rules, Voices)
Contents = Buffer | NDArray[Any]
NAMES: tuple[Name, ...] = get_args(Name)


class Target(Protocol):
    """Runs the kernels of one world, and allocates its arrays where these kernels can reach them.

    Attributes:
        name: which target it is.
        threaded: whether it can use several threads.
    """

    name: Name
    threaded: bool

    def zeros(self, slot: str, shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
        """Return an array of zeros. It replaces the array that was allocated before under the same ``slot``."""

    def keep(self, slot: str, contents: Contents) -> NDArray[Any]:
        """Return an array with these contents, C-contiguous and reachable; ``slot`` as in `zeros`."""

    def call(self, kernel: str, threads: int, *arguments: Any) -> None:
        """Call a kernel of `motorcade.engine.kernels.KERNELS`; its arrays come from `zeros` or `keep`."""


def keep_all(target: Target, figures: Figures) -> Figures:
    """Return a named tuple with its buffers kept by ``target`` as arrays, each in a slot named after its field."""
    kind = type(figures).__name__
    kept: dict[str, Any] = {
        name: target.keep(f"{kind}.{name}", value)
        for name, value in figures._asdict().items()
        if isinstance(value, Buffer)
    }
    return figures._replace(**kept)


def as_array(contents: Contents) -> NDArray[Any]:
    """Return a buffer as an array of NumPy, without a copy."""
    if isinstance(contents, Buffer):
        return np.asarray(contents.items).view(contents.dtype).reshape(contents.shape)
    return contents


class HeapArrays:
    """Arrays where NumPy allocates them."""

    def zeros(self, slot: str, shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
        """Return an array of zeros."""
        return np.zeros(shape, dtype)

    def keep(self, slot: str, contents: Contents) -> NDArray[Any]:
        """Return the contents as an array, copied where they are not C-contiguous."""
        return np.ascontiguousarray(as_array(contents))


class InterpretedKernels(HeapArrays):
    """The kernels as plain Python: some hundred times slower than native ones, for a debugger and for comparison."""

    name: Name = "interpreted"
    threaded = False

    def call(self, kernel: str, threads: int, *arguments: Any) -> None:
        """Call a kernel."""
        # Compiled integers wrap around silently, so NumPy's have to.
        with np.errstate(over="ignore"):
            _interpreted(kernel)(*arguments)


@lru_cache
def _interpreted(kernel: str) -> Callable[..., None]:
    return KERNELS[kernel]("", range)
