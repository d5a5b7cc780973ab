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
        # A full deque drops its oldest time.
        self._times_ms: deque[int] = deque(maxlen=most)

    def wait_ms(self, now_ms: int) -> int:
        """How long it has to wait at ``now_ms`` (ticks); 0 where it may be done at once."""
        if len(self._times_ms) < (self._times_ms.maxlen or 0):
            return 0
        return max(self._window_ms - elapsed_ms(now_ms, self._times_ms[0]), 0)

    def add(self, now_ms: int) -> None:
        """Count that it was done at ``now_ms`` (ticks)."""
        self._times_ms.append(now_ms)

    def allows(self, now_ms: int) -> bool:
        """Whether it may be done once more at ``now_ms`` (ticks); if so, it counts."""
        if self.wait_ms(now_ms):
            return False
        self.add(now_ms)
        return True


class Attempts:
    """Limit the attempts of each key, an address or a name; who has made too many has to wait, also with a right one.

    Args:
        most: how many a key may have in a window.
        window_s: the length of the window.
        code: of the error where there are too many.
    """

    def __init__(self, most: int, window_s: float, code: str = "too-many-attempts") -> None:
        self._most = most
        self._window_s = window_s
        self._code = code
        self._limits: OrderedDict[str, RateLimit] = OrderedDict()

    def check(self, key: str, now_s: float) -> None:
        """Raise MotorcadeError, with the seconds to wait, and how many a second are allowed, if there were too many."""
        limit = self._limits.get(key)
        wait_ms = limit.wait_ms(to_ticks(now_s)) if limit else 0
        if wait_ms:
            seconds = math.ceil(wait_ms / 1000)
            raise MotorcadeError(self._code, seconds=seconds, most=math.ceil(self._most / self._window_s))

    def add(self, key: str, now_s: float) -> None:
        """Count an attempt."""
        if key not in self._limits:
            self._limits[key] = RateLimit(self._most, int(self._window_s * 1000))
        self._limits[key].add(to_ticks(now_s))
        self._limits.move_to_end(key)
        if len(self._limits) > _MOST_KEYS:
            self._limits.popitem(last=False)

    def count(self, key: str, now_s: float) -> None:
        """Count an attempt. Raises MotorcadeError where there were too many."""
        self.check(key, now_s)
        self.add(key, now_s)
