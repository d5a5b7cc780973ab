"""Plane geometry that gives the same bits on every machine.

Lengths are µm, headings binary angles: 2^32 is a full turn, counter-clockwise from the x axis. Cosines come from a
table of rounded numbers. Everything else uses only operations that IEEE 754 rounds exactly: + - * / and the square
root.
"""

import math
from array import array
from statistics import NormalDist

from motorcade.engine.backend import in_kernel
from motorcade.engine.state import Floats
from motorcade.mats.plane import nearest_of_segment

FULL_TURN = 1 << 32
QUARTER_TURN = 1 << 30
FAR_UM = 1.0e12

_TABLE_BITS = 12
_STEP_BITS = 32 - _TABLE_BITS
# COSINES[k] is the cosine of k / 2^12 of a full turn.
COSINES = array(
    "d", [round(math.cos(math.tau * k / (1 << _TABLE_BITS)) * 2**40) / 2**40 for k in range((1 << _TABLE_BITS) + 1)]
)
# 1024 equally probable values of the standard normal distribution, ascending.
NORMALS = array("d", [round(NormalDist().inv_cdf((k + 0.5) / 1024) * 2**20) / 2**20 for k in range(1024)])
# More than the largest of NORMALS.
MOST_NORMAL = 3.3


def to_heading(radians: float) -> int:
    """An angle in radians as a binary angle."""
    return round(radians / math.tau * FULL_TURN) % FULL_TURN


@in_kernel
def cosine(heading: int, cosines: Floats) -> float:
    """The cosine of a binary angle, within 3e-7; ``cosines`` is COSINES."""
    heading = int(heading) & 0xFFFFFFFF
    k = heading >> _STEP_BITS
    part = float(heading & ((1 << _STEP_BITS) - 1)) / (1 << _STEP_BITS)
    return float(cosines[k] + (cosines[k + 1] - cosines[k]) * part)


@in_kernel
def sine(heading: int, cosines: Floats) -> float:
    """The sine of a binary angle, within 3e-7."""
    return cosine(int(heading) - QUARTER_TURN, cosines)


@in_kernel
def ahead_of(heading: int, cosines: Floats) -> tuple[float, float]:
    """A step of length 1 along a binary angle: its cosine and its sine."""
    return cosine(heading, cosines), sine(heading, cosines)


@in_kernel
def is_shaded(ax: float, ay: float, bx: float, by: float, x: float, y: float, radius: float) -> bool:
    """Whether a disc about (x, y) touches the line of sight from a to b."""
    along_x = bx - ax
    along_y = by - ay
    to_x = x - ax
    to_y = y - ay
    from_x = x - bx
    from_y = y - by
    squared = along_x * along_x + along_y * along_y
    near = radius * radius
    aside = to_x * along_y - to_y * along_x
    dot = to_x * along_x + to_y * along_y
    between = (dot > 0.0) & (dot < squared) & (aside * aside < near * squared)
    return between | (to_x * to_x + to_y * to_y < near) | (from_x * from_x + from_y * from_y < near)


@in_kernel
def cross(ax: float, ay: float, bx: float, by: float, x0: float, y0: float, x1: float, y1: float) -> bool:
    """Whether the line of sight from a to b meets a segment."""
    side_0 = (bx - ax) * (y0 - ay) - (by - ay) * (x0 - ax)
    side_1 = (bx - ax) * (y1 - ay) - (by - ay) * (x1 - ax)
    side_a = (x1 - x0) * (ay - y0) - (y1 - y0) * (ax - x0)
    side_b = (x1 - x0) * (by - y0) - (y1 - y0) * (bx - x0)
    return ((side_0 > 0.0) != (side_1 > 0.0)) & ((side_a > 0.0) != (side_b > 0.0))


@in_kernel
def disc_to_cone(ahead: float, aside: float, radius: float, cone_cos: float, cone_sin: float) -> tuple[float, float]:
    """How far the surface of a disc is from the tip of a cone, and how far the disc is outside of the cone.

    Either is below 0 where the tip, or a part of the cone, is inside of the disc. The centre of the disc is ``ahead``
    along the axis of the cone and ``aside`` of it. Half of the cone's angle, given by its cosine and sine, is below a
    quarter turn.
    """
    away, aside = math.sqrt(ahead * ahead + aside * aside) - radius, abs(aside)
    beyond_edge = aside * cone_cos - ahead * cone_sin
    along_edge = ahead * cone_cos + aside * cone_sin
    return away, min(beyond_edge - radius, away) if along_edge > 0.0 else away


@in_kernel
def segment_in_cone(
    ahead_0: float, aside_0: float, ahead_1: float, aside_1: float, cone_cos: float, cone_sin: float
) -> float:
    """The distance from the tip of a cone to the part of a segment inside the cone; FAR_UM where none is inside."""
    first = 0.0
    last = 1.0
    for sign in (1.0, -1.0):
        # Below 0 on the cone's side of this edge.
        at_0 = sign * aside_0 * cone_cos - ahead_0 * cone_sin
        at_1 = sign * aside_1 * cone_cos - ahead_1 * cone_sin
        if at_0 > 0.0 and at_1 > 0.0:
            return FAR_UM
        if at_0 > 0.0:
            first = max(first, at_0 / (at_0 - at_1))
        elif at_1 > 0.0:
            last = min(last, at_0 / (at_0 - at_1))
    if first > last:
        return FAR_UM
    ahead = ahead_1 - ahead_0
    aside = aside_1 - aside_0
    near_ahead, near_aside = nearest_of_segment(
        0.0, 0.0, ahead_0 + first * ahead, aside_0 + first * aside, ahead_0 + last * ahead, aside_0 + last * aside
    )
    return math.sqrt(near_ahead * near_ahead + near_aside * near_aside)


@in_kernel
def mix(seed: int, number: int, moment: int) -> int:
    """32 pseudo-random bits: a hash of three integers, for random draws of the world, not of a car's brain.

    Two rounds of multiply and xor-shift (constants: Wellons, "lowbias32").
    """
    x = (int(seed) * 0x9E3779B1 + int(number)) & 0xFFFFFFFF
    for k in range(2):
        x = ((x ^ x >> 16) * 0x7FEB352D) & 0xFFFFFFFF
        x = ((x ^ x >> 15) * 0x846CA68B) & 0xFFFFFFFF
        x = x ^ x >> 16
        if k == 0:
            x = (x + int(moment) * 0x85EBCA6B) & 0xFFFFFFFF
    return x
