"""Durations made of levels: what can be made, what is nearest, and how to cut a step with the fewest cuts."""

from functools import lru_cache
from heapq import heappop, heappush
from math import ceil, floor

# No program holds more words than this, so no step is cut into more pieces.
MOST_PIECES = 255


@lru_cache(maxsize=4096)
def to_ms(seconds: float) -> int | None:
    """``seconds`` in whole milliseconds, or None where they are none."""
    duration_ms = round(seconds * 1000)
    return duration_ms if abs(duration_ms - seconds * 1000) < 1e-6 else None


@lru_cache(maxsize=4096)
def cut(
    durations_ms: tuple[int, ...], lengths_ms: tuple[int, ...], levels_ms: tuple[int, ...]
) -> tuple[int, ...] | None:
    """Cut blocks that start together into the fewest pieces that words can hold.

    Each piece lasts one of ``lengths_ms``; a block either goes on through the
    whole piece or ends in it after one of ``levels_ms``. Among cuts of the same
    number of pieces, the one that is longest first.

    Args:
        durations_ms: how long each block lasts.
        lengths_ms: allowed lengths of a piece, above 0.
        levels_ms: allowed durations of a block in a piece.

    Returns:
        The pieces' lengths in order, or None where there is no such cut. Blocks
        that last no time at all make no piece.
    """
    total_ms = max(durations_ms, default=0)
    if total_ms == 0:
        return ()
    if total_ms in lengths_ms and all(duration in levels_ms for duration in durations_ms):
        return (total_ms,)
    longest_first = sorted(lengths_ms, reverse=True)
    if not longest_first or total_ms > MOST_PIECES * longest_first[0]:
        return None
    came_from: dict[int, tuple[int, int]] = {}
    reached = [0]
    while reached and total_ms not in came_from:
        beyond = []
        for begin in reached:
            for length in longest_first:
                end = begin + length
                if end > total_ms or end in came_from:
                    continue
                if all(d <= begin or d >= end or d - begin in levels_ms for d in durations_ms):
                    came_from[end] = (begin, length)
                    beyond.append(end)
        reached = beyond
    if total_ms not in came_from:
        return None
    pieces = []
    at = total_ms
    while at:
        at, length = came_from[at]
        pieces.append(length)
    return tuple(reversed(pieces))


def pieces_needed(duration_ms: int, levels_ms: tuple[int, ...]) -> int:
    """How many pieces a duration beyond MOST_PIECES takes at the least."""
    return -(-duration_ms // levels_ms[-1])


@lru_cache(maxsize=4096)
def is_sum(duration_ms: int, levels_ms: tuple[int, ...]) -> bool:
    """Whether levels add up to ``duration_ms``."""
    return duration_ms >= _smallest_sums(levels_ms).get(duration_ms % levels_ms[1], duration_ms + 1)


def nearest_sums(duration_s: float, levels_ms: tuple[int, ...]) -> tuple[float, float]:
    """The largest sum of levels below ``duration_s`` (at least 0) and the smallest above it, in seconds."""
    below_ms = ceil(duration_s * 1000 - 1e-6) - 1
    above_ms = floor(duration_s * 1000 + 1e-6) + 1
    step_ms = levels_ms[1]
    below, above = [0], []
    for residue, smallest in _smallest_sums(levels_ms).items():
        if smallest <= below_ms:
            below.append(below_ms - (below_ms - residue) % step_ms)
        above.append(max(smallest, above_ms + (residue - above_ms) % step_ms))
    return max(below) / 1000, min(above) / 1000


@lru_cache(maxsize=64)
def _smallest_sums(levels_ms: tuple[int, ...]) -> dict[int, int]:
    """For each remainder modulo the shortest duration the smallest sum of levels that leaves it.

    Every larger number with that remainder is a sum too: add the shortest duration.
    """
    step_ms = levels_ms[1]
    smallest: dict[int, int] = {}
    open_sums = [0]
    while open_sums:
        found = heappop(open_sums)
        if found % step_ms in smallest:
            continue
        smallest[found % step_ms] = found
        for level in levels_ms[2:]:
            heappush(open_sums, found + level)
    return smallest
