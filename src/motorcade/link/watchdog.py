"""Keeps a `motorcade.link.driving.Drive` alive, and its wheels still where that fails.

Three watch over each other: the loop beats, a thread outside the loop stops the
wheels where it doesn't, and the arbiter stops them where no command comes.
"""

import asyncio
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from types import TracebackType

from motorcade.link.driving import Drive

_BEAT_MS = 50


class Watchdog:
    """A thread that stops the wheels where the loop is stuck; use it as a context manager."""

    def __init__(self, drive: Drive) -> None:
        self._drive = drive
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="drive watchdog", daemon=True)

    def __enter__(self) -> None:
        self._thread.start()

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self._thread.join()

    def _watch(self) -> None:
        rest_ms = _BEAT_MS
        while not self._ended.wait(min(rest_ms, _BEAT_MS) / 1000):
            with suppress(OSError):
                rest_ms = self._drive.watch()


@asynccontextmanager
async def kept(drive: Drive) -> AsyncIterator[None]:
    """Beats while the block runs, watched by a thread; however it ends, the wheels then stand still."""
    beating = None
    try:
        drive.beat()
        with Watchdog(drive):
            beating = asyncio.ensure_future(_beat(drive))
            yield
    finally:
        if beating:
            beating.cancel()
        drive.close()


async def _beat(drive: Drive) -> None:
    while True:
        await asyncio.sleep(min(drive.beat(), _BEAT_MS) / 1000)
