"""The hardware watchdog: it resets the chip where the car's loop hangs, and the motors stop.

Portable.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from typing import Any

# Longer than any tick: writing an image to a flash that has to be erased first takes some tenths of a second.
TIMEOUT_MS = 2000
# An ESP32's watchdog can't be switched off, but it takes any timeout.
_AT_THE_PROMPT_MS = 24 * 3600 * 1000
# An RP2040's and RP2350's is off without the bit ENABLE of its register CTRL. The third alias of a register clears
# bits.
# Source: their data sheets, chapters 4.7 and 12.9.
_RP2_CTRL = {"RP2040": 0x40058000, "RP2350": 0x400D8000}
_RP2_CLEARS = 0x3000
_RP2_ENABLE = 1 << 30


class Watchdog:
    """Reset the chip where ``feed`` isn't called for TIMEOUT_MS.

    Args:
        modules: see `motorcade.boards.on_chip.power_on.Modules`.
    """

    def __init__(self, modules: "Any") -> None:
        self._machine = modules.machine
        self._platform = modules.platform
        self._chip = modules.implementation._machine
        self._timer = modules.machine.WDT(timeout=TIMEOUT_MS)

    def feed(self) -> None:
        """Put off the reset."""
        self._timer.feed()

    def stop(self) -> None:
        """Put the reset off for a day or for ever, for somebody who works at the prompt."""
        if self._platform == "esp32":
            self._machine.WDT(timeout=_AT_THE_PROMPT_MS)
            return
        chip = "RP2350" if "RP2350" in self._chip else "RP2040"
        self._machine.mem32[_RP2_CTRL[chip] + _RP2_CLEARS] = _RP2_ENABLE
