"""Check a board's store: what was stored is found again, and after a power cut the old image or the new one is there.

Portable. Power is cut in the middle of store_image only under CPython: MicroPython doesn't profile. There Python's own
functions also show whether a file was written for good; for any other store an observer cuts the power.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable, Iterator
    from typing import Any

import sys

from motorcade.car.check.checked_board import CheckedBoard, brief, is_count, with_others
from motorcade.words.receiver import MOST_WORDS
from motorcade.words.ticks import elapsed_ms
from motorcade.words.upload import answer_within_ms

EMPTY = b"\x00\x00\x00\x00"
# One state: LED 0 for a second.
_STATE = b"\x00\x08\x00\x00"
SMALL = b"\x01\x00\x00\x00" + _STATE
_MAX_CUTS = 500
# So often an image is stored and read in a row: some stores take long only now and then.
_STORES = 45
# So long a car may wait before it stores an image, while the uploader waits for its answer.
_RESTS_MS = 500
# Calls by which a program may write a file for good.
_SYNCS = ("fsync", "fdatasync", "sync", "syncfs", "fcntl", "msync")


def check_store(checked: CheckedBoard) -> None:
    """Note a store that loses an image or is slow; store the image again that was there before.

    After a power cut the old image or the new one has to be there.
    """
    before = checked.call("load_image")
    reopen = checked.offer("reopen")
    try:
        # Smaller images follow the largest, of which nothing must be left.
        for data in (SMALL, _largest(checked), SMALL, EMPTY):
            _timed(checked, checked.board, "store_image", data)
            found = _timed(checked, checked.board, "load_image")
            is_kept = found == data and type(found) is bytes
            checked.require(is_kept, "check-store-loses", found=brief(found), stored=brief(data))
            if reopen is not None:
                is_kept = _timed(checked, reopen(), "load_image") == data
                checked.require(is_kept, "check-store-forgets", bytes=len(data))
        for _ in range(_STORES):
            _timed(checked, checked.board, "store_image", SMALL)
            _timed(checked, checked.board, "load_image")
        _check_cuts(checked, reopen)
    finally:
        checked.call("store_image", before or EMPTY)


def _timed(checked: CheckedBoard, board: "Any", method: str, *data: bytes) -> "Any":
    """Call store_image or load_image of a board, and note a call that takes long. Raises BrokenBoardError."""
    began_ms = checked.call("now_ms")
    result = checked.call_of(board, method, *data)
    took_ms = elapsed_ms(checked.call("now_ms"), began_ms)
    image = result or b""
    if data:
        image = data[0]
    most_ms = answer_within_ms(image) - _RESTS_MS
    checked.require(took_ms <= most_ms, "check-store-slow", method=method, took_ms=took_ms, most_ms=most_ms)
    return result


def _largest(checked: CheckedBoard) -> bytes:
    """Return the largest image that the board can store."""
    words = getattr(checked.board, "most_words", MOST_WORDS)
    if not is_count(words, MOST_WORDS) or words == 0:
        words = MOST_WORDS
    others = words - 1
    states = min(others, 255)
    dwell = 1 if others > states else 0
    return bytes([states, others - states, dwell, 0]) + _STATE * others


def _check_cuts(checked: CheckedBoard, reopen: "Callable[[], Any] | None") -> None:
    """Cut the power after store_image and in the middle of it, and note where neither image is left."""
    old, new = SMALL, _largest(checked)
    unsynced = None
    if hasattr(sys, "setprofile"):
        unsynced = _unsynced_file(lambda: checked.call("store_image", old))
    cut_power = None
    if unsynced is None:
        # It can't be seen here what is written for good.
        cut_power = checked.offer("observe.cut_power")

    def reopened() -> "Any":
        if cut_power is not None:
            cut_power()
        if reopen is None:
            return checked.board
        return reopen()

    if cut_power is not None:
        for data in (old, new):
            _timed(checked, checked.board, "store_image", data)
            found = _timed(checked, reopened(), "load_image")
            checked.require(found == data, "check-store-not-kept", found=brief(found), stored=brief(data))
    checked.call("store_image", old)
    for place in _cuts_of(lambda: checked.call("store_image", new)):
        board = reopened()
        found = _timed(checked, board, "load_image")
        checked.require(found in (old, new), "check-store-cut", found=brief(found), **place)
        # The cut may have left this board damaged, as with an open file: use the one that was opened after it.
        _timed(checked, board, "store_image", old)
    checked.require(not unsynced, "check-store-unsynced", file=unsynced)


def _unsynced_file(action: "Callable[[], Any]") -> "str | None":
    """Return the name of the file that ``action`` renamed before all of it was written for good, "" for none.

    None where that can't be seen: no file is renamed, or files are written for good by other functions. As long as it
    runs, functions of os note the files for all threads, and do what they do.
    """
    os: Any = sys.modules["os"]
    really_open, always_synced = os.open, getattr(os, "O_SYNC", 0) | getattr(os, "O_DSYNC", 0)
    synced: dict[tuple[int, int], int] = {}
    unsynced: list[str] = []
    is_unsure = False

    def syncs(real: "Callable[[Any], Any]") -> "Callable[[Any], Any]":
        def call(file: "Any") -> None:
            real(file)
            found = os.fstat(file if isinstance(file, int) else file.fileno())
            synced[found.st_dev, found.st_ino] = found.st_size

        return call

    def renames(real: "Callable[..., Any]") -> "Callable[..., Any]":
        def call(file: "Any", *arguments: "Any", **options: "Any") -> "Any":
            found = os.stat(file)
            is_synced = synced.get((found.st_dev, found.st_ino)) == found.st_size
            if is_synced:
                unsynced.append("")
            else:
                unsynced.append(os.path.basename(file))
            return real(file, *arguments, **options)

        return call

    def opens(path: "Any", flags: int, *arguments: "Any", **options: "Any") -> "Any":
        nonlocal is_unsure
        is_unsure = is_unsure or bool(flags & always_synced)
        return really_open(path, flags, *arguments, **options)

    def profile(frame: "Any", event: str, argument: "Any") -> None:
        # A function that a module imported by its name is not the one that was replaced.
        nonlocal is_unsure
        if event == "c_call" and argument.__name__ in _SYNCS and frame.f_code.co_filename != __file__:
            is_unsure = True

    wrapped: dict[str, Any] = {name: syncs(getattr(os, name)) for name in ("fsync", "fdatasync") if hasattr(os, name)}
    wrapped.update({name: renames(getattr(os, name)) for name in ("replace", "rename")}, open=opens)
    with_others(os, wrapped, lambda: _profiled(action, profile))
    if is_unsure or not unsynced:
        return None
    return max(unsynced)


def _profiled(action: "Callable[[], Any]", profile: "Callable[[Any, str, Any], None]") -> None:
    before = sys.getprofile()
    sys.setprofile(profile)
    try:
        action()
    finally:
        sys.setprofile(before)


class PowerCut(BaseException):
    """A power cut. A BaseException, so that no ``except Exception`` or ``except OSError`` continues after it."""


def _cuts_of(action: "Callable[[], Any]") -> "Iterator[dict[str, Any]]":
    """Run ``action`` repeatedly, cut off before one more of its calls each time, until it runs to its end.

    Yields the place of each cut outside Python's own library: ``{"line": 7, "file": "board.py"}``.
    """
    if not hasattr(sys, "setprofile"):
        return
    for calls in range(_MAX_CUTS):
        place: dict[str, Any] = {}
        try:
            _profiled(action, _cut_after(calls, place))
        except PowerCut:
            pass
        if not place:
            return
        yield place


def _cut_after(calls: int, place: "dict[str, Any]") -> "Callable[[Any, str, Any], None]":
    """Return a function for sys.setprofile that cuts the power after so many calls, and notes the place."""
    library = sys.modules["os"].__file__.rpartition("os.")[0]  # type: ignore[union-attr]

    def is_of_library(frame: "Any") -> bool:
        return bool(frame.f_code.co_filename.startswith((library, "<frozen")))

    def profile(frame: "Any", event: str, argument: "Any") -> None:
        nonlocal calls
        # A call of the board's own functions, or one that may reach the system.
        if event == "call":
            calls -= not is_of_library(frame)
        elif event == "c_call":
            calls -= (argument.__module__ or type(argument.__self__).__module__) != "builtins"
        if calls < 0 and not place:
            while is_of_library(frame):
                frame = frame.f_back
            place.update(line=frame.f_lineno, file=frame.f_code.co_filename.replace("\\", "/").split("/")[-1])
            raise PowerCut

    return profile
