"""Bound how often an address, or for a name, something may be tried: codes, personal numbers, passwords, joining."""

import math
from collections import OrderedDict, deque

from motorcade.errors import MotorcadeError

_MOST_KEYS = 4096


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
        """Raise MotorcadeError, with the seconds to wait, where there were too many."""
        times_s = self._times_s.get(key, deque())
        if len(times_s) == self._most and now_s - times_s[0] < self._window_s:
            raise MotorcadeError(self._code, seconds=max(math.ceil(self._window_s - (now_s - times_s[0])), 1))

    def add(self, key: str, now_s: float) -> None:
        """Count an attempt."""
        self._times_s.setdefault(key, deque(maxlen=self._most)).append(now_s)
        self._times_s.move_to_end(key)
        if len(self._times_s) > _MOST_KEYS:
            self._times_s.popitem(last=False)
