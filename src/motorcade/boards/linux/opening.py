"""A Linux car's hardware, from its pin file to a board that is ready."""

from pathlib import Path
from typing import Any

from motorcade.boards.linux.board import Equipment
from motorcade.boards.linux.gpio_chip import open_gpio
from motorcade.boards.linux.hardware_watchdog import HardwareWatchdog
from motorcade.boards.linux.lirc import LircSender, open_sender
from motorcade.boards.linux.programmed_drive import ProgrammedDrive
from motorcade.boards.linux.raspberry_pi import RaspberryPi
from motorcade.boards.linux.rescue import pull_low
from motorcade.config.pins import PinMap
from motorcade.config.profile import Profile
from motorcade.errors import MotorcadeError

_MOTORS = ("left_motor", "right_motor", "drive_motor")
_KINDS_OF_WHEELS = (("left_motor", "right_motor"), ("drive_motor", "servo"))
_ON_LINUX = ("raspberry-pi", "linux")


def open_car(equipment: Equipment, pins: PinMap, profile: Profile, gpio_chip: int | None = None) -> RaspberryPi:
    """The board of a car that words drive.

    Args:
        gpio_chip: the number of the gpiochip, None for the computer's own.

    Raises:
        MotorcadeError: the pin file is another car's.
        NoGpioError, GpioForbiddenError, InfraredError: the hardware isn't there, or not for this user.
    """
    _check_computer(pins)
    _check_parts(equipment, pins)
    factory = open_gpio(pins.chip, gpio_chip)
    return RaspberryPi(equipment, pins, profile, factory, _sender(pins, profile, factory))


def open_drive(
    equipment: Equipment,
    pins: PinMap,
    profile: Profile,
    gpio_chip: int | None = None,
    watchdog: Path | None = None,
) -> ProgrammedDrive:
    """The board of a car that somebody steers, and that words drive where it is left to them.

    Args:
        gpio_chip: the number of the gpiochip, None for the computer's own.
        watchdog: the device of a hardware watchdog, None to use none.

    Raises:
        MotorcadeError: the pin file is another car's.
        NoGpioError, GpioForbiddenError, InfraredError, WatchdogError: the hardware isn't there, or not for this user.
    """
    _check_computer(pins)
    _check_parts(equipment, pins)
    factory = open_gpio(pins.chip, gpio_chip)
    sender = _sender(pins, profile, factory)
    armed = HardwareWatchdog(watchdog) if watchdog else None
    rescue = ("motorcade.boards.linux.rescue:pull_low", _what_stops(pins, gpio_chip))
    return ProgrammedDrive(equipment, pins, profile, factory, sender, armed, rescue)


def stop_wheels(pins: PinMap, gpio_chip: int | None = None) -> list[int]:
    """Make all pins that turn wheels low, and say which they are; for a car whose program has died.

    Raises:
        MotorcadeError: the pin file is another car's.
        NoGpioError, GpioForbiddenError: the hardware isn't there, or not for this user.
    """
    _check_computer(pins)
    pull_low(*_what_stops(pins, gpio_chip))
    return motor_pins(pins)


def motor_pins(pins: PinMap) -> list[int]:
    """All pins that make wheels turn."""
    return [wire.pin for wire in pins.wires if wire.device.key in _MOTORS]


def _what_stops(pins: PinMap, gpio_chip: int | None) -> tuple[str, ...]:
    """The arguments of pull_low."""
    return (pins.chip.name, "" if gpio_chip is None else str(gpio_chip), *map(str, motor_pins(pins)))


def _sender(pins: PinMap, profile: Profile, factory: Any) -> LircSender | None:
    """The infrared sender, where the pin file names one. Raises InfraredError."""
    if pins.pin("infrared", "sender") is None:
        return None
    return LircSender(open_sender(), profile.infrared.unit_us, factory.ticks)


def _check_computer(pins: PinMap) -> None:
    if pins.chip.name not in _ON_LINUX:
        raise MotorcadeError("pin-file-of-microcontroller", car=pins.name, chip=pins.chip.name)


def _check_parts(equipment: Equipment, pins: PinMap) -> None:
    """A car has wheels of one kind, and a follower has ears."""
    kinds = sum(all(map(pins.has, kind)) for kind in _KINDS_OF_WHEELS)
    if kinds != 1:
        raise MotorcadeError("two-kinds-of-wheels" if kinds else "no-wheels", car=pins.name)
    if not equipment.is_leader and pins.pin("infrared", "receiver") is None:
        raise MotorcadeError("no-receiver", car=pins.name)
