"""The scenario for benchmarks of roads: rings of road side by side, and cars that follow them."""

import math
from itertools import pairwise

from motorcade.mats import Mat, Pose
from motorcade.mats.model import Line, Starts, path_of
from motorcade.program.compiler import compile_program
from motorcade.program.model import Followers, Program
from motorcade.program.steps import follow_line, led, together

CARS_OF_RING = 10
RING_M = 2.4, 1.6  # the outer size of a ring
BEND_M = 0.4
BETWEEN_M = 0.4  # rings
CARS_OF_LEADER = 10


def road_programs() -> list[bytes]:
    """An image for the leaders, one in each ring: all follow their ring, equally fast, and pass their word on."""
    words = [together(follow_line(3), led(3, k), forward=True) for k in range(3)]
    return [compile_program(Program([follow_line(3)], Followers(words))).image]


def road_mat(cars: int) -> Mat:
    """As many rings as ``cars`` need, with the cars at equal distances on them."""
    rings = math.ceil(cars / CARS_OF_RING)
    columns = math.ceil(math.sqrt(rings))
    wide, high = RING_M
    lines: list[Line] = []
    poses: list[Pose] = []
    for ring in range(rings):
        x, y = ring % columns * (wide + BETWEEN_M), ring // columns * (high + BETWEEN_M)
        corners = (x, y), (x + wide, y), (x + wide, y + high), (x, y + high)
        lines.append(Line(corners, bend_m=BEND_M, closed=True))
        poses += _places(path_of(lines[-1]), min(CARS_OF_RING, cars - len(poses)))
    leads = [number % CARS_OF_LEADER == 0 for number in range(cars)]
    return Mat("roads", Starts.of(poses, leads), 20, lines=tuple(lines))


def _places(way: list[tuple[float, float]], count: int) -> list[Pose]:
    """``count`` places at equal distances along a closed way, headed along it."""
    lengths = [math.dist(here, there) for here, there in pairwise(way)]
    places, at, passed = [], 0, 0.0
    for k in range(count):
        wanted = sum(lengths) * k / count
        while passed + lengths[at] < wanted:
            passed += lengths[at]
            at += 1
        (x0, y0), (x1, y1) = way[at], way[at + 1]
        part = (wanted - passed) / lengths[at]
        places.append(Pose(x0 + part * (x1 - x0), y0 + part * (y1 - y0), math.atan2(y1 - y0, x1 - x0)))
    return places
