"""Words as bytes, and bytes as words.

Portable. Words are sent most significant byte first.
"""

import struct

from motorcade.errors import MotorcadeError, Phrase

WORD_BYTES = 4
_PACKING = {"big": ">I", "little": "<I"}


class ImageError(MotorcadeError):
    """Bytes or words that are no image, or none that a car can hold.

    The code is image-cut-off, image-too-long, image-header, image-word or image-too-large.
    """


def pack(word: int, byte_order: str = "big") -> bytes:
    """Return the four bytes of ``word`` (0 to 4294967295). Raises KeyError unless ``byte_order`` is big or little."""
    return struct.pack(_PACKING[byte_order], word)


def unpack(data: bytes, byte_order: str = "big") -> int:
    """Return the word in four bytes."""
    word: int = struct.unpack(_PACKING[byte_order], data)[0]
    return word


def words_to_bytes(words: tuple[int, ...]) -> bytes:
    """Return the bytes of words, most significant byte first."""
    return b"".join([pack(word) for word in words])


def bytes_to_words(data: bytes) -> tuple[int, ...]:
    """Return the words in ``data``. Raises ImageError unless it is a whole number of words."""
    if len(data) % WORD_BYTES:
        raise ImageError("image-cut-off", reason=Phrase("part-of-a-word", count=len(data)))
    return struct.unpack(f">{len(data) // WORD_BYTES}I", data)
