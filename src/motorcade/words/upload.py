"""The car's end of a serial upload: it takes bytes and the time, and returns events. It opens no port.

Portable: it runs on a microcontroller. The computer's end is `motorcade.words.uploader`. The header of an image
contains its length, and the car answers with one ASCII line:
``OK words=<n> crc32=<8 hex>`` or ``ERR <reason>``. The uploader compares the
CRC-32 (zlib's) with its own. A check request (`motorcade.words.request`) before
an image makes the car compare it too, before it replaces the image that it has.
"""

from binascii import crc32
from collections import namedtuple

from motorcade.errors import brief
from motorcade.words import receiver
from motorcade.words.packing import WORD_BYTES, pack
from motorcade.words.request import REQUEST_BYTES, check_words

SILENCE_MS = receiver.SILENCE_MS
ANSWER_WITHIN_MS = 2000
# A car answers once the image is stored. An EEPROM takes 3.4 ms a byte, so the answer to a large image is due later.
_STORING_MS_A_BYTE = 5
READBACK_REQUEST = pack(receiver.READBACK_HEADER)
# The image of a car that never received one.
NO_PROGRAM = pack(0)
# The beginnings of the reasons for which a car refuses bytes. Another reason is the brief form of an ImageError.
CUT_OFF = "cut off after"
NOT_EMPTY = "the empty image has"
CHANGED_REQUEST = "the check request was changed"
OTHER_CHECKSUM = "the checksum is"
CANT_STORE = "the image could not be stored"
TOO_LARGE = "image-too-large"

# The events.
IMAGE = "image"
READBACK = "readback"
CHECK = "check"
REQUEST = "request"
REFUSED = "refused"
CarEvent = namedtuple("CarEvent", ("kind", "image", "answer"))
"""What the caller of a CarEnd has to do.

IMAGE: store ``image`` (bytes), then send ``answer``. READBACK: send the stored
image's bytes. CHECK: send `motorcade.words.request.ready_line` of ``answer`` and the
stored image. REQUEST: answer the request (`motorcade.words.request`) in ``image``.
REFUSED: send ``answer`` and keep the stored image. Before the first image is stored,
the stored image is NO_PROGRAM.
"""


def ok_line(image: bytes) -> bytes:
    """Return the answer of a car to an image that it holds now."""
    return _ok_line(len(image) // WORD_BYTES, crc32(image))


def _ok_line(words: int, checksum: int) -> bytes:
    return f"OK words={words} crc32={checksum:08x}\n".encode()


def answer_within_ms(image: bytes) -> int:
    """Return within how many ms after its last byte the answer to ``image`` is due."""
    return max(ANSWER_WITHIN_MS, len(image) * _STORING_MS_A_BYTE)


def error_line(reason: str) -> bytes:
    """Return the answer of a car to bytes that it refuses; ``reason`` is one ASCII line."""
    return f"ERR {reason}\n".encode()


class CarEnd:
    """The end of a car: it finds images and requests in the bytes from a serial port.

    Args:
        most_words: how many words the largest image has that the car can store, 12 to 511.
        work_words: how many words one call checks at most, 1 or more. What is left is done by the next calls.
    """

    def __init__(self, most_words: int = receiver.MOST_WORDS, work_words: int = receiver.MOST_WORDS) -> None:
        self._memory = [0] * receiver.SIZE
        self._buffer = bytearray(most_words * WORD_BYTES)
        self._work_words = work_words
        # Bytes for which the buffer has no room yet.
        self._waiting = b""
        self._events: list[CarEvent] = []
        receiver.switch_on(self._memory, most_words)

    def receive_data(self, data: bytes, now_ms: int) -> bool:
        """Take bytes that came at ``now_ms``; call it with ``b""`` from time to time so that it notices silence.

        Return whether there is an event, or work for the next call.
        """
        if data:
            self._waiting = self._waiting + data if self._waiting else data
        is_working = self._process(now_ms)
        while self._waiting:
            count = min(receiver.room(self._memory, self._buffer, now_ms), len(self._waiting))
            if count == 0:
                return True
            end = self._memory[receiver.END]
            if count == len(self._waiting):
                # Each copy costs a microcontroller time: it looks for room for it in all its memory.
                self._buffer[end : end + count] = self._waiting
                self._waiting = b""
            else:
                self._buffer[end : end + count] = self._waiting[:count]
                self._waiting = self._waiting[count:]
            receiver.add(self._memory, count, now_ms)
            is_working = is_working or self._process(now_ms)
        return is_working or bool(self._events)

    def next_event(self) -> CarEvent | None:
        """Return the next CarEvent, or None."""
        return self._events.pop(0) if self._events else None

    def _process(self, now_ms: int) -> bool:
        """Take the events that the bytes in the buffer make. Return whether work is left for the next call."""
        while True:
            event = receiver.next_event(self._memory, self._buffer, self._work_words, now_ms)
            if event == receiver.NOTHING:
                return False
            if event == receiver.WORKING:
                return True
            self._events.append(self._car_event(event))

    def _car_event(self, event: int) -> CarEvent:
        r = self._memory
        if event == receiver.IMAGE:
            begin = r[receiver.START]
            # A slice of the buffer itself would be a second copy, and a chip looks for room for each.
            image = bytes(memoryview(self._buffer)[begin : begin + r[receiver.LENGTH]])
            return CarEvent(IMAGE, image, _ok_line(len(image) // WORD_BYTES, r[receiver.CRC]))
        if event == receiver.READBACK:
            return CarEvent(READBACK, b"", b"")
        if event == receiver.REQUEST:
            begin = r[receiver.START]
            return CarEvent(REQUEST, bytes(memoryview(self._buffer)[begin : begin + REQUEST_BYTES]), b"")
        if event == receiver.CHECK:
            return CarEvent(CHECK, b"", check_words(r[receiver.ANNOUNCED], r[receiver.NUMBER]))
        return CarEvent(REFUSED, b"", error_line(self._reason(event)))

    def _reason(self, event: int) -> str:
        """Return why the bytes were refused; the receiver's memory holds the details."""
        r = self._memory
        count, word = r[receiver.COUNT], r[receiver.WORD]
        if event == receiver.CUT_OFF:
            return f"{CUT_OFF} {count} bytes"
        if event == receiver.NOT_EMPTY:
            return f"{NOT_EMPTY} {WORD_BYTES} bytes, {count} are here"
        if event == receiver.CHANGED_REQUEST:
            return f"{CHANGED_REQUEST} on the way"
        if event == receiver.OTHER_CHECKSUM:
            return f"{OTHER_CHECKSUM} {r[receiver.CRC]:08x}, {r[receiver.ANNOUNCED]:08x} was announced"
        if event == receiver.BAD_HEADER:
            return brief("image-header", {"word": word})
        if event == receiver.BAD_WORD and r[receiver.HEADER]:
            return brief("image-word", {"header": r[receiver.HEADER], "position": count, "word": word})
        if event == receiver.BAD_WORD:
            return brief("image-word", {"position": count, "word": word})
        return brief(TOO_LARGE, {"words": count, "most": r[receiver.MOST_BYTES] // WORD_BYTES})
