"""Announce an image to a car by a check request (`motorcade.words.request`), and understand the answer."""

from binascii import crc32
from typing import NamedTuple

from motorcade.words.request import CHECK_HEADER, check_request, check_words, held_checksum
from motorcade.words.ticks import elapsed_ms
from motorcade.words.upload import (
    CANT_STORE,
    CHANGED_REQUEST,
    CUT_OFF,
    NOT_EMPTY,
    OTHER_CHECKSUM,
    REFUSED,
    SILENT,
    TOO_LARGE,
    Lines,
    ok_line,
    printable,
    refusal,
)

# Two tries take as long as a boot loader, which opening the port starts on some boards.
ANSWER_WITHIN_MS = 1000

# What may come of a request besides REFUSED and SILENT.
READY = "ready"
TAKEN = "taken"

_REASONS_OF_CARS_WITH_CHECKS = (CUT_OFF, NOT_EMPTY, CHANGED_REQUEST, OTHER_CHECKSUM, CANT_STORE, TOO_LARGE)


class Answer(NamedTuple):
    """The answer to a check request.

    Attributes:
        kind: READY, the car will take the announced image only; REFUSED; TAKEN, the car took the request as an image,
            so it knows no check requests; or SILENT.
        held: where READY, the CRC-32 of the image that the car holds.
        text: where READY, the car's line; where REFUSED, the reason.
    """

    kind: str
    held: int = 0
    text: str = ""


class CheckRequestEnd:
    """Announce an image and understand the answer.

    Args:
        image: its bytes.
        number: 0 to 255, tells requests apart.

    Attributes:
        request: the bytes to send.
    """

    def __init__(self, image: bytes, number: int):
        self.request = check_request(crc32(image), number)
        self._expected = check_words(crc32(image), number)
        self._lines = Lines()
        self._sent_ms: int | None = None
        self._answer: Answer | None = None

    def finish_sending(self, now_ms: int) -> None:
        """Note that the last byte of ``request`` was sent at ``now_ms`` (ticks)."""
        self._sent_ms = now_ms

    def receive_data(self, data: bytes, now_ms: int) -> None:
        """Take the bytes that came by ``now_ms`` (ticks), also none, so that a missing answer is noticed."""
        for line in self._lines.split(data):
            self._answer = self._answer or self._to_answer(line)
        if self._answer is None and self._sent_ms is not None:
            late = elapsed_ms(now_ms, self._sent_ms) >= ANSWER_WITHIN_MS
            self._answer = Answer(SILENT) if late else None

    def answer(self) -> Answer | None:
        """The answer; None while it may still come."""
        return self._answer

    def _to_answer(self, line: bytes) -> Answer | None:
        held = held_checksum(line, self._expected)
        if held is not None:
            return Answer(READY, held, printable(line[line.find(self._expected) :]))
        if ok_line(self.request).strip().lower() in line.lower():
            return Answer(TAKEN)
        reason = refusal(line)
        return None if reason is None else Answer(REFUSED, text=reason)


def knows_no_checks(reasons: list[str]) -> bool:
    """Whether a car that refused several check requests, for ``reasons``, doesn't know them.

    A car that knows them refuses only what was changed on the way: for a reason of its own, or with the word that it
    received instead.
    """
    reason = reasons[0]
    if len(reasons) < 2 or set(reasons) != {reason} or not reason or reason.startswith(_REASONS_OF_CARS_WITH_CHECKS):
        return False
    return "0x" not in reason or f"0x{CHECK_HEADER:08x}" in reason.lower()
