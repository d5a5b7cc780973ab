"""Cars follow lines, turn to them and stop on dark floor in the engine; marks are where their geometry says."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade import Mat, Pose, Program, compile_program, dark, follow_line, forward, turn_left_to_line, wander
from motorcade.engine.floor import floor_of, marks_of, outside_um
from motorcade.engine.world import World
from motorcade.errors import MotorcadeError
from motorcade.mats.model import Line, Physics, Starts, path_of
from support.plain_senses import is_dark
from support.worlds import digest, lines

ROUND = [k * math.tau / 120 for k in range(120)]
ROADS = {
    "oval": (Line(tuple((0.9 * math.cos(a), 0.55 * math.sin(a)) for a in ROUND), closed=True), 11),
    "eight": (Line(tuple((0.9 * math.sin(a), 0.5 * math.sin(2 * a)) for a in ROUND), closed=True), 11),
    "stadium": (Line(((-0.95, -0.35), (0.95, -0.35), (0.95, 0.35), (-0.95, 0.35)), bend_m=0.35, closed=True), 11),
    "right angles": (Line(((-0.6, -0.6), (0.6, -0.6), (0.6, 0.6), (-0.6, 0.6)), closed=True), 34),
}
POINTS = st.tuples(st.integers(-2000, 2000), st.integers(-2000, 2000)).map(lambda mm: (mm[0] / 1000, mm[1] / 1000))


def off_mm(x, y, way):
    """How far a place is from a way."""
    nearest = math.inf
    for (ax, ay), (bx, by) in pairwise(way):
        along_x, along_y = bx - ax, by - ay
        length = along_x * along_x + along_y * along_y
        part = min(max(((x - ax) * along_x + (y - ay) * along_y) / length, 0), 1) if length else 0
        nearest = min(nearest, math.hypot(x - ax - part * along_x, y - ay - part * along_y))
    return nearest * 1000


def world_of(pose, program, **marks):
    mat = Mat("floor", Starts.of([pose], [True]), 20, **marks)
    return World(mat, [compile_program(Program([program])).image], seeds=1)


@pytest.mark.parametrize("speed", [1, 3])
@pytest.mark.parametrize(("line", "most_mm"), ROADS.values(), ids=list(ROADS))
def test_a_car_keeps_to_its_line_with_noisy_wheels(line, most_mm, speed):
    way = path_of(line)
    (x0, y0), (x1, y1) = way[0], way[1]
    pose = Pose(x0, y0, math.atan2(y1 - y0, x1 - x0))
    world = world_of(pose, follow_line(3, speed=speed), lines=(line,), physics=Physics(wheel_noise=0.05))
    travelled_m, last = 0.0, (x0, y0)
    for _ in range(600):
        world.run(60)
        here = (float(world.snapshot().x_m[0]), float(world.snapshot().y_m[0]))
        assert off_mm(*here, way) <= most_mm
        travelled_m += math.dist(last, here)
        last = here
    # It is on its way for most of the time.
    assert travelled_m > 0.6 * speed * 0.1 * 36


def test_without_the_bit_a_car_leaves_the_line():
    line, most_mm = ROADS["stadium"]
    way = path_of(line)
    world = world_of(Pose(*way[0]), forward(3), lines=(line,))
    world.run(30_000)
    assert off_mm(float(world.snapshot().x_m[0]), float(world.snapshot().y_m[0]), way) > 10 * most_mm


def test_a_car_stops_at_one_of_ten_thousand_marks_where_single_ticks_bring_it():
    spots = tuple((0.1 * (number % 100), 0.1 * (number // 100), 0.02) for number in range(10_000))
    at_once, stepped = (world_of(Pose(5, 5.25, 0.02), wander(20, unless=dark()), spots=spots) for _ in range(2))
    at_once.run(8000)
    for _ in range(400):
        stepped.step()
    # It has driven, and stands.
    assert at_once.snapshot().x_m[0] > 5.3
    assert at_once.snapshot().wheels[0] == 0
    assert digest(at_once) == digest(stepped)


def test_a_turn_ends_where_a_line_lies():
    # Ahead and behind the car there is nothing; a line lies to its left.
    world = world_of(Pose(0, 0), turn_left_to_line(3, speed=2), lines=(Line(((0.0, 0.03), (0.0, 1.0))),))
    world.run(2900)
    assert math.degrees(float(world.snapshot().heading[0])) == pytest.approx(56, abs=3)


@pytest.mark.parametrize("things", ["spots", "patches"])
def test_a_wanderer_stays_on_dark(things):
    marks = {"spots": ((0, 0, 0.5),), "patches": (((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)),)}
    cars = [Pose(x / 2, y / 2, x + y) for x in range(-2, 3) for y in range(-2, 3)]
    mat = Mat(
        "spot",
        Starts.of(cars, [True] * len(cars)),
        20,
        (4, 4),
        physics=Physics(collisions=False),
        **{things: marks[things]},
    )
    world = World(mat, [compile_program(Program([wander(3, speed=3, unless=dark())])).image], seeds=3)
    world.run(60_000)
    now = world.snapshot()
    stands = [bool(wheels & 3 == 0) for wheels in now.wheels]
    for car, is_still in enumerate(stands):
        x, y, heading = (float(column[car]) for column in (now.x_m, now.y_m, now.heading))
        ahead, aside = (math.cos(heading), math.sin(heading)), (-math.sin(heading), math.cos(heading))
        front = [
            [at + 0.06 * a + side * b for at, a, b in zip((x, y), ahead, aside, strict=True)]
            for side in (0.0225, -0.0225)
        ]
        sees = any(math.hypot(*at) < 0.5 if things == "spots" else max(map(abs, at)) < 0.5 for at in front)
        assert is_still == sees
    assert 0 < sum(stands) < len(stands)


@given(
    st.lists(lines(POINTS), max_size=3),
    st.lists(st.tuples(POINTS, st.floats(0.001, 1)), max_size=2),
    st.lists(st.lists(POINTS, min_size=3, max_size=5), max_size=2),
    st.lists(POINTS, min_size=1, max_size=20),
)
def test_a_place_is_dark_where_a_mark_is(dark_lines, spots, patches, places):
    mat = Mat(
        "any",
        Starts.of([], []),
        lines=tuple(dark_lines),
        spots=tuple((*at, radius) for at, radius in spots),
        patches=tuple(map(tuple, patches)),
    )
    floor = floor_of(mat).items
    if not len(floor):
        assert not list(marks_of(mat))
        return
    world = type("World", (), {"mat": mat})()
    for x, y in ((round(x * 1e6), round(y * 1e6)) for x, y in places):
        assert (outside_um(x, y, 0.0, 0.0, 1.0, 0.0, floor)[0] <= 0) == is_dark(world, x, y)


@given(POINTS)
def test_a_sensor_knows_of_marks_beyond_its_cell(at):
    floor = floor_of(Mat("spots", Starts.of([], []), spots=((-9.0, -9.0, 0.1), (*at, 0.1)))).items
    for angle in (k * math.tau / 8 for k in range(8)):
        x, y = at[0] + 0.15 * math.cos(angle), at[1] + 0.15 * math.sin(angle)
        assert outside_um(x * 1e6, y * 1e6, 0.0, 0.0, 1.0, 0.0, floor)[0] == pytest.approx(50_000, abs=2)


@pytest.mark.parametrize(
    ("x", "y", "outside_mm"),
    [
        (-30, -40, 50),
        (1030, -40, 50),
        (1030, 1040, 50),
        (-30, 1040, 50),
        (500, -20, 20),
        (1010, 500, 10),
        (500, 980, -20),
    ],
)
def test_a_place_is_as_far_from_a_patch_as_its_nearest_edge(x, y, outside_mm):
    floor = floor_of(Mat("patch", Starts.of([], []), patches=(((0, 0), (1, 0), (1, 1), (0, 1)),))).items
    assert outside_um(x * 1000.0, y * 1000.0, 0.0, 0.0, 1.0, 0.0, floor)[0] == pytest.approx(outside_mm * 1000)


@given(lines(POINTS))
def test_a_way_keeps_to_its_points_and_its_bends(line):
    way = path_of(line)
    assert all(math.isfinite(each) for point in way for each in point)
    if line.closed and len(line.points_m) > 2:
        assert way[0] == way[-1]
    else:
        assert (way[0], way[-1]) == (line.points_m[0], line.points_m[-1])
    corners = list(line.points_m) + [line.points_m[0]] * line.closed
    assert all(off_mm(x, y, corners) <= line.bend_m * 1000 + 0.001 for x, y in way)


def test_a_floor_with_too_much_on_it_is_refused(monkeypatch):
    monkeypatch.setattr("motorcade.engine.floor._MOST_LISTED", 20_000)
    mat = Mat("dear", Starts.of([], []), spots=tuple((x, 0.0, 20.0) for x in range(10)))
    with pytest.raises(MotorcadeError, match="mat dear"):
        floor_of(mat)
