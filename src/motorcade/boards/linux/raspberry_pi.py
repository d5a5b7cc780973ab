"""Cars with a Raspberry Pi, or another computer with Linux: gpiozero behind the contracts of boards."""

import warnings
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any, Protocol

from gpiozero import DigitalInputDevice, DistanceSensor, GPIODevice, OutputDevice
from gpiozero.exc import DistanceSensorNoEcho, PWMSoftwareFallback

from motorcade.boards.linux.board import Equipment, LinuxBoard
from motorcade.boards.linux.chassis import open_chassis
from motorcade.boards.linux.hardware_watchdog import HardwareWatchdog
from motorcade.boards.linux.infrared_receiver import InfraredReceiver
from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.car.drive_board import DriveBoard
from motorcade.config.pins import PinMap
from motorcade.config.profile import Profile
from motorcade.errors import MotorcadeError

_LEDS = 4
# The median of three is done with one false echo and is no older than 180 ms.
_PINGS = 3


class InfraredSender(Protocol):
    """Sends frames, such as `motorcade.boards.linux.lirc.LircSender`. ``ended_s``: when the last one had been sent."""

    ended_s: float

    def send(self, frame: int) -> None:
        """Begin to send 32 bits."""

    def is_sending(self) -> bool:
        """Whether a frame is on the air."""

    def close(self) -> None:
        """Give up what it holds."""


class WordWheels(Protocol):
    """What words make turn."""

    def set(self, direction: int, speed_level: int) -> None:
        """As `motorcade.car.board.Board.set_wheels`."""


class RaspberryPi(LinuxBoard):
    """A car that words drive, with the parts that its pin file names.

    Args:
        equipment: what every Linux car has.
        pins: which part is at which pin.
        profile: the car's kind.
        factory: gpiozero's pin factory (`motorcade.boards.linux.gpio_chip.open_gpio`); closed with the board.
        sender: of infrared, None for none; closed with the board.
        wheels: what its words turn, where another board has the wheels and closes ``factory``; those of its pin
            file, unless given.
    """

    def __init__(
        self,
        equipment: Equipment,
        pins: PinMap,
        profile: Profile,
        factory: Any,
        sender: InfraredSender | None = None,
        wheels: WordWheels | None = None,
    ) -> None:
        super().__init__(equipment)
        self._sender = sender
        self._held = ExitStack()
        if wheels is None:
            self._held.callback(factory.close)
            wheels = open_chassis(pins, profile, factory, self._held)
        self._wheels = wheels
        self._leds = [
            self._at(OutputDevice, pins.pin("leds", f"led_{which}"), pin_factory=factory) for which in range(_LEDS)
        ]
        self._pir = self._at(DigitalInputDevice, pins.pin("pir", "output"), pin_factory=factory)
        self._range_mm = profile.body.ultrasonic_range_mm
        self._ultrasonic = self._at(
            _distance_sensor, pins.pin("ultrasonic", "echo"), pins.pin("ultrasonic", "trigger"), self._range_mm, factory
        )
        self._infrared = InfraredReceiver(profile.infrared.unit_us, factory.ticks)
        self._receiver = self._at(GPIODevice, pins.pin("infrared", "receiver"), pin_factory=factory)
        if self._receiver is not None:
            self._receiver.pin.input_with_pull("up")
            self._receiver.pin.edges = "both"
            self._receiver.pin.when_changed = self._take_edge

    def set_wheels(self, direction: int, speed_level: int) -> None:
        if self._wheels:
            self._wheels.set(direction, speed_level)

    def set_led(self, which: int) -> None:
        for number, led in enumerate(self._leds):
            if led is not None:
                led.value = number == which

    def obstacle_mm(self) -> int:
        if self._ultrasonic is None:
            return NOTHING_IN_SIGHT_MM
        share: float = self._ultrasonic.value
        # 0 stands for 'nothing measured yet': no HC-SR04 measures less than 20 mm.
        return NOTHING_IN_SIGHT_MM if share in (0, 1) else round(share * self._range_mm)

    def sees_person(self) -> bool:
        return self._pir is not None and bool(self._pir.value)

    def received_frames(self) -> list[int]:
        if self._sender is None:
            return self._infrared.received_frames(False, float("-inf"))
        return self._infrared.received_frames(self._sender.is_sending(), self._sender.ended_s)

    def senses_carrier(self) -> bool:
        return self._infrared.senses_carrier()

    def is_sending(self) -> bool:
        return self._sender is not None and self._sender.is_sending()

    def send_frame(self, frame: int) -> None:
        if self._sender is not None:
            self._sender.send(frame)

    def close(self) -> None:
        """Give the pins back, and stop listening and sending."""
        with ExitStack() as rest:
            rest.callback(super().close)
            if self._sender is not None:
                rest.callback(self._sender.close)
            self._held.close()

    def _at(self, kind: Callable[..., Any], pin: int | None, *arguments: Any, **options: Any) -> Any:
        """A device at ``pin`` that is closed with the board; None where there is no pin."""
        return None if pin is None else self._held.enter_context(kind(pin, *arguments, **options))

    def _take_edge(self, ticks: float, state: int) -> None:
        """Called by a thread of gpiozero's. The receiver's output is low while there is carrier."""
        self._infrared.receive_edge(ticks, not state)


def _distance_sensor(echo: int, trigger: int, range_mm: int, factory: Any) -> Any:
    # Its edges carry the kernel's time, and a sensor that falls silent is no news to a car that drives.
    warnings.simplefilter("ignore", PWMSoftwareFallback)
    warnings.simplefilter("ignore", DistanceSensorNoEcho)
    return DistanceSensor(
        echo, trigger, max_distance=range_mm / 1000, queue_len=_PINGS, partial=True, pin_factory=factory
    )


class RaspberryPiDrive(DriveBoard):
    """A car that somebody steers, with the wheels that its pin file names: two motors, or one motor and a servo.

    Args:
        pins: which part is at which pin.
        profile: the car's kind; its ``servo`` and ``motor`` count.
        factory: as for RaspberryPi.
        watchdog: fed as long as all is well, and disarmed at the end; None for none.
        rescue: see `motorcade.car.drive_board.DriveBoard.rescue`.

    Raises:
        MotorcadeError: the pin file names no wheels.
    """

    def __init__(
        self,
        pins: PinMap,
        profile: Profile,
        factory: Any,
        watchdog: HardwareWatchdog | None = None,
        rescue: tuple[str, tuple[str, ...]] | None = None,
    ) -> None:
        self._watchdog = watchdog
        self._rescue = rescue
        self._held = ExitStack()
        if watchdog is not None:
            self._held.callback(watchdog.close)
        self._held.callback(factory.close)
        chassis = open_chassis(pins, profile, factory, self._held)
        if chassis is None:
            raise MotorcadeError("no-wheels", car=pins.name)
        self._chassis = chassis

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        self._chassis.apply(angle_deg, direction, speed)

    def neutral(self) -> None:
        self._chassis.neutral()

    def keep_alive(self) -> None:
        if self._watchdog is not None:
            self._watchdog.feed()

    def rescue(self) -> tuple[str, tuple[str, ...]] | None:
        return self._rescue

    def close(self) -> None:
        with self._held:
            self.neutral()
