"""Durations made of levels: what can be made, what is nearest, and how to cut a step with the fewest cuts."""

from bisect import bisect_right
from functools import lru_cache
from math import gcd

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
    sums, step_ms = _sums(levels_ms)
    if duration_ms > sums[-1]:
        return duration_ms % step_ms == 0
    return sums[bisect_right(sums, duration_ms) - 1] == duration_ms


def nearest_sums(duration_s: float, levels_ms: tuple[int, ...]) -> tuple[float, ...]:
    """The largest sum of levels below ``duration_s`` and the smallest above it, in seconds."""
    sums, step_ms = _sums(levels_ms)
    if duration_s * 1000 >= sums[-1]:
        below = int(duration_s * 1000) // step_ms * step_ms
        return below / 1000, (below + step_ms) / 1000
    at = bisect_right(sums, duration_s * 1000)
    return sums[at - 1] / 1000, sums[at] / 1000


@lru_cache(maxsize=64)
def _sums(levels_ms: tuple[int, ...]) -> tuple[list[int], int]:
    """All sums of levels up to where every multiple of their common divisor is one, and that divisor."""
    positive = [level for level in levels_ms if level]
    step_ms = gcd(*positive)
    # Beyond the product of the two largest (in steps) no multiple is missing; a
    # profile's four levels keep this small.
    limit = positive[-1] // step_ms * (positive[-2] if len(positive) > 1 else step_ms) + positive[-1]
    possible = {0}
    sums = [0]
    for candidate in range(step_ms, min(limit, MOST_PIECES * positive[-1]) + 1, step_ms):
        if any(candidate - level in possible for level in positive):
            possible.add(candidate)
            sums.append(candidate)
    return sums, step_ms
