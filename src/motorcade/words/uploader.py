"""The computer's end of a serial upload or a readback: it takes bytes and the time, and says how it ended.

It opens no port. `motorcade.words.upload` is the car's end, and describes the protocol.
"""

from collections import namedtuple

from motorcade.errors import Phrase
from motorcade.words.image import announced_words, check_header, parse_image_bytes
from motorcade.words.packing import WORD_BYTES, ImageError, unpack
from motorcade.words.ticks import elapsed_ms
from motorcade.words.upload import ANSWER_WITHIN_MS, IMAGE, REFUSED, answer_within_ms, ok_line

_LONGEST_LINE = 200

# The outcomes, besides REFUSED.
VERIFIED = "verified"
NOT_VERIFIED = "not verified"
MISMATCH = "mismatch"
SILENT = "silent"

Outcome = namedtuple("Outcome", ("kind", "detail"))
"""How an upload or a readback ended.

``kind`` is one of the kinds above, REFUSED, or IMAGE for a readback; ``detail`` a Phrase, what the car answered
(text), or the image's bytes.
"""


def refusal(line: bytes) -> str | None:
    """Return the reason in an ERR line of a car, None where ``line`` is no such line."""
    at = line.find(b"ERR ")
    # After readable text it is a message of the board itself; after noise it is an answer.
    if at == 0 or (at > 0 and not 32 <= line[at - 1] < 127):
        return printable(line[at + 4 :])
    return None


class LineEnd:
    """What waits on a computer for the line with which a car answers bytes.

    Send the bytes, call ``finish_sending``, then pass on what comes back until there is an outcome.

    Args:
        within_ms: within how long after the last byte the answer is due.

    Attributes:
        outcome: the Outcome; None while the answer may come.
    """

    def __init__(self, within_ms: int) -> None:
        self.outcome: Outcome | None = None
        self._within_ms = within_ms
        self._line = b""
        self._sent_ms: int | None = None

    def finish_sending(self, now_ms: int) -> None:
        """Note that the last byte was sent at ``now_ms``: the answer of the car is due from then on."""
        self._sent_ms = now_ms

    def receive_data(self, data: bytes, now_ms: int) -> None:
        """Take bytes that came back by ``now_ms``; call it with ``b""`` so that it notices a missing answer."""
        lines = (self._line + data).split(b"\n")
        # Of a very long line the end counts.
        self._line = lines.pop()[-_LONGEST_LINE:]
        for line in lines:
            if self.outcome is None:
                self.outcome = self._outcome_of(line[-_LONGEST_LINE:])
        if self.outcome is None and self._sent_ms is not None and elapsed_ms(now_ms, self._sent_ms) >= self._within_ms:
            self.outcome = Outcome(SILENT, Phrase("no-answer-within", duration_ms=self._within_ms))

    def _outcome_of(self, line: bytes) -> Outcome | None:
        """Return what the car answers by a line; None where it is no answer. A subclass adds to refusals."""
        reason = refusal(line)
        return None if reason is None else Outcome(REFUSED, reason)


class UploaderEnd(LineEnd):
    """The end of an uploader: it reads the answer of the car to ``image`` (bytes)."""

    def __init__(self, image: bytes) -> None:
        super().__init__(answer_within_ms(image))
        self._expected = printable(ok_line(image)[:-1])

    def _outcome_of(self, line: bytes) -> Outcome | None:
        at = line.find(b"OK words=")
        refused = super()._outcome_of(line)
        if refused or at < 0:
            return refused
        answer = printable(line[at:].strip())
        if answer.lower() == self._expected.lower():
            return Outcome(VERIFIED, answer)
        return Outcome(MISMATCH, Phrase("other-answer", answer=answer, expected=self._expected))


class ReadbackEnd:
    """The end of a reader: it reads the bytes that follow READBACK_REQUEST. The Outcome's detail is the image."""

    def __init__(self, now_ms: int) -> None:
        self.outcome: Outcome | None = None
        self._buffer = b""
        self._last_ms = now_ms

    def receive_data(self, data: bytes, now_ms: int) -> None:
        """Take bytes that came by ``now_ms``; call it with ``b""`` so that it notices a missing answer."""
        if self.outcome is not None:
            return
        if data:
            self._buffer += data
            self._last_ms = now_ms
            self._advance()
        elif elapsed_ms(now_ms, self._last_ms) >= ANSWER_WITHIN_MS:
            if self._buffer:
                phrase = Phrase("car-stopped-after", count=len(self._buffer))
            else:
                phrase = Phrase("no-answer-within", duration_ms=ANSWER_WITHIN_MS)
            self.outcome = Outcome(SILENT, phrase)

    def _advance(self) -> None:
        if self._buffer[:4] == b"ERR ":
            if b"\n" in self._buffer:
                self.outcome = Outcome(REFUSED, printable(self._buffer[4 : self._buffer.find(b"\n")]))
            return
        if len(self._buffer) < WORD_BYTES:
            return
        try:
            header = unpack(self._buffer[:WORD_BYTES])
            check_header(header)
            length = announced_words(header) * WORD_BYTES
            if len(self._buffer) >= length:
                parse_image_bytes(self._buffer[:length])
                self.outcome = Outcome(IMAGE, self._buffer[:length])
        except ImageError as error:
            self.outcome = Outcome(REFUSED, Phrase("readback-is-no-image", reason=error))


def printable(line: bytes) -> str:
    """Return ``line`` as ASCII text; other bytes, which come from noise, become question marks."""
    return "".join([chr(byte) if 32 <= byte < 127 else "?" for byte in line]).strip()
