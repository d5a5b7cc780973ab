"""How many followers began the word of each slot, and how late: counted while a run goes on, for any number of cars."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from motorcade.config.profile import Profile
from motorcade.engine.events import START
from motorcade.engine.state import Moment
from motorcade.mats import Mat
from motorcade.words.image import parse_image_bytes
from motorcade.words.infrared import TAGS

# A tagged word can still be begun so many slots later; after that its tag counts as newer again.
_OPEN_SLOTS = 31
_NEVER_MS = np.iinfo(np.int32).max


class Slot(NamedTuple):
    """One slot of a leader: the time in which it sends one follower word.

    Attributes:
        leader: the number of the leader.
        tag: 1 to 63; 0 for a bare word.
        begin_ms: when the slot began.
        once, again, never: how many followers began its word once, more than once, and not at all.
        lag_p50_ms, lag_p95_ms: the time from the slot's beginning until half and 95% of those that began the word had
            begun it; None where none did.
    """

    leader: int
    tag: int
    begin_ms: int
    once: int
    again: int
    never: int
    lag_p50_ms: int | None
    lag_p95_ms: int | None


class SlotCounts:
    """A sink of a recording that counts the beginnings of words by slot.

    All leaders run the same image and were switched on at 0 ms, so their slots coincide. A bare word is known by its
    bits, and counts for the slot in which it began or for the one before.

    Args:
        image: the bytes that the leaders run.
        mat: which cars lead.
        profile: the meaning of the dwell level.
    """

    def __init__(self, image: bytes, mat: Mat, profile: Profile):
        parsed = parse_image_bytes(image)
        self._words = np.array(parsed.followers, np.int64)
        self._tagged = bool(parsed.tagged)
        self._dwell_ms = profile.dwell_ms[parsed.dwell_level] if parsed.followers else 0
        self._leads = np.asarray(mat.starts.leads)
        self._counts: dict[int, NDArray[np.uint8]] = {}
        self._lags_ms: dict[int, NDArray[np.int32]] = {}
        self._closed: list[tuple[int, int, int, int | None, int | None]] = []

    @property
    def counts_anything(self) -> bool:
        """Whether there are slots and followers."""
        return bool(len(self._words)) and not self._leads.all()

    def write(self, moment: Moment) -> None:
        """Positions don't matter here."""

    def write_events(self, t_ms: int, events: NDArray[np.void]) -> None:
        """Count the words that began; ``t_ms`` is the time until which the run has come."""
        started = events[events["kind"] == START]
        at_ms, cars = started["t_ms"].astype(np.int64), started["car"].astype(np.int64)
        slots = self._slots_of(at_ms // self._dwell_ms, started)
        for slot in np.unique(slots[slots >= len(self._closed)]).tolist():
            of_slot = slots == slot
            counts, lags_ms = self._open(slot)
            begun = np.bincount(cars[of_slot], minlength=len(counts))
            counts[:] = np.minimum(counts + begun, 2)
            np.minimum.at(lags_ms, cars[of_slot], (at_ms[of_slot] - slot * self._dwell_ms).astype(np.int32))
        while len(self._closed) < (t_ms - 1) // self._dwell_ms - _OPEN_SLOTS:
            self._close_one()

    def close(self) -> None:
        """Nothing has to be finished."""

    def slots(self, until_ms: int) -> list[Slot]:
        """The slots that began before ``until_ms``, each once for every leader."""
        while len(self._closed) < -(-until_ms // self._dwell_ms):
            self._close_one()
        return [
            Slot(leader, number % TAGS + 1 if self._tagged else 0, number * self._dwell_ms, *counted)
            for number, counted in enumerate(self._closed)
            for leader in np.flatnonzero(self._leads).tolist()
        ]

    def _slots_of(self, now: NDArray[np.int64], started: NDArray[np.void]) -> NDArray[np.int64]:
        """The slot that each beginning belongs to, -1 where to none; ``now`` are the slots in which they happened."""
        if self._tagged:
            behind = (now % TAGS + 1 - started["other"].astype(np.int64)) % TAGS
            found = np.where((behind <= _OPEN_SLOTS) & (started["other"] > 0), now - behind, -1)
        else:
            words = started["word"].astype(np.int64)
            before = np.where(words == self._words[(now - 1) % len(self._words)], now - 1, -1)
            found = np.where(words == self._words[now % len(self._words)], now, before)
        return found

    def _open(self, slot: int) -> tuple[NDArray[np.uint8], NDArray[np.int32]]:
        if slot not in self._counts:
            self._counts[slot] = np.zeros(len(self._leads), np.uint8)
            self._lags_ms[slot] = np.full(len(self._leads), _NEVER_MS, np.int32)
        return self._counts[slot], self._lags_ms[slot]

    def _close_one(self) -> None:
        counts, lags_ms = self._open(len(self._closed))
        del self._counts[len(self._closed)], self._lags_ms[len(self._closed)]
        followers = counts[~self._leads]
        once, never = int((followers == 1).sum()), int((followers == 0).sum())
        begun_ms = lags_ms[~self._leads & (lags_ms < _NEVER_MS)]
        p50_ms, p95_ms = (
            (int(np.percentile(begun_ms, share, method="inverted_cdf")) for share in (50, 95))
            if len(begun_ms)
            else (None, None)
        )
        self._closed.append((once, len(followers) - once - never, never, p50_ms, p95_ms))
