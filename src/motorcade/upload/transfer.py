"""Whole talks with a car, an upload and a readback, from the first silence to the last try.

Pure: bytes that came and the clock in, bytes to send out. Every carrier of bytes
(a serial port, a page's port, a test) steps the same talk.
"""

from abc import ABC, abstractmethod
from binascii import crc32
from collections.abc import Callable, Generator, Iterator
from typing import NamedTuple, Protocol, TypeVar

from motorcade.errors import Phrase
from motorcade.upload import check_request as asking
from motorcade.upload.check_request import READY, TAKEN, Answer, CheckRequestEnd, knows_no_checks
from motorcade.words import upload
from motorcade.words.ticks import elapsed_ms
from motorcade.words.upload import (
    CANT_STORE,
    IMAGE,
    MISMATCH,
    NOT_VERIFIED,
    READBACK_REQUEST,
    REFUSED,
    SILENCE_MS,
    SILENT,
    VERIFIED,
    Outcome,
    ReadbackEnd,
    UploaderEnd,
)

# How often an image is sent, and how often it is announced before each time.
TRIES = 3
# Before it says anything an uploader is silent for so long that the car forgets what reached it before;
# what would else become the beginning of an image is the rest of an upload that broke off.
SETTLE_MS = SILENCE_MS + 100
# A board that never stops talking is talked to nevertheless.
_LONGEST_SETTLE_MS = 3000
_AHEAD_BYTES = 64
_BITS_A_BYTE = 10

# What the car holds, as far as it has said.
OLD = "old"
NEW = "new"
EITHER = "either"
NEITHER = "neither"
UNKNOWN = "unknown"

# Why there is another try.
ASKS_AGAIN = "asks-again"
SENDS_AGAIN = "sends-again"
READS_AGAIN = "reads-again"


class Retry(NamedTuple):
    """Another try: the ``number``-th of ``of``, and its reason (a key of `motorcade.upload.failures.RETRIES`)."""

    reason: str
    number: int
    of: int


class _Hearing(Protocol):
    def receive_data(self, data: bytes, now_ms: int) -> None: ...


class _Sending(_Hearing, Protocol):
    def finish_sending(self, now_ms: int) -> None: ...


Found = TypeVar("Found")
Steps = Generator[bytes, None, None]


class Transfer(ABC):
    """A talk with a car.

    Attributes:
        outcome: how it ended, None while it goes on.
        holds: what the car holds: OLD, NEW, EITHER of the two, NEITHER, or UNKNOWN; empty where nothing was sent to it.
        rest_ms: how long nothing is to be done unless bytes come.
    """

    def __init__(self, baud: int, retrying: Callable[[Retry], None] = lambda retry: None):
        self.outcome: Outcome | None = None
        self.holds = ""
        self.rest_ms = 0
        self._baud = baud
        self._retrying = retrying
        self._data = b""
        self._now_ms = 0
        self._steps: Iterator[bytes] = self._talk()

    def step(self, data: bytes, now_ms: int) -> bytes:
        """Take the bytes that came by ``now_ms`` (ticks); gives the bytes to send now, often none."""
        self._data, self._now_ms = data, now_ms
        return next(self._steps, b"")

    @abstractmethod
    def _talk(self) -> Steps:
        """The whole talk: yields what to send, and ends with its outcome set."""

    def _hear(self, end: _Hearing, found: Callable[[], Found | None], within_ms: int) -> Generator[bytes, None, Found]:
        """Feed ``end`` until there is something ``found``, which it is within ``within_ms``."""
        begin_ms = self._now_ms
        while (result := found()) is None:
            self.rest_ms = max(1, within_ms - elapsed_ms(self._now_ms, begin_ms))
            yield b""
            end.receive_data(self._data, self._now_ms)
        return result

    def _settle(self) -> Steps:
        begin_ms = quiet_ms = self._now_ms
        while (rest_ms := SETTLE_MS - elapsed_ms(self._now_ms, quiet_ms)) > 0:
            if elapsed_ms(self._now_ms, begin_ms) >= _LONGEST_SETTLE_MS:
                return
            self.rest_ms = rest_ms
            yield b""
            if self._data:
                quiet_ms = self._now_ms

    def _send(self, data: bytes, end: _Sending, sent: Callable[[int], None] = lambda count: None) -> Steps:
        """Send ``data`` as fast as the line carries it, so that the answer's deadline is the line's.

        The operating system would take it all at once, and a pseudo-terminal says at once that it has left.
        """
        begin_ms, count = self._now_ms, 0
        needed_ms = -(-len(data) * _BITS_A_BYTE * 1000 // self._baud)
        while (rest_ms := needed_ms - elapsed_ms(self._now_ms, begin_ms)) > 0 or count < len(data):
            carried = elapsed_ms(self._now_ms, begin_ms) * self._baud // (_BITS_A_BYTE * 1000)
            piece = data[count : carried + _AHEAD_BYTES]
            count += len(piece)
            if piece:
                sent(count)
            ahead_ms = -(-_AHEAD_BYTES * _BITS_A_BYTE * 500 // self._baud)
            self.rest_ms = rest_ms if count == len(data) else ahead_ms
            yield piece
            end.receive_data(self._data, self._now_ms)
        end.finish_sending(self._now_ms)


class ReadbackTransfer(Transfer):
    """Fetches the image that a car holds: the outcome's detail where its kind is IMAGE."""

    def _talk(self) -> Steps:
        for number in range(1, TRIES + 1):
            if number > 1:
                self._retrying(Retry(READS_AGAIN, number, TRIES))
            yield from self._settle()
            end = ReadbackEnd(self._now_ms)
            yield READBACK_REQUEST
            end.receive_data(self._data, self._now_ms)
            outcome = yield from self._hear(end, end.next_event, upload.ANSWER_WITHIN_MS)
            if outcome.kind == IMAGE or is_busy(outcome):
                break
        self.outcome = outcome


class UploadTransfer(Transfer):
    """Sends ``image`` until the car holds it, or says why it can't.

    A car that knows checks is told the checksum first, and takes nothing else then.
    The line keeps the order of its bytes, so what the car answers to an announcement
    tells what became of all that was sent before: nothing else makes `holds` certain.
    To a car that knows no checks the image is sent as it is, and so without ``verify``.

    Args:
        baud: bits a second of the line, ten to a byte.
        number: 0 to 255, another one for each upload, so that a late answer to an earlier one is known.
        sent: hears how many bytes of the image have been sent.
        retrying: hears of each further try.
    """

    def __init__(
        self,
        image: bytes,
        baud: int,
        verify: bool = True,
        number: int = 0,
        sent: Callable[[int], None] = lambda count: None,
        retrying: Callable[[Retry], None] = lambda retry: None,
    ):
        super().__init__(baud, retrying)
        self.holds = OLD
        self._image = image
        self._verify = verify
        self._number = number
        self._sent = sent
        self._held_first = 0
        self._last: Outcome = Outcome(SILENT, "")

    def _talk(self) -> Steps:
        if not self._verify:
            yield from self._settle()
            yield from self._send_image(UNKNOWN)
            self.outcome = Outcome(NOT_VERIFIED, Phrase("sent-not-verified"))
            return
        answer, reasons = yield from self._announce()
        if answer.kind == READY:
            self._held_first = answer.held
            yield from self._send_checked()
        elif answer.kind == TAKEN:
            # An image in which nothing moves.
            self.holds = NEITHER
            yield from self._send_plain()
        elif knows_no_checks(reasons):
            yield from self._send_plain()
        self.outcome = self._last

    def _announce(self) -> Generator[bytes, None, tuple[Answer, list[str]]]:
        """Tell the car what comes until it is ready for that; gives its last answer and all its refusals."""
        answer, reasons = Answer(SILENT), []
        for number in range(1, TRIES + 1):
            if number > 1:
                self._retrying(Retry(ASKS_AGAIN, number, TRIES))
            yield from self._settle()
            end = CheckRequestEnd(self._image, self._number)
            self._number = self._number + 1 & 255
            yield from self._send(end.request, end)
            answer = yield from self._hear(end, end.answer, asking.ANSWER_WITHIN_MS)
            if answer.kind in (READY, TAKEN):
                break
            reasons.append(answer.said)
            self._last = outcome_of(answer)
            if is_busy(self._last):
                break
        return answer, reasons

    def _send_checked(self) -> Steps:
        for number in range(1, TRIES + 1):
            if number > 1:
                self._retrying(Retry(SENDS_AGAIN, number, TRIES))
            outcome = yield from self._send_image(EITHER)
            if outcome.kind == VERIFIED:
                self.holds, self._last = NEW, outcome
                return
            answer, _ = yield from self._announce()
            if answer.kind != READY:
                return
            self._last = self._learned(answer, outcome)
            if self.holds == NEW or CANT_STORE in str(outcome.detail):
                return

    def _learned(self, answer: Answer, outcome: Outcome) -> Outcome:
        """How a try ended after which the car gave ``answer``."""
        if answer.held == crc32(self._image):
            self.holds = NEW
            return Outcome(VERIFIED, answer.said)
        self.holds = OLD if answer.held == self._held_first else NEITHER
        return outcome

    def _send_plain(self) -> Steps:
        held = self.holds
        for number in range(1, TRIES + 1):
            if number > 1:
                self._retrying(Retry(SENDS_AGAIN, number, TRIES))
            yield from self._settle()
            self._last = yield from self._send_image(UNKNOWN)
            if self._last.kind == VERIFIED:
                self.holds = NEW
                return
            if self._last.kind == REFUSED:
                self.holds = held
                return
            held = self.holds = NEITHER if self._last.kind == MISMATCH else UNKNOWN

    def _send_image(self, holds: str) -> Generator[bytes, None, Outcome]:
        """Send the image and await the answer; with the last bytes the car may hold what ``holds`` says."""

        def sent(count: int) -> None:
            if count == len(self._image) or holds == UNKNOWN:
                self.holds = holds
            self._sent(count)

        end = UploaderEnd(self._image, self._verify)
        yield from self._send(self._image, end, sent)
        return (yield from self._hear(end, end.next_event, upload.ANSWER_WITHIN_MS))


def is_busy(outcome: Outcome) -> bool:
    """Whether the car said that it is talking to somebody else."""
    return outcome.kind == REFUSED and str(outcome.detail).startswith("busy")


def outcome_of(answer: Answer) -> Outcome:
    """An unsuccessful answer to a check request as an outcome of the upload."""
    if answer.kind == SILENT:
        return Outcome(SILENT, Phrase("no-answer-within", duration_ms=asking.ANSWER_WITHIN_MS))
    return Outcome(REFUSED, answer.said)
