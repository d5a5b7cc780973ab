"""The world of cars: its air, its bodies, its sensors and voices, and what it refuses."""

from dataclasses import replace

import numpy as np
import pytest

from motorcade import (
    Followers,
    Mat,
    Physics,
    Pose,
    Program,
    World,
    avoid,
    compile_program,
    formation,
    forward,
    led,
    left,
    open_table,
    pir,
    together,
    voice,
    wait,
    wander,
)
from motorcade.sim.errors import WorldError
from motorcade.sim.mat import Person, Starts, Voice
from motorcade.sim.world import KINDS, WHYS
from strategies import CLASSROOM

RIGHT_FAST, STILL, FORWARD = 2 * 4 + 3, 0, 2
ALONE = [Pose(0, 0)]
# Each car hears only its neighbours: infrared reaches 1 m.
CHAIN = [Pose(0.8 * place, 0) for place in range(5)]
LIT = [led(0, 1)]


def world(leader: list, followers: Followers | list | None, poses: list[Pose], seed: int = 0, **more: object) -> World:
    """Cars on a table, the first of them leading; ``more`` changes the table."""
    mat = replace(open_table(poses), **more)
    return World(mat, [compile_program(Program(leader, followers)).image], CLASSROOM, seeds=seed, events=True)


def events(cars: World, duration_ms: int, kind: str, car: int | None = None) -> np.ndarray:
    cars.run(duration_ms)
    told = cars.take_events()
    return told[(told["kind"] == KINDS.index(kind)) & ((told["car"] == car) | (car is None))]


def wheels(cars: World, ticks: int, car: int = 0) -> list[int]:
    shown = []
    for _ in range(ticks):
        cars.step()
        shown.append(int(cars.snapshot().wheels[car]))
    return shown


# The air


@pytest.mark.parametrize(("distance_m", "hears"), [(0.99, True), (1.0, True), (1.01, False)])
def test_infrared_reaches_as_far_as_the_profile_says(distance_m: float, hears: bool) -> None:
    assert bool(len(events(world([wait(1)], LIT, [Pose(0, 0), Pose(0, distance_m)]), 3000, "start"))) == hears


def test_leader_hears_nobody() -> None:
    cars = world([wait(1)], Followers(LIT, forward=True), formation(2))
    cars.run(10_000)
    told = cars.take_events()
    assert set(told["car"][told["kind"] == KINDS.index("heard")]) == {1, 2}
    assert set(told["car"][told["kind"] == KINDS.index("frame")]) == {0, 1, 2}


def test_hidden_senders_collide_in_a_chain_of_cars() -> None:
    """The leader and car 2 can't hear each other, so neither waits for the other, and car 1 hears neither."""
    lost = events(world([wait(1)], Followers(LIT, forward=True), CHAIN), 30_000, "lost", car=1)
    collisions = lost[lost["why"] == WHYS.index("collision")]
    assert set(collisions["other"]) == {0, 2}
    for t_ms in set(collisions["t_ms"]):
        assert len(collisions[collisions["t_ms"] == t_ms]) >= 1
    assert len(lost[lost["why"] == WHYS.index("sending")])


@pytest.mark.parametrize(("passes_on", "reached"), [(True, {1, 2, 3, 4}), (False, {1})])
def test_followers_that_pass_words_on_reach_beyond_the_leader(passes_on: bool, reached: set[int]) -> None:
    starts = events(world([wait(1)], Followers([led(2, 3)], forward=passes_on), CHAIN), 20_000, "start")
    assert set(starts["car"]) == reached
    assert len(set(starts["word"])) == 1


def test_deaf_followers_lose_what_is_sent_meanwhile() -> None:
    cars = world([wait(1)], Followers([led(0, 3)], accept_ir=False), formation(1))
    assert set(events(cars, 3000, "lost")["why"]) == {WHYS.index("deaf")}
    assert cars.counts()["deaf"][0] > 10


def test_two_leaders_erase_each_other_unless_one_is_captured() -> None:
    starts = Starts.of([Pose(0, 0), Pose(0.9, 0), Pose(0.3, 0)], [True, True, False])
    image = compile_program(Program([wait(1)], LIT)).image
    heard = {}
    for ratio in (None, 3.0, 5.0):
        physics = Physics(line_of_sight=False, capture_ratio=ratio)
        cars = World(Mat(name="two", starts=starts, physics=physics), [image], CLASSROOM)
        cars.run(5000)
        heard[ratio] = int(cars.counts()["heard"][0])
    # One is twice as far as the other: its power is a quarter.
    assert heard[None] == heard[5.0] == 0
    assert heard[3.0] > 50


@pytest.mark.parametrize(
    ("more", "hears"),
    [
        ({}, True),
        ({"walls": ((0.4, -0.5, 0.4, 0.5),)}, False),
        ({"walls": ((0.4, 0.1, 0.4, 0.5),)}, True),
        ({"discs": ((0.4, 0.05, 0.1),)}, False),
        ({"polygons": (((0.3, -0.2), (0.5, -0.2), (0.4, 0.2)),)}, False),
    ],
)
def test_walls_and_obstacles_shade_infrared(more: dict, hears: bool) -> None:
    cars = world([wait(1)], LIT, [Pose(0, 0), Pose(0.8, 0)], physics=Physics(), **more)
    assert bool(len(events(cars, 2000, "heard"))) == hears
    unshaded = world([wait(1)], LIT, [Pose(0, 0), Pose(0.8, 0)], physics=Physics(line_of_sight=False), **more)
    assert len(events(unshaded, 2000, "heard"))


def test_a_car_shades_those_behind_it() -> None:
    row = [Pose(0, 0), Pose(0.4, 0), Pose(0.8, 0.02)]
    assert set(events(world([wait(1)], LIT, row, physics=Physics()), 2000, "heard")["car"]) == {1}
    assert set(events(world([wait(1)], LIT, row), 2000, "heard")["car"]) == {1, 2}


@pytest.mark.parametrize(("half_deg", "hearers"), [(180, {1, 2, 3}), (60, {1, 2}), (30, {1})])
def test_a_beam_reaches_only_what_it_points_at(half_deg: float, hearers: set[int]) -> None:
    around = [Pose(0, 0), Pose(0.5, 0), Pose(0.35, 0.5), Pose(-0.5, 0)]
    cars = world([wait(1)], LIT, around, physics=Physics(line_of_sight=False, beam_half_angle_deg=half_deg))
    assert set(events(cars, 2000, "heard")["car"]) == hearers


def test_parity_finds_odd_flips_and_the_undetected_are_counted() -> None:
    rate = 0.02
    poses = [Pose(0, 0), *(Pose(0.5 * np.cos(turn), 0.5 * np.sin(turn)) for turn in np.arange(20) * 0.314)]
    cars = world(
        [wait(3)], [led(0, 3)], poses, physics=Physics(line_of_sight=False, bit_error_rate=rate, collisions=False)
    )
    cars.run(60_000)
    counts = {name: int(values[0]) for name, values in cars.counts().items()}
    judged = sum(counts[name] for name in ("heard", "lost_parity", "lost_reserved"))
    odd = (1 - (1 - 2 * rate) ** 32) / 2
    assert counts["lost_parity"] / judged == pytest.approx(odd, abs=0.02)
    # Of those with an even number of flips, many have one in a reserved bit and are found by that.
    even = 1 - odd - (1 - rate) ** 32
    assert 0 < counts["undetected"] < even * judged
    assert counts["undetected"] + counts["lost_reserved"] == pytest.approx(even * judged, rel=0.1)


# Bodies


def test_cars_that_meet_push_each_other_and_pass_where_there_are_no_bodies() -> None:
    facing = [Pose(0, 0), Pose(0.6, 0, np.pi)]
    mat = Mat(name="duel", starts=Starts.of(facing, [True, True]), tick_ms=20)
    image = compile_program(Program([forward(3, speed=3)], None)).image
    cars, ghosts = (World(replace(mat, physics=Physics(collisions=has)), [image], CLASSROOM) for has in (True, False))
    cars.run(3000)
    ghosts.run(3000)
    gap_m = np.diff(cars.snapshot().x_m)[0]
    # They give by a tick's way each, 6 mm.
    assert 0.15 - 0.012 <= gap_m <= 0.15
    assert cars.counts()["touching_ms"][0] > 2000
    assert ghosts.snapshot().x_m.tolist() == pytest.approx([0.9, -0.3], abs=1e-4)
    assert ghosts.counts()["touching_ms"][0] == 0


def test_a_crowd_stays_on_a_walled_mat_outside_of_its_obstacles() -> None:
    place = np.arange(100)
    starts = Starts(0.2 + 0.28 * (place % 10), 0.2 + 0.28 * (place // 10), place * 1.0, place % 50 == 0)
    mat = Mat(
        name="box",
        starts=starts,
        tick_ms=20,
        size_m=(3, 3),
        walled=True,
        discs=((3.0, 3.0, 0.3),),
        polygons=(((2.9, 0.1), (2.9, 0.3), (2.8, 0.2)),),
    )
    cars = World(
        mat, [compile_program(Program([wander(3, speed=3)], Followers([wander(3, speed=3)], forward=True))).image]
    )
    for _ in range(30):
        cars.run(1000)
        shown = cars.snapshot()
        for at_m in (shown.x_m, shown.y_m):
            assert at_m.min() > 0.075 - 0.02
            assert at_m.max() < 3 - 0.075 + 0.02
        assert np.hypot(shown.x_m - 3, shown.y_m - 3).min() > 0.375 - 0.02


def test_way_and_turn_are_what_the_profile_says() -> None:
    cars = world([forward(3, speed=1), left(1, speed=1)], None, ALONE)
    cars.run(4000)
    shown = cars.snapshot()
    assert shown.x_m[0] == pytest.approx(0.3, abs=2e-6)
    assert np.degrees(shown.heading[0]) == pytest.approx(30, abs=1e-4)


def test_wheel_noise_spreads_cars_that_else_drive_as_one() -> None:
    def aside_m(noise: float) -> np.ndarray:
        starts = Starts.of([Pose(0, float(y)) for y in range(20)], [True] * 20)
        mat = Mat(name="race", starts=starts, tick_ms=20, physics=Physics(wheel_noise=noise))
        cars = World(mat, [compile_program(Program([forward(3, speed=3)], None)).image])
        cars.run(9000)
        return cars.snapshot().y_m - np.arange(20)

    assert np.ptp(aside_m(0.0)) < 1e-6
    assert aside_m(0.05).std() > 2 * aside_m(0.01).std() > 0


# Sensors and voices


def test_avoiding_turns_right_until_the_way_is_free() -> None:
    # 250 mm lie between the two bodies, and level 2 keeps 300 mm away.
    cars = world([together(forward(3, speed=3), avoid(2, 3))], None, [Pose(0, 0), Pose(0.4, 0)])
    shown = wheels(cars, 3000)
    assert shown[0] == RIGHT_FAST
    assert 0 < shown.count(RIGHT_FAST) < 1000
    assert cars.snapshot().x_m[0] > 0.3


@pytest.mark.parametrize("more", [{"walls": ((0.5, -1, 0.5, 1),)}, {"discs": ((0.6, 0.0, 0.1),)}])
def test_walls_and_obstacles_are_avoided_too(more: dict) -> None:
    cars = world([together(forward(3, speed=3), avoid(2, 3))], None, ALONE, **more)
    shown = wheels(cars, 2500)
    assert shown[0] == 3
    assert RIGHT_FAST in shown
    assert cars.counts()["touching_ms"][0] == 0


def test_a_person_who_walks_by_stills_the_wheels_while_the_clock_runs_on() -> None:
    walker = Person(((0, 2, 9), (1, 2, 0), (2, 2, 0), (2.1, 2, 9)))
    cars = world([together(forward(3), pir()), left(1)], None, ALONE, people=(walker,))
    shown = wheels(cars, 4000)
    assert set(shown[1000:2000]) == {STILL}
    assert set(shown[2200:3000]) == {FORWARD}
    assert set(shown[3000:]) == {1 * 4 + 2}


@pytest.mark.parametrize("person", [(-1.0, 0.0), (0.5, 2.0), (3.2, 0.0)])
def test_a_person_behind_beside_or_far_away_is_not_sensed(person: tuple[float, float]) -> None:
    cars = world([together(forward(1), pir())], None, ALONE, people=(Person(((0, *person),)),))
    assert set(wheels(cars, 500)) == {FORWARD}


def test_stop_and_go_hold_and_release_the_wheels() -> None:
    cars = world([together(forward(3), voice())], None, ALONE)
    assert set(wheels(cars, 500)) == {FORWARD}
    cars.say("stop")
    assert set(wheels(cars, 500)) == {STILL}
    cars.say("go")
    assert set(wheels(cars, 500)) == {FORWARD}


def test_voices_are_heard_where_and_when_they_are_said() -> None:
    starts = Starts.of([Pose(0, 0), Pose(0, 3)], [True, True])
    said = (Voice(1.0, "stop", 0.0, 0.0, 1.0), Voice(2.0, "go"))
    mat = Mat(name="voices", starts=starts, voices=said)
    cars = World(mat, [compile_program(Program([together(forward(3), voice())], None)).image])
    cars.run(1500)
    assert cars.snapshot().wheels.tolist() == [STILL, FORWARD]
    cars.run(1000)
    assert cars.snapshot().wheels.tolist() == [FORWARD, FORWARD]


# What a world is, and what it refuses


def test_each_leader_runs_its_own_program() -> None:
    starts = Starts.of([Pose(0, 0), Pose(0, 3), Pose(0, 6)], [True] * 3)
    images = [compile_program(Program([step], None)).image for step in (forward(3), left(3))]
    cars = World(Mat(name="three", starts=starts), images)
    cars.run(100)
    assert cars.snapshot().wheels.tolist() == [FORWARD, 1 * 4 + 2, FORWARD]


def test_a_hundred_thousand_cars_take_at_most_128_bytes_each() -> None:
    place = np.arange(100_000)
    starts = Starts(place % 316 * 0.7, place // 316 * 0.7, place * 0.1, place % 100 == 0)
    cars = World(Mat(name="hall", starts=starts, tick_ms=20), [compile_program(Program([wait(1)], LIT)).image])
    assert cars.nbytes / cars.cars <= 128


@pytest.mark.parametrize(
    ("change", "images", "says"),
    [
        ({"starts": Starts.of([], [])}, 1, "no car"),
        ({}, 0, "give a program"),
        ({}, 256, "up to 255"),
        ({"tick_ms": 50}, 1, "smaller tick_ms"),
    ],
)
def test_what_cannot_be_a_world_is_refused_in_a_sentence(change: dict, images: int, says: str) -> None:
    mat = replace(open_table(ALONE), **change)
    with pytest.raises(WorldError, match=says):
        World(mat, [compile_program(Program([wait(1)], None)).image] * images)


def test_a_world_that_no_memory_holds_is_refused_before_it_is_made() -> None:
    with pytest.raises(WorldError, match="GB of memory"):
        World(open_table(ALONE), [compile_program(Program([wait(1)], None)).image], seeds=range(1 << 31))
