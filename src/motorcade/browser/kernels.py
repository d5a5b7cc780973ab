"""Run the kernels in a browser: engine.wasm is instantiated by JavaScript, and Python holds places in its memory.

A call between Python and JavaScript takes some microseconds, so a picture needs few of them, and contents cross as
bytes. `web/src/site/engine.ts` is what JavaScript gives; tests give one that is made of wasmtime.
"""

import math
from collections.abc import Callable
from typing import Any, Protocol

from motorcade.engine.backend import BackendName
from motorcade.engine.linear_memory import LinearArray, LinearMemory, parse_arguments
from motorcade.engine.simulation import Simulation
from motorcade.engine.state import Buffer, width_of
from motorcade.missions.odds import OpenWorlds


class View(Protocol):
    """Bytes of the memory: a Uint8Array, as Pyodide shows it. It is valid until the memory grows."""

    def to_bytes(self) -> bytes:
        """Return a copy."""

    def assign(self, contents: Any, /) -> None:
        """Replace all bytes by those of a buffer of the same size."""


class Instance(Protocol):
    """An instance of engine.wasm, which has a memory of its own. Addresses and sizes are bytes.

    Attributes:
        heap: the address from which on the memory is free.
        section: the text of the module's section ``motorcade.arguments``.
    """

    heap: int
    section: str

    def grow(self, end: int, /) -> bool:
        """Make the memory at least ``end`` bytes large; return whether that was possible."""

    def view(self, address: int, size: int, /) -> View:
        """Return a part of the memory."""

    def clear(self, address: int, size: int, /) -> None:
        """Fill a part of the memory with zeros."""

    def call(self, kernel: str, address: int, /) -> None:
        """Call a kernel with the address of its arguments."""


OpenInstance = Callable[[], Instance]


class BrowserKernels(LinearMemory):
    """The kernels in an instance of engine.wasm that belongs to JavaScript."""

    name: BackendName = "webassembly"
    threaded = False

    def __init__(self, instance: Instance) -> None:
        super().__init__(parse_arguments(instance.section), int(instance.heap))
        self._instance = instance

    def zeros(self, slot: str, shape: tuple[int, ...], dtype: str) -> LinearArray:
        """Return an array of zeros. It replaces the array that was allocated before under the same ``slot``.

        Raises:
            MotorcadeError: the world is too large for WebAssembly.
        """
        array = self._array(slot, shape, dtype)
        self.clear(array)
        return array

    def allocate(self, slot: str, contents: Buffer) -> LinearArray:
        """Return a C-contiguous copy in the linear memory; ``slot`` as in `zeros`. Raises MotorcadeError."""
        array = self._array(slot, contents.shape, contents.dtype)
        self._assign(array.address, memoryview(contents.items).cast("B"))
        return array

    def read(self, array: LinearArray) -> bytes:
        """Return the contents of an array, with what is between its rows."""
        return bytes(self._instance.view(array.address, array.span).to_bytes())

    def write(self, array: LinearArray, contents: bytes) -> None:
        """Replace the contents of an array by what `read` returns."""
        self._assign(array.address, contents)

    def clear(self, array: LinearArray) -> None:
        """Fill an array, and the gaps between its rows, with zeros."""
        self._instance.clear(array.address, array.span)

    def _array(self, slot: str, shape: tuple[int, ...], dtype: str) -> LinearArray:
        size = width_of(dtype)
        strides = tuple(size * math.prod(shape[number + 1 :]) for number in range(len(shape)))
        address, _ = self._place(slot, size * math.prod(shape))
        return LinearArray(dtype, tuple(shape), strides, address)

    def _assign(self, address: int, contents: Any) -> None:
        if len(contents):
            self._instance.view(address, len(contents)).assign(contents)

    def _describe(self, value: Any) -> LinearArray | None:
        if isinstance(value, LinearArray):
            return value
        return None

    def _grow_to(self, end: int) -> bool:
        return bool(self._instance.grow(end))

    def _call(self, kernel: str, block: bytes) -> None:
        address, _ = self._place("arguments", len(block))
        self._assign(address, block)
        self._instance.call(kernel, address)


def open_worlds(open_instance: OpenInstance) -> OpenWorlds:
    """Return what opens worlds in the browser; those of a call share an instance of engine.wasm."""
    return lambda mat, images, profile, seeds, events: Simulation(
        mat, images, profile, BrowserKernels(open_instance()), seeds=seeds, events=events
    )
