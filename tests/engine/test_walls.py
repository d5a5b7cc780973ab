"""The lists of walls and obstacles by cell: each that can matter to a car there is listed, on every backend."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from motorcade.engine import layout
from motorcade.engine.world import open_backend
from motorcade.mats.plane import nearest_of_segment
from support.worlds import Case, cases


@settings(max_examples=25)
@given(cases(), st.lists(st.tuples(*[st.integers(-9_000_000, 9_000_000)] * 2), min_size=5, max_size=20))
def test_what_is_within_reach_of_a_point_is_in_the_list_of_its_cell(case: Case, points: list[tuple[int, int]]) -> None:
    rules = layout.rules_of(case.mat, case.profile, case.images)
    backends = [open_backend(name) for name in ("webassembly", "interpreted")]
    place, other = (layout.obstacles_of(case.mat, rules, backend) for backend in backends)
    for one, another in zip(place, other, strict=True):
        assert np.array_equal(one, another)
    walls, discs = layout.outlines_of(case.mat)
    for x, y in points:
        nearest = [math.dist((x, y), nearest_of_segment(x, y, *wall)) for wall in walls]
        nearest += [math.dist((x, y), disc[:2]) - disc[2] for disc in discs]
        column, row = (
            min(max(math.floor((at - origin) * place.frame[2]), 0), int(most) - 1)
            for at, origin, most in zip((x, y), place.frame, place.frame[3:], strict=False)
        )
        cell = row * int(place.frame[3]) + column
        listed = slice(place.first[cell], place.first[cell + 1])
        away = dict(zip(place.items[listed].tolist(), place.away[listed].tolist(), strict=True))
        assert list(away.values()) == sorted(away.values())
        for item, distance in enumerate(nearest):
            if distance <= rules.range * rules.line_of_sight:
                assert away[item] <= max(distance, 0)
