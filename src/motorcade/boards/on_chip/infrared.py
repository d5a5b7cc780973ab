"""Infrared on a microcontroller: frames in from a receiver's edges, frames out by the chip's hardware.

Portable. The output of a demodulating receiver (VS1838B, TSOP38238) is low while there is carrier. An interrupt only
times its edges; the loop turns them into marks and spaces. To send, the ESP32 has its remote control peripheral (RMT),
the RP2040 its programmable I/O (PIO): they send a whole frame with its 38 kHz carrier while the loop goes on.
"""

from array import array

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from typing import Any

from motorcade.boards.on_chip.frame_program import CYCLE_STEPS, UNIT_OVERHEAD_STEPS, assemble
from motorcade.words.infrared import HEADER_SPACE_UNITS, FrameReceiver, frame_durations_us
from motorcade.words.ticks import TICKS_MASK

CARRIER_HZ = 38000
_CARRIER_PERCENT = 33
# 80 MHz / 80: durations are in µs.
_RMT_CLOCK_DIVIDER = 80
# The edges of three frames: no more come during a slow tick. A power of two.
_EDGES = 256
# The receiver reports a mark's end late, by up to about ten periods of the carrier.
_ECHO_US = 1000


def has_come(now_us: int, due_us: int) -> bool:
    """Return whether ``due_us`` is now or past, also where the clock wraps at 2^30 µs."""
    return (now_us - due_us) & TICKS_MASK <= TICKS_MASK >> 1


class InfraredReceiver:
    """Turn the edges at a pin into frames; leave out the echo of the car's own frames.

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
        # Longer than the longest space in a frame, so that the air doesn't seem free within a frame.
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
        """Store an edge. Runs as an interrupt: short, and without allocation."""
        at = self._written & (_EDGES - 1)
        self._times_us[at] = self._clock.ticks_us()
        self._levels[at] = pin.value()
        self._written = (self._written + 1) & TICKS_MASK

    def is_past_echo(self, sent_until_us: int) -> bool:
        """Return whether all echoes of a frame that ended at ``sent_until_us`` have come."""
        return has_come(self._clock.ticks_us(), sent_until_us + _ECHO_US)

    def received_frames(self, has_echo: bool, sent_until_us: int) -> list[int]:
        """Return the frames that ended since the last call, parity unchecked.

        Args:
            has_echo: whether the car sends, or did since the last call; edges up to ``sent_until_us`` and shortly
                after are its echo then.
            sent_until_us: when its frame ended or will end.
        """
        frames = []
        waiting = (self._written - self._read) & TICKS_MASK
        if waiting > _EDGES:
            # The oldest edges were overwritten: the frame that they belong to is lost.
            self._read = (self._written - _EDGES) & TICKS_MASK
            self._discard_frame()
        while self._read != self._written:
            at = self._read & (_EDGES - 1)
            at_us, level = self._times_us[at], self._levels[at]
            self._read = (self._read + 1) & TICKS_MASK
            is_echo = has_echo and has_come(sent_until_us + _ECHO_US, at_us)
            if is_echo:
                self._discard_frame()
            else:
                self._receive(at_us, level)
            self._last_us = at_us
            self._level = level
            frame = self._frames.next_frame()
            self._free = is_echo or frame is not None
            if frame is not None:
                frames.append(frame)
        return frames

    def senses_carrier(self) -> bool:
        """Return whether a frame is on the air: there is carrier, or a space no longer than those within a frame."""
        if self._level == 0:
            return True
        if not self._free and (self._clock.ticks_us() - self._last_us) & TICKS_MASK > self._free_after_us:
            self._free = True
        return not self._free

    def _receive(self, at_us: int, level: int) -> None:
        if level == self._level:
            # An edge was missed: the pulse was longer than it seems.
            self._discard_frame()
        elif level:
            self._frames.receive_mark((at_us - self._last_us) & TICKS_MASK)
        else:
            self._frames.receive_space((at_us - self._last_us) & TICKS_MASK)

    def _discard_frame(self) -> None:
        """Discard the frame that has begun: no frame has a mark of length 0."""
        self._frames.receive_mark(0)


class RmtSender:
    """Send frames by an ESP32's RMT.

    Args:
        machine, esp32: MicroPython's modules.
        pin: the LED's GPIO number.
        unit_us: the unit of a frame.
    """

    def __init__(self, machine: "Any", esp32: "Any", pin: int, unit_us: int) -> None:
        self._unit_us = unit_us
        output = machine.Pin(pin, machine.Pin.OUT, value=0)
        carrier = (CARRIER_HZ, _CARRIER_PERCENT, 1)
        self._rmt = esp32.RMT(0, pin=output, clock_div=_RMT_CLOCK_DIVIDER, tx_carrier=carrier)

    def send(self, frame: int) -> None:
        """Begin to send ``frame``."""
        self._rmt.write_pulses(frame_durations_us(frame, self._unit_us))


class PioSender:
    """Send frames by a state machine of an RP2040.

    Args:
        machine, rp2: MicroPython's modules.
        pin: the LED's GPIO number.
        unit_us: the unit of a frame.
    """

    def __init__(self, machine: "Any", rp2: "Any", pin: int, unit_us: int) -> None:
        steps_hz = CARRIER_HZ * CYCLE_STEPS
        unit_steps = (unit_us * steps_hz + 500000) // 1000000
        cycles = (unit_steps - UNIT_OVERHEAD_STEPS + CYCLE_STEPS // 2) // CYCLE_STEPS
        output = machine.Pin(pin, machine.Pin.OUT, value=0)
        self._state_machine = rp2.StateMachine(0, assemble(rp2), freq=steps_hz, set_base=output)
        self._state_machine.active(1)
        # The program counts down to 0, one cycle more than the number.
        self._state_machine.put(cycles - 1)

    def send(self, frame: int) -> None:
        """Begin to send ``frame``."""
        self._state_machine.put(frame)
