"""Sources of a car's voice input: the words 'stop' and 'go'.

Portable. A board's ``heard_voice`` returns what its source's ``heard_voice`` gives.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable, Sequence

from motorcade.car.brain import NO_VOICE, VOICE_STOP


class VoiceSource:
    """A source that never hears anything; others derive from it."""

    def heard_voice(self) -> int:
        """Return what was heard since the last call: NO_VOICE, VOICE_STOP or VOICE_GO. Never waits.

        Where both words were heard, it is VOICE_STOP.
        """
        return NO_VOICE


class SerialVoice(VoiceSource):
    """A module that recognises words by itself, such as one with an LD3320, and reports them over a UART.

    Args:
        read: returns the bytes that came since the last call, ``b""`` for none; never waits.
        patterns: pairs of the bytes that the module sends and the voice that they mean.
            No pattern contains another (`motorcade.config.pins` checks that).
    """

    def __init__(self, read: "Callable[[], bytes]", patterns: "Sequence[tuple[bytes, int]]") -> None:
        self._read = read
        self._patterns = patterns
        self._longest = max([len(pattern) for pattern, voice in patterns])
        self._recent = b""

    def heard_voice(self) -> int:
        """See VoiceSource; bytes that match no pattern are ignored."""
        data = self._read()
        latest = NO_VOICE
        for i in range(len(data)):
            self._recent = (self._recent + data[i : i + 1])[-self._longest :]
            for pattern, voice in self._patterns:
                if self._recent.endswith(pattern):
                    self._recent = b""
                    if latest != VOICE_STOP:
                        latest = voice
                    break
        return latest
