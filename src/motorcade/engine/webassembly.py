"""Run the kernels of engine.wasm, which ``scripts/engine_module.py`` makes from `motorcade.engine.kernels`.

The module has one linear memory. A world's arrays lie in it, so the kernels work on them without copies, and so can
native kernels. The memory never moves: all of its addresses are reserved at once, and it only grows.

Each kernel of the module takes one number: the address of a block that holds its arguments, 8 bytes for each number. An
array is five kinds of numbers: two zeros, the count of items, the size of an item, the address of the first item, the
shape and the strides. The module's custom section ``motorcade.arguments`` names the arguments of each kernel and pins
their types.
"""

import ctypes
import json
import struct
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import wasmtime
from numpy.typing import DTypeLike, NDArray

from motorcade.engine.targets import Contents, Name, as_array
from motorcade.errors import MotorcadeError

PATH = Path(__file__).with_name("engine.wasm")
SECTION = "motorcade.arguments"
_PAGE = 1 << 16
_LINE = 64  # bytes of a cache line, at which each array begins


class Argument(NamedTuple):
    """An argument of a kernel: a number, or an array where ``rank`` isn't 0.

    Attributes:
        name: the parameter, with the fields of named tuples after dots.
        dtype: NumPy's name of the type.
        layout: "C" where an array has to be C-contiguous, "A" where any strides will do, "" for a number.
    """

    name: str
    dtype: str
    rank: int = 0
    layout: str = ""

    def __str__(self) -> str:
        return f"{self.name}: {self.dtype}" + (f", {self.rank}-d, {self.layout}" if self.rank else "")


class _Part(NamedTuple):
    """An argument of a call, or a tuple of them: how many they are, and the part of the block that holds them."""

    value: Any
    length: int
    block: bytes


class _Module(NamedTuple):
    module: wasmtime.Module
    arguments: dict[str, list[Argument]]


class WebAssemblyKernels:
    """The kernels in WebAssembly: ready in 0.1 s, and somewhat slower than native ones."""

    name: Name = "webassembly"
    threaded = False

    def __init__(self) -> None:
        engine, module = _module()
        self._arguments = module.arguments
        self._store = wasmtime.Store(engine)
        exports = wasmtime.Instance(self._store, module.module, []).exports(self._store)
        functions = ((name, exports[name]) for name in self._arguments)
        self._kernels = {name: each for name, each in functions if isinstance(each, wasmtime.Func)}
        memory, heap = exports["memory"], exports["__heap_base"]
        assert isinstance(memory, wasmtime.Memory)
        assert isinstance(heap, wasmtime.Global)
        self._memory = memory
        self._base = ctypes.addressof(memory.data_ptr(self._store).contents)
        self._end = heap.value(self._store)
        self._slots: dict[str, tuple[int, int]] = {}
        self._packed: dict[str, list[_Part]] = {name: [] for name in self._arguments}

    def zeros(self, slot: str, shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
        """Return an array of zeros. It replaces the array that was allocated before under the same ``slot``.

        Raises:
            MotorcadeError: the world is too large for WebAssembly.
        """
        array = self._array(slot, shape, np.dtype(dtype))
        array[...] = 0
        return array

    def keep(self, slot: str, contents: Contents) -> NDArray[Any]:
        """Return a C-contiguous copy in the linear memory; ``slot`` as in `zeros`. Raises MotorcadeError."""
        array = as_array(contents)
        copy = self._array(slot, array.shape, array.dtype)
        copy[...] = array
        return copy

    def call(self, kernel: str, threads: int, *arguments: Any) -> None:
        """Call a kernel. Raises MotorcadeError where an argument isn't what the module was made for."""
        expected = self._arguments[kernel]
        packed, given = self._packed[kernel], list(_parts(arguments))
        del packed[len(given) :]
        first = 0
        for number, value in enumerate(given):
            # To describe all arrays takes ten times as long as a tick of few cars; most are those of the last call.
            if number == len(packed):
                packed.append(self._pack(kernel, value, expected[first:]))
            elif packed[number].value is not value:
                packed[number] = self._pack(kernel, value, expected[first:])
            first += packed[number].length
        _check(kernel, expected[first] if first < len(expected) else None)
        block = b"".join(part.block for part in packed)
        place, _ = self._place("arguments", len(block))
        ctypes.memmove(self._base + place, block, len(block))
        self._kernels[kernel](self._store, place)

    def _pack(self, kernel: str, values: Any, expected: list[Argument]) -> _Part:
        numbers: list[int | float] = []
        form = ["<"]
        count = 0
        for value in values if isinstance(values, tuple) else (values,):
            argument = expected[count] if count < len(expected) else None
            count += 1
            if isinstance(value, np.ndarray):
                numbers += self._array_numbers(kernel, argument, value)
                form.append(f"{5 + 2 * value.ndim}q")
            else:
                is_float = isinstance(value, float)
                _check(kernel, argument, "float64" if is_float else "int64")
                numbers.append(value)
                form.append("d" if is_float else "q")
        return _Part(values, count, struct.pack("".join(form), *numbers))

    def _array_numbers(self, kernel: str, argument: Argument | None, array: NDArray[Any]) -> list[int]:
        layout = "C" if array.flags.c_contiguous and argument and argument.layout == "C" else "A"
        _check(kernel, argument, array.dtype.name, array.ndim, layout)
        address = array.__array_interface__["data"][0] - self._base
        if not 0 <= address <= self._end - array.nbytes:
            raise MotorcadeError("kernel-argument-elsewhere", kernel=kernel, argument=str(argument))
        return [0, 0, array.size, array.itemsize, address, *array.shape, *array.strides]

    def _array(self, slot: str, shape: tuple[int, ...], dtype: np.dtype[Any]) -> NDArray[Any]:
        place, size = self._place(slot, int(np.prod(shape)) * dtype.itemsize)
        buffer = (ctypes.c_ubyte * size).from_address(self._base + place)
        # An array holds its buffer, and so the memory.
        buffer.store = self._store  # type: ignore[attr-defined]
        return np.ndarray(shape, dtype, memoryview(buffer))

    def _place(self, slot: str, size: int) -> tuple[int, int]:
        """The address and size of a slot that has room for ``size`` bytes; a slot that is too small is left behind."""
        place, room = self._slots.get(slot, (0, 0))
        if room < size or not room:
            place, room = -(-self._end // _LINE) * _LINE, max(size, 2 * room, _LINE)
            missing = place + room - self._memory.data_len(self._store)
            if missing > 0:
                try:
                    self._memory.grow(self._store, -(-missing // _PAGE))
                except wasmtime.WasmtimeError:
                    raise MotorcadeError("world-exceeds-webassembly", needed=(place + room) / 1e9, most=4.3) from None
            self._slots[slot], self._end = (place, room), place + room
        return place, room


def _parts(arguments: tuple[Any, ...]) -> Iterator[Any]:
    """The arguments, but a tuple of tuples is taken apart."""
    for argument in arguments:
        if isinstance(argument, tuple) and any(isinstance(each, tuple) for each in argument):
            yield from argument
        else:
            yield argument


def _check(kernel: str, expected: Argument | None, *given: Any) -> None:
    """Raise MotorcadeError unless the argument's type is what the module expects."""
    found = Argument(expected.name if expected else "", *given) if given else None
    if found != expected:
        raise MotorcadeError("kernel-argument-differs", kernel=kernel, expected=str(expected), found=str(found))


@lru_cache
def _module() -> tuple[wasmtime.Engine, _Module]:
    config = wasmtime.Config()
    config.memory_may_move = False
    config.memory_reservation = 1 << 32
    engine = wasmtime.Engine(config)
    code = PATH.read_bytes()
    arguments = {
        kernel: [Argument(*argument) for argument in listed]
        for kernel, listed in json.loads(custom_section(code, SECTION)).items()
    }
    return engine, _Module(wasmtime.Module(engine, code), arguments)


def custom_section(code: bytes, name: str) -> bytes:
    """Return a custom section of a WebAssembly module. Raises KeyError where there is none of that name."""
    at = 8
    while at < len(code):
        kind = code[at]
        size, at = _unsigned(code, at + 1)
        end = at + size
        if kind == 0:
            length, at = _unsigned(code, at)
            if code[at : at + length].decode() == name:
                return code[at + length : end]
        at = end
    raise KeyError(name)


def _unsigned(code: bytes, at: int) -> tuple[int, int]:
    """The number in LEB128 at a place, and the place after it."""
    number, shift = 0, 0
    while True:
        number |= (code[at] & 0x7F) << shift
        shift += 7
        at += 1
        if code[at - 1] < 0x80:
            return number, at
