"""Run the kernels in a browser: engine.wasm is instantiated by JavaScript, and Python holds places in its memory.

A call between Python and JavaScript takes some microseconds, so a picture needs few of them, and contents cross as
bytes. `web/src/site/engine.ts` is what JavaScript gives; tests give one that is made of wasmtime.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from motorcade.config.profile import Profile
from motorcade.engine.backend import Name
from motorcade.engine.linear_memory import Described, LinearMemory, parse_arguments
from motorcade.engine.simulation import Simulation
from motorcade.engine.state import Buffer
from motorcade.mats import Mat
from motorcade.missions.odds import OpenWorlds
from motorcade.service.studio_world import StudioWorld, open_world
from motorcade.service.world_messages import SetWorld

_ITEM_BYTES = {"int64": 8, "float64": 8, "uint32": 4, "int32": 4, "float32": 4, "uint16": 2, "uint8": 1}


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

    def copy(self, to: int, address: int, size: int, /) -> None:
        """Copy ``size`` bytes from ``address`` to ``to``."""

    def call(self, kernel: str, address: int, /) -> None:
        """Call a kernel with the address of its arguments."""


OpenInstance = Callable[[], Instance]


@dataclass(frozen=True, slots=True, eq=False)
class LinearArray:
    """An array in the linear memory: where it is, without its contents. Indices are numbers or slices without a step.

    Attributes:
        dtype: NumPy's name of the type.
        strides: the bytes from one item to the next, of each dimension.
        address: of the first item.
    """

    dtype: str
    shape: tuple[int, ...]
    strides: tuple[int, ...]
    address: int

    @property
    def count(self) -> int:
        """How many items there are."""
        return math.prod(self.shape)

    @property
    def is_contiguous(self) -> bool:
        """Whether the items follow each other without gaps; slices keep their order."""
        return self.span == self.count * _ITEM_BYTES[self.dtype]

    @property
    def span(self) -> int:
        """The bytes from the first item to the end of the last one."""
        if not self.count:
            return 0
        steps = zip(self.shape, self.strides, strict=True)
        return sum((length - 1) * stride for length, stride in steps) + _ITEM_BYTES[self.dtype]

    def __getitem__(self, index: "int | slice | tuple[int | slice, ...]") -> "LinearArray":
        parts = index if isinstance(index, tuple) else (index,)
        address, shape, strides = self.address, [], []
        for part, length, stride in zip(parts, self.shape, self.strides, strict=False):
            if isinstance(part, slice):
                begin, end, _ = part.indices(length)
                shape.append(max(end - begin, 0))
                strides.append(stride)
                address += begin * stride
            else:
                address += part * stride
        rest = len(parts)
        return LinearArray(self.dtype, (*shape, *self.shape[rest:]), (*strides, *self.strides[rest:]), address)

    def view(self, dtype: str) -> "LinearArray":
        """Return the same bytes of a one-dimensional contiguous array as items of another type."""
        size = _ITEM_BYTES[dtype]
        return LinearArray(dtype, (self.span // size,), (size,), self.address)


class BrowserKernels(LinearMemory):
    """The kernels in an instance of engine.wasm that belongs to JavaScript."""

    name: Name = "webassembly"
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
        """Return the contents of a contiguous array."""
        return bytes(self._instance.view(array.address, array.span).to_bytes())

    def write(self, array: LinearArray, contents: bytes) -> None:
        """Replace the contents of a contiguous array."""
        self._assign(array.address, contents)

    def clear(self, array: LinearArray) -> None:
        """Fill an array, and the gaps between its rows, with zeros."""
        self._instance.clear(array.address, array.span)

    def save(self, arrays: Sequence[LinearArray]) -> list[int]:
        """Return the addresses of copies of arrays, gaps included; the next call overwrites them."""
        saved = [self._place(f"saved {number}", array.span)[0] for number, array in enumerate(arrays)]
        for array, place in zip(arrays, saved, strict=True):
            self._instance.copy(place, array.address, array.span)
        return saved

    def restore(self, arrays: Sequence[LinearArray], saved: list[int]) -> None:
        """Give the arrays the contents that `save` copied."""
        for array, place in zip(arrays, saved, strict=True):
            self._instance.copy(array.address, place, array.span)

    def _array(self, slot: str, shape: tuple[int, ...], dtype: str) -> LinearArray:
        size = _ITEM_BYTES[dtype]
        strides = tuple(size * math.prod(shape[number + 1 :]) for number in range(len(shape)))
        address, _ = self._place(slot, size * math.prod(shape))
        return LinearArray(dtype, tuple(shape), strides, address)

    def _assign(self, address: int, contents: Any) -> None:
        if len(contents):
            self._instance.view(address, len(contents)).assign(contents)

    def _describe(self, value: Any) -> Described | None:
        if not isinstance(value, LinearArray):
            return None
        size = _ITEM_BYTES[value.dtype]
        return Described(value.dtype, value.is_contiguous, value.count, size, value.address, value.shape, value.strides)

    def _grow_to(self, end: int) -> bool:
        return bool(self._instance.grow(end))

    def _call(self, kernel: str, block: bytes) -> None:
        address, _ = self._place("arguments", len(block))
        self._assign(address, block)
        self._instance.call(kernel, address)


def make_world(message: SetWorld, open_instance: OpenInstance, most_cars: int) -> StudioWorld:
    """Build a page's world. Raises MotorcadeError."""

    def make(mat: Mat, images: Sequence[bytes], profile: Profile, seed: int) -> Simulation:
        return Simulation(mat, images, profile, BrowserKernels(open_instance()), seeds=(seed,), events=True)

    return open_world(message, most_cars, make)


def open_worlds(open_instance: OpenInstance) -> OpenWorlds:
    """Return what opens the worlds of missions, for `motorcade.service.requests.Context`."""
    return lambda mission, image, seeds, events: Simulation(
        mission.mat, [image], mission.profile, BrowserKernels(open_instance()), seeds=seeds, events=events
    )
