"""A mat as data: where cars start, walls and obstacles, lines on the floor, people, voices, and the physics."""

import math
from array import array
from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from itertools import compress
from typing import Any, Self

from motorcade.config.arguments import instance_of, not_allowed, to_list, to_number, to_whole
from motorcade.errors import MatError, Phrase

Point = tuple[float, float]
Wall = tuple[float, float, float, float]
Disc = tuple[float, float, float]
Corners = tuple[Point, ...]

# How far a chord may be from the arc that it stands for.
_SAGITTA_M = 0.001
_SPACING_M = 0.25
_MOST_FOLLOWERS = 2_000_000


@dataclass(slots=True)
class Pose:
    """The position of a car in metres, and its heading in radians counter-clockwise from the x axis."""

    x: float
    y: float
    heading: float = 0.0


@dataclass(frozen=True, slots=True)
class Starts:
    """Where the cars start, and which of them lead; a car's index is its number.

    Each column is a read-only buffer with an index, `tolist` and so on, which NumPy takes without a copy
    (``np.asarray(starts.x_m)``).

    Args:
        x_m, y_m: metres, one per car; buffers, such as arrays, or other sequences. They are copied.
        heading: radians counter-clockwise from the x axis.
        leads: whether each car leads.
        groups: the tables of the mat's file that the cars come from, in order: ``("crowd[0]", 500)`` stands for the
            next 500 cars. Errors name them; empty where the cars come from no file.

    Raises:
        MotorcadeError: the columns differ in length, or one has rows.
    """

    x_m: "memoryview[float]"
    y_m: "memoryview[float]"
    heading: "memoryview[float]"
    leads: "memoryview[bool]"
    groups: tuple[tuple[str, int], ...] = ()

    def __post_init__(self) -> None:
        for name in ("x_m", "y_m", "heading"):
            object.__setattr__(self, name, floats(getattr(self, name)))
        object.__setattr__(self, "leads", flags(self.leads))
        if len({len(self.x_m), len(self.y_m), len(self.heading), len(self.leads)}) > 1:
            raise MatError("starts-differ-in-length")

    def __len__(self) -> int:
        return len(self.x_m)

    def __reduce__(self) -> tuple[Any, ...]:
        # A memoryview can't be pickled.
        x_m, y_m, heading = (array("d", column.tobytes()) for column in (self.x_m, self.y_m, self.heading))
        return Starts, (x_m, y_m, heading, self.leads.tobytes(), self.groups)

    @property
    def leaders(self) -> list[int]:
        """The numbers of the cars that lead."""
        return list(compress(range(len(self)), self.leads))

    @classmethod
    def of(cls, poses: Sequence[Pose], leads: Iterable[bool]) -> Self:
        """Make one car per pose; ``leads`` has for each whether it leads."""
        poses = [instance_of(Pose, "poses", pose) for pose in to_list("poses", poses)]
        x_m, y_m, heading = (floats([getattr(pose, name) for pose in poses]) for name in ("x", "y", "heading"))
        return cls(x_m, y_m, heading, flags(leads))


def floats(values: Iterable[float]) -> "memoryview[float]":
    """Copy numbers into a read-only buffer of float64. Raises MotorcadeError: some are no numbers."""
    try:
        return memoryview(_bytes_of(values, "d") or array("d", values).tobytes()).cast("d")
    except (TypeError, ValueError, OverflowError):
        raise not_allowed("starts", values, Phrase("list-of-numbers")) from None


def flags(values: Iterable[object]) -> "memoryview[bool]":
    """Copy truth values into a read-only buffer, a byte each. Raises MotorcadeError: this is no list."""
    return memoryview(_bytes_of(values, "?") or bytes(map(bool, to_list("leads", values)))).cast("?")


def _bytes_of(values: Any, kind: str) -> bytes | None:
    """The bytes of a buffer of this kind of number; None for others."""
    try:
        given = memoryview(values)
    except TypeError:
        return None
    if given.ndim != 1:
        raise MatError("starts-differ-in-length")
    if given.format == kind:
        return given.tobytes()
    return None


@dataclass(frozen=True, slots=True)
class Person:
    """A person who walks straight from point to point; the cars' PIR sensors detect people.

    Attributes:
        path: (t_s, x_m, y_m), with t_s rising from 0; a person with one point stands there.
        repeats: whether the path begins again at its end; else the person stays there.
    """

    path: tuple[tuple[float, float, float], ...]
    repeats: bool = False


@dataclass(frozen=True, slots=True)
class Voice:
    """A word that is spoken once.

    Attributes:
        at_s: the time after the start, in seconds.
        word: ``stop`` or ``go``.
        x_m, y_m, radius_m: cars within the radius of the point hear it; where the radius is None, all cars do.
    """

    at_s: float
    word: str
    x_m: float = 0.0
    y_m: float = 0.0
    radius_m: float | None = None


@dataclass(frozen=True, slots=True)
class Physics:
    """The physics of a mat; each setting can be changed alone.

    Attributes:
        collisions: bodies push each other apart, and walls and obstacles stop them.
        line_of_sight: walls, obstacles and cars block infrared.
        capture_ratio: where two frames overlap, the stronger one is received if its power is at least so many times the
            power of the other (above 1); None: both are lost.
        beam_half_angle_deg: half of the angle of the sender's cone about its heading, 1 to 180 (all directions).
        bit_error_rate: probability that a bit of a frame flips on its way to a receiver, 0 to 0.5.
        wheel_noise: standard deviation of each wheel's speed as a share of it, 0 to 0.5.
    """

    collisions: bool = True
    line_of_sight: bool = True
    capture_ratio: float | None = None
    beam_half_angle_deg: float = 180.0
    bit_error_rate: float = 0.0
    wheel_noise: float = 0.0


@dataclass(frozen=True, slots=True)
class Line:
    """A dark line on the floor.

    Attributes:
        points_m: its points, two or more, in order.
        width_m: its width.
        bend_m: the radius of the arcs that round its corners; 0 for sharp corners. An arc takes at most half of a
            stretch, so between near points it is smaller.
        closed: whether it goes on from its last point to its first.
    """

    points_m: tuple[Point, ...]
    width_m: float = 0.03
    bend_m: float = 0.0
    closed: bool = False


@dataclass(frozen=True, slots=True)
class Mat:
    """A place that cars drive on. Lengths are metres; x goes right, y up.

    Attributes:
        name: its name, one line.
        starts: where the cars start.
        tick_ms: the simulator's step, 1 to 40.
        size_m: width and height, its lower left corner is the origin; None for an unbounded plane.
        walled: whether the mat's edge is a wall; needs ``size_m``.
        walls: straight and thin, x0, y0, x1, y1.
        discs: round obstacles, x, y, radius.
        polygons: solid obstacles, three corners (x, y) or more each.
        people: the people who walk there.
        voices: the words that are spoken there.
        physics: the physics of the mat.
        lines, spots, patches: dark lines on the floor, round dark spots (x, y, radius) and dark polygons.
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
    lines: tuple[Line, ...] = ()
    spots: tuple[Disc, ...] = ()
    patches: tuple[Corners, ...] = ()

    def __post_init__(self) -> None:
        instance_of(Starts, "starts", self.starts)
        # Arrays and numbers of NumPy's would get everywhere, and some of them are neither true nor false.
        for its_field in fields(self):
            if hasattr(value := getattr(self, its_field.name), "tolist"):
                object.__setattr__(self, its_field.name, _as_tuples(value.tolist()))
        tick_ms: Any = self.tick_ms
        if isinstance(tick_ms, float) and tick_ms.is_integer():
            object.__setattr__(self, "tick_ms", int(tick_ms))


def _as_tuples(value: Any) -> Any:
    if isinstance(value, list):
        return tuple(map(_as_tuples, value))
    return value


def formation(followers: int, reach_m: float = 1.0) -> list[Pose]:
    """Place the leader at the origin, facing along x, and its followers on a grid of 250 mm.

    The followers stand as near to it as possible: first behind it within ``reach_m``, the range of its infrared, then
    beside and in front of it, then farther away.
    """
    followers = to_whole("followers", followers, 0, _MOST_FOLLOWERS)
    reach_m = to_number("reach_m", reach_m, 0, math.inf)
    # Half of a disc with this radius has enough places.
    radius = math.isqrt(followers * 16 // 25) + 4
    side = 2 * radius + 1
    reach = min(reach_m / _SPACING_M, float(radius))
    behind = _nearest(radius, range(-radius, 0), side)
    others = _nearest(math.ceil(reach), range(math.ceil(reach) + 1), side)
    near, near_others = (bisect_left(places, int(reach * reach + 1) * side * side) for places in (behind, others))
    # The nearest of the others is the leader's.
    places = (behind[:near] + others[1:near_others] + behind[near:])[:followers]
    x_m = [(place // side % side - radius) * _SPACING_M for place in places]
    y_m = [(radius - place % side) * _SPACING_M for place in places]
    return [Pose(0.0, 0.0), *map(Pose, x_m, y_m)]


def _nearest(reach: int, columns: Iterable[int], side: int) -> list[int]:
    """The places in some columns of a grid within a radius, the nearest first.

    A place is one number, because a million tuples take seconds. Its digits, in the base ``side``, are the squared
    distance, the column and the row; the middle of the grid is at half of ``side``.
    """
    places: list[int] = []
    for column in columns:
        high = math.isqrt(reach * reach - column * column)
        squared = column * column
        first = (squared * side + column + side // 2) * side + side // 2
        places += [first + row * row * side * side - row for row in range(high, -high - 1, -1)]
    places.sort()
    return places


def open_table(poses: Sequence[Pose], tick_ms: int = 1) -> Mat:
    """Make an unbounded plane with nothing but cars, of which the first leads; no car blocks another's infrared."""
    poses = to_list("poses", poses)
    leads = [number == 0 for number in range(len(poses))]
    return Mat("open table", Starts.of(poses, leads), tick_ms, physics=Physics(line_of_sight=False))


def playground() -> Mat:
    """Make a walled mat to drive on: obstacles, a person who walks, and a leader in front of four followers."""
    poses = [Pose(0.9, 1.5), *(Pose(0.4, 0.9 + 0.4 * k) for k in range(4))]
    return Mat(
        "playground",
        Starts.of(poses, [True] + [False] * 4),
        20,
        (4.0, 3.0),
        True,
        walls=((2.6, 0.0, 2.6, 0.7),),
        discs=((1.9, 2.1, 0.12), (3.2, 1.2, 0.18)),
        polygons=(((2.4, 2.4), (2.9, 2.4), (2.9, 2.6), (2.4, 2.6)),),
        people=(Person(((0.0, 3.6, 0.4), (8.0, 3.6, 2.6), (16.0, 3.6, 0.4)), repeats=True),),
    )


def path_of(line: Line) -> list[Point]:
    """Return the points of the line's middle, the first again where it is closed.

    Arcs become chords that are at most 1 mm off.
    """
    points = line.points_m
    if len(points) == 2:
        return list(points)
    path: list[Point] = []
    count = len(points)
    for at, here in enumerate(points):
        is_end = not line.closed and at in (0, count - 1)
        if is_end or line.bend_m == 0:
            path.append(here)
        else:
            path += _bend(points[at - 1], here, points[(at + 1) % count], line.bend_m)
    if line.closed:
        return [*path, path[0]]
    return path


def _bend(before: Point, corner: Point, after: Point, radius_m: float) -> Sequence[Point]:
    """Return the points of the arc that touches both sides of a corner; the corner where the path is straight."""
    to_before = _direction(corner, before)
    to_after = _direction(corner, after)
    if to_before is None or to_after is None:
        return (corner,)
    half = math.acos(max(-1.0, min(1.0, to_before[0] * to_after[0] + to_before[1] * to_after[1]))) / 2
    if half < 1e-3 or half > math.pi / 2 - 1e-3:
        return (corner,)
    most_m = min(math.dist(corner, before), math.dist(corner, after)) / 2
    from_corner_m = min(radius_m / math.tan(half), most_m)
    radius = from_corner_m * math.tan(half)
    begin = corner[0] + to_before[0] * from_corner_m, corner[1] + to_before[1] * from_corner_m
    to_middle = to_before[0] + to_after[0], to_before[1] + to_after[1]
    length = math.hypot(*to_middle)
    away = from_corner_m / math.cos(half)
    centre = corner[0] + to_middle[0] / length * away, corner[1] + to_middle[1] / length * away
    first = math.atan2(begin[1] - centre[1], begin[0] - centre[0])
    turn = math.pi - 2 * half
    if to_before[0] * to_after[1] - to_before[1] * to_after[0] > 0:
        turn = -turn
    step = math.pi
    if radius > _SAGITTA_M:
        step = 2 * math.acos(max(0.0, 1 - _SAGITTA_M / radius))
    pieces = max(1, math.ceil(abs(turn) / step))
    angles = [first + turn * piece / pieces for piece in range(pieces + 1)]
    return [(centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle)) for angle in angles]


def _direction(here: Point, there: Point) -> Point | None:
    length = math.dist(here, there)
    if length:
        return ((there[0] - here[0]) / length, (there[1] - here[1]) / length)
    return None
