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


def scene(poses, range_mm, forwards, told, leads=True):
    """Cars that stand still, after some seconds; the first one leads."""
    followers = Followers([led(1, 1), led(2, 2)] if told else [], forward=forwards)
    image = compile_program(Program([wait(1)], followers)).image
    starts = Starts.of(poses, [leads, *[False] * (len(poses) - 1)])
    mat = replace(open_table(poses, tick_ms=10), starts=starts, physics=Physics())
    world = World(mat, [image], events=True, threads=1)
    world.furnish(world.mat, range_mm)
    studio = StudioWorld(world)
    studio.run(SECONDS * 1000)
    return studio


def cause(studio, car):
    """The answer of a studio, which can be told in every language."""
    found = studio.details(car).why
    assert set(found.sentence) == set(languages())
    assert all(found.sentence.values())
    return found


@settings(max_examples=15)
@given(st.lists(PLACES, min_size=2, max_size=4), st.integers(3, 15), st.booleans(), st.booleans())
def test_without_the_cause_the_car_hears(poses, decimetres, forwards, told):
    radius_m = built_in_profile("classroom").body.diameter_mm / 1000
    if any(math.dist((a.x, a.y), (b.x, b.y)) <= radius_m for a in poses for b in poses if a is not b):
        return
    given = {"poses": poses, "range_mm": decimetres * 100, "forwards": forwards, "told": told}
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
                assert scene(**{**given, "range_mm": found.value}).details(car).heard
            case "forward":
                assert scene(**{**given, "forwards": True}).details(car).heard
            case "move":
                sender = found.car
                at = poses[sender]
                beside = Pose(at.x + 0.2 * math.cos(at.heading), at.y + 0.2 * math.sin(at.heading))
                alone = [at, beside] if sender == 0 else [poses[0], at, beside]
                assert scene(**{**given, "poses": alone}).details(len(alone) - 1).heard


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


def test_without_a_leader_nobody_sends():
    assert cause(scene([Pose(0, 0), Pose(0.5, 0)], 1000, False, True, leads=False), 1).cure == "leader"
