"""A car that is driven, served on free ports by an event loop of its own, and its board, which records setpoints."""

import asyncio
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from typing import Any

from motorcade.car.drive_board import DriveBoard
from motorcade.config.profile import Profile, built_in_profile
from motorcade.drive.channels import Clients
from motorcade.drive.listener import bind
from motorcade.drive.server import serving, watched
from motorcade.drive.session import CarControl
from motorcade.timing import monotonic_ms
from motorcade.words.formats import SWITCHES
from support.waiting import DEADLINE_S

NEUTRAL = (90, 1, 0)
CLASSROOM = built_in_profile("classroom")
# Cars with long time limits for a busy machine: STEADY for a late loop of the car, PATIENT for late drivers too.
STEADY = replace(CLASSROOM, drive=replace(CLASSROOM.drive, watchdog_ms=8000))
PATIENT = replace(CLASSROOM, drive=replace(STEADY.drive, failsafe_ms=9000, hand_over_ms=60_000))


class NotedBoard(DriveBoard):
    """Record each setpoint with its time, ``(seconds of the clock, (angle, direction, speed))``, and the switches."""

    switches = tuple(each.name for each in SWITCHES)

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self._clock = clock
        self.notes: list[tuple[float, tuple[int, int, int]]] = []
        self.switched: list[tuple[str, bool]] = []

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        self.notes.append((self._clock(), (angle_deg, direction, speed)))

    def neutral(self) -> None:
        self.notes.append((self._clock(), NEUTRAL))

    def set_switch(self, name: str, is_on: bool) -> None:
        self.switched.append((name, is_on))

    @property
    def setpoint(self) -> tuple[int, int, int]:
        """The last setpoint."""
        return self.notes[-1][1]

    @property
    def moves(self) -> bool:
        return self.setpoint[2] > 0

    def was_told(self, setpoint: tuple[int, int, int], since: int = 0) -> bool:
        """Whether this setpoint came, after the first ``since`` records."""
        return any(each == setpoint for _, each in self.notes[since:])

    def has_moved(self, since: int = 0) -> bool:
        """Whether the wheels have turned, after the first ``since`` records."""
        return any(setpoint[2] for _, setpoint in self.notes[since:])


class DrivenCar:
    """``with DrivenCar() as car``: its ``port`` and ``telemetry_port``, its ``board``, ``drive`` and ``server``.

    It has a thread for itself, so that a test may block, freeze or flood its own.
    """

    def __init__(
        self, tls: Any = None, byte_order: str = "big", profile: Profile | None = None, revoked: Any = None
    ) -> None:
        self.profile = profile or CLASSROOM
        self.board = NotedBoard()
        self.control = CarControl(self.board, monotonic_ms, self.profile)
        self.server = Clients(self.control, byte_order, revoked)
        self.port = self.telemetry_port = 0
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
            sockets = [stack.enter_context(bind("127.0.0.1", 0)) for _ in range(2)]
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
