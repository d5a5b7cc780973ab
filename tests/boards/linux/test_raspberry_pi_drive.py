"""A steered car on a Raspberry Pi turns setpoints into its servo's pulse and its motor's duty, and ends in neutral."""

import os
import sys
from dataclasses import replace

import pytest

from motorcade.boards.linux.hardware_watchdog import HardwareWatchdog
from motorcade.config.profile import Motor
from support.mock_pi import LEFT_MOTOR, pulse_us, shown
from support.strategies import CLASSROOM


@pytest.mark.parametrize(
    ("angle_deg", "wanted_us"), [(0, 500), (45, 1000), (90, 1500), (91, 1511.111111), (135, 2000), (180, 2500)]
)
def test_the_servo_gets_the_pulse_of_its_angle(drive, pins, angle_deg, wanted_us):
    board = drive()
    assert (pins.pin(19).frequency, pulse_us(pins)) == (50, 1500)
    board.apply(angle_deg, 1, 0)
    assert pulse_us(pins) == pytest.approx(wanted_us, abs=1e-5)


def test_a_servo_that_is_bent_or_turned_round_goes_by_its_profile(drive, pins):
    bent = replace(CLASSROOM.servo, period_ms=10, pulse_0_deg_us=2400, pulse_90_deg_us=1400, pulse_180_deg_us=600)
    board = drive(replace(CLASSROOM, servo=bent))
    assert pins.pin(19).frequency == 100
    told = []
    for angle_deg in (0, 45, 90, 135, 180):
        board.apply(angle_deg, 1, 0)
        told.append(pulse_us(pins))
    assert told == pytest.approx([2400, 1900, 1400, 1000, 600], abs=1e-5)


@pytest.mark.parametrize("speed", [0, 1, 40, 150, 254, 255])
def test_the_motor_gets_its_duty_either_way(drive, pins, speed):
    board = drive()
    on = 255 if speed else 0
    board.apply(42, 1, speed)
    assert shown(pins, LEFT_MOTOR) == (on, 0, speed)
    board.apply(42, 0, speed)
    assert shown(pins, LEFT_MOTOR) == (0, on, speed)


def test_a_motor_gets_no_more_than_its_profile_allows(drive, pins):
    board = drive(replace(CLASSROOM, motor=Motor(pwm_max=120)))
    board.apply(90, 1, 200)
    assert shown(pins, LEFT_MOTOR) == (255, 0, 120)


def test_neutral_stops_the_wheels_and_centres_the_steering(drive, pins):
    board = drive()
    board.apply(10, 0, 255)
    board.neutral()
    assert (shown(pins, LEFT_MOTOR), pulse_us(pins)) == ((0, 0, 0), 1500)
    assert board.battery_mv() is None
    assert not board.has_program


def test_a_steered_car_is_closed_in_neutral_and_gives_its_pins_back(drive, pins):
    board = drive()
    motor = [pins.pin(number) for number in LEFT_MOTOR]
    board.apply(10, 1, 255)
    board.close()
    assert [(pin.state, pin.function) for pin in motor] == [(0, "input")] * 3
    assert pins.pins == {}


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such watchdog")
def test_a_steered_car_feeds_its_watchdog_and_disarms_it_at_the_end(drive, tmp_path):
    device = tmp_path / "watchdog"
    os.mkfifo(device)
    reader = os.open(device, os.O_RDONLY | os.O_NONBLOCK)
    board = drive(watchdog=HardwareWatchdog(device))
    board.keep_alive()
    assert os.read(reader, 100) == b"\0"
    board.close()
    assert os.read(reader, 100) == b"V"
    os.close(reader)


def test_a_steered_car_without_a_watchdog_says_who_rescues_it(drive):
    rescue = ("motorcade.boards.linux.rescue:pull_low", ("raspberry-pi", "", "5", "6", "12"))
    board = drive(rescue=rescue)
    board.keep_alive()
    assert board.rescue() == rescue
