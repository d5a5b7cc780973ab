"""Wait for something that sends no event, such as another process. Everything else brings an event or a mock clock."""

import asyncio
import threading
import time
from collections.abc import Callable
from subprocess import Popen
from typing import Any

# How long a busy machine may take. No test depends on a shorter time.
DEADLINE_S = 30.0
_PERIOD_S = 0.005


async def until(condition: Callable[[], Any], deadline_s: float = DEADLINE_S) -> Any:
    """Wait until ``condition()`` is true, by the clock of the event loop; return what it gives."""
    loop = asyncio.get_running_loop()
    end_s = loop.time() + deadline_s
    while not (found := condition()):
        assert loop.time() < end_s, "it never happened"
        await asyncio.sleep(_PERIOD_S)
    return found


def wait_until(condition: Callable[[], Any], *processes: Popen, deadline_s: float = DEADLINE_S) -> Any:
    """Wait until ``condition()`` is true in a thread without an event loop; fail when one of the processes ends.

    Between two looks it rests as long as a look takes, so that whatever is waited for gets the processor.
    """
    pause = threading.Event()
    looks_s = time.monotonic()
    end_s = looks_s + deadline_s
    while not (found := condition()):
        looked_s = time.monotonic()
        assert looked_s < end_s, "it never happened"
        assert all(process.poll() is None for process in processes), "a process ended too early"
        pause.wait(max(_PERIOD_S, looked_s - looks_s))
        looks_s = time.monotonic()
    return found
