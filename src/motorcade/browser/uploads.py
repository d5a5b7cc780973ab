"""Uploads of a page: through a serial port that the page has opened, or to the virtual car in its worker."""

import os
from collections.abc import Callable
from typing import Any

from motorcade.browser.storage import BrowserStorage
from motorcade.car.board import Board
from motorcade.car.loop import Car
from motorcade.config.profile import levels_of
from motorcade.errors import MotorcadeError
from motorcade.service.messages import Port, decode
from motorcade.service.upload_session import UploadSession, check_order, failed
from motorcade.service.world_messages import UploadOrder
from motorcade.words.ticks import TICKS_MASK

VIRTUAL_PORT = Port("virtual", "", "virtual")
# As the simulated car of a computer.
_TICK_S = 0.004


class _VirtualBoard(Board):
    """A leader without wheels and lights, whose store is the browser's."""

    is_leader = True

    def __init__(self, levels: tuple[int, ...], storage: BrowserStorage) -> None:
        self.levels = levels
        self.time_ms = 0
        self.received = b""
        self.sent = b""
        self._storage = storage

    def now_ms(self) -> int:
        return self.time_ms

    def load_image(self) -> bytes | None:
        return self._storage.car_image()

    def store_image(self, data: bytes) -> None:
        self._storage.store_car_image(data)

    def read_serial(self) -> bytes:
        received, self.received = self.received, b""
        return received

    def write_serial(self, data: bytes) -> None:
        self.sent += data


class UploadStream:
    """One transfer: the order first, then the bytes of a port that the page has opened.

    Args:
        clock: seconds since any moment.
        storage: what the virtual car holds, where the transfer is with that car, which is switched on for it; None for
            a port of the page.
    """

    def __init__(self, clock: Callable[[], float], storage: BrowserStorage | None) -> None:
        self._clock = clock
        self._storage = storage
        self._session: UploadSession | None = None
        self._board: _VirtualBoard | None = None
        self._is_over = False

    def receive(self, data: str | bytes) -> list[Any]:
        """Take the order, or bytes of the port; return what is to be sent. Raises MotorcadeError."""
        if self._is_over:
            return []
        if self._session is None:
            self._begin(decode(data, UploadOrder))
        else:
            # A text isn't for the port, and nothing of the page is for the virtual car: the page is faulty.
            self._session.receive(data if isinstance(data, bytes) and self._board is None else None)
        return self.advance()

    def _begin(self, order: UploadOrder) -> None:
        if self._storage is not None:
            if order.port != VIRTUAL_PORT.port:
                raise MotorcadeError("no-such-port", port=order.port)
            self._board = _VirtualBoard(levels_of(check_order(order)), self._storage)
            self._car = Car(self._board)
        self._session = UploadSession(order, os.urandom(1)[0])

    def advance(self) -> list[Any]:
        """Do what is due; return what is to be sent."""
        if self._session is None:
            return []
        now_s = self._clock()
        answers: list[Any] = list(self._session.advance(now_s))
        self._is_over = self._session.is_over
        if self._board:
            self._board.received += b"".join(each for each in answers if isinstance(each, bytes))
            self._board.time_ms = int(now_s * 1000) & TICKS_MASK
            self._car.tick()
            if self._board.sent:
                self._session.receive(self._board.sent)
                self._board.sent = b""
            answers = [each for each in answers if not isinstance(each, bytes)]
        return answers

    def wait_s(self) -> float | None:
        """After how many seconds `advance` is to be called; None: not before the next message."""
        if self._session is None or self._is_over:
            return None
        return _TICK_S if self._board else self._session.wait_s

    def refuse(self, problem: MotorcadeError) -> Any:
        """End the transfer; return the message that tells the page an error."""
        self._is_over = True
        return failed(problem)
