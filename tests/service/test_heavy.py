"""What a page may send takes time in proportion to its size, and what is too heavy is refused before it is done."""

import json
import math
from contextlib import suppress
from pathlib import Path
from time import process_time

import pytest

import motorcade.missions
from motorcade import Program, compile_program, decompile, forward, led
from motorcade.config.files import line_of
from motorcade.config.profile import parse_profile
from motorcade.errors import MotorcadeError
from motorcade.mats import parse_mat
from motorcade.program.model import align
from motorcade.service.messages import MissionChoice
from motorcade.service.requests import Context, respond
from motorcade.service.world_messages import SetWorld, StepWorld
from motorcade.service.world_session import WorldSession
from motorcade.words.packing import bytes_to_words
from support.session_page import server_world

# Of CPU time.
MOST_S = 1.0
# The same work ten times as often takes ten times as long; what grows with the square takes a hundred times.
MOST_RATIO = 40
# Shorter times are mostly the clock's.
LEAST_S = 0.002

FEW = {"crowd": [{"cars": 5}]}
ZIGZAG = [[5 * k, 0 if k % 2 else 1990] for k in range(395)] + [[2000, 2000], [0, 2000]]
WALLS = [{"from_m": [5 * k, 0], "to_m": [2000 - 5 * k, 1900]} for k in range(300)]
CROWDS = [{"cars": 1, "corner_m": [k % 40 * 10, k // 40 * 10], "size_m": [9, 9]} for k in range(2000)]
CIRCLE = [[100 + 90 * math.cos(k / 50 * math.pi), 100 + 90 * math.sin(k / 50 * math.pi)] for k in range(100)]
PATH = {"path": [[k, 1, 1] for k in range(10_000)]}


def mat(**more):
    return {"format": "motorcade-mat/1", "name": "x", "size_m": [2000, 2000], **more}


def mission(goals, cars=2000, zone=None, **furniture):
    place = {"size_m": [200, 200], "crowd": [{"cars": cars, "leaders": 1}], **furniture}
    zones = [{"name": "z", "corners_m": zone}] if zone else []
    level = {"path": "swarm", "order": 1, "level": "words", "seconds": 10}
    return {"format": "motorcade-mission/1", "name": "x", **level, "mat": place, "goal": goals, "zone": zones}


def chosen(document):
    return SetWorld(mat=mat() | document["mat"], mission=MissionChoice("x", document))


IN_ZONE = {"kind": "in-zone", "zone": "z", "at": "always"}
DISCS = [{"centre_m": [k, 199], "radius_m": 0.1} for k in range(200)]
REFUSED = {
    "too many cars": ("too-many-cars", SetWorld(mat(crowd=[{"cars": 2001}]))),
    # Refused before a place for any car is searched for.
    "far too many": ("too-many-cars", SetWorld(mat(crowd=[{"cars": 1e300}]))),
    "401 discs": ("too-much-furniture", SetWorld(mat(disc=[{"centre_m": [9, 9], "radius_m": 1}] * 401, **FEW))),
    "no mat": ("bad-mat", SetWorld({})),
    "10,000 walls": ("too-much-furniture", SetWorld(mat(wall=WALLS * 34, **FEW))),
    "long ways": ("too-much-furniture", SetWorld(mat(person=[PATH] * 3, **FEW))),
    "polygons": ("too-much-furniture", SetWorld(mat(polygon=[{"corners_m": CIRCLE}] * 5, **FEW))),
    "2,000 crowds": ("bad-mat", SetWorld(mat(wall=WALLS, crowd=CROWDS))),
    "a zigzag": (
        "bad-mat",
        SetWorld(mat(polygon=[{"corners_m": ZIGZAG}], crowd=[{"cars": 2000, "placement": "random"}])),
    ),
    "no room": (
        "bad-mat",
        SetWorld(mat(disc=[{"centre_m": [1000, 1000], "radius_m": 1500}], crowd=[{"cars": 10}])),
    ),
    "a zone of many corners": ("goals-too-detailed", chosen(mission([IN_ZONE] * 30, zone=CIRCLE))),
    "a larger zone": ("too-much-furniture", chosen(mission([IN_ZONE] * 30, 10, zone=CIRCLE * 5))),
    "obstacles": ("goals-too-detailed", chosen(mission([{"kind": "no-touch"}] * 30, disc=DISCS))),
    "walls": ("too-much-furniture", chosen(mission([{"kind": "no-touch"}], 10, wall=WALLS * 2))),
}
HEAVIEST = {
    "30 goals": mission([{"kind": "lit", "led": 1, "at": "always"}] * 30),
    "a zone": mission([IN_ZONE], zone=CIRCLE[::10]),
    "distances": mission([{"kind": "together", "metres": 1}] * 30),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_a_heavy_world_is_refused_in_time(kind):
    code, message = REFUSED[kind]
    began_s = process_time()
    with pytest.raises(MotorcadeError) as refused:
        server_world(message)
    assert process_time() - began_s < MOST_S
    assert refused.value.code == code


@pytest.mark.parametrize("kind", HEAVIEST)
def test_the_largest_step_of_a_world_with_goals_takes_less_than_a_second(kind):
    session = WorldSession("0" * 32, server_world)
    session.receive(chosen(HEAVIEST[kind]))
    began_s = process_time()
    session.receive(StepWorld(100))
    assert process_time() - began_s < MOST_S


MISSION = (Path(motorcade.missions.__file__).parent / "gallery" / "a-secret.toml").read_text(encoding="utf-8")
HEAD = "from motorcade import *\nprogram = Program(leader=["


def ask(name, **message):
    respond(name, json.dumps(message).encode(), Context(None, None, list))


def open_mission(text):
    ask("missions/open", text=text)


def text_to_blocks(text):
    ask("python-to-blocks", leader={"blocks": {"blocks": []}}, text=text)


def read_mat(**furniture):
    parse_mat(json.dumps(mat(size_m=[900, 900], **furniture)), "x", "JSON")


# For each a size, and what is done at a size.
JOBS = {
    "a mission with comments and a fault": (2000, lambda n: open_mission(MISSION + "# a\n" * n + "unknown = 1\n")),
    "a mission with goals": (300, lambda n: open_mission(MISSION + '\n[[goal]]\nkind = "x"' * n)),
    "a mission with unknown keys": (300, lambda n: open_mission(MISSION + "".join(f"\n[x.k{i}]" for i in range(n)))),
    "a mission in JSON": (3000, lambda n: open_mission(json.dumps({"format": "motorcade-mission/1", "a": [1] * n}))),
    "a mission with a key of many parts": (1500, lambda n: open_mission("a" + ".a" * n + " = 1")),
    "a mission with a key of many quoted parts": (1500, lambda n: open_mission("'a'" + ' . "a"' * n + " = 1")),
    "a mission with one long word": (20_000, lambda n: open_mission("a" * n + ' "' * n)),
    "a mission with many lists in lists": (40, lambda n: open_mission("a = " + "[" * n + "]" * n)),
    "a mission with many numbers": (2000, lambda n: open_mission("a = [" + "1.5, " * n + "]")),
    "text in one line with an accent": (300, lambda n: text_to_blocks(HEAD + "voice('é'), " * n + "])")),
    "a text with comments": (
        300,
        lambda n: ask(
            "blocks-to-python",
            leader={"blocks": {"blocks": []}},
            text=HEAD + "\n" + "forward(1), # b\n" * n + "])",
        ),
    ),
    "a text of wrong lines": (300, lambda n: text_to_blocks(HEAD + "\n" + "forwar(1), # é\n" * n + "])")),
    "a text of names": (300, lambda n: text_to_blocks("".join(f"a{i} = 1\n" for i in range(n)) + HEAD + "])")),
    "a text of repeats": (100, lambda n: text_to_blocks(HEAD + "repeat(2, forward(1)), " * n + "])")),
    "a text of steps at once": (100, lambda n: text_to_blocks(HEAD + "together(" + "led(1, 1), " * n + ")])")),
    "a text of doubled lists": (
        200,
        lambda n: text_to_blocks("".join(f"a{i + 1} = [a{i}, a{i}]\n" for i in range(n)) + HEAD + "])"),
    ),
    "a file of numbers": (3000, lambda n: ask("open", text=json.dumps({"format": "motorcade/1", "a": [1] * n}))),
    "a mat's crowds": (80, lambda n: read_mat(crowd=CROWDS[:n])),
    "a mat's leaders": (1000, lambda n: read_mat(crowd=[{"cars": 2 * n, "leaders": n}])),
    "a mat's walls": (
        300,
        lambda n: read_mat(wall=[{"from_m": [k % 90, k // 90], "to_m": [k % 90 + 0.5, k // 90]} for k in range(n)]),
    ),
    "a mat's path": (900, lambda n: read_mat(person=[{"path": [[k, 1, 1] for k in range(n)]}])),
    "a program and its image": (
        12,
        lambda n: decompile(bytes_to_words(compile_program(Program(leader=[forward(1), led(1, 1)] * n)).image)),
    ),
    "steps that are compared": (
        150,
        lambda n: align([forward(1)] * n, [led(1, 1), *[forward(1), led(1, 1)] * (n // 2)]),
    ),
    "a profile": (300, lambda n: parse_profile("".join(f"[k{k}]\nx = 1\n" for k in range(n)), "p.toml")),
}


@pytest.mark.parametrize("kind", JOBS)
def test_ten_times_as_much_takes_no_hundred_times_as_long(kind):
    size, job = JOBS[kind]

    def took_s(size):
        """The CPU time of one run."""
        began_s = process_time()
        with suppress(MotorcadeError):
            job(size)
        return process_time() - began_s

    limit_s = MOST_RATIO * max(min(took_s(size) for _ in range(3)), LEAST_S)
    assert any(took_s(10 * size) < limit_s for _ in range(3))


@pytest.mark.parametrize(
    ("place", "line"), [(("a",), 3), (("w", 0, "x"), 7), (("w", 0, "z"), 9), (("w", 1), 10), (("not there",), 11)]
)
def test_the_line_of_a_value_is_the_one_on_which_it_is_complete(place, line):
    text = '# [ "\na = [1, # ]\n 2]\n[[w]]\nx = """\n] \\""" #\n"""\ny = \'[\'\nz = {b = "[\\""}\n[[w]]\n'
    assert line_of(text, place) == line
