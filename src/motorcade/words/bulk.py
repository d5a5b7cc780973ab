"""Decode and encode arrays of words: a column for each field, hundreds of millions of words a second.

Two kernels give the same results from the same table of fields. The NumPy kernel works in blocks that fit into the
cache, mostly on integers as narrow as the fields; the Numba kernel reads the words once and uses all cores. Numba is
imported on first use.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib.util import find_spec
from itertools import pairwise
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from motorcade.words.field import WORD_BITS, WORD_MASK, Field, WordFormat

# 256 KiB of words and their columns fit into the second-level cache of a core.
BLOCK_WORDS = 1 << 16
# Below this number NumPy finishes before Numba is imported.
NUMBA_WORDS = 1 << 20

Words = npt.NDArray[np.uint32]
Column = npt.NDArray[np.unsignedinteger[Any]]
KernelName = Literal["numpy", "numba"]


class _Kernel(NamedTuple):
    """Two functions that take the words, fields whose columns have one dtype, and these columns.

    ``decode`` fills the columns, which are rows of one matrix. ``encode`` sets the bits of the fields in the
    words, where they are 0, and returns whether any value has more bits than its field.
    """

    decode: Callable[[Words, Sequence[Field], Column], None]
    encode: Callable[[Words, Sequence[Field], Sequence[Column]], bool]


def decode_columns(
    word_format: WordFormat, words: npt.ArrayLike, strict: bool = False, kernel: KernelName | None = None
) -> dict[str, Column]:
    """Decode the fields of many words.

    Args:
        word_format: the format of the words.
        words: shape (n,), integers 0 to 4294967295 of any dtype; native uint32 isn't copied.
        strict: refuse reserved bits that are set; otherwise the columns of reserved fields hold them.
        kernel: ``"numpy"`` or ``"numba"``; None takes Numba where it is installed and n is a million or more.

    Returns:
        By name, in the format's order, a column of shape (n,) for each field: uint8
        where the field has up to 8 bits, uint16 where it has more. Columns of one
        dtype share one block of memory; copy a column to keep only that one.

    Raises:
        WordError: for the first word that the scalar ``decode`` refuses: first by ranges, then by pairs.
        TypeError: the words aren't integers of at most 64 bits.
        ValueError: the words aren't one-dimensional, or there is no such kernel.
        ImportError: ``kernel`` is ``"numba"`` and Numba can't be imported.
    """
    native = _native_words(word_format, words)
    chosen = _kernel(kernel, len(native))
    columns: dict[str, Column] = {}
    for dtype, fields in _fields_by_dtype(word_format.fields):
        matrix = np.empty((len(fields), len(native)), dtype)
        chosen.decode(native, fields, matrix)
        columns.update(zip((field.name for field in fields), matrix, strict=True))
    checked = [field for field in word_format.fields if field.restricted or (strict and field.reserved)]
    row = _first_row_refused(checked, columns, strict)
    if row is not None:
        word_format.decode(int(native[row]), strict)
    _check_pairs(word_format, native)
    return {field.name: columns[field.name] for field in word_format.fields}


def encode_columns(
    word_format: WordFormat, columns: Mapping[str, npt.ArrayLike], kernel: KernelName | None = None
) -> Words:
    """Encode words from many values of each field.

    Args:
        word_format: the format of the words.
        columns: by field name, integers of any dtype, all of shape (n,); columns that
            ``decode_columns`` returned aren't copied. Fields left out take their default.
        kernel: as for ``decode_columns``.

    Returns:
        The words: uint32, shape (n,); n is 0 where there are no columns.

    Raises:
        WordError: for the first row that the scalar ``encode`` refuses: first by ranges, then by pairs.
        TypeError: a name is no field of the format, or a column isn't integers of at most 64 bits.
        ValueError: a column isn't one-dimensional or not as long as the others, or there is no such kernel.
        ImportError: ``kernel`` is ``"numba"`` and Numba can't be imported.
    """
    given = {name: _integers(name, column) for name, column in columns.items()}
    count = _common_length(word_format, given)
    chosen = _kernel(kernel, count)
    left_out = sum(field.default << field.low for field in word_format.fields if field.name not in given)
    words = np.full(count, left_out, np.uint32)
    present = [field for field in word_format.fields if field.name in given]
    checked = []
    for dtype, fields in _fields_by_dtype(present):
        spilled = chosen.encode(words, fields, [_read_only(given[field.name], dtype) for field in fields])
        checked += [field for field in fields if spilled or field.restricted or given[field.name].dtype != dtype]
    row = _first_row_refused(checked, given, strict=False)
    if row is not None:
        word_format.encode(**{name: int(column[row]) for name, column in given.items()})
    _check_pairs(word_format, words)
    return words


def _integers(name: str, values: npt.ArrayLike) -> npt.NDArray[Any]:
    array = np.asarray(values)
    if array.ndim != 1:
        raise ValueError(f"{name}: of {array.ndim} dimensions; allowed: 1")
    if array.size and array.dtype.kind not in "biu":
        raise TypeError(f"{name}: of type {array.dtype}; allowed: integers of at most 64 bits")
    return array


def _native_words(word_format: WordFormat, values: npt.ArrayLike) -> Words:
    given = _integers("words", values)
    if given.dtype != np.uint32 and (row := _first_refused(given, range(WORD_MASK + 1))) is not None:
        word_format.decode(int(given[row]))
    return _read_only(given, np.dtype(np.uint32))


def _common_length(word_format: WordFormat, columns: Mapping[str, npt.NDArray[Any]]) -> int:
    if unknown := sorted(set(columns) - {field.name for field in word_format.fields}):
        raise TypeError(f"{unknown[0]} is no field of {word_format.name}")
    if len(lengths := {len(column) for column in columns.values()}) > 1:
        raise ValueError(f"columns of different lengths: {sorted(lengths)}")
    return max(lengths, default=0)


def _read_only(array: npt.NDArray[Any], dtype: np.dtype[Any]) -> npt.NDArray[Any]:
    """Return a read-only view of ``array``. Numba would compile again for each other kind of array."""
    view = np.require(array, dtype, ("C", "A")).view()
    view.flags.writeable = False
    return view


def _fields_by_dtype(fields: Sequence[Field]) -> list[tuple[np.dtype[Any], list[Field]]]:
    groups: dict[np.dtype[Any], list[Field]] = {}
    for field in fields:
        groups.setdefault(np.min_scalar_type(field.raw_mask), []).append(field)
    return list(groups.items())


@cache
def _allowed(field: Field, strict: bool) -> Sequence[int]:
    """Return the raw values that ``field`` may hold, ascending; a range where they have no gaps."""
    if strict and field.reserved:
        return range(field.defined + 1)
    if not field.restricted:
        return range(field.raw_mask + 1)
    raws = [raw for raw in range(field.raw_mask + 1) if field.allows(raw)]
    without_holes = range(raws[0], raws[-1] + 1)
    return without_holes if len(without_holes) == len(raws) else raws


def _first_refused(column: npt.NDArray[Any], allowed: Sequence[int]) -> int | None:
    """Return the row of the first value that isn't ``allowed``."""
    if not column.size:
        return None
    if isinstance(allowed, range):
        low, high = allowed[0], allowed[-1]
        never_below = low == 0 and column.dtype.kind == "u"
        if (never_below or column.min() >= low) and column.max() <= high:
            return None
        refused = (column < low) | (column > high)
    else:
        refused = ~np.isin(column, allowed)
    return int(refused.argmax()) if refused.any() else None


def _first_row_refused(fields: Sequence[Field], columns: Mapping[str, npt.NDArray[Any]], strict: bool) -> int | None:
    rows = (_first_refused(columns[field.name], _allowed(field, strict)) for field in fields)
    return min((row for row in rows if row is not None), default=None)


def _check_pairs(word_format: WordFormat, words: Words) -> None:
    """Raise the WordError of the first word in which only one of two paired fields is 0."""
    if word_format.paired:
        first_rows = np.unique(words, return_index=True)[1]
        for word in words[np.sort(first_rows)].tolist():
            word_format.decode(word)


def _windows(fields: Sequence[Field], bits: int) -> list[list[Field]]:
    """Group neighbouring fields that fit into ``bits`` bits together."""
    windows: list[list[Field]] = []
    for field in fields:
        if windows and windows[-1][0].high - field.low < bits:
            windows[-1].append(field)
        else:
            windows.append([field])
    return windows


def _decode_numpy(words: Words, fields: Sequence[Field], columns: Column) -> None:
    windows = _windows(fields, 8 * columns.itemsize)
    column_of = dict(zip(fields, columns, strict=True))
    for start in range(0, len(words), BLOCK_WORDS):
        part = slice(start, start + BLOCK_WORDS)
        block = words[part]
        window_bits = np.empty(len(block), columns.dtype)
        for window in windows:
            low = window[-1].low
            np.right_shift(block, low, out=window_bits, casting="unsafe")
            for field in window:
                column = column_of[field][part]
                np.right_shift(window_bits, field.low - low, out=column)
                column &= field.raw_mask


def _encode_numpy(words: Words, fields: Sequence[Field], columns: Sequence[Column]) -> bool:
    windows = _windows(fields, 8 * columns[0].itemsize)
    column_of = dict(zip(fields, columns, strict=True))
    spilled = False
    for start in range(0, len(words), BLOCK_WORDS):
        part = slice(start, start + BLOCK_WORDS)
        block = words[part]
        spilled |= any(column[part].max() > field.raw_mask for field, column in column_of.items())
        for window in windows:
            window_bits = column_of[window[0]][part].copy()
            for above, field in pairwise(window):
                # A product, because the left shift of narrow integers in NumPy is eight times slower.
                window_bits *= 1 << above.low - field.low
                window_bits |= column_of[field][part]
            block |= window_bits.astype(np.uint32) << window[-1].low
    return spilled


@cache
def _numba_loops() -> tuple[Any, Any]:
    """Return the loops of Numba for decoding and encoding, compiled once and cached on disk.

    They work on slices, because the compiler uses SIMD only for indices from 0.
    """
    from numba import njit, prange

    # The words of a block stay in the first-level cache of a core while all columns are filled.
    size = 4096

    @njit(parallel=True, cache=True)
    def fill_columns(words: Any, lows: Any, masks: Any, columns: Any) -> None:
        for block in prange((len(words) + size - 1) // size):
            part = slice(block * size, (block + 1) * size)
            source = words[part]
            for row in range(len(lows)):
                low, mask, column = lows[row], masks[row], columns[row][part]
                for index in range(len(source)):
                    column[index] = (source[index] >> low) & mask

    @njit(parallel=True, cache=True)
    def add_columns(words: Any, lows: Any, masks: Any, columns: Any) -> Any:
        spilled = np.zeros((len(words) + size - 1) // size, np.uint32)
        for block in prange(len(spilled)):
            part = slice(block * size, (block + 1) * size)
            target = words[part]
            for row in range(len(lows)):
                low, column, seen = lows[row], columns[row][part], np.uint32(0)
                for index in range(len(target)):
                    raw = np.uint32(column[index])  # otherwise Numba widens to 64 bits
                    seen |= raw
                    target[index] |= raw << low
                spilled[block] |= seen & ~masks[row]
        return spilled.any()

    return fill_columns, add_columns


def _decode_numba(words: Words, fields: Sequence[Field], columns: Column) -> None:
    _numba_loops()[0](words, *_lows_and_masks(fields), columns)


def _encode_numba(words: Words, fields: Sequence[Field], columns: Sequence[Column]) -> bool:
    # Always as many columns as a word can have: Numba would compile again for each other number.
    padding = [columns[0]] * (WORD_BITS - len(columns))
    return bool(_numba_loops()[1](words, *_lows_and_masks(fields), (*columns, *padding)))


def _lows_and_masks(fields: Sequence[Field]) -> Words:
    return np.array([[field.low for field in fields], [field.raw_mask for field in fields]], np.uint32)


_KERNELS = {"numpy": _Kernel(_decode_numpy, _encode_numpy), "numba": _Kernel(_decode_numba, _encode_numba)}


def _kernel(name: KernelName | None, count: int) -> _Kernel:
    if name is None:
        name = "numba" if count >= NUMBA_WORDS and find_spec("numba") else "numpy"
    if name not in _KERNELS:
        raise ValueError(f"kernel is {name!r}; allowed: {', '.join(_KERNELS)} or None")
    return _KERNELS[name]
