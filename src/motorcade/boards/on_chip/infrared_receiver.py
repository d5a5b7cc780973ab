"""Infrared in: the edges of a demodulating receiver (VS1838B, TSOP38238) become frames.

Portable. The receiver's output is low while there is carrier. Edges are only
timed in the interrupt; they become marks and spaces when the loop asks.
"""

from array import array

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from typing import Any

from motorcade.words.infrared import HEADER_SPACE_UNITS, FrameReceiver
from motorcade.words.ticks import TICKS_MASK

# Three frames: as much as comes while a slow tick lasts. A power of two.
_EDGES = 256
# The receiver reports a mark's end late by up to some ten periods of the carrier.
_ECHO_US = 1000


def has_come(now_us: int, due_us: int) -> bool:
    """Whether ``due_us`` is now or past, right across the wrap of a clock of 2^30 µs."""
    return (now_us - due_us) & TICKS_MASK <= TICKS_MASK >> 1


class InfraredReceiver:
    """The receiver.

    Args:
        machine: MicroPython's module.
        clock: MicroPython's time module.
        pin: its GPIO number.
        unit_us: the unit of a frame.
        interrupt: further arguments of machine.Pin.irq, such as ``{"hard": True}`` where the chip has that.
    """

    def __init__(self, machine: "Any", clock: "Any", pin: int, unit_us: int, interrupt: "dict[str, bool]") -> None:
        self._clock = clock
        self._frames = FrameReceiver(unit_us)
        # Longer than the longest space in a frame, so that a frame's spaces don't pass for free air.
        self._free_after_us = (HEADER_SPACE_UNITS + 1) * unit_us
        self._times_us = array("i", [0] * _EDGES)
        self._levels = bytearray(_EDGES)
        self._written = 0
        self._read = 0
        self._last_us = clock.ticks_us()
        self._level = 1
        self._free = True
        self._pin = machine.Pin(pin, machine.Pin.IN)
        self._pin.irq(self._take_edge, machine.Pin.IRQ_RISING | machine.Pin.IRQ_FALLING, **interrupt)

    def _take_edge(self, pin: "Any") -> None:
        """Runs as an interrupt: short, and nothing allocated."""
        at = self._written & (_EDGES - 1)
        self._times_us[at] = self._clock.ticks_us()
        self._levels[at] = pin.value()
        self._written = (self._written + 1) & TICKS_MASK

    def is_past_echo(self, sent_until_us: int) -> bool:
        """Whether all echoes of a sending that ended at ``sent_until_us`` have come."""
        return has_come(self._clock.ticks_us(), sent_until_us + _ECHO_US)

    def received_frames(self, deaf: bool, deaf_until_us: int) -> list[int]:
        """The frames that ended since the last call, parity unchecked.

        Args:
            deaf: whether the car sends, or did since the last call; edges are its own echo then,
                but for those behind ``deaf_until_us``.
            deaf_until_us: when its sending ended or will end.
        """
        frames = []
        waiting = (self._written - self._read) & TICKS_MASK
        if waiting > _EDGES:
            # The oldest were overwritten: what they belonged to is lost.
            self._read = (self._written - _EDGES) & TICKS_MASK
            self._lose_step()
        while self._read != self._written:
            at = self._read & (_EDGES - 1)
            at_us, level = self._times_us[at], self._levels[at]
            self._read = (self._read + 1) & TICKS_MASK
            is_echo = deaf and has_come(deaf_until_us + _ECHO_US, at_us)
            if is_echo:
                self._lose_step()
            else:
                self._take(at_us, level)
            self._last_us = at_us
            self._level = level
            frame = self._frames.next_frame()
            self._free = is_echo or frame is not None
            if frame is not None:
                frames.append(frame)
        return frames

    def senses_carrier(self) -> bool:
        """Whether a frame is on the air: there is carrier, or a space no longer than those within a frame."""
        if self._level == 0:
            return True
        if not self._free and (self._clock.ticks_us() - self._last_us) & TICKS_MASK > self._free_after_us:
            self._free = True
        return not self._free

    def _take(self, at_us: int, level: int) -> None:
        if level == self._level:
            # An edge was missed: the pulse is longer than it seems.
            self._lose_step()
        elif level:
            self._frames.receive_mark((at_us - self._last_us) & TICKS_MASK)
        else:
            self._frames.receive_space((at_us - self._last_us) & TICKS_MASK)

    def _lose_step(self) -> None:
        """Forget the frame that has begun; a mark of no length is none's."""
        self._frames.receive_mark(0)
