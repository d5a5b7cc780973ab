"""The keyboard as a voice: who types a word and Enter says it to the car."""

import threading
from collections import deque
from collections.abc import Iterable

from motorcade.boards.voice import WORDS, VoiceSource
from motorcade.car.brain import NO_VOICE, VOICE_STOP


class KeyboardVoice(VoiceSource):
    """Takes 'stop' and 'go', or their first letters, from lines that somebody types.

    Args:
        lines: such as ``sys.stdin``. They are read in a thread of their own, since a line
            keeps its reader waiting on every system.
    """

    def __init__(self, lines: Iterable[str]) -> None:
        self._said: deque[int] = deque()
        threading.Thread(target=self._listen, args=(lines,), daemon=True).start()

    def heard(self) -> int:
        """See VoiceSource; any other word is passed over."""
        said = NO_VOICE
        while self._said:
            voice = self._said.popleft()
            if said != VOICE_STOP:
                said = voice
        return said

    def _listen(self, lines: Iterable[str]) -> None:
        for line in lines:
            typed = line.strip().lower()
            self._said.extend(voice for word, voice in WORDS if typed in (word, word[0]))
