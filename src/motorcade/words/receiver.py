"""The receiver of uploads in a car: it finds images and requests in bytes, with bounded work a call.

Portable plain functions of integers, as `motorcade.car.brain`: CPython and MicroPython run this file, and it is
translated to C. `motorcade.words.upload` describes the protocol; its ``CarEnd`` is the shell around these functions in
Python. They take these arguments:

``r``
    the receiver's memory: SIZE unsigned integers below 2^32, at the indices below.
``buffer``
    the bytes that came and aren't processed yet: 4 for each word of the largest image that the car takes.
``now``
    the clock's reading in ms (`motorcade.words.ticks`).

In each tick a shell

1. calls `next_event` until it returns NOTHING or WORKING, and does what each event says before the next call;
2. copies at most ``room`` bytes that came to ``buffer`` at ``r[END]``, and calls `add` with their number;
3. does 1 again where it copied bytes.

It goes on with its other work after WORKING, and calls `next_event` again in the next tick.

How it works
============

The buffer holds what came between START and END. START is always the first byte of something: an image, a check
request, a request, or a readback. The first four bytes are its header, which says what it is and how long: LENGTH is
0 until the header is here, then the number of bytes to wait for.

Silence marks where something begins. After SILENCE_MS without a byte the next one begins a new thing, and what is
incomplete is refused (CUT_OFF). After any refusal the rest may not begin at a word, so SKIPS is set and bytes are
ignored until the next silence.

The control words of an image are checked and its CRC-32 is computed while it arrives, at most ``work_words`` a call,
so that no tick of a slow chip takes long. CHECKED is how far that has come. A wrong word is refused when the whole
image is here, since the uploader listens only then.

Four zeros are the empty image, but a loose cable makes zeros, too. So they count only between two silences, unless a
check request announced just this image.

A check request (`motorcade.words.request`) announces a CRC-32. Until CHECK_LASTS_MS have passed without a byte, only
an image with that sum is taken; others are refused (OTHER_CHECKSUM), and the car keeps the image that it has.

The bytes of an IMAGE or a REQUEST stay in the buffer until the next call, so that a shell may store them from there
without a copy; TAKEN remembers to drop them.
"""

from motorcade.words import uint8, uint8_at, uint16, uint16_at
from motorcade.words.blocks import crc32_of, move_to_start
from motorcade.words.flow import DECIDES, TAGGED, word_fault
from motorcade.words.positions import MOST_RESERVED, UNUSED_BITS
from motorcade.words.request import (
    CHECK_BYTES,
    CHECK_HEADER,
    CHECK_LASTS_MS,
    KIND_AT,
    MARKS,
    PAYLOAD_AT,
    REQUEST_BYTES,
    REQUEST_HEADER,
    SUM_AT,
)
from motorcade.words.ticks import elapsed_ms

SILENCE_MS = 500
READBACK_HEADER = 0x000000FF
# A header's bytes hold at most this many words; a car may hold fewer, but it needs room for a request.
MOST_WORDS = 511
LEAST_WORDS = REQUEST_BYTES // 4

# The memory, r.
START: uint16_at = 0  # index of the first byte in the buffer that isn't processed
END: uint16_at = 1  # index behind the last one
MOST_BYTES: uint16_at = 2  # how many bytes the buffer holds
LENGTH: uint16_at = 3  # bytes of the image or request at START; 0 while its header is unknown
CHECKED: uint16_at = 4  # index behind the last byte of the image that was checked
CRC = 5  # CRC-32 of the image up to there
BAD_POSITION: uint16_at = 6  # position of the first control word that no image has; 0 for none
SKIPS: uint8_at = 7  # 1 while bytes are ignored, up to the next silence
LAST_BYTE_MS = 8  # when the last byte came
IS_ANNOUNCED: uint8_at = 9  # 1 while only the announced image is taken
ANNOUNCED = 10  # CRC-32 of the announced image
NUMBER: uint8_at = 11  # number of the last check request
TAKEN: uint8_at = 12  # 1 from the event IMAGE, 2 from REQUEST to the next call: its bytes are still in the buffer
COUNT = 13  # of the last refusal: a number of bytes or words, or a position
WORD = 14  # of the last refusal: the word
HEADER = 15  # of the last BAD_WORD: its image's header where the leader decides, else 0
SIZE = 16

# What next_event returns.
NOTHING = 0  # nothing to do until bytes come
WORKING = 1  # there is more to do: call again in the next tick
IMAGE = 2  # store r[LENGTH] bytes at buffer[r[START]], then answer OK; r[CRC] is their CRC-32
READBACK = 3  # send the stored image
CHECK = 4  # answer the check request r[ANNOUNCED], r[NUMBER]
# Refusals: answer ERR and keep the stored image.
CUT_OFF = 5  # r[COUNT] bytes came, then silence
NOT_EMPTY = 6  # the empty image has r[COUNT] bytes
CHANGED_REQUEST = 7  # a request was changed on the way
OTHER_CHECKSUM = 8  # the checksum is r[CRC], not r[ANNOUNCED]
BAD_HEADER = 9  # no image has the header r[WORD]
BAD_WORD = 10  # no image has r[WORD] at position r[COUNT]; r[HEADER]: not behind that header
TOO_LARGE = 11  # the image has r[COUNT] words, more than the car holds
REQUEST = 12  # no refusal: answer the request at buffer[r[START]] (`motorcade.words.request`)

_UNUSED_IN_THIRD = UNUSED_BITS >> 8
_UNUSED_IN_FOURTH = UNUSED_BITS & 255
_CHECK_MARK = CHECK_HEADER & 255
_REQUEST_MARK = REQUEST_HEADER & 255


def switch_on(r: list[int], most_words: uint16) -> None:
    """Clear the memory; ``most_words`` (LEAST_WORDS to MOST_WORDS) is the size of the largest image."""
    for i in range(SIZE):
        r[i] = 0
    r[MOST_BYTES] = most_words * 4


def room(r: list[int], buffer: bytearray, now: int) -> uint16:
    """Return how many bytes may be copied to ``buffer`` at ``r[END]`` now."""
    if r[END] > r[START] and elapsed_ms(now, r[LAST_BYTE_MS]) >= SILENCE_MS:
        # What came before the silence is not processed yet.
        return 0
    if r[END] == r[MOST_BYTES] and r[START] > 0:
        move_to_start(buffer, r[START], r[END])
        r[END] = r[END] - r[START]
        r[CHECKED] = r[CHECKED] - r[START]
        r[START] = 0
    return r[MOST_BYTES] - r[END]


def add(r: list[int], count: uint16, now: int) -> None:
    """Take ``count`` bytes (1 or more) that were copied to ``buffer`` at ``r[END]``."""
    r[LAST_BYTE_MS] = now
    if r[SKIPS] == 0:
        r[END] = r[END] + count


def next_event(r: list[int], buffer: bytearray, work_words: uint16, now: int) -> uint8:
    """Go on with the bytes in the buffer. Return an event, NOTHING to REQUEST.

    It checks at most ``work_words`` (1 or more) words. It also notices silence, after which the next byte begins an
    image or a request.
    """
    if r[TAKEN]:
        _drop_image(r)
    event = NOTHING
    if r[END] - r[START] >= 4:
        event = _advance(r, buffer, work_words)
    if event != NOTHING:
        return event
    quiet_ms = elapsed_ms(now, r[LAST_BYTE_MS])
    if quiet_ms >= SILENCE_MS:
        event = _end_by_silence(r)
    if quiet_ms >= CHECK_LASTS_MS:
        r[IS_ANNOUNCED] = 0
    return event


def _end_by_silence(r: list[int]) -> uint8:
    """Return IMAGE where nothing but the empty image came, CUT_OFF where part of something did, else NOTHING."""
    count = r[END] - r[START]
    is_empty_image = 1 if r[LENGTH] == 4 and count == 4 else 0
    if count > 0 and is_empty_image == 0:
        _skip(r)
    r[SKIPS] = 0
    if count == 0:
        return NOTHING
    if is_empty_image:
        r[TAKEN] = 1
        return IMAGE
    r[COUNT] = count
    return CUT_OFF


def _advance(r: list[int], buffer: bytearray, work_words: uint16) -> uint8:
    """Go on with the image or request at START, of which there are at least 4 bytes."""
    if r[LENGTH] == 0:
        event = _read_header(r, buffer)
        if event != NOTHING:
            return event
    here = r[END] - r[START]
    if buffer[r[START] + 3] == _CHECK_MARK:
        if here < CHECK_BYTES:
            return NOTHING
        return _take_check(r, buffer)
    if buffer[r[START] + 3] == _REQUEST_MARK:
        if here < REQUEST_BYTES:
            return NOTHING
        return _take_request(r, buffer)
    if r[LENGTH] == 4 and r[IS_ANNOUNCED] == 0:
        # A break or a loose cable makes zeros. So four zeros are an image only between two silences.
        if here == 4:
            return NOTHING
        r[COUNT] = here
        _skip(r)
        return NOT_EMPTY
    if here > r[LENGTH]:
        here = r[LENGTH]
    if _check_words(r, buffer, work_words, r[START] + here - here % 4):
        return WORKING
    if here < r[LENGTH]:
        return NOTHING
    return _end_image(r, buffer)


def _read_header(r: list[int], buffer: bytearray) -> uint8:
    """Set LENGTH by the header at START. Return NOTHING then, else READBACK or a refusal."""
    start = r[START]
    header = _word_at(buffer, start)
    if header == READBACK_HEADER:
        _drop(r, 4)
        return READBACK
    if header == CHECK_HEADER:
        r[LENGTH] = CHECK_BYTES
        return NOTHING
    if header == REQUEST_HEADER:
        r[LENGTH] = REQUEST_BYTES
        return NOTHING
    leader_states = buffer[start]
    follower_words = buffer[start + 1]
    dwell = buffer[start + 2]
    reserved = buffer[start + 3]
    # A dwell has one bit where there are follower words, and none where there are none.
    is_good = 1 if reserved <= MOST_RESERVED and (dwell == 0 or dwell & (dwell - 1) == 0) else 0
    if follower_words == 0:
        is_good = 1 if dwell == 0 and (reserved == 0 or reserved == DECIDES) else 0
    elif dwell == 0:
        is_good = 0
    if leader_states == 0 and reserved & DECIDES:
        is_good = 0
    if is_good == 0:
        r[WORD] = header
        _skip(r)
        return BAD_HEADER
    words = 1 + leader_states + follower_words
    if words * 4 > r[MOST_BYTES]:
        r[COUNT] = words
        _skip(r)
        return TOO_LARGE
    r[LENGTH] = words * 4
    r[CHECKED] = start + 4
    r[CRC] = crc32_of(buffer, start, start + 4, 0)
    r[BAD_POSITION] = 0
    return NOTHING


def _take_check(r: list[int], buffer: bytearray) -> uint8:
    """Take the whole check request at START. Return CHECK, or CHANGED_REQUEST."""
    checksum = 0
    number = 0
    for i in range(5):
        word = _word_at(buffer, r[START] + 4 + i * 4)
        if word & (0xFFFFFFFF ^ 0xFF << PAYLOAD_AT) != MARKS:
            _skip(r)
            return CHANGED_REQUEST
        checksum = (checksum << 8 | number) & 0xFFFFFFFF
        number = word >> PAYLOAD_AT & 255
    r[ANNOUNCED] = checksum
    r[NUMBER] = number
    r[IS_ANNOUNCED] = 1
    _drop(r, CHECK_BYTES)
    return CHECK


def _take_request(r: list[int], buffer: bytearray) -> uint8:
    """Take the whole request at START. Return REQUEST, or CHANGED_REQUEST."""
    checksum = 0
    for i in range(8):
        checksum = (checksum << 4 | buffer[r[START] + SUM_AT + i] & 15) & 0xFFFFFFFF
    if checksum != crc32_of(buffer, r[START] + KIND_AT, r[START] + SUM_AT, 0):
        _skip(r)
        return CHANGED_REQUEST
    r[TAKEN] = 2
    return REQUEST


def _check_words(r: list[int], buffer: bytearray, work_words: uint16, end: uint16) -> uint8:
    """Check the control words up to index ``end``, at most ``work_words``. Return 1 where some are left, else 0."""
    begin = r[CHECKED]
    is_left = 0
    if end - begin > work_words * 4:
        end = begin + work_words * 4
        is_left = 1
    if end == begin:
        return is_left
    at: uint16 = begin
    start: uint16 = r[START]
    last_leader_word: uint16 = start
    if buffer[start + 3] & DECIDES:
        last_leader_word = start + buffer[start] * 4
    while at < end:
        is_bad: uint8 = (buffer[at + 2] & _UNUSED_IN_THIRD) | (buffer[at + 3] & _UNUSED_IN_FOURTH)
        if at <= last_leader_word:
            is_bad = _leader_word_fault(buffer, start, at)
        if is_bad and r[BAD_POSITION] == 0:
            r[BAD_POSITION] = (at - start) // 4
        at = at + 4
    r[CRC] = crc32_of(buffer, begin, end, r[CRC])
    r[CHECKED] = end
    return is_left


def _leader_word_fault(buffer: bytearray, start: uint16, at: uint16) -> uint8:
    """Return what is wrong with the leader word at ``at`` of a leader that decides; its image begins at ``start``."""
    return word_fault(
        buffer[at],
        buffer[at + 1],
        buffer[at + 2],
        buffer[at + 3],
        buffer[start],
        buffer[start + 1],
        buffer[start + 3] & TAGGED,
    )


def _end_image(r: list[int], buffer: bytearray) -> uint8:
    """Return IMAGE, or a refusal, for the whole image at START, of which all words were checked."""
    if r[BAD_POSITION]:
        r[COUNT] = r[BAD_POSITION]
        r[HEADER] = 0
        if buffer[r[START] + 3] & DECIDES:
            r[HEADER] = _word_at(buffer, r[START])
        r[WORD] = _word_at(buffer, r[START] + r[BAD_POSITION] * 4)
        _skip(r)
        return BAD_WORD
    if r[IS_ANNOUNCED] and r[CRC] != r[ANNOUNCED]:
        _skip(r)
        return OTHER_CHECKSUM
    r[TAKEN] = 1
    return IMAGE


def _drop_image(r: list[int]) -> None:
    """Remove the image or the request that the shell has taken from the buffer."""
    is_image = 1 if r[TAKEN] == 1 else 0
    r[TAKEN] = 0
    if is_image and r[IS_ANNOUNCED]:
        # What follows an announced image was not announced.
        r[IS_ANNOUNCED] = 0
        _skip(r)
    else:
        _drop(r, r[LENGTH])


def _drop(r: list[int], count: uint16) -> None:
    """Remove ``count`` bytes from the start of the buffer."""
    r[LENGTH] = 0
    r[START] = r[START] + count
    # A request checks no words, and the index may not fall below 0 when the buffer's bytes move to its start.
    r[CHECKED] = r[START]
    if r[START] == r[END]:
        r[START] = 0
        r[END] = 0


def _skip(r: list[int]) -> None:
    """Remove all bytes from the buffer, and ignore what comes up to the next silence.

    After a wrong word the rest may not begin at a word: only silence marks where the next image begins.
    """
    r[LENGTH] = 0
    r[START] = 0
    r[END] = 0
    r[SKIPS] = 1


def _word_at(buffer: bytearray, at: uint16) -> int:
    """Return the word in the four bytes from index ``at`` on."""
    return buffer[at] << 24 | buffer[at + 1] << 16 | buffer[at + 2] << 8 | buffer[at + 3]
