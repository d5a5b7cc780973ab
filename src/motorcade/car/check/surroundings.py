"""What a check of a board does to its surroundings: cuts of power, and clocks that are ahead.

Portable; what a Python doesn't offer is left out: MicroPython can't trace lines, nor are its modules to be changed.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable, Iterator
    from typing import Any

import sys
import time

HAS_CLOCK = hasattr(time, "monotonic")
_MOST_CUTS = 500
_CLOCKS = (("monotonic", 0.001), ("time", 0.001), ("perf_counter", 0.001))
_NS_CLOCKS = (("monotonic_ns", 1000000), ("time_ns", 1000000), ("perf_counter_ns", 1000000))


class PowerCut(BaseException):
    """Stands for a cut of power: no ``except Exception`` or ``except OSError`` goes on behind it."""


def cuts_of(action: "Callable[[], Any]") -> "Iterator[str]":
    """Run ``action`` again and again, each time cut one line of Python later, and at last whole.

    Yields, after each cut, where it was: ``line 7 of board.py``.
    """
    if not hasattr(sys, "settrace"):
        return
    for lines in range(_MOST_CUTS):
        place = _cut(action, lines)
        if not place:
            return
        yield place


def _cut(action: "Callable[[], Any]", lines: int) -> str:
    """Run ``action`` for so many lines; where it was cut then, ``""`` where it ended before."""
    left, place = [lines], [""]

    def trace(frame: "Any", event: str, argument: "Any") -> "Any":
        if event == "line":
            if left[0] == 0:
                file = frame.f_code.co_filename.replace("\\", "/").split("/")[-1]
                place[0] = f"line {frame.f_lineno} of {file}"
                raise PowerCut
            left[0] -= 1
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        action()
    except PowerCut:
        pass
    finally:
        sys.settrace(before)
    return place[0]


def read_later(read: "Callable[[], Any]", later_ms: int) -> "Any":
    """What ``read`` gives where this computer's clocks are ``later_ms`` ahead; None where they can't be set.

    Other threads would see those clocks too, so they stay where there are others.
    """
    threading = sys.modules.get("threading")
    if sys.implementation.name == "micropython" or (threading and threading.active_count() > 1):
        return None
    kept = [(name, getattr(time, name)) for name, _ in _CLOCKS + _NS_CLOCKS]
    try:
        for name, unit in _CLOCKS + _NS_CLOCKS:
            setattr(time, name, _ahead(getattr(time, name), later_ms * unit))
        return read()
    finally:
        for name, clock in kept:
            setattr(time, name, clock)


def _ahead(clock: "Callable[[], Any]", by: "Any") -> "Callable[[], Any]":
    return lambda: clock() + by


def host_ms() -> float:
    """A clock beside the board's, in ms; always 0 where there is none (HAS_CLOCK)."""
    return time.monotonic() * 1000 if HAS_CLOCK else 0.0
