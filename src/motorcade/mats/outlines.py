"""What must hold of walls, obstacles, paths and voices whatever the cars: lengths, areas, times that rise."""

import numpy as np
from numpy.typing import NDArray

from motorcade.engine.errors import MatError
from motorcade.mats.model import Corners, Mat
from motorcade.mats.schema import SHORTEST_M

_SMALLEST_M2 = SHORTEST_M * SHORTEST_M
_SHORTEST_S = 0.001


def check_outlines(mat: Mat, called: str) -> None:
    """Raises MatError, about the mat called ``called``, where a wall, an obstacle or a path can't be."""
    if mat.walled and mat.size_m is None:
        raise MatError("edge-without-size", mat=called)
    for number, (x0, y0, x1, y1) in enumerate(mat.walls):
        if (x1 - x0) ** 2 + (y1 - y0) ** 2 < _SMALLEST_M2:
            raise MatError("no-length", mat=called, place=f"wall[{number}]")
    for number, corners in enumerate(mat.polygons):
        if problem := _problem_of(corners):
            code, sides = problem
            raise MatError(code, mat=called, place=f"polygon[{number}].corners_m", **sides)
    for number, person in enumerate(mat.people):
        place = f"person[{number}].path"
        times = [t_s for t_s, _, _ in person.path]
        if times[0] != 0:
            raise MatError("late-begin", mat=called, place=f"{place}[0]", time=times[0])
        for step in range(1, len(times)):
            if times[step] - times[step - 1] < _SHORTEST_S * (1 - 1e-6):
                figures = {"time": times[step], "before": times[step - 1]}
                raise MatError("times-not-rising", mat=called, place=f"{place}[{step}]", **figures)


def _problem_of(corners: Corners) -> tuple[str, dict[str, int]] | None:
    """What is wrong with a polygon: its code, and the two corners or sides that are."""
    points = np.array(corners)
    nexts = np.roll(points, -1, axis=0)
    short = np.flatnonzero(((nexts - points) ** 2).sum(axis=1) < _SMALLEST_M2)
    if short.size:
        return "same-corners", {"one": int(short[0]), "other": (int(short[0]) + 1) % len(corners)}
    if np.abs(_turn(points[0], points, nexts)).sum() / 2 < _SMALLEST_M2:
        return "flat", {}
    if crossing := _crossing(points, nexts):
        one, other = crossing
        return "crossing", {"one": one, "other": other}
    return None


def _crossing(begins: NDArray[np.float64], ends: NDArray[np.float64]) -> tuple[int, int] | None:
    """Two sides of a polygon that meet elsewhere than at the corner they share; side k begins at corner k."""
    count = len(begins)
    for side in range(count):
        begin, end = begins[side], ends[side]
        following = (side + 1) % count
        if _turn(begin, end, ends[following]) == 0 and np.dot(end - begin, ends[following] - end) < 0:
            return side, following
        others = np.arange(side + 2, count if side else count - 1)
        if hits := others[_meet(begin, end, begins[others], ends[others])].tolist():
            return side, hits[0]
    return None


def _meet(
    a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64], d: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Whether the segment from ``a`` to ``b`` meets each of those from ``c`` to ``d``, at an end too."""
    boxes = (np.minimum(a, b) <= np.maximum(c, d)) & (np.minimum(c, d) <= np.maximum(a, b))
    apart = np.sign(_turn(a, b, c)) * np.sign(_turn(a, b, d)) > 0
    beside = np.sign(_turn(c, d, a)) * np.sign(_turn(c, d, b)) > 0
    meet: NDArray[np.bool_] = boxes.all(axis=1) & ~apart & ~beside
    return meet


def _turn(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> NDArray[np.float64]:
    """Above 0 where the way from ``a`` over ``b`` to ``c`` turns left, 0 where it is straight."""
    ahead, onward = b - a, c - a
    turn: NDArray[np.float64] = ahead[..., 0] * onward[..., 1] - ahead[..., 1] * onward[..., 0]
    return turn
