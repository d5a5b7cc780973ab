"""Serial upload, both ends: bytes and the clock in, events out; no port is touched here.

Portable: the car's end runs on a microcontroller. An image carries its own
length in its header, and the car answers one ASCII line:
``OK words=<n> crc32=<8 hex>`` or ``ERR <reason>``. The uploader compares the
CRC-32 (zlib's) with its own.
"""

from binascii import crc32
from collections import namedtuple

from motorcade.words.image import (
    WORD_BYTES,
    ImageError,
    announced_words,
    check_header,
    pack,
    parse_image_bytes,
    unpack,
)
from motorcade.words.ticks import elapsed_ms

SILENCE_MS = 500
ANSWER_WITHIN_MS = 2000
READBACK_HEADER = 0x000000FF
READBACK_REQUEST = pack(READBACK_HEADER)
_LONGEST_LINE = 200

# What a car's end reports.
IMAGE = "image"
READBACK = "readback"
REFUSED = "refused"
# What an uploader's end reports besides REFUSED.
VERIFIED = "verified"
NOT_VERIFIED = "not verified"
MISMATCH = "mismatch"
SILENT = "silent"

CarEvent = namedtuple("CarEvent", ("kind", "image", "answer"))
"""What the car's shell does next.

IMAGE: store ``image`` (bytes), then send ``answer``. READBACK: send the stored
image's bytes. REFUSED: send ``answer``; the stored image stays.
"""

Outcome = namedtuple("Outcome", ("kind", "detail"))
"""How an upload or a readback ended: one of the kinds above, and a sentence or the image's bytes."""


def ok_line(image: bytes) -> bytes:
    """The car's answer to an image that it holds now."""
    return f"OK words={len(image) // WORD_BYTES} crc32={crc32(image):08x}\n".encode()


def error_line(reason: str) -> bytes:
    """The car's answer to bytes that it doesn't take; ``reason`` is one ASCII line."""
    return f"ERR {reason}\n".encode()


class CarEnd:
    """What a car does with the bytes from its serial port."""

    def __init__(self) -> None:
        self._buffer = b""
        self._skipping = False
        self._last_byte_ms = 0
        self._events: list[CarEvent] = []

    def receive_data(self, data: bytes, now_ms: int) -> None:
        """Take bytes that came at ``now_ms``; call it with ``b""`` now and then so that silence is noticed."""
        if elapsed_ms(now_ms, self._last_byte_ms) >= SILENCE_MS:
            self._reset()
        if not data:
            return
        self._last_byte_ms = now_ms
        if not self._skipping:
            self._buffer += data
            self._advance()

    def next_event(self) -> CarEvent | None:
        """The next CarEvent, or None."""
        return self._events.pop(0) if self._events else None

    def _reset(self) -> None:
        if self._buffer:
            self._refuse(f"cut off after {len(self._buffer)} bytes")
        self._buffer = b""
        self._skipping = False

    def _advance(self) -> None:
        while len(self._buffer) >= WORD_BYTES and not self._skipping:
            header = unpack(self._buffer[:WORD_BYTES])
            if header == READBACK_HEADER:
                self._buffer = self._buffer[WORD_BYTES:]
                self._events.append(CarEvent(READBACK, b"", b""))
                continue
            try:
                check_header(header)
                length = announced_words(header) * WORD_BYTES
                if len(self._buffer) < length:
                    return
                image = self._buffer[:length]
                parse_image_bytes(image)
            except ImageError as error:
                self._refuse(str(error))
                self._buffer = b""
                # Where one word is wrong the rest can't be trusted to begin at a
                # word; silence is the only mark that the next image has.
                self._skipping = True
                return
            self._buffer = self._buffer[length:]
            self._events.append(CarEvent(IMAGE, image, ok_line(image)))

    def _refuse(self, reason: str) -> None:
        self._events.append(CarEvent(REFUSED, b"", error_line(reason)))


class UploaderEnd:
    """What an uploader makes of the car's answer to ``image`` (bytes).

    Send ``image``, call ``finish_sending``, then feed what comes back until
    ``next_event`` gives the Outcome.
    """

    def __init__(self, image: bytes, verify: bool = True) -> None:
        self.image = image
        self._verify = verify
        self._line = b""
        self._sent_ms: int | None = None
        self._outcome: Outcome | None = None
        self._told = False

    def finish_sending(self, now_ms: int) -> None:
        """The last byte left at ``now_ms``: from here on the car's answer is due."""
        self._sent_ms = now_ms
        if not self._verify and self._outcome is None:
            self._outcome = Outcome(NOT_VERIFIED, "sent, not verified")

    def receive_data(self, data: bytes, now_ms: int) -> None:
        """Take bytes that came back by ``now_ms``; ``b""`` lets a missing answer be noticed."""
        for i in range(len(data)):
            byte = data[i : i + 1]
            if byte == b"\n":
                self._take_line(self._line)
                self._line = b""
            else:
                self._line = (self._line + byte)[-_LONGEST_LINE:]
        if self._outcome is not None or self._sent_ms is None:
            return
        if elapsed_ms(now_ms, self._sent_ms) >= ANSWER_WITHIN_MS:
            self._outcome = Outcome(SILENT, f"no answer within {ANSWER_WITHIN_MS} ms")

    def next_event(self) -> Outcome | None:
        """The Outcome, once, or None while it is open."""
        if self._outcome is None or self._told:
            return None
        self._told = True
        return self._outcome

    def _take_line(self, line: bytes) -> None:
        if self._outcome is not None:
            return
        at = line.find(b"ERR ")
        if at == 0 or (at > 0 and not 32 <= line[at - 1] < 127):
            # Behind other text it is a board's own message; behind noise it is an answer.
            self._outcome = Outcome(REFUSED, _printable(line[at + 4 :]))
            return
        at = line.find(b"OK words=")
        if at < 0:
            return
        answer = line[at:].strip()
        if answer.lower() == ok_line(self.image).strip().lower():
            self._outcome = Outcome(VERIFIED, _printable(answer))
        else:
            expected = _printable(ok_line(self.image).strip())
            self._outcome = Outcome(MISMATCH, f"the car answered '{_printable(answer)}', expected '{expected}'")


class ReadbackEnd:
    """What a reader makes of the bytes that follow READBACK_REQUEST; its Outcome's detail is the image."""

    def __init__(self, now_ms: int) -> None:
        self._buffer = b""
        self._last_ms = now_ms
        self._outcome: Outcome | None = None
        self._told = False

    def receive_data(self, data: bytes, now_ms: int) -> None:
        """Take bytes that came by ``now_ms``; ``b""`` lets a missing answer be noticed."""
        if self._outcome is not None:
            return
        if data:
            self._buffer += data
            self._last_ms = now_ms
            self._advance()
        elif elapsed_ms(now_ms, self._last_ms) >= ANSWER_WITHIN_MS:
            if self._buffer:
                sentence = f"the car stopped after {len(self._buffer)} bytes"
            else:
                sentence = f"no answer within {ANSWER_WITHIN_MS} ms"
            self._outcome = Outcome(SILENT, sentence)

    def next_event(self) -> Outcome | None:
        """The Outcome, once, or None while it is open."""
        if self._outcome is None or self._told:
            return None
        self._told = True
        return self._outcome

    def _advance(self) -> None:
        if self._buffer[:4] == b"ERR ":
            if b"\n" in self._buffer:
                self._outcome = Outcome(REFUSED, _printable(self._buffer[4 : self._buffer.find(b"\n")]))
            return
        if len(self._buffer) < WORD_BYTES:
            return
        try:
            header = unpack(self._buffer[:WORD_BYTES])
            check_header(header)
            length = announced_words(header) * WORD_BYTES
            if len(self._buffer) >= length:
                parse_image_bytes(self._buffer[:length])
                self._outcome = Outcome(IMAGE, self._buffer[:length])
        except ImageError as error:
            self._outcome = Outcome(REFUSED, f"what came back is no image: {error}")


def _printable(line: bytes) -> str:
    """ASCII text of ``line``; bytes that noise put there become question marks."""
    return "".join([chr(byte) if 32 <= byte < 127 else "?" for byte in line]).strip()
