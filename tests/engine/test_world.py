"""Making and changing worlds, and what they refuse."""

import math
from dataclasses import replace

import numpy as np
import pytest

from motorcade import (
    Mat,
    Physics,
    Pose,
    Program,
    World,
    compile_program,
    formation,
    forward,
    led,
    left,
    open_table,
    wait,
)
from motorcade.engine.backend import NAMES, BackendName
from motorcade.errors import MotorcadeError
from motorcade.mats import Starts
from support.strategies import CLASSROOM
from support.tables import FORWARD, LEFT, counted, hearers, leaders, table
from support.worlds import ROAMING, CrowdedWorld, crowd, digest


def test_each_leader_runs_its_own_program() -> None:
    starts = Starts.of([Pose(0, 0), Pose(0, 3), Pose(0, 6)], [True] * 3)
    images = [compile_program(Program([step], None)).image for step in (forward(3), left(3))]
    cars = World(Mat(name="three", starts=starts), images)
    cars.run(100)
    assert cars.snapshot().wheels.tolist() == [FORWARD, LEFT, FORWARD]


def test_a_hundred_thousand_cars_take_at_most_144_bytes_each() -> None:
    place = np.arange(100_000)
    starts = Starts(place % 316 * 0.7, place // 316 * 0.7, place * 0.1, place % 100 == 0)
    cars = World(Mat(name="large", starts=starts, tick_ms=20), [compile_program(Program([wait(1)], [led(0, 1)])).image])
    assert cars.nbytes / cars.cars <= 144


@pytest.mark.parametrize(
    ("change", "images", "says"),
    [
        ({"starts": Starts.of([], [])}, 1, "no car"),
        ({}, 0, "give a program"),
        ({}, 256, "up to 255"),
        ({"tick_ms": 50}, 1, "tick_ms is 50; allowed: a whole number from 1 to 40"),
    ],
)
def test_an_impossible_world_is_refused(change: dict, images: int, says: str) -> None:
    mat = replace(open_table([Pose(0, 0)]), **change)
    with pytest.raises(MotorcadeError, match=says):
        World(mat, [compile_program(Program([wait(1)], None)).image] * images)


@pytest.mark.parametrize(
    ("part", "change", "tick_ms", "says"),
    [
        ("body", {"ultrasonic_cone_deg": 90}, 1, "ultrasonic_cone_deg is 90"),
        ("body", {"diameter_mm": 40}, 40, "in a tick, which is more than a quarter of its body's 40 mm"),
        ("infrared", {"unit_us": 400}, 40, "tick_ms is 40 and the shortest frame takes 35.6 ms"),
    ],
)
def test_a_car_that_can_not_be_simulated_is_refused(part: str, change: dict, tick_ms: int, says: str) -> None:
    profile = replace(CLASSROOM, **{part: replace(getattr(CLASSROOM, part), **change)})
    with pytest.raises(MotorcadeError, match=says):
        leaders([wait(1)], [Pose(0, 0)], profile, tick_ms=tick_ms)


def test_a_world_that_exceeds_the_memory_is_refused() -> None:
    with pytest.raises(MotorcadeError, match="GB of memory"):
        World(open_table([Pose(0, 0)]), [compile_program(Program([wait(1)], None)).image], seeds=range(1 << 31))


TWO = Starts.of([Pose(0.5, 0.5), Pose(1.5, 0.5)], [True, False])
ROOM = Mat("room", TWO, 20, (2.0, 1.0), True, walls=((1.0, 0.0, 1.0, 1.0),), discs=((0.5, 0.8, 0.1),))
BESIDE = Starts.of([Pose(0.5, 0.5), Pose(0.6, 0.5)], [True, False])


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"starts": BESIDE}, "car 1 starts at .* 0.1 m from car 0"),
        ({"starts": Starts.of([Pose(0.5, 0.5), Pose(1.05, 0.5)], [True, False])}, r"car 1 starts at .* on wall\[0\]"),
        ({"starts": Starts.of([Pose(0.5, 0.65), Pose(1.5, 0.5)], [True, False])}, r"car 0 starts at .* on disc\[0\]"),
        (
            {"starts": Starts.of([Pose(0.5, 0.5), Pose(1.95, 0.5)], [True, False])},
            "car 1 starts at .* over the mat's edge",
        ),
        ({"polygons": (((1.4, 0.4), (1.6, 0.4), (1.6, 0.6)),)}, r"car 1 starts at .* on polygon\[0\]"),
        ({"starts": Starts.of([Pose(math.nan, 0.5), Pose(1.5, 0.5)], [True, False])}, "the x of car 0 is nan"),
    ],
)
def test_cars_that_stand_in_something_are_refused(change: dict, says: str) -> None:
    for kernels in NAMES:
        with pytest.raises(MotorcadeError, match=says):
            World(replace(ROOM, **change), [ROAMING], kernels=kernels)
    world = World(ROOM, [ROAMING])
    if "starts" in change:
        with pytest.raises(MotorcadeError, match=says):
            world.place_cars([change["starts"]])


def test_cars_without_bodies_may_stand_in_each_other() -> None:
    World(replace(ROOM, starts=BESIDE, physics=Physics(collisions=False)), [ROAMING])


@pytest.mark.parametrize("kernels", NAMES)
def test_each_world_may_have_places_of_its_own_for_a_run(kernels: BackendName) -> None:
    others = Starts.of([Pose(0.3, 0.3, 1), Pose(1.3, 0.3, 2)], [True, False])
    world = World(ROOM, [ROAMING], seeds=[1, 2], kernels=kernels)
    moved = World(replace(ROOM, starts=others), [ROAMING], seeds=2, kernels=kernels)
    alone = World(ROOM, [ROAMING], seeds=1, kernels=kernels)
    world.place_cars([TWO, others])
    for each in (world, moved, alone):
        each.run(200)
    assert [digest(world, 0), digest(world, 1)] == [digest(alone), digest(moved)]
    world.reset()
    assert world.snapshot(1).x_m.tolist() == [0.5, 1.5]
    world.step()
    with pytest.raises(MotorcadeError, match="before the first step"):
        world.place_cars([TWO, TWO])


@pytest.mark.parametrize(
    ("duration_ms", "says"),
    [(30, "30 ms is less than a tick"), (-100, "duration_ms is -100"), (math.nan, "is nan"), (1.5, "is 1.5")],
)
def test_a_time_in_which_nothing_can_happen_is_refused(duration_ms: float, says: str) -> None:
    cars = leaders([forward(3)], [Pose(0, 0)], tick_ms=40)
    with pytest.raises(MotorcadeError, match=says):
        cars.run(duration_ms)
    assert cars.now_ms == 0


def test_numbers_of_numpy_give_the_same_run() -> None:
    image = compile_program(Program([forward(np.float32(2), speed=np.int64(3))])).image
    plain = World(replace(open_table(formation(3)), tick_ms=20), [image], seeds=[3, 4])
    given = World(replace(open_table(formation(np.int64(3))), tick_ms=np.int64(20)), [image], seeds=np.array([3, 4]))
    plain.run(500)
    given.run(np.float64(500))
    assert (digest(given, 1), given.now_ms, type(given.now_ms)) == (digest(plain, 1), 500, int)
    given.reset(np.array([3.0, 4.0]))
    assert given.seeds == (3, 4)


@pytest.mark.parametrize("seeds", [-1, 1 << 32, 0.5, math.nan, None, "1", [1, -1], [[1, 2]], [], True])
def test_seeds_that_are_none_are_refused(seeds: object) -> None:
    with pytest.raises(MotorcadeError, match="seed"):
        World(open_table([Pose(0, 0)]), [ROAMING], seeds=seeds)  # type: ignore[arg-type]


def test_one_image_in_place_of_a_list_is_told_so() -> None:
    with pytest.raises(MotorcadeError, match=r"write \[image\]"):
        World(open_table([Pose(0, 0)]), ROAMING)  # type: ignore[arg-type]
    with pytest.raises(MotorcadeError, match=r"such as compile_program\(program\).image"):
        World(open_table([Pose(0, 0)]), [compile_program(Program([wait(1)]))])  # type: ignore[list-item]


def test_a_moved_car_receives_and_touches_at_its_new_place_at_once() -> None:
    cars = table([wait(1)], [led(1, 1)], [Pose(0, 0), Pose(3, 0), Pose(3, 1)])
    assert hearers(cars, 500) == set()
    cars.move(1, Pose(0.5, 0))
    assert hearers(cars, 200) == {1}
    cars.move(2, Pose(0.55, 0))
    cars.step()
    assert counted(cars)["touching_ms"] == 2 * cars.tick_ms


def test_a_driving_car_stops_at_a_new_obstacle() -> None:
    cars = leaders([forward(3, speed=3)], [Pose(0, 0)])
    cars.run(500)
    # So near that the car would pass into it before it looked around again by itself.
    cars.set_environment(replace(cars.mat, discs=((0.34, 0, 0.1),)))
    for _ in range(40):
        cars.run(50)
        assert cars.snapshot().x_m[0] < 0.34 - 0.1 - 0.07


def test_setting_the_environment_changes_the_range_of_infrared() -> None:
    cars = table([wait(1)], [led(1, 1)], [Pose(0, 0), Pose(1.5, 0)])
    assert hearers(cars, 500) == set()
    cars.set_environment(cars.mat, range_mm=1600)
    assert hearers(cars, 500) == {1}
    cars.set_environment(cars.mat)
    assert cars.profile.infrared.range_mm == 1600


@pytest.mark.parametrize("count", [20, 60])
def test_setting_the_environment_before_the_first_tick_equals_building_the_world_so(count: int) -> None:
    given = crowd(count)
    bare = Mat("bare", given.starts, given.tick_ms)
    built, changed = (CrowdedWorld(mat, [ROAMING], seeds=5) for mat in (given, bare))
    changed.set_environment(given)
    for cars in (built, changed):
        cars.run(1600)
    assert digest(changed) == digest(built)


@pytest.mark.parametrize("wheel_noise", [0.0, 0.1])
def test_setting_the_environment_anew_moves_no_car_that_others_push(wheel_noise: float) -> None:
    # So close that they touch at once.
    starts = Starts.of([Pose(0.1 * (i % 4), 0.1 * (i // 4), i) for i in range(12)], [True] * 12)
    mat = Mat("tight", starts, 20, size_m=(0.6, 0.6), walled=True, physics=Physics(wheel_noise=wheel_noise))
    image = compile_program(Program([forward(3, speed=3)], None)).image
    left_alone, set_anew = (CrowdedWorld(mat, [image], seeds=3) for _ in range(2))
    for _ in range(6):
        set_anew.set_environment(mat)
        for cars in (left_alone, set_anew):
            cars.run(200)
        assert set_anew.snapshot().x_m.tolist() == left_alone.snapshot().x_m.tolist()


def test_a_moved_car_is_found_among_many() -> None:
    far = [Pose(5 + place % 8 * 0.3, place // 8 * 0.3) for place in range(40)]
    cars = table([wait(1)], [led(1, 1)], [Pose(0, 0), *far])
    assert hearers(cars, 500) == set()
    cars.move(30, Pose(0.5, 0))
    assert hearers(cars, 100) == {30}


@pytest.mark.parametrize(
    ("car", "pose", "says"),
    [
        (2, Pose(0, 0), "car is 2; allowed: a whole number from 0 to 1"),
        (-1, Pose(0, 0), "car is -1"),
        (0, Pose(math.nan, 0), "x is nan"),
        (0, Pose(0, 3000), "y is 3000; allowed: a number from -2000 to 2000"),
    ],
)
def test_unknown_cars_and_places_are_refused(car: int, pose: Pose, says: str) -> None:
    cars = table([wait(1)], None, [Pose(0, 0), Pose(1, 0)])
    with pytest.raises(MotorcadeError, match=says):
        cars.move(car, pose)


def test_an_impossible_mat_changes_nothing() -> None:
    small = replace(CLASSROOM, body=replace(CLASSROOM.body, diameter_mm=80))
    cars = leaders([wait(1)], [Pose(0, 0)], small, tick_ms=40)
    before = cars.mat, cars.profile
    with pytest.raises(MotorcadeError, match="smaller tick_ms"):
        cars.set_environment(replace(cars.mat, physics=Physics(wheel_noise=0.5)), range_mm=500)
    assert (cars.mat, cars.profile) == before


def test_the_layout_of_arguments_is_the_same_in_worlds_of_any_size_and_with_any_drivers() -> None:
    """engine.wasm refuses others. Numba would compile for half a minute for each layout of an array that it meets."""
    image = compile_program(Program([forward(3)])).image
    for followers in (14, 15, 16):
        world = World(open_table(formation(followers)), [image], kernels="webassembly")
        for car in range(3):
            world.drive(car, 40, 1, 100)
        world.run(20)
        world.give_back(1)
        world.run(20)
        assert world.now_ms == 40
