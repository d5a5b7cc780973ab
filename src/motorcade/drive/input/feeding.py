"""A thread that reads a stick at a car, since a device's driver may take its time, and the car's loop must not.

What the thread doesn't read the car doesn't hear: where it hangs, the car's failsafe stops the wheels.
"""

import asyncio
import threading
from collections.abc import AsyncIterator, Callable
from concurrent.futures import Future
from contextlib import AbstractContextManager, asynccontextmanager

from motorcade.drive.input.deadman import QUIT, StickSource
from motorcade.drive.input.local import LocalStick
from motorcade.drive.safety.clock import monotonic_ms
from motorcade.drive.session import CarControl

# A car takes 100 commands a second.
PERIOD_S = 0.02
_PATIENCE_S = 2.0


@asynccontextmanager
async def fed(
    drive: CarControl,
    opening: AbstractContextManager[StickSource],
    say: Callable[[str], None],
    leave: Callable[[], None],
) -> AsyncIterator[None]:
    """Let a stick at the car drive it while the block runs.

    Args:
        drive: the car.
        opening: the stick; opened, read and closed in a thread of its own.
        say: as `LocalStick` takes it, called from that thread; so is ``leave``.
        leave: called when the stick's user wants to end.

    Raises:
        OSError: the stick can't be opened.
    """
    opened: Future[None] = Future()
    ended = threading.Event()
    arguments = (LocalStick(drive, say), opening, opened, ended, say, leave)
    # A daemon, so that a device's driver that hangs can't keep a car from ending.
    thread = threading.Thread(target=_feed, args=arguments, name="stick at the car", daemon=True)
    thread.start()
    try:
        await asyncio.wrap_future(opened)
        yield
    finally:
        ended.set()
        await asyncio.to_thread(thread.join, _PATIENCE_S)


def _feed(
    stick: LocalStick,
    opening: AbstractContextManager[StickSource],
    opened: "Future[None]",
    ended: threading.Event,
    say: Callable[[str], None],
    leave: Callable[[], None],
) -> None:
    try:
        with opening as source:
            opened.set_result(None)
            while not ended.wait(PERIOD_S):
                reading = source.read()
                stick.take(reading, monotonic_ms())
                if QUIT in reading.orders:
                    leave()
    except OSError as problem:
        if opened.done():
            say(f"the stick at the car can't be read any more: {problem}")
        else:
            opened.set_exception(problem)
    finally:
        opened.cancel()
        stick.leave()
