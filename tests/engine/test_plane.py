"""Places are 32 bits of µm: a run in which a car comes to their end says so, and no place wraps."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from motorcade import Pose, Program, World, compile_program, forward, wait
from motorcade.engine.backend import NAMES, BackendName
from motorcade.errors import MotorcadeError
from motorcade.mats import Mat, Physics, Starts
from support.strategies import CLASSROOM
from support.worlds import CrowdedWorld

TICK_MS = 20
# Cars as fast as they can be at all.
FAST = replace(
    CLASSROOM, speeds_mm_s=(0, 1, 2, 23_000), body=replace(CLASSROOM.body, diameter_mm=1900, wheel_base_mm=1000)
)
AWAY = compile_program(Program([forward(3, speed=3)])).image
STANDS = compile_program(Program([wait(1)])).image
FARTHEST_M = 2147


def plane(*poses: Pose, **physics: Any) -> Mat:
    return Mat("a plane", Starts.of(poses, [True] * len(poses)), TICK_MS, physics=Physics(**physics))


@pytest.mark.parametrize("kernels", NAMES)
@pytest.mark.parametrize(("x", "y"), [(1, 0), (-1, 0), (0, 1), (0, -1)])
def test_a_run_ends_where_the_plane_ends(x: int, y: int, kernels: BackendName) -> None:
    world = World(plane(Pose(0, 0), Pose(9, 9)), [STANDS, AWAY], FAST, seeds=range(3), kernels=kernels, events=True)
    world.move(1, Pose(1990 * x, 1990 * y, math.atan2(y, x)), world=2)
    # The other two are nowhere near.
    with pytest.raises(MotorcadeError, match="car 1 of world 2 came farther than 2,147 m from 0") as caught:
        world.run(100_000)
    assert caught.value.details["time"] == world.now_ms / 1000
    there = world.snapshot(2)
    assert FARTHEST_M < max(abs(there.x_m[1]), abs(there.y_m[1])) < FARTHEST_M + 0.5
    # It stays there until somebody moves it back; the others are at the same time.
    events = [len(world.take_events())]
    with pytest.raises(MotorcadeError, match="car 1 of world 2"):
        world.run(TICK_MS)
    assert (world.now_ms, len(world.take_events())) == (round(caught.value.details["time"] * 1000), 0)
    assert events[0] > 0
    world.move(1, Pose(0, 5), world=2)
    world.run(1000)
    assert world.now_ms == round(caught.value.details["time"] * 1000) + 1000


def test_a_car_that_stands_or_drives_along_the_edge_goes_on() -> None:
    along = World(plane(Pose(2000, -1900, math.pi / 2)), [AWAY], FAST)
    along.run(100_000)
    assert along.snapshot().y_m[0] > 300
    assert along.now_ms == 100_000


@pytest.mark.parametrize("physics", [{"wheel_noise": 0.5}, {"collisions": False}])
def test_no_place_wraps_with_any_physics_and_many_cars(physics: dict[str, Any]) -> None:
    """Cars in a heap push each other, and drive in all directions."""
    heap = [Pose(1999, 1999, 0.21 * number) for number in range(30)]
    # With noise a wheel may be more than twice as fast.
    slower = replace(FAST, speeds_mm_s=(0, 1, 2, 8_000))
    world = CrowdedWorld(plane(*heap, **physics), [AWAY], slower, events=True)
    place, is_over = world.snapshot(), False
    while not is_over:
        before = place
        try:
            world.run(TICK_MS)
        except MotorcadeError as problem:
            is_over = problem.code == "car-left-plane"
        place = world.snapshot()
        assert np.hypot(place.x_m - before.x_m, place.y_m - before.y_m).max() < 0.7


@pytest.mark.parametrize("pose", [Pose(2001, 0), Pose(0, -2200), Pose(math.nan, 0), Pose(0, 0, 1e300)])
def test_a_car_that_begins_outside_is_refused(pose: Pose) -> None:
    with pytest.raises(MotorcadeError) as caught:
        World(plane(Pose(0, 0), pose), [STANDS])
    assert caught.value.code == "start-out-of-range"


def test_cars_that_would_drive_farther_in_a_tick_than_a_number_holds_are_refused() -> None:
    faster = replace(FAST, speeds_mm_s=(0, 1, 2, 900_000), body=replace(FAST.body, diameter_mm=1_000_000))
    with pytest.raises(MotorcadeError, match="18000 mm in a tick; allowed: up to 480 mm"):
        World(plane(Pose(0, 0)), [AWAY], faster)
