"""What a mat is, as data: where cars start, what stands in their way, who walks and speaks, which physics hold."""

import heapq
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from motorcade.engine.errors import MatError

Wall = tuple[float, float, float, float]
Disc = tuple[float, float, float]
Corners = tuple[tuple[float, float], ...]

_SPACING_M = 0.25
_SIDE = 20


@dataclass(slots=True)
class Pose:
    """Where a car is: metres, and radians counter-clockwise from the x axis."""

    x: float
    y: float
    heading: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Starts:
    """Where the cars stand at first, and which of them lead; a car's index is its number.

    Attributes:
        x_m, y_m: float64, one per car.
        heading: float64, radians counter-clockwise from the x axis.
        leads: bool.
        groups: whom the cars belong to in the mat's file, in order: ``("crowd[0]", 500)`` stands
            for the next 500 cars. Errors name them; empty where the cars come from no file.

    The arrays are copied and read-only. Raises MatError where their lengths differ.
    """

    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]
    heading: NDArray[np.float64]
    leads: NDArray[np.bool_]
    groups: tuple[tuple[str, int], ...] = ()

    def __post_init__(self) -> None:
        for name, kind in (("x_m", np.float64), ("y_m", np.float64), ("heading", np.float64), ("leads", np.bool_)):
            column = np.array(getattr(self, name), dtype=kind)
            column.flags.writeable = False
            object.__setattr__(self, name, column)
        shapes = {each.shape for each in self._columns()}
        if len(shapes) > 1 or self.x_m.ndim != 1:
            raise MatError("lengths-differ")

    def __len__(self) -> int:
        return len(self.x_m)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Starts):
            return NotImplemented
        pairs = zip(self._columns(), other._columns(), strict=True)
        return self.groups == other.groups and all(np.array_equal(mine, its) for mine, its in pairs)

    @classmethod
    def of(cls, poses: Sequence[Pose], leads: Sequence[bool]) -> Self:
        """One car per pose; ``leads`` says of each whether it leads."""
        x_m, y_m, heading = (np.array([getattr(pose, name) for pose in poses], float) for name in ("x", "y", "heading"))
        return cls(x_m, y_m, heading, np.array(leads, bool))

    def _columns(self) -> tuple[NDArray[np.generic], ...]:
        return self.x_m, self.y_m, self.heading, self.leads


@dataclass(frozen=True, slots=True)
class Person:
    """Somebody who walks a path, straight from point to point, and is seen by the cars' PIR sensors.

    ``path`` holds (t_s, x_m, y_m), t_s rising from 0; with one point they stand there.
    With ``repeats`` the path begins anew when it is over, else they stay at its end.
    """

    path: tuple[tuple[float, float, float], ...]
    repeats: bool = False


@dataclass(frozen=True, slots=True)
class Voice:
    """A word, ``stop`` or ``go``, that is said once, ``at_s`` seconds after the start.

    Cars within ``radius_m`` of (x_m, y_m) hear it; where that is None, all do.
    """

    at_s: float
    word: str
    x_m: float = 0.0
    y_m: float = 0.0
    radius_m: float | None = None


@dataclass(frozen=True, slots=True)
class Physics:
    """Which physics hold, each a part of its own.

    Attributes:
        collisions: bodies push each other apart; walls and obstacles hold them.
        line_of_sight: walls, obstacles and cars shade infrared.
        capture_ratio: a frame survives another that is so many times weaker (power, above 1); None: never.
        beam_half_angle_deg: the sender's cone about its heading, 1 to 180; 180 is all round.
        bit_error_rate: chance of each bit of a frame to flip on its way to one receiver, 0 to 0.5.
        wheel_noise: standard deviation of each wheel's speed as a share of it, 0 to 0.5.
    """

    collisions: bool = True
    line_of_sight: bool = True
    capture_ratio: float | None = None
    beam_half_angle_deg: float = 180.0
    bit_error_rate: float = 0.0
    wheel_noise: float = 0.0


@dataclass(frozen=True, slots=True)
class Mat:
    """A place that cars drive on. Lengths are metres; x goes right, y up.

    Attributes:
        name: what it is called, in a line.
        starts: where the cars stand at first.
        tick_ms: the clock's step, 1 to 40.
        size_m: width and height, its lower left corner is the origin; None: a plane without end.
        walled: whether the mat's edge is a wall; needs ``size_m``.
        walls: straight and thin, x0, y0, x1, y1.
        discs: round obstacles, x, y, radius.
        polygons: solid obstacles, three corners (x, y) or more each.
        people: who walks there.
        voices: what is said there.
        physics: which physics hold.
    """

    name: str
    starts: Starts
    tick_ms: int = 1
    size_m: tuple[float, float] | None = None
    walled: bool = False
    walls: tuple[Wall, ...] = ()
    discs: tuple[Disc, ...] = ()
    polygons: tuple[Corners, ...] = ()
    people: tuple[Person, ...] = ()
    voices: tuple[Voice, ...] = ()
    physics: Physics = Physics()


def formation(followers: int, reach_m: float = 1.0) -> list[Pose]:
    """The leader at the origin, looking along x, and its followers on a grid of 250 mm.

    They stand as near to it as they can: first behind it, within ``reach_m``
    (where its infrared is heard), then beside and before it, then further away.
    """
    poses = [Pose(0.0, 0.0)]
    side = _SIDE + math.isqrt(followers)
    places = [(column, row) for column in range(-side, side + 1) for row in range(-side, side + 1) if column or row]

    def order(place: tuple[int, int]) -> tuple[bool, bool, int, int, int]:
        column, row = place
        squared = column * column + row * row
        return squared * _SPACING_M**2 > reach_m**2, column >= 0, squared, column, -row

    nearest = heapq.nsmallest(followers, places, key=order)
    return poses + [Pose(column * _SPACING_M, row * _SPACING_M) for column, row in nearest]


def open_table(poses: Sequence[Pose], tick_ms: int = 1) -> Mat:
    """A plane without end, with nothing on it but cars; the first of them leads.

    They carry their infrared above their bodies, so that none shades another.
    """
    leads = [number == 0 for number in range(len(poses))]
    return Mat("open table", Starts.of(poses, leads), tick_ms, physics=Physics(line_of_sight=False))
