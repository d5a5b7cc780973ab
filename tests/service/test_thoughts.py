"""What cars think: the bubble above a car and the answer of its card say the same, for each kind of thought."""

from typing import Any, get_args

import pytest

from motorcade import Followers, Program, compile_program, follow_line, forward, led, wait
from motorcade.config.profile import built_in_profile
from motorcade.service.thoughts import MOST_CARS, MOST_THOUGHTS, THOUGHTS
from motorcade.service.world_messages import (
    CarDetails,
    CarThought,
    Seek,
    SetEnvironment,
    SetWorld,
    StepWorld,
    Thought,
    Thoughts,
    Watch,
    WorldHello,
)
from support.session_page import SessionPage, server_world, site_world
from support.studio_programs import table_of

WAITS, LIGHTS = (wait(1),), (led(1, 1), led(2, 2))
WALL = {"from_m": [0.5, -1], "to_m": [0.5, 1]}
LINE = {"points_m": [[0, 0], [4, 0]]}
TICK_MS = 10


def page_of(poses, *, leads=1, leader=WAITS, followers=LIGHTS, forward=False, listen=True, **world):
    """A page with cars at their places (x and y in metres, heading in degrees); the first ones lead.

    ``world`` has fields of `SetWorld`, and lists of the mat.
    """
    make_world = world.pop("make_world", server_world)
    profile = world.pop("profile", "classroom")
    range_mm = world.pop("range_mm", None)
    image = None
    if leader:
        told = Followers(list(followers), forward=forward, accept_ir=listen)
        image = compile_program(Program(list(leader), told), built_in_profile(profile)).image
    return SessionPage(make_world, SetWorld(table_of(poses, leads, **world), image, profile, range_mm=range_mm))


def seen(page, car, until_ms=12_000):
    """Step a page's world; return all thoughts of a car. At each moment they say what its answer says."""
    page.send(Watch(car))
    told: list[CarThought] = []
    found = set()
    for _ in range(until_ms // 100):
        page.answers.clear()
        page.send(StepWorld(100 // TICK_MS))
        for answer in page.answers:
            if isinstance(answer, Thoughts):
                told = answer.thoughts
        why = page.last(CarDetails).why
        mine = [thought.thought for thought in told if thought.car == car]
        assert mine in ([], [THOUGHTS.get(why.code)])
        found.update(mine)
    return found


STANDS = [(0, 0, 0), (0.5, 0, 0)]
CASES: dict[Thought, tuple[Any, int, dict[str, Any]]] = {
    "blockedByCar": ([(1, 1, 0), (1.4, 1, 180)], 0, {"leads": 2, "leader": [forward(3, 3)], "followers": ()}),
    "blocked": ([(0, 0, 0)], 0, {"leader": [forward(3, 3)], "followers": (), "wall": [WALL]}),
    "noLine": ([(0, 0.5, 0)], 0, {"leader": [follow_line(3, 3)], "followers": (), "line": [LINE]}),
    "hidden": ([(0, 0, 0), (1, 0, 0)], 1, {"wall": [WALL], "range_mm": 2000}),
    "outsideBeam": ([(1, 1, 180), (1.5, 1, 0)], 1, {"physics": {"beam_half_angle_deg": 40}}),
    "notPassedOn": ([(0, 0, 0), (0.8, 0, 0), (1.6, 0, 0)], 2, {"range_mm": 1000}),
    "tooFar": ([(0, 0, 0), (2.5, 0, 0)], 1, {"range_mm": 1000}),
    "deaf": (
        [(0, 0, 0), (0.6, -0.1, 0), (1.1, 0.8, 0), (1.1, 0.2, 0), (1.4, -0.6, 0), (1.3, -0.3, 0)],
        2,
        {"forward": True, "listen": False, "followers": (led(2, 3), led(2, 3)), "range_mm": 1000},
    ),
    "collisions": ([(0, 0, 0), (1, 0, 0), (0.5, 0, 0)], 2, {"leads": 2}),
    "damaged": (STANDS, 1, {"physics": {"bit_error_rate": 0.5}}),
    "noProgram": (STANDS, 0, {"leader": ()}),
    "nothing": (STANDS, 1, {"followers": ()}),
}


@pytest.mark.parametrize("make_world", [server_world, site_world])
@pytest.mark.parametrize("thought", CASES)
def test_bubble_and_card_say_the_same(thought, make_world):
    poses, car, world = CASES[thought]
    assert thought in seen(page_of(poses, make_world=make_world, **world), car)


def test_each_thought_is_that_of_an_answer():
    assert set(THOUGHTS.values()) == set(get_args(Thought))


@pytest.mark.parametrize("profile", ["classroom", "e-puck"])
def test_a_car_sees_the_line_that_is_between_its_sensors(profile):
    """Each profile has its sensors elsewhere: a car on a thin line follows it, one beside the line says so."""
    sensors = built_in_profile(profile).floor
    thin = {**LINE, "width_m": 0.008}
    world = {"profile": profile, "leader": [follow_line(3, 3)], "followers": (), "line": [thin], "tick_ms": TICK_MS}
    assert seen(page_of([(0.2, 0, 0)], **world), 0, 3000) == set()
    beside_m = (sensors.apart_mm / 2 + 15) / 1000
    assert seen(page_of([(0.2, beside_m, 0)], **world), 0, 3000) == {"noLine"}


def test_a_car_that_is_left_behind_says_that_it_is_too_far():
    page = page_of([(0.4, 0, 0), (0, 0, 0)], leader=[forward(3, 3)], range_mm=600)
    assert "tooFar" in seen(page, 1, 20_000)


def test_few_think_at_once_and_none_at_the_very_beginning():
    page = page_of([(0, 0, 0), *((5, k, 0) for k in range(9))], range_mm=1000)
    page.send(StepWorld(100))
    assert page.take(Thoughts) == []
    page.send(StepWorld(100))
    assert [told.car for told in page.last(Thoughts).thoughts] == list(range(1, MOST_THOUGHTS + 1))


def test_a_large_crowd_thinks_nothing():
    page = page_of([(0, 0, 0), *((5 + k, 0, 0) for k in range(MOST_CARS))], range_mm=1000)
    page.send(StepWorld(100))
    page.send(StepWorld(100))
    assert page.take(Thoughts) == []


def test_the_past_has_the_thoughts_of_its_time():
    page = page_of([(0, 0, 0), (2.5, 0, 0)], range_mm=1000)
    for _ in range(4):
        page.send(StepWorld(100))
    page.send(Seek(1000))
    assert page.take(Thoughts)[-1].thoughts == []
    page.send(Seek(3000))
    assert page.take(Thoughts)[-1].thoughts == [CarThought(1, "tooFar")]
    page.send(Seek(None))
    assert page.take(Thoughts) == []


def test_a_page_that_connects_again_is_told_and_a_thought_ends_when_its_cause_does():
    page = page_of([(0, 0, 0), (2.5, 0, 0)], range_mm=1000)
    for _ in range(2):
        page.send(StepWorld(100))
    page.answers.clear()
    page.answers += page.session.connect()
    assert page.take(WorldHello | Thoughts)[-1] == Thoughts([CarThought(1, "tooFar")])
    mat = {"format": "motorcade-mat/1", "name": "Table", "tick_ms": TICK_MS}
    page.send(SetEnvironment(mat, range_mm=3000))
    # The next message is on its way.
    assert page.take(Thoughts)[-1].thoughts == [CarThought(1, "waiting")]
    for _ in range(3):
        page.send(StepWorld(100))
    assert page.take(Thoughts)[-1].thoughts == []
