"""Slots: the times in which the leaders of a run send one word each.

All leaders run the same image and were switched on at 0 ms, so their slots coincide.
"""

from motorcade.config.profile import Profile
from motorcade.words.image import Image, holds_a_tell
from motorcade.words.infrared import TAGS, slot_tags


class Slots:
    """Which slot the beginning of a word belongs to.

    A bare word is known by its bits, and counts for the slot in which it began or for the one before. A tagged word
    counts for the newest slot with its tag.

    Attributes:
        dwell_ms: how long a slot lasts; 0 where the image has no words for followers, and where the leader tells them
            when it decides to.
        count: the slots that are over by the end of the run.
    """

    def __init__(self, image: Image, profile: Profile, duration_ms: int = 0) -> None:
        self._words = image.followers
        self._is_tagged = bool(image.tagged)
        is_timed = bool(image.followers) and not holds_a_tell(image)
        self.dwell_ms = profile.dwell_ms[image.dwell_level] if is_timed else 0
        self.count = duration_ms // self.dwell_ms if self.dwell_ms else 0
        # The tags of the first slots; of twice as many whenever more are asked for.
        self._tags: list[int] = []

    def tag(self, slot: int) -> int:
        """The tag of a slot's word, 0 for a bare one."""
        if not self._is_tagged:
            return 0
        if slot >= len(self._tags):
            self._tags = slot_tags(self._words, 2 * slot + 1)
        return self._tags[slot]

    def of(self, t_ms: int, word: int, tag: int) -> int:
        """The slot of a word that began at ``t_ms``; -1 where it belongs to none."""
        if not self.dwell_ms:
            return -1
        now = t_ms // self.dwell_ms
        if self._is_tagged:
            recent = range(now, max(now - TAGS, -1), -1)
            return next((slot for slot in recent if self.tag(slot) == tag), -1)
        for slot in (now, now - 1):
            if slot >= 0 and word == self._words[slot % len(self._words)]:
                return slot
        return -1
