"""The clock of this computer in ms that wrap, and how often something may be done."""

import time
from collections import deque

from motorcade.words.ticks import TICKS_MASK, elapsed_ms


def to_ticks(seconds: float) -> int:
    """A time in seconds as milliseconds that wrap, as `motorcade.words.ticks` defines them."""
    return int(seconds * 1000) & TICKS_MASK


def monotonic_ms() -> int:
    """The time now in milliseconds that never go back and wrap, as `motorcade.words.ticks` defines them."""
    return time.monotonic_ns() // 1_000_000 & TICKS_MASK


class RateLimit:
    """Allow something at most ``most`` times in any ``window_ms``.

    Args:
        most: at least 1.
        window_ms: length of the window.
    """

    def __init__(self, most: int, window_ms: int) -> None:
        self._window_ms = window_ms
        self._times_ms: deque[int] = deque(maxlen=most)

    def allows(self, now_ms: int) -> bool:
        """Whether it may be done once more at ``now_ms`` (ticks); if so, it counts."""
        times_ms = self._times_ms
        if len(times_ms) == times_ms.maxlen and elapsed_ms(now_ms, times_ms[0]) < self._window_ms:
            return False
        # A full deque drops its oldest time.
        times_ms.append(now_ms)
        return True
