"""The board of a car with a Raspberry Pi, or another computer with Linux: gpiozero drives its parts; and open it."""

import warnings
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

from gpiozero import DigitalInputDevice, DistanceSensor, GPIODevice, OutputDevice
from gpiozero.exc import DistanceSensorNoEcho, PWMSoftwareFallback

from motorcade.boards.computer import ComputerBoard, Equipment
from motorcade.boards.linux.chassis import Chassis, open_chassis
from motorcade.boards.linux.gpio_chip import open_gpio, pull_low
from motorcade.boards.linux.infrared import LircSender, open_sender
from motorcade.boards.on_chip.infrared import InfraredReceiver
from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.config.pins import INPUTS, PinMap
from motorcade.config.profile import Profile
from motorcade.drive.motor_guard import MotorGuard, hurry
from motorcade.errors import MotorcadeError
from motorcade.words.formats import SWITCHES
from motorcade.words.ticks import TICKS_MASK, elapsed_ms

_LEDS = 4
_MOTORS = ("left_motor", "right_motor", "drive_motor")
_KINDS_OF_WHEELS = (("left_motor", "right_motor"), ("drive_motor", "servo"))
# The median of three pings tolerates one false echo and is at most 180 ms old.
_PINGS = 3
# How often the guard is told that the loop runs.
_ALIVE_MS = 40
# More than a second of frames has; a power of two.
_MAX_EDGES = 1024


class RaspberryPi(ComputerBoard):
    """A car that words drive, with the parts that its pin file names.

    Args:
        equipment: what every car on a computer has.
        pins: which part is at which pin; as `open_pins` wants it.
        profile: the car's kind.
        factory: gpiozero's pin factory (`motorcade.boards.linux.gpio_chip.open_gpio`); closed with the board.
        sender: of infrared, None for none; closed with the board.
        wheels: those of another board, which closes ``factory``; None for the wheels of the pin file.

    Attributes:
        guard: stops the wheels where this process is killed or its loop hangs; ended with the board.
    """

    kind = "raspberry-pi"
    guard: MotorGuard | None = None

    def __init__(
        self,
        equipment: Equipment,
        pins: PinMap,
        profile: Profile,
        factory: Any,
        sender: LircSender | None = None,
        wheels: Chassis | None = None,
    ) -> None:
        super().__init__(equipment)
        self._sender = sender
        self._devices = ExitStack()
        if wheels is None:
            self._devices.callback(factory.close)
            wheels = open_chassis(pins, profile, factory, self._devices)
        self._wheels = wheels
        self._moves = False
        self._alive_ms = self.now_ms()
        self._leds = [
            self._open(OutputDevice, pins.pin("leds", f"led_{which}"), pin_factory=factory) for which in range(_LEDS)
        ]
        self._inputs = {
            part.key: [
                self._open(DigitalInputDevice, pins.pin(part.key, role.key), pin_factory=factory) for role in part.roles
            ]
            for part in INPUTS
        }
        # The parts whose inputs count as 1 while they are low.
        self._are_low = {part.key for part in INPUTS if part.active and not pins.level(part.key, part.active)}
        self._range_mm = profile.body.ultrasonic_range_mm
        trigger = pins.pin("ultrasonic", "trigger")
        self._ultrasonic = self._open(_DistanceSensor, pins.pin("ultrasonic", "echo"), trigger, self._range_mm, factory)
        self._ticks = factory.ticks
        self._echo_ended_s = factory.ticks()
        self._infrared = InfraredReceiver(lambda: _to_us(factory.ticks()), profile.infrared.unit_us, _MAX_EDGES)
        self._receiver = self._open(GPIODevice, pins.pin("infrared", "receiver"), pin_factory=factory)
        if self._receiver is not None:
            self._receiver.pin.input_with_pull("up")
            self._receiver.pin.edges = "both"
            self._receiver.pin.when_changed = self._receive_edge

    def set_wheels(self, direction: int, speed_level: int) -> None:
        if speed_level:
            # The guard knows of a movement before this process can hang in it.
            self._beat(moves=True)
        self._wheels.set(direction, speed_level)
        if not speed_level:
            self._beat(moves=False)

    def keep_alive(self) -> None:
        if elapsed_ms(self.now_ms(), self._alive_ms) >= _ALIVE_MS:
            self._beat(self._moves)

    def _beat(self, moves: bool) -> None:
        self._moves = moves
        self._alive_ms = self.now_ms()
        if self.guard:
            self.guard.beat(moves)

    def set_led(self, which: int) -> None:
        for number, led in enumerate(self._leds):
            if led is not None:
                led.value = number == which

    def obstacle_mm(self) -> int:
        if self._ultrasonic is None:
            return NOTHING_IN_SIGHT_MM
        share: float = self._ultrasonic.value
        # 0 means that nothing was measured yet: no HC-SR04 measures less than 20 mm.
        if share in (0, 1):
            return NOTHING_IN_SIGHT_MM
        return round(share * self._range_mm)

    def read_inputs(self, part: str) -> int:
        one = part not in self._are_low
        pins = enumerate(self._inputs[part])
        return sum((pin.value == one) << place for place, pin in pins if pin is not None)

    def received_frames(self) -> list[int] | tuple[int, ...]:
        if self._sender is not None:
            if self._sender.is_sending():
                self._infrared.ignore_until(_to_us(self._ticks()))
            elif self._sender.ended_s != self._echo_ended_s:
                self._echo_ended_s = self._sender.ended_s
                self._infrared.ignore_until(_to_us(self._echo_ended_s))
        return self._infrared.received_frames()

    def senses_carrier(self) -> bool:
        return self._infrared.senses_carrier()

    def is_sending(self) -> bool:
        return self._sender is not None and self._sender.is_sending()

    def send_frame(self, frame: int) -> None:
        if self._sender is not None:
            self._sender.send(frame)

    def close(self) -> None:
        """Release the pins, and stop receiving and sending."""
        with ExitStack() as cleanup:
            cleanup.callback(super().close)
            if self.guard:
                cleanup.callback(self.guard.dismiss)
            if self._sender is not None:
                cleanup.callback(self._sender.close)
            self._devices.close()

    def _open(self, kind: Callable[..., Any], pin: int | None, *arguments: Any, **options: Any) -> Any:
        """Open a device at ``pin`` that is closed with the board; None where there is no pin."""
        if pin is None:
            return None
        return self._devices.enter_context(kind(pin, *arguments, **options))

    def _receive_edge(self, ticks: float, state: int) -> None:
        """Take an edge from a thread of gpiozero's."""
        self._infrared.take_edge(_to_us(ticks), state)


class _DistanceSensor(DistanceSensor):  # type: ignore[misc]
    """An HC-SR04 whose thread ends before its pins are closed; gpiozero's thread could still ping a closed pin."""

    def __init__(self, echo: int, trigger: int, range_mm: int, factory: Any) -> None:
        # The kernel times the edges, and a missing echo is normal for a car that drives.
        warnings.simplefilter("ignore", PWMSoftwareFallback)
        warnings.simplefilter("ignore", DistanceSensorNoEcho)
        super().__init__(
            echo, trigger, max_distance=range_mm / 1000, queue_len=_PINGS, partial=True, pin_factory=factory
        )

    def close(self) -> None:
        if getattr(self, "_queue", None):
            self._queue.stop()
        super().close()


def _to_us(ticks_s: float) -> int:
    """Return the time of gpiozero's clock in µs that wrap at 2^30."""
    return int(ticks_s * 1e6) & TICKS_MASK


def open_car(equipment: Equipment, pins: PinMap, profile: Profile, gpio_chip: int | None = None) -> RaspberryPi:
    """Open the board of a car that words drive, and start its guard; ``gpio_chip`` as for `open_gpio`.

    Raises MotorcadeError: the pin file is another car's; the hardware isn't there, or this user may not use it. Raises
    OSError: the guard doesn't start.
    """
    board = RaspberryPi(equipment, pins, profile, *open_pins(equipment, pins, profile, gpio_chip))
    try:
        board.guard = MotorGuard(rescue_call(pins, gpio_chip), profile.drive.failsafe_ms)
    except OSError:
        board.close()
        raise
    # On a busy computer the guard would take a car that is late for a frozen one.
    hurry()
    return board


def rescue_call(pins: PinMap, gpio_chip: int | None) -> tuple[str, tuple[str, ...]]:
    """Return what another process has to call to stop the wheels, as `DriveBoard.rescue` does."""
    return f"{pull_low.__module__}:{pull_low.__name__}", pull_low_arguments(pins, gpio_chip)


def stop_wheels(pins: PinMap, gpio_chip: int | None = None) -> list[int]:
    """Make all pins that turn wheels low and return them; for a car whose program has died. Raises as `open_car`."""
    _check_computer(pins)
    pull_low(*pull_low_arguments(pins, gpio_chip))
    return motor_pins(pins)


def motor_pins(pins: PinMap) -> list[int]:
    """Return all pins that make wheels turn."""
    return [wire.pin for wire in pins.wires if wire.device.key in _MOTORS]


def pull_low_arguments(pins: PinMap, gpio_chip: int | None) -> tuple[str, ...]:
    """Return the arguments of `pull_low` that stop the wheels and switch everything off."""
    switches = [switch.name for switch in SWITCHES]
    switched = [wire.pin for wire in pins.wires if wire.device.key in switches]
    number = ""
    if gpio_chip is not None:
        number = str(gpio_chip)
    return (pins.chip.name, number, *map(str, motor_pins(pins) + switched))


def _check_computer(pins: PinMap) -> None:
    if not pins.chip.runs_linux:
        raise MotorcadeError("pin-file-of-microcontroller", car=pins.name, chip=pins.chip.name)


def open_pins(
    equipment: Equipment, pins: PinMap, profile: Profile, gpio_chip: int | None
) -> tuple[Any, LircSender | None]:
    """Open gpiozero's pin factory, and the infrared sender where the pin file names one. Raises MotorcadeError.

    Check first that a car has wheels of one kind, and that a follower has a receiver.
    """
    _check_computer(pins)
    kinds = sum(all(map(pins.has, kind)) for kind in _KINDS_OF_WHEELS)
    if kinds != 1:
        raise MotorcadeError("two-kinds-of-wheels" if kinds else "no-wheels", car=pins.name)
    if not equipment.is_leader and pins.pin("infrared", "receiver") is None:
        raise MotorcadeError("no-receiver", car=pins.name)
    factory = open_gpio(pins.chip, gpio_chip)
    if pins.pin("infrared", "sender") is None:
        return factory, None
    return factory, LircSender(open_sender(), profile.infrared.unit_us, factory.ticks)
