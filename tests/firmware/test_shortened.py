"""A chip's modules without constants, docstrings and annotations do what they did."""

import sys
from pathlib import Path
from typing import Any

from motorcade.firmware.shortened import joined, shortened

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


def test_what_is_shortened_does_the_same_and_modules_of_constants_are_empty(tmp_path, monkeypatch):
    short = shortened(FILES, "lib")
    assert short["lib/small/ends.py"] == b""
    # A function has an argument of this name.
    assert short["lib/small/numbers.py"] == b"MASK = (1 << 3) - 1"
    assert short["main.py"] == FILES["main.py"]
    expected = result(tmp_path / "whole", FILES, monkeypatch)
    assert result(tmp_path / "short", short, monkeypatch) == expected
    for gone in (b"numbers.WORD", b"LOW", b"Keep both", b"= (b, a)", b"->"):
        assert gone in USER.replace(b"b, a", b"(b, a)")
        assert gone not in short["lib/small/user.py"]


MORE = b"""
from small import tools
from small.tools import scaled as grown, Tool

def scaled(value):
    return value - 1

class Drawer:
    size = 2
    def scaled(self, by):
        return grown(self.size) * by

def everything(scaled):
    from small.late import late
    return scaled, grown(3), tools.scaled(4), tools.BASE, Drawer().scaled(5), Tool().name, late(6), again(7)

def again(value):
    return scaled(value)
"""
TOOLS = b"""
BASE = [1]
def scaled(value):
    return helped(value) * 2
def helped(scaled):
    base = scaled
    return base
class Tool:
    name = "scaled"
"""
LATE = b"""
from small.tools import helped
def late(value):
    return helped(value) + len(BASE)
BASE = "late"
"""
ALONE = b"def made(asm_pio): return asm_pio"


def test_joined_modules_do_what_they_did(tmp_path, monkeypatch):
    files = {
        "lib/small/__init__.py": b"",
        "lib/small/more.py": MORE,
        "lib/small/tools.py": TOOLS,
        "lib/small/late.py": LATE,
        "lib/small/alone.py": ALONE,
        "main.py": b"import small.more",
    }
    one = joined(files, "lib", "lib/small/more.py")
    assert one.keys() == {"lib/small/more.py", "lib/small/alone.py", "main.py"}
    assert b"small" not in one["lib/small/more.py"]
    names: dict[str, Any] = {}
    exec(one["lib/small/more.py"], names)
    assert names["everything"](8) == (8, 6, 8, [1], 20, "scaled", 10, 6)
