"""An image: a header word, the leader's control words and the followers', and its bytes.

Portable. Source: seed 000, general part; every word goes over a wire most
significant byte first.
"""

import struct
from collections import namedtuple

from motorcade.words.field import WordError
from motorcade.words.formats import CONTROL, HEADER

WORD_BYTES = 4
_PACKING = {"big": ">I", "little": "<I"}

Image = namedtuple("Image", ("leader", "followers", "dwell_level"))
"""What an image holds.

``leader`` and ``followers`` are tuples of control words; ``dwell_level`` is 0 to 7,
or -1 where there are no follower words.
"""


class ImageError(ValueError):
    """Bytes or words that are no image.

    Attributes:
        code: short name of the fault, stable: cut-off, too-long, header or word.
        figures: what its sentence tells, by name; `motorcade.words.sentences` says it in other languages.
    """

    def __init__(self, code: str, sentence: str, **figures: object) -> None:
        super().__init__(sentence)
        self.code = code
        self.figures = figures


def pack(word: int, byte_order: str = "big") -> bytes:
    """The four bytes of ``word`` (0 to 4294967295). ``byte_order`` is big or little; KeyError else."""
    return struct.pack(_PACKING[byte_order], word)


def unpack(data: bytes, byte_order: str = "big") -> int:
    """The word in four bytes."""
    word: int = struct.unpack(_PACKING[byte_order], data)[0]
    return word


def words_to_bytes(words: tuple[int, ...]) -> bytes:
    """An image's bytes, or any words', most significant byte first."""
    return b"".join([pack(word) for word in words])


def bytes_to_words(data: bytes) -> tuple[int, ...]:
    """The words in ``data``. Raises ImageError unless it is a whole number of words."""
    if len(data) % WORD_BYTES:
        raise ImageError("cut-off", f"{len(data)} bytes are no whole number of 4-byte words", count=len(data))
    return tuple(unpack(data[i : i + WORD_BYTES]) for i in range(0, len(data), WORD_BYTES))


def image_words(image: Image) -> tuple[int, ...]:
    """The words of an Image, header first. Raises WordError: too many words, or no dwell level for them."""
    if image.followers and not 0 <= image.dwell_level <= 7:
        raise WordError("dwell level", image.dwell_level, "0 to 7")
    dwell = 1 << image.dwell_level if image.followers else 0
    header = HEADER.encode(leader_states=len(image.leader), follower_words=len(image.followers), dwell=dwell)
    return (header,) + tuple(image.leader) + tuple(image.followers)


def announced_words(header: int) -> int:
    """How many words an image with this header word has, the header included."""
    return 1 + (header >> 24) + (header >> 16 & 255)


def check_header(header: int) -> None:
    """Raises ImageError where no image can begin with this header word."""
    try:
        HEADER.decode(header, True)
    except WordError as error:
        figures = {"word": header, "field": error.field, "value": error.value}
        raise ImageError("header", f"the header word 0x{header:08X} is not valid: {error}", **figures)


def parse_image(words: tuple[int, ...]) -> Image:
    """The Image in ``words``, every word checked.

    Raises:
        ImageError: too few or too many words, a header that isn't one, or a
            control word with bits set that an image writes 0 (reserved, parity).
    """
    if not words:
        raise ImageError("cut-off", "the image is empty: not even a header word is here")
    check_header(words[0])
    header = HEADER.decode(words[0])
    expected = announced_words(words[0])
    if len(words) < expected:
        sentence = f"the image is cut off: its header announces {expected} words, {len(words)} are here"
        raise ImageError("cut-off", sentence, expected=expected, here=len(words))
    if len(words) > expected:
        sentence = f"the image is too long: its header announces {expected} words, {len(words)} are here"
        raise ImageError("too-long", sentence, expected=expected, here=len(words))
    for position in range(1, expected):
        _check_control(words[position], position)
    leader = tuple(words[1 : 1 + header.leader_states])
    level = -1
    while header.dwell >> level + 1:
        level += 1
    return Image(leader, tuple(words[1 + header.leader_states :]), level)


def parse_image_bytes(data: bytes) -> Image:
    """The Image in ``data``. Raises ImageError."""
    return parse_image(bytes_to_words(data))


def _check_control(word: int, position: int) -> None:
    try:
        values = CONTROL.decode(word, True)
    except WordError as error:
        raise _bad_word(position, word, error.field, error.value, str(error))
    if values.parity:
        raise _bad_word(position, word, "parity", 1, "parity is 1, an image writes 0")


def _bad_word(position: int, word: int, field: str, value: object, reason: str) -> ImageError:
    sentence = f"word {position} (0x{word:08X}) is not valid: {reason}"
    return ImageError("word", sentence, position=position, word=word, field=field, value=value)
