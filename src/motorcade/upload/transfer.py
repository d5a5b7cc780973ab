"""Upload an image to a car, or read it back, from the first silence to the last try.

Pure: received bytes and the clock in, bytes to send out. Whatever carries the bytes (a serial port, a page's port, a
test) steps the same transfer.
"""

from abc import ABC, abstractmethod
from binascii import crc32
from collections.abc import Callable, Generator, Iterator
from typing import NamedTuple

from motorcade.errors import MotorcadeError, Phrase
from motorcade.upload import check_request
from motorcade.upload.check_request import READY, TAKEN, CheckRequestEnd, knows_no_checks
from motorcade.words import upload
from motorcade.words.image import WORD_BYTES, refused_image
from motorcade.words.ticks import elapsed_ms
from motorcade.words.upload import (
    CANT_STORE,
    IMAGE,
    MISMATCH,
    NOT_VERIFIED,
    OTHER_CHECKSUM,
    READBACK_REQUEST,
    REFUSED,
    SILENCE_MS,
    SILENT,
    TOO_LARGE,
    VERIFIED,
    LineEnd,
    Outcome,
    ReadbackEnd,
    UploaderEnd,
)

# How often an image is sent, and how often it is announced before each time.
TRIES = 3
# An uploader is silent for so long before it begins that the car's receiver resets; the rest of an upload that broke
# off would else become the beginning of the image.
SETTLE_MS = SILENCE_MS + 100
# Opening the port restarts an Arduino, whose boot loader swallows what comes for up to 2 s. Where the car answers, a
# further try is enough.
BOOT_MS = 2100
# A board that never stops sending gets the upload nevertheless.
_LONGEST_SETTLE_MS = 3000
_AHEAD_BYTES = 64
_BITS_A_BYTE = 10

# What the car holds, as far as its answers tell.
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
    """Another try: the ``number``-th of ``of``, and its reason: ASKS_AGAIN, SENDS_AGAIN or READS_AGAIN."""

    reason: str
    number: int
    of: int

    def sentence(self, language: str = "en") -> str:
        """A sentence for the user, in ``language``."""
        return Phrase(f"upload-{self.reason}", number=self.number, of=self.of).sentence(language)


Steps = Generator[bytes, None, None]


class Transfer(ABC):
    """One upload or readback.

    Args:
        baud: bits a second of the line, ten to a byte; 0 for a connection of a network, which carries bytes as fast
            as it can, and whose first upload need not wait until the car's receiver resets.
        retrying: called before each further try.

    Attributes:
        outcome: how it ended; None while it goes on.
        holds: what the car holds: OLD, NEW, EITHER of the two, NEITHER, or UNKNOWN; empty where nothing was sent to it.
        rest_ms: how long there is nothing to do unless bytes come.
    """

    def __init__(self, baud: int, retrying: Callable[[Retry], None] = lambda retry: None):
        self.outcome: Outcome | None = None
        self.holds = ""
        self.rest_ms = 0
        self._baud = baud
        self._retrying = retrying
        self._has_settled = False
        self._data = b""
        self._now_ms = 0
        self._steps: Iterator[bytes] = self._run()

    def step(self, data: bytes, now_ms: int) -> bytes:
        """Take the bytes that came by ``now_ms`` (ticks). Returns the bytes to send now, often none."""
        self._data, self._now_ms = data, now_ms
        return next(self._steps, b"")

    @abstractmethod
    def _run(self) -> Steps:
        """Run the transfer: yield what to send, and set the outcome at the end."""

    def _tries(self, reason: str) -> Iterator[int]:
        """Yield the number of each try; tell of each further one."""
        for number in range(1, TRIES + 1):
            if number > 1:
                self._retrying(Retry(reason, number, TRIES))
            yield number

    def _receive(self, end: LineEnd | ReadbackEnd, within_ms: int) -> Generator[bytes, None, Outcome]:
        """Give received bytes to ``end`` until it has an outcome, at the latest after ``within_ms``."""
        begin_ms = self._now_ms
        while (result := end.outcome) is None:
            self.rest_ms = max(1, within_ms - elapsed_ms(self._now_ms, begin_ms))
            yield b""
            end.receive_data(self._data, self._now_ms)
        return result

    def _settle(self, settle_ms: int) -> Steps:
        if not (self._baud or self._has_settled):
            self._has_settled = True
            return
        begin_ms = quiet_ms = self._now_ms
        while (rest_ms := settle_ms - elapsed_ms(self._now_ms, quiet_ms)) > 0:
            if elapsed_ms(self._now_ms, begin_ms) >= _LONGEST_SETTLE_MS:
                return
            self.rest_ms = rest_ms
            yield b""
            if self._data:
                quiet_ms = self._now_ms

    def _send(self, data: bytes, end: LineEnd, sent: Callable[[int], None] = lambda count: None) -> Steps:
        """Send ``data`` as fast as the line carries it, so that the answer's deadline counts from its end.

        The operating system takes it all at once, and a pseudo-terminal reports at once that it has been sent.
        """
        begin_ms, count = self._now_ms, 0
        if not self._baud:
            sent(len(data))
            yield data
            end.receive_data(self._data, self._now_ms)
            end.finish_sending(self._now_ms)
            return
        needed_ms = -(-len(data) * _BITS_A_BYTE * 1000 // self._baud)
        while (rest_ms := needed_ms - elapsed_ms(self._now_ms, begin_ms)) > 0 or count < len(data):
            due_bytes = elapsed_ms(self._now_ms, begin_ms) * self._baud // (_BITS_A_BYTE * 1000)
            piece = data[count : due_bytes + _AHEAD_BYTES]
            count += len(piece)
            if piece:
                sent(count)
            ahead_ms = -(-_AHEAD_BYTES * _BITS_A_BYTE * 500 // self._baud)
            self.rest_ms = rest_ms if count == len(data) else ahead_ms
            yield piece
            end.receive_data(self._data, self._now_ms)
        end.finish_sending(self._now_ms)


class ReadbackTransfer(Transfer):
    """Read back the image that a car holds: the outcome's detail where its kind is IMAGE."""

    def _run(self) -> Steps:
        for _ in self._tries(READS_AGAIN):
            yield from self._settle(SETTLE_MS)
            end = ReadbackEnd(self._now_ms)
            yield READBACK_REQUEST
            end.receive_data(self._data, self._now_ms)
            outcome = yield from self._receive(end, upload.ANSWER_WITHIN_MS)
            if outcome.kind == IMAGE or is_busy(outcome):
                break
        self.outcome = outcome


class UploadTransfer(Transfer):
    """Send an image until the car holds it or refuses it.

    A car that knows check requests gets the checksum first, and then takes no other image. The line keeps the order
    of its bytes, so the car's answer to an announcement shows what became of all that was sent before it; nothing
    else makes ``holds`` certain. A car that knows no check requests gets the image as it is, and so does any car
    without ``verify``.

    Args:
        image: its bytes.
        baud: bits a second of the line, ten to a byte.
        verify: whether to wait for the car's answer.
        number: 0 to 255, another one for each upload, so that a late answer to an earlier one is recognized.
        sent: called with the number of bytes of the image that have been sent.
        retrying: called before each further try.
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
        # The checksum of the image that the car holds, by its last answer.
        self._held = 0
        self._last: Outcome = Outcome(SILENT, "")

    def _run(self) -> Steps:
        if not self._verify:
            yield from self._settle(BOOT_MS)
            self.outcome = yield from self._send_image(UNKNOWN)
            return
        answer, reasons = yield from self._announce()
        if answer.kind == READY:
            yield from self._send_checked()
        elif answer.kind == TAKEN:
            # The car took the request as an image in which nothing moves.
            self.holds = NEITHER
            yield from self._send_plain()
        elif knows_no_checks(reasons):
            yield from self._send_plain()
        self.outcome = self._last

    def _announce(self) -> Generator[bytes, None, tuple[Outcome, list[str]]]:
        """Announce the image until the car is ready for it. Returns its last answer and the reasons of all refusals."""
        reasons = []
        for _ in self._tries(ASKS_AGAIN):
            yield from self._settle(SETTLE_MS)
            end = CheckRequestEnd(self._image, self._number)
            self._number = self._number + 1 & 255
            yield from self._send(end.request, end)
            answer = yield from self._receive(end, check_request.ANSWER_WITHIN_MS)
            if answer.kind in (READY, TAKEN):
                self._held = end.held
                break
            reasons.append(str(answer.detail) if answer.kind == REFUSED else "")
            self._last = answer
            if is_busy(self._last):
                break
        return answer, reasons

    def _send_checked(self) -> Steps:
        held_first = self._held
        for _ in self._tries(SENDS_AGAIN):
            outcome = yield from self._send_image(EITHER)
            if outcome.kind == VERIFIED:
                self.holds, self._last = NEW, outcome
                return
            answer, _ = yield from self._announce()
            if answer.kind != READY:
                return
            if self._held == crc32(self._image):
                self.holds, self._last = NEW, Outcome(VERIFIED, answer.detail)
                return
            self.holds, self._last = OLD if self._held == held_first else NEITHER, outcome
            if CANT_STORE in str(outcome.detail) or self._is_too_large(outcome):
                return

    def _is_too_large(self, outcome: Outcome) -> bool:
        """Whether the car refused the image because it can't hold that many words."""
        error = refused_image(str(outcome.detail)) if outcome.kind == REFUSED else None
        words = len(self._image) // WORD_BYTES
        return error is not None and error.code == TOO_LARGE and error.details["words"] == words

    def _send_plain(self) -> Steps:
        held = self.holds
        for _ in self._tries(SENDS_AGAIN):
            yield from self._settle(SETTLE_MS)
            self._last = yield from self._send_image(UNKNOWN)
            if self._last.kind == VERIFIED:
                self.holds = NEW
                return
            if self._last.kind == REFUSED:
                self.holds = held
                return
            held = self.holds = NEITHER if self._last.kind == MISMATCH else UNKNOWN

    def _send_image(self, holds: str) -> Generator[bytes, None, Outcome]:
        """Send the image and wait for the answer; from the last bytes on the car may hold what ``holds`` tells."""

        def sent(count: int) -> None:
            if count == len(self._image) or holds == UNKNOWN:
                self.holds = holds
            self._sent(count)

        end = UploaderEnd(self._image)
        yield from self._send(self._image, end, sent)
        if not self._verify:
            return Outcome(NOT_VERIFIED, Phrase("sent-not-verified"))
        return (yield from self._receive(end, upload.answer_within_ms(self._image)))


def is_busy(outcome: Outcome) -> bool:
    """Whether the car refused because of another uploader."""
    return outcome.kind == REFUSED and str(outcome.detail).startswith("busy")


def upload_error(port: str, outcome: Outcome, holds: str) -> MotorcadeError | None:
    """The error for `Transfer.outcome` and `Transfer.holds` of an upload; None where it succeeded."""
    kind, detail = outcome
    if kind == SILENT:
        return MotorcadeError("no-answer", port=port, detail=detail, holds=holds_phrase(holds))
    if kind == MISMATCH or (kind == REFUSED and str(detail).startswith(OTHER_CHECKSUM)):
        return MotorcadeError("mismatch", port=port, detail=detail, holds=holds_phrase(holds))
    if kind != REFUSED:
        return None
    if is_busy(outcome):
        # The other upload will replace the image that the car has.
        return MotorcadeError("car-busy", port=port, holds=holds_phrase("" if holds == OLD else holds))
    return MotorcadeError("refused", port=port, detail=refused_image(str(detail)) or detail, holds=holds_phrase(holds))


def readback_error(port: str, outcome: Outcome) -> MotorcadeError | None:
    """The error for a readback's outcome; None where it succeeded."""
    kind, detail = outcome
    if kind == IMAGE:
        return None
    if kind == SILENT:
        return MotorcadeError("nothing-to-read", port=port, detail=detail)
    if is_busy(outcome):
        return MotorcadeError("car-busy", port=port, holds="")
    return MotorcadeError("no-image", port=port, detail=detail)


def holds_phrase(holds: str) -> Phrase | str:
    """The sentence for what the car holds after a failure; empty where nothing was sent to it."""
    return Phrase(f"car-holds-{holds}") if holds else ""
