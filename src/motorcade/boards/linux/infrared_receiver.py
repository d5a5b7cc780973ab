"""Infrared in: the timed edges of a demodulating receiver become frames, but those of the car's own sending don't."""

from collections import deque
from collections.abc import Callable

from motorcade.words.infrared import HEADER_SPACE_UNITS, FrameReceiver

# A receiver module reports a mark's end late by up to some ten periods of the carrier.
_ECHO_S = 0.001
# As many as a second of frames has.
_MOST_EDGES = 1024


class InfraredReceiver:
    """Edges in, from any thread; frames out.

    Args:
        unit_us: the unit of a frame.
        clock_s: a clock in seconds, that of the edges.
    """

    def __init__(self, unit_us: int, clock_s: Callable[[], float]) -> None:
        self._clock_s = clock_s
        self._edges: deque[tuple[float, bool]] = deque(maxlen=_MOST_EDGES)
        self._frames = FrameReceiver(unit_us)
        # Longer than the longest space in a frame, so that a frame's spaces don't pass for free air.
        self._free_after_s = (HEADER_SPACE_UNITS + 1) * unit_us / 1e6
        self._last_s = clock_s()
        self._has_carrier = False
        self._in_frame = False

    def receive_edge(self, at_s: float, carrier: bool) -> None:
        """From ``at_s`` on there is carrier, or none."""
        self._edges.append((at_s, carrier))

    def received_frames(self, is_sending: bool, sent_until_s: float) -> list[int]:
        """The frames that ended since the last call, parity unchecked.

        Args:
            is_sending: whether the car sends itself: edges are its own echo then.
            sent_until_s: when its last sending ended; edges up to then and shortly behind are echoes too.
        """
        frames = []
        deaf_until_s = float("inf") if is_sending else sent_until_s + _ECHO_S
        while self._edges:
            at_s, carrier = self._edges.popleft()
            is_echo = at_s <= deaf_until_s
            if is_echo:
                # A mark of no length makes the receiver forget what it has begun.
                self._frames.receive_mark(0)
            elif carrier:
                self._frames.receive_space(round((at_s - self._last_s) * 1e6))
            else:
                self._frames.receive_mark(round((at_s - self._last_s) * 1e6))
            self._last_s, self._has_carrier = at_s, carrier
            frame = self._frames.next_frame()
            self._in_frame = not is_echo and frame is None
            if frame is not None:
                frames.append(frame)
        return frames

    def senses_carrier(self) -> bool:
        """Whether a frame is on the air: there is carrier, or a space no longer than those within a frame."""
        return self._has_carrier or (self._in_frame and self._clock_s() - self._last_s <= self._free_after_s)
