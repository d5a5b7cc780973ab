"""A board's store: what was stored is found again, and a cut of power leaves the old image or the new one.

Portable.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable
    from typing import Any

from motorcade.car.check.parts import is_image_or_none
from motorcade.car.check.probe import BoardFailedError, Probe, brief
from motorcade.car.check.surroundings import cuts_of

EMPTY = b"\x00\x00\x00\x00"
# One state: LED 0 for a second. And the largest image that there is.
SMALL = b"\x01\x00\x00\x00\x00\x08\x00\x00"
LARGE = b"\xff\xff\x01\x00" + b"\x00\x08\x00\x00" * 510


def check_store(probe: Probe, reopen: "Callable[[], Any] | None") -> None:
    """Note what is wrong with load_image and store_image, and put the image back that was there."""
    image = "the bytes of the image that it stores, or None"
    before = probe.answer("load_image", is_image_or_none, image)
    try:
        if _round_trips(probe, reopen):
            _check_cuts(probe, reopen)
        probe.call("store_image", before or EMPTY)
    except BoardFailedError:
        pass


def _round_trips(probe: Probe, reopen: "Callable[[], Any] | None") -> bool:
    # The smaller ones behind the largest: what is left of that must not show.
    for data in (SMALL, LARGE, SMALL, EMPTY):
        probe.call("store_image", data)
        found = probe.call("load_image")
        if found != data or type(found) is not bytes:
            probe.breach(
                f"load_image() gave {brief(found)} after store_image({brief(data)}); it has to give that image"
            )
            return False
        if reopen is not None and probe.call_of(reopen(), "load_image") != data:
            probe.breach(f"a board that was opened anew has lost the image of {len(data)} bytes that was stored")
            return False
    return True


def _check_cuts(probe: Probe, reopen: "Callable[[], Any] | None") -> None:
    old, new = SMALL, LARGE
    probe.call("store_image", old)

    def store() -> None:
        probe.call("store_image", new)

    for place in cuts_of(store):
        board = reopen() if reopen is not None else probe.board
        found = probe.call_of(board, "load_image")
        if found not in (old, new):
            probe.breach(
                f"a cut of power in store_image, at {place}, leaves {brief(found)} in place of the old image or "
                "the new one: write a second file, flush it, and rename it to the first one's name"
            )
            return
        # The board may have taken harm from the cut, as an open file: its successor goes on.
        probe.call_of(board, "store_image", old)
