"""A line for uploads to a car whose thread ticks only when a test allows it."""

import threading
from collections import deque

from motorcade.boards.lines import WaitingLine
from support.waiting import DEADLINE_S


class PacedLine(WaitingLine):
    """Takes uploads, and holds the car's thread before each tick until the test allows the tick."""

    def __init__(self) -> None:
        self.sent: deque[bytes] = deque()
        self.answered = b""
        self.problem: Exception | None = None
        self._changed = threading.Condition()
        self._allowed = 0.0
        self._waits = False

    def wait(self, seconds: float) -> None:
        """Called by the car's thread before each tick."""
        with self._changed:
            self._waits = True
            self._changed.notify_all()
            assert self._changed.wait_for(lambda: self._allowed, DEADLINE_S)
            self._waits = False
            self._allowed -= 1
        if self.problem:
            raise self.problem

    def allow(self, ticks: float) -> None:
        """Let the car's thread tick so many times more, without waiting for it."""
        with self._changed:
            self._allowed += ticks
            self._changed.notify_all()

    def tick(self) -> None:
        """Let the car's thread tick once, and wait until it has."""
        with self._changed:
            self._allowed += 1
            self._changed.notify_all()
            assert self._changed.wait_for(lambda: self._waits and not self._allowed, DEADLINE_S)

    def read(self) -> bytes:
        return self.sent.popleft() if self.sent else b""

    def write(self, data: bytes) -> None:
        self.answered += data
