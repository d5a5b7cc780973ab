"""How often something may be done."""

from collections.abc import Callable


class Allowance:
    """So many times a second, and twice as many at once after a pause."""

    def __init__(self, a_second: float, clock: Callable[[], float]):
        self._a_second = a_second
        self._clock = clock
        self._left = 2.0 * a_second
        self._at_s = clock()

    def take(self) -> bool:
        """Whether it may be done once more."""
        now_s = self._clock()
        self._left = min(self._left + (now_s - self._at_s) * self._a_second, 2.0 * self._a_second)
        self._at_s = now_s
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True
