"""How simulated bodies drive, touch, and sense what is around them."""

from dataclasses import replace

import numpy as np
import pytest

from motorcade import Followers, Physics, Pose, avoid, forward, left, pir, right, together, voice, wait, wander
from motorcade.mats import Mat, Person, Starts, Voice
from support.strategies import CLASSROOM
from support.tables import FORWARD, FORWARD_FAST, LEFT, RIGHT_FAST, STILL, counted, leaders, table, wheels, world

ALONE = [Pose(0, 0)]
RADIUS_M = CLASSROOM.body.diameter_mm / 2000
# The way of the fastest car in a tick of 20 ms.
TICK_M = 0.006


def gaps_m(x_m: np.ndarray, y_m: np.ndarray) -> np.ndarray:
    """The distances of all pairs."""
    first, second = np.triu_indices(len(x_m), 1)
    return np.hypot(x_m[first] - x_m[second], y_m[first] - y_m[second])


# Driving


def test_cars_drive_and_turn_as_fast_as_the_profile_says() -> None:
    cars = table([forward(3, speed=1), left(1, speed=1), forward(2, speed=3), right(3, speed=3)], None, ALONE)
    cars.run(9000)
    shown = cars.snapshot()
    ahead = np.radians(30)
    assert shown.x_m[0] == pytest.approx(0.3 + 0.6 * np.cos(ahead), abs=3e-6)
    assert shown.y_m[0] == pytest.approx(0.6 * np.sin(ahead), abs=3e-6)
    assert np.degrees(shown.heading[0]) == pytest.approx(30 - 270 + 360, abs=1e-4)


def test_wheel_noise_spreads_cars_that_would_drive_alike() -> None:
    """The cars weave about their course: the mean of their ways stays the same, and no two are equal."""
    side_by_side = [Pose(0, float(y)) for y in range(100)]

    def ends(noise: float) -> tuple[np.ndarray, np.ndarray]:
        cars = leaders([forward(3, speed=3)], side_by_side, tick_ms=20, physics=Physics(wheel_noise=noise))
        cars.run(9000)
        return cars.snapshot().x_m, cars.snapshot().y_m - np.arange(100)

    x_m, aside_m = ends(0.0)
    assert x_m.tolist() == pytest.approx([2.7] * 100, abs=2e-6)
    assert not aside_m.any()
    little, much = ends(0.01), ends(0.05)
    assert len(set(little[1].tolist())) == 100
    assert much[1].std() == pytest.approx(5 * little[1].std(), rel=0.3)
    assert abs(little[1].mean()) < 4 * little[1].std() / 10
    assert little[0].mean() == pytest.approx(2.7, rel=0.01)


# Bodies


def test_cars_push_each_other_with_collisions_and_pass_through_without() -> None:
    facing = [Pose(0, 0), Pose(0.6, 0, np.pi)]
    cars, ghosts = (
        leaders([forward(3, speed=3)], facing, tick_ms=20, physics=Physics(collisions=has)) for has in (True, False)
    )
    cars.run(3000)
    ghosts.run(3000)
    # Each can enter the other by the way of a tick, 6 mm.
    assert 2 * RADIUS_M - 0.012 <= np.diff(cars.snapshot().x_m)[0] <= 2 * RADIUS_M
    assert counted(cars)["touching_ms"] > 2000
    assert ghosts.snapshot().x_m.tolist() == pytest.approx([0.9, -0.3], abs=1e-4)
    assert not counted(ghosts)["touching_ms"]


def test_bodies_at_rest_do_not_overlap() -> None:
    """All cars drive to the middle and then stand still."""
    turns = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    ring = [Pose(0.7 * np.cos(turn), 0.7 * np.sin(turn), turn + np.pi) for turn in turns]
    cars = leaders([forward(3), wait(3)], ring, tick_ms=5)
    cars.run(3000)
    assert gaps_m(cars.snapshot().x_m, cars.snapshot().y_m).min() < 2 * RADIUS_M
    cars.run(3000)
    # The remaining overlap is too small to move a car by 1 µm.
    assert gaps_m(cars.snapshot().x_m, cars.snapshot().y_m).min() > 2 * RADIUS_M - 1e-5


def test_two_cars_at_one_point_separate() -> None:
    cars = leaders([wait(3)], [Pose(1, 1), Pose(1, 1)])
    cars.run(3000)
    assert gaps_m(cars.snapshot().x_m, cars.snapshot().y_m)[0] == pytest.approx(2 * RADIUS_M, abs=1e-5)


def test_a_crowd_stays_inside_walls_and_outside_obstacles() -> None:
    place = np.arange(81)
    starts = Starts(0.3 + 0.3 * (place % 9), 0.3 + 0.3 * (place // 9), place * 1.0, place % 40 == 0)
    mat = Mat(
        "box",
        starts,
        tick_ms=20,
        size_m=(3, 3),
        walled=True,
        discs=((3.0, 3.0, 0.3), (1.05, 1.05, 0.02)),
        polygons=(((1.9, 1.6), (2.0, 1.6), (2.0, 1.7), (1.9, 1.7)),),
    )
    wild = [wander(3, speed=3)]
    cars = world(mat, wild, Followers(wild, forward=True))
    for _ in range(40):
        cars.run(1000)
        shown = cars.snapshot()
        x_m, y_m = shown.x_m, shown.y_m
        to_edge = np.minimum(np.minimum(x_m, 3 - x_m), np.minimum(y_m, 3 - y_m))
        to_discs = [np.hypot(x_m - x, y_m - y) - radius for x, y, radius in mat.discs]
        to_box = np.hypot(x_m - np.clip(x_m, 1.9, 2.0), y_m - np.clip(y_m, 1.6, 1.7))
        # Walls give by a tick's way, and bodies by two for each car of those that press.
        assert min(each.min() for each in (to_edge, to_box, *to_discs)) > RADIUS_M - 1.01 * TICK_M
        assert gaps_m(x_m, y_m).min() > 2 * RADIUS_M - 10 * TICK_M
    assert counted(cars)["touching_ms"] > 10_000


def test_no_queue_pushes_its_first_car_through_a_wall() -> None:
    queue = [Pose(-0.2 - 0.151 * place, 0) for place in range(30)]
    cars = leaders([forward(3, speed=3)], queue, tick_ms=20, walls=((0, -1, 0, 1),))
    cars.run(30_000)
    assert cars.snapshot().x_m.max() < -RADIUS_M + 1.01 * TICK_M


def test_no_crowd_pushes_its_cars_out_of_a_corner() -> None:
    """All drive to where two walls meet."""
    rows = [(-2.6 - 0.17 * (place // 12), 0.17 * (place % 12) - 1) for place in range(150)]
    cars = leaders(
        [forward(3, speed=3)],
        [Pose(x, y, np.arctan2(-y, -x)) for x, y in rows],
        tick_ms=20,
        walls=((0, 0, -5, -2), (0, 0, -5, 2)),
    )
    cars.run(30_000)
    shown = cars.snapshot()
    assert (np.abs(shown.y_m) < -0.4 * shown.x_m).all()


# Ultrasonic


@pytest.mark.parametrize(
    ("more", "nearest_mm"),
    [
        ({"poses": [Pose(0, 0), Pose(0.4, 0)]}, 250),
        ({"poses": [Pose(0, 0), Pose(0.17, 0)]}, 20),
        ({"poses": [Pose(0, 0), Pose(-0.4, 0)]}, None),
        ({"poses": [Pose(0, 0), Pose(0.475, 0.4)]}, None),  # 45 degrees to the side
        ({"walls": ((0.4, -1, 0.4, 1),)}, 325),
        ({"walls": ((0.4, -1, 0.4, -0.2),)}, None),
        ({"discs": ((0.5, 0.0, 0.1),)}, 325),
        ({"polygons": (((0.3, 0), (0.6, -0.5), (0.6, 0.5)),)}, 225),
        ({"poses": [Pose(0.1, 2.5)], "size_m": (0.45, 5), "walled": True}, 275),
    ],
)
def test_ultrasound_measures_to_the_nearest_surface_ahead(more: dict, nearest_mm: int | None) -> None:
    """A car turns away from what is nearer than its radius, and from nothing that is not."""
    poses = more.pop("poses", ALONE)
    for radius_mm in (nearest_mm, (nearest_mm or 998) + 2):
        profile = replace(CLASSROOM, avoid_radii_mm=(1, 1, 1, radius_mm or 1000))
        cars = leaders([together(forward(3, speed=3), avoid(3, 3))], poses, profile, **more)
        cars.step()
        turns = nearest_mm is not None and radius_mm > nearest_mm
        assert cars.snapshot().wheels[0] == (RIGHT_FAST if turns else FORWARD_FAST)


def test_avoiding_turns_right_until_the_way_is_free() -> None:
    # 250 mm lie between the two bodies, and level 2 keeps 300 mm away.
    cars = table([together(forward(3, speed=3), avoid(2, 3))], None, [Pose(0, 0), Pose(0.4, 0)])
    shown = wheels(cars, 3000)
    turned_ms = shown.count(RIGHT_FAST)
    assert 0 < turned_ms < 1000
    assert shown == [RIGHT_FAST] * turned_ms + [FORWARD_FAST] * (3000 - turned_ms)
    assert cars.snapshot().heading[0] == pytest.approx(-np.pi / 2 * turned_ms / 1000)
    assert cars.snapshot().x_m[0] > 0.3


@pytest.mark.parametrize("more", [{"walls": ((0.5, -1, 0.5, 1),)}, {"discs": ((0.6, 0.0, 0.1),)}])
def test_walls_and_obstacles_are_avoided_before_they_are_touched(more: dict) -> None:
    cars = table([together(forward(3, speed=3), avoid(2, 3))], None, ALONE, **more)
    shown = wheels(cars, 2500)
    # 425 mm lie between the body and the wall, and level 2 keeps 300 mm away.
    came_ms = shown.index(RIGHT_FAST)
    assert came_ms == pytest.approx((425 - 300) / 0.3, abs=2)
    assert FORWARD_FAST in shown[came_ms:]
    assert not counted(cars)["touching_ms"]


# People


def test_a_person_walking_by_stops_the_wheels_but_not_the_word() -> None:
    """From 9 m away straight to 2 m before the car within a second, away again after a third one."""
    walker = Person(((0, 2, 9), (1, 2, 0), (2, 2, 0), (2.1, 2, 9)))
    cars = table([together(forward(3), pir()), left(1)], None, ALONE, people=(walker,))
    shown = wheels(cars, 4000)
    # They come into the sector, 55 degrees to each side and 3 m deep, some way before that.
    came_ms, left_ms = shown.index(STILL), 2000 + shown[2000:].index(FORWARD)
    assert came_ms == pytest.approx(1000 * (9 - np.sqrt(9 - 1.7**2)) / 9, abs=30)
    assert 2000 < left_ms < 2100
    assert shown == [FORWARD] * came_ms + [STILL] * (left_ms - came_ms) + [FORWARD] * (3000 - left_ms) + [LEFT] * 1000


@pytest.mark.parametrize(("repeats", "at_4_s"), [(True, STILL), (False, FORWARD)])
def test_a_repeating_path_starts_again(repeats: bool, at_4_s: int) -> None:
    """Before the car for the first of three seconds."""
    path = ((0, 2, 0), (1, 2, 0), (1.001, 90, 0), (3, 90, 0))
    cars = table([together(forward(3), pir())], None, ALONE, people=(Person(path, repeats),))
    cars.run(500)
    assert cars.snapshot().wheels[0] == STILL
    cars.run(1500)
    assert cars.snapshot().wheels[0] == FORWARD
    cars.run(1500)
    assert cars.snapshot().wheels[0] == at_4_s


@pytest.mark.parametrize("person", [(-1.0, 0.0), (0.5, 2.0), (3.2, 0.0)])
def test_a_person_behind_beside_or_far_away_is_not_sensed(person: tuple[float, float]) -> None:
    cars = table([together(forward(1), pir())], None, ALONE, people=(Person(((0, *person),)),))
    assert set(wheels(cars, 500)) == {FORWARD}


# Voices


def test_stop_and_go_hold_and_release_the_wheels_but_not_the_word() -> None:
    cars = table([together(forward(6), voice()), left(1), together(forward(3), voice())], None, ALONE)
    assert set(wheels(cars, 500)) == {FORWARD}
    cars.say("stop")
    assert set(wheels(cars, 3500)) == {STILL}
    cars.say("go")
    assert set(wheels(cars, 1000)) == {FORWARD}
    cars.say("stop")
    assert set(wheels(cars, 1000)) == {STILL}
    assert set(wheels(cars, 1000)) == {LEFT}
    assert set(wheels(cars, 1000)) == {FORWARD}


def test_voices_are_heard_where_and_when_they_are_said() -> None:
    said = (Voice(2.0, "go"), Voice(1.0, "stop", 0.0, 0.2, 1.0))
    cars = leaders([together(forward(3), voice())], [Pose(0, 0), Pose(0, 3)], voices=said)
    shown = []
    for _ in range(3000):
        cars.step()
        shown.append(tuple(cars.snapshot().wheels.tolist()))
    assert shown == [(FORWARD, FORWARD)] * 1000 + [(STILL, FORWARD)] * 1000 + [(FORWARD, FORWARD)] * 1000


def test_a_voice_reaches_exactly_as_far_as_its_radius() -> None:
    said = (Voice(0.0, "stop", 0.0, 0.0, 1.0),)
    cars = leaders([together(forward(3), voice())], [Pose(1.0, 0), Pose(1.000001, 0)], voices=said)
    cars.run(10)
    assert cars.snapshot().wheels.tolist() == [STILL, FORWARD]
