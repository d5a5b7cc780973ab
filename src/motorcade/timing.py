"""The clock of this computer in ms that wrap, and how often something may be done."""

import math
import time
from collections import OrderedDict, deque

from motorcade.errors import MotorcadeError
from motorcade.words.ticks import TICKS_MASK, elapsed_ms

# Of so many keys attempts are counted: the oldest is forgotten.
_MOST_KEYS = 4096


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


class Attempts:
    """Count attempts of each key, an address or a name; who has made too many has to wait, also with a right one.

    Args:
        most: how many a key may have in a window.
        window_s: the length of the window.
        code: of the error where there are too many.
    """

    def __init__(self, most: int, window_s: float, code: str = "too-many-attempts") -> None:
        self._most, self._window_s, self._code = most, window_s, code
        self._times_s: OrderedDict[str, deque[float]] = OrderedDict()

    def check(self, key: str, now_s: float) -> None:
        """Raise MotorcadeError, with the seconds to wait, and how many a second are allowed, if there were too many."""
        times_s = self._times_s.get(key, deque())
        if len(times_s) == self._most and now_s - times_s[0] < self._window_s:
            seconds = max(math.ceil(self._window_s - (now_s - times_s[0])), 1)
            raise MotorcadeError(self._code, seconds=seconds, most=math.ceil(self._most / self._window_s))

    def add(self, key: str, now_s: float) -> None:
        """Count an attempt."""
        self._times_s.setdefault(key, deque(maxlen=self._most)).append(now_s)
        self._times_s.move_to_end(key)
        if len(self._times_s) > _MOST_KEYS:
            self._times_s.popitem(last=False)

    def count(self, key: str, now_s: float) -> None:
        """Count an attempt. Raises MotorcadeError where there were too many."""
        self.check(key, now_s)
        self.add(key, now_s)
