"""Break off a call at any line of the engine, as Ctrl-C or another signal's handler may."""

import queue
import sys
import threading
from collections.abc import Callable
from concurrent import futures
from pathlib import Path
from types import FrameType
from typing import Any

import motorcade.engine

# What the engine uses of Python itself, where an exception might leave a lock locked, counts too.
_FOLDERS = str(Path(motorcade.engine.__file__).parent), threading.__file__, queue.__file__, futures.__path__[0]


class Interrupt(BaseException):
    """Nobody else raises it, and nobody catches it."""


def lines_until_interrupted(call: Callable[[], Any], at: int) -> int:
    """Make a call, and raise Interrupt in this thread at the engine's ``at``-th line; return how many it ran."""
    count = 0

    def trace(frame: FrameType, event: str, argument: Any) -> Any:
        nonlocal count
        if not frame.f_code.co_filename.startswith(_FOLDERS):
            return None
        if event == "line":
            count += 1
            if count == at:
                raise Interrupt
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        call()
    except Interrupt:
        pass
    finally:
        sys.settrace(before)
    return count
