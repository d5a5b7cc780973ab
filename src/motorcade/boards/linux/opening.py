"""Open a Linux car's hardware: from its pin file to a board that is ready."""

from pathlib import Path
from typing import Any

from motorcade.boards.computer import BatteryFile, Equipment, HardwareWatchdog
from motorcade.boards.linux.gpio_chip import open_gpio, pull_low
from motorcade.boards.linux.infrared import LircSender, open_sender
from motorcade.boards.linux.programmed_drive import ProgrammedDrive
from motorcade.boards.linux.raspberry_pi import RaspberryPi
from motorcade.config.pins import PinMap
from motorcade.config.profile import Profile
from motorcade.errors import MotorcadeError
from motorcade.words.switches import SWITCHES

_MOTORS = ("left_motor", "right_motor", "drive_motor")
_KINDS_OF_WHEELS = (("left_motor", "right_motor"), ("drive_motor", "servo"))
_LINUX_CHIPS = ("raspberry-pi", "linux")
_RESCUE = f"{pull_low.__module__}:{pull_low.__name__}"


def open_car(equipment: Equipment, pins: PinMap, profile: Profile, gpio_chip: int | None = None) -> RaspberryPi:
    """Open the board of a car that words drive; ``gpio_chip`` as for `open_gpio`.

    Raises MotorcadeError: the pin file is another car's; the hardware isn't there, or this user may not use it.
    """
    _check_pins(equipment, pins)
    factory = open_gpio(pins.chip, gpio_chip)
    return RaspberryPi(equipment, pins, profile, factory, _open_sender(pins, profile, factory))


def open_drive(
    equipment: Equipment,
    pins: PinMap,
    profile: Profile,
    gpio_chip: int | None = None,
    watchdog: Path | None = None,
    battery: BatteryFile | None = None,
) -> ProgrammedDrive:
    """Open the board of a car that somebody drives, and that words drive when the driver gives them the wheels.

    ``watchdog`` is the device of a hardware watchdog, None to use none; ``battery`` measures its voltage. Raises what
    `open_car` raises.
    """
    _check_pins(equipment, pins)
    factory = open_gpio(pins.chip, gpio_chip)
    sender = _open_sender(pins, profile, factory)
    armed = HardwareWatchdog(watchdog) if watchdog else None
    rescue = (_RESCUE, _pull_low_arguments(pins, gpio_chip))
    return ProgrammedDrive(equipment, pins, profile, factory, sender, armed, rescue, battery)


def stop_wheels(pins: PinMap, gpio_chip: int | None = None) -> list[int]:
    """Make all pins that turn wheels low and return them; for a car whose program has died. Raises as `open_car`."""
    _check_computer(pins)
    pull_low(*_pull_low_arguments(pins, gpio_chip))
    return motor_pins(pins)


def motor_pins(pins: PinMap) -> list[int]:
    """Return all pins that make wheels turn."""
    return [wire.pin for wire in pins.wires if wire.device.key in _MOTORS]


def _pull_low_arguments(pins: PinMap, gpio_chip: int | None) -> tuple[str, ...]:
    switched = [wire.pin for wire in pins.wires if wire.device.key in [each.name for each in SWITCHES]]
    return (pins.chip.name, "" if gpio_chip is None else str(gpio_chip), *map(str, motor_pins(pins) + switched))


def _open_sender(pins: PinMap, profile: Profile, factory: Any) -> LircSender | None:
    """Open the infrared sender where the pin file names one. Raises MotorcadeError."""
    if pins.pin("infrared", "sender") is None:
        return None
    return LircSender(open_sender(), profile.infrared.unit_us, factory.ticks)


def _check_computer(pins: PinMap) -> None:
    if pins.chip.name not in _LINUX_CHIPS:
        raise MotorcadeError("pin-file-of-microcontroller", car=pins.name, chip=pins.chip.name)


def _check_pins(equipment: Equipment, pins: PinMap) -> None:
    """Check that a car has wheels of one kind, and that a follower has a receiver."""
    _check_computer(pins)
    kinds = sum(all(map(pins.has, kind)) for kind in _KINDS_OF_WHEELS)
    if kinds != 1:
        raise MotorcadeError("two-kinds-of-wheels" if kinds else "no-wheels", car=pins.name)
    if not equipment.is_leader and pins.pin("infrared", "receiver") is None:
        raise MotorcadeError("no-receiver", car=pins.name)
