"""Make check requests: they announce the checksum of the next image, so that the car accepts no other.

Portable. Source: seed 000, h3, which is reserved for extensions; docs/adr/0014 gives
the reasons. A request is six words: a header that announces two states and three
follower words and has 254 in its reserved field, and those five control words,
each with one byte in its reserved field: the image's CRC-32 and a number. A car
that ignores reserved fields takes them for an image in which nothing moves.

A car that knows check requests answers
``OK check=<8 hex><2 hex> holds=<8 hex> sum=<8 hex>``: the checksum
and the number of the request, the CRC-32 of the image that the car holds, and the CRC-32 of the line up to there.
"""

from binascii import crc32

from motorcade.words.image import WORD_BYTES, pack

CHECK_HEADER = 0x020301FE
CHECK_WORDS = 6
CHECK_BYTES = CHECK_WORDS * WORD_BYTES
# How long a car waits for the announced image, counted from the last byte that came.
CHECK_LASTS_MS = 10000
# Bits that have no effect while motor and avoidance are off. They keep every byte of a
# word above zero, whereas the words of an image end in a zero byte. So a request that
# lost some bytes, or came with some bytes twice, is never an image.
MARKS = 0x01010802
PAYLOAD_AT = 2


def check_request(checksum: int, number: int) -> bytes:
    """Return the request that announces an image with the CRC-32 ``checksum``.

    ``number`` (0 to 255) distinguishes requests.
    """
    payload = pack(checksum) + bytes([number])
    return pack(CHECK_HEADER) + b"".join([pack(MARKS | byte << PAYLOAD_AT) for byte in payload])


def check_words(checksum: int, number: int) -> bytes:
    """Return the beginning of the answer to a check request with this checksum and number."""
    return f"OK check={checksum:08x}{number:02x}".encode()


def ready_line(beginning: bytes, held: bytes) -> bytes:
    """Return the whole answer of a car that holds the image ``held``; ``beginning`` comes from `check_words`."""
    line = beginning + f" holds={crc32(held):08x}".encode()
    return line + f" sum={crc32(line):08x}\n".encode()


def held_checksum(line: bytes, beginning: bytes) -> int | None:
    """Return the CRC-32 of the image that the car holds, from its answer; None where the line is no such answer."""
    at = line.find(beginning)
    if at < 0:
        return None
    line = line[at:].strip()
    digits = line[len(beginning) + 7 : len(beginning) + 15]
    try:
        checksum = int(digits, 16)
    except ValueError:
        return None
    expected = beginning + f" holds={checksum:08x}".encode()
    return checksum if line == expected + f" sum={crc32(expected):08x}".encode() else None
