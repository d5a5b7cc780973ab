"""Upload an image to a car, or read it back, from the first silence to the last try.

Pure: received bytes and the clock in, bytes to send out. Whatever carries the bytes (a serial port, a page's port, a
test) steps the same transfer.
"""

import re
from abc import ABC, abstractmethod
from binascii import crc32
from collections.abc import Callable, Generator, Iterator

from motorcade.errors import MotorcadeError, Phrase, TransferError
from motorcade.words import upload
from motorcade.words.image import refused_image
from motorcade.words.packing import WORD_BYTES
from motorcade.words.request import CHECK_HEADER, check_request, check_words, held_checksum
from motorcade.words.ticks import elapsed_ms
from motorcade.words.uploader import (
    MISMATCH,
    NOT_VERIFIED,
    SILENT,
    VERIFIED,
    LineEnd,
    Outcome,
    ReadbackEnd,
    UploaderEnd,
    printable,
)

# How often an image is sent, and how often it is announced before each time.
TRIES = 3
# An uploader is silent for so long before it begins that the car's receiver resets; the rest of an upload that broke
# off would else become the beginning of the image.
SETTLE_MS = upload.SILENCE_MS + 100
# Opening the port restarts an Arduino, whose boot loader swallows what comes for up to 2 s. Where the car answers, a
# further try is enough.
BOOT_MS = 2100
# A board that never stops sending gets the upload nevertheless.
_LONGEST_SETTLE_MS = 3000
_AHEAD_BYTES = 64
_BITS_A_BYTE = 10
# Two tries take as long as a boot loader, which opening the port starts on some boards.
CHECKED_WITHIN_MS = 1000

# What may come of a check request besides REFUSED and SILENT: the car will take the announced image only; or it took
# the request as an image, so it knows no check requests.
READY = "ready"
TAKEN = "taken"
_REASONS_OF_CARS_WITH_CHECKS = (
    upload.CUT_OFF,
    upload.NOT_EMPTY,
    upload.CHANGED_REQUEST,
    upload.OTHER_CHECKSUM,
    upload.CANT_STORE,
    upload.TOO_LARGE,
)

# What the car holds, as far as its answers tell.
OLD = "old"
NEW = "new"
EITHER = "either"
NEITHER = "neither"
UNKNOWN = "unknown"

# What may come of a whole transfer besides: the board runs something else, as what it sends shows.
FOREIGN = "foreign"
# So much of what came last is kept to tell that.
_HEARD_BYTES = 400
_LONGEST_SHOWN = 60
# What may stand in a damaged answer of a car.
_SIGNS_OF_A_CAR = (b"OK ", b"ERR ", b"words=", b"crc32=", b"check=", b"holds=")
# What programs of other boards send, and the phrase that names each.
_OTHER_PROGRAMS = (
    (re.compile(rb">>> ?|MicroPython v|CircuitPython"), "board-python"),
    (re.compile(rb"echo:|Marlin|\bok T:|^start\s", re.MULTILINE), "board-printer"),
    (re.compile(rb"\$G[A-Z]{4},"), "board-gps"),
    (re.compile(rb"rst:0x|ets [A-Z][a-z]{2} "), "board-boot-loader"),
)

# Why there is another try: the keys of phrases, whose details are the ``number`` of the try, and ``of`` how many.
ASKS_AGAIN = "upload-asks-again"
SENDS_AGAIN = "upload-sends-again"
READS_AGAIN = "upload-reads-again"


class CheckRequestEnd(LineEnd):
    """Announce an image by a check request (`motorcade.words.request`), and understand the answer.

    The outcome is READY with the car's line, REFUSED with the reason, TAKEN or SILENT.

    Args:
        image: its bytes.
        number: 0 to 255, tells requests apart.

    Attributes:
        request: the bytes to send.
        held: the CRC-32 of the image that the car holds, where the answer is READY.
    """

    def __init__(self, image: bytes, number: int):
        super().__init__(CHECKED_WITHIN_MS)
        self.request = check_request(crc32(image), number)
        self.held = 0
        self._expected = check_words(crc32(image), number)

    def _outcome_of(self, line: bytes) -> Outcome | None:
        held = held_checksum(line, self._expected)
        if held is not None:
            self.held = held
            return Outcome(READY, printable(line[line.find(self._expected) :]))
        if upload.ok_line(self.request).strip().lower() in line.lower():
            return Outcome(TAKEN, "")
        return super()._outcome_of(line)


Steps = Generator[bytes, None, None]


class Transfer(ABC):
    """One upload or readback.

    Args:
        baud: bits a second of the line, ten to a byte; 0 for a connection of a network, which carries bytes as fast
            as it can, and whose first upload need not wait until the car's receiver resets.
        retrying: called before each further try, with its reason.

    Attributes:
        outcome: how it ended; None while it goes on.
        holds: what the car holds: OLD, NEW, EITHER of the two, NEITHER, or UNKNOWN; empty where nothing was sent to it.
        rest_ms: how long there is nothing to do unless bytes come.
    """

    def __init__(self, baud: int, retrying: Callable[[Phrase], None] = lambda retry: None):
        self.outcome: Outcome | None = None
        self.holds = ""
        self.rest_ms = 0
        self._baud = baud
        self._retrying = retrying
        self._has_settled = False
        self._data = b""
        self._now_ms = 0
        self._heard = b""
        self._steps: Iterator[bytes] = self._run()

    def step(self, data: bytes, now_ms: int) -> bytes:
        """Take the bytes that came by ``now_ms`` (ticks). Returns the bytes to send now, often none."""
        self._data = data
        self._now_ms = now_ms
        self._heard = (self._heard + data)[-_HEARD_BYTES:]
        return next(self._steps, b"")

    def _or_foreign(self, outcome: Outcome) -> Outcome:
        """Return FOREIGN in place of an outcome without an answer where something else than a car has sent text."""
        program = other_program(self._heard)
        if program is None:
            return outcome
        return Outcome(FOREIGN, program)

    @abstractmethod
    def _run(self) -> Steps:
        """Run the transfer: yield what to send, and set the outcome at the end."""

    def _tries(self, reason: str) -> Iterator[int]:
        """Yield the number of each try; tell of each further one."""
        for number in range(1, TRIES + 1):
            if number > 1:
                self._retrying(Phrase(reason, number=number, of=TRIES))
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
        begin_ms = self._now_ms
        count = 0
        # A network takes all at once.
        ahead_bytes = len(data)
        needed_ms = 0
        if self._baud:
            ahead_bytes = _AHEAD_BYTES
            needed_ms = -(-len(data) * _BITS_A_BYTE * 1000 // self._baud)
        while (rest_ms := needed_ms - elapsed_ms(self._now_ms, begin_ms)) > 0 or count < len(data):
            due_bytes = elapsed_ms(self._now_ms, begin_ms) * self._baud // (_BITS_A_BYTE * 1000)
            piece = data[count : due_bytes + ahead_bytes]
            count += len(piece)
            if piece:
                sent(count)
            self.rest_ms = rest_ms
            if count < len(data):
                self.rest_ms = -(-_AHEAD_BYTES * _BITS_A_BYTE * 500 // self._baud)
            yield piece
            end.receive_data(self._data, self._now_ms)
        end.finish_sending(self._now_ms)


class ReadbackTransfer(Transfer):
    """Read back the image that a car holds: the outcome's detail where its kind is IMAGE."""

    def _run(self) -> Steps:
        for _ in self._tries(READS_AGAIN):
            yield from self._settle(SETTLE_MS)
            end = ReadbackEnd(self._now_ms)
            yield upload.READBACK_REQUEST
            end.receive_data(self._data, self._now_ms)
            outcome = yield from self._receive(end, upload.ANSWER_WITHIN_MS)
            if outcome.kind == upload.IMAGE or is_busy(outcome):
                break
        if outcome.kind != upload.IMAGE:
            outcome = self._or_foreign(outcome)
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
        retrying: Callable[[Phrase], None] = lambda retry: None,
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
        elif _knows_no_checks(reasons):
            yield from self._send_plain()
        self.outcome = self._last
        if answer.kind == SILENT and self._last.kind == SILENT:
            self.outcome = self._or_foreign(self._last)

    def _announce(self) -> Generator[bytes, None, tuple[Outcome, list[str]]]:
        """Announce the image until the car is ready for it. Returns its last answer and the reasons of all refusals."""
        reasons = []
        for _ in self._tries(ASKS_AGAIN):
            yield from self._settle(SETTLE_MS)
            end = CheckRequestEnd(self._image, self._number)
            self._number = self._number + 1 & 255
            yield from self._send(end.request, end)
            answer = yield from self._receive(end, CHECKED_WITHIN_MS)
            if answer.kind in (READY, TAKEN):
                self._held = end.held
                break
            if answer.kind == upload.REFUSED:
                reasons.append(str(answer.detail))
            else:
                reasons.append("")
            self._last = answer
            if is_busy(self._last):
                break
        return answer, reasons

    def _send_checked(self) -> Steps:
        held_first = self._held
        for _ in self._tries(SENDS_AGAIN):
            outcome = yield from self._send_image(EITHER)
            if outcome.kind == VERIFIED:
                self.holds = NEW
                self._last = outcome
                return
            answer, _ = yield from self._announce()
            if answer.kind != READY:
                return
            if self._held == crc32(self._image):
                self.holds = NEW
                self._last = Outcome(VERIFIED, answer.detail)
                return
            self._last = outcome
            self.holds = NEITHER
            if self._held == held_first:
                self.holds = OLD
            if upload.CANT_STORE in str(outcome.detail) or self._is_too_large(outcome):
                return

    def _is_too_large(self, outcome: Outcome) -> bool:
        """Whether the car refused the image because it can't hold that many words."""
        if outcome.kind != upload.REFUSED:
            return False
        error = refused_image(str(outcome.detail))
        words = len(self._image) // WORD_BYTES
        return error is not None and error.code == upload.TOO_LARGE and error.details["words"] == words

    def _send_plain(self) -> Steps:
        held = self.holds
        for _ in self._tries(SENDS_AGAIN):
            yield from self._settle(SETTLE_MS)
            self._last = yield from self._send_image(UNKNOWN)
            if self._last.kind == VERIFIED:
                self.holds = NEW
                return
            if self._last.kind == upload.REFUSED:
                self.holds = held
                return
            self.holds = UNKNOWN
            if self._last.kind == MISMATCH:
                self.holds = NEITHER
            held = self.holds

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


def other_program(heard: bytes) -> Phrase | None:
    """Return what the board that sent these bytes runs, if it is no car; None where that isn't known."""
    if any(sign in heard for sign in _SIGNS_OF_A_CAR):
        return None
    for pattern, key in _OTHER_PROGRAMS:
        if pattern.search(heard):
            return Phrase(key)
    # The first and the last one may be cut.
    text = max(heard.split(b"\n"), key=len).strip()
    letters = sum(32 <= byte < 127 for byte in text)
    # A wrong baud rate makes noise of text.
    if letters < 3 or letters < len(text):
        return None
    return Phrase("board-sends", text=printable(text[:_LONGEST_SHOWN]))


def _knows_no_checks(reasons: list[str]) -> bool:
    """Whether a car that refused several check requests, for ``reasons``, doesn't know them.

    A car that knows them refuses only what was changed on the way: for a reason of its own, or with the word that it
    received instead.
    """
    reason = reasons[0]
    if len(reasons) < 2 or set(reasons) != {reason} or not reason or reason.startswith(_REASONS_OF_CARS_WITH_CHECKS):
        return False
    return "0x" not in reason or f"0x{CHECK_HEADER:08x}" in reason.lower()


def is_busy(outcome: Outcome) -> bool:
    """Whether the car refused because of another uploader."""
    return outcome.kind == upload.REFUSED and str(outcome.detail).startswith("busy")


def upload_error(port: str, outcome: Outcome, holds: str, in_network: bool = False) -> MotorcadeError | None:
    """The error for `Transfer.outcome` and `Transfer.holds` of an upload; None where it succeeded.

    ``in_network``: the car is reached without a cable and a baud rate.
    """
    kind, detail = outcome
    if kind == FOREIGN:
        return TransferError("runs-something-else", port=port, what=detail)
    if kind == SILENT:
        code = "no-answer-at-address" if in_network else "no-answer"
        return TransferError(code, port=port, detail=detail, holds=holds_phrase(holds))
    if kind == MISMATCH or (kind == upload.REFUSED and str(detail).startswith(upload.OTHER_CHECKSUM)):
        return TransferError("mismatch", port=port, detail=detail, holds=holds_phrase(holds))
    if kind != upload.REFUSED:
        return None
    if is_busy(outcome):
        # The other upload will replace the image that the car has.
        return TransferError("car-busy", port=port, holds=holds_phrase("" if holds == OLD else holds))
    return TransferError("refused", port=port, detail=refused_image(str(detail)) or detail, holds=holds_phrase(holds))


def readback_error(port: str, outcome: Outcome) -> MotorcadeError | None:
    """The error for a readback's outcome; None where it succeeded."""
    kind, detail = outcome
    if kind == upload.IMAGE:
        return None
    if kind == FOREIGN:
        return TransferError("runs-something-else", port=port, what=detail)
    if kind == SILENT:
        return TransferError("nothing-to-read", port=port, detail=detail)
    if is_busy(outcome):
        return TransferError("car-busy", port=port, holds="")
    return TransferError("no-image", port=port, detail=detail)


def holds_phrase(holds: str) -> Phrase | str:
    """The sentence for what the car holds after a failure; empty where nothing was sent to it."""
    if not holds:
        return ""
    return Phrase(f"car-holds-{holds}")
