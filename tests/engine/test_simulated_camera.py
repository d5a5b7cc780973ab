"""The camera of a simulated car shows floor, walls, obstacles, cars with LEDs, and people at their places."""

import io
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from PIL import Image

from motorcade import Pose, World, forward, led, open_table, wait
from motorcade.engine import simulated_camera as view
from motorcade.engine.pictures import LEDS
from motorcade.engine.simulated_drive import LiveWorld, SimulatedCamera
from motorcade.mats import Person, check_mat, playground
from motorcade.mats.model import Line
from support.strategies import CLASSROOM
from support.tables import table, world


def seen(cars: World, car: int = 0) -> np.ndarray:
    return view.Scene(cars).draw(cars.snapshot(), car).astype(int)


def shown(poses: list[Pose], steps: list | None = None, **more: object) -> np.ndarray:
    """The picture of car 0 shortly after the start."""
    cars = table(steps or [wait(3)], None, poses, **more)
    cars.run(20)
    return seen(cars)


def columns(picture: np.ndarray, nothing: np.ndarray) -> np.ndarray:
    """The columns in which something stands."""
    return np.flatnonzero((np.abs(picture - nothing) > 25).any(axis=(0, 2)))


EMPTY = shown([Pose(0, 0)])


def test_the_sky_is_above_and_the_floor_below() -> None:
    assert EMPTY.shape == (view.HEIGHT, view.WIDTH, 3)
    assert EMPTY[0, :, 2].mean() > EMPTY[0, :, 0].mean() + 50
    assert EMPTY[-1].mean() > 150
    # The floor's lines move as the car does.
    assert (shown([Pose(0.06, 0)]) != EMPTY).any()


@pytest.mark.parametrize(("y_m", "side"), [(0.3, -1), (0.0, 0), (-0.3, 1)])
def test_a_car_appears_at_its_place_and_larger_when_it_is_nearer(y_m: float, side: int) -> None:
    far, near = (columns(shown([Pose(0, 0), Pose(x_m, y_m)]), EMPTY) for x_m in (1.5, 0.8))
    assert len(near) > 1.3 * len(far) > 0
    assert np.sign(round((near.mean() - view.WIDTH / 2) / 10)) == side
    # A pinhole camera at the body's front: half of the view is 35 degrees.
    expected = view.WIDTH / 2 * (1 - y_m / (0.8 - 0.075) / np.tan(np.radians(35)))
    assert near.mean() == pytest.approx(expected, abs=3)


def test_the_camera_shows_neither_its_car_nor_what_is_behind_or_far_away() -> None:
    for pose in (Pose(-0.5, 0), Pose(0.0, 0.5), Pose(60, 0)):
        assert len(columns(shown([Pose(0, 0), pose]), EMPTY)) == 0


@pytest.mark.parametrize(
    "marks",
    [
        {"lines": (Line(((0.3, -1.0), (0.3, 1.0)), width_m=0.1),)},
        {"spots": ((0.35, 0.0, 0.1),)},
        {"patches": (((0.3, -0.1), (0.4, -0.1), (0.4, 0.1), (0.3, 0.1)),)},
    ],
)
def test_what_is_dark_on_the_floor_ahead_is_seen_in_its_place(marks: dict[str, Any]) -> None:
    picture = shown([Pose(0, 0)], **marks)
    middle = picture[:, view.WIDTH // 2].mean(axis=1)
    dark = np.flatnonzero(middle < 80)
    assert len(dark) > 5
    assert middle[dark[-1] + 10] > 150
    assert (picture[: view.HEIGHT // 3] == EMPTY[: view.HEIGHT // 3]).all()


def test_leds_have_their_colours() -> None:
    """The leader in front of the camera lights one LED after the other."""
    for which, colour in enumerate(LEDS):
        cars = table([led(which, 3)], None, [Pose(0.5, 0), Pose(0, 0)])
        cars.run(20)
        wanted = np.array([int(colour[place : place + 2], 16) for place in (1, 3, 5)])
        assert np.abs(seen(cars, 1) - wanted).sum(axis=2).min() < 12
    cars = table([forward(3)], None, [Pose(0.5, 0), Pose(0, 0)])
    cars.run(20)
    assert np.abs(seen(cars, 1) - wanted).sum(axis=2).min() > 60


def test_lamps_are_white_in_front_and_red_at_the_back() -> None:
    def reds(heading: float) -> int:
        picture = shown([Pose(0, 0), Pose(0.5, 0, heading)])
        return int(((picture[..., 0] > 200) & (picture[..., 1:] < 60).all(axis=2)).sum())

    assert reds(0.0) > 20
    assert reds(np.pi) == 0


def test_walls_hide_what_is_behind_them_and_nothing_in_front() -> None:
    wall = (1.0, -3.0, 1.0, 3.0)
    poses = [Pose(0, 0), Pose(1.5, 0)]
    alone = shown(poses[:1], walls=(wall,))
    assert len(columns(alone, EMPTY)) == view.WIDTH
    assert (shown(poses, walls=(wall,)) == alone).all()
    assert len(columns(shown([Pose(0, 0), Pose(0.5, 0)], walls=(wall,)), alone)) > 20


@pytest.mark.parametrize(
    "more",
    [
        {"discs": ((1.0, 0.0, 0.2),)},
        {"polygons": (((0.8, -0.2), (1.2, -0.2), (1.2, 0.2), (0.8, 0.2)),)},
        {"people": (Person(((0.0, 1.0, 0.0),)),)},
    ],
)
def test_obstacles_and_people_appear_in_front_of_the_horizon(more: dict) -> None:
    picture = shown([Pose(0, 0)], **more)
    there = columns(picture, EMPTY)
    assert len(there) > 20
    assert there.mean() == pytest.approx(view.WIDTH / 2, abs=2)
    if "people" in more:
        # People are taller than walls.
        assert (np.abs(picture[0] - EMPTY[0]) > 25).any()


def test_the_floor_ends_at_the_mats_edge() -> None:
    mat = replace(open_table([Pose(0.5, 1.0)]), size_m=(1.0, 2.0))
    picture = seen(world(mat, [wait(3)]))
    # The edge is 42 cm ahead of the camera; beyond it the floor has another colour.
    bottom, far = picture[-1].mean(axis=0), picture[int(view.HEIGHT * 0.5)].mean(axis=0)
    assert np.abs(bottom - far).max() > 20


def test_only_a_mat_whose_edge_is_a_wall_shows_walls_there() -> None:
    still = open_table([Pose(0.5, 1.0)])
    an_open, walled = (seen(world(replace(still, size_m=(1.0, 2.0), walled=each), [wait(3)])) for each in (False, True))
    # Above the horizon there is nothing but the sky and what stands.
    sky = slice(0, int(view.HEIGHT * 0.4))
    assert (an_open[sky] == EMPTY[sky]).all()
    assert len(columns(walled[sky], EMPTY[sky])) == view.WIDTH


def test_a_picture_is_drawn_at_a_wall_in_an_obstacle_and_on_another_car() -> None:
    for more in ({"walls": ((0.0751, -1, 0.0751, 1),)}, {"discs": ((0.1, 0.0, 0.3),)}, {"walls": ((-1, 0, 1, 0),)}):
        assert shown([Pose(0, 0)], **more).shape == EMPTY.shape
    assert shown([Pose(0, 0), Pose(0, 0)]).shape == EMPTY.shape


def test_the_camera_of_a_live_world_makes_jpeg_files() -> None:
    mat = playground()
    check_mat(mat, CLASSROOM)
    live = LiveWorld(World(mat, [bytes(4)]), lambda: 0.0)
    picture = Image.open(io.BytesIO(SimulatedCamera(partial(live.jpeg, 0)).jpeg()))
    assert (picture.format, picture.size) == ("JPEG", (view.WIDTH, view.HEIGHT))


def test_a_live_car_says_whether_it_has_a_program() -> None:
    driving = bytes.fromhex("01000000 65800000")
    without, programmed = (LiveWorld(World(playground(), [image]), lambda: 0.0) for image in (bytes(4), driving))
    assert [without.board(car).has_program for car in (0, 1)] == [False, True]
    assert programmed.board(0).has_program
