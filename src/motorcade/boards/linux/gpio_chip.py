"""Open the pins of a computer with Linux for gpiozero, by the kernel's gpiochip.

`motorcade.drive.motor_guard` imports this file when it starts, for `pull_low`: after the death of the car's
process there is no time for imports. So this file imports all that the pins need at its top.
"""

import contextlib
import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from gpiozero import GPIOZeroError
from gpiozero.pins import BoardInfo, HeaderInfo, PinInfo

from motorcade.config.chips import Chip, chip_named
from motorcade.errors import MotorcadeError

_RASPBERRY_PI = "raspberry-pi"


class HardwareError(MotorcadeError, OSError):
    """Hardware that fails while the car drives; the contracts of boards ask for an OSError."""


if sys.platform == "linux":
    # lgpio creates a pipe in the working directory when it is imported.
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        import lgpio
        from gpiozero.pins.lgpio import LGPIOFactory, LGPIOPin

    class _FinePin(LGPIOPin):  # type: ignore[misc]
        """A pin whose PWM isn't rounded to whole percents, which are 200 µs of a servo's 20 ms."""

        _pwm: tuple[float, float] | None

        def _set_state(self, value: float) -> None:
            with self._as_hardware_error():
                if self._pwm:
                    frequency, _ = self._pwm
                    self._pwm = (frequency, value * 100)
                    lgpio.tx_pwm(self.factory._handle, self._number, *self._pwm)
                else:
                    super()._set_state(value)

        def _set_frequency(self, value: float | None) -> None:
            with self._as_hardware_error():
                super()._set_frequency(value)

        @contextlib.contextmanager
        def _as_hardware_error(self) -> Iterator[None]:
            try:
                yield
            except lgpio.error as problem:
                raise HardwareError("pin-fails", pin=repr(self), reason=problem) from None

    class _Factory(LGPIOFactory):  # type: ignore[misc]
        """The pins of a Raspberry Pi, which finds its own gpiochip, or the lines of another computer's gpiochip."""

        def __init__(self, chip: Chip, number: int | None) -> None:
            self._foreign_lines = 0
            if chip.name != _RASPBERRY_PI:
                self._foreign_lines = len(chip.header)
                number = number or 0
            super().__init__(number)
            self.pin_class = _FinePin

        def _get_board_info(self) -> Any:
            if self._foreign_lines:
                return _foreign_board(self._foreign_lines)
            return super()._get_board_info()


def open_gpio(chip: Chip, number: int | None = None) -> Any:
    """Open this computer's pins as a gpiozero pin factory.

    Args:
        chip: which computer it is; ``linux`` for any whose kernel has a gpiochip.
        number: of ``/dev/gpiochip<number>``. A Raspberry Pi finds its own; others mostly have their pins at 0.

    Raises:
        MotorcadeError: there are no pins, or not those, or this user may not use them.
    """
    if sys.platform != "linux":
        raise MotorcadeError("gpio-needs-linux")
    try:
        return _Factory(chip, number)
    except lgpio.error as problem:
        path = Path(f"/dev/gpiochip{number or 0}")
        if path.exists() and not os.access(path, os.R_OK | os.W_OK):
            raise MotorcadeError("gpio-forbidden", path=path) from None
        raise MotorcadeError("no-gpio-chip", path=path, reason=problem) from None
    except GPIOZeroError as problem:
        raise MotorcadeError("another-computer", title=chip.title, reason=problem) from None


def pull_low(chip: str, number: str, *pins: str) -> None:
    """Make ``pins`` low. They stay low when the process ends: the kernel doesn't change them then.

    Args:
        chip: its name in pin files.
        number: as in open_gpio; ``""`` for None.
        pins: GPIO numbers. All are texts, since another process gives them on a command line.
    """
    factory = open_gpio(chip_named(chip), int(number) if number else None)
    for pin in pins:
        factory.pin(int(pin)).output_with_state(False)


def _foreign_board(lines: int) -> Any:
    """Return gpiozero's description of a computer of which only the numbers of its lines are known."""
    pins = {
        line + 1: PinInfo(
            line + 1, f"GPIO{line}", frozenset({line, f"GPIO{line}"}), "", line + 1, 1, frozenset({"gpio"})
        )
        for line in range(lines)
    }
    unknown = dict.fromkeys(BoardInfo._fields)
    return BoardInfo(**{**unknown, "model": "Linux", "headers": {"": HeaderInfo("", lines, 1, pins)}, "board": ""})
