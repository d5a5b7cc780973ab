"""Call the kernels of engine.wasm, which ``scripts/engine_module.py`` makes from `motorcade.engine.kernels`.

The module has one linear memory, and a world's arrays lie in it. Each kernel of the module takes one number: the
address of a block that holds its arguments, 8 bytes for each number. An array is five kinds of numbers: two zeros, the
count of items, the size of an item, the address of the first item, the shape and the strides. The module's custom
section ``motorcade.arguments`` names the arguments of each kernel and pins their types.

This module knows no WebAssembly runtime and needs no NumPy: `motorcade.engine.webassembly` has wasmtime's, and
`motorcade.browser.kernels` the browser's.
"""

import json
import struct
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

from motorcade.errors import MotorcadeError

PATH = Path(__file__).with_name("engine.wasm")
SECTION = "motorcade.arguments"
_INT = struct.Struct("<q")
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


class Described(NamedTuple):
    """What a kernel is told of an array; ``address`` counts from the beginning of the memory, maybe outside of it."""

    dtype: str
    is_contiguous: bool
    items: int
    item_bytes: int
    address: int
    shape: tuple[int, ...]
    strides: tuple[int, ...]


class _Part(NamedTuple):
    """An argument of a call, or a tuple of them.

    Attributes:
        value: what was given.
        length: how many arguments it is.
        block: the part of the block that holds them.
        parts: where the tuple holds tuples, what it holds.
    """

    value: Any
    length: int
    block: bytes
    parts: "tuple[_Part, ...]" = ()


_NOTHING = _Part(object(), 0, b"")


@lru_cache
def module_arguments() -> dict[str, list[Argument]]:
    """Return the arguments of each kernel of the installed engine.wasm."""
    return parse_arguments(custom_section(PATH.read_bytes(), SECTION).decode())


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

    def __init__(self, arguments: dict[str, list[Argument]], end: int) -> None:
        self._arguments = arguments
        self._end = end
        self._slots: dict[str, tuple[int, int]] = {}
        self._packed: dict[str, list[_Part]] = {name: [] for name in arguments}

    def _describe(self, value: Any) -> Described | None:
        """Return what a kernel is told of an array; None for a number."""
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

    def _block(self, kernel: str, *arguments: Any) -> bytes:
        expected, packed = self._arguments[kernel], self._packed[kernel]
        if len(packed) != len(arguments):
            packed[:] = [_NOTHING] * len(arguments)
        first = 0
        for number, value in enumerate(arguments):
            part = packed[number]
            # To describe all arrays takes ten times as long as a tick of few cars; most are those of the last call.
            if part.value is not value:
                part = packed[number] = self._pack_again(kernel, value, expected, first, part)
            first += part.length
        if first < len(expected):
            _check(kernel, expected[first])
        return b"".join([part.block for part in packed])

    def _pack_again(self, kernel: str, value: Any, expected: list[Argument], first: int, before: _Part) -> _Part:
        """Pack an argument in place of ``before``; of a tuple that holds tuples only what differs is packed."""
        if type(value) is int:
            _check(kernel, expected[first] if first < len(expected) else None, "int64")
            return _Part(value, 1, _INT.pack(value))
        is_same = before.parts and type(value) is type(before.value)
        if not is_same and not (isinstance(value, tuple) and any(isinstance(each, tuple) for each in value)):
            return self._pack(kernel, value, expected[first:])
        parts, at = [], first
        for each, part in zip(value, before.parts if is_same else [_NOTHING] * len(value), strict=True):
            parts.append(part if part.value is each else self._pack(kernel, each, expected[at:]))
            at += parts[-1].length
        return _Part(value, at - first, b"".join([part.block for part in parts]), tuple(parts))

    def _pack(self, kernel: str, values: Any, expected: list[Argument]) -> _Part:
        numbers: list[int | float] = []
        form = ["<"]
        count = 0
        for value in values if isinstance(values, tuple) else (values,):
            argument = expected[count] if count < len(expected) else None
            count += 1
            described = None if isinstance(value, int | float) else self._describe(value)
            if described is not None:
                numbers += self._array_numbers(kernel, argument, described)
                form.append(f"{5 + 2 * len(described.shape)}q")
            else:
                is_float = isinstance(value, float)
                _check(kernel, argument, "float64" if is_float else "int64")
                numbers.append(value)
                form.append("d" if is_float else "q")
        return _Part(values, count, struct.pack("".join(form), *numbers))

    def _array_numbers(self, kernel: str, argument: Argument | None, array: Described) -> list[int]:
        layout = "C" if array.is_contiguous and argument and argument.layout == "C" else "A"
        _check(kernel, argument, array.dtype, len(array.shape), layout)
        if not 0 <= array.address <= self._end - array.items * array.item_bytes:
            raise MotorcadeError("kernel-argument-elsewhere", kernel=kernel, argument=str(argument))
        return [0, 0, array.items, array.item_bytes, array.address, *array.shape, *array.strides]

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
            self._slots[slot], self._end = (place, room), place + room
        return place, room


def _check(kernel: str, expected: Argument | None, *given: Any) -> None:
    """Raise MotorcadeError unless the argument's type is what the module expects."""
    found = Argument(expected.name if expected else "", *given) if given else None
    if found != expected:
        raise MotorcadeError("kernel-argument-differs", kernel=kernel, expected=str(expected), found=str(found))


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
