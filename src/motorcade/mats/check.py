"""Checks a mat for the cars of one profile: whether each of them has room where it starts."""

from typing import Any

import numpy as np

from motorcade.config.profile import Profile
from motorcade.engine.errors import MatError
from motorcade.mats.document import document_of
from motorcade.mats.model import Mat
from motorcade.mats.nearness import close_pair, obstructed
from motorcade.mats.outlines import check_outlines
from motorcade.mats.schema import FARTHEST_M
from motorcade.mats.shape import check_shape

# The simulator keeps whole micrometres.
_ROUNDING_M = 1e-6


def check_mat(mat: Mat, profile: Profile) -> None:
    """Check all of ``mat``, read from a file or built in Python, for cars of ``profile``.

    Raises:
        MatError: something on it can't be, or a car starts over the mat's edge, in an obstacle or
            in another car; the sentence names the place and what to do.
    """
    check_shape(document_of(mat), mat.name)
    check_outlines(mat, mat.name)
    starts = mat.starts
    if not len(starts):
        raise MatError("no-cars", mat=mat.name)
    for name, values, most in (
        ({"en": "x", "zh": " x "}, starts.x_m, FARTHEST_M),
        ({"en": "y", "zh": " y "}, starts.y_m, FARTHEST_M),
        ({"en": "heading", "zh": "朝向"}, starts.heading, 1e6),
    ):
        wrong = np.flatnonzero(~(np.abs(values) <= most))
        if wrong.size:
            car = int(wrong[0])
            figures = {"name": name, "value": values[car], "most": most}
            raise MatError("start-out-of-range", mat=mat.name, who=_who(mat, car), **figures)
    _check_room(mat, profile.body.diameter_mm / 1000)


def _check_room(mat: Mat, diameter_m: float) -> None:
    x_m, y_m = mat.starts.x_m, mat.starts.y_m
    clearance_m = diameter_m / 2 - _ROUNDING_M
    if mat.walled and mat.size_m is not None:
        width, height = mat.size_m
        over = np.minimum(np.minimum(x_m, width - x_m), np.minimum(y_m, height - y_m)) < clearance_m
        if over.any():
            car = int(np.argmax(over))
            raise MatError("over-the-edge", **_start(mat, car), diameter=diameter_m, inside=diameter_m / 2)
    for place, cars in obstructed(x_m, y_m, clearance_m, mat.walls, mat.discs, mat.polygons):
        raise MatError("on-something", **_start(mat, int(cars.min())), diameter=diameter_m, place=place)
    if pair := close_pair(x_m, y_m, diameter_m - _ROUNDING_M):
        one, other = pair
        apart_m = float(np.hypot(x_m[one] - x_m[other], y_m[one] - y_m[other]))
        raise MatError("too-close", **_start(mat, other), diameter=diameter_m, apart=apart_m, other=_who(mat, one))


def _start(mat: Mat, car: int) -> dict[str, Any]:
    """The figures of a sentence about where a car starts."""
    return {"mat": mat.name, "who": _who(mat, car), "x": mat.starts.x_m[car], "y": mat.starts.y_m[car]}


def _who(mat: Mat, car: int) -> dict[str, str]:
    """A car by its place in the file, or by its number; in each language."""
    first = 0
    for place, count in mat.starts.groups:
        if car < first + count:
            if count == 1:
                return {"en": place, "zh": f" {place} "}
            return {"en": f"car {car - first} of {place}", "zh": f" {place} 的小车 {car - first} "}
        first += count
    return {"en": f"car {car}", "zh": f"小车 {car} "}
