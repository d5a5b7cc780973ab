"""The wheels of a Linux car, on gpiozero: two motors, or one motor and a servo. Both obey words and drivers."""

from contextlib import ExitStack
from typing import Any, Protocol

from gpiozero import OutputDevice, PWMOutputDevice, Servo

from motorcade.boards.on_chip.motors import Wheels
from motorcade.boards.steering import CENTRE_DEG, motor_duties, servo_angle_deg
from motorcade.car.brain import FORWARD
from motorcade.config.pins import DUTY_MAX, PinMap
from motorcade.config.profile import Profile

# The pulses are timed by a program, whose lateness matters less the longer they are.
PWM_HZ = 100


class Chassis(Protocol):
    """Wheels of any kind. No motor gets more than the profile's ``motor.pwm_max``. Methods raise OSError."""

    def set(self, direction: int, speed_level: int) -> None:
        """As `motorcade.car.board.Board.set_wheels`."""

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        """As `motorcade.car.drive_board.DriveBoard.apply`."""

    def neutral(self) -> None:
        """Stand still with straight wheels."""


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


class TwoMotors:
    """A left and a right motor, whose difference steers."""

    def __init__(self, pins: PinMap, profile: Profile, factory: Any, held: ExitStack) -> None:
        self._left = Motor(pins, "left_motor", factory, held)
        self._right = Motor(pins, "right_motor", factory, held)
        self._most = profile.motor.pwm_max
        self._wheels = Wheels(self._left, self._right, *_duties(pins, self._most))

    def set(self, direction: int, speed_level: int) -> None:
        """See Chassis."""
        self._wheels.set(direction, speed_level)

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        """See Chassis."""
        left, right = motor_duties(angle_deg, direction, min(speed, self._most))
        self._left.drive(left)
        self._right.drive(right)

    def neutral(self) -> None:
        """See Chassis."""
        self._left.drive(0)
        self._right.drive(0)


class SteeredMotor:
    """A motor, and a servo that steers; a turn on the spot becomes a tight bend."""

    def __init__(self, pins: PinMap, profile: Profile, factory: Any, held: ExitStack) -> None:
        self._motor = Motor(pins, "drive_motor", factory, held)
        self._most = profile.motor.pwm_max
        self._drive_duties, self._turn_duties = _duties(pins, self._most)
        servo = profile.servo
        self._pulses_us = (servo.pulse_0_deg_us, servo.pulse_90_deg_us, servo.pulse_180_deg_us)
        self._servo = held.enter_context(
            Servo(
                pins.pin("servo", "signal"),
                initial_value=self._servo_value(CENTRE_DEG),
                min_pulse_width=min(self._pulses_us) / 1e6,
                max_pulse_width=max(self._pulses_us) / 1e6,
                frame_width=servo.period_ms / 1000,
                pin_factory=factory,
            )
        )

    def set(self, direction: int, speed_level: int) -> None:
        """See Chassis."""
        duties = self._drive_duties if direction == FORWARD else self._turn_duties
        self.apply(servo_angle_deg(direction), 1, duties[speed_level])

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        """See Chassis."""
        self._servo.value = self._servo_value(angle_deg)
        duty = min(speed, self._most)
        self._motor.drive(duty if direction else -duty)

    def neutral(self) -> None:
        """See Chassis."""
        self._motor.drive(0)
        self._servo.value = self._servo_value(CENTRE_DEG)

    def _servo_value(self, angle_deg: int) -> float:
        """The angle as gpiozero takes it, -1 for the shortest pulse to 1 for the longest."""
        right_us, centre_us, left_us = self._pulses_us
        if angle_deg < CENTRE_DEG:
            pulse_us = right_us + (centre_us - right_us) * angle_deg / CENTRE_DEG
        else:
            pulse_us = centre_us + (left_us - centre_us) * (angle_deg - CENTRE_DEG) / CENTRE_DEG
        shortest_us, longest_us = min(self._pulses_us), max(self._pulses_us)
        return 2 * (pulse_us - shortest_us) / (longest_us - shortest_us) - 1


def open_chassis(pins: PinMap, profile: Profile, factory: Any, held: ExitStack) -> Chassis | None:
    """The wheels that a pin file names, None where it names none; ``held`` closes them."""
    if pins.has("left_motor") and pins.has("right_motor"):
        return TwoMotors(pins, profile, factory, held)
    if pins.has("drive_motor") and pins.has("servo"):
        return SteeredMotor(pins, profile, factory, held)
    return None


def _duties(pins: PinMap, most: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Of the speed levels, straight on and turning."""
    drive, turn = (tuple(min(duty, most) for duty in duties) for duties in (pins.drive_duties, pins.turn_duties))
    return drive, turn
