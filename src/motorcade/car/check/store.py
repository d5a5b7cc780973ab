"""Check a board's store: what was stored is found again, and after a power cut the old image or the new one is there.

Portable. Power is cut only under CPython: MicroPython can't trace lines.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable, Iterator
    from typing import Any

import sys

from motorcade.car.check.parts import is_image_or_none
from motorcade.car.check.probe import BoardFailedError, Probe, brief
from motorcade.errors import Phrase

EMPTY = b"\x00\x00\x00\x00"
# One state: LED 0 for a second. And the largest image.
SMALL = b"\x01\x00\x00\x00\x00\x08\x00\x00"
LARGE = b"\xff\xff\x01\x00" + b"\x00\x08\x00\x00" * 510
_MAX_CUTS = 500


def check_store(probe: Probe, reopen: "Callable[[], Any] | None") -> None:
    """Note what is wrong with load_image and store_image, and store the image again that was there before."""
    before = probe.answer("load_image", is_image_or_none, "image")
    try:
        if _round_trips(probe, reopen):
            _check_cuts(probe, reopen)
        probe.call("store_image", before or EMPTY)
    except BoardFailedError:
        pass


def _round_trips(probe: Probe, reopen: "Callable[[], Any] | None") -> bool:
    # Smaller images follow the largest, of which nothing must be left.
    for data in (SMALL, LARGE, SMALL, EMPTY):
        probe.call("store_image", data)
        found = probe.call("load_image")
        if found != data or type(found) is not bytes:
            probe.breach(Phrase("check-store-loses", found=brief(found), stored=brief(data)))
            return False
        if reopen is not None and probe.call_of(reopen(), "load_image") != data:
            probe.breach(Phrase("check-store-forgets", bytes=len(data)))
            return False
    return True


def _check_cuts(probe: Probe, reopen: "Callable[[], Any] | None") -> None:
    old, new = SMALL, LARGE
    probe.call("store_image", old)

    def store() -> None:
        probe.call("store_image", new)

    for place in _cuts_of(store):
        board = reopen() if reopen is not None else probe.board
        found = probe.call_of(board, "load_image")
        if found not in (old, new):
            probe.breach(Phrase("check-store-cut", found=brief(found), **place))
            return
        # The cut may have left this board damaged, as with an open file: use the one that was opened after it.
        probe.call_of(board, "store_image", old)


class PowerCut(BaseException):
    """A power cut. A BaseException, so that no ``except Exception`` or ``except OSError`` continues after it."""


def _cuts_of(action: "Callable[[], Any]") -> "Iterator[dict[str, Any]]":
    """Run ``action`` repeatedly, cut off a moment later each time, until it runs to its end.

    The moments are before each line, and, in Python's own library, before each call that may reach the system.
    Yields the place of each cut: ``{"line": 7, "file": "board.py"}``.
    """
    if not hasattr(sys, "settrace"):
        return
    for moments in range(_MAX_CUTS):
        place = _Cut(moments).run(action)
        if not place:
            return
        yield place


class _Cut:
    """One power cut, after so many moments."""

    def __init__(self, moments: int) -> None:
        self._left = moments
        self._place: dict[str, Any] = {}
        self._library = sys.modules["os"].__file__.rpartition("os.")[0]  # type: ignore[union-attr]

    def run(self, action: "Callable[[], Any]") -> "dict[str, Any]":
        """Run ``action`` until the cut; return its place, ``{}`` where the action ended before it."""
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
        if self._is_of_library(frame):
            return None
        if event == "line":
            self._pass(frame)
        return self._trace

    def _profile(self, frame: "Any", event: str, argument: "Any") -> None:
        if event == "c_call" and self._is_of_library(frame):
            module = argument.__module__ or type(argument.__self__).__module__
            if module != "builtins":
                self._pass(frame)

    def _is_of_library(self, frame: "Any") -> bool:
        file = frame.f_code.co_filename
        return bool(file.startswith((self._library, "<frozen")))

    def _pass(self, frame: "Any") -> None:
        """Count a moment; cut the power where no more are left. Name the last place outside Python's own library."""
        if self._left or self._place:
            self._left -= 1
            return
        while self._is_of_library(frame) and frame.f_back is not None:
            frame = frame.f_back
        file = frame.f_code.co_filename.replace("\\", "/").split("/")[-1]
        self._place = {"line": frame.f_lineno, "file": file}
        raise PowerCut
