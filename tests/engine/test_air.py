"""Infrared between simulated cars: who receives which frame, and why other frames are lost."""

from dataclasses import replace

import numpy as np
import pytest

from motorcade import Followers, Physics, Pose, World, formation, led, open_table, wait
from motorcade.engine.events import KINDS, LOSS_REASONS
from motorcade.mats import Mat, Starts
from motorcade.words.infrared import air_us, to_frame
from support.strategies import CLASSROOM
from support.tables import counted, events_of, hearers, table, world
from support.worlds import crowd, digest, ran

# Each car hears only its neighbours: infrared reaches 1 m.
CHAIN = [Pose(0.8 * place, 0) for place in range(5)]
LIT = [led(0, 1)]
FRAME, HEARD = KINDS.index("frame"), KINDS.index("heard")
SENDING, COLLISION = LOSS_REASONS.index("sending"), LOSS_REASONS.index("collision")
PAIR = [Pose(0, 0), Pose(0.8, 0)]


@pytest.mark.parametrize(("distance_m", "hears"), [(0.99, True), (1.0, True), (1.01, False)])
def test_infrared_reaches_as_far_as_the_profile_says(distance_m: float, hears: bool) -> None:
    cars = table([wait(1)], LIT, [Pose(0, 0), Pose(0, distance_m)])
    assert bool(hearers(cars, 3000)) == hears
    assert bool(counted(cars)["heard"]) == hears
    assert bool(cars.snapshot().word[1]) == hears


def test_a_leader_receives_nothing() -> None:
    cars = table([wait(1)], Followers(LIT, forward=True), formation(2))
    cars.run(10_000)
    events = cars.take_events()
    cars_of = {kind: set(events["car"][events["kind"] == k].tolist()) for k, kind in enumerate(KINDS)}
    assert cars_of["frame"] == {0, 1, 2}
    assert cars_of["heard"] == cars_of["lost"] == cars_of["start"] == {1, 2}


def test_a_frame_is_received_unless_another_overlaps_it_or_the_receiver_sends() -> None:
    """In a chain the leader and car 2 can't hear each other, so neither waits for the other."""
    cars = table([wait(1)], Followers(LIT, forward=True), CHAIN)
    cars.run(30_000)
    events = cars.take_events()
    frames = [
        (car, t_ms, t_ms - -air_us(to_frame(word), CLASSROOM.infrared.unit_us) // 1000)
        for t_ms, car, kind, word in events[["t_ms", "car", "kind", "word"]].tolist()
        if kind == FRAME and car <= 2
    ]
    free = [
        (end_ms, sender)
        for sender, begin_ms, end_ms in frames
        if sender != 1
        and end_ms < 30_000
        and not any(begin_ms < end and begin < end_ms and car != sender for car, begin, end in frames)
    ]
    at_1 = events[(events["car"] == 1) & (events["kind"] == HEARD)]
    assert sorted(at_1[["t_ms", "other"]].tolist()) == sorted(free)
    lost = {(why, sender) for why, sender in events[events["car"] == 1][["why", "other"]].tolist() if why}
    assert lost >= {(SENDING, 0), (COLLISION, 0), (COLLISION, 2)}


@pytest.mark.parametrize(("passes_on", "reached"), [(True, {1, 2, 3, 4}), (False, {1})])
def test_followers_that_pass_words_on_reach_beyond_the_leader(passes_on: bool, reached: set[int]) -> None:
    starts = events_of(table([wait(1)], Followers([led(2, 3)], forward=passes_on), CHAIN), 20_000, "start")
    assert set(starts["car"]) == reached
    assert len(set(starts["word"])) == 1


def test_deaf_followers_lose_frames() -> None:
    cars = table([wait(1)], Followers([led(0, 3)], accept_ir=False), formation(1))
    assert len(events_of(cars, 3000, "lost", why="deaf")) == counted(cars)["deaf"] > 10
    assert not counted(cars)["lost_collision"]


def test_the_stronger_of_two_frames_survives_at_the_capture_ratio() -> None:
    """One sender is twice as far away as the other, so its power is a quarter."""
    starts = Starts.of([Pose(0, 0), Pose(0.9, 0), Pose(0.3, 0)], [True, True, False])
    senders = {}
    for ratio in (None, 3.0, 5.0):
        mat = Mat("two", starts, physics=Physics(line_of_sight=False, capture_ratio=ratio))
        senders[ratio] = events_of(world(mat, [wait(1)], LIT), 5000, "heard")["other"].tolist()
    assert senders[None] == senders[5.0] == []
    assert set(senders[3.0]) == {0}
    assert len(senders[3.0]) > 50


def test_neither_frame_survives_when_both_senders_are_at_one_point() -> None:
    starts = Starts.of([Pose(0, 0)] * 3, [True, True, False])
    physics = Physics(collisions=False, line_of_sight=False, capture_ratio=4.0)
    both = world(Mat("one", starts, physics=physics), [wait(1)], LIT)
    assert events_of(both, 5000, "heard")["other"].tolist() == []
    alone = world(Mat("one", Starts.of([Pose(0, 0)] * 2, [True, False]), physics=physics), [wait(1)], LIT)
    assert len(events_of(alone, 5000, "heard")) > 50


@pytest.mark.parametrize(
    ("more", "hears"),
    [
        ({}, True),
        ({"walls": ((0.4, -0.5, 0.4, 0.5),)}, False),
        ({"walls": ((0.4, 0.1, 0.4, 0.5),)}, True),
        ({"discs": ((0.4, 0.05, 0.1),)}, False),
        ({"discs": ((0.4, 0.15, 0.1),)}, True),
        ({"polygons": (((0.3, -0.2), (0.5, -0.2), (0.4, 0.2)),)}, False),
    ],
)
def test_walls_and_obstacles_shade_infrared(more: dict, hears: bool) -> None:
    assert bool(hearers(table([wait(1)], LIT, PAIR, physics=Physics(), **more), 2000)) == hears
    assert hearers(table([wait(1)], LIT, PAIR, physics=Physics(line_of_sight=False), **more), 2000)


def test_a_car_shades_the_cars_behind_it_but_not_on_an_open_table() -> None:
    row = [Pose(0, 0), Pose(0.4, 0), Pose(0.8, 0.02)]
    assert hearers(table([wait(1)], LIT, row, physics=Physics()), 2000) == {1}
    assert hearers(world(open_table(row), [wait(1)], LIT), 2000) == {1, 2}


@pytest.mark.parametrize(("half_deg", "heard_by"), [(180, {1, 2, 3}), (60, {1, 2}), (30, {1})])
def test_a_beam_reaches_only_cars_inside_it(half_deg: float, heard_by: set[int]) -> None:
    around = [Pose(0, 0, np.pi / 2), Pose(0, 0.5), Pose(-0.5, 0.35), Pose(0, -0.5)]
    physics = Physics(line_of_sight=False, beam_half_angle_deg=half_deg)
    assert hearers(table([wait(1)], LIT, around, physics=physics), 2000) == heard_by


def test_bit_errors_lose_as_many_frames_as_probability_predicts() -> None:
    """Parity finds odd numbers of flips, tag and check some of the even numbers; the others go undetected."""
    rate, reserved = 0.02, 10
    turns = np.arange(40) * 0.157
    around = [Pose(0, 0), *(Pose(0.9 * np.cos(turn), 0.9 * np.sin(turn)) for turn in turns)]
    physics = Physics(collisions=False, line_of_sight=False, bit_error_rate=rate)
    # The word is over at once, so that no wrong word makes a car deaf for long.
    profile = replace(CLASSROOM, durations_ms=(0, 1, 2, 3), idle_state_ms=1)
    mat = replace(open_table(around, tick_ms=20), physics=physics)
    cars = World(mat, [bytes.fromhex("00010100 80000000")], profile, seeds=4)
    cars.run(120_000)
    counts = counted(cars)
    # A flipped bit of c8 leaves a frame that isn't bare: without a tag, or with a check that doesn't fit.
    counts["lost_c8"] = counts["lost_reserved"] + counts["lost_check"] + counts["lost_remote"]
    received = counts["heard"] + counts["lost_parity"] + counts["lost_c8"]
    assert received > 50_000

    def even(bits: int) -> float:
        return (1 + (1 - 2 * rate) ** bits) / 2

    passed = even(32 - reserved) * (1 - rate) ** reserved
    for name, chance in (
        ("lost_parity", 1 - even(32)),
        ("lost_c8", even(32) - passed),
        ("undetected", passed - (1 - rate) ** 32),
    ):
        deviation = np.sqrt(received * chance * (1 - chance))
        assert abs(counts[name] - received * chance) < 5 * deviation, name


def test_every_frame_at_every_follower_in_range_is_counted_once() -> None:
    cars = table([wait(1)], [led(0, 1), led(1, 1)], formation(4), physics=Physics(bit_error_rate=0.01))
    cars.run(20_000)
    counts = counted(cars)
    fates = ["heard", "deaf", *(name for name in counts if name.startswith("lost_"))]
    within_sight = hearers(table([wait(1)], LIT, formation(4), physics=Physics()), 1000)
    ended = counts["frames"] - int(cars.snapshot().sends[0])
    assert sum(counts[name] for name in fates) == ended * len(within_sight) > 100


def test_more_cars_around_a_sender_than_it_lists_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    expected = digest(ran(crowd(60), 2000))
    monkeypatch.setattr("motorcade.engine.layout._MOST_AROUND", 3)
    assert digest(ran(crowd(60), 2000)) == expected
