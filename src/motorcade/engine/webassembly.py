"""Run the kernels of engine.wasm by wasmtime, on arrays of NumPy in its linear memory.

The kernels work on the arrays without copies. The memory never moves: all of its addresses
are reserved at once, and it only grows.
"""

import ctypes
from functools import lru_cache
from typing import Any

import numpy as np
import wasmtime
from numpy.typing import NDArray

from motorcade.engine.backend import BackendName
from motorcade.engine.linear_memory import PATH, LinearMemory, module_arguments
from motorcade.engine.native import NumpyArrays, as_array
from motorcade.engine.state import Buffer

_PAGE = 1 << 16


class WebAssemblyKernels(NumpyArrays, LinearMemory):
    """The kernels in WebAssembly, for computers that no library of `motorcade.engine.native` is for."""

    name: BackendName = "webassembly"
    threaded = False

    def __init__(self) -> None:
        engine, module = _module()
        self._store = wasmtime.Store(engine)
        exports = wasmtime.Instance(self._store, module, []).exports(self._store)
        functions = ((name, exports.get(name)) for name in module_arguments())
        self._kernels = {name: kernel for name, kernel in functions if isinstance(kernel, wasmtime.Func)}
        memory = exports["memory"]
        heap = exports["__heap_base"]
        assert isinstance(memory, wasmtime.Memory)
        assert isinstance(heap, wasmtime.Global)
        self._memory = memory
        self._base = ctypes.addressof(memory.data_ptr(self._store).contents)
        super().__init__(module_arguments(), heap.value(self._store))

    def zeros(self, slot: str, shape: tuple[int, ...], dtype: str) -> NDArray[Any]:
        """Return an array of zeros. It replaces the array that was allocated before under the same ``slot``.

        Raises:
            MotorcadeError: the world is too large for WebAssembly.
        """
        array = self._array(slot, shape, np.dtype(dtype))
        array[...] = 0
        return array

    def allocate(self, slot: str, contents: Buffer) -> NDArray[Any]:
        """Return a C-contiguous copy in the linear memory; ``slot`` as in `zeros`. Raises MotorcadeError."""
        array = as_array(contents)
        copy = self._array(slot, array.shape, array.dtype)
        copy[...] = array
        return copy

    def _array(self, slot: str, shape: tuple[int, ...], dtype: np.dtype[Any]) -> NDArray[Any]:
        place, size = self._place(slot, int(np.prod(shape)) * dtype.itemsize)
        buffer = (ctypes.c_ubyte * size).from_address(self._base + place)
        # An array holds its buffer, and so the memory.
        buffer.store = self._store  # type: ignore[attr-defined]
        return np.ndarray(shape, dtype, memoryview(buffer))

    def _grow_to(self, end: int) -> bool:
        missing = end - self._memory.data_len(self._store)
        if missing > 0:
            try:
                self._memory.grow(self._store, -(-missing // _PAGE))
            except wasmtime.WasmtimeError:
                return False
        return True

    def _call(self, kernel: str, block: bytes) -> None:
        address, _ = self._place("arguments", len(block))
        ctypes.memmove(self._base + address, block, len(block))
        self._kernels[kernel](self._store, address)


@lru_cache
def _module() -> tuple[wasmtime.Engine, wasmtime.Module]:
    config = wasmtime.Config()
    config.memory_may_move = False
    config.memory_reservation = 1 << 32
    engine = wasmtime.Engine(config)
    return engine, wasmtime.Module(engine, PATH.read_bytes())
