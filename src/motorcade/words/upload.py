"""Serial upload, both ends: bytes and the clock in, events out; no port is touched here.

Portable: the car's end runs on a microcontroller. An image carries its own
length in its header, and the car answers one ASCII line:
``OK words=<n> crc32=<8 hex>`` or ``ERR <reason>``. The uploader compares the
CRC-32 (zlib's) with its own. A check request (`motorcade.words.check`) before
an image lets the car compare it too, before it gives up the image that it has.
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
# The image of a car that never got one.
NO_PROGRAM = pack(0)
# How the reasons begin that a car gives for refusing bytes, besides the brief form of an ImageError.
CUT_OFF = "cut off after"
NOT_EMPTY = "the empty image has"
CHANGED_REQUEST = "the check request was changed"
OTHER_CHECKSUM = "the checksum is"
CANT_STORE = "the image could not be stored"
_LONGEST_LINE = 200

# What a car's end reports.
IMAGE = "image"
READBACK = "readback"
CHECK = "check"
REFUSED = "refused"
# What an uploader's end reports besides REFUSED.
VERIFIED = "verified"
NOT_VERIFIED = "not verified"
MISMATCH = "mismatch"
SILENT = "silent"

CarEvent = namedtuple("CarEvent", ("kind", "image", "answer"))
"""What the car's shell does next.

IMAGE: store ``image`` (bytes), then send ``answer``. READBACK: send the stored
image's bytes. CHECK: send `motorcade.words.check.ready_line` of ``answer`` and the
stored image. REFUSED: send ``answer``; the stored image stays. Where none was ever
stored it is NO_PROGRAM.
"""

Outcome = namedtuple("Outcome", ("kind", "detail"))
"""How an upload or a readback ended.

``kind`` is one of the kinds above; ``detail`` a Phrase, what the car answered (text), or the image's bytes.
"""


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
        # The checksum that was announced for the next image; None while any may come.
        self._announced: int | None = None
        self._events: list[CarEvent] = []

    def receive_data(self, data: bytes, now_ms: int) -> None:
        """Take bytes that came at ``now_ms``; call it with ``b""`` now and then so that silence is noticed."""
        quiet_ms = elapsed_ms(now_ms, self._last_byte_ms)
        if quiet_ms >= SILENCE_MS:
            self._hear_silence()
        if quiet_ms >= CHECK_LASTS_MS:
            self._announced = None
        if not data:
            return
        self._last_byte_ms = now_ms
        if not self._skipping:
            self._buffer += data
            self._advance()

    def next_event(self) -> CarEvent | None:
        """The next CarEvent, or None."""
        return self._events.pop(0) if self._events else None

    def _hear_silence(self) -> None:
        if self._buffer == NO_PROGRAM and self._announced is None:
            self._events.append(CarEvent(IMAGE, NO_PROGRAM, ok_line(NO_PROGRAM)))
        elif self._buffer:
            self._refuse(f"{CUT_OFF} {len(self._buffer)} bytes")
        self._buffer = b""
        self._skipping = False

    def _advance(self) -> None:
        going_on = True
        while going_on and len(self._buffer) >= WORD_BYTES:
            header = unpack(self._buffer[:WORD_BYTES])
            try:
                if header == READBACK_HEADER:
                    self._take(WORD_BYTES)
                    self._events.append(CarEvent(READBACK, b"", b""))
                elif header == CHECK_HEADER:
                    going_on = self._take_check()
                else:
                    going_on = self._take_image(header)
            except ImageError as error:
                going_on = self._turn_down(error.brief())

    def _take_check(self) -> bool:
        """True where the whole request was there."""
        if len(self._buffer) < CHECK_BYTES:
            return False
        found = read_check(self._take(CHECK_BYTES))
        if found is None:
            return self._turn_down(f"{CHANGED_REQUEST} on the way")
        self._announced = found[0]
        self._events.append(CarEvent(CHECK, b"", check_words(found[0], found[1])))
        return True

    def _take_image(self, header: int) -> bool:
        """True where a whole image was there and more may follow it."""
        check_header(header)
        length = announced_words(header) * WORD_BYTES
        here = len(self._buffer)
        if here < length:
            return False
        if header == 0 and self._announced is None:
            # Zeros are what a break or a loose cable leaves: an image only where they are four between silences.
            if here > length:
                return self._turn_down(f"{NOT_EMPTY} {length} bytes, {here} are here")
            return False
        image = self._buffer[:length]
        parse_image_bytes(image)
        if self._announced is not None and crc32(image) != self._announced:
            return self._turn_down(f"{OTHER_CHECKSUM} {crc32(image):08x}, {self._announced:08x} was announced")
        self._events.append(CarEvent(IMAGE, image, ok_line(image)))
        if self._announced is None:
            self._take(length)
            return True
        # What follows an image that was announced was announced by nobody.
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

    def _turn_down(self, reason: str) -> bool:
        """Refuse what is here and all that comes before a silence; False: there is nothing to go on with."""
        # Where one word is wrong the rest can't be trusted to begin at a word;
        # silence is the only mark that the next image has.
        self._refuse(reason)
        self._skip()
        return False

    def _refuse(self, reason: str) -> None:
        self._events.append(CarEvent(REFUSED, b"", error_line(reason)))


class Lines:
    """Bytes as they come, in lines."""

    def __init__(self) -> None:
        self._line = b""

    def split(self, data: bytes) -> list[bytes]:
        """The lines that ``data`` completes, each without its end; of a very long one the last 200 bytes."""
        parts = (self._line + data).split(b"\n")
        self._line = parts[-1][-_LONGEST_LINE:]
        return [part[-_LONGEST_LINE:] for part in parts[:-1]]


def refusal(line: bytes) -> str | None:
    """The reason in the car's ERR line, None where ``line`` is none."""
    at = line.find(b"ERR ")
    # Behind other text it is a board's own message; behind noise it is an answer.
    if at == 0 or (at > 0 and not 32 <= line[at - 1] < 127):
        return printable(line[at + 4 :])
    return None


class UploaderEnd:
    """What an uploader makes of the car's answer to ``image`` (bytes).

    Send ``image``, call ``finish_sending``, then feed what comes back until
    ``next_event`` gives the Outcome.
    """

    def __init__(self, image: bytes, verify: bool = True) -> None:
        self.image = image
        self._verify = verify
        self._lines = Lines()
        self._sent_ms: int | None = None
        self._outcome: Outcome | None = None
        self._told = False

    def finish_sending(self, now_ms: int) -> None:
        """The last byte left at ``now_ms``: from here on the car's answer is due."""
        self._sent_ms = now_ms
        if not self._verify and self._outcome is None:
            self._outcome = Outcome(NOT_VERIFIED, Phrase("sent-not-verified"))

    def receive_data(self, data: bytes, now_ms: int) -> None:
        """Take bytes that came back by ``now_ms``; ``b""`` lets a missing answer be noticed."""
        for line in self._lines.split(data):
            self._take_line(line)
        if self._outcome is not None or self._sent_ms is None:
            return
        if elapsed_ms(now_ms, self._sent_ms) >= ANSWER_WITHIN_MS:
            self._outcome = Outcome(SILENT, Phrase("no-answer-within", duration_ms=ANSWER_WITHIN_MS))

    def next_event(self) -> Outcome | None:
        """The Outcome, once, or None while it is open."""
        if self._outcome is None or self._told:
            return None
        self._told = True
        return self._outcome

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
                phrase = Phrase("car-stopped-after", count=len(self._buffer))
            else:
                phrase = Phrase("no-answer-within", duration_ms=ANSWER_WITHIN_MS)
            self._outcome = Outcome(SILENT, phrase)

    def next_event(self) -> Outcome | None:
        """The Outcome, once, or None while it is open."""
        if self._outcome is None or self._told:
            return None
        self._told = True
        return self._outcome

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
    """ASCII text of ``line``; bytes that noise put there become question marks."""
    return "".join([chr(byte) if 32 <= byte < 127 else "?" for byte in line]).strip()
