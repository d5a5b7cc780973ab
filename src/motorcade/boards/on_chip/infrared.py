"""Infrared: frames in from a receiver's edges, also on Linux; frames out by a microcontroller's hardware.

Portable. The output of a demodulating receiver (VS1838B, TSOP38238) is low while there is carrier. An interrupt only
times its edges; the loop turns them into marks and spaces. To send, the ESP32 has its remote control peripheral (RMT),
the RP2040 its programmable I/O (PIO): they send a whole frame with its 38 kHz carrier while the loop goes on.
"""

from array import array

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable
    from typing import Any

from motorcade.boards.on_chip.frame_program import CYCLE_STEPS, UNIT_OVERHEAD_STEPS, assemble
from motorcade.words.infrared import HEADER_SPACE_UNITS, FrameReceiver, frame_durations_us
from motorcade.words.ticks import TICKS_MASK

CARRIER_HZ = 38000
_CARRIER_PERCENT = 33
# Durations are in µs: 80 MHz / 80.
_RMT_RESOLUTION_HZ = 1_000_000
_RMT_CLOCK_DIVIDER = 80
# The edges of three frames: no more come during a slow tick. A power of two.
_EDGES = 256
# The receiver reports a mark's end late, by up to about ten periods of the carrier.
_ECHO_US = 1000
# A header's mark takes 9 ms. A collection of garbage that begins so long after it began ends with it, or within the
# tolerance of the space behind it.
_HEADER_BEGINS_US = 1200
# No frame has a mark of this length: what has begun is no frame.
_DISCARDS = 0


def has_come(now_us: int, due_us: int) -> bool:
    """Return whether ``due_us`` is now or past, also where the clock wraps at 2^30 µs."""
    return (now_us - due_us) & TICKS_MASK <= TICKS_MASK >> 1


class InfraredReceiver:
    """Turn a receiver's edges into frames; leave out the echo of the car's own frames.

    Args:
        ticks_us: returns the time in µs that wraps at 2^30.
        unit_us: the unit of a frame.
        max_edges: how many edges may wait between two calls of ``received_frames``; a power of two.
    """

    def __init__(self, ticks_us: "Callable[[], int]", unit_us: int, max_edges: int = _EDGES) -> None:
        self._ticks_us = ticks_us
        self._frames = FrameReceiver(unit_us)
        # Longer than the longest space in a frame, so that the air doesn't seem free within a frame.
        self._free_after_us = (HEADER_SPACE_UNITS + 1) * unit_us
        self._max_edges = max_edges
        # Counters of edges wrap early: a hard interrupt can't make integers from 2^30 up.
        self._edge_mask = 4 * max_edges - 1
        self._times_us = array("i", [0] * max_edges)
        self._levels = bytearray(max_edges)
        self._written = 0
        self._read = 0
        self._last_us = ticks_us()
        self._level = 1
        self._free = True
        self._has_echo = False
        self._echo_until_us = 0

    def take_edge(self, at_us: int, level: int) -> None:
        """Store an edge to ``level``. Other threads and interrupts may call this: it is short and allocates nothing."""
        at = self._written & (self._max_edges - 1)
        self._times_us[at] = at_us
        self._levels[at] = level
        self._written = (self._written + 1) & self._edge_mask

    def ignore_until(self, sent_until_us: int) -> None:
        """Take edges up to ``sent_until_us``, when the car's own frame ends, and shortly after as its echo."""
        self._has_echo = True
        self._echo_until_us = (sent_until_us + _ECHO_US) & TICKS_MASK

    def received_frames(self) -> list[int] | tuple[int, ...]:
        """Return the frames that ended since the last call, parity unchecked."""
        read, written, has_echo = self._read, self._written, self._has_echo
        if read == written and not has_echo:
            return ()
        frames: list[int] = []
        receiver, times_us, levels = self._frames, self._times_us, self._levels
        # All edges of an echo that is past now are stored already.
        echo_is_past = has_echo and has_come(self._ticks_us(), self._echo_until_us)
        if (written - read) & self._edge_mask > self._max_edges:
            # The oldest edges were overwritten: the frame that they belong to is lost.
            read = (written - self._max_edges) & self._edge_mask
            receiver.receive_mark(_DISCARDS)
        # Names local to this loop: it runs 67 times a frame, and a microcontroller looks up each attribute.
        last_us, last_level, free = self._last_us, self._level, self._free
        while read != written:
            at_us = times_us[read & (self._max_edges - 1)]
            level = levels[read & (self._max_edges - 1)]
            read = (read + 1) & self._edge_mask
            free = False
            if has_echo and has_come(self._echo_until_us, at_us):
                receiver.receive_mark(_DISCARDS)
                free = True
            elif level == last_level:
                # An edge was missed: the pulse was longer than it seems.
                receiver.receive_mark(_DISCARDS)
            elif level == 0:
                receiver.receive_space((at_us - last_us) & TICKS_MASK)
            elif receiver.receive_mark((at_us - last_us) & TICKS_MASK):
                frames.append(receiver.next_frame() or 0)
                free = True
            last_us, last_level = at_us, level
        self._read, self._last_us, self._level, self._free = read, last_us, last_level, free
        if echo_is_past:
            self._has_echo = False
        return frames

    def header_begins(self) -> bool:
        """Return whether a header's mark began just now: no edge comes for 7 ms then."""
        if (self._written - self._read) & self._edge_mask != 1:
            return False
        at = self._read & (self._max_edges - 1)
        at_us = self._times_us[at]
        if self._levels[at] or (self._ticks_us() - at_us) & TICKS_MASK > _HEADER_BEGINS_US:
            return False
        return self._free or (at_us - self._last_us) & TICKS_MASK > self._free_after_us

    def senses_carrier(self) -> bool:
        """Return whether a frame is on the air: there is carrier, or a space no longer than those within a frame."""
        if self._level == 0:
            return True
        if not self._free and (self._ticks_us() - self._last_us) & TICKS_MASK > self._free_after_us:
            self._free = True
        return not self._free


def open_receiver(
    machine: "Any", clock: "Any", pin: int, unit_us: int, interrupt: "dict[str, bool]"
) -> InfraredReceiver:
    """Receive at a GPIO pin of a microcontroller; ``clock`` is MicroPython's time module.

    ``interrupt`` has further arguments of machine.Pin.irq, such as ``{"hard": True}`` where the chip has that.
    """
    ticks_us = clock.ticks_us
    receiver = InfraredReceiver(ticks_us, unit_us)

    def take_edge(changed: "Any") -> None:
        receiver.take_edge(ticks_us(), changed.value())

    machine.Pin(pin, machine.Pin.IN).irq(take_edge, machine.Pin.IRQ_RISING | machine.Pin.IRQ_FALLING, **interrupt)
    return receiver


class RmtSender:
    """Send frames by an ESP32's RMT; ``pin`` is the LED's GPIO number, ``unit_us`` the unit of a frame."""

    def __init__(self, machine: "Any", esp32: "Any", pin: int, unit_us: int) -> None:
        self._unit_us = unit_us
        output = machine.Pin(pin, machine.Pin.OUT, value=0)
        carrier = (CARRIER_HZ, _CARRIER_PERCENT, 1)
        try:
            self._rmt = esp32.RMT(0, pin=output, resolution_hz=_RMT_RESOLUTION_HZ, tx_carrier=carrier)
        except TypeError:
            # An older MicroPython knows clock_div alone, which is deprecated now.
            self._rmt = esp32.RMT(0, pin=output, clock_div=_RMT_CLOCK_DIVIDER, tx_carrier=carrier)

    def send(self, frame: int) -> None:
        """Begin to send ``frame``."""
        self._rmt.write_pulses(frame_durations_us(frame, self._unit_us))


class PioSender:
    """Send frames by a state machine of an RP2040; the arguments are as RmtSender's."""

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
