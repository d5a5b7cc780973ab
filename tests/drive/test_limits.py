"""What a profile limits while somebody drives: a car whose clock, board and battery are the test's."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest

from motorcade.car.arbiter import APPLIED, NEEDS_NEUTRAL, UNPOWERED
from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.car.drive_limits import READINGS
from motorcade.config.profile import Profile
from motorcade.drive.session import CarControl, ControlSession
from motorcade.drive.wire import SessionError
from motorcade.engine.simulated_drive import DrivenCars
from motorcade.engine.world import World
from motorcade.mats import playground
from motorcade.words.formats import DRIVE
from support.mock_board import CLASSROOM, NEUTRAL, MockCar

AHEAD = DRIVE.encode(angle=90, direction=1, speed=255)
BACK = DRIVE.encode(angle=90, direction=0, speed=255)
STILL = DRIVE.encode(angle=90, direction=1, speed=0)
SECOND_MS = 1000


def limited(**keys: Any) -> Profile:
    return replace(CLASSROOM, drive=replace(CLASSROOM.drive, **keys))


class LimitedCar(MockCar):
    """A car with limits, and its driver."""

    def __init__(self, **keys: Any) -> None:
        super().__init__(limited(**keys))
        self.board.voltage_mv = 7400
        self.session = ControlSession(self.control, "ada")

    def drive(self, word: int, for_ms: int, session: ControlSession | None = None) -> list[int]:
        """Send ``word`` every 50 ms; the speed after each time that the car did what was due."""
        speeds, end_ms = [], self.now_ms + for_ms
        sent_ms = self.now_ms - 50
        while self.now_ms < end_ms:
            if self.now_ms - sent_ms >= 50:
                (session or self.session).command(word)
                sent_ms = self.now_ms
            rest_ms = self.control.beat()
            speeds.append(self.board.setpoint[2])
            self.now_ms += min(rest_ms, 50)
        return speeds

    @property
    def shown(self) -> tuple[str, int, int | None]:
        """State, speed and obstacle of the telemetry."""
        telemetry = self.control.telemetry()
        return telemetry.state, telemetry.speed, telemetry.obstacle_mm


def test_a_car_without_limits_has_nothing_to_do_until_its_command_is_old() -> None:
    car = LimitedCar()
    car.session.command(AHEAD)
    assert car.control.beat() >= CLASSROOM.drive.failsafe_ms


# Acceleration


def test_a_car_speeds_up_no_faster_than_its_profile_says_and_stops_at_once() -> None:
    car = LimitedCar(acceleration_max_mm_per_s2=300)
    speeds = car.drive(AHEAD, 1200)
    # 300 mm/s is full speed, so that takes a second; the limit acts every 20 ms.
    assert speeds == sorted(speeds)
    assert (speeds[0], speeds[-1]) == (0, 255)
    assert max(later - earlier for earlier, later in pairwise(speeds)) <= 6
    assert len(speeds) - speeds.count(255) == pytest.approx(50, abs=2)
    car.session.command(STILL)
    assert car.board.setpoint == NEUTRAL
    car.drive(AHEAD, 1200)
    car.session.stop()
    assert car.board.setpoint == NEUTRAL


def test_the_failsafe_waits_for_no_limit_and_telemetry_has_the_speed_that_is_applied() -> None:
    car = LimitedCar(acceleration_max_mm_per_s2=300)
    car.drive(AHEAD, 500)
    assert car.shown[1] == car.board.setpoint[2] < 150
    car.now_ms += 301
    car.control.beat()
    assert (car.board.setpoint, car.shown[0]) == (NEUTRAL, "failsafe")


# Obstacles


def test_an_obstacle_stops_the_driver_until_they_drive_backward_or_it_is_gone() -> None:
    car = LimitedCar(obstacle_stop_mm=150)
    assert car.drive(AHEAD, 100)[-1] == 255
    car.board.ahead_mm = 140
    # The driver's command is the old one: the car looks by itself.
    car.now_ms += car.control.beat()
    car.control.beat()
    assert (car.board.setpoint, car.shown) == (NEUTRAL, ("moving", 0, 140))
    assert car.session.command(BACK) == APPLIED
    assert (car.board.setpoint, car.shown) == ((90, 0, 255), ("moving", 255, None))
    assert car.drive(AHEAD, 100)[-1] == 0
    car.board.ahead_mm = NOTHING_IN_SIGHT_MM
    assert car.drive(AHEAD, 100)[-1] == 255


def test_without_a_sensor_or_without_the_key_nothing_stops_a_driver() -> None:
    without_key, without_sensor = LimitedCar(), LimitedCar(obstacle_stop_mm=150)
    without_key.board.ahead_mm, without_sensor.board.ahead_mm = 1, None
    assert without_key.drive(AHEAD, 100)[-1] == without_sensor.drive(AHEAD, 100)[-1] == 255
    # Nobody asks a sensor that isn't needed.
    without_key.board.ahead_mm = -1
    assert without_key.drive(AHEAD, 100)[-1] == 255
    assert without_key.control.telemetry().last_fault == ""


def test_a_sensor_that_fails_stops_the_car() -> None:
    car = LimitedCar(obstacle_stop_mm=150)
    car.drive(AHEAD, 100)
    car.board.ahead_mm = -1
    car.control.beat()
    telemetry = car.control.telemetry()
    assert (telemetry.state, telemetry.last_fault) == ("failsafe", "the sensor is broken")
    assert car.board.setpoint == NEUTRAL


def test_a_simulated_car_stops_before_the_wall_that_its_driver_heads_for() -> None:
    world = World(playground(), [bytes(4)], limited(obstacle_stop_mm=450), kernels="webassembly")
    driven, at_ms = DrivenCars(), [0]
    board = driven.board(0, has_program=False)
    control = CarControl(board, lambda: at_ms[0], world.profile)
    session = ControlSession(control, "ada")
    board.apply(*NEUTRAL)
    for _ in range(400):
        session.command(AHEAD)
        driven.steer(world)
        world.run(50)
        at_ms[0] += 50
    assert control.telemetry().obstacle_mm == board.ahead_mm
    # No nearer than the way of one look, and it didn't stop far away.
    assert 400 < board.ahead_mm < 450
    before = world.snapshot().x_m[0]
    session.command(BACK)
    driven.steer(world)
    world.run(500)
    assert world.snapshot().x_m[0] != before


# Battery


def test_a_low_battery_ends_in_a_gentle_stop_and_commands_count_again_once_it_is_charged() -> None:
    car = LimitedCar(battery_low_mv=6400, battery_charged_mv=7000, acceleration_max_mm_per_s2=600)
    car.drive(AHEAD, 2 * SECOND_MS)
    car.board.voltage_mv = 6000
    speeds = car.drive(AHEAD, (READINGS + 1) * SECOND_MS)
    falling = [speed for speed in speeds if 0 < speed < 255]
    # Half a second of 20 ms each, as fast as it may speed up.
    assert falling == sorted(falling, reverse=True)
    assert len(falling) == pytest.approx(25, abs=2)
    assert (car.shown[0], car.board.setpoint) == ("discharged", NEUTRAL)
    assert car.session.command(AHEAD) == car.session.command(STILL) == UNPOWERED
    with pytest.raises(SessionError, match="battery"):
        car.session.resume_program()
    car.board.voltage_mv = 6900
    car.drive(AHEAD, 5 * SECOND_MS)
    assert car.shown[0] == "discharged"
    car.board.voltage_mv = 7000
    car.drive(AHEAD, (READINGS + 1) * SECOND_MS)
    # A stick that is still held moves nothing.
    assert (car.shown[0], car.board.setpoint) == ("failsafe", NEUTRAL)
    assert car.session.command(STILL) == APPLIED
    assert car.drive(AHEAD, SECOND_MS)[-1] == 255


def test_an_emergency_stop_ends_a_gentle_stop_and_outlasts_the_battery() -> None:
    car = LimitedCar(battery_low_mv=6400, battery_charged_mv=7000)
    car.drive(AHEAD, SECOND_MS)
    car.board.voltage_mv = 6000
    while car.board.setpoint[2] == 255:
        car.drive(AHEAD, 50)
    car.session.stop()
    assert (car.board.setpoint, car.shown[0]) == (NEUTRAL, "stopped")
    car.session.clear()
    assert car.shown[0] == "discharged"


def test_a_low_battery_stops_the_program_too() -> None:
    car = LimitedCar(battery_low_mv=6400, battery_charged_mv=7000)
    car.session.resume_program()
    car.board.voltage_mv = 6000
    for _ in range(READINGS + 1):
        car.now_ms += SECOND_MS
        car.control.beat()
    assert (car.shown[0], car.board.setpoint, car.board.calls.count(("begin",))) == ("discharged", NEUTRAL, 1)


def test_a_battery_that_can_not_be_read_any_more_counts_as_flat() -> None:
    car = LimitedCar(battery_low_mv=6400, battery_charged_mv=7000)
    assert car.drive(AHEAD, 2 * SECOND_MS)[-1] == 255
    car.board.battery_mv = broken_sensor
    car.drive(AHEAD, (READINGS - 1) * SECOND_MS)
    assert car.shown[0] == "moving"
    car.drive(AHEAD, 4 * SECOND_MS)
    assert (car.shown[0], car.board.setpoint) == ("discharged", NEUTRAL)
    assert car.control.telemetry().last_fault == "no answer from the sensor"
    del car.board.battery_mv
    car.board.voltage_mv = 7100
    car.drive(AHEAD, (READINGS + 1) * SECOND_MS)
    assert car.session.command(STILL) == APPLIED
    assert car.drive(AHEAD, SECOND_MS)[-1] == 255


def broken_sensor() -> int:
    raise OSError("no answer from the sensor")


@pytest.mark.parametrize("voltage_mv", [None, 7399, 6400])
def test_a_battery_that_is_not_low_or_not_measured_changes_nothing(voltage_mv: int | None) -> None:
    car = LimitedCar(battery_low_mv=6400, battery_charged_mv=7000)
    car.board.voltage_mv = voltage_mv
    assert car.drive(AHEAD, 5 * SECOND_MS)[-1] == 255


# Arming


def test_a_car_that_asks_for_arming_refuses_the_first_move_of_each_driver() -> None:
    car = LimitedCar(arming=True)
    assert car.session.command(AHEAD) == NEEDS_NEUTRAL
    assert (car.shown[0], car.session.counts["needs-neutral"]) == ("disarmed", 1)
    assert car.session.command(STILL) == car.session.command(AHEAD) == APPLIED
    car.session.release()
    other = ControlSession(car.control, "other")
    assert other.command(AHEAD) == NEEDS_NEUTRAL
    assert car.board.setpoint == NEUTRAL
    assert other.command(STILL) == other.command(AHEAD) == APPLIED
