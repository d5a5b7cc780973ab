"""Both kinds of wheels obey both kinds of words: DRIVE words and control words."""

from contextlib import ExitStack
from dataclasses import replace

import pytest

from motorcade.boards.linux.chassis import motor_duties, open_chassis
from motorcade.config.pins import parse_pins
from motorcade.config.profile import DriveMotor
from support.mock_pi import DUTIES, ENABLED, HEAD, LEFT_MOTOR, STEERED, pulse_us, shown
from support.strategies import CLASSROOM

WEAK = replace(CLASSROOM, motor=DriveMotor(pwm_max=60))


@pytest.fixture
def chassis(pins):
    """Open the wheels of a pin file."""
    with ExitStack() as devices:
        yield lambda text, profile=CLASSROOM: open_chassis(parse_pins(HEAD + text, "test.toml"), profile, pins, devices)


# Two motors that a driver steers


@pytest.mark.parametrize(
    ("angle_deg", "duties"),
    [(90, (180, 180)), (45, (180, 90)), (0, (180, 0)), (135, (90, 180)), (180, (0, 180)), (89, (180, 178))],
)
def test_the_inner_motor_is_slower_in_tighter_bends(angle_deg, duties):
    assert motor_duties(angle_deg, 1, 180) == duties
    assert motor_duties(angle_deg, 0, 180) == tuple(-duty for duty in duties)


# A servo and a motor that words drive


@pytest.mark.parametrize(
    ("direction", "level", "wanted_us", "duty"),
    [(0, 1, 1500, 51), (0, 3, 1500, 255), (1, 2, 2500, 34), (2, 3, 500, 85), (0, 0, 1500, 0)],
)
def test_a_words_turn_is_full_lock_on_a_car_with_a_servo(chassis, pins, direction, level, wanted_us, duty):
    wheels = chassis(STEERED + DUTIES)
    wheels.set(direction, level)
    assert pulse_us(pins) == pytest.approx(wanted_us, abs=1e-5)
    assert shown(pins, LEFT_MOTOR) == (255 if duty else 0, 0, duty)


# A servo and a motor that DRIVE words drive


@pytest.mark.parametrize(
    ("angle_deg", "pulse"), [(0, 500), (45, 1000), (90, 1500), (91, 1511.111111), (135, 2000), (180, 2500)]
)
def test_the_servo_gets_the_pulse_of_its_angle(chassis, pins, angle_deg, pulse):
    wheels = chassis(STEERED)
    assert (pins.pin(19).frequency, pulse_us(pins)) == (50, 1500)
    wheels.apply(angle_deg, 1, 0)
    assert pulse_us(pins) == pytest.approx(pulse, abs=1e-5)


def test_a_servo_with_uneven_or_reversed_pulses_follows_its_profile(chassis, pins):
    uneven = replace(CLASSROOM.servo, period_ms=10, pulse_0_deg_us=2400, pulse_90_deg_us=1400, pulse_180_deg_us=600)
    wheels = chassis(STEERED, replace(CLASSROOM, servo=uneven))
    assert pins.pin(19).frequency == 100
    pulses_us = []
    for angle_deg in (0, 45, 90, 135, 180):
        wheels.apply(angle_deg, 1, 0)
        pulses_us.append(pulse_us(pins))
    assert pulses_us == pytest.approx([2400, 1900, 1400, 1000, 600], abs=1e-5)


@pytest.mark.parametrize("speed", [0, 1, 40, 150, 254, 255])
def test_the_motor_gets_its_duty_in_both_directions(chassis, pins, speed):
    wheels = chassis(STEERED)
    on = 255 if speed else 0
    wheels.apply(42, 1, speed)
    assert shown(pins, LEFT_MOTOR) == (on, 0, speed)
    wheels.apply(42, 0, speed)
    assert shown(pins, LEFT_MOTOR) == (0, on, speed)


@pytest.mark.parametrize("text", [ENABLED, STEERED + DUTIES], ids=["two motors", "a servo"])
def test_no_motor_exceeds_the_duty_of_its_profile(chassis, pins, text):
    wheels = chassis(text, WEAK)
    wheels.set(0, 3)
    assert shown(pins, LEFT_MOTOR) == (255, 0, 60)
    wheels.set(0, 1)
    assert shown(pins, LEFT_MOTOR) == (255, 0, 51)
    wheels.apply(90, 1, 200)
    assert shown(pins, LEFT_MOTOR) == (255, 0, 60)
