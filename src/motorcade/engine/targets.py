"""What runs the kernels of a world. All targets give the same bits; `motorcade.engine.choice` picks one."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any, Literal, Protocol, TypeVar, get_args

import numpy as np
from numpy.typing import DTypeLike, NDArray

from motorcade.engine.kernels import KERNELS
from motorcade.engine.state import People, Rules, Voices

Name = Literal["native", "webassembly", "interpreted"]
Figures = TypeVar("Figures", People, Rules, Voices)
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

    def keep(self, slot: str, array: NDArray[Any]) -> NDArray[Any]:
        """Return an array with the same contents, C-contiguous and reachable; ``slot`` as in `zeros`."""

    def call(self, kernel: str, threads: int, *arguments: Any) -> None:
        """Call a kernel of `motorcade.engine.kernels.KERNELS`; its arrays come from `zeros` or `keep`."""


def keep_all(target: Target, figures: Figures) -> Figures:
    """Return a named tuple with its arrays kept by ``target``, each in a slot named after its field."""
    kind = type(figures).__name__
    kept: dict[str, Any] = {
        name: target.keep(f"{kind}.{name}", value)
        for name, value in figures._asdict().items()
        if isinstance(value, np.ndarray)
    }
    return figures._replace(**kept)


class HeapArrays:
    """Arrays where NumPy allocates them."""

    def zeros(self, slot: str, shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
        """Return an array of zeros."""
        return np.zeros(shape, dtype)

    def keep(self, slot: str, array: NDArray[Any]) -> NDArray[Any]:
        """Return the array itself, or a C-contiguous copy."""
        return np.ascontiguousarray(array)


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
