"""Call the kernels of engine.wasm, which ``scripts/engine_module.py`` makes from `motorcade.engine.kernels`.

The module has one linear memory, and a world's arrays lie in it. Each kernel of the module takes one number: the
address of a block that holds its arguments, 8 bytes for each number. An array is five kinds of numbers: two zeros, the
count of items, the size of an item, the address of the first item, the shape and the strides. The module's custom
section ``motorcade.arguments`` names the arguments of each kernel and pins their types.

This module knows no WebAssembly runtime and needs no NumPy: `motorcade.engine.webassembly` has wasmtime's, and
`motorcade.browser.kernels` the browser's.
"""

import json
import math
import struct
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

from motorcade.engine.state import width_of
from motorcade.errors import MotorcadeError

PATH = Path(__file__).with_name("engine.wasm")
SECTION = "motorcade.arguments"
_INT = struct.Struct("<q")
_FLOAT = struct.Struct("<d")
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


@dataclass(frozen=True, slots=True, eq=False)
class LinearArray:
    """Where an array is, without its contents. Indices are numbers or slices without a step.

    Attributes:
        dtype: NumPy's name of the type.
        strides: the bytes from one item to the next, of each dimension.
        address: of the first item; of NumPy's arrays it may be outside of the memory.
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
        """Whether the items follow each other without gaps, row by row."""
        expected = width_of(self.dtype)
        for length, stride in zip(reversed(self.shape), reversed(self.strides), strict=True):
            if length > 1 and stride != expected:
                return self.count == 0
            expected *= length
        return True

    @property
    def span(self) -> int:
        """The bytes from the first item to the end of the last one."""
        if not self.count:
            return 0
        steps = zip(self.shape, self.strides, strict=True)
        return sum((length - 1) * stride for length, stride in steps) + width_of(self.dtype)

    def __getitem__(self, index: "int | slice | tuple[int | slice, ...]") -> "LinearArray":
        parts = index if isinstance(index, tuple) else (index,)
        address = self.address
        shape = []
        strides = []
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
        size = width_of(dtype)
        return LinearArray(dtype, (self.span // size,), (size,), self.address)


class _Part(NamedTuple):
    """A value of a call: how many arguments it is, the part of the block that holds them, and the parts of a tuple."""

    value: Any
    length: int
    block: bytes
    parts: "tuple[_Part, ...]" = ()


_NOTHING = _Part(object(), 0, b"")


@lru_cache
def module_arguments() -> dict[str, list[Argument]]:
    """Return the arguments of each kernel of the installed engine.wasm."""
    return parse_arguments(section_text())


def section_text() -> str:
    """Return the text of the module's section."""
    # Behind the section's name there is its text, whose end JSON tells.
    text = PATH.read_bytes().partition(SECTION.encode())[2].decode("latin-1")
    return text[: json.JSONDecoder().raw_decode(text)[1]]


def parse_arguments(section: str) -> dict[str, list[Argument]]:
    """Return the arguments of each kernel, from the text of the module's section."""
    listed = json.loads(section).items()
    return {kernel: [Argument(*argument) for argument in arguments] for kernel, arguments in listed}


class LinearMemory:
    """Calls kernels by blocks of arguments, and places arrays in the linear memory of an instance of engine.wasm.

    Args:
        arguments: of each kernel.
        end: the address from which on the memory is free.
    """

    interruptible = False

    def __init__(self, arguments: dict[str, list[Argument]], end: int) -> None:
        self._arguments = arguments
        self._end = end
        self._slots: dict[str, tuple[int, int]] = {}
        self._packed = dict.fromkeys(arguments, _NOTHING)

    def _describe(self, value: Any) -> LinearArray | None:
        """Return where an array is; None for a number."""
        raise NotImplementedError

    def _grow_to(self, end: int) -> bool:
        """Make the memory at least ``end`` bytes large; return whether that was possible."""
        raise NotImplementedError

    def _call(self, kernel: str, block: bytes) -> None:
        """Call a kernel with the block of its arguments."""
        raise NotImplementedError

    def call(self, kernel: str, *arguments: Any) -> None:
        """Call a kernel. Raises MotorcadeError where an argument isn't what the module was made for."""
        self._call(kernel, self._block(kernel, *arguments))

    def join(self) -> None:
        """Wait for nothing: calls have one thread."""

    def _block(self, kernel: str, *arguments: Any) -> bytes:
        expected = self._arguments[kernel]
        part = self._packed[kernel] = self._pack(kernel, arguments, 0, self._packed[kernel])
        if part.length < len(expected):
            _check(kernel, expected[part.length])
        return part.block

    def _pack(self, kernel: str, value: Any, first: int, before: _Part) -> _Part:
        """Pack what stands at argument ``first``; of a tuple only what isn't as ``before``.

        To describe all arrays takes ten times as long as a tick of few cars; most are those of the last call.
        """
        if isinstance(value, tuple):
            parts = []
            at = first
            earlier = before.parts if len(before.parts) == len(value) else [_NOTHING] * len(value)
            for item, part in zip(value, earlier, strict=True):
                parts.append(part if part.value is item else self._pack(kernel, item, at, part))
                at += parts[-1].length
            return _Part(value, at - first, b"".join([part.block for part in parts]), tuple(parts))
        expected = self._arguments[kernel]
        argument = expected[first] if first < len(expected) else None
        array = None if isinstance(value, int | float) else self._describe(value)
        if array is None:
            is_float = isinstance(value, float)
            _check(kernel, argument, "float64" if is_float else "int64")
            return _Part(value, 1, (_FLOAT if is_float else _INT).pack(value))
        layout = "C" if argument and argument.layout == "C" and array.is_contiguous else "A"
        _check(kernel, argument, array.dtype, len(array.shape), layout)
        count = array.count
        size = width_of(array.dtype)
        if not 0 <= array.address <= self._end - count * size:
            raise MotorcadeError("kernel-argument-elsewhere", kernel=kernel, argument=str(argument))
        numbers = 0, 0, count, size, array.address, *array.shape, *array.strides
        return _Part(value, 1, struct.pack(f"<{len(numbers)}q", *numbers))

    def _place(self, slot: str, size: int) -> tuple[int, int]:
        """The address and size of a slot that has room for ``size`` bytes; a slot that is too small is left behind.

        Raises:
            MotorcadeError: the world is too large for WebAssembly.
        """
        place, room = self._slots.get(slot, (0, 0))
        if room < size or not room:
            place, room = -(-self._end // _LINE) * _LINE, max(size, 2 * room, _LINE)
            if not self._grow_to(place + room):
                raise MotorcadeError("world-exceeds-webassembly", needed=(place + room) / 1e9, most=4.3)
            self._slots[slot] = (place, room)
            self._end = place + room
        return place, room


def _check(kernel: str, expected: Argument | None, *given: Any) -> None:
    """Raise MotorcadeError unless the argument's type is what the module expects."""
    found = Argument(expected.name if expected else "", *given) if given else None
    if found != expected:
        raise MotorcadeError("kernel-argument-differs", kernel=kernel, expected=str(expected), found=str(found))
