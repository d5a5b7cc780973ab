"""Where the cars of a formation stand."""

import math
from collections.abc import Iterator

import pytest

from motorcade.mats import formation


def places_in_order(followers: int, reach_m: float) -> Iterator[tuple[float, float]]:
    """Places of a grid of 0.25 m: behind the leader within its reach, then others within it, then behind it."""
    side = math.isqrt(followers) + 20
    grid = [
        (column, row) for column in range(-side, side + 1) for row in range(-side, side + 1) if (column, row) != (0, 0)
    ]

    def order(place: tuple[int, int]) -> tuple[bool, bool, int, int, int]:
        column, row = place
        return math.hypot(*place) * 0.25 > reach_m, column >= 0, column**2 + row**2, column, -row

    return ((column * 0.25, row * 0.25) for column, row in sorted(grid, key=order)[:followers])


@pytest.mark.parametrize("reach_m", [0, 0.2, 0.25, 1.0, 3.7, 1000.0])
def test_followers_stand_as_near_to_the_leader_as_they_can(reach_m: float) -> None:
    for followers in (0, 1, 2, 5, 11, 60, 500):
        leader, *others = [(pose.x, pose.y) for pose in formation(followers, reach_m)]
        assert leader == (0, 0)
        assert others == list(places_in_order(followers, reach_m))


def test_a_formation_of_a_million_cars() -> None:
    """Each place alone took so long that this would take minutes."""
    poses = formation(1_000_000)
    assert len({(pose.x, pose.y) for pose in poses}) == 1_000_001
    assert max(math.hypot(pose.x, pose.y) for pose in poses) < 0.25 * 802
