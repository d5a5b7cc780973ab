"""Serve one car at two ports, commands at one, telemetry and requests at the other; and keep its control alive.

A thread makes the arbiter stop the wheels in time where no command comes, and stops them where the event loop that
takes the commands is stuck. For a board that needs it, another process (`motorcade.drive.motor_guard`) stops
them where this process or that thread is killed or frozen.

The loop sets no timers of its own: a timer while it waits for sockets costs a twentieth of a command's latency.
"""

import asyncio
import socket
import ssl
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial

from motorcade.car.arbiter import MOVING
from motorcade.drive.channels import PERIOD_S, Clients, CommandChannel, TelemetryChannel
from motorcade.drive.listener import Listener
from motorcade.drive.motor_guard import MotorGuard, hurry
from motorcade.drive.session import CarControl
from motorcade.words.ticks import elapsed_ms

_REVOKED_EVERY_S = 0.5
_BEAT_MS = 50


async def _send_telemetry(clients: Clients) -> None:
    """Send telemetry to every channel, ten times a second, until cancelled."""
    loop = asyncio.get_running_loop()
    while True:
        if not clients.channels:
            clients.has_channels.clear()
            await clients.has_channels.wait()
        begin_s = loop.time()
        telemetry = clients.control.telemetry()._asdict()
        for channel in list(clients.channels):
            channel.end_period(telemetry)
        await asyncio.sleep(max(0.0, begin_s + PERIOD_S - loop.time()))


async def _check_revoked(clients: Clients) -> None:
    """Look for newly revoked keys twice a second, until cancelled; a list that can't be read is a fault."""
    revoked, has_changed = clients.revoked, True
    while revoked:
        if has_changed and revoked.problem:
            clients.control.fail(revoked.problem, stops=False)
        for channel in [*clients.commands, *clients.channels]:
            channel.check_keys()
        await asyncio.sleep(_REVOKED_EVERY_S)
        # The file may be on a slow card.
        has_changed = await asyncio.to_thread(revoked.reload)


@asynccontextmanager
async def serving(
    clients: Clients, commands: socket.socket, telemetry: socket.socket, tls: ssl.SSLContext | None = None
) -> AsyncIterator[tuple[Listener, Listener]]:
    """Accept clients at two listening sockets while the block runs; then drop all of them."""

    def turn_away() -> None:
        clients.control.turned_away += 1

    listeners = (
        Listener(commands, partial(CommandChannel, clients), turn_away, tls),
        Listener(telemetry, partial(TelemetryChannel, clients), turn_away, tls),
    )
    tasks = [asyncio.ensure_future(listener.serve()) for listener in listeners]
    tasks += [asyncio.ensure_future(job(clients)) for job in (_send_telemetry, _check_revoked)]
    try:
        yield listeners
    finally:
        for listener in listeners:
            listener.close_to_newcomers()
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        for listener in listeners:
            listener.drop_all()


class Watchdog:
    """A thread that asks ``loop``, which takes a car's commands, for signs of life; use it as a context manager."""

    def __init__(self, control: CarControl, loop: asyncio.AbstractEventLoop) -> None:
        self._control = control
        self._loop = loop
        self._is_asked = False
        self._ended = threading.Event()
        self._writing = threading.Lock()
        self._thread = threading.Thread(target=self._watch, name="drive watchdog", daemon=True)
        self._guard: MotorGuard | None = None
        if rescue := control.board.rescue():
            self._guard = MotorGuard(rescue, control.limits.failsafe_ms)
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
