"""The file of a mission: what is read, and which sentence each fault gets."""

import json

import pytest

from motorcade.errors import MotorcadeError
from motorcade.locales import languages
from motorcade.missions.document import mission_of, parse_mission, read_mission
from motorcade.program.steps import WaitStep

SMALL = """\
format = "motorcade-mission/1"
name = "Stand still"
seconds = 5

[[mat.car]]
at_m = [0, 0]
role = "leader"

[[zone]]
name = "home"
centre_m = [0, 0]
radius_m = 1

[[goal]]
kind = "in-zone"
zone = "home"
"""
CRIPPLED = {
    "a key that is not known": ("seconds = 5", "secnods = 5", "line 3: secnods is not known; known are"),
    "a wall's end": ("[[zone]]", "[[mat.wall]]\nfrom_m = [0, 0]\n[[zone]]", "line 9: mat.wall[0].to_m is missing"),
    "a zone without area": ("centre_m = [0, 0]\nradius_m = 1\n", "", "zone[0] needs one of corners_m, centre_m"),
    "a key of another kind": ('zone = "home"', 'zone = "home"\ncount = 3', "line 17: goal[0].count is not known"),
    "an unknown zone": ('\nzone = "home"', '\nzone = "hoem"', 'line 16: goal[0].zone is "hoem"; allowed: "home"'),
    "an unknown group": (
        'zone = "home"',
        'zone = "home"\nwho = "both"',
        'goal[0].who is "both"; allowed: one of "leader"',
    ),
    "no such group": ('zone = "home"', 'zone = "home"\nwho = "followers"', "and there is no such car"),
    "no such car": (
        'zone = "home"',
        'zone = "home"\nwho = [1]',
        "goal[0].who is 1; allowed: a whole number from 0 to 0",
    ),
    "no first star": ('zone = "home"', 'zone = "home"\nstar = 2', "no goal is for the first star"),
    "nobody leads": ('role = "leader"', 'role = "follower"', "no car leads"),
    "a car off the mat": ("[[mat.car]]", 'mat.edge = "wall"\nmat.size_m = [1, 1]\n[[mat.car]]', "over the mat's edge"),
    "text in no language": ('name = "Stand still"', "name = {}", "name needs one of en, zh"),
    "a voice is missing": ('kind = "in-zone"\nzone = "home"', 'kind = "stopped-by-voice"', 'a voice that says "stop"'),
    "no bound": ('kind = "in-zone"\nzone = "home"', 'kind = "travelled"', "goal[0] needs one of least_m, most_m"),
    "a goal by itself": (
        'zone = "home"',
        'zone = "home"\n[[goal]]\nkind = "all-by"\ngoal = 2\nseconds = 1',
        "goal[1].goal must",
    ),
    "a goal that is met all the time": (
        'zone = "home"',
        'zone = "home"\nat = "always"\n[[goal]]\nkind = "all-by"\ngoal = 1\nseconds = 1',
        "goal[1].goal must",
    ),
    "two zones of a name": (
        "[[goal]]",
        '[[zone]]\nname = "home"\ncentre_m = [1, 0]\nradius_m = 1\n[[goal]]',
        "zone[1].name is home",
    ),
    "a broken program": (
        "[[goal]]",
        "[solution]\nleader = [{ wait = { secnods = 3 } }]\n[[goal]]",
        "secnods is not known",
    ),
    "a program that is not there": ("[[goal]]", '[solution]\nprogram = "x.json"\n[[goal]]', "[solution] is not valid"),
    "two programs": (
        "[[goal]]",
        '[solution]\nprogram = "x"\nleader = []\n[[goal]]',
        "solution has program, leader; keep one",
    ),
    "too much to check": (
        "[[mat.car]]",
        "seeds = [1, 2, 3, 4, 5]\nmat.crowd = [{cars = 4000, corner_m = [5, 5], size_m = [50, 50]}]\n[[mat.car]]",
        "4001 cars × 5 s × 5 seeds take too long",
    ),
    "notes name a hint that is not there": (
        "[[goal]]",
        '[notes]\nminutes = 9\naim = "a"\nsay = "b"\nfurther = "c"\nmistakes = [{ text = "d", hint = 2 }]\n[[goal]]',
        "notes.mistakes[0].hint is 2",
    ),
    "no TOML": ("format = ", "format ", "is not TOML"),
}


def test_a_small_file_has_defaults():
    mission = parse_mission(SMALL, "small", "TOML")
    assert (mission.id, mission.seeds, mission.duration_ms, mission.stars) == ("small", (0, 1, 2), 5000, 1)
    assert mission.name.texts == dict.fromkeys(languages(), "Stand still")
    assert mission.goals[0].values == {"who": "all", "share": 1, "zone": "home", "at": "end"}


@pytest.mark.parametrize("what", CRIPPLED)
def test_a_fault_is_told_with_its_place(what, tmp_path):
    good, bad, sentence = CRIPPLED[what]
    assert good in SMALL
    path = tmp_path / "small.toml"
    path.write_text(SMALL.replace(good, bad, 1), encoding="utf-8")
    with pytest.raises(MotorcadeError) as caught:
        read_mission(path)
    assert caught.value.exit_code == 2
    assert sentence in caught.value.sentence("en")
    assert all(caught.value.sentence(language) for language in languages())


def test_json_has_the_same_keys_and_a_project_file_may_stand_beside_it(tmp_path):
    document = {
        "format": "motorcade-mission/1",
        "name": {"zh": "停"},
        "mat": {"car": [{"at_m": [0, 0], "role": "leader"}]},
        "goal": [{"kind": "no-touch"}],
        "solution": {"program": "mine.json"},
    }
    (tmp_path / "m.json").write_text(json.dumps(document), encoding="utf-8")
    (tmp_path / "mine.json").write_text('{"format": "motorcade-program/1", "leader": [{"wait": {"seconds": 1}}]}')
    mission = read_mission(tmp_path / "m.json")
    assert mission.solution.leader == (WaitStep(1),)
    assert mission.name.sentence("en") == "停"
    with pytest.raises(MotorcadeError, match="a mission that is no file"):
        mission_of(document, "m")


def test_another_ending_is_refused(tmp_path):
    with pytest.raises(MotorcadeError, match=r"ends in \.toml or \.json"):
        read_mission(tmp_path / "m.yaml")
