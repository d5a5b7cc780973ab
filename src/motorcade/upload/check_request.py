"""What an uploader makes of the car's answer to a check request (`motorcade.words.check`)."""

from binascii import crc32
from typing import NamedTuple

from motorcade.words.check import CHECK_HEADER, check_request, check_words, held_checksum
from motorcade.words.ticks import elapsed_ms
from motorcade.words.upload import (
    CANT_STORE,
    CHANGED_REQUEST,
    CUT_OFF,
    NOT_EMPTY,
    OTHER_CHECKSUM,
    REFUSED,
    SILENT,
    Lines,
    ok_line,
    printable,
    refusal,
)

# Two tries take as long as a board's boot loader, which an opened port starts on some.
ANSWER_WITHIN_MS = 1000

# What may come of a request besides REFUSED and SILENT.
READY = "ready"
TAKEN = "taken"

_SAID_BY_CARS_THAT_KNOW = (CUT_OFF, NOT_EMPTY, CHANGED_REQUEST, OTHER_CHECKSUM, CANT_STORE)


class Answer(NamedTuple):
    """What came of a request.

    READY: the car will take the announced image only, and holds one with the
    CRC-32 ``held``; ``said`` is its line. REFUSED: ``said`` is the reason. TAKEN: it
    took the request for an image, so it knows no checks. SILENT: no answer.
    """

    kind: str
    held: int = 0
    said: str = ""


class CheckRequestEnd:
    """Announces ``image`` to a car and understands its answer; ``number`` (0 to 255) tells requests apart."""

    def __init__(self, image: bytes, number: int):
        self.request = check_request(crc32(image), number)
        self._expected = check_words(crc32(image), number)
        self._lines = Lines()
        self._sent_ms: int | None = None
        self._answer: Answer | None = None

    def finish_sending(self, now_ms: int) -> None:
        """The last byte of ``request`` left at ``now_ms``."""
        self._sent_ms = now_ms

    def receive_data(self, data: bytes, now_ms: int) -> None:
        """Take bytes that came back by ``now_ms``; ``b""`` lets a missing answer be noticed."""
        for line in self._lines.split(data):
            self._answer = self._answer or self._understood(line)
        if self._answer is None and self._sent_ms is not None:
            late = elapsed_ms(now_ms, self._sent_ms) >= ANSWER_WITHIN_MS
            self._answer = Answer(SILENT) if late else None

    def answer(self) -> Answer | None:
        """What came of the request, None while that is open."""
        return self._answer

    def _understood(self, line: bytes) -> Answer | None:
        held = held_checksum(line, self._expected)
        if held is not None:
            return Answer(READY, held, printable(line[line.find(self._expected) :]))
        if ok_line(self.request).strip().lower() in line.lower():
            return Answer(TAKEN)
        reason = refusal(line)
        return None if reason is None else Answer(REFUSED, said=reason)


def knows_no_checks(reasons: list[str]) -> bool:
    """Whether a car that refused several requests, for ``reasons``, doesn't know what they are.

    A car that does know refuses only what was changed on the way, for reasons of
    its own or with the word that it got instead.
    """
    reason = reasons[0]
    if len(reasons) < 2 or set(reasons) != {reason} or not reason or reason.startswith(_SAID_BY_CARS_THAT_KNOW):
        return False
    return "0x" not in reason or f"0x{CHECK_HEADER:08x}" in reason.lower()
