"""What a page sends to its world takes at most a second of CPU time: what is heavier is refused before it is done."""

import math
from time import process_time

import pytest

from motorcade.boards.simulated_drive import DrivenCars
from motorcade.errors import MotorcadeError
from motorcade.server.studio.driving import build_world
from motorcade.service.messages import MissionChoice
from motorcade.service.world_messages import SetWorld, Step
from motorcade.service.world_session import WorldSession

MOST_S = 1.0
FEW = {"crowd": [{"cars": 5}]}
ZIGZAG = [[5 * k, 0 if k % 2 else 1990] for k in range(395)] + [[2000, 2000], [0, 2000]]
WALLS = [{"from_m": [5 * k, 0], "to_m": [2000 - 5 * k, 1900]} for k in range(300)]
CROWDS = [{"cars": 1, "corner_m": [k % 40 * 10, k // 40 * 10], "size_m": [9, 9]} for k in range(2000)]
CIRCLE = [[100 + 90 * math.cos(k / 50 * math.pi), 100 + 90 * math.sin(k / 50 * math.pi)] for k in range(100)]
PATH = {"path": [[k, 1, 1] for k in range(10_000)]}


def mat(side_m=2000, **more):
    return {"format": "motorcade-mat/1", "name": "x", "size_m": [side_m, side_m], **more}


def mission(goals, cars=2000, zone=None, **furniture):
    place = {"size_m": [200, 200], "crowd": [{"cars": cars, "leaders": 1}], **furniture}
    zones = [{"name": "z", "corners_m": zone}] if zone else []
    level = {"path": "swarm", "order": 1, "level": "words", "seconds": 10}
    return {"format": "motorcade-mission/1", "name": "x", **level, "mat": place, "goal": goals, "zone": zones}


MATS = {
    "10,000 walls": ("too-much-furniture", mat(wall=WALLS * 34, **FEW)),
    "long ways": ("too-much-furniture", mat(person=[PATH] * 3, **FEW)),
    "polygons": ("too-much-furniture", mat(polygon=[{"corners_m": CIRCLE}] * 5, **FEW)),
    "2,000 crowds": ("bad-mat", mat(wall=WALLS, crowd=CROWDS)),
    "a zigzag": ("bad-mat", mat(polygon=[{"corners_m": ZIGZAG}], crowd=[{"cars": 2000, "placement": "random"}])),
    "no room": ("bad-mat", mat(disc=[{"centre_m": [1000, 1000], "radius_m": 1500}], crowd=[{"cars": 10}])),
}
IN_ZONE = {"kind": "in-zone", "zone": "z", "at": "always"}
MISSIONS = {
    "a zone of many corners": ("goals-too-detailed", mission([IN_ZONE] * 30, zone=CIRCLE)),
    "a larger zone": ("too-much-furniture", mission([IN_ZONE] * 30, 10, zone=CIRCLE * 5)),
    "obstacles": (
        "goals-too-detailed",
        mission([{"kind": "no-touch"}] * 30, disc=[{"centre_m": [k, 199], "radius_m": 0.1} for k in range(200)]),
    ),
    "walls": ("too-much-furniture", mission([{"kind": "no-touch"}], 10, wall=WALLS * 2)),
}
HEAVIEST = {
    "30 goals": mission([{"kind": "lit", "led": 1, "at": "always"}] * 30),
    "a zone": mission([IN_ZONE], zone=CIRCLE[::10]),
    "distances": mission([{"kind": "together", "metres": 1}] * 30),
}


def build(message):
    return build_world(message, DrivenCars(), 2000)


def chosen(document):
    return SetWorld(mat=mat() | document["mat"], mission=MissionChoice("x", document))


@pytest.mark.parametrize("kind", [*MATS, *MISSIONS])
def test_a_heavy_world_is_refused_in_time(kind):
    code, document = (MATS | MISSIONS)[kind]
    message = SetWorld(mat=document) if kind in MATS else chosen(document)
    began_s = process_time()
    with pytest.raises(MotorcadeError) as refused:
        build(message)
    assert process_time() - began_s < MOST_S
    assert refused.value.code == code


@pytest.mark.parametrize("kind", HEAVIEST)
def test_the_largest_step_of_a_world_with_goals_takes_less_than_a_second(kind):
    session = WorldSession("0" * 32, build)
    session.begin(build(chosen(HEAVIEST[kind])))
    began_s = process_time()
    session.receive(Step(100))
    assert process_time() - began_s < MOST_S
