"""A word on the air: parity, air time, and the marks and spaces of its frame.

Portable; the functions of integers are compiled into the simulator too. A
frame has the shape of the NEC remote control's, with 32 free bits: a mark of 16
units, a space of 8, then each bit, most significant first, as a mark of 1 unit
and a space of 1 (a zero) or 3 (a one), and one mark to end. A unit is 560 µs.
"""

UNIT_US = 560
HEADER_MARK_UNITS = 16
HEADER_SPACE_UNITS = 8
ZERO_SPACE_UNITS = 1
ONE_SPACE_UNITS = 3
_FIXED_UNITS = HEADER_MARK_UNITS + HEADER_SPACE_UNITS + 32 * (1 + ZERO_SPACE_UNITS) + 1


def ones(word: int) -> int:
    """How many of the 32 bits are set."""
    word = word - (word >> 1 & 0x55555555)
    word = (word & 0x33333333) + (word >> 2 & 0x33333333)
    word = (word + (word >> 4)) & 0x0F0F0F0F
    word = word + (word >> 8)
    return (word + (word >> 16)) & 63


def to_frame(word: int) -> int:
    """``word`` as it goes on the air: bit 0 set or cleared for an even number of ones (seed 000, c9)."""
    word = word & 0xFFFFFFFE
    return word | (ones(word) & 1)


def parity_is_even(frame: int) -> int:
    """1 where a frame holds an even number of ones, as every good one does, else 0."""
    return 1 - (ones(frame) & 1)


def air_us(frame: int, unit_us: int) -> int:
    """How long a frame takes on the air in µs: with 560 µs units 49,840 (all zeros) to 85,680 (all ones)."""
    return (_FIXED_UNITS + (ONE_SPACE_UNITS - ZERO_SPACE_UNITS) * ones(frame)) * unit_us


def frame_durations_us(frame: int, unit_us: int = UNIT_US) -> list[int]:
    """The frame's 67 durations in µs: mark, space, mark, ... mark."""
    units = [HEADER_MARK_UNITS, HEADER_SPACE_UNITS]
    for bit in range(31, -1, -1):
        units.append(1)
        units.append(ONE_SPACE_UNITS if frame >> bit & 1 else ZERO_SPACE_UNITS)
    units.append(1)
    return [count * unit_us for count in units]


class FrameReceiver:
    """Marks and spaces in, frames out; pure, and in step again at the next header whatever came before.

    Args:
        unit_us: the sender's unit.
        tolerance_percent: how far a header's mark and space may be off. The spaces
            of bits are told apart halfway between a zero's and a one's.
    """

    def __init__(self, unit_us: int = UNIT_US, tolerance_percent: int = 25) -> None:
        self._unit_us = unit_us
        self._tolerance_percent = tolerance_percent
        self._frames: list[int] = []
        self._in_header = False
        self._bits_left: int | None = None
        self._bits = 0

    def receive_mark(self, duration_us: int) -> None:
        """The carrier was there for ``duration_us``."""
        if self._about(duration_us, HEADER_MARK_UNITS):
            self._restart()
            self._in_header = True
        elif not self._short(duration_us) or self._bits_left is None:
            self._restart()
        elif self._bits_left == 0:
            self._frames.append(self._bits)
            self._restart()

    def receive_space(self, duration_us: int) -> None:
        """The carrier was away for ``duration_us``, between two marks."""
        if self._in_header:
            self._in_header = False
            self._bits_left = 32 if self._about(duration_us, HEADER_SPACE_UNITS) else None
        elif self._bits_left:
            if not self._unit_us < 2 * duration_us < 10 * self._unit_us:
                self._restart()
                return
            one = 2 * duration_us > (ZERO_SPACE_UNITS + ONE_SPACE_UNITS) * self._unit_us
            self._bits = self._bits << 1 | (1 if one else 0)
            self._bits_left -= 1

    def next_frame(self) -> int | None:
        """The next whole frame as 32 bits, its parity not yet checked; None when there is none."""
        return self._frames.pop(0) if self._frames else None

    def _restart(self) -> None:
        self._in_header = False
        self._bits_left = None
        self._bits = 0

    def _about(self, duration_us: int, units: int) -> bool:
        nominal_us = units * self._unit_us
        return abs(duration_us - nominal_us) * 100 <= self._tolerance_percent * nominal_us

    def _short(self, duration_us: int) -> bool:
        return self._unit_us < 2 * duration_us < 4 * self._unit_us
