"""Stamps in drive words, by which a car notices that a word was sent long ago. Pure: the time is an argument.

After a stall the network delivers old words one by one, and each looks new. A stamp says when its word was sent, by the
sender's clock. Clocks of two computers differ, so a car compares: the smallest difference of arrival and stamp in the
last minute belongs to a word that was not delayed. Source: the protocol's section "Stamped drive words".
"""

from motorcade.words.formats import DRIVE
from motorcade.words.ticks import elapsed_ms

STAMP_MASK = (1 << DRIVE.field("reserved").high + 1) - 1
# A stamp comes round after so many steps.
_STEPS = STAMP_MASK
_STEP_MS = 4
_ROUND_MS = _STEPS * _STEP_MS
# A word can be so much faster than all before it; what looks faster still is a whole round too slow.
_FASTER_MS = 1000
_HALF_MINUTE_MS = 30_000


def stamp_at(now_ms: int) -> int:
    """The stamp, 1 to 2047, of what is sent at ``now_ms`` (any clock that never goes back, from 0)."""
    return 1 + now_ms // _STEP_MS % _STEPS


class Freshness:
    """Find the words of one connection that were sent too long ago.

    Args:
        stale_ms: a word is old that took so much longer than the fastest of the last minute.
    """

    def __init__(self, stale_ms: int) -> None:
        self._stale_ms = stale_ms
        self._now_ms = 0
        self._ticks: int | None = None
        # The smallest difference in the present half minute and in the one before it; None where no word came.
        self._smallest: int | None = None
        self._smallest_before: int | None = None
        self._until_ms = _HALF_MINUTE_MS
        self._has_stamped = False

    def is_fresh(self, stamp: int, now: int) -> bool:
        """Whether a word with this stamp, that came at ``now`` (ticks), is fresh.

        Without stamps (0) every word is fresh; a client that has once stamped must go on.
        """
        self._advance(now)
        known = [each for each in (self._smallest, self._smallest_before) if each is not None]
        if stamp == 0:
            return not self._has_stamped
        self._has_stamped = True
        difference_ms = (self._now_ms - (stamp - 1) * _STEP_MS) % _ROUND_MS
        if not known:
            self._smallest = difference_ms
            return True
        smallest = min(known)
        later_ms = (difference_ms - smallest + _FASTER_MS) % _ROUND_MS - _FASTER_MS
        difference_ms = smallest + later_ms
        self._smallest = difference_ms if self._smallest is None else min(self._smallest, difference_ms)
        return later_ms <= self._stale_ms

    def _advance(self, now: int) -> None:
        """Count the time on, since ticks wrap in the middle of a stamp's round."""
        self._now_ms += elapsed_ms(now, self._ticks) if self._ticks is not None else 0
        self._ticks = now
        if self._now_ms >= self._until_ms:
            is_next = self._now_ms < self._until_ms + _HALF_MINUTE_MS
            self._smallest_before, self._smallest = self._smallest if is_next else None, None
            self._until_ms = self._now_ms + _HALF_MINUTE_MS
