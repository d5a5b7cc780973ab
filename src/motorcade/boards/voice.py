"""Where a car's voice input comes from: sources of the words 'stop' and 'go'.

Portable. The contract of a board asks ``heard_voice`` for what was said since
the last call; a board hands that on to its source's ``heard``.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable, Sequence

from motorcade.car.brain import NO_VOICE, VOICE_GO, VOICE_STOP

WORDS = (("stop", VOICE_STOP), ("go", VOICE_GO))


class VoiceSource:
    """A source that never hears anything; others derive from it."""

    def heard(self) -> int:
        """What was said since the last call: NO_VOICE, VOICE_STOP or VOICE_GO. Never waits.

        Where both were said, 'stop' counts.
        """
        return NO_VOICE

    def close(self) -> None:
        """Give up what the source holds."""


class SerialVoice(VoiceSource):
    """A module that recognises words by itself, such as one with an LD3320, and tells them over a UART.

    Args:
        read: () -> the bytes that came since the last call, ``b""`` for none; never waits.
        patterns: pairs of the bytes that the module sends and the voice that they mean.
            No pattern contains another (`motorcade.config.voice_map` sees to it).
    """

    def __init__(self, read: "Callable[[], bytes]", patterns: "Sequence[tuple[bytes, int]]") -> None:
        self._read = read
        self._patterns = patterns
        self._longest = max([len(pattern) for pattern, voice in patterns])
        self._recent = b""

    def heard(self) -> int:
        """See VoiceSource; bytes that no pattern knows are passed over."""
        data = self._read()
        said = NO_VOICE
        for i in range(len(data)):
            self._recent = (self._recent + data[i : i + 1])[-self._longest :]
            for pattern, voice in self._patterns:
                if self._recent.endswith(pattern):
                    self._recent = b""
                    if said != VOICE_STOP:
                        said = voice
                    break
        return said
