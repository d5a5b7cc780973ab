"""Cars with a Raspberry Pi, or another computer with Linux: gpiozero behind the contracts of boards."""

import warnings
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any, Protocol

from gpiozero import DigitalInputDevice, DistanceSensor, GPIODevice, OutputDevice, PWMOutputDevice, Servo
from gpiozero.exc import DistanceSensorNoEcho, PWMSoftwareFallback

from motorcade.boards.hardware_watchdog import HardwareWatchdog
from motorcade.boards.infrared_receiver import InfraredReceiver
from motorcade.boards.linux import Equipment, LinuxBoard
from motorcade.boards.on_chip.motors import Wheels
from motorcade.boards.pins import DUTY_MAX, PinMap
from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.car.drive_board import DriveBoard
from motorcade.profile import Profile

# The pulses are timed by a program, whose lateness matters less the longer they are.
PWM_HZ = 100
_CENTRE_DEG = 90
_LEDS = 4
# The median of three is done with one false echo and is no older than 180 ms.
_PINGS = 3


class InfraredSender(Protocol):
    """What sends frames, such as `motorcade.boards.lirc.LircSender`. ``ended_s``: when the last one had been sent."""

    ended_s: float

    def send(self, frame: int) -> None:
        """Begin to send 32 bits."""

    def is_sending(self) -> bool:
        """Whether a frame is on the air."""

    def close(self) -> None:
        """Give up what it holds."""


class Motor:
    """One motor behind an L298-style driver, at the pins of ``part`` in a pin file.

    Without ``enable`` the PWM is on the direction pins. ``held`` closes what is opened here.
    """

    def __init__(self, pins: PinMap, part: str, factory: Any, held: ExitStack) -> None:
        def pulsed(pin: int | None) -> Any:
            return held.enter_context(PWMOutputDevice(pin, frequency=PWM_HZ, pin_factory=factory))

        directions = [pins.pin(part, key) for key in ("forward", "backward")]
        enable = pins.pin(part, "enable")
        self._enable = None if enable is None else pulsed(enable)
        if enable is None:
            self._directions = [pulsed(pin) for pin in directions]
        else:
            self._directions = [held.enter_context(OutputDevice(pin, pin_factory=factory)) for pin in directions]

    def drive(self, duty: int) -> None:
        """Turn forward with ``duty`` 1 to 255 of full power, backward with -1 to -255; 0 lets the motor run out."""
        share = abs(duty) / DUTY_MAX
        forward, backward = self._directions
        # Never both at once, and no power while they change.
        if self._enable is not None:
            self._enable.value = 0
        forward.value = 0
        backward.value = 0
        if duty:
            driven = forward if duty > 0 else backward
            driven.value = share if self._enable is None else 1
        if self._enable is not None:
            self._enable.value = share


class RaspberryPi(LinuxBoard):
    """A car that words drive, with the parts that its pin file names.

    Args:
        equipment: what every Linux car has.
        pins: which part is at which pin.
        profile: the car's kind.
        factory: gpiozero's pin factory, such as `motorcade.boards.gpio_chip.open_gpio` gives; closed with the board.
        sender: of infrared, None for none; closed with the board.
    """

    def __init__(
        self, equipment: Equipment, pins: PinMap, profile: Profile, factory: Any, sender: InfraredSender | None = None
    ) -> None:
        super().__init__(equipment)
        self._sender = sender
        self._held = ExitStack()
        self._held.callback(factory.close)
        self._wheels: Wheels | None = None
        if pins.has("left_motor") and pins.has("right_motor"):
            left, right = (Motor(pins, part, factory, self._held) for part in ("left_motor", "right_motor"))
            self._wheels = Wheels(left, right, pins.drive_duties, pins.turn_duties)
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
    """A car that somebody steers: a servo and one motor, at the pins that its pin file names.

    Args:
        pins: ``servo`` and ``drive_motor`` are used.
        profile: the car's kind; its ``servo`` and ``motor`` count.
        factory: as for RaspberryPi.
        watchdog: fed as long as all is well, and disarmed at the end; None for none.
        rescue: see `motorcade.car.drive_board.DriveBoard.rescue`.
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
        self._pwm_max = profile.motor.pwm_max
        servo = profile.servo
        self._pulses_us = (servo.pulse_0_deg_us, servo.pulse_90_deg_us, servo.pulse_180_deg_us)
        self._held = ExitStack()
        if watchdog is not None:
            self._held.callback(watchdog.close)
        self._held.callback(factory.close)
        self._motor = Motor(pins, "drive_motor", factory, self._held)
        self._servo = self._held.enter_context(
            Servo(
                pins.pin("servo", "signal"),
                initial_value=self._servo_value(_CENTRE_DEG),
                min_pulse_width=min(self._pulses_us) / 1e6,
                max_pulse_width=max(self._pulses_us) / 1e6,
                frame_width=servo.period_ms / 1000,
                pin_factory=factory,
            )
        )

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        self._servo.value = self._servo_value(angle_deg)
        duty = min(speed, self._pwm_max)
        self._motor.drive(duty if direction else -duty)

    def neutral(self) -> None:
        self._motor.drive(0)
        self._servo.value = self._servo_value(_CENTRE_DEG)

    def keep_alive(self) -> None:
        if self._watchdog is not None:
            self._watchdog.feed()

    def rescue(self) -> tuple[str, tuple[str, ...]] | None:
        return self._rescue

    def close(self) -> None:
        with self._held:
            self.neutral()

    def _servo_value(self, angle_deg: int) -> float:
        """The angle as gpiozero takes it, -1 for the shortest pulse to 1 for the longest."""
        right_us, centre_us, left_us = self._pulses_us
        if angle_deg < _CENTRE_DEG:
            pulse_us = right_us + (centre_us - right_us) * angle_deg / _CENTRE_DEG
        else:
            pulse_us = centre_us + (left_us - centre_us) * (angle_deg - _CENTRE_DEG) / _CENTRE_DEG
        shortest_us, longest_us = min(self._pulses_us), max(self._pulses_us)
        return 2 * (pulse_us - shortest_us) / (longest_us - shortest_us) - 1
