"""Keep a car's control alive, and stop the wheels where that fails.

A thread makes the arbiter stop the wheels in time where no command comes, and stops them where the event loop that
takes the commands is stuck. For a board that needs it, another process (`motorcade.drive.motor_guard`) stops
them where this process or that thread is killed or frozen.

The loop sets no timers of its own: a timer while it waits for sockets costs a twentieth of a command's latency.
"""

import asyncio
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from motorcade.car.arbiter import MOVING
from motorcade.drive.motor_guard import MotorGuard, hurry
from motorcade.drive.session import CarControl
from motorcade.words.ticks import elapsed_ms

_BEAT_MS = 50


class Watchdog:
    """A thread that asks ``loop``, which takes a car's commands, for signs of life; use it as a context manager."""

    def __init__(self, control: CarControl, loop: asyncio.AbstractEventLoop) -> None:
        self._control = control
        self._loop = loop
        self._is_asked = False
        self._ended = threading.Event()
        self._writing = threading.Lock()
        self._thread = threading.Thread(target=self._watch, name="drive watchdog", daemon=True)
        rescue = control.board.rescue()
        self._guard = MotorGuard(rescue, control.limits.failsafe_ms) if rescue else None
        if self._guard:
            # So that the guard knows of a movement before the process can freeze in it.
            control.wheels.before_moving = self._beat_guard

    def __enter__(self) -> None:
        self._thread.start()

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()
        try:
            self._control.close()
        finally:
            if self._guard:
                self._guard.dismiss()

    def _watch(self) -> None:
        rest_ms = 0
        if self._guard:
            # On a busy computer the guard would take a process that stops its wheels late for a frozen one.
            hurry()
        while not self._ended.wait(min(rest_ms, _BEAT_MS) / 1000):
            try:
                rest_ms = self._control.watch()
                self._beat_guard()
            except OSError as problem:
                rest_ms = _BEAT_MS
                self._control.fail(problem)
            # At most one call waits, however long the loop is stuck.
            if not self._is_asked:
                self._is_asked = True
                self._loop.call_soon_threadsafe(self._answer)

    def _answer(self) -> None:
        self._is_asked = False
        self._control.beat()

    def _beat_guard(self) -> None:
        # Reading the state and sending it is one step, whichever thread does it: the last that is sent is true.
        with self._writing:
            if self._guard:
                self._guard.beat(not self._control.wheels.is_neutral, self._rest_ms())

    def _rest_ms(self) -> int | None:
        """For how much longer the command counts that moves the wheels; None where none does."""
        arbiter, limits = self._control.arbiter, self._control.limits
        if arbiter.state != MOVING:
            return None
        return limits.failsafe_ms + 1 - elapsed_ms(self._control.clock(), arbiter.commanded_ms)


@asynccontextmanager
async def watched(control: CarControl) -> AsyncIterator[None]:
    """Watch over a car while the block runs; however it ends, the wheels then stand still and the board is closed."""
    control.beat()
    with Watchdog(control, asyncio.get_running_loop()):
        yield
