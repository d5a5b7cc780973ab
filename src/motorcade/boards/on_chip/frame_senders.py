"""Infrared out: hardware that sends a whole frame with its 38 kHz carrier while the loop goes on.

Portable. The ESP32 has its remote control peripheral (RMT), the RP2040 its programmable I/O (PIO).
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from typing import Any

from motorcade.boards.on_chip.frame_program import CYCLE_STEPS, UNIT_OVERHEAD_STEPS, assemble
from motorcade.words.infrared import frame_durations_us

CARRIER_HZ = 38000
_CARRIER_PERCENT = 33
# 80 MHz / 80: durations are in µs.
_RMT_CLOCK_DIVIDER = 80


class RmtSender:
    """Sends by an ESP32's RMT.

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
    """Sends by a state machine of an RP2040.

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
        # The program counts to 0, so once more than the number.
        self._state_machine.put(cycles - 1)

    def send(self, frame: int) -> None:
        """Begin to send ``frame``."""
        self._state_machine.put(frame)
