"""Room on a mat: cars without room are found, and crowds are placed where there is room."""

import cmath
import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motorcade.errors import MotorcadeError
from motorcade.mats import Mat, Pose, check_mat, document, open_table
from support.mats import AREA, CLASSROOM, mat

BODY_M = CLASSROOM.body.diameter_mm / 1000


def apart_m(x_m: np.ndarray, y_m: np.ndarray) -> float:
    """The least distance between two of some points."""
    distances = np.hypot(x_m[:, None] - x_m, y_m[:, None] - y_m)
    np.fill_diagonal(distances, np.inf)
    return float(distances.min())


# Points on a lattice of 50 mm: their distances lie on both sides of 150 mm, and exactly on it.
LATTICE = st.lists(st.tuples(st.integers(-12, 12), st.integers(-12, 12)), min_size=2, max_size=8)


@settings(max_examples=200)
@given(LATTICE)
def test_cars_that_overlap_at_the_start_are_found(points: list[tuple[int, int]]) -> None:
    poses = [Pose(x * 0.05, y * 0.05) for x, y in points]
    x_m, y_m = (np.array(values) for values in zip(*((pose.x, pose.y) for pose in poses), strict=True))
    if apart_m(x_m, y_m) > BODY_M - 1e-6:
        check_mat(open_table(poses), CLASSROOM)
    else:
        with pytest.raises(MotorcadeError, match="so move them apart"):
            check_mat(open_table(poses), CLASSROOM)


def test_near_cars_are_found_with_other_cars_at_heights_between_theirs() -> None:
    poses = [Pose(9, 0), Pose(0, 0.07), Pose(5, 0.08), Pose(0, 0.215)]
    with pytest.raises(MotorcadeError, match=r"car 3 starts at .* m from car 1"):
        check_mat(open_table(poses), CLASSROOM)


def test_the_only_car_without_room_among_many_is_named() -> None:
    crowd = mat(f"[[crowd]]\ncars = 90000\n{AREA.replace('5, 5', '75, 75')}")
    x_m, y_m = np.array(crowd.starts.x_m), np.array(crowd.starts.y_m)
    x_m[70_000] += 0.12
    starts = replace(crowd.starts, x_m=x_m)
    with pytest.raises(MotorcadeError, match=r"car 70001 of crowd\[0\] starts .* from car 70000 of crowd\[0\]"):
        check_mat(replace(crowd, starts=starts), CLASSROOM)
    wall = (float(x_m[123]), float(y_m[123]) + 0.07, float(x_m[123]) + 1e-2, float(y_m[123]) + 0.07)
    with pytest.raises(MotorcadeError, match=r"car 123 of crowd\[0\] starts .*, on wall\[0\]"):
        check_mat(replace(crowd, walls=(wall,)), CLASSROOM)


def test_cars_that_touch_do_not_overlap() -> None:
    touching = 'size_m = [2.1, 1.35]\nedge = "wall"\n[[crowd]]\ncars = 126\nspacing_m = 0.15\n'
    check_mat(mat(touching), CLASSROOM)
    # As floats 1.075 - 1 is below 0.075, and 0.6 - 0.45 below 0.15.
    against = open_table([Pose(1, 0.45), Pose(1, 0.6)])
    check_mat(replace(against, walls=((1.075, 0.0, 1.075, 1.0),)), CLASSROOM)


@settings(max_examples=60)
@given(
    cars=st.integers(1, 60),
    width_m=st.floats(0.3, 5),
    height_m=st.floats(0.3, 5),
    spacing_m=st.floats(0.15, 0.6),
    placement=st.sampled_from(["grid", "random"]),
    seed=st.integers(0, 2**32 - 1),
    data=st.data(),
)
def test_a_crowd_is_placed_apart_inside_its_area_with_its_leaders_or_has_no_room(
    cars: int, width_m: float, height_m: float, spacing_m: float, placement: str, seed: int, data: st.DataObject
) -> None:
    leaders = data.draw(st.integers(0, cars))
    body = (
        f"[[crowd]]\ncars = {cars}\nleaders = {leaders}\ncorner_m = [-1, 2]\nsize_m = [{width_m}, {height_m}]\n"
        f'spacing_m = {spacing_m}\nplacement = "{placement}"\nheading_deg = "random"\nseed = {seed}\n'
    )
    if cars > math.floor(width_m / spacing_m + 1e-9) * math.floor(height_m / spacing_m + 1e-9):
        with pytest.raises(MotorcadeError, match="finds room for"):
            mat(body)
        return
    starts = mat(body).starts
    x_m, y_m = np.asarray(starts.x_m), np.asarray(starts.y_m)
    assert len(starts) == cars
    assert sum(starts.leads) == leaders
    assert apart_m(x_m, y_m) > spacing_m - 1e-9
    margin_m = spacing_m / 2 - 1e-9
    assert x_m.min() >= -1 + margin_m
    assert x_m.max() <= -1 + width_m - margin_m
    assert y_m.min() >= 2 + margin_m
    assert y_m.max() <= 2 + height_m - margin_m
    assert mat(body).starts == starts


def test_a_random_crowd_depends_on_its_seed_and_never_changes() -> None:
    body = f'[[crowd]]\ncars = 40\nleaders = 7\nplacement = "random"\nheading_deg = "random"\n{AREA}'
    one, other = mat(body + "seed = 1").starts, mat(body + "seed = 2").starts
    assert not np.allclose(one.x_m, other.x_m)
    assert len(set(one.heading)) == 40
    # Fixed values: recordings must not change with a new version of any library.
    assert np.round([one.x_m[0], one.y_m[0], one.heading[0]], 6).tolist() == [0.189664, 0.137169, 2.450491]
    assert one.leaders == [6, 8, 15, 19, 24, 29, 38]


def test_a_crowd_keeps_clear_of_what_stands_there_and_of_single_cars() -> None:
    for placement in ("grid", "random"):
        crowd = mat(
            f'[[crowd]]\ncars = 200\nplacement = "{placement}"\n{AREA}[[disc]]\ncentre_m = [1, 1]\nradius_m = 0.5\n'
            "[[wall]]\nfrom_m = [0, 3]\nto_m = [5, 3]\n[[polygon]]\ncorners_m = [[3, 1], [4, 1], [4, 2]]\n"
            "[[car]]\nat_m = [0.2, 0.2]\n"
        )
        check_mat(crowd, CLASSROOM)
        x_m, y_m = np.asarray(crowd.starts.x_m), np.asarray(crowd.starts.y_m)
        assert apart_m(x_m, y_m) > 0.25 - 1e-9
        assert np.hypot(x_m[1:] - 1, y_m[1:] - 1).min() > 0.5 + 0.125 - 1e-9
        assert abs(y_m[1:] - 3).min() > 0.125 - 1e-9


def is_clear(x: float, y: float, clearance_m: float, there: Mat) -> bool:
    """Whether a point is farther than a clearance from everything that stands there, by plain formulas."""
    for corners in ((wall[:2], wall[2:]) for wall in there.walls):
        if from_segment_m(x, y, *corners) < clearance_m:
            return False
    if any(math.hypot(x - disc_x, y - disc_y) < radius + clearance_m for disc_x, disc_y, radius in there.discs):
        return False
    for corners in there.polygons:
        sides = list(zip(corners, (*corners[1:], corners[0]), strict=True))
        if any(from_segment_m(x, y, *side) < clearance_m for side in sides):
            return False
        # The angles under which a point inside sees the sides make a full turn.
        angles = (cmath.phase(complex(bx - x, by - y) / complex(ax - x, ay - y)) for (ax, ay), (bx, by) in sides)
        if abs(sum(angles)) > math.pi:
            return False
    return True


def from_segment_m(x: float, y: float, begin: tuple[float, float], end: tuple[float, float]) -> float:
    along, to = complex(*end) - complex(*begin), complex(x, y) - complex(*begin)
    part = min(max((to * along.conjugate()).real / abs(along) ** 2, 0), 1)
    return abs(to - part * along)


@st.composite
def outlines(draw: st.DrawFn) -> list[list[float]]:
    """The corners of a polygon that goes once round its middle."""
    middle = complex(draw(st.integers(0, 40)), draw(st.integers(0, 40))) / 8
    count = draw(st.integers(3, 12))
    away = draw(st.lists(st.integers(2, 20).map(lambda length: length / 8), min_size=count, max_size=count))
    corners = [middle + cmath.rect(far, math.tau * (k + 0.1) / count) for k, far in enumerate(away)]
    return [[corner.real, corner.imag] for corner in corners]


@settings(max_examples=60)
@given(
    st.lists(st.lists(st.integers(-8, 48).map(lambda n: n / 8), min_size=4, max_size=4, unique=True), max_size=4),
    st.lists(st.tuples(*[st.integers(-8, 48).map(lambda n: n / 8)] * 2, st.sampled_from([0.01, 0.3, 2])), max_size=2),
    st.lists(outlines(), max_size=2),
)
def test_a_crowd_in_rows_takes_each_place_that_is_free_and_a_car_elsewhere_is_refused(
    walls: list[list[float]], discs: list[tuple[float, float, float]], polygons: list[list[list[float]]]
) -> None:
    body = "".join(f"[[wall]]\nfrom_m = {wall[:2]}\nto_m = {wall[2:]}\n" for wall in walls)
    body += "".join(f"[[disc]]\ncentre_m = [{x}, {y}]\nradius_m = {radius}\n" for x, y, radius in discs)
    body += "".join(f"[[polygon]]\ncorners_m = {corners}\n" for corners in polygons)
    there = mat(body)
    places = [((column + 0.5) * 0.31, (row + 0.5) * 0.31) for row in range(16) for column in range(16)]
    free = [place for place in places if is_clear(*place, 0.155, there)]
    crowd = f"{body}[[crowd]]\nspacing_m = 0.31\n{AREA}cars = "
    with pytest.raises(MotorcadeError, match=f"finds room for {len(free)} of its 300 cars"):
        mat(f"{crowd}300\n")
    if free:
        taken = mat(f"{crowd}{len(free)}\n").starts
        assert np.allclose(np.stack([taken.x_m, taken.y_m], axis=1), free, atol=1e-9, rtol=0)
    standing = [place for place in places if is_clear(*place, BODY_M / 2, there)]
    for poses, has_room in ((standing, True), (places, len(standing) == len(places))):
        cars = replace(there, starts=open_table([Pose(x, y) for x, y in poses]).starts)
        if poses and has_room:
            check_mat(cars, CLASSROOM)
        elif poses:
            first = next(car for car, place in enumerate(places) if place not in standing)
            with pytest.raises(MotorcadeError, match=r"car \d+ starts at .*, on (wall|disc|polygon)\[") as caught:
                check_mat(cars, CLASSROOM)
            assert int(caught.value.details["car"].details["number"]) >= first


WIDE = "size_m = [2000, 2000]\n"
FINE = "[[crowd]]\ncars = 2000\nspacing_m = 0.01\n"
COVERED = "[[polygon]]\ncorners_m = [[0, 0], [2000, 0], [2000, 2000], [0, 2000]]\n"


def test_a_crowd_in_a_huge_area_without_room_costs_little_memory() -> None:
    """16 million places of 1 cm once took 2 GB."""
    resource = pytest.importorskip("resource")
    for placement in ("grid", "random"):
        with pytest.raises(MotorcadeError, match="finds room for 0 of its 2000 cars"):
            mat(f'{WIDE}{FINE}placement = "{placement}"\n{COVERED}')
    most_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert most_kb < 1.5e6 * (1024 if sys.platform == "darwin" else 1)


@pytest.mark.parametrize(
    "body",
    [
        f'{WIDE}{FINE}placement = "random"\n{COVERED}'
        + "".join(f"[[wall]]\nfrom_m = [{k}, 0]\nto_m = [{k + 0.5}, 2000]\n" for k in range(1000)),
        WIDE + "".join(f"{FINE}seed = {k}\n" for k in range(40)),
    ],
    ids=["many long walls", "many wide crowds"],
)
def test_what_takes_too_long_to_place_is_refused(body: str) -> None:
    with pytest.raises(MotorcadeError, match="are too many, or reach too far, to be checked in a few seconds"):
        mat(body)


def test_polygons_with_too_many_long_sides_beside_each_other_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(document, "_MOST_PAIRS", 10_000)
    teeth = [[k / 2 + 1000 * (k % 2), 1000 * (k % 2)] for k in range(96)]
    comb = f"[[polygon]]\ncorners_m = {[*teeth, [1999, 1000], [1999, -1], [-1, -1]]}\n"
    assert len(mat(comb).polygons) == 1
    with pytest.raises(MotorcadeError, match=r"polygon\[2\].corners_m and the polygons before it have too many"):
        mat(comb * 3)


@pytest.mark.parametrize(("placement", "off_m"), [("grid", 1e-9), ("random", 0.3)])
def test_leaders_are_apart_and_in_the_middle_of_equal_parts_of_the_crowd(placement: str, off_m: float) -> None:
    for leaders in (3, 16, 17, 22, 28):
        starts = mat(f'[[crowd]]\ncars = 400\nleaders = {leaders}\nplacement = "{placement}"\n{AREA}').starts
        x_m, y_m = np.asarray(starts.x_m)[starts.leaders], np.asarray(starts.y_m)[starts.leaders]
        assert apart_m(x_m, y_m) > 0.6 * math.sqrt(25 / leaders)
        if leaders == 16:
            assert len({*zip((x_m // 1.25).tolist(), (y_m // 1.25).tolist(), strict=True)}) == 16
            assert np.abs(np.mod([x_m, y_m], 1.25) - 0.625).max() <= off_m
