"""Compare plane geometry with the definitions: angles, and many points of each figure."""

import math
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from motorcade.engine.geometry import (
    COSINES,
    FAR_UM,
    FULL_TURN,
    MOST_NORMAL,
    NORMALS,
    cosine,
    cross,
    disc_to_cone,
    is_shaded,
    mix,
    nearest_of_segment,
    segment_in_cone,
    sine,
    to_heading,
)

# Whole µm, as in the simulator, within a mat of 20 m.
LENGTH = st.integers(-10_000_000, 10_000_000).map(float)
POINT = st.tuples(LENGTH, LENGTH)
RADIUS = st.integers(1, 2_000_000).map(float)
HALF_CONE = st.integers(1, 89).map(math.radians)
PARTS = np.linspace(0, 1, 4001)


def way(a: tuple[float, float], b: tuple[float, float]) -> float:
    return math.dist(a, b)


def from_segment(point: tuple[float, float], a: tuple[float, float], b: tuple[float, float]) -> float:
    """The distance of a point from a segment: from an end, or by the sine of an angle where it stands beside it."""
    at_a = math.atan2(point[1] - a[1], point[0] - a[0]) - math.atan2(b[1] - a[1], b[0] - a[0])
    at_b = math.atan2(point[1] - b[1], point[0] - b[0]) - math.atan2(a[1] - b[1], a[0] - b[0])
    if math.cos(at_a) <= 0 or math.cos(at_b) <= 0:
        return min(way(point, a), way(point, b))
    return abs(way(point, a) * math.sin(at_a))


# Angles


@given(st.integers(-FULL_TURN, 2 * FULL_TURN))
@example(FULL_TURN - 1)
def test_cosine_and_sine_are_those_of_the_angle(heading: int) -> None:
    angle = heading / FULL_TURN * math.tau
    assert cosine(heading, COSINES) == pytest.approx(math.cos(angle), abs=3e-7)
    assert sine(heading, COSINES) == pytest.approx(math.sin(angle), abs=3e-7)


def test_quarters_of_a_turn_are_exact() -> None:
    quarters = [round(to_heading(turns * math.tau)) for turns in (0, 0.25, 0.5, 0.75, 1, -0.25)]
    assert [cosine(heading, COSINES) for heading in quarters] == [1, 0, -1, 0, 1, 0]
    assert [sine(heading, COSINES) for heading in quarters] == [0, 1, 0, -1, 0, -1]


# Segments


@given(POINT, POINT, POINT)
@example((3.0, 4.0), (0.0, 0.0), (0.0, 0.0))
def test_no_point_of_a_segment_is_nearer_than_the_nearest_point(
    point: tuple[float, float], a: tuple[float, float], b: tuple[float, float]
) -> None:
    nearest = nearest_of_segment(*point, *a, *b)
    assert way(a, nearest) + way(nearest, b) == pytest.approx(way(a, b), abs=1e-3)
    each = np.hypot(a[0] + PARTS * (b[0] - a[0]) - point[0], a[1] + PARTS * (b[1] - a[1]) - point[1])
    assert way(point, nearest) <= each.min() + 1e-3
    if a != b:
        assert way(point, nearest) == pytest.approx(from_segment(point, a, b), abs=1e-2)


@given(POINT, POINT, POINT, RADIUS)
@example((0.0, 0.0), (10.0, 0.0), (13.0, 0.0), 4.0)
@example((0.0, 0.0), (10.0, 0.0), (-3.0, 0.0), 4.0)
@example((0.0, 0.0), (0.0, 0.0), (3.0, 0.0), 4.0)
def test_a_disc_shades_lines_that_pass_nearer_than_its_radius(
    a: tuple[float, float], b: tuple[float, float], disc: tuple[float, float], radius: float
) -> None:
    away = way(disc, a) if a == b else from_segment(disc, a, b)
    assume(abs(away - radius) > 0.1)
    assert is_shaded(*a, *b, *disc, radius) == (away < radius)


SMALL = st.tuples(st.integers(-9, 9), st.integers(-9, 9))


@given(SMALL, SMALL, SMALL, SMALL)
def test_a_wall_is_crossed_where_both_lines_meet_between_their_ends(
    a: tuple[int, int], b: tuple[int, int], c: tuple[int, int], d: tuple[int, int]
) -> None:
    along, wall = (b[0] - a[0], b[1] - a[1]), (d[0] - c[0], d[1] - c[1])
    turn = along[0] * wall[1] - along[1] * wall[0]
    assume(turn)
    to = c[0] - a[0], c[1] - a[1]
    on_line = Fraction(to[0] * wall[1] - to[1] * wall[0], turn)
    on_wall = Fraction(to[0] * along[1] - to[1] * along[0], turn)
    # What only touches an end may count as either.
    assume(not {on_line, on_wall} & {0, 1})
    meets = 0 < on_line < 1 and 0 < on_wall < 1
    assert cross(*map(float, (*a, *b, *c, *d))) == meets


# The ultrasonic sensor's cone, its tip at the origin, looking along x


@given(POINT, RADIUS, HALF_CONE)
def test_a_disc_is_seen_that_touches_the_cone(at: tuple[float, float], radius: float, half: float) -> None:
    away = math.hypot(*at)
    distance, outside = disc_to_cone(*at, radius, math.cos(half), math.sin(half))
    assert distance == pytest.approx(away - radius)
    if away <= radius:
        assert outside <= 0
        return
    beside = abs(math.atan2(at[1], at[0])) - half - math.asin(radius / away)
    assume(abs(beside) > 1e-6)
    assert (outside <= 0) == (beside < 0)


@given(POINT, POINT, RADIUS, HALF_CONE)
def test_a_disc_leaves_the_cone_no_sooner_than_it_has_moved_so_far(
    here: tuple[float, float], there: tuple[float, float], radius: float, half: float
) -> None:
    """A car goes on to be seen, or not, while it can't have moved farther than that."""
    outside = [disc_to_cone(*at, radius, math.cos(half), math.sin(half))[1] for at in (here, there)]
    assert abs(outside[0] - outside[1]) <= math.dist(here, there) + 1e-3


@given(POINT, POINT, HALF_CONE)
@example((-1000.0, 50.0), (1000.0, 50.0), 0.2)
@example((1000.0, -500.0), (1000.0, 500.0), 0.2)
@example((-1000.0, -500.0), (-1000.0, 500.0), 0.2)
def test_a_wall_is_seen_where_it_is_within_the_cone_and_nearest(
    a: tuple[float, float], b: tuple[float, float], half: float
) -> None:
    seen = segment_in_cone(*a, *b, math.cos(half), math.sin(half))
    x, y = a[0] + PARTS * (b[0] - a[0]), a[1] + PARTS * (b[1] - a[1])
    inside = np.abs(np.arctan2(y, x)) < half - 1e-9
    step = way(a, b) * PARTS[1]
    if inside.any():
        nearest = np.hypot(x, y)[inside].min()
        assert nearest - step - 1e-3 <= seen <= nearest + 1e-3
    elif seen < FAR_UM:
        # It may pass through the tip of the cone between two of the points.
        assert np.abs(np.abs(np.arctan2(y, x)) - half).min() <= 2 * math.atan2(step, max(seen, 1e-9))


# Dice


@pytest.mark.parametrize("which", ["seed", "number", "moment"])
def test_each_bit_of_a_draw_is_one_half_of_the_time(which: str) -> None:
    at = {"seed": 5, "number": 6, "moment": 7}
    draws = np.array([mix(**{**at, which: count}) for count in range(20_000)], np.uint64)
    ones = (draws[:, None] >> np.arange(32, dtype=np.uint64) & 1).mean(axis=0)
    # Five standard deviations, for 32 bits.
    assert np.abs(ones - 0.5).max() < 5 * 0.5 / math.sqrt(len(draws))
    for low in (0, 8, 16, 24):
        counts = np.bincount((draws >> low & 255).astype(np.int64), minlength=256)
        chi_squared = float(((counts - len(draws) / 256) ** 2).sum() / (len(draws) / 256))
        assert abs(chi_squared - 255) < 5 * math.sqrt(2 * 255)


@pytest.mark.parametrize("which", ["seed", "number", "moment"])
def test_neighbours_draw_independently(which: str) -> None:
    at = {"seed": 5, "number": 6, "moment": 7}
    draws = [mix(**{**at, which: count * 20}) for count in range(10_000)]
    changed = np.array([(one ^ other).bit_count() for one, other in pairwise(draws)])
    assert abs(changed.mean() - 16) < 5 * math.sqrt(8 / len(changed))
    assert abs(changed.var() - 8) < 1


def test_normal_draws_have_the_mean_0_and_the_deviation_1() -> None:
    normals = np.asarray(NORMALS)
    assert normals.mean() == pytest.approx(0, abs=1e-6)
    assert normals.std() == pytest.approx(1, abs=2e-3)
    assert np.abs(normals).max() <= MOST_NORMAL
