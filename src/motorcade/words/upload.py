"""Both ends of a serial upload, the computer and the car: they take bytes and the time, and return events.

They open no port. Portable: the end of the car runs on a microcontroller. The header of an image
contains its length, and the car answers with one ASCII line:
``OK words=<n> crc32=<8 hex>`` or ``ERR <reason>``. The uploader compares the
CRC-32 (zlib's) with its own. A check request (`motorcade.words.check`) before
an image makes the car compare it too, before it replaces the image that it has.
"""

from binascii import crc32
from collections import namedtuple

from motorcade.errors import Phrase
from motorcade.words.check import CHECK_BYTES, CHECK_HEADER, CHECK_LASTS_MS, check_words, read_check
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
# The image of a car that never received one.
NO_PROGRAM = pack(0)
# The beginnings of the reasons for which a car refuses bytes. Another reason is the brief form of an ImageError.
CUT_OFF = "cut off after"
NOT_EMPTY = "the empty image has"
CHANGED_REQUEST = "the check request was changed"
OTHER_CHECKSUM = "the checksum is"
CANT_STORE = "the image could not be stored"
_LONGEST_LINE = 200

# The events of the end of a car.
IMAGE = "image"
READBACK = "readback"
CHECK = "check"
REFUSED = "refused"
# The outcomes of the end of an uploader, besides REFUSED.
VERIFIED = "verified"
NOT_VERIFIED = "not verified"
MISMATCH = "mismatch"
SILENT = "silent"

CarEvent = namedtuple("CarEvent", ("kind", "image", "answer"))
"""What the caller of a CarEnd has to do.

IMAGE: store ``image`` (bytes), then send ``answer``. READBACK: send the stored
image's bytes. CHECK: send `motorcade.words.check.ready_line` of ``answer`` and the
stored image. REFUSED: send ``answer`` and keep the stored image. Before the first
image is stored, the stored image is NO_PROGRAM.
"""

Outcome = namedtuple("Outcome", ("kind", "detail"))
"""How an upload or a readback ended.

``kind`` is one of the kinds above; ``detail`` a Phrase, what the car answered (text), or the image's bytes.
"""


def ok_line(image: bytes) -> bytes:
    """Return the answer of a car to an image that it holds now."""
    return f"OK words={len(image) // WORD_BYTES} crc32={crc32(image):08x}\n".encode()


def error_line(reason: str) -> bytes:
    """Return the answer of a car to bytes that it refuses; ``reason`` is one ASCII line."""
    return f"ERR {reason}\n".encode()


class CarEnd:
    """The end of a car: it finds images and requests in the bytes from a serial port."""

    def __init__(self) -> None:
        self._buffer = b""
        self._skipping = False
        self._last_byte_ms = 0
        # The checksum that was announced for the next image; None while any may come.
        self._announced: int | None = None
        self._events: list[CarEvent] = []

    def receive_data(self, data: bytes, now_ms: int) -> None:
        """Take bytes that came at ``now_ms``; call it with ``b""`` from time to time so that it notices silence."""
        quiet_ms = elapsed_ms(now_ms, self._last_byte_ms)
        if quiet_ms >= SILENCE_MS:
            self._end_by_silence()
        if quiet_ms >= CHECK_LASTS_MS:
            self._announced = None
        if not data:
            return
        self._last_byte_ms = now_ms
        if not self._skipping:
            self._buffer += data
            self._advance()

    def next_event(self) -> CarEvent | None:
        """Return the next CarEvent, or None."""
        return self._events.pop(0) if self._events else None

    def _end_by_silence(self) -> None:
        if self._buffer == NO_PROGRAM and self._announced is None:
            self._events.append(CarEvent(IMAGE, NO_PROGRAM, ok_line(NO_PROGRAM)))
        elif self._buffer:
            self._refuse(f"{CUT_OFF} {len(self._buffer)} bytes")
        self._buffer = b""
        self._skipping = False

    def _advance(self) -> None:
        goes_on = True
        while goes_on and len(self._buffer) >= WORD_BYTES:
            header = unpack(self._buffer[:WORD_BYTES])
            try:
                if header == READBACK_HEADER:
                    self._take(WORD_BYTES)
                    self._events.append(CarEvent(READBACK, b"", b""))
                elif header == CHECK_HEADER:
                    goes_on = self._take_check()
                else:
                    goes_on = self._take_image(header)
            except ImageError as error:
                goes_on = self._refuse_until_silence(error.brief())

    def _take_check(self) -> bool:
        """Take a check request from the buffer. Return True where it was complete and valid."""
        if len(self._buffer) < CHECK_BYTES:
            return False
        found = read_check(self._take(CHECK_BYTES))
        if found is None:
            return self._refuse_until_silence(f"{CHANGED_REQUEST} on the way")
        self._announced = found[0]
        self._events.append(CarEvent(CHECK, b"", check_words(found[0], found[1])))
        return True

    def _take_image(self, header: int) -> bool:
        """Take an image from the buffer. Return True where it was complete and more may follow it."""
        check_header(header)
        length = announced_words(header) * WORD_BYTES
        here = len(self._buffer)
        if here < length:
            return False
        if header == 0 and self._announced is None:
            # A break or a loose cable makes zeros. So four zeros are an image only between two silences.
            if here > length:
                return self._refuse_until_silence(f"{NOT_EMPTY} {length} bytes, {here} are here")
            return False
        image = self._buffer[:length]
        parse_image_bytes(image)
        if self._announced is not None and crc32(image) != self._announced:
            return self._refuse_until_silence(
                f"{OTHER_CHECKSUM} {crc32(image):08x}, {self._announced:08x} was announced"
            )
        self._events.append(CarEvent(IMAGE, image, ok_line(image)))
        if self._announced is None:
            self._take(length)
            return True
        # What follows an announced image was not announced.
        self._announced = None
        self._skip()
        return False

    def _take(self, count: int) -> bytes:
        data = self._buffer[:count]
        self._buffer = self._buffer[count:]
        return data

    def _skip(self) -> None:
        self._buffer = b""
        self._skipping = True

    def _refuse_until_silence(self, reason: str) -> bool:
        """Refuse what is in the buffer and everything up to the next silence. Return False."""
        # After a wrong word the rest may not begin at a word: only silence marks where
        # the next image begins.
        self._refuse(reason)
        self._skip()
        return False

    def _refuse(self, reason: str) -> None:
        self._events.append(CarEvent(REFUSED, b"", error_line(reason)))


class Lines:
    """Split bytes into lines."""

    def __init__(self) -> None:
        self._line = b""

    def split(self, data: bytes) -> list[bytes]:
        """Return the lines that ``data`` completes, without their ends; of a very long line the last 200 bytes."""
        parts = (self._line + data).split(b"\n")
        self._line = parts[-1][-_LONGEST_LINE:]
        return [part[-_LONGEST_LINE:] for part in parts[:-1]]


def refusal(line: bytes) -> str | None:
    """Return the reason in an ERR line of a car, None where ``line`` is no such line."""
    at = line.find(b"ERR ")
    # After readable text it is a message of the board itself; after noise it is an answer.
    if at == 0 or (at > 0 and not 32 <= line[at - 1] < 127):
        return printable(line[at + 4 :])
    return None


class _End:
    """The base of UploaderEnd and ReadbackEnd, which run on the computer: it returns an Outcome once."""

    def __init__(self) -> None:
        self._outcome: Outcome | None = None
        self._is_returned = False

    def next_event(self) -> Outcome | None:
        """Return the Outcome once; None before it is known and afterwards."""
        if self._outcome is None or self._is_returned:
            return None
        self._is_returned = True
        return self._outcome


class UploaderEnd(_End):
    """The end of an uploader: it reads the answer of the car to ``image`` (bytes).

    Send ``image``, call ``finish_sending``, then pass on what comes back until
    ``next_event`` returns the Outcome.
    """

    def __init__(self, image: bytes, verify: bool = True) -> None:
        super().__init__()
        self.image = image
        self._verify = verify
        self._lines = Lines()
        self._sent_ms: int | None = None

    def finish_sending(self, now_ms: int) -> None:
        """Note that the last byte was sent at ``now_ms``: the answer of the car is due from then on."""
        self._sent_ms = now_ms
        if not self._verify and self._outcome is None:
            self._outcome = Outcome(NOT_VERIFIED, Phrase("sent-not-verified"))

    def receive_data(self, data: bytes, now_ms: int) -> None:
        """Take bytes that came back by ``now_ms``; call it with ``b""`` so that it notices a missing answer."""
        for line in self._lines.split(data):
            self._take_line(line)
        if self._outcome is not None or self._sent_ms is None:
            return
        if elapsed_ms(now_ms, self._sent_ms) >= ANSWER_WITHIN_MS:
            self._outcome = Outcome(SILENT, Phrase("no-answer-within", duration_ms=ANSWER_WITHIN_MS))

    def _take_line(self, line: bytes) -> None:
        if self._outcome is not None:
            return
        reason = refusal(line)
        if reason is not None:
            self._outcome = Outcome(REFUSED, reason)
            return
        at = line.find(b"OK words=")
        if at < 0:
            return
        answer = line[at:].strip()
        if answer.lower() == ok_line(self.image).strip().lower():
            self._outcome = Outcome(VERIFIED, printable(answer))
        else:
            expected = printable(ok_line(self.image).strip())
            self._outcome = Outcome(MISMATCH, Phrase("other-answer", answer=printable(answer), expected=expected))


class ReadbackEnd(_End):
    """The end of a reader: it reads the bytes that follow READBACK_REQUEST. The Outcome's detail is the image."""

    def __init__(self, now_ms: int) -> None:
        super().__init__()
        self._buffer = b""
        self._last_ms = now_ms

    def receive_data(self, data: bytes, now_ms: int) -> None:
        """Take bytes that came by ``now_ms``; call it with ``b""`` so that it notices a missing answer."""
        if self._outcome is not None:
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
            self._outcome = Outcome(SILENT, phrase)

    def _advance(self) -> None:
        if self._buffer[:4] == b"ERR ":
            if b"\n" in self._buffer:
                self._outcome = Outcome(REFUSED, printable(self._buffer[4 : self._buffer.find(b"\n")]))
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
            self._outcome = Outcome(REFUSED, Phrase("readback-is-no-image", reason=error))


def printable(line: bytes) -> str:
    """Return ``line`` as ASCII text; other bytes, which come from noise, become question marks."""
    return "".join([chr(byte) if 32 <= byte < 127 else "?" for byte in line]).strip()
