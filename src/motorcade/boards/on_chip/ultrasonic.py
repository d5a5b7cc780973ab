"""An HC-SR04 that is read without waiting: interrupts time the echo, and the last distance measured is the answer.

Portable.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Mapping
    from typing import Any

from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.words.ticks import TICKS_MASK, elapsed_ms

# All echoes of a ping have faded after this time, also where no obstacle is near.
PING_EVERY_MS = 60
# An older distance is no longer true for a moving car.
STALE_MS = 3 * PING_EVERY_MS
_TRIGGER_US = 10
# Sound travels 343 m/s at 20 °C, there and back.
_MM_PER_2000_US = 343


class Ultrasonic:
    """Measure distances with an HC-SR04.

    Args:
        machine, clock: MicroPython's modules machine and time.
        pins: ``trigger`` and ``echo``, GPIO numbers.
        range_mm: a distance beyond it counts as nothing in sight.
        interrupt: further arguments of machine.Pin.irq, such as ``{"hard": True}`` where the chip has that.
    """

    def __init__(
        self, machine: "Any", clock: "Any", pins: "Mapping[str, int]", range_mm: int, interrupt: "dict[str, bool]"
    ) -> None:
        self._clock = clock
        self._range_mm = range_mm
        self._trigger = machine.Pin(pins["trigger"], machine.Pin.OUT, value=0)
        self._rose_us = 0
        self._width_us = 0
        self._has_pinged = False
        self._has_answer = False
        self._pinged_ms = 0
        self._distance_mm = NOTHING_IN_SIGHT_MM
        echo = machine.Pin(pins["echo"], machine.Pin.IN)
        echo.irq(self._take_edge, machine.Pin.IRQ_RISING | machine.Pin.IRQ_FALLING, **interrupt)

    def _take_edge(self, pin: "Any") -> None:
        """Time an edge. Runs as an interrupt: short, and without allocation."""
        if pin.value():
            self._rose_us = self._clock.ticks_us()
        elif self._rose_us:
            self._width_us = (self._clock.ticks_us() - self._rose_us) & TICKS_MASK
            self._rose_us = 0

    def distance_mm(self) -> int:
        """Return the last distance to an obstacle; NOTHING_IN_SIGHT_MM where none was measured lately.

        Ping where that is due. The first distance is known a few ms after the first call.
        """
        now_ms = self._clock.ticks_ms()
        waited_ms = elapsed_ms(now_ms, self._pinged_ms)
        if self._width_us:
            distance_mm = self._width_us * _MM_PER_2000_US // 2000
            self._distance_mm = distance_mm if distance_mm <= self._range_mm else NOTHING_IN_SIGHT_MM
            self._width_us = 0
            self._has_answer = True
        if not self._has_pinged or waited_ms >= PING_EVERY_MS:
            if not self._has_answer or waited_ms >= STALE_MS:
                self._distance_mm = NOTHING_IN_SIGHT_MM
            self._ping(now_ms)
        return self._distance_mm

    def is_measuring(self) -> bool:
        """Return whether an echo may be on its way: its interrupt must not be late."""
        if not self._has_pinged or self._width_us:
            return False
        return elapsed_ms(self._clock.ticks_ms(), self._pinged_ms) < PING_EVERY_MS and not self._has_answer

    def _ping(self, now_ms: int) -> None:
        self._has_pinged = True
        self._pinged_ms = now_ms
        self._has_answer = False
        self._trigger.value(1)
        self._clock.sleep_us(_TRIGGER_US)
        self._trigger.value(0)
