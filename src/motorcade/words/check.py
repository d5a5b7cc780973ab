"""The check request: tells a car the checksum of the image that comes next, so that it takes no other.

Portable. Source: seed 000, h3, which is there for extensions; docs/adr/0014 has
the reasons. A request is six words: a header that announces two states and three
follower words and has 254 in its reserved field, and those five control words,
each with one byte in its reserved field: the image's CRC-32 and a number. A car
that looks at no reserved field takes them for an image in which nothing moves.

A car that knows checks answers
``OK check=<8 hex><2 hex> holds=<8 hex> sum=<8 hex>``: what it was asked, the
CRC-32 of the image that it holds, and the CRC-32 of the line up to there.
"""

from binascii import crc32

from motorcade.words.image import WORD_BYTES, pack, unpack

CHECK_HEADER = 0x020301FE
CHECK_WORDS = 6
CHECK_BYTES = CHECK_WORDS * WORD_BYTES
# How long a car waits for the image that was announced, counted from the last byte that came.
CHECK_LASTS_MS = 10000
# Ones where they do nothing, the motor and avoidance being off. None of a word's
# bytes is then zero, while an image's words end in a zero byte: a request that
# lost or doubled bytes on the way is no image.
_MARKS = 0x01010802
_SHIFT = 2
_REST = 0xFFFFFFFF ^ 0xFF << _SHIFT


def check_request(checksum: int, number: int) -> bytes:
    """Announces an image with the CRC-32 ``checksum``; ``number`` (0 to 255) tells requests apart."""
    payload = pack(checksum) + bytes([number])
    return pack(CHECK_HEADER) + b"".join([pack(_MARKS | byte << _SHIFT) for byte in payload])


def read_check(request: bytes) -> tuple[int, int] | None:
    """The checksum and the number in the CHECK_BYTES of a request; None where they were changed on the way."""
    payload = []
    for at in range(WORD_BYTES, CHECK_BYTES, WORD_BYTES):
        word = unpack(request[at : at + WORD_BYTES])
        if word & _REST != _MARKS:
            return None
        payload.append(word >> _SHIFT & 0xFF)
    return unpack(bytes(payload[:WORD_BYTES])), payload[WORD_BYTES]


def check_words(checksum: int, number: int) -> bytes:
    """The beginning of the answer to a check request."""
    return f"OK check={checksum:08x}{number:02x}".encode()


def ready_line(beginning: bytes, held: bytes) -> bytes:
    """The whole answer of a car that holds the image ``held``; ``beginning`` is that of `check_words`."""
    line = beginning + f" holds={crc32(held):08x}".encode()
    return line + f" sum={crc32(line):08x}\n".encode()


def held_checksum(line: bytes, beginning: bytes) -> int | None:
    """The CRC-32 of the image that the car holds, from its answer; None where the line is no whole such answer."""
    at = line.find(beginning)
    if at < 0:
        return None
    line = line[at:].strip()
    digits = line[len(beginning) + 7 : len(beginning) + 15]
    try:
        checksum = int(digits, 16)
    except ValueError:
        return None
    told = beginning + f" holds={checksum:08x}".encode()
    return checksum if line == told + f" sum={crc32(told):08x}".encode() else None
