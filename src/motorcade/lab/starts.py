"""Where the cars of an environment start, in an episode that has places of its own."""

import math
from functools import partial
from typing import Any

import numpy as np

from motorcade.config.arguments import not_allowed, to_list, to_number
from motorcade.config.profile import Profile
from motorcade.errors import MotorcadeError, Phrase
from motorcade.mats import Mat, Pose, Starts
from motorcade.mats.crowd import Crowd, place_crowd
from motorcade.mats.geometry import Budget, SweepLine

# On a mat without a size, cars start at most so far outside of where the mat has them.
_AROUND_M = 0.5
# Between two bodies, and between a body and a wall.
_APART_M = 0.01


def starts_of(places: Any, mat: Mat) -> Starts:
    """Return the places that Python code gives all cars of a mat. Raises MotorcadeError: they are none."""
    poses = [_pose_of(place) for place in to_list("places", places)]
    if len(poses) != len(mat.starts):
        raise MotorcadeError("places-differ-from-cars", cars=len(mat.starts), worlds=1)
    return Starts.of(poses, mat.starts.leads)


def _pose_of(place: Any) -> Pose:
    """A Pose, or x, y and, unless it is 0, heading."""
    numbers = [place.x, place.y, place.heading] if isinstance(place, Pose) else to_list("places", place)
    if len(numbers) not in (2, 3):
        raise not_allowed("places", place, Phrase("places-of-cars"))
    return Pose(*(to_number("places", number, -math.inf, math.inf) for number in numbers))


def random_starts(mat: Mat, profile: Profile, seed: int) -> Starts:
    """Return places at random for all cars of a mat: on all of it, or around its starts where it has no size.

    Raises MotorcadeError: there is no room for all of them.
    """
    starts = mat.starts
    low = (0.0, 0.0)
    size = mat.size_m
    if size is None:
        low = min(starts.x_m) - _AROUND_M, min(starts.y_m) - _AROUND_M
        size = max(starts.x_m) + _AROUND_M - low[0], max(starts.y_m) + _AROUND_M - low[1]
    apart_m = profile.body.diameter_mm / 1000 + _APART_M
    file = Phrase("mat-named", name=mat.name)
    budget = Budget(len(starts), file)
    crowd = Crowd(file, "random_starts", len(starts), 0, low, size, apart_m, "random", "random", seed)
    x_m, y_m, heading, _ = place_crowd(crowd, partial(SweepLine, mat, apart_m / 2, budget), budget)
    # A crowd stands in the order of rows.
    order = np.random.RandomState(seed).permutation(len(starts)).tolist()
    poses = [Pose(x_m[place], y_m[place], heading[place]) for place in order]
    return Starts.of(poses, starts.leads)
