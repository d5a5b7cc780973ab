"""Mats: a file's content becomes a mat."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motorcade.errors import MotorcadeError
from motorcade.mats import Mat, Person, Physics, Pose, Starts, Voice, check_mat, open_table, parse_mat, read_mat
from motorcade.mats.document import document_of, mat_of
from motorcade.mats.model import Line
from support.mats import CAR, CLASSROOM, HEAD, mat

ROOT = Path(__file__).parent.parent.parent
EXAMPLES = sorted((ROOT / "examples" / "mats").iterdir())
EVERYTHING = """
format = "motorcade-mat/1"
name = "Everything"
tick_ms = 5
size_m = [6, 4.5]
edge = "wall"

[[wall]]
from_m = [1, 0]
to_m = [1, 2.5]

[[disc]]
centre_m = [3, 3]
radius_m = 0.25

[[polygon]]
corners_m = [[4, 1], [5, 1], [4.5, 2]]

[[person]]
path = [[0, 1, 2], [1.5, 2, 2]]
repeats = true

[[person]]
path = [[0, 5, 4]]

[[voice]]
at_s = 2.5
word = "stop"

[[voice]]
at_s = 3
word = "go"
centre_m = [1, 2]
radius_m = 0.5

[[car]]
at_m = [2, 1]
heading_deg = 90
role = "leader"

[[car]]
at_m = [2.5, 1]

[[crowd]]
cars = 4
leaders = 1
corner_m = [4, 3]
size_m = [1, 1]
spacing_m = 0.5
placement = "grid"
heading_deg = -90
seed = 1

[physics]
collisions = false
line_of_sight = false
capture_ratio = 2
beam_half_angle_deg = 20
bit_error_rate = 0.01
wheel_noise = 0.1
"""


def test_every_key_reaches_its_attribute() -> None:
    read = parse_mat(EVERYTHING, "everything", "TOML")
    x_m, y_m = [2, 2.5, 4.25, 4.75, 4.25, 4.75], [1, 1, 3.25, 3.25, 3.75, 3.75]
    heading = np.radians([90, 0, -90, -90, -90, -90])
    leads = read.starts.leads.tolist()
    assert leads[:2] == [True, False]
    assert sum(leads[2:]) == 1
    groups = (("car[0]", 1), ("car[1]", 1), ("crowd[0]", 4))
    assert read == Mat(
        name="Everything",
        tick_ms=5,
        size_m=(6, 4.5),
        walled=True,
        walls=((1, 0, 1, 2.5),),
        discs=((3, 3, 0.25),),
        polygons=(((4, 1), (5, 1), (4.5, 2)),),
        people=(Person(((0, 1, 2), (1.5, 2, 2)), repeats=True), Person(((0, 5, 4),), repeats=False)),
        voices=(Voice(2.5, "stop"), Voice(3, "go", 1, 2, 0.5)),
        physics=Physics(False, False, 2, 20, 0.01, 0.1),
        starts=Starts(np.array(x_m), np.array(y_m), heading, leads, groups),
    )
    check_mat(read, CLASSROOM)


def test_the_document_of_a_mat_is_read_as_the_same_mat() -> None:
    marks = """
[[line]]
points_m = [[0, 0], [1, 0], [1, 1]]
width_m = 0.05
bend_m = 0.2
closed = true
[[spot]]
centre_m = [3, 1]
radius_m = 0.2
[[patch]]
corners_m = [[4, 1], [5, 1], [4.5, 2]]
"""
    read = replace(parse_mat(EVERYTHING + marks, "everything", "TOML"), starts=Starts.of([], []))
    assert read.lines == (Line(((0, 0), (1, 0), (1, 1)), 0.05, 0.2, True),)
    assert (read.spots, read.patches) == (((3, 1, 0.2),), (((4, 1), (5, 1), (4.5, 2)),))
    assert mat_of(document_of(read), "again") == read


def test_keys_that_are_left_out_have_defaults() -> None:
    assert mat(CAR) == Mat("n", Starts(np.ones(1), np.ones(1), np.zeros(1), np.zeros(1, bool), (("car[0]", 1),)))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_an_example_has_room_for_its_cars_and_a_leader(path: Path) -> None:
    read = read_mat(path)
    check_mat(read, CLASSROOM)
    assert any(read.starts.leads)


def test_the_docs_name_every_key_and_every_example() -> None:
    page = (ROOT / "docs" / "mats.md").read_text(encoding="utf-8")
    root = json.loads((ROOT / "docs" / "motorcade-mat-1.schema.json").read_text(encoding="utf-8"))["properties"]
    tables = [part.get("items", part).get("properties", {}) for part in root.values()]
    for key in {*root, *(key for table in tables for key in table)}:
        assert f"`{key}`" in page or f"`[[{key}]]`" in page or f"`[{key}]`" in page, key
    for path in EXAMPLES:
        assert f"`{path.name}`" in page


def test_a_file_may_have_a_byte_order_mark_and_an_ending_in_capitals(tmp_path: Path) -> None:
    path = tmp_path / "MAT.TOML"
    path.write_text(HEAD + CAR, encoding="utf-8-sig")
    assert read_mat(path) == mat(CAR)


@pytest.mark.parametrize(
    "corners",
    [
        "[[0, 0], [1, 0], [0, 1]]",
        "[[0, 3], [1, 1], [3, 1], [1.5, 0], [2, -2], [0, -1], [-2, -2], [-1.5, 0], [-3, 1], [-1, 1]]",
        "[[0, 0], [5, 0], [5, 5], [1, 5], [1, 2], [3, 2], [3, 3], [2, 3], [2, 4], [4, 4], [4, 1], [0, 1]]",
        "[[0, 0], [1, 0], [2, 0], [2, 1]]",
    ],
    ids=["triangle", "star", "spiral", "a corner on a straight side"],
)
def test_an_obstacle_may_have_any_outline_that_does_not_cross_itself(corners: str) -> None:
    points = json.loads(corners)
    for first in range(len(points)):
        turned = points[first:] + points[:first]
        for each in (turned, turned[::-1]):
            assert mat(f"[[polygon]]\ncorners_m = {each}").polygons == (tuple(map(tuple, each)),)


def test_the_first_car_of_an_open_table_leads_and_starts_are_read_only_and_equal_in_length() -> None:
    poses = [Pose(0, 0, 1), Pose(1, 2)]
    starts = open_table(poses).starts
    assert starts == Starts.of(poses, [True, False]) != Starts.of(poses, [True, True])
    with pytest.raises(TypeError, match="read-only"):
        starts.x_m[0] = 1
    with pytest.raises(MotorcadeError, match="one value per car"):
        Starts.of([Pose(0, 0)], [True, False])
