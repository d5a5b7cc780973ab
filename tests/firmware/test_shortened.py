"""A chip's modules without constants, docstrings and annotations do what they did."""

import sys
from pathlib import Path

from motorcade.firmware.shortened import shortened

NUMBERS = b'"""Numbers."""\nBITS = 3\nMASK: int = (1 << BITS) - 1\nWORD = 0xFFFFFFFF\n'
USER = b'''
"""A module."""
MYPY = False
if MYPY:
    from typing import Any
else:
    Any = object
from small import numbers
from small.ends import LOW
from small.numbers import MASK as MOST
COUNT = 0
NONE = 0
NAMES = ("a", "b")


class Fault(Exception):
    """Says what is wrong."""


class Pair:
    first: int = 1

    def __init__(self, a: "Any", b: int = LOW) -> None:
        """Keep both."""
        self.a, self.b = b, a


def counted(by: int) -> int:
    global COUNT
    COUNT += by
    return COUNT


def shadowed(MOST: int) -> int:
    return MOST


def used(x: int) -> "Any":
    x, y = LOW - x, numbers.MASK ** 2
    return x, y, f"{MOST}", NAMES[LOW], numbers.WORD & ~x, -LOW, 3 - NONE, NONE + x, (x >> NONE) + NONE, NONE - x
'''
FILES = {
    "lib/small/__init__.py": b"",
    "lib/small/numbers.py": NUMBERS,
    "lib/small/ends.py": b"LOW = -1",
    "lib/small/user.py": USER,
    "main.py": b"BITS = 1",
}


def result(folder: Path, files: dict[str, bytes], monkeypatch) -> tuple[object, ...]:
    for path, data in files.items():
        target = folder / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(data)
    for name in [name for name in sys.modules if name.partition(".")[0] == "small"]:
        del sys.modules[name]
    monkeypatch.syspath_prepend(folder / "lib")
    from small import user  # type: ignore[import-not-found]

    assert user.__file__ == str(folder / "lib" / "small" / "user.py")
    pair = user.Pair(5)
    return user.used(4), pair.a, pair.b, pair.first, user.counted(2), user.COUNT, user.shadowed(9), user.Fault("x").args


def test_what_is_shortened_does_the_same_and_modules_of_constants_are_gone(tmp_path, monkeypatch):
    short = shortened(FILES, "lib")
    assert "lib/small/ends.py" not in short
    # A function has an argument of this name.
    assert short["lib/small/numbers.py"] == b"MASK = (1 << 3) - 1"
    assert short["main.py"] == FILES["main.py"]
    expected = result(tmp_path / "whole", FILES, monkeypatch)
    assert result(tmp_path / "short", short, monkeypatch) == expected
    for gone in (b"numbers.WORD", b"LOW", b"NONE + x", b"x >> NONE", b"Keep both", b"= (b, a)", b"->"):
        assert gone in USER.replace(b"b, a", b"(b, a)")
        assert gone.replace(b"NONE", b"0") not in short["lib/small/user.py"]
