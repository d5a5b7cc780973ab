"""Keeps a `motorcade.link.driving.drive.Drive` alive, and its wheels still where that fails.

Each watches the one before it: the arbiter stops the wheels where no command comes, a thread where the loop that
takes the commands is stuck, and another process (`motorcade.link.driving.guard`) where this one is killed or frozen,
for a board that needs it.
"""

import asyncio
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from types import TracebackType

from motorcade.link.driving.drive import Drive
from motorcade.link.driving.guard import Guard

_BEAT_MS = 50


class Watchdog:
    """A thread that stops the wheels where the loop is stuck; use it as a context manager."""

    def __init__(self, drive: Drive) -> None:
        self._drive = drive
        self._ended = threading.Event()
        self._telling = threading.Lock()
        self._thread = threading.Thread(target=self._watch, name="drive watchdog", daemon=True)
        rescue = drive.rescue
        self._guard = Guard(rescue, drive.failsafe_ms) if rescue else None
        if self._guard:
            # Or a process that freezes at once would freeze before its guard knew.
            drive.ask_before_moving(self._tell_guard)

    def __enter__(self) -> None:
        self._thread.start()

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self._thread.join()
        try:
            self._drive.close()
        finally:
            if self._guard:
                self._guard.dismiss()

    def _watch(self) -> None:
        rest_ms = 0
        while not self._ended.wait(min(rest_ms, _BEAT_MS) / 1000):
            try:
                rest_ms = self._drive.watch()
                self._tell_guard()
            except OSError as problem:
                rest_ms = _BEAT_MS
                self._drive.fail(problem)

    def _tell_guard(self) -> None:
        # What is told last has to be what was so last, whoever tells it.
        with self._telling:
            if self._guard:
                self._guard.beat(self._drive.moves)


@asynccontextmanager
async def kept(drive: Drive) -> AsyncIterator[None]:
    """Beats while the block runs, watched over; however it ends, the wheels then stand still, the board closed."""
    drive.beat()
    with Watchdog(drive):
        beating = asyncio.ensure_future(_beat(drive))
        try:
            yield
        finally:
            beating.cancel()


async def _beat(drive: Drive) -> None:
    while True:
        await asyncio.sleep(min(drive.beat(), _BEAT_MS) / 1000)
