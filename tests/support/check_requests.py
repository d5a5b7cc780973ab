"""Read a check request as a car does, without the receiver that a car has."""

from motorcade.words.image import WORD_BYTES, bytes_to_words
from motorcade.words.request import CHECK_BYTES, MARKS, PAYLOAD_AT


def read_check(request: bytes) -> tuple[int, int] | None:
    """The checksum and the number of a request (CHECK_BYTES); None where it was damaged on the way."""
    words = bytes_to_words(request[WORD_BYTES:CHECK_BYTES])
    if any(word & (0xFFFFFFFF ^ 0xFF << PAYLOAD_AT) != MARKS for word in words):
        return None
    payload = bytes(word >> PAYLOAD_AT & 0xFF for word in words)
    return int.from_bytes(payload[:WORD_BYTES], "big"), payload[WORD_BYTES]
