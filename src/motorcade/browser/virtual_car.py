"""The virtual car in a page's worker: the loop of a real car, at the other end of an upload in the same worker."""

from motorcade.browser.storage import BrowserStorage
from motorcade.car.board import Board
from motorcade.car.loop import Car
from motorcade.config.profile import levels_of
from motorcade.service.messages import Port
from motorcade.service.upload_session import UploadSession, check_order
from motorcade.service.world_messages import UploadAnswer, UploadOrder
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


class VirtualUpload:
    """One transfer to or from the virtual car, which is switched on for it. Raises MotorcadeError.

    Args:
        order: the page's request.
        check_number: as in UploadSession.
        storage: holds the car's image.

    Attributes:
        wait_s: after how many seconds `advance` is to be called.
    """

    wait_s = _TICK_S

    def __init__(self, order: UploadOrder, check_number: int, storage: BrowserStorage) -> None:
        self._session = UploadSession(order, check_number)
        self._board = _VirtualBoard(levels_of(check_order(order)), storage)
        self._car = Car(self._board)

    @property
    def is_over(self) -> bool:
        """Whether the transfer has ended; the outcome was the last answer."""
        return self._session.is_over

    def receive(self, data: bytes | None) -> None:
        """Take what the page sends after its order: nothing belongs there, so the transfer ends."""
        self._session.receive(None)

    def advance(self, now_s: float) -> list[bytes | UploadAnswer]:
        """Continue at ``now_s`` (seconds since any moment); return answers for the page."""
        board = self._board
        answers: list[bytes | UploadAnswer] = []
        for each in self._session.advance(now_s):
            if isinstance(each, bytes):
                board.received += each
            else:
                answers.append(each)
        board.time_ms = int(now_s * 1000) & TICKS_MASK
        self._car.tick()
        if board.sent:
            self._session.receive(board.sent)
            board.sent = b""
        return answers
