"""Stamps in drive words, by which a car notices that a word was sent long ago. Pure: the time is an argument.

After a stall the network delivers old words one by one, and each looks new. A stamp says when its word was sent, by the
sender's clock. Clocks of two computers differ, so a car compares: the smallest difference of arrival and stamp in the
last minute belongs to a word that was not delayed. Source: the protocol's section "Stamped drive words".

A stamp comes round after 8.2 s, so it says nothing after a longer silence; and before the first word that came in time
there is nothing to compare with. So at the beginning, and after a silence, the car sends its clock, and the client
answers with it, with the number of words that it has sent, and with its stamp. All later words are younger than that
clock, and the round trip bounds the difference. A client that has no telemetry can't be asked: it sends no stamps.
"""

from typing import NamedTuple

from motorcade.words.formats import DRIVE
from motorcade.words.ticks import TICKS_MASK, elapsed_ms

STAMP_MASK = (1 << DRIVE.field("reserved").high + 1) - 1
# A stamp comes round after so many steps.
STEPS = STAMP_MASK
STEP_MS = 4
_ROUND_MS = STEPS * STEP_MS
# A word can be so much faster than all before it; what looks faster still is a whole round too slow.
_FASTER_MS = 1000
_HALF_MINUTE_MS = 30_000
# After so long without a fresh word stamps alone are not believed. Less than half a round.
_SILENCE_MS = 4000
# An answer is asked for again after so long, and may take as long: slow, but steady networks can be driven in.
_ANSWER_LASTS_MS = 1000


class _Answer(NamedTuple):
    """A client's answer to the car's clock: when that was sent, how many words were sent before, the difference."""

    clock_ms: int
    number: int
    difference_ms: int


def stamp_at(now_ms: int) -> int:
    """The stamp, 1 to 2047, of what is sent at ``now_ms`` (any clock that never goes back, from 0)."""
    return 1 + now_ms // STEP_MS % STEPS


class Freshness:
    """Find the words of one connection that were sent too long ago.

    Args:
        stale_ms: a word is old that took so much longer than the fastest of the last minute, or than an answer.
    """

    def __init__(self, stale_ms: int) -> None:
        self._stale_ms = stale_ms
        self._has_stamped = False
        self._now_ms = 0
        self._ticks: int | None = None
        # The smallest difference in the present half minute and in the one before it; None where no word came.
        self._smallest: int | None = None
        self._smallest_before: int | None = None
        self._until_ms = _HALF_MINUTE_MS
        # When the last fresh word with a stamp came; None before the first.
        self._fresh_ms: int | None = None
        self._newest_number = 0
        self._answer: _Answer | None = None

    def is_fresh(self, stamp: int, now: int, number: int = 0, stands: bool = False, drives: bool = True) -> bool:
        """Whether a word is fresh that came at ``now`` (ticks).

        Without stamps every word is fresh; a client that has once stamped must go on.

        Args:
            stamp: 0 for none.
            number: of the word among those of its connection, from 1; 0 where it is unknown.
            stands: whether it commands speed 0, as the first word after a silence has to; the first of all needn't.
            drives: whether it commands the wheels; others come behind one that does.
        """
        self._advance(now)
        if stamp == 0:
            return not self._has_stamped
        self._has_stamped = True
        is_overtaken = 0 < number <= self._newest_number
        self._newest_number = max(self._newest_number, number)
        difference_ms = (self._now_ms - (stamp - 1) * STEP_MS) % _ROUND_MS
        if self._needs_answer:
            is_fresh = drives and self._fits_answer(number, stands, difference_ms)
        else:
            is_fresh = not is_overtaken and self._fits_last_minute(difference_ms)
        if is_fresh:
            self._fresh_ms = self._now_ms
        return is_fresh

    def clock_to_answer(self, now: int) -> int | None:
        """The car's clock at ``now`` (ticks) in units of a stamp; None while no answer to it is needed."""
        self._advance(now)
        answered = self._answer is not None and elapsed_ms(now, self._answer.clock_ms) < _ANSWER_LASTS_MS
        if self._needs_answer and not answered:
            return now // STEP_MS
        return None

    def take_answer(self, clock: int, number: int, stamp: int, now: int) -> None:
        """Take the client's answer to ``clock`` at ``now`` (ticks), unless its round trip took too long.

        Args:
            clock: as `clock_to_answer` gave it.
            number: how many words the client had sent.
            stamp: of the moment when it answered.
        """
        self._advance(now)
        clock_ms = clock * STEP_MS & TICKS_MASK
        if elapsed_ms(now, clock_ms) > _ANSWER_LASTS_MS:
            return
        difference_ms = (self._now_ms - (stamp - 1) * STEP_MS) % _ROUND_MS
        if self._answer:
            # The fastest answer says most.
            before_ms = self._answer.difference_ms
            difference_ms = before_ms + min(_later_ms(difference_ms, before_ms), 0)
        self._answer = _Answer(clock_ms, number, difference_ms)

    @property
    def _needs_answer(self) -> bool:
        return self._fresh_ms is None or self._now_ms - self._fresh_ms > _SILENCE_MS

    def _fits_answer(self, number: int, stands: bool, difference_ms: int) -> bool:
        """Whether a word came after the client's answer and in time, and after a silence with speed 0."""
        answer = self._answer
        if answer is None or self._ticks is None or number <= answer.number:
            return False
        # What is sent after the answer is younger than the car's clock in it, so that its stamp has not come round.
        self._answer = None
        later_ms = _later_ms(difference_ms, answer.difference_ms)
        needs_rest = self._fresh_ms is not None and not stands
        if needs_rest or elapsed_ms(self._ticks, answer.clock_ms) > _SILENCE_MS or later_ms > self._stale_ms:
            return False
        self._smallest, self._smallest_before = answer.difference_ms + min(later_ms, 0), None
        return True

    def _fits_last_minute(self, difference_ms: int) -> bool:
        known = [smallest for smallest in (self._smallest, self._smallest_before) if smallest is not None]
        later_ms = 0
        if known:
            later_ms = _later_ms(difference_ms, min(known))
        if known:
            difference_ms = min(known) + later_ms
        else:
            difference_ms = difference_ms
        if self._smallest is None:
            self._smallest = difference_ms
        else:
            self._smallest = min(self._smallest, difference_ms)
        return later_ms <= self._stale_ms

    def _advance(self, now: int) -> None:
        """Count the time on, since ticks wrap in the middle of a stamp's round."""
        self._now_ms += elapsed_ms(now, self._ticks) if self._ticks is not None else 0
        self._ticks = now
        if self._now_ms >= self._until_ms:
            is_next = self._now_ms < self._until_ms + _HALF_MINUTE_MS
            self._smallest_before, self._smallest = self._smallest if is_next else None, None
            self._until_ms = self._now_ms + _HALF_MINUTE_MS


def _later_ms(difference_ms: int, smallest_ms: int) -> int:
    """How much later than the fastest a word came, below 0 where it was faster."""
    return (difference_ms - smallest_ms + _FASTER_MS) % _ROUND_MS - _FASTER_MS
