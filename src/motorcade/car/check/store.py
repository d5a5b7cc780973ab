"""Check a board's store: what was stored is found again, and after a power cut the old image or the new one is there.

Portable. Power is cut in the middle of store_image only under CPython: MicroPython can't trace lines. There Python's
own functions also show whether a file was written for good; for any other store an observer cuts the power.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable, Iterator
    from typing import Any

import sys

from motorcade.car.check.calls import is_image_or_none
from motorcade.car.check.probe import Probe, brief, is_count
from motorcade.words.receiver import MOST_WORDS
from motorcade.words.ticks import elapsed_ms
from motorcade.words.upload import answer_within_ms

EMPTY = b"\x00\x00\x00\x00"
# One state: LED 0 for a second.
_STATE = b"\x00\x08\x00\x00"
SMALL = b"\x01\x00\x00\x00" + _STATE
_MAX_CUTS = 500
_SYNCS = ("fsync", "fdatasync")
_WATCHED = ("fsync", "fdatasync", "replace", "rename", "open")
# So often an image is stored and read in a row: some stores take long only now and then.
_CALLS = 45
# So long a car may wait before it stores an image, while the uploader waits for its answer.
_RESTS_MS = 500
# Calls by which a program may write a file for good, too.
_OTHER_SYNCS = ("fsync", "fdatasync", "sync", "syncfs", "fcntl", "msync")


def check_store(probe: Probe) -> None:
    """Note what is wrong with load_image and store_image, and store the image again that was there before."""
    before = probe.answer("load_image", is_image_or_none, "image")
    reopen = probe.offer("reopen")
    try:
        _round_trips(probe, reopen)
        for _ in range(_CALLS):
            _call(probe, probe.board, "store_image", SMALL)
            _call(probe, probe.board, "load_image")
        cut_power = probe.offer("observe.cut_power") if _is_unsure_of_syncs(probe) else None
        if cut_power is not None:
            _check_keeping(probe, reopen, cut_power)
        _check_cuts(probe, reopen, cut_power)
    finally:
        probe.call("store_image", before or EMPTY)


def _call(probe: Probe, board: "Any", name: str, *data: bytes) -> "Any":
    """Call store_image or load_image of a board, and note a call that takes long. Raises BrokenBoardError."""
    began_ms = probe.call("now_ms")
    result = probe.call_of(board, name, *data)
    took_ms = elapsed_ms(probe.call("now_ms"), began_ms)
    most_ms = answer_within_ms(data[0] if data else result or b"") - _RESTS_MS
    probe.require(took_ms <= most_ms, "check-store-slow", method=name, took_ms=took_ms, most_ms=most_ms)
    return result


def _largest(probe: Probe) -> bytes:
    """Return the largest image that the board can store."""
    words = getattr(probe.board, "most_words", MOST_WORDS)
    others = (words if is_count(words, MOST_WORDS) and words else MOST_WORDS) - 1
    states = min(others, 255)
    return bytes([states, others - states, 1 if others > states else 0, 0]) + _STATE * others


def _round_trips(probe: Probe, reopen: "Callable[[], Any] | None") -> None:
    # Smaller images follow the largest, of which nothing must be left.
    for data in (SMALL, _largest(probe), SMALL, EMPTY):
        _call(probe, probe.board, "store_image", data)
        found = _call(probe, probe.board, "load_image")
        is_kept = found == data and type(found) is bytes
        probe.require(is_kept, "check-store-loses", found=brief(found), stored=brief(data))
        if reopen is not None:
            probe.require(_call(probe, reopen(), "load_image") == data, "check-store-forgets", bytes=len(data))


def _is_unsure_of_syncs(probe: Probe) -> bool:
    """Store an image and note a file that gets its name before it is written for good.

    Return whether that can't be seen here: the store is no file, or this is no CPython.
    """
    if not hasattr(sys, "setprofile"):
        return True
    syncs = _Syncs()
    syncs.watch(lambda: probe.call("store_image", SMALL))
    if syncs.unsynced and not syncs.is_unsure:
        probe.breach("check-store-unsynced", file=syncs.unsynced)
        return False
    return syncs.is_unsure or not syncs.renamed


def _check_keeping(probe: Probe, reopen: "Callable[[], Any] | None", cut_power: "Callable[[], Any]") -> None:
    """Note an image that isn't there any more when the power fails as soon as store_image has returned."""
    for data in (SMALL, _largest(probe)):
        _call(probe, probe.board, "store_image", data)
        cut_power()
        found = _call(probe, reopen() if reopen is not None else probe.board, "load_image")
        probe.require(found == data, "check-store-not-kept", found=brief(found), stored=brief(data))


def _check_cuts(probe: Probe, reopen: "Callable[[], Any] | None", cut_power: "Callable[[], Any] | None") -> None:
    old, new = SMALL, _largest(probe)
    probe.call("store_image", old)
    for place in _cuts_of(lambda: probe.call("store_image", new)):
        if cut_power is not None:
            cut_power()
        board = reopen() if reopen is not None else probe.board
        found = _call(probe, board, "load_image")
        probe.require(found in (old, new), "check-store-cut", found=brief(found), **place)
        # The cut may have left this board damaged, as with an open file: use the one that was opened after it.
        _call(probe, board, "store_image", old)


class _Syncs:
    """Watch how Python's module os writes files for good.

    Attributes:
        renamed: how many files got another name.
        unsynced: the name of the last one of them that was not written for good before, or not all of it.
        is_unsure: whether files may have been written for good in another way than by os.fsync.
    """

    def __init__(self) -> None:
        self.renamed = 0
        self.unsynced = ""
        self.is_unsure = False
        self._os: Any = sys.modules["os"]
        self._synced_bytes: dict[tuple[int, int], int] = {}
        self._is_seen = False

    def watch(self, action: "Callable[[], Any]") -> None:
        """Run ``action``. As long as it runs, the functions of os count for all threads, and do what they do."""
        kept = [(name, getattr(self._os, name)) for name in _WATCHED if hasattr(self._os, name)]
        profiled = sys.getprofile()
        sys.setprofile(self._profile)
        try:
            for name, real in kept:
                setattr(self._os, name, self._opens(real) if name == "open" else self._seen(real, name in _SYNCS))
            action()
        finally:
            for name, real in kept:
                setattr(self._os, name, real)
            sys.setprofile(profiled)

    def _seen(self, real: "Callable[..., Any]", syncs: bool) -> "Callable[..., Any]":
        def call(file: "Any", *arguments: "Any", **options: "Any") -> "Any":
            if not syncs:
                self._rename(file)
            self._is_seen = True
            try:
                result = real(file, *arguments, **options)
            finally:
                self._is_seen = False
            if syncs:
                place, size = self._place(self._os.fstat(file if isinstance(file, int) else file.fileno()))
                self._synced_bytes[place] = size
            return result

        return call

    def _opens(self, real: "Callable[..., Any]") -> "Callable[..., Any]":
        always = getattr(self._os, "O_SYNC", 0) | getattr(self._os, "O_DSYNC", 0)

        def call(path: "Any", flags: int, *arguments: "Any", **options: "Any") -> "Any":
            self.is_unsure = self.is_unsure or bool(flags & always)
            return real(path, flags, *arguments, **options)

        return call

    def _rename(self, file: "Any") -> None:
        place, size = self._place(self._os.stat(file))
        self.renamed += 1
        if self._synced_bytes.get(place) != size:
            self.unsynced = str(file).replace("\\", "/").split("/")[-1]

    def _place(self, found: "Any") -> "tuple[tuple[int, int], int]":
        return (found.st_dev, found.st_ino), found.st_size

    def _profile(self, frame: "Any", event: str, argument: "Any") -> None:
        # A function that a module imported by its name is not the one that was replaced.
        if event == "c_call" and argument.__name__ in _OTHER_SYNCS and not self._is_seen:
            self.is_unsure = True


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
