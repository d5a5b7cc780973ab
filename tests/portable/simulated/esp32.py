"""A replacement for the module esp32."""

from simulated.timing import time_methods


class Esp32:
    """A replacement for the module esp32 on ``chip``: the transmitter of remote control signals (RMT).

    Args:
        knows_resolution: False as in older versions, which know clock_div alone.
    """

    def __init__(self, chip, knows_resolution=True):
        class RMT:
            def __init__(self, channel, pin, tx_carrier, clock_div=None, resolution_hz=None):
                if (resolution_hz is None) == knows_resolution:
                    raise TypeError("extra keyword arguments given")
                self._nominal_us = clock_div / 80 if resolution_hz is None else 1_000_000 / resolution_hz
                self._pin = pin.number
                self._free_us = 0
                chip.notify("carrier", self._pin, tx_carrier[0])

            def write_pulses(self, durations, data=True):
                if not data or not all(1 <= duration <= 32767 for duration in durations):
                    raise ValueError("durations must be 1 to 32767, and this simulation begins with a mark")
                # A leader's tick may be late by a little more than the gap between frames.
                if chip.now_us + 10_000 < self._free_us:
                    raise AssertionError("write_pulses waits long for the end of the pulses before")
                chip.pass_time(max(0, self._free_us - chip.now_us))
                durations_us = [round(duration * self._nominal_us) for duration in durations]
                self._free_us = chip.now_us + sum(durations_us)
                chip.notify("infrared", self._pin, durations_us)

        time_methods(chip, RMT, "write_pulses")
        self.RMT = RMT
