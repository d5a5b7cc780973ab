"""An image: a header word, the control words of the leader and of the followers; its check.

Source: seed 000, general part. A car's own check of an upload is in `motorcade.words.receiver`.
"""

from collections import namedtuple
from typing import Any

from motorcade.errors import Phrase
from motorcade.words.field import WordError, WordFormat
from motorcade.words.flow import (
    BAD_COUNT,
    BAD_LEVEL,
    BAD_TARGET,
    DECIDES,
    IN_TURN,
    TAGGED,
    TELL,
    UNTAGGED,
    highest_level,
    word_fault,
)
from motorcade.words.formats import CONTROL, FLOW, HEADER, STATE
from motorcade.words.packing import ImageError, bytes_to_words, pack

Image = namedtuple("Image", ("leader", "followers", "dwell_level", "tagged", "decides"), defaults=(0,))
"""The content of an image.

``leader`` and ``followers`` are tuples of words: control words, or states and flow words of a leader that decides;
``dwell_level`` is 0 to 7, or -1 where there are no follower words; ``tagged`` is 1 where the follower words travel with
a tag, else 0; ``decides`` is 1 where the leader decides, else 0.
"""


def image_words(image: Image) -> tuple[int, ...]:
    """Return the words of an Image, header first. Raises WordError where there are too many words."""
    dwell = 1 << image.dwell_level if image.followers else 0
    reserved = image.tagged * TAGGED | image.decides * DECIDES
    header = HEADER.encode(
        leader_states=len(image.leader), follower_words=len(image.followers), dwell=dwell, reserved=reserved
    )
    return (header,) + tuple(image.leader) + tuple(image.followers)


def holds_a_tell(image: Image) -> bool:
    """Return whether the leader decides when its followers are told something; else the dwell does."""
    return bool(image.decides) and any(word >> 31 and word >> 28 & 7 == TELL for word in image.leader)


def announced_words(header: int) -> int:
    """Return how many words an image with this header word has, the header included."""
    return 1 + (header >> 24) + (header >> 16 & 255)


def check_header(header: int) -> None:
    """Raise ImageError where no image can begin with this header word."""
    try:
        values = HEADER.decode(header, True)
    except WordError as error:
        raise ImageError("image-header", word=header, reason=error)
    missing = ""
    if values.reserved & TAGGED and not values.follower_words:
        missing = "follower words"
    elif values.reserved & DECIDES and not values.leader_states:
        missing = "leader words"
    if missing:
        reason = WordError("reserved", values.reserved, Phrase("zero-without-others", others=missing))
        raise ImageError("image-header", word=header, reason=reason)


def parse_image(words: tuple[int, ...]) -> Image:
    """Check every word and return the Image in ``words``.

    Raises:
        ImageError: too few or too many words, a header that no image has, or a
            word that no image has in this place: bits set that are 0 in an image
            (reserved, parity), or a flow word without a meaning.
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
        check_word(words[position], position, words[0])
    leader = tuple(words[1 : 1 + header.leader_states])
    level = -1
    while header.dwell >> level + 1:
        level += 1
    followers = tuple(words[1 + header.leader_states :])
    return Image(leader, followers, level, header.reserved & TAGGED, int(header.reserved & DECIDES > 0))


def parse_image_bytes(data: bytes) -> Image:
    """Return the Image in ``data``. Raises ImageError."""
    return parse_image(bytes_to_words(data))


def format_at(position: int, word: int, header: int) -> WordFormat:
    """Return the format of ``word``, which stands ``position`` words after ``header`` in an image."""
    if position == 0:
        return HEADER
    if header & DECIDES == 0 or position > header >> 24:
        return CONTROL
    return FLOW if word >> 31 else STATE


def check_word(word: int, position: int, header: int) -> None:
    """Raise ImageError where an image with ``header`` can't have ``word`` at ``position``, 1 for the first one."""
    word_format = format_at(position, word, header)
    reason: WordError | Phrase | None = None
    try:
        values = word_format.decode(word, True)
        if word_format is not CONTROL:
            _check_leader_word(values, word, header)
        elif values.parity:
            reason = Phrase("parity-is-set")
    except WordError as error:
        reason = error
    if reason:
        decider = {"header": header} if header & DECIDES else {}
        raise ImageError("image-word", position=position, word=word, reason=reason, **decider)


def _check_leader_word(values: Any, word: int, header: int) -> None:
    """Raise WordError where a state or a flow word, of which each field is good, doesn't fit its image."""
    leader_words, follower_words = header >> 24, header >> 16 & 255
    first, second, third, fourth = pack(word)
    fault = word_fault(first, second, third, fourth, leader_words, follower_words, header & TAGGED)
    if fault == BAD_TARGET and values.op == TELL:
        raise WordError("target", values.target, Phrase("follower-word-or-turn", last=follower_words - 1, turn=IN_TURN))
    if fault == BAD_TARGET:
        raise WordError("target", values.target, Phrase("values-from-to", minimum=0, maximum=leader_words - 1))
    if fault == BAD_COUNT:
        raise WordError("value", values.value, Phrase("values-from-to", minimum=0, maximum=follower_words))
    if fault == UNTAGGED:
        raise WordError("op", TELL, Phrase("tell-needs-tags"))
    if fault == BAD_LEVEL and values.flow:
        highest = Phrase("values-from-to", minimum=0, maximum=highest_level(values.condition))
        raise WordError("level", values.level, highest)
    if fault == BAD_LEVEL:
        highest = Phrase("values-from-to", minimum=0, maximum=highest_level(values.until))
        raise WordError("until_level", values.until_level, highest)


def refused_image(reason: str) -> "ImageError | None":
    """Return the ImageError whose brief form a car sent (``image-word position=3 word=0x40000001``), else None.

    A car adds the image's header where a leader that decides has that word.
    """
    try:
        numbers = dict([part.split("=") for part in reason.split()[1:]])
        if reason.startswith("image-header "):
            check_header(int(numbers["word"], 16))
        elif reason.startswith("image-word "):
            check_word(int(numbers["word"], 16), int(numbers["position"]), int(numbers.get("header", "0"), 16))
        elif reason.startswith("image-too-large "):
            return ImageError("image-too-large", words=int(numbers["words"]), most=int(numbers["most"]))
    except ImageError as error:
        return error
    except (KeyError, ValueError):
        pass
    return None
