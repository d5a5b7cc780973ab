"""A car that is driven, served on free ports by an event loop of its own, and its board, which records setpoints."""

import asyncio
import socket
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from typing import Any

from motorcade.config.profile import Profile
from motorcade.drive.channels import Clients
from motorcade.drive.listener import bind
from motorcade.drive.server import serving, watched
from motorcade.drive.session import CarControl
from motorcade.timing import monotonic_ms
from support.mock_board import CLASSROOM, MockDriveBoard
from support.waiting import DEADLINE_S

# Cars with long time limits for a busy machine: STEADY for a late loop of the car, PATIENT for late drivers too.
STEADY = replace(CLASSROOM, drive=replace(CLASSROOM.drive, watchdog_ms=8000))
PATIENT = replace(CLASSROOM, drive=replace(STEADY.drive, failsafe_ms=9000, hand_over_ms=60_000))


class DrivenCar:
    """``with DrivenCar() as car``: its ``port`` and ``telemetry_port``, its ``board``, ``drive`` and ``server``.

    It has a thread for itself, so that a test may block, freeze or flood its own.
    """

    def __init__(
        self,
        tls: Any = None,
        byte_order: str = "big",
        profile: Profile | None = None,
        revoked: Any = None,
        port: int = 0,
    ) -> None:
        self.profile = profile or CLASSROOM
        self.board = MockDriveBoard()
        self.control = CarControl(self.board, monotonic_ms, self.profile)
        self.server = Clients(self.control, byte_order, revoked)
        self.port, self.telemetry_port = port, 0
        self._tls = tls
        self._loop = asyncio.new_event_loop()
        self._ended = asyncio.Event()
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> "DrivenCar":
        self._thread.start()
        assert self._ready.wait(DEADLINE_S), "the car didn't start"
        return self

    def __exit__(self, *problem: object) -> None:
        self._loop.call_soon_threadsafe(self._ended.set)
        self._thread.join(DEADLINE_S)
        assert not self._thread.is_alive(), "the car didn't end"

    @contextmanager
    def stuck(self) -> Iterator[None]:
        """Keep its loop stuck."""
        begun, ended = threading.Event(), threading.Event()

        def hang() -> None:
            begun.set()
            ended.wait()

        self._loop.call_soon_threadsafe(hang)
        assert begun.wait(DEADLINE_S), "the loop was stuck before"
        try:
            yield
        finally:
            ended.set()

    def _run(self) -> None:
        # A runner lets the loop close the sockets of those who were dropped last.
        with asyncio.Runner(loop_factory=lambda: self._loop) as runner:
            runner.run(self._serve())

    async def _serve(self) -> None:
        with ExitStack() as stack:
            sockets = [stack.enter_context(bind("127.0.0.1", port)) for port in (self.port, 0)]
            self.port, self.telemetry_port = (each.getsockname()[1] for each in sockets)
            async with watched(self.control), serving(self.server, sockets[0], sockets[1], self._tls):
                self._ready.set()
                await self._ended.wait()


@contextmanager
def deaf_port() -> Iterator[int]:
    """A port that is taken, and at which no server listens."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        yield taken.getsockname()[1]
