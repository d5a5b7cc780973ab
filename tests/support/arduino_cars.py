"""What emulated Arduino cars of the tests do: their words, their limits, and the frames at the pin of their sender."""

from itertools import pairwise

from motorcade.words.infrared import FrameReceiver, frame_durations_us
from motorcade.words.packing import words_to_bytes

CYCLES_A_US = 16
CARRIER_HZ = 38_000
# A longer pause between two pulses is a space.
SPACE_US = 40
_HALF_PERIOD_US = 1e6 / CARRIER_HZ / 2
_MARKS_AND_SPACES = 67


def checked_frames(edges: list[tuple[int, int]]) -> list[int]:
    """Return the frames in a pin's edges, each the cycle and the level.

    Fails unless the carrier is 38 kHz ± 1%, and each mark and space of a frame is as long as it should be ± 5%.
    """
    rises_us = [cycle / CYCLES_A_US for cycle, level in edges if level]
    periods_us = [later - earlier for earlier, later in pairwise(rises_us) if later - earlier < SPACE_US]
    carrier_hz = 1e6 * len(periods_us) / sum(periods_us)
    assert abs(carrier_hz - CARRIER_HZ) <= CARRIER_HZ / 100
    assert max(periods_us) - min(periods_us) < 1
    # The first mark may have begun before the record.
    marks = _marks(edges)[1:]
    first = next(index for index, (begin, end) in enumerate(marks) if end - begin > 5000)
    durations = [edge for (begin, end), (after, _) in pairwise(marks[first:]) for edge in (end - begin, after - end)]
    receiver, frames = FrameReceiver(), []
    for index, duration_us in enumerate(durations):
        (receiver.receive_space if index % 2 else receiver.receive_mark)(round(duration_us))
        frame = receiver.next_frame()
        frames += [frame] if frame is not None else []
    # A pause follows the last mark of each.
    for frame, begin in zip(frames, range(0, len(durations), _MARKS_AND_SPACES + 1), strict=False):
        for index, nominal_us in enumerate(frame_durations_us(frame)):
            measured_us = durations[begin + index] + (-_HALF_PERIOD_US if index % 2 else _HALF_PERIOD_US)
            assert abs(measured_us - nominal_us) <= nominal_us * 0.05
    return frames


def _marks(edges: list[tuple[int, int]]) -> list[tuple[float, float]]:
    """Where each mark begins and ends, in µs: from its first pulse to the end of its last one."""
    marks: list[tuple[float, float]] = []
    for cycle, level in edges:
        at_us = cycle / CYCLES_A_US
        if level and (not marks or at_us - marks[-1][1] > SPACE_US):
            marks.append((at_us, at_us))
        elif marks:
            marks[-1] = (marks[-1][0], at_us)
    return marks


DUTIES = (0, 115, 180, 255)
FORWARD, LEFT, RIGHT = range(3)
LONGEST_TICK_US = 5000
# Of an Uno's 31.5 KB, for the fullest car.
MOST_FLASH_BYTES = 26 * 1024
MOST_RAM_BYTES = 1638


def word(direction: int, speed: int, led: int, seconds: int = 3) -> int:
    """A word that drives and lights an LED for so long; infrared is accepted by followers alone."""
    return 1 << 29 | direction << 27 | speed << 25 | seconds << 23 | led << 21 | seconds << 19


# Followers' words last longer than a dwell, which is 2 s.
LEADS = ((LEFT, 2, 0), (FORWARD, 0, 2), (RIGHT, 3, 1))
STATES = tuple(word(*does, seconds) for does, seconds in zip(LEADS, (1, 1, 2), strict=True))
FOLLOW = ((LEFT, 1, 1), (RIGHT, 2, 0), (LEFT, 3, 3))
WORDS = tuple(1 << 31 | word(*does) for does in FOLLOW)
BARE = words_to_bytes((0x03030200, *STATES, *WORDS))
FORWARD_BIT = 1 << 30
TAGGED = words_to_bytes((0x03030201, *STATES, *(word | FORWARD_BIT for word in WORDS)))
