"""The wheels of a Linux car, on gpiozero: two motors, or one motor and a servo.

Both kinds obey DRIVE words and control words. A DRIVE word has a servo's angle and one motor's duty, so two motors
steer by their difference; a control word turns on the spot, which takes two motors, so a steered car makes a bend.
"""

from contextlib import ExitStack
from functools import partial
from typing import Any, Protocol

from gpiozero import OutputDevice, PWMOutputDevice, Servo

from motorcade.boards.on_chip.parts import MotorPair
from motorcade.car.brain import FORWARD, LEFT, RIGHT
from motorcade.config.pins import DUTY_MAX, PinMap
from motorcade.config.profile import Profile

# Software times the pulses: the longer they are, the less its delays matter.
PWM_HZ = 100
CENTRE_DEG = 90
# A control word's turn on the spot becomes full lock to that side.
_ANGLES_DEG = {FORWARD: CENTRE_DEG, LEFT: 180, RIGHT: 0}


class Chassis(Protocol):
    """Wheels of any kind. No motor gets a higher duty than the profile's ``motor.pwm_max``. Methods raise OSError."""

    def set(self, direction: int, speed_level: int) -> None:
        """Turn as a control word asks; arguments as of `motorcade.car.board.Board.set_wheels`."""

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        """Turn as a DRIVE word asks; arguments as of `motorcade.car.drive_board.DriveBoard.apply`."""

    def neutral(self) -> None:
        """Stop, with straight wheels."""


class GpioMotor:
    """One motor behind an L298-style driver, at the pins of ``part`` in a pin file.

    Without ``enable`` the PWM is on the direction pins. ``devices`` closes what is opened here.
    """

    def __init__(self, pins: PinMap, part: str, factory: Any, devices: ExitStack) -> None:
        pulsed = partial(PWMOutputDevice, frequency=PWM_HZ, pin_factory=factory)
        switched = partial(OutputDevice, pin_factory=factory)
        self._enable = []
        kind = pulsed
        enable = pins.pin(part, "enable")
        if enable is not None:
            self._enable = [devices.enter_context(pulsed(enable))]
            kind = switched
        self._directions = [devices.enter_context(kind(pins.pin(part, key))) for key in ("forward", "backward")]

    def drive(self, duty: int) -> None:
        """Turn forward with ``duty`` 1 to 255 of full power, backward with -1 to -255; with 0 the motor coasts."""
        # Never both at once, and no power while they change.
        for device in self._enable + self._directions:
            device.value = 0
        if duty:
            on = [self._directions[duty < 0], *self._enable]
            for device in on[:-1]:
                device.value = 1
            on[-1].value = abs(duty) / DUTY_MAX


class TwoMotors(MotorPair):
    """A left and a right motor; their difference steers."""

    def __init__(self, pins: PinMap, profile: Profile, factory: Any, devices: ExitStack) -> None:
        self._max_duty = profile.motor.pwm_max
        left, right = (GpioMotor(pins, part, factory, devices) for part in ("left_motor", "right_motor"))
        wheels = profile.wheels
        percents = (wheels.left_duty_percent, wheels.right_duty_percent)
        super().__init__(left, right, *_duties(pins, self._max_duty), percents)

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        left, right = motor_duties(angle_deg, direction, min(speed, self._max_duty))
        self._left.drive(left)
        self._right.drive(right)

    def neutral(self) -> None:
        self._left.drive(0)
        self._right.drive(0)


class SteeredMotor:
    """A motor and a steering servo; a turn on the spot becomes a tight bend."""

    def __init__(self, pins: PinMap, profile: Profile, factory: Any, devices: ExitStack) -> None:
        self._motor = GpioMotor(pins, "drive_motor", factory, devices)
        self._max_duty = profile.motor.pwm_max
        self._drive_duties, self._turn_duties = _duties(pins, self._max_duty)
        servo = profile.servo
        self._pulses_us = (servo.pulse_0_deg_us, servo.pulse_90_deg_us, servo.pulse_180_deg_us)
        self._servo = devices.enter_context(
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
        duties = self._turn_duties
        if direction == FORWARD:
            duties = self._drive_duties
        self.apply(_ANGLES_DEG[direction], 1, duties[speed_level])

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        self._servo.value = self._servo_value(angle_deg)
        duty = min(speed, self._max_duty)
        if direction == 0:
            duty = -duty
        self._motor.drive(duty)

    def neutral(self) -> None:
        self._motor.drive(0)
        self._servo.value = self._servo_value(CENTRE_DEG)

    def _servo_value(self, angle_deg: int) -> float:
        """Return the angle as gpiozero takes it: -1 for the shortest pulse to 1 for the longest."""
        right_us, centre_us, left_us = self._pulses_us
        if angle_deg < CENTRE_DEG:
            pulse_us = right_us + (centre_us - right_us) * angle_deg / CENTRE_DEG
        else:
            pulse_us = centre_us + (left_us - centre_us) * (angle_deg - CENTRE_DEG) / CENTRE_DEG
        shortest_us = min(self._pulses_us)
        longest_us = max(self._pulses_us)
        return 2 * (pulse_us - shortest_us) / (longest_us - shortest_us) - 1


def motor_duties(angle_deg: int, direction: int, speed: int) -> tuple[int, int]:
    """Return the duties of a left and a right motor for a DRIVE word; negative duties turn backward.

    The outer wheel has the word's duty. The inner wheel has a share of it: all at 90 degrees, half at 45 and 135,
    none at 0 and 180, where the car turns about its inner wheel.

    Args:
        angle_deg: 0 to 180; below 90 is right.
        direction: 1 forward, 0 backward.
        speed: duty, 0 to 255.
    """
    off_deg = abs(angle_deg - CENTRE_DEG)
    inner = (speed * (CENTRE_DEG - off_deg) + CENTRE_DEG // 2) // CENTRE_DEG
    if direction == 0:
        speed = -speed
        inner = -inner
    if angle_deg < CENTRE_DEG:
        return speed, inner
    return inner, speed


def open_chassis(pins: PinMap, profile: Profile, factory: Any, devices: ExitStack) -> Chassis:
    """Open the wheels that a pin file names; ``devices`` closes them."""
    if pins.has("left_motor"):
        return TwoMotors(pins, profile, factory, devices)
    return SteeredMotor(pins, profile, factory, devices)


def _duties(pins: PinMap, max_duty: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the duties of the speed levels, straight on and turning."""
    drive = tuple(min(duty, max_duty) for duty in pins.drive_duties)
    turn = tuple(min(duty, max_duty) for duty in pins.turn_duties)
    return drive, turn
