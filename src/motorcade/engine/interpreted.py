"""Run the kernels as plain Python on arrays of NumPy."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motorcade.engine.backend import Name
from motorcade.engine.kernels import KERNELS
from motorcade.engine.state import Buffer


def as_array(contents: Buffer) -> NDArray[Any]:
    """Return a buffer as an array of NumPy, without a copy."""
    return np.asarray(contents.items).view(contents.dtype).reshape(contents.shape)


class NumpyArrays:
    """How arrays of NumPy are read and written, wherever they are."""

    def read(self, array: NDArray[Any]) -> bytes:
        """Return the contents of an array."""
        return array.tobytes()

    def write(self, array: NDArray[Any], contents: bytes) -> None:
        """Replace the contents of an array."""
        array[...] = np.frombuffer(contents, array.dtype).reshape(array.shape)

    def clear(self, array: NDArray[Any]) -> None:
        """Fill an array with zeros."""
        array[...] = 0

    def save(self, arrays: Sequence[NDArray[Any]]) -> list[NDArray[Any]]:
        """Return copies of arrays."""
        return [array.copy() for array in arrays]

    def restore(self, arrays: Sequence[NDArray[Any]], saved: list[NDArray[Any]]) -> None:
        """Give the arrays the contents that `save` copied."""
        for array, copy in zip(arrays, saved, strict=True):
            array[...] = copy


class HeapArrays(NumpyArrays):
    """Arrays where NumPy allocates them."""

    def zeros(self, slot: str, shape: tuple[int, ...], dtype: str) -> NDArray[Any]:
        """Return an array of zeros."""
        return np.zeros(shape, dtype)

    def allocate(self, slot: str, contents: Buffer) -> NDArray[Any]:
        """Return the contents as an array, without a copy."""
        return as_array(contents)


class InterpretedKernels(HeapArrays):
    """The kernels as plain Python: some hundred times slower than native ones, for a debugger and for comparison."""

    name: Name = "interpreted"
    threaded = False

    def call(self, kernel: str, *arguments: Any) -> None:
        """Call a kernel."""
        # Compiled integers wrap around silently, so NumPy's have to.
        with np.errstate(over="ignore"):
            KERNELS[kernel](*arguments)
