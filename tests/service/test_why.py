"""Why a car does what it does: the cause that is named is one, for without it the run is another one.

What a cause names is carried out as the page's button does it: by the request ``remedy``.
"""

import json
import math
import struct
from typing import Any, NamedTuple

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from motorcade import Followers, Program, dark, heard, led, obstacle, person, wait, wander
from motorcade import forward as ahead
from motorcade.config.profile import built_in_profile
from motorcade.engine.events import FRAME
from motorcade.engine.moment import unpack_events
from motorcade.locales import languages
from motorcade.mats import Mat, Pose, Starts
from motorcade.mats.geometry import Obstacle
from motorcade.program.blocks import blocks_of
from motorcade.service.messages import Blocks, Capabilities
from motorcade.service.programs import compile_blocks
from motorcade.service.requests import Context, respond
from motorcade.service.studio_world import open_world
from motorcade.service.why import in_the_way
from motorcade.service.world_messages import SetWorld
from motorcade.words.infrared import word_of
from support.studio_programs import block_in, table_of

SECONDS = 9
DIAMETER_M = built_in_profile("classroom").body.diameter_mm / 1000
LIGHTS = (led(1, 1), led(2, 2))
HEARD = ("why-heard", "why-waits", "why-garbled", "why-behind-collision", "why-behind-sending")
CONTEXT = Context(Capabilities(False, False, False, 100), None, list)
PLACES = st.tuples(st.integers(0, 60), st.integers(0, 60), st.integers(-170, 170)).map(
    lambda place: (place[0] / 20, place[1] / 20, place[2])
)


class Project(NamedTuple):
    """What a page has of a project."""

    leader: dict[str, Any]
    followers: dict[str, Any] | None
    mat: dict[str, Any]
    range_mm: int | None = None


def project(poses, *, leads=1, leader=None, followers=LIGHTS, forward=False, listen=True, range_mm=None, **mat):
    """Cars at their places (x and y in metres, heading in degrees); the first ones lead."""
    told = Followers(list(followers), forward=forward, accept_ir=listen)
    return Project(*blocks_of(Program(leader or [wait(1)], told)), table_of(poses, leads, **mat), range_mm)


def played(given, run_ms=SECONDS * 1000):
    """The project's world after some time."""
    image = compile_blocks(Blocks(given.leader, given.followers)).image
    studio = open_world(SetWorld(given.mat, image, range_mm=given.range_mm), 100)
    studio.run(run_ms)
    return studio


def cause(studio, car):
    """The answer of a studio, which is told in every language."""
    found = studio.details(car).why
    assert set(found.sentence) == set(languages())
    assert all(found.sentence.values())
    return found


def remedied(given, car, found):
    """The project after the button was pressed; None where the page says that there is no room."""
    order = {"mat": given.mat, "remedy": found.remedy, "value": found.value, "car": car, "followers": given.followers}
    answer = json.loads(respond("remedy", json.dumps({**order, "range_mm": given.range_mm}).encode(), CONTEXT))
    if answer["mat"] is None and answer["range_mm"] is None and not answer["fields"]:
        return None
    followers = json.loads(json.dumps(given.followers))
    for change in answer["fields"]:
        block_in(followers, change["block"])["fields"][change["field"]] = change["value"]
    return Project(given.leader, followers, answer["mat"] or given.mat, answer["range_mm"] or given.range_mm)


def is_apart(poses):
    return all(math.dist(a[:2], b[:2]) > DIAMETER_M for a in poses for b in poses if a is not b)


def is_reached(studio, car):
    """Whether messages reach the car, even if they are damaged there or meet others."""
    details = studio.details(car)
    return bool(details.heard or any(details.lost.values()))


@settings(max_examples=settings().max_examples if settings().max_examples >= 1000 else 20)
@given(
    st.lists(PLACES, min_size=2, max_size=4).filter(is_apart),
    st.integers(3, 15),
    st.booleans(),
    st.integers(0, 1),
    st.sampled_from([0.0, 0.1, 0.5]),
    st.sampled_from([40, 180]),
)
@example([(0, 0, 0), (2, 0, 0)], 9, False, 1, 0.0, 180)
@example([(0, 0, 0), (0.5, 0, 0), (1, 0, 0)], 7, False, 1, 0.0, 180)
@example([(1, 1, 180), (1.5, 1, 0)], 9, False, 1, 0.0, 40)
@example([(1, 1, 0), (1.5, 1, 0)], 9, False, 0, 0.0, 180)
@example([(0.15, 0, 0), (0, 0.05, 0), (0, 0.2, 58)], 3, False, 1, 0.1, 180)
@example([(0, 0, 0), (0, 0.3, 0), (0.05, 0.15, 0)], 3, False, 1, 0.5, 180)
@example([(0.25, 0, 1), (0, 0, 0)], 4, False, 1, 0.0, 40)
def test_without_the_cause_the_car_hears(poses, decimetres, forward, leads, flips, beam_deg):
    physics = {"bit_error_rate": flips, "beam_half_angle_deg": beam_deg}
    given = project(poses, leads=leads, forward=forward, range_mm=decimetres * 100, physics=physics)
    before = played(given)
    for car in range(leads, len(poses)):
        found = cause(before, car)
        assert bool(before.details(car).heard) == (found.code in HEARD)
        if not found.remedy:
            continue
        after = remedied(given, car, found)
        if after is None:
            continue
        now = played(after)
        if found.remedy == "leader":
            assert cause(now, car).code != "why-no-leader"
        elif found.remedy == "loss":
            assert now.details(car).heard
            assert cause(now, car).code != "why-garbled"
        else:
            assert is_reached(now, car)


@settings(max_examples=settings().max_examples if settings().max_examples >= 1000 else 20)
@given(
    st.sampled_from(["wall", "disc", "polygon", "car"]), st.integers(-20, 20), st.integers(15, 40), st.integers(0, 3)
)
def test_what_is_taken_away_is_not_in_the_way(kind, aside, away, others):
    """A leader drives along x; across its way stands one thing, and others stand beside it."""
    at, y = 2 + away / 50, 2 + aside / 400
    things = {
        "wall": {"from_m": [at, y - 0.5], "to_m": [at, y + 0.5]},
        "disc": {"centre_m": [at + 0.1, y], "radius_m": 0.1},
        "polygon": {"corners_m": [[at, y - 0.2], [at + 0.2, y - 0.2], [at + 0.2, y + 0.2], [at, y + 0.2]]},
    }
    far = {
        "wall": [{"from_m": [0, 9 + k], "to_m": [1, 9 + k]} for k in range(others)],
        "disc": [{"centre_m": [k, 9], "radius_m": 0.1} for k in range(others)],
        "polygon": [{"corners_m": [[k, 7], [k + 0.1, 7], [k, 7.1]]} for k in range(others)],
    }
    poses = [(2, 2, 0), *((k, 5, 0) for k in range(others)), *([(at, y, 0)] if kind == "car" else [])]
    extra = {kind: [*far[kind], things[kind]]} if kind != "car" else {}
    given = project(poses, leader=[ahead(3, 3)], followers=(), **extra)
    before = played(given, 0)
    while not cause(before, 0).remedy and before.now_ms < 2600:
        before.run(50)
    found = cause(before, 0)
    assert found.remedy == f"remove-{kind}"
    before.run(300)
    after = played(remedied(given, 0, found), before.now_ms)
    assert cause(after, 0).code == "why-leads"
    assert _x_m(after) > _x_m(before) + 0.01


@given(
    st.sampled_from(["wall", "disc", "polygon", "car"]),
    st.integers(1, 39),
    st.integers(0, 359),
    st.integers(0, 180),
    st.integers(-60, 60),
)
def test_only_what_stands_ahead_is_in_the_way(kind, depth_mm, heading_deg, side_deg, behind_deg):
    """A car whose body overlaps a thing behind it or beside it drives away from it; one ahead holds it."""
    radius_m = 0.05

    def found(direction_deg):
        angle = math.radians(heading_deg + direction_deg)
        to_x, to_y = math.cos(angle), math.sin(angle)
        near_m = radius_m - depth_mm / 1000
        at_x, at_y = 2 + near_m * to_x, 2 + near_m * to_y
        one, two = (at_x - to_y, at_y + to_x), (at_x + to_y, at_y - to_x)
        things = {
            "wall": {"walls": ((*one, *two),)},
            "disc": {"discs": ((2 + (near_m + 0.3) * to_x, 2 + (near_m + 0.3) * to_y, 0.3),)},
            "polygon": {"polygons": ((one, two, (at_x + 2 * to_x, at_y + 2 * to_y)),)},
            "car": {},
        }
        mat = Mat("one thing", Starts.of([Pose(2, 2)], [True]), **things[kind])
        other = (2 + (near_m + radius_m) * to_x, 2 + (near_m + radius_m) * to_y)
        places = ((2, other[0]), (2, other[1])) if kind == "car" else ((2,), (2,))
        return in_the_way(mat, 0, *places, math.radians(heading_deg), radius_m)

    assert found(180 + behind_deg) is None
    assert found(side_deg if side_deg > 60 else 90) is None
    assert found(behind_deg * 0.9) == Obstacle(kind, 1 if kind == "car" else 0)


def _x_m(studio):
    """Where the first car is, from the picture that the page gets."""
    return struct.unpack_from("<f", studio.pictures.moment(is_stored=False))[0]


@pytest.mark.parametrize(
    ("step", "mat", "code"),
    [
        (ahead(3, unless=person()), {"person": [{"path": [[0, 0.6, 0]]}]}, "why-minds-person"),
        (ahead(3, unless=heard()), {"voice": [{"at_s": 0.1, "word": "stop"}]}, "why-minds-voice"),
        (ahead(3, unless=obstacle(3)), {"disc": [{"centre_m": [0.5, 0], "radius_m": 0.1}]}, "why-minds-obstacle"),
        (wander(3, unless=dark()), {"spot": [{"centre_m": [0, 0], "radius_m": 0.4}]}, "why-minds-floor"),
        # Who minds two things is told of the one that holds the car.
        (ahead(3, unless=person() | heard()), {"person": [{"path": [[0, 0.6, 0]]}]}, "why-minds-person"),
        (ahead(3, unless=person()), {}, "why-leads"),
        (ahead(3), {"person": [{"path": [[0, 0.6, 0]]}]}, "why-leads"),
    ],
)
def test_who_minds_something_says_what(step, mat, code):
    studio = played(project([(0, 0, 0), (0, 5, 0)], leader=[step], **mat), 400)
    assert cause(studio, 0).code == code


def test_who_drives_against_the_edge_or_a_leader_is_told_what_would_be_needed():
    edge = played(project([(0.5, 1, 180)], leader=[ahead(3, 3)], followers=(), size_m=[4, 2], edge="wall"), 2900)
    assert (cause(edge, 0).code, cause(edge, 0).remedy) == ("why-against-edge", "")
    crash = played(project([(1, 1, 0), (1.4, 1, 180)], leads=2, leader=[ahead(3, 3)], followers=()), 1000)
    assert (cause(crash, 0).code, cause(crash, 0).remedy, cause(crash, 0).car) == ("why-against-leader", "", 1)


def test_a_car_that_did_not_listen_listens_after_the_remedy():
    given = project([(0, 0, 0), (0.5, 0, 0)], followers=(ahead(1, 3), led(1, 1)), listen=False)
    studio = played(given, 0)
    while studio.now_ms < 20_000 and cause(studio, 1).code != "why-does-not-listen":
        studio.run(50)
    found = cause(studio, 1)
    assert found.remedy == "listen"
    studio.run(5000)
    assert studio.details(1).lost["deaf"] > 1
    assert played(remedied(given, 1, found), studio.now_ms).details(1).lost["deaf"] == 0


def test_a_car_that_missed_the_newest_message_has_another_word_than_the_one_that_is_sent():
    studio = played(project([(0, 0, 0), (0.5, 0, 0), (0.5, 0.3, 0)], forward=True), 0)
    sent, behind = None, []
    while studio.now_ms < 20_000:
        sent = next((word_of(each.word) for each in sent_by_the_leader(studio.run(20))), sent)
        details = studio.details(2)
        if details.why.code.startswith("why-behind"):
            behind.append(int(details.word, 16) != sent)
    assert behind
    assert all(behind)


def sent_by_the_leader(events):
    return [each for each in unpack_events(events) if (each.kind, each.car) == (FRAME, 0)]


def test_where_two_send_at_once_no_button_is_offered():
    given = project([(0, 0, 0), (1, 0, 0), (0.5, 0, 0)], leads=2)
    studio = played(given, 0)
    told = set()
    while studio.now_ms < SECONDS * 1000:
        studio.run(20)
        found = cause(studio, 2)
        told.add(found.code)
        assert not found.remedy
    assert told & {"why-lost-collision", "why-heard"}


@pytest.mark.parametrize(
    ("poses", "forward", "told", "car", "code"),
    [
        ([(0, 0, 0), (0.5, 0, 0)], False, True, 1, "why-heard"),
        ([(0, 0, 0), (0.5, 0, 0)], False, True, 0, "why-leads"),
        ([(0, 0, 0), (0.5, 0, 0)], False, False, 1, "why-no-words"),
        ([(0, 0, 0), (1.5, 0, 0)], False, True, 1, "why-too-far"),
        ([(0, 0, 0), (0.8, 0, 0), (1.6, 0, 0)], False, True, 2, "why-not-passed-on"),
        ([(0, 0, 0), (0.8, 0, 0), (1.6, 0, 0)], True, True, 2, "why-heard"),
    ],
)
def test_each_cause_is_told(poses, forward, told, car, code):
    followers = LIGHTS if told else ()
    assert cause(played(project(poses, followers=followers, forward=forward, range_mm=1000)), car).code == code


def test_the_first_message_in_bad_air_is_lost_and_the_remedy_is_named():
    given = project([(0, 0, 0), (0.5, 0, 0)], physics={"bit_error_rate": 0.5})
    noisy = played(given, 0)
    while not any(noisy.details(1).lost.values()):
        noisy.run(20)
    found = cause(noisy, 1)
    assert (found.code, found.remedy) == ("why-lost", "loss")
    assert played(remedied(given, 1, found), noisy.now_ms).details(1).heard
