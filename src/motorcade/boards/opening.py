"""A Linux car's hardware, from its pin file to a board that is ready."""

from pathlib import Path

from motorcade.boards.gpio_chip import open_gpio
from motorcade.boards.hardware_watchdog import HardwareWatchdog
from motorcade.boards.linux import Equipment
from motorcade.boards.lirc import LircSender, open_sender
from motorcade.boards.pins import PinMap, PinsError
from motorcade.boards.raspberry_pi import RaspberryPi, RaspberryPiDrive
from motorcade.boards.rescue import pull_low
from motorcade.profile import Profile

_MOTORS = ("left_motor", "right_motor", "drive_motor")
_ON_LINUX = ("raspberry-pi", "linux")


def open_car(equipment: Equipment, pins: PinMap, profile: Profile, gpio_chip: int | None = None) -> RaspberryPi:
    """The board of a car that words drive.

    Args:
        gpio_chip: the number of the gpiochip, None for the computer's own.

    Raises:
        PinsError: the pin file is another car's.
        NoGpioError, GpioForbiddenError, InfraredError: the hardware isn't there, or not for this user.
    """
    _check(pins, ("left_motor", "right_motor"))
    factory = open_gpio(pins.chip, gpio_chip)
    sender = None
    if pins.pin("infrared", "sender") is not None:
        sender = LircSender(open_sender(), profile.infrared.unit_us, factory.ticks)
    return RaspberryPi(equipment, pins, profile, factory, sender)


def open_drive(
    pins: PinMap, profile: Profile, gpio_chip: int | None = None, watchdog: Path | None = None
) -> RaspberryPiDrive:
    """The board of a car that somebody steers.

    Args:
        gpio_chip: the number of the gpiochip, None for the computer's own.
        watchdog: the device of a hardware watchdog, None to use none.

    Raises:
        PinsError: the pin file is another car's.
        NoGpioError, GpioForbiddenError, WatchdogError: the hardware isn't there, or not for this user.
    """
    _check(pins, ("drive_motor", "servo"))
    factory = open_gpio(pins.chip, gpio_chip)
    armed = HardwareWatchdog(watchdog) if watchdog else None
    rescue = ("motorcade.boards.rescue:pull_low", _what_stops(pins, gpio_chip))
    return RaspberryPiDrive(pins, profile, factory, armed, rescue)


def stop_wheels(pins: PinMap, gpio_chip: int | None = None) -> list[int]:
    """Make all pins that turn wheels low, and say which they are; for a car whose program has died.

    Raises:
        PinsError: the pin file is another car's.
        NoGpioError, GpioForbiddenError: the hardware isn't there, or not for this user.
    """
    _check(pins, ())
    pull_low(*_what_stops(pins, gpio_chip))
    return motor_pins(pins)


def motor_pins(pins: PinMap) -> list[int]:
    """All pins that make wheels turn."""
    return [wire.pin for wire in pins.wires if wire.device.key in _MOTORS]


def _what_stops(pins: PinMap, gpio_chip: int | None) -> tuple[str, ...]:
    """The arguments of pull_low."""
    return (pins.chip.name, "" if gpio_chip is None else str(gpio_chip), *map(str, motor_pins(pins)))


def _check(pins: PinMap, parts: tuple[str, ...]) -> None:
    if pins.chip.name not in _ON_LINUX:
        raise PinsError(
            f"the pin file is that of {pins.name}, with the chip {pins.chip.name}: such a board gets its programs "
            "by `motorcade install-firmware`"
        )
    if missing := [part for part in parts if not pins.has(part)]:
        raise PinsError(f"the pin file of {pins.name} has no [{missing[0]}], which this car needs")
