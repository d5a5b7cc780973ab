"""Announce an image to a car by a check request (`motorcade.words.request`), and understand the answer."""

from binascii import crc32

from motorcade.words.request import CHECK_HEADER, check_request, check_words, held_checksum
from motorcade.words.upload import (
    CANT_STORE,
    CHANGED_REQUEST,
    CUT_OFF,
    NOT_EMPTY,
    OTHER_CHECKSUM,
    TOO_LARGE,
    LineEnd,
    Outcome,
    ok_line,
    printable,
)

# Two tries take as long as a boot loader, which opening the port starts on some boards.
ANSWER_WITHIN_MS = 1000

# What may come of a request besides REFUSED and SILENT: the car will take the announced image only; or it took the
# request as an image, so it knows no check requests.
READY = "ready"
TAKEN = "taken"

_REASONS_OF_CARS_WITH_CHECKS = (CUT_OFF, NOT_EMPTY, CHANGED_REQUEST, OTHER_CHECKSUM, CANT_STORE, TOO_LARGE)


class CheckRequestEnd(LineEnd):
    """Announce an image and understand the answer.

    Args:
        image: its bytes.
        number: 0 to 255, tells requests apart.

    Attributes:
        request: the bytes to send.
        held: the CRC-32 of the image that the car holds, where the answer is READY.
    """

    def __init__(self, image: bytes, number: int):
        super().__init__(ANSWER_WITHIN_MS)
        self.request = check_request(crc32(image), number)
        self.held = 0
        self._expected = check_words(crc32(image), number)

    def _outcome_of(self, line: bytes) -> Outcome | None:
        held = held_checksum(line, self._expected)
        if held is not None:
            self.held = held
            return Outcome(READY, printable(line[line.find(self._expected) :]))
        if ok_line(self.request).strip().lower() in line.lower():
            return Outcome(TAKEN, "")
        return super()._outcome_of(line)


def knows_no_checks(reasons: list[str]) -> bool:
    """Whether a car that refused several check requests, for ``reasons``, doesn't know them.

    A car that knows them refuses only what was changed on the way: for a reason of its own, or with the word that it
    received instead.
    """
    reason = reasons[0]
    if len(reasons) < 2 or set(reasons) != {reason} or not reason or reason.startswith(_REASONS_OF_CARS_WITH_CHECKS):
        return False
    return "0x" not in reason or f"0x{CHECK_HEADER:08x}" in reason.lower()
