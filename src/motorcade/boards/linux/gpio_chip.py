"""The pins of a computer with Linux, by the kernel's gpiochip; gpiozero drives them."""

import contextlib
import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from gpiozero import GPIOZeroError
from gpiozero.pins import BoardInfo, HeaderInfo, PinInfo

from motorcade.boards.linux.chips import Chip
from motorcade.boards.linux.errors import GpioForbiddenError, NoGpioError

_RASPBERRY_PI = "raspberry-pi"


def open_gpio(chip: Chip, number: int | None = None) -> Any:
    """A gpiozero pin factory for this computer's pins.

    Args:
        chip: which computer it is; ``linux`` for any whose kernel has a gpiochip.
        number: of ``/dev/gpiochip<number>``. A Raspberry Pi finds its own; others have their pins at 0, as a rule.

    Raises:
        NoGpioError, GpioForbiddenError: in a sentence.
    """
    if not sys.platform.startswith("linux"):
        raise NoGpioError("The pins of a car are driven by Linux, which isn't here; `--board simulated` needs no pins")
    lgpio = _lgpio()
    try:
        return _factory_class(lgpio, chip.name != _RASPBERRY_PI, len(chip.header))(number)
    except lgpio.error as problem:
        path = Path(f"/dev/gpiochip{number or 0}")
        if path.exists() and not os.access(path, os.R_OK | os.W_OK):
            raise GpioForbiddenError(
                f"You may not use {path}: sudo usermod -aG gpio $USER, then log in again"
            ) from None
        raise NoGpioError(f"There are no pins at {path} ({problem}); `--board simulated` needs none") from None
    except GPIOZeroError as problem:
        raise NoGpioError(f"This is no {chip.title} ({problem}); `--board simulated` needs no pins") from None


def prepare() -> None:
    """Import what `open_gpio` needs, so that it takes no time when it is called. Raises ImportError, OSError."""
    _factory_class(_lgpio(), is_foreign=False, lines=0)


def _lgpio() -> Any:
    """The module lgpio, which leaves a pipe in the working directory of whoever imports it: in one that goes away."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        import lgpio

        return lgpio


def _factory_class(lgpio: Any, is_foreign: bool, lines: int) -> Any:
    from gpiozero.pins.lgpio import LGPIOFactory, LGPIOPin

    class FinePin(LGPIOPin):  # type: ignore[misc]
        """A pin whose PWM isn't rounded to whole percents, which are 200 µs of a servo's 20 ms."""

        _pwm: tuple[float, float] | None

        def _set_state(self, value: float) -> None:
            with self._told():
                if self._pwm:
                    frequency, _ = self._pwm
                    self._pwm = (frequency, value * 100)
                    lgpio.tx_pwm(self.factory._handle, self._number, *self._pwm)
                else:
                    super()._set_state(value)

        def _set_frequency(self, value: float | None) -> None:
            with self._told():
                super()._set_frequency(value)

        @contextlib.contextmanager
        def _told(self) -> Iterator[None]:
            try:
                yield
            except lgpio.error as problem:
                raise OSError(f"{self!r} can't be driven: {problem}") from None

    class Factory(LGPIOFactory):  # type: ignore[misc]
        """Its own Raspberry Pi's pins, or on a foreign computer the lines of a gpiochip."""

        def __init__(self, number: int | None) -> None:
            super().__init__(0 if is_foreign and number is None else number)
            self.pin_class = FinePin

        def _get_board_info(self) -> Any:
            return _foreign_board(lines) if is_foreign else super()._get_board_info()

    return Factory


def _foreign_board(lines: int) -> Any:
    """What gpiozero knows of a computer of which it knows nothing but the numbers of its lines."""
    pins = {
        line + 1: PinInfo(
            line + 1, f"GPIO{line}", frozenset({line, f"GPIO{line}"}), "", line + 1, 1, frozenset({"gpio"})
        )
        for line in range(lines)
    }
    unknown = dict.fromkeys(BoardInfo._fields)
    return BoardInfo(**{**unknown, "model": "Linux", "headers": {"": HeaderInfo("", lines, 1, pins)}, "board": ""})
