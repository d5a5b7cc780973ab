"""The commands missions and check."""

import csv
import json
import os
import sys
from pathlib import Path

import pytest

from motorcade.missions.document import LITERATURE, missions
from support.command_line import Terminal, data, run

# A leader that must drive out of its box, and a program for it.
MISSION = """\
format = "motorcade-mission/1"
name = { en = "Leave", zh = "离开" }
seconds = 4
seeds = [7, 8]
steps = ["drive", "wait"]

[[mat.car]]
at_m = [0, 0]
role = "leader"

[[zone]]
name = "box"
centre_m = [0, 0]
radius_m = 0.5

[[goal]]
kind = "out-of-zone"
zone = "box"
at = "end"

[[goal]]
star = 2
kind = "states-at-most"
count = 1

[solution]
leader = [{ drive = { direction = "forward", speed = 2, seconds = 3 } }]
"""


@pytest.fixture
def mission(tmp_path):
    path = tmp_path / "leave.toml"
    path.write_text(MISSION, encoding="utf-8")
    return path


def project(tmp_path, *leader):
    path = tmp_path / "mine.motorcade.json"
    path.write_text(json.dumps({"format": "motorcade-program/1", "leader": [*leader]}), encoding="utf-8")
    return path


FORWARD = {"drive": {"direction": "forward", "speed": 2, "seconds": 1}}
FAR = {"drive": {"direction": "forward", "speed": 2, "seconds": 3}}


def test_missions_lists_each_with_its_path_order_and_stars():
    listed = json.loads(run("missions", "--json").out)
    assert [each["id"] for each in listed] == [each.id for each in (*missions(), *missions(LITERATURE))]
    assert all(
        {*each} == {"id", "name", "path", "order", "stars", "shortest"} and each["stars"] == 3 for each in listed
    )
    assert json.loads(run("missions", "--language", "zh", "--json").out)[0]["name"] != listed[0]["name"]
    shown = run("missions", stdout=Terminal()).out
    assert [each["id"] for each in listed if each["id"] not in shown] == []
    assert ("–" in shown, "None" in shown) == (any(each["shortest"] is None for each in listed), False)


def test_check_counts_stars_and_says_when_and_why(mission, tmp_path):
    two_states = project(tmp_path, FAR, {"wait": {"seconds": 1}})
    for program, stars in (("solution", 2), (two_states, 1)):
        result = data("check", mission, program, "--json")
        assert result["stars"] == stars
    goals = {goal["kind"]: goal for goal in result["goals"]}
    assert {*goals["out-of-zone"]} == {"kind", "star", "met", "seed", "t_ms", "why", "cars", "grade"}
    assert goals["states-at-most"] == {
        "kind": "states-at-most",
        "star": 2,
        "met": False,
        "seed": 7,
        "t_ms": 0,
        "why": "the leader takes 2 steps; 1 can do it",
        "cars": [],
        "grade": 0.5,
    }
    # At 200 mm/s the car is out of the box, whose radius is 0.5 m, after 2.5 s.
    assert (goals["out-of-zone"]["met"], goals["out-of-zone"]["t_ms"]) == (True, 2600)


def test_check_ends_with_1_where_no_star_is_earned(mission, tmp_path):
    standing = project(tmp_path, {"wait": {"seconds": 1}})
    ran = run("check", mission, standing, "--language", "zh", "--json")
    assert ran.code == 1
    assert json.loads(ran.out)["goals"][1]["why"].startswith("小车在")
    forbidden = project(tmp_path, FORWARD, {"led": {"which": 0, "seconds": 1}})
    ran = run("check", mission, forbidden, "--json")
    assert (ran.code, json.loads(ran.out)["goals"][0]["why"]) == (
        1,
        "the program uses light; allowed are driving, waiting",
    )


@pytest.mark.parametrize(
    ("place", "notes"),
    [
        ("centre_m = [2.4, 0]", []),
        ("centre_m = [2.5, 0]", ["motorcade: Zone 'box' is beside the mat. Move it onto the mat."]),
        ("at_m = [0, -0.1]", ["motorcade: Car 0 stands beside the mat. Move it onto the mat."]),
    ],
)
def test_check_names_what_lies_beside_the_mat(tmp_path, place, notes):
    path = tmp_path / "beside.toml"
    key = place.partition(" ")[0]
    text = MISSION.replace(f"{key} = [0, 0]", place).replace("[[mat.car]]", "[mat]\nsize_m = [2, 1]\n\n[[mat.car]]")
    path.write_text(text, encoding="utf-8")
    assert run("check", path, "solution").err.splitlines() == notes


def test_check_takes_images_and_python_text_and_never_executes_it(mission, tmp_path):
    text, image = tmp_path / "leave.py", tmp_path / "image.bin"
    text.write_text("from motorcade import *\nprogram = Program([forward(3)])\nif __name__ == '__main__':\n    1 / 0\n")
    run("compile", project(tmp_path, FORWARD), "-o", image)
    for program in (text, image):
        assert json.loads(run("check", mission, program, "--json").out)["stars"] == 2


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("no-such-mission", "solution"), "there is no mission 'no-such-mission'"),
        (("missing.toml", "solution"), "missing.toml can't be read"),
        (("leave.toml", "near-miss"), "the mission has no program called near-miss"),
        (("leave.toml", "missing.json"), "missing.json is no program that can be checked: there is no such file"),
        (("leave.toml", "leave.toml"), "leave.toml is no program that can be checked"),
        (("leave.toml", "bad.json"), "leader[0].wait.secnods: 'secnods' can't stand here"),
        (("leave.toml", "open.py"), "open.py is no program that can be checked: line 1, column "),
    ],
)
def test_a_bad_file_ends_with_2_and_one_sentence(mission, tmp_path, monkeypatch, arguments, sentence):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.json").write_text('{"format": "motorcade-program/1", "leader": [{"wait": {"secnods": 1}}]}')
    (tmp_path / "open.py").write_text("program = Program([forward(2)")
    ran = run("check", *arguments)
    assert (ran.code, ran.out) == (2, "")
    assert sentence in ran.err
    assert len(ran.err.splitlines()) == 1


def test_search_saves_the_best_programs_and_a_picture_of_its_archive(mission, tmp_path):
    folder = tmp_path / "found"
    ran = run("search", mission, "--runs", 100, "--output", folder, "--jobs", 1, "--json")
    found = json.loads(ran.out)
    assert (ran.code, found["shortest"]) == (0, 1)
    assert found["best"][0]["grade"] == 1
    assert (folder / "archive.png").stat().st_size > 3000
    checked = json.loads(run("check", mission, found["best"][0]["file"], "--json").out)
    assert (checked["stars"], checked["grade"]) == (2, 1)
    again = run("search", mission, "--runs", 100, "--output", folder, "--seed", 1)
    assert (again.code, "--seed" in again.err) == (2, True)


def test_check_of_a_folder_makes_a_table_and_a_page_whatever_lies_there(mission, tmp_path):
    folder = tmp_path / "class" / "小明"
    folder.mkdir(parents=True)
    texts = {
        "good.motorcade.json": json.dumps({"format": "motorcade-program/1", "leader": [FAR]}),
        "near.motorcade.json": json.dumps({"format": "motorcade-program/1", "leader": [{"wait": {"seconds": 1}}]}),
        "cut.motorcade.json": json.dumps({"format": "motorcade-program/1", "leader": [FAR]})[:40],
        "=1+1.motorcade.json": "[]",
        "a&amp.txt": "a note",
        ".hidden": "",
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder.parent / "photo.png").write_bytes(b"\x89PNG" + bytes(500))
    for language, stars in (("zh", "星星"), ("en", "Stars")):
        ran = run("check", mission, folder.parent, "--language", language, "--json")
        assert ran.code == 1
        told = json.loads(ran.out)
        page, table = Path(told["page"]), Path(told["table"])
        rows = list(csv.reader(table.read_text(encoding="utf-8-sig").splitlines()))
        assert rows[0][1] == stars
        found = {name.rpartition("/")[2]: row for name, *row in rows[1:]}
        assert {*found} == {*texts, "photo.png"} - {".hidden"}
        assert [found[f"{name}.motorcade.json"][0] for name in ("good", "near", "cut")] == ["2", "0", ""]
        assert [bool(cell) for cell in found["near.motorcade.json"][2:]] == [True, False]
        assert all(found[name][3] for name in ("cut.motorcade.json", "a&amp.txt", "photo.png"))
    text = page.read_text(encoding="utf-8")
    assert (text.count("<svg "), text.count("a&amp;amp.txt")) == (2, 1)
    # Its own report is no file of a pupil.
    assert len(told["files"]) == 6
    (folder.parent / "photo.png").unlink()
    for name in ("near.motorcade.json", "cut.motorcade.json", "=1+1.motorcade.json", "a&amp.txt"):
        (folder / name).unlink()
    assert run("check", mission, folder.parent, "-o", tmp_path / "out.html").code == 0
    empty = tmp_path / "empty"
    empty.mkdir()
    assert run("check", mission, empty).code == 2


@pytest.mark.skipif(sys.platform != "linux", reason="others take no names that aren't UTF-8")
def test_a_name_that_is_no_utf_8_ends_no_report(mission, tmp_path):
    folder, good = tmp_path / "class", json.dumps({"format": "motorcade-program/1", "leader": [FAR]})
    folder.mkdir()
    for name in (b"\xff.motorcade.json", b"\x1b[2J.motorcade.json", b"\xe2\x80\xae.motorcade.json"):
        (folder / os.fsdecode(name)).write_text(good, encoding="utf-8")
    told = json.loads(run("check", mission, folder, "--json").out)
    assert len(told["files"]) == 3
    rows = list(csv.reader(Path(told["table"]).read_text(encoding="utf-8-sig").splitlines()))
    assert [row[1] for row in rows[1:]] == ["2"] * 3
    shown = run("check", mission, folder, stdout=Terminal()).out
    assert "\x1b[2J" not in shown
    assert "\udcff" not in shown


def test_somebody_at_a_terminal_sees_why_each_file_of_a_folder_has_no_star(tmp_path):
    folder = tmp_path / "class"
    folder.mkdir()
    near = json.dumps({"format": "motorcade-program/1", "leader": [{"wait": {"seconds": 1}}]})
    (folder / "cut").write_text(near[:40], encoding="utf-8")
    (folder / "near").write_text(near, encoding="utf-8")
    cut, lost = json.loads(run("check", "follow-me", folder, "--json").out)["files"]
    why, *others = [goal["why"] for goal in lost["goals"] if not goal["met"]]
    shown = run("check", "follow-me", folder, stdout=Terminal()).out.splitlines()
    for name, reason in (("cut", cut["problem"]), ("near", why)):
        assert any(name in line and reason[:20] in line for line in shown)
    # Each reason begins a line.
    assert all(any(line.strip(" │–").startswith(other[:20]) for line in shown) for other in others)
    assert others
