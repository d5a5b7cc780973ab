"""The clock of a car that is driven."""

import time

from motorcade.words.ticks import TICKS_MASK


def monotonic_ms() -> int:
    """Milliseconds that never go back and wrap, as `motorcade.words.ticks` says."""
    return time.monotonic_ns() // 1_000_000 & TICKS_MASK
