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
    """Run ``action`` again and again, each time cut a moment later, and at last whole.

    The moments are before each line, and, in what Python brings itself, before each call that may
    reach the system. Yields, after each cut, where it was: ``line 7 of board.py``.
    """
    if not hasattr(sys, "settrace"):
        return
    for moments in range(_MOST_CUTS):
        place = _Cut(moments).run(action)
        if not place:
            return
        yield place


class _Cut:
    """One cut of power, after so many moments."""

    def __init__(self, moments: int) -> None:
        self._left = moments
        self._place = ""
        self._library = sys.modules["os"].__file__.rpartition("os.")[0]  # type: ignore[union-attr]

    def run(self, action: "Callable[[], Any]") -> str:
        """Run ``action`` until the cut; gives its place, ``""`` where it ended before."""
        traced, profiled = sys.gettrace(), sys.getprofile()
        sys.settrace(self._trace)
        sys.setprofile(self._profile)
        try:
            action()
        except PowerCut:
            pass
        finally:
            sys.setprofile(profiled)
            sys.settrace(traced)
        return self._place

    def _trace(self, frame: "Any", event: str, argument: "Any") -> "Any":
        if self._is_librarys(frame):
            return None
        if event == "line":
            self._pass(frame)
        return self._trace

    def _profile(self, frame: "Any", event: str, argument: "Any") -> None:
        if event == "c_call" and self._is_librarys(frame):
            home = argument.__module__ or type(argument.__self__).__module__
            if home != "builtins":
                self._pass(frame)

    def _is_librarys(self, frame: "Any") -> bool:
        file = frame.f_code.co_filename
        return bool(file.startswith((self._library, "<frozen")))

    def _pass(self, frame: "Any") -> None:
        if self._left or self._place:
            self._left -= 1
            return
        while self._is_librarys(frame) and frame.f_back is not None:
            frame = frame.f_back
        file = frame.f_code.co_filename.replace("\\", "/").split("/")[-1]
        self._place = f"line {frame.f_lineno} of {file}"
        raise PowerCut


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
