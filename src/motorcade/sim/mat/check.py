"""Checks a mat for the cars of one profile: whether each of them has room where it starts."""

import numpy as np

from motorcade.profile import Profile
from motorcade.sim.errors import MatError
from motorcade.sim.mat.document import document_of
from motorcade.sim.mat.model import Mat
from motorcade.sim.mat.nearness import close_pair, obstructed
from motorcade.sim.mat.outlines import check_outlines
from motorcade.sim.mat.schema import FARTHEST_M
from motorcade.sim.mat.shape import check_shape

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
        raise MatError(f"mat {mat.name}: there are no cars; add a [[car]] or a [[crowd]]")
    for name, values, most in (
        ("x", starts.x_m, FARTHEST_M),
        ("y", starts.y_m, FARTHEST_M),
        ("heading", starts.heading, 1e6),
    ):
        wrong = np.flatnonzero(~(np.abs(values) <= most))
        if wrong.size:
            car = int(wrong[0])
            raise MatError(
                f"mat {mat.name}: the {name} of {_who(mat, car)} is {values[car]:g}; allowed: -{most:g} to {most:g}"
            )
    _check_room(mat, profile.body.diameter_mm / 1000)


def _check_room(mat: Mat, diameter_m: float) -> None:
    x_m, y_m = mat.starts.x_m, mat.starts.y_m
    clearance_m = diameter_m / 2 - _ROUNDING_M
    about = f"a car's body is {diameter_m:g} m across"
    if mat.walled and mat.size_m is not None:
        width, height = mat.size_m
        over = np.minimum(np.minimum(x_m, width - x_m), np.minimum(y_m, height - y_m)) < clearance_m
        if over.any():
            where = _where(mat, int(np.argmax(over)))
            raise MatError(
                f"mat {mat.name}: {where}, over the mat's edge; {about}, so keep its centre {diameter_m / 2:g} m inside"
            )
    for place, cars in obstructed(x_m, y_m, clearance_m, mat.walls, mat.discs, mat.polygons):
        raise MatError(f"mat {mat.name}: {_where(mat, int(cars.min()))}, on {place}; {about}, so move one of them")
    if pair := close_pair(x_m, y_m, diameter_m - _ROUNDING_M):
        one, other = pair
        apart_m = float(np.hypot(x_m[one] - x_m[other], y_m[one] - y_m[other]))
        raise MatError(
            f"mat {mat.name}: {_where(mat, other)}, {apart_m:g} m from {_who(mat, one)}; {about}, so move them "
            "apart, or give a crowd more spacing_m"
        )


def _where(mat: Mat, car: int) -> str:
    return f"{_who(mat, car)} starts at [{mat.starts.x_m[car]:g}, {mat.starts.y_m[car]:g}]"


def _who(mat: Mat, car: int) -> str:
    """A car by its place in the file, or by its number."""
    first = 0
    for place, count in mat.starts.groups:
        if car < first + count:
            return place if count == 1 else f"car {car - first} of {place}"
        first += count
    return f"car {car}"
