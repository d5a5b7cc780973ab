"""The small world: its air, its sensors, its clock and its dice."""

from collections import Counter
from itertools import pairwise

import pytest

from motorcade import (
    Followers,
    Pose,
    Program,
    World,
    avoid,
    compile_program,
    forward,
    led,
    left,
    pir,
    repeat,
    together,
    voice,
    wait,
    wander,
)
from motorcade.sim.channel import Channel
from motorcade.sim.world import Event, formation
from strategies import CLASSROOM
from timelines import STILL, watch

ALONE = [Pose(0, 0)]
# Each car hears only its neighbours: infrared reaches 1 m.
CHAIN = [Pose(0.8 * place, 0) for place in range(5)]
RIGHT = 2


def world(leader: list, followers: Followers | list | None, poses: list[Pose], **more: object) -> World:
    return World(compile_program(Program(leader, followers)).image, CLASSROOM, poses, **more)


def run(cars: World, duration_ms: int) -> list[Event]:
    for _ in cars.run(duration_ms):
        pass
    return cars.events


def wheels(cars: World, ticks: int) -> list[tuple[int, int]]:
    """What the leader's wheels do in each tick, a millisecond unless the world's clock is coarser."""
    return [moment[0] for moment in watch(cars, 0, ticks)]


def wandering(seed: int, tick_ms: int = 1) -> World:
    return world([wander(3)], Followers([wander(3), led(1, 1)], forward=True), formation(3), seed=seed, tick_ms=tick_ms)


def test_same_seed_gives_the_same_run() -> None:
    first, second, other = wandering(7), wandering(7), wandering(8)
    assert run(first, 10_000) == run(second, 10_000)
    assert first.poses == second.poses
    assert run(other, 10_000) != first.events
    assert other.poses[0] != first.poses[0]
    other.reset(7)
    assert run(other, 10_000) == first.events


@pytest.mark.parametrize(("distance_m", "hears"), [(0.99, True), (1.0, True), (1.01, False)])
def test_infrared_reaches_as_far_as_the_profile_says(distance_m: float, hears: bool) -> None:
    events = run(world([wait(1)], [led(0, 1)], [Pose(0, 0), Pose(0, distance_m)]), 3000)
    assert any(event.kind == "heard" for event in events) == hears
    assert any(event.kind == "start" for event in events) == hears


def test_leader_hears_nobody() -> None:
    events = run(world([wait(1)], Followers([led(0, 1)], forward=True), formation(2)), 10_000)
    assert {event.car for event in events if event.kind in ("heard", "lost", "start")} == {1, 2}
    assert {event.car for event in events if event.kind == "frame"} == {0, 1, 2}


def test_frames_that_overlap_at_a_receiver_are_both_lost_there_and_only_there() -> None:
    air = Channel(4, unit_us=560)
    air.begin(0, 0, 0, [1, 2])
    air.begin(3, 0, 49_000, [2])
    lost = {frame.sender: frame.lost for frame in air.ended(200_000)}
    assert lost == {0: {2: "collision"}, 3: {2: "collision"}}


def test_a_frame_that_begins_when_another_has_ended_arrives() -> None:
    air = Channel(3, unit_us=560)
    air.begin(0, 0, 0, [2])
    assert air.senses_carrier(2)
    assert not air.ended(49_839)
    assert [frame.lost for frame in air.ended(49_840)] == [{}]
    assert not air.senses_carrier(2)
    air.begin(1, 0, 49_840, [2])
    assert [frame.lost for frame in air.ended(100_000)] == [{}]


@pytest.mark.parametrize("first", [0, 1])
def test_a_car_cannot_hear_while_it_sends(first: int) -> None:
    air = Channel(2, unit_us=560)
    air.begin(first, 0, 0, [1 - first])
    air.begin(1 - first, 0, 20_000, [first])
    assert [frame.lost for frame in air.ended(100_000)] == [{1 - first: "sending"}, {first: "sending"}]


def test_hidden_senders_collide_in_a_chain_of_cars() -> None:
    """The leader and car 2 can't hear each other, so neither waits for the other, and car 1 hears neither."""
    events = run(world([wait(1)], Followers([led(0, 1)], forward=True), CHAIN), 30_000)
    lost = [event for event in events if event.kind == "lost" and event.car == 1]
    collisions = [event for event in lost if event.detail["why"] == "collision"]
    assert {event.detail["sender"] for event in collisions} == {0, 2}
    for event in collisions:
        others = [each for each in lost if each.detail["sender"] != event.detail["sender"]]
        assert any(abs(each.t_ms - event.t_ms) <= 86 for each in others)
    heard_ms = {event.t_ms for event in events if event.kind == "heard" and event.car == 1}
    assert heard_ms.isdisjoint(event.t_ms for event in collisions)
    sent_ms = [event.t_ms for event in events if event.kind == "frame" and event.car == 1]
    missed_ms = [event.t_ms for event in lost if event.detail["why"] == "sending"]
    assert missed_ms
    # Both lasted 86 ms at the most, so that the car began its own at most twice that before.
    assert all(any(0 < end_ms - begin_ms <= 172 for begin_ms in sent_ms) for end_ms in missed_ms)


@pytest.mark.parametrize(("passes_on", "reached"), [(True, {1, 2, 3, 4}), (False, {1})])
def test_followers_that_pass_words_on_reach_beyond_the_leader(passes_on: bool, reached: set[int]) -> None:
    program = Program([wait(1)], Followers([led(2, 3)], forward=passes_on))
    cars = World(compile_program(program).image, CLASSROOM, CHAIN)
    starts = [event for event in run(cars, 20_000) if event.kind == "start"]
    assert {event.car for event in starts} == reached
    assert {event.word for event in starts} == {compile_program(program).words[-1]}


def test_followers_send_only_the_words_that_they_are_to_pass_on() -> None:
    program = Program([wait(1)], [led(0, 3, forward=True), led(1, 3)])
    passed_on = compile_program(program).words[2]
    events = run(World(compile_program(program).image, CLASSROOM, formation(2)), 20_000)
    assert {event.word for event in events if event.kind == "frame" and event.car > 0} == {passed_on}


def test_deaf_followers_lose_what_is_sent_meanwhile() -> None:
    events = run(world([wait(1)], Followers([led(0, 3)], accept_ir=False), formation(1)), 3000)
    start = next(event for event in events if event.kind == "start")
    later = [event for event in events if event.car == 1 and event.t_ms > start.t_ms]
    assert {event.kind for event in later} == {"lost"}
    assert {event.detail["why"] for event in later} == {"deaf"}


@pytest.mark.parametrize(
    ("other", "distance_mm"),
    [
        (Pose(0.4, 0.0), 250),
        (Pose(2.1, 0.0), 1950),
        (Pose(2.2, 0.0), None),  # farther than ultrasound reaches
        (Pose(-0.4, 0.0), None),
        (Pose(0.475, 0.4), None),  # 45 degrees to the side
        (Pose(0.1, 0.0), 0),
    ],
)
def test_ultrasound_measures_to_the_nearest_body_ahead(other: Pose, distance_mm: int | None) -> None:
    measured_mm = world([wait(1)], None, [Pose(0, 0), other]).obstacle_mm(0)
    assert measured_mm > 100_000 if distance_mm is None else abs(measured_mm - distance_mm) <= 1


def test_avoiding_turns_right_until_the_way_is_free() -> None:
    # 250 mm lie between the two bodies, and level 2 keeps 300 mm away.
    cars = world([together(forward(3, speed=3), avoid(2, 3))], None, [Pose(0, 0), Pose(0.4, 0)])
    turned_ms = 0
    for _ in range(3000):
        is_near = cars.obstacle_mm(0) < 300
        cars.step()
        assert (cars.boards[0].direction, cars.boards[0].speed_level) == ((RIGHT if is_near else 0), 3)
        turned_ms += is_near
    assert 0 < turned_ms < 1000
    assert cars.poses[0].heading < 0
    assert cars.poses[0].x > 0.3


@pytest.mark.parametrize(
    "step",
    [
        avoid(3, 3),
        together(wait(3), avoid(3, 3)),
        together(forward(3, speed=0), avoid(3, 3)),
        together(led(0, 3), avoid(3, 3)),
    ],
)
def test_avoiding_moves_no_car_that_stands(step: object) -> None:
    assert set(wheels(world([step], None, [Pose(0, 0), Pose(0.3, 0)]), 3000)) == {STILL}


@pytest.mark.parametrize(
    "step", [together(forward(1), avoid(1, 1)), together(forward(1), avoid(3, 0)), together(forward(1), led(0, 1))]
)
def test_a_car_drives_on_where_nothing_is_near_enough_or_it_need_not_look(step: object) -> None:
    assert set(wheels(world([step], None, [Pose(0, 0), Pose(0.4, 0)]), 100)) == {(0, 2)}


def test_a_person_stills_the_wheels_while_the_clock_runs_on() -> None:
    cars = world([together(forward(3), pir()), left(1)], None, ALONE, people=[(2.0, 0.5)])
    assert set(wheels(cars, 1500)) == {STILL}
    cars.people.clear()
    assert set(wheels(cars, 1500)) == {(0, 2)}
    cars.people.append((2.0, 0.5))
    assert set(wheels(cars, 1000)) == {(1, 2)}
    assert [event.t_ms for event in cars.events if event.kind == "state"] == [0, 3000]


@pytest.mark.parametrize("person", [(-1.0, 0.0), (0.5, 2.0), (3.2, 0.0)])
def test_a_person_behind_beside_or_far_away_is_not_sensed(person: tuple[float, float]) -> None:
    assert set(wheels(world([together(forward(1), pir())], None, ALONE, people=[person]), 500)) == {(0, 2)}


def test_stop_and_go_hold_and_release_the_wheels_while_the_clock_runs_on() -> None:
    cars = world([together(forward(6), voice()), left(1), together(forward(3), voice())], None, ALONE)
    assert set(wheels(cars, 500)) == {(0, 2)}
    cars.say("stop")
    assert set(wheels(cars, 3500)) == {STILL}
    cars.say("go")
    assert set(wheels(cars, 1000)) == {(0, 2)}
    cars.say("stop")
    assert set(wheels(cars, 1000)) == {STILL}
    assert set(wheels(cars, 1000)) == {(1, 2)}
    assert set(wheels(cars, 1000)) == {(0, 2)}


def test_stop_is_heard_only_by_those_who_listen() -> None:
    cars = world([forward(3)], None, ALONE)
    cars.say("stop")
    assert set(wheels(cars, 1000)) == {(0, 2)}


def test_random_driving_goes_straight_half_of_the_time_and_turns_each_way_a_quarter() -> None:
    cars = world([wander(3)], None, ALONE, seed=3, tick_ms=500)
    drawn = Counter(direction for direction, _ in wheels(cars, 4000))
    assert 1850 <= drawn[0] <= 2150
    assert 850 <= drawn[1] <= 1150
    assert 850 <= drawn[2] <= 1150


@pytest.mark.parametrize("tick_ms", [20, 333, 1750, 4321])
def test_random_driving_is_the_same_whatever_the_tick(tick_ms: int) -> None:
    prompt, late = (world([wander(3), wander(1), wait(1)], None, ALONE, tick_ms=each) for each in (1, tick_ms))
    shown = wheels(prompt, 60_000)[::tick_ms]
    assert {(0, 2), (1, 2), (2, 2)} <= set(shown)
    assert wheels(late, len(shown)) == shown


def test_random_driving_changes_its_mind_every_half_second() -> None:
    shown = wheels(world([wander(3)], None, ALONE), 30_000)
    changes = [at_ms for at_ms, (before, after) in enumerate(pairwise(shown), start=1) if before != after]
    assert len(changes) > 20
    assert all(at_ms % 500 == 0 for at_ms in changes)


@pytest.mark.parametrize("tick_ms", [7, 20, 333, 4321])
def test_a_late_tick_loses_no_time_for_the_leader(tick_ms: int) -> None:
    program = Program(
        [forward(3), repeat(2, left(1), together(forward(2), led(1, 1))), wander(2), wait(0)],
        [led(0, 1), led(1, 1)],
    )
    compiled = compile_program(program)
    prompt, late = (World(compiled.image, CLASSROOM, ALONE, tick_ms=each) for each in (1, tick_ms))
    shown, shown_late = watch(prompt, 0, 20_000), watch(late, 0, 20_000 // tick_ms)
    assert shown_late == shown[::tick_ms][: len(shown_late)]
    told, told_late = (
        [event for event in cars.events if event.kind == "state" and event.t_ms <= 12_000] for cars in (prompt, late)
    )
    assert told_late == told
    for event in late.events:
        if event.kind == "frame":
            assert event.word == compiled.words[-2:][event.t_ms // 1000 % 2]
