"""Keeps a `motorcade.drive.session.Drive` alive, and its wheels still where that fails.

A thread lets the arbiter stop the wheels in time where no command comes, and stops them where the loop that takes the
commands is stuck. Another process (`motorcade.drive.safety.motor_guard`) stops them where this process, or that thread,
is killed or frozen, for a board that needs it.

The loop has no clock to mind: waiting for a socket with one took a twentieth of a command's way.
"""

import asyncio
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from types import TracebackType

from motorcade.drive.safety.motor_guard import MotorGuard
from motorcade.drive.session import CarControl

_BEAT_MS = 50


class Watchdog:
    """A thread that asks the loop for signs of life; use it as a context manager.

    Args:
        drive: the car.
        loop: what takes its commands.
    """

    def __init__(self, drive: CarControl, loop: asyncio.AbstractEventLoop) -> None:
        self._drive = drive
        self._loop = loop
        self._is_asked = False
        self._ended = threading.Event()
        self._telling = threading.Lock()
        self._thread = threading.Thread(target=self._watch, name="drive watchdog", daemon=True)
        rescue = drive.rescue
        self._guard = MotorGuard(rescue, drive.failsafe_ms) if rescue else None
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
            # Else a loop that is stuck for long would find many questions.
            if not self._is_asked:
                self._is_asked = True
                self._loop.call_soon_threadsafe(self._answer)

    def _answer(self) -> None:
        self._is_asked = False
        self._drive.beat()

    def _tell_guard(self) -> None:
        # What is told last has to be what was so last, whoever tells it.
        with self._telling:
            if self._guard:
                self._guard.beat(self._drive.moves)


@asynccontextmanager
async def kept(drive: CarControl) -> AsyncIterator[None]:
    """Watched over while the block runs; however it ends, the wheels then stand still, the board closed."""
    drive.beat()
    with Watchdog(drive, asyncio.get_running_loop()):
        yield
