"""An image: a header word, the control words of the leader and of the followers; its check.

Source: seed 000, general part. A car's own check of an upload is in `motorcade.words.receiver`.
"""

from collections import namedtuple

from motorcade.errors import Phrase
from motorcade.words.field import WordError
from motorcade.words.formats import CONTROL, HEADER
from motorcade.words.packing import ImageError, bytes_to_words

Image = namedtuple("Image", ("leader", "followers", "dwell_level", "tagged"))
"""The content of an image.

``leader`` and ``followers`` are tuples of control words; ``dwell_level`` is 0 to 7,
or -1 where there are no follower words; ``tagged`` is 1 where the follower words
travel with a tag, else 0.
"""


def image_words(image: Image) -> tuple[int, ...]:
    """Return the words of an Image, header first. Raises WordError where there are too many words."""
    dwell = 1 << image.dwell_level if image.followers else 0
    header = HEADER.encode(
        leader_states=len(image.leader), follower_words=len(image.followers), dwell=dwell, reserved=image.tagged
    )
    return (header,) + tuple(image.leader) + tuple(image.followers)


def announced_words(header: int) -> int:
    """Return how many words an image with this header word has, the header included."""
    return 1 + (header >> 24) + (header >> 16 & 255)


def check_header(header: int) -> None:
    """Raise ImageError where no image can begin with this header word."""
    try:
        values = HEADER.decode(header, True)
    except WordError as error:
        raise ImageError("image-header", word=header, reason=error)
    if values.reserved and not values.follower_words:
        reason = WordError("reserved", values.reserved, Phrase("zero-without-others", others="follower words"))
        raise ImageError("image-header", word=header, reason=reason)


def parse_image(words: tuple[int, ...]) -> Image:
    """Check every word and return the Image in ``words``.

    Raises:
        ImageError: too few or too many words, a header that no image has, or a
            control word with bits set that are 0 in an image (reserved, parity).
    """
    if not words:
        raise ImageError("image-cut-off", reason=Phrase("image-is-empty"))
    check_header(words[0])
    header = HEADER.decode(words[0])
    expected = announced_words(words[0])
    if len(words) < expected:
        raise ImageError("image-cut-off", reason=Phrase("words-are-missing", expected=expected, here=len(words)))
    if len(words) > expected:
        raise ImageError("image-too-long", expected=expected, here=len(words))
    for position in range(1, expected):
        check_control(words[position], position)
    leader = tuple(words[1 : 1 + header.leader_states])
    level = -1
    while header.dwell >> level + 1:
        level += 1
    return Image(leader, tuple(words[1 + header.leader_states :]), level, header.reserved)


def parse_image_bytes(data: bytes) -> Image:
    """Return the Image in ``data``. Raises ImageError."""
    return parse_image(bytes_to_words(data))


def check_control(word: int, position: int) -> None:
    """Raise ImageError where an image can't have this control word, ``position`` words after its header."""
    try:
        values = CONTROL.decode(word, True)
    except WordError as error:
        raise ImageError("image-word", position=position, word=word, reason=error)
    if values.parity:
        raise ImageError("image-word", position=position, word=word, reason=Phrase("parity-is-set"))


def refused_image(reason: str) -> "ImageError | None":
    """Return the ImageError whose brief form a car sent (``image-word position=3 word=0x40000001``), else None."""
    try:
        numbers = dict([part.split("=") for part in reason.split()[1:]])
        if reason.startswith("image-header "):
            check_header(int(numbers["word"], 16))
        elif reason.startswith("image-word "):
            check_control(int(numbers["word"], 16), int(numbers["position"]))
        elif reason.startswith("image-too-large "):
            return ImageError("image-too-large", words=int(numbers["words"]), most=int(numbers["most"]))
    except ImageError as error:
        return error
    except (KeyError, ValueError):
        pass
    return None
