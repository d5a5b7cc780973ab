"""Time on a car: integer milliseconds that wrap at 2^30, as MicroPython's do."""

from motorcade.words import uint8

TICKS_MASK = (1 << 30) - 1


def elapsed_ms(now_ms: int, then_ms: int) -> int:
    """Return the milliseconds from ``then_ms`` to ``now_ms``, also across the wrap. Subtract times in no other way."""
    return (now_ms - then_ms) & TICKS_MASK


def later_ms(now_ms: int, duration_ms: int) -> int:
    """Return the tick ``duration_ms`` after ``now_ms``."""
    return (now_ms + duration_ms) & TICKS_MASK


def reached(now_ms: int, due_ms: int) -> uint8:
    """Return 1 where ``due_ms`` is now or past, 0 where it is still to come (at most 2^29 ms, six days, ahead)."""
    return 1 if (now_ms - due_ms) & TICKS_MASK < 1 << 29 else 0
