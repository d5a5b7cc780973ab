"""An upload or a readback through a port that the page opened, or with a simulated car: without I/O.

Bytes and time come in, bytes and answers go out.
"""

from collections.abc import Callable

from motorcade.car.board import Board
from motorcade.car.loop import Car
from motorcade.config.profile import Profile, built_in_profile, levels_of
from motorcade.errors import MotorcadeError, Phrase, TransferError
from motorcade.service import world_messages
from motorcade.service.messages import ErrorAnswer, Port, sentences
from motorcade.service.world_messages import Outcome, UploadAnswer, UploadOrder
from motorcade.upload.transfer import (
    ReadbackTransfer,
    Transfer,
    UploadTransfer,
    holds_phrase,
    readback_error,
    upload_error,
)
from motorcade.words.image import parse_image_bytes
from motorcade.words.ticks import TICKS_MASK

# The port of the simulated car.
VIRTUAL_PORT = Port("virtual", "", "virtual")
# The name of the page's own port in messages.
WEB_SERIAL = "Web Serial"
# No car sends more bytes; if more arrive, the port has another device.
_MOST_BYTES = 1 << 16
_READ_S = 0.02
# As the loop of a car on a computer.
_TICK_S = 0.004


class UploadSession:
    """One transfer through a port of the page's. Raises MotorcadeError where the order isn't valid.

    Args:
        order: the page's request.
        check_number: a random number from 0 to 255 that distinguishes this upload from others.

    Attributes:
        is_over: whether the transfer has ended; the outcome was the last answer.
    """

    def __init__(self, order: UploadOrder, check_number: int) -> None:
        self.is_over = False
        self._order = order
        self._out: list[bytes | UploadAnswer] = []
        self._data = b""
        self._count = 0
        self._transfer = transfer_of(order, check_number, lambda progress: self._out.append(progress))

    @property
    def wait_s(self) -> float:
        """After how many seconds without bytes `advance` is to be called."""
        return min(self._transfer.rest_ms / 1000, _READ_S)

    def receive(self, data: bytes | None) -> None:
        """Store bytes from the port for `advance`; None: the page has closed the port."""
        if data is None or self._count + len(data) > _MOST_BYTES:
            holds = holds_phrase(self._transfer.holds)
            self._end(failed(TransferError("went-away", port=WEB_SERIAL, holds=holds)))
            return
        self._count += len(data)
        self._data += data

    def advance(self, now_s: float) -> list[bytes | UploadAnswer]:
        """Continue at ``now_s`` (seconds since any moment); return bytes for the port and answers for the page."""
        if not self.is_over:
            data, self._data = self._data, b""
            to_port = self._transfer.step(data, int(now_s * 1000) & TICKS_MASK)
            if self._transfer.outcome is not None:
                self._end(outcome_of(self._order, self._transfer, WEB_SERIAL))
            elif to_port:
                self._out.append(to_port)
        out, self._out = self._out, []
        return out

    def _end(self, outcome: Outcome) -> None:
        if not self.is_over:
            self._out.append(outcome)
        self.is_over = True


class _VirtualBoard(Board):
    """A leader without wheels and lights."""

    is_leader = True

    def __init__(
        self, levels: tuple[int, ...], load: Callable[[], bytes | None], store: Callable[[bytes], None]
    ) -> None:
        self.levels = levels
        self.time_ms = 0
        self.received = self.sent = b""
        self._load, self._store = load, store

    def now_ms(self) -> int:
        return self.time_ms

    def load_image(self) -> bytes | None:
        return self._load()

    def store_image(self, data: bytes) -> None:
        self._store(data)

    def read_serial(self) -> bytes:
        received, self.received = self.received, b""
        return received

    def write_serial(self, data: bytes) -> None:
        self.sent += data


class VirtualCarSession(UploadSession):
    """One transfer with a simulated leader, which is switched on for it. Raises what `UploadSession` raises.

    Args:
        order, check_number: as `UploadSession` takes them.
        load: returns the image that the car holds; None for none.
        store: stores a new image. Raises OSError.
    """

    def __init__(
        self,
        order: UploadOrder,
        check_number: int,
        load: Callable[[], bytes | None],
        store: Callable[[bytes], None],
    ) -> None:
        super().__init__(order, check_number)
        self._board = _VirtualBoard(levels_of(check_order(order)), load, store)
        self._car = Car(self._board)

    @property
    def wait_s(self) -> float:
        return _TICK_S

    def receive(self, data: bytes | None) -> None:
        """End the transfer: nothing of the page is for this car."""
        super().receive(None)

    def advance(self, now_s: float) -> list[bytes | UploadAnswer]:
        """Continue both ends at ``now_s``; return answers for the page. Raises what ``load`` raises."""
        out = super().advance(now_s)
        self._board.received += b"".join(message for message in out if isinstance(message, bytes))
        self._board.time_ms = int(now_s * 1000) & TICKS_MASK
        self._car.tick()
        if self._board.sent:
            super().receive(self._board.sent)
            self._board.sent = b""
        return [message for message in out if not isinstance(message, bytes)]


def check_order(order: UploadOrder) -> Profile:
    """Check an order; return its profile. Raises MotorcadeError where the order isn't valid."""
    if (order.image is None) != order.readback:
        raise MotorcadeError("bad-message", reason="give either an image or readback")
    if order.image is not None:
        parse_image_bytes(order.image)
    return built_in_profile(order.profile)


def transfer_of(order: UploadOrder, check_number: int, put: Callable[[world_messages.Progress], None]) -> Transfer:
    """Return the transfer of an order; ``put`` is given its progress. Raises MotorcadeError where it isn't valid.

    ``check_number`` as `UploadSession` takes it.
    """
    baud, image = check_order(order).serial.baud, order.image
    if image is None:
        return ReadbackTransfer(baud)
    size = len(image)

    def tell(sent: int, notice: world_messages.RetryNotice | None = None) -> None:
        put(world_messages.Progress(sent, size, notice))

    def tell_retry(retry: Phrase) -> None:
        tell(0, world_messages.RetryNotice(**retry.details, sentence=sentences(retry)))

    return UploadTransfer(image, baud, order.verify, check_number, tell, tell_retry)


def outcome_of(order: UploadOrder, transfer: Transfer, port: str) -> Outcome:
    """Return the outcome of a transfer that has ended; errors call the port ``port``."""
    outcome = transfer.outcome
    assert outcome is not None
    if order.readback:
        failure = readback_error(port, outcome)
        if failure:
            return failed(failure)
        return world_messages.ImageRead(bytes(outcome.detail))
    if failure := upload_error(port, outcome, transfer.holds):
        return failed(failure)
    if order.verify:
        return world_messages.Verified(str(outcome.detail))
    return world_messages.NotVerified()


def failed(problem: MotorcadeError, port: str = "") -> world_messages.Failed:
    """Return the outcome for an error; ``port`` replaces the name of the port in its sentence."""
    if port and "port" in problem.details:
        problem.details["port"] = port
    return world_messages.Failed(ErrorAnswer(**problem.to_dict("page")))
