"""Why a car hears nothing: the cause that is named is one, for without it the car hears."""

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motorcade import Followers, Pose, Program, World, compile_program, led, open_table, wait
from motorcade.config.profile import built_in_profile
from motorcade.locales import languages
from motorcade.mats import Physics, Starts
from motorcade.service.studio_world import StudioWorld

SECONDS = 9
PLACES = st.tuples(st.integers(0, 60), st.integers(0, 60), st.integers(-3, 3)).map(
    lambda place: Pose(place[0] / 20, place[1] / 20, float(place[2]))
)


def scene(poses, range_mm, forwards, told, leads=True, flips=0.0, run_ms=SECONDS * 1000):
    """Cars that stand still, after some seconds; the first one leads."""
    followers = Followers([led(1, 1), led(2, 2)] if told else [], forward=forwards)
    image = compile_program(Program([wait(1)], followers)).image
    starts = Starts.of(poses, [leads, *[False] * (len(poses) - 1)])
    mat = replace(open_table(poses, tick_ms=10), starts=starts, physics=Physics(bit_error_rate=flips))
    world = World(mat, [image], events=True, threads=1)
    world.furnish(world.mat, range_mm)
    studio = StudioWorld(world)
    studio.run(run_ms)
    return studio


def cause(studio, car):
    """The answer of a studio, which can be told in every language."""
    found = studio.details(car).why
    assert set(found.sentence) == set(languages())
    assert all(found.sentence.values())
    return found


@settings(max_examples=15)
@given(
    st.lists(PLACES, min_size=2, max_size=4),
    st.integers(3, 15),
    st.booleans(),
    st.booleans(),
    st.sampled_from([0.0, 0.1, 0.5]),
)
def test_without_the_cause_the_car_hears(poses, decimetres, forwards, told, flips):
    radius_m = built_in_profile("classroom").body.diameter_mm / 1000
    if any(math.dist((a.x, a.y), (b.x, b.y)) <= radius_m for a in poses for b in poses if a is not b):
        return
    given = {"poses": poses, "range_mm": decimetres * 100, "forwards": forwards, "told": told, "flips": flips}

    def outcome_is_other(studio, car):
        """The car hears, or its messages reach it now and are damaged on the way."""
        return studio.details(car).heard or (flips and any(studio.details(car).lost.values()))

    before = scene(**given)
    for car in range(1, len(poses)):
        found = cause(before, car)
        heard = before.details(car).heard
        assert bool(heard) == (found.code == "why-heard")
        match found.cure:
            case "followers":
                given["told"] = True
                # They hear now, or it is another cause that keeps them from it.
                assert cause(scene(**given), car).cure != "followers"
            case "range_mm":
                assert outcome_is_other(scene(**{**given, "range_mm": found.value}), car)
            case "forward":
                assert outcome_is_other(scene(**{**given, "forwards": True}), car)
            case "move":
                sender = found.car
                at = poses[sender]
                beside = Pose(at.x + 0.2 * math.cos(at.heading), at.y + 0.2 * math.sin(at.heading))
                alone = [at, beside] if sender == 0 else [poses[0], at, beside]
                assert outcome_is_other(scene(**{**given, "poses": alone}), len(alone) - 1)
            case "loss":
                assert scene(**{**given, "flips": 0.0}).details(car).heard


@pytest.mark.parametrize(
    ("poses", "range_mm", "forwards", "told", "car", "key"),
    [
        ([Pose(0, 0), Pose(0.5, 0)], 1000, False, True, 1, "why-heard"),
        ([Pose(0, 0), Pose(0.5, 0)], 1000, False, True, 0, "why-leads"),
        ([Pose(0, 0), Pose(0.5, 0)], 1000, False, False, 1, "why-no-words"),
        ([Pose(0, 0), Pose(1.5, 0)], 1000, False, True, 1, "why-too-far"),
        ([Pose(0, 0), Pose(0.8, 0), Pose(1.6, 0)], 1000, False, True, 2, "why-not-passed-on"),
        ([Pose(0, 0), Pose(0.8, 0), Pose(1.6, 0)], 1000, True, True, 2, "why-heard"),
    ],
)
def test_each_cause_is_told(poses, range_mm, forwards, told, car, key):
    assert cause(scene(poses, range_mm, forwards, told), car).code == key


@settings(max_examples=15)
@given(st.integers(3, 20), st.sampled_from([0.05, 0.2, 0.5]), st.integers(0, 1000))
def test_a_message_that_was_damaged_is_heard_where_no_bits_flip(tenths, flips, seed):
    poses = [Pose(0, 0), Pose(tenths / 20, 0)]
    noisy = scene(poses, 1000, False, True, flips=flips, run_ms=0)
    noisy.reset(seed)
    while noisy.now_ms < 1500 and not any(noisy.details(1).lost.values()):
        noisy.run(20)
    found = cause(noisy, 1)
    if found.code == "why-lost":
        assert found.cure == "loss"
        assert scene(poses, 1000, False, True, run_ms=noisy.now_ms).details(1).heard
    else:
        assert found.code == "why-heard"


def test_the_first_message_in_bad_air_is_lost_and_the_cure_is_named():
    poses = [Pose(0, 0), Pose(0.5, 0)]
    noisy = scene(poses, 1000, False, True, flips=0.5, run_ms=0)
    while not any(noisy.details(1).lost.values()):
        noisy.run(20)
    found = cause(noisy, 1)
    assert (found.code, found.cure) == ("why-lost", "loss")


def test_without_a_leader_nobody_sends():
    assert cause(scene([Pose(0, 0), Pose(0.5, 0)], 1000, False, True, leads=False), 1).cure == "leader"
