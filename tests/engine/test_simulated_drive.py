"""Simulated cars that somebody drives: they follow the bicycle model, and their brain goes on."""

from dataclasses import replace

import numpy as np
import pytest

from motorcade import Followers, Physics, Pose, forward, led, left, right, together, wait
from motorcade.engine.simulated_drive import DrivenCars, LiveWorld
from motorcade.engine.state import DRIVEN
from motorcade.errors import MotorcadeError
from support.strategies import CLASSROOM
from support.tables import FORWARD, hearers, leaders, table, wheels

RADIUS_M = CLASSROOM.body.diameter_mm / 2000
# The distance of the fastest car in a tick of 20 ms.
TICK_M = 0.006
STANDING = [wait(3)]


def alone(**more):
    return table(STANDING, None, [Pose(0, 0)], **more)


@pytest.mark.parametrize(("direction", "sign"), [(1, 1), (0, -1)])
@pytest.mark.parametrize(("speed", "metres"), [(255, 0.6), (128, 0.6 * 128 / 255), (0, 0)])
def test_a_car_driven_straight_has_the_speed_of_its_duty(direction, sign, speed, metres):
    cars = alone()
    cars.drive(0, 90, direction, speed)
    cars.run(2000)
    shown = cars.snapshot()
    assert shown.x_m[0] == pytest.approx(sign * metres, abs=1e-5)
    assert shown.y_m[0] == shown.heading[0] == 0


@pytest.mark.parametrize(("angle_deg", "side"), [(180, 1), (135, 1), (0, -1)])
@pytest.mark.parametrize("direction", [0, 1])
def test_a_steered_car_follows_the_circle_of_the_bicycle_model(angle_deg, side, direction):
    cars = alone()
    cars.drive(0, angle_deg, direction, 255)
    steered = np.tan(np.radians(CLASSROOM.servo.steering_deg * abs(angle_deg - 90) / 90))
    base_m = CLASSROOM.body.wheel_base_mm / 1000
    # The middle between the axles; the rear one's circle has the radius base / tan.
    radius_m = np.hypot(base_m / steered, base_m / 2)
    shown = []
    for _ in range(round(2 * np.pi * radius_m / 0.3 * 1000) + 1):
        cars.step()
        now = cars.snapshot()
        shown.append((now.x_m[0], now.y_m[0]))
    x_m, y_m = np.array(shown).T
    assert np.ptp(x_m) == pytest.approx(2 * radius_m, abs=1e-3)
    assert np.ptp(y_m) == pytest.approx(2 * radius_m, abs=1e-3)
    assert np.hypot(x_m[-1], y_m[-1]) < 1e-3
    # The circle lies on the side to which the wheels are turned, in both driving directions.
    assert side * (y_m.max() + y_m.min()) > radius_m


def test_a_driven_car_stops_at_walls_and_obstacles():
    wall_m = 0.12
    cars = alone(tick_ms=20, walls=((wall_m, -2, wall_m, 2),))
    cars.run(2000)
    # First straight ahead, then along the wall.
    for angle_deg in (90, 180, 120, 0):
        cars.drive(0, angle_deg, 1, 255)
        for _ in range(200):
            cars.step()
            assert cars.snapshot().x_m[0] < wall_m - RADIUS_M + 1.01 * TICK_M
    assert cars.counts()["touching_ms"][0] > 500


def test_a_driven_car_pushes_other_cars_and_is_seen_and_received():
    cars = table(STANDING, None, [Pose(0, 0), Pose(0.3, 0)])
    cars.drive(0, 90, 1, 255)
    cars.run(2000)
    pushing, pushed = cars.snapshot().x_m.tolist()
    assert 0.3 < pushing < pushed
    assert pushed - pushing >= 2 * RADIUS_M - 0.012


def test_a_driven_leader_keeps_sending_and_running_its_states():
    program = [together(forward(2), led(1, 2)), left(2)]
    driven, free = (table(program, Followers([forward(2)]), [Pose(0, 0), Pose(0, 0.5)]) for _ in range(2))
    driven.drive(0)
    assert hearers(driven, 3000) == hearers(free, 3000) == {1}
    shown, other = driven.snapshot(), free.snapshot()
    assert (shown.word[0], shown.led[0]) == (other.word[0], other.led[0])
    assert shown.x_m[0] < 0.1 < other.x_m[0]


def test_a_driven_follower_receives_words_and_obeys_its_driver():
    cars = table([wait(3)], Followers([together(forward(3), led(2, 3))]), [Pose(0, 0), Pose(-0.3, 0)])
    cars.run(500)
    assert cars.snapshot().wheels[1] == FORWARD
    cars.drive(1, 90, 0, 85)
    cars.run(1000)
    shown = cars.snapshot()
    assert (shown.led[1], shown.wheels[1]) == (2, DRIVEN + 1)
    assert shown.x_m[1] < -0.3


def test_a_released_car_continues_its_program_at_the_present_state():
    driven, free = (table([forward(2), right(2), forward(2)], None, [Pose(0, 0)]) for _ in range(2))
    driven.drive(0, 90, 1, 0)
    for cars in (driven, free):
        cars.run(2500)
    driven.give_back(0)
    assert wheels(driven, 3000) == wheels(free, 3000)
    # A second call changes nothing.
    driven.give_back(0)
    assert wheels(driven, 500) == wheels(free, 500)


def test_wheel_slip_affects_driven_cars():
    cars = leaders(STANDING, [Pose(0, float(y)) for y in range(60)], tick_ms=20, physics=Physics(wheel_noise=0.05))
    for car in range(60):
        cars.drive(car, 90, 1, 255)
    cars.run(9000)
    shown = cars.snapshot()
    aside_m = shown.y_m - np.arange(60)
    assert len(set(aside_m.tolist())) == 60
    assert abs(aside_m.mean()) < 4 * aside_m.std() / np.sqrt(60)
    assert shown.x_m.mean() == pytest.approx(2.7, rel=0.03)


def test_reset_ends_driving():
    cars = table([forward(3)], None, [Pose(0, 0)])
    cars.drive(0)
    cars.reset()
    assert set(wheels(cars, 1000)) == {FORWARD}


def test_driving_a_car_that_does_not_exist_is_an_error():
    with pytest.raises(MotorcadeError, match="car is 1; allowed: a whole number from 0 to 0"):
        alone().drive(1)
    with pytest.raises(MotorcadeError, match="car is -1; allowed: a whole number from 0 to 0"):
        alone().give_back(-1)
    far = replace(CLASSROOM, servo=replace(CLASSROOM.servo, steering_deg=90))
    with pytest.raises(MotorcadeError, match=r"servo\.steering_deg is 90"):
        leaders(STANDING, [Pose(0, 0)], far)


# Boards


def test_a_board_acts_at_the_next_tick_and_gives_the_wheels_to_the_program():
    cars, driven = table([forward(3)], None, [Pose(0, 0)]), DrivenCars()
    board = driven.board(0, has_program=True)

    def after(command):
        command()
        driven.steer(cars)
        cars.run(100)
        return cars.snapshot().wheels[0]

    assert after(lambda: None) == FORWARD
    assert after(board.end_program) == DRIVEN
    assert after(lambda: board.apply(90, 0, 255)) == DRIVEN + 3
    assert after(board.neutral) == DRIVEN
    assert after(board.begin_program) == FORWARD
    board.apply(90, 1, 100)
    cars.reset()
    assert after(lambda: None) == DRIVEN + 2


def test_a_board_without_its_car_waits():
    driven = DrivenCars()
    driven.board(5, has_program=True).apply(90, 1, 255)
    cars = alone()
    driven.steer(cars)
    cars.run(1000)
    assert cars.snapshot().x_m[0] == 0


def test_a_live_world_follows_the_clock_and_drops_a_long_lag():
    at_s = [0.0]
    live = LiveWorld(alone(tick_ms=20), lambda: at_s[0])
    live.board(0).apply(90, 1, 255)
    for _ in range(100):
        at_s[0] += 0.013
        live.advance()
    # 1.3 s less the part of a tick that is left.
    assert live.snapshot().x_m[0] == pytest.approx(0.3 * 1.28, abs=0.0062)
    at_s[0] += 60
    live.advance()
    assert live.snapshot().x_m[0] == pytest.approx(0.3 * 1.28 + 0.3 * 0.25, abs=0.0122)


def test_cars_of_a_live_world_begin_again_where_one_leaves_the_plane():
    at_s = [0.0]
    # As fast as a profile allows.
    fast = replace(CLASSROOM, speeds_mm_s=(0, 1, 2, 90_000), body=replace(CLASSROOM.body, diameter_mm=1900))
    world = leaders(STANDING, [Pose(1990, 0, 0)], fast, tick_ms=5)
    live = LiveWorld(world, lambda: at_s[0])
    live.board(0).apply(90, 1, 255)
    shown_m = []
    for _ in range(20):
        at_s[0] += 0.2
        live.advance()
        shown_m.append(live.snapshot().x_m[0])
    assert max(shown_m) > 2100
    assert 1990 <= shown_m[-1] < max(shown_m)
