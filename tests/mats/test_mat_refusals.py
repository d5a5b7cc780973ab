"""Mats that are not valid: each is refused in a sentence that names the place and what to do."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motorcade.errors import MotorcadeError
from motorcade.mats import Person, Physics, Pose, Starts, check_mat, open_table, parse_mat, read_mat
from support.mats import AREA, CAR, CLASSROOM, mat

POINT = "[x, y] in metres, each from -2000 to 2000"
SIZE = "[width, height] in metres, each from 0.001 to 2000"
STEP = "[t_s, x, y], t_s from 0 to 1000000 s, x and y from -2000 to 2000 m"
PATH = f"a list of 1 to 10000 {STEP}"
METRES = "allowed: a number from -2000 to 2000 metres"
MEETS = "meets itself where its sides {} and {} touch or cross; list its corners in order around it"
ROOM = "lower cars or spacing_m, or give it a larger or emptier area"
ACROSS = "a car's body is 0.15 m across, so"
MARKS = "line, patch, spot"
TABLE = f"format, name, tick_ms, size_m, edge, floor, {MARKS}, wall, disc, polygon, voice, person, car, crowd, physics"


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("tick_ms = 41", "tick_ms is 41; allowed: a whole number from 1 to 40 milliseconds"),
        ('floor = "sea"', 'floor is "sea"; allowed: "table", "classroom", "city", "night", "moon", "plain"'),
        ('edge = "wall"', "edge is a wall but there is no size_m; give the mat's width and height"),
        ("wall = 3", "wall is 3; allowed: a list of tables, each under [[wall]]"),
        ("[[wall]]\nfrom_m = [0, 0]", f"wall[0].to_m is missing; give {POINT}"),
        ("[[wall]]\nfrom_m = [0, nan]\nto_m = [0, 1]", f"wall[0].from_m[1] is nan; {METRES}"),
        (
            "[[wall]]\nfrom_m = [0, 1]\nto_m = [0, 2]\n[[wall]]\nfrom_m = [0, 1]\nto_m = [0, 1.0001]",
            "wall[1] has no length; give two different points, 1 mm apart or more",
        ),
        (
            "[[polygon]]\ncorners_m = [[0, 0], [1, 0], [1, 0], [0, 1]]",
            "polygon[0].corners_m has corners 1 and 2 at one place; leave one of them out",
        ),
        (
            "[[polygon]]\ncorners_m = [[0, 0], [1, 1], [2, 2], [3, 3]]",
            "polygon[0].corners_m has no area; move its corners apart",
        ),
        (
            "[[polygon]]\ncorners_m = [[0, 0], [1, 1], [1, 0], [0, 1]]",
            f"polygon[0].corners_m {MEETS.format(0, 2)}",
        ),
        (
            "[[polygon]]\ncorners_m = [[0, 0], [2, 0], [2, 2], [1, 0], [0, 2]]",
            f"polygon[0].corners_m {MEETS.format(0, 2)}",
        ),
        (
            "[[polygon]]\ncorners_m = [[0, 0], [2, 0], [1, 0], [1, 1]]",
            f"polygon[0].corners_m {MEETS.format(0, 1)}",
        ),
        (
            "[[person]]\npath = [[0, 0, 0], [-1, 1, 1]]",
            "person[0].path[1][0] is -1; allowed: a number from 0 to 1000000 seconds",
        ),
        ("[[person]]\npath = [[1, 0, 0]]", "person[0].path[0] is at 1 s; begin the path at 0 s"),
        (
            "[[person]]\npath = [[0, 0, 0], [2, 1, 1], [2, 2, 2]]",
            "person[0].path[2] is at 2 s, after 2 s; let times rise, by 0.001 s or more",
        ),
        (
            "[[car]]\nat_m = [0, 0]\nheading_deg = 361",
            "car[0].heading_deg is 361; allowed: a number from -360 to 360 degrees",
        ),
        (f"[[crowd]]\ncars = 3\nleaders = 4\n{AREA}", "crowd[0].leaders is 4; allowed: up to 3, as many as its cars"),
        ("[[crowd]]\ncars = 3", "crowd[0] has no area and the mat no size_m; give the crowd its corner_m and size_m"),
        (
            f'[[crowd]]\ncars = 3\n{AREA}heading_deg = "up"',
            'crowd[0].heading_deg is "up"; allowed: a number from -360 to 360 degrees, or "random"',
        ),
        (
            f"[[crowd]]\ncars = 401\n{AREA}",
            f"crowd[0] finds room for 400 of its 401 cars on 5 x 5 m, 0.25 m apart; {ROOM}",
        ),
        (
            f'[[crowd]]\ncars = 26\nspacing_m = 1\nplacement = "random"\n{AREA}',
            f"crowd[0] finds room for 25 of its 26 cars on 5 x 5 m, 1 m apart; {ROOM}",
        ),
        (
            f"[[crowd]]\ncars = 3\n{AREA}[[polygon]]\ncorners_m = [[-9, -9], [9, -9], [9, 9], [-9, 9]]",
            f"crowd[0] finds room for 0 of its 3 cars on 5 x 5 m, 0.25 m apart; {ROOM}",
        ),
        (
            "[[crowd]]\ncars = 3\ncorner_m = [0, 0]\nsize_m = [9, 0.2]",
            f"crowd[0] finds room for 0 of its 3 cars on 9 x 0.2 m, 0.25 m apart; {ROOM}",
        ),
        (f"[[crowd]]\ncars = 1500000\n{AREA}" * 2, "there are 3000000 cars in all; allowed: up to 2000000"),
        ("[physics]\ncollisions = 1", "physics.collisions is 1; allowed: true or false"),
        ("[physics]\ncapture_ratio = 1", "physics.capture_ratio is 1; allowed: a number above 1, up to 1000000"),
        # From here on the fault is that cars have no room.
        ("", "there are no cars; add a [[car]] or a [[crowd]]"),
        (
            f'size_m = [1.05, 9]\nedge = "wall"\n{CAR}',
            f"car[0] starts at [1, 1], over the mat's edge; {ACROSS} keep its centre 0.075 m inside",
        ),
        (
            f"{CAR}[[wall]]\nfrom_m = [1.07, 0]\nto_m = [1.07, 3]",
            f"car[0] starts at [1, 1], on wall[0]; {ACROSS} move one of them",
        ),
        (
            f"[[disc]]\ncentre_m = [9, 9]\nradius_m = 1\n[[disc]]\ncentre_m = [1, 2]\nradius_m = 0.95\n{CAR}",
            f"car[0] starts at [1, 1], on disc[1]; {ACROSS} move one of them",
        ),
        (
            f"[[polygon]]\ncorners_m = [[0, 0], [9, 0], [9, 9], [0, 9]]\n{CAR}",
            f"car[0] starts at [1, 1], on polygon[0]; {ACROSS} move one of them",
        ),
        (
            f"{CAR}[[car]]\nat_m = [1.1, 1]",
            f"car[1] starts at [1.1, 1], 0.1 m from car[0]; {ACROSS} move them apart, or give a crowd more spacing_m",
        ),
        (
            f"{CAR}[[crowd]]\ncars = 5\nspacing_m = 0.1\n{AREA}",
            f"car 1 of crowd[0] starts at [0.15, 0.05], 0.1 m from car 0 of crowd[0]; {ACROSS} "
            "move them apart, or give a crowd more spacing_m",
        ),
        (
            "[[crowd]]\ncars = 5\ncorner_m = [1999.5, 0]\nsize_m = [5, 1]",
            "the x of car 2 of crowd[0] is 2000.12; allowed: -2000 to 2000",
        ),
    ],
)
def test_a_fault_is_refused_in_a_sentence_that_names_the_place_and_what_to_do(body: str, said: str) -> None:
    with pytest.raises(MotorcadeError) as caught:
        check_mat(mat(body), CLASSROOM)
    # Reading names the file, checking names the mat.
    assert str(caught.value) in (f"mat m: {said}", f"mat n: {said}")
    assert_in_chinese(caught.value)


def assert_in_chinese(problem: MotorcadeError) -> None:
    """The Chinese sentence has the same numbers, and no English words but keys and what is in the file."""
    chinese = problem.sentence("zh").partition("：")[2]
    assert re.search(r"[\u4e00-\u9fff]", chinese)
    assert not re.search(r"[a-z]{2,} [a-z]{2,}", chinese)
    numbers = re.compile(r"-?\d+(?:\.\d+)?")
    assert set(numbers.findall(chinese)) <= set(numbers.findall(str(problem)))


@pytest.mark.parametrize(
    ("text", "kind", "said"),
    [
        ("x", "TOML", "mat m is not TOML: Expected"),
        ("[1]", "JSON", f"mat m: the whole of it is [1]; allowed: a table {{...}} of {TABLE}"),
        (
            'format = "motorcade-mat/2"\nname = "n"',
            "TOML",
            'mat m: format is "motorcade-mat/2"; allowed: "motorcade-mat/1"',
        ),
    ],
)
def test_text_that_is_not_a_mat_is_refused_in_a_sentence(text: str, kind: str, said: str) -> None:
    with pytest.raises(MotorcadeError) as caught:
        parse_mat(text, "m", kind)
    assert str(caught.value).startswith(said)


def test_a_file_that_cannot_be_read_is_refused_in_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe\xfa")
    (tmp_path / "mat.yaml").write_text("", encoding="utf-8")
    for name, said in (
        ("none.toml", "mat none.toml can't be read: there is no such file or folder"),
        ("bytes.toml", "mat bytes.toml can't be read: it is not text in UTF-8 or UTF-16"),
        ("mat.yaml", "mat mat.yaml: a mat's file ends in .toml or .json; name a file that does"),
    ):
        with pytest.raises(MotorcadeError) as caught:
            read_mat(tmp_path / name)
        assert str(caught.value) == said


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"tick_ms": 50}, "tick_ms is 50; allowed: a whole number from 1 to 40 milliseconds"),
        (
            {"physics": Physics(capture_ratio=math.nan)},
            "physics.capture_ratio is nan; allowed: a number above 1, up to 1000000",
        ),
        ({"discs": ((5, 5, np.float64(-1)),)}, "disc[0].radius_m is -1.0; allowed: a number from 0.001 to 2000 metres"),
        ({"walls": ((1, 1, 1, 1),)}, "wall[0] has no length; give two different points, 1 mm apart or more"),
        ({"people": (Person(()),)}, f"person[0].path is []; allowed: {PATH}"),
        ({"starts": Starts.of([Pose(math.nan, 0)], [True])}, "the x of car 0 is nan; allowed: -2000 to 2000"),
        (
            {"starts": Starts.of([Pose(0, 0), Pose(0, 2001)], [True, False])},
            "the y of car 1 is 2001; allowed: -2000 to 2000",
        ),
        (
            {"starts": Starts.of([Pose(0, 0, math.inf)], [True])},
            "the heading of car 0 is inf; allowed: -1e+06 to 1e+06",
        ),
    ],
)
def test_a_mat_built_in_python_has_the_same_checks(changes: dict, said: str) -> None:
    table = open_table([Pose(0, 0)])
    check_mat(table, CLASSROOM)
    with pytest.raises(MotorcadeError) as caught:
        check_mat(replace(table, **changes), CLASSROOM)
    assert str(caught.value) == f"mat open table: {said}"
    assert_in_chinese(caught.value)
