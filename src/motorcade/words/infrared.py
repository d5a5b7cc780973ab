"""A word as an infrared frame: tag, check and parity, air time, marks and spaces.

Portable; the engine compiles the functions of integers, too. A frame has the
shape of an NEC remote control's, with 32 free bits: a mark of 16 units and a
space of 8, then for each bit, most significant first, a mark of 1 unit and a
space of 1 (a zero) or 3 (a one), and one mark at the end. A unit is 560 µs.

A tagged frame has a tag in bits 10 to 6, the number of the leader's slot, and five
check bits in bits 5 to 1. With the parity bit the 32 bits are an extended Hamming
code (32,26), which finds every one, two or three flipped bits. Source: the
protocol's section "Tagged words".

A remote control's frame ends in its command and the command's complement. No bare
frame does, since its bits 10 to 1 are 0. Of tagged frames a leader passes over the
tags with which one would, so a car may refuse all such frames.
"""

from motorcade.words import uint8, uint16

# For the type checker alone: MicroPython has no such module.
MYPY = False
if MYPY:
    from collections.abc import Sequence

TAGS = 31
# A tag is newer than another from 1 to so many slots after it.
NEWER_SLOTS = 15
# Bits 31 to 11: the word of a frame, without tag, check and parity.
ACTION_BITS = 0xFFFFF800
# An integer from 2^30 up is an object for MicroPython: bits are looked at in halves.
LOWER_HALF = 0xFFFF
# Bit n is 1 where n, 0 to 15, has an odd number of ones.
ODD = 0x6996

# In FrameReceiver: no header came.
_NO_FRAME = -1

UNIT_US = 560
HEADER_MARK_UNITS = 16
HEADER_SPACE_UNITS = 8
ZERO_SPACE_UNITS = 1
ONE_SPACE_UNITS = 3
_FIXED_UNITS = HEADER_MARK_UNITS + HEADER_SPACE_UNITS + 32 * (1 + ZERO_SPACE_UNITS) + 1


def ones(word: int) -> uint8:
    """Return how many of the 32 bits are set."""
    upper: uint16 = word >> 16
    lower: uint16 = word & LOWER_HALF
    upper = upper - (upper >> 1 & 0x5555)
    lower = lower - (lower >> 1 & 0x5555)
    fours: uint16 = (upper & 0x3333) + (upper >> 2 & 0x3333) + (lower & 0x3333) + (lower >> 2 & 0x3333)
    eights: uint16 = (fours & 0x0F0F) + (fours >> 4 & 0x0F0F)
    return (eights + (eights >> 8)) & 63


def to_frame(word: int) -> int:
    """Return the frame of ``word``: bit 0 makes the number of ones even (seed 000, c9)."""
    word = word & 0xFFFFFFFE
    return word | is_odd(word >> 16 ^ word & LOWER_HALF)


def parity_is_even(frame: int) -> uint8:
    """Return 1 where the number of ones in a frame is even, as in every good frame, else 0."""
    return 1 - is_odd(frame >> 16 ^ frame & LOWER_HALF)


def is_odd(half: uint16) -> uint8:
    """Return 1 where the number of ones among 16 bits is odd, else 0."""
    half = half ^ half >> 8
    return ODD >> ((half ^ half >> 4) & 15) & 1


def check_of(frame: int) -> uint8:
    """Return the check, 0 to 31, that belongs to bits 31 to 6 of a frame."""
    return _check(frame >> 16, frame & LOWER_HALF)


def _check(upper: uint16, lower: uint16) -> uint8:
    """Return the check of a frame that is given as its halves.

    The bits are numbered, from bit 31 down, by the integers from 3 to 31 that are no powers of two: bits 20 to 6 count
    to 31, bits 27 to 21 to 15, bits 30 to 28 to 7, and bit 31 is number 3. Bit k of the check is 1 where an odd number
    of those bits are 1 whose number has bit k set. Once bit k is known, numbers that differ in bit k alone are added.
    """
    to_31: uint16 = (upper & 31) << 10 | lower >> 6
    with_8: uint16 = to_31 & 255 ^ upper >> 5 & 127
    eights: uint16 = to_31 >> 8 ^ with_8
    with_4: uint16 = eights & 15 ^ upper >> 12 & 7
    fours: uint16 = eights >> 4 ^ with_4 ^ upper >> 15
    high: uint8 = is_odd(to_31) << 2 | is_odd(with_8) << 1 | ODD >> with_4 & 1
    return high << 2 | (ODD >> (fours & 3) & 1) << 1 | ODD >> (fours & 5) & 1


def tag_of(frame: int) -> uint8:
    """Return the tag of a frame: 1 to 31, or 0 for a bare frame."""
    return frame >> 6 & 31


def word_of(frame: int) -> int:
    """Return the control word of a frame: without tag, check and parity."""
    return frame & ACTION_BITS


def check_is_good(frame: int) -> uint8:
    """Return 1 where the check of a tagged frame belongs to its word and tag, else 0."""
    return 1 if check_of(frame) == frame >> 1 & 31 else 0


def tagged_frame(word: int, tag: uint8) -> int:
    """Return the frame of ``word``, of which bits 31 to 11 count, with ``tag``, 1 to 31."""
    upper: uint16 = word >> 16
    lower: uint16 = word & 0xF800 | tag << 6
    lower = lower | _check(upper, lower) << 1
    return upper << 16 | lower | is_odd(upper ^ lower)


def is_remote_control(frame: int) -> uint8:
    """Return 1 where bits 7 to 0 are the complement of bits 15 to 8, as in each frame of NEC's protocols, else 0."""
    return 1 if (frame ^ frame >> 8) & 255 == 255 else 0


def next_tag(tag: uint8, word: int) -> uint8:
    """Return the tag of the slot of ``word`` after the one with ``tag``: after 31 comes 1.

    A tag with which the frame would look like a remote control's is passed over; the one after it never does.
    """
    tag = tag % TAGS + 1
    if is_remote_control(tagged_frame(word, tag)):
        tag = tag % TAGS + 1
    return tag


def slot_tags(words: "Sequence[int]", slots: int) -> list[int]:
    """Return the tags of the first ``slots`` slots of a leader that is switched on with these follower words."""
    tags = []
    tag = 0
    for slot in range(slots):
        tag = next_tag(tag, words[slot % len(words)])
        tags.append(tag)
    return tags


def tag_is_newer(tag: uint8, other: uint8) -> uint8:
    """Return 1 where ``tag`` is 1 to 15 slots after ``other``, else 0."""
    slots = (tag + TAGS - other) % TAGS
    return 1 if 1 <= slots <= NEWER_SLOTS else 0


def air_us(frame: int, unit_us: int) -> int:
    """Return the duration of a frame in µs: with units of 560 µs 49,840 (all zeros) to 85,680 (all ones)."""
    return (_FIXED_UNITS + (ONE_SPACE_UNITS - ZERO_SPACE_UNITS) * ones(frame)) * unit_us


def frame_durations_us(frame: int, unit_us: int = UNIT_US) -> list[int]:
    """Return the 67 durations of a frame in µs: mark, space, mark, ... mark."""
    units = [HEADER_MARK_UNITS, HEADER_SPACE_UNITS]
    for bit in range(31, -1, -1):
        units.append(1)
        units.append(ONE_SPACE_UNITS if frame >> bit & 1 else ZERO_SPACE_UNITS)
    units.append(1)
    return [count * unit_us for count in units]


class FrameReceiver:
    """Find frames in marks and spaces. After noise it finds the next frame by its header.

    Args:
        unit_us: the sender's unit.
        tolerance_percent: how far the mark and the space of a header may differ from
            their nominal duration. The spaces of bits are distinguished halfway
            between the one of a zero and the one of a one.
    """

    def __init__(self, unit_us: int = UNIT_US, tolerance_percent: int = 25) -> None:
        # Durations between these, in µs; a microcontroller takes long for calls and multiplications at each edge.
        self._header_mark = _around(HEADER_MARK_UNITS * unit_us, tolerance_percent)
        self._header_space = _around(HEADER_SPACE_UNITS * unit_us, tolerance_percent)
        self._least_us = unit_us // 2 + 1
        self._longest_mark_us = (4 * unit_us - 1) // 2
        self._longest_space_us = (10 * unit_us - 1) // 2
        self._longest_zero_us = (ZERO_SPACE_UNITS + ONE_SPACE_UNITS) * unit_us // 2
        self._frames: list[int] = []
        self._in_header = False
        self._bits_left = _NO_FRAME
        # The two halves of the bits: 32 bits are no small integer on a microcontroller.
        self._high = 0
        self._low = 0

    def receive_mark(self, duration_us: int) -> bool:
        """Take a mark: the carrier was on for ``duration_us``. Return whether it ends a frame."""
        bits_left = self._bits_left
        if bits_left > 0 and self._least_us <= duration_us <= self._longest_mark_us:
            return False
        self._bits_left = _NO_FRAME
        if bits_left == 0 and self._least_us <= duration_us <= self._longest_mark_us:
            self._frames.append(self._high << 16 | self._low)
            return True
        self._in_header = self._header_mark[0] <= duration_us <= self._header_mark[1]
        return False

    def receive_space(self, duration_us: int) -> None:
        """Take a space between two marks: the carrier was off for ``duration_us``."""
        bits_left = self._bits_left
        if bits_left > 0:
            if not self._least_us <= duration_us <= self._longest_space_us:
                self._bits_left = _NO_FRAME
                return
            bit = 1 if duration_us > self._longest_zero_us else 0
            if bits_left > 16:
                self._high = self._high << 1 | bit
            else:
                self._low = self._low << 1 | bit
            self._bits_left = bits_left - 1
        elif self._in_header:
            self._in_header = False
            if self._header_space[0] <= duration_us <= self._header_space[1]:
                self._bits_left = 32
                self._high = 0
                self._low = 0

    def next_frame(self) -> int | None:
        """Return the next whole frame as 32 bits, its parity unchecked; None where there is none."""
        return self._frames.pop(0) if self._frames else None


def _around(nominal_us: int, tolerance_percent: int) -> tuple[int, int]:
    """Return the least and the greatest duration that differs by at most the tolerance."""
    difference_us = tolerance_percent * nominal_us // 100
    return nominal_us - difference_us, nominal_us + difference_us
