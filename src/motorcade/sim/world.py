"""A small world, exact and plain: cars that run the loop of a real car, on one clock and one seed.

Each tick, in this order: frames that ended are delivered; every car's loop
runs; frames that they began go on the air; the cars move. No car sees what
another one did in the same tick, so their order has no meaning.
"""

import heapq
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.car.brain import LEFT, NO_VOICE, RIGHT, VOICE_GO, VOICE_STOP
from motorcade.car.loop import Car
from motorcade.profile import Profile
from motorcade.sim.board import SimulatedBoard, levels_of
from motorcade.sim.channel import Channel

VOICES = {"stop": VOICE_STOP, "go": VOICE_GO}
_SPACING_M = 0.25
_SIDE = 20


@dataclass(slots=True)
class Pose:
    """Where a car is: metres, and radians counter-clockwise from the x axis."""

    x: float
    y: float
    heading: float = 0.0


class Event(NamedTuple):
    """Something that happened to a car.

    ``kind`` is one of: state (the leader begins a state), start (a follower
    begins a word), over (its length is over), frame (a frame was begun), heard, lost.
    ``word`` is the control word, for a lost frame the bits on the air. ``detail``
    holds what else there is: ``index`` of a state, ``why`` of a lost frame (parity,
    reserved, deaf, sending, collision), ``sender`` of one that was lost on the air.
    """

    t_ms: int
    car: int
    kind: str
    word: int
    detail: dict[str, Any]

    def as_dict(self) -> dict[str, Any]:
        """The event for JSON."""
        return {"t_ms": self.t_ms, "car": self.car, "kind": self.kind, "word": self.word, **self.detail}


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


class World:
    """One leader (car 0) and its followers.

    Args:
        image: the leader's image, the very bytes that were uploaded.
        profile: what its levels mean.
        poses: where the cars stand at first, the leader first.
        seed: the same seed gives the same run.
        tick_ms: the clock's step.
        people: where people stand, (x, y) in metres.
    """

    def __init__(
        self,
        image: bytes,
        profile: Profile,
        poses: list[Pose],
        seed: int = 0,
        tick_ms: int = 1,
        people: list[tuple[float, float]] | None = None,
    ):
        self.profile = profile
        self.levels = levels_of(profile)
        self.people = people or []
        self.tick_ms = tick_ms
        self._image = image
        self._first_poses = poses
        self.reset(seed)

    def reset(self, seed: int) -> None:
        """Everything as at the beginning, with ``seed``."""
        self.seed = seed
        self.now_ms = 0
        self.voice = NO_VOICE
        self.events: list[Event] = []
        self.poses = [Pose(pose.x, pose.y, pose.heading) for pose in self._first_poses]
        self.channel = Channel(len(self.poses), self.profile.infrared.unit_us)
        self.boards = [SimulatedBoard(self, index, None if index else self._image) for index in range(len(self.poses))]
        self.cars = [Car(board) for board in self.boards]

    def say(self, word: str) -> None:
        """Every car hears ``stop`` or ``go`` in the next tick."""
        self.voice = VOICES[word]

    def step(self) -> None:
        """One tick."""
        self._deliver()
        for car in self.cars:
            car.tick()
        self.voice = NO_VOICE
        self._put_on_air()
        self._move()
        self.now_ms += self.tick_ms

    def run(self, duration_ms: int, every_ms: int = 1000) -> Iterator[int]:
        """Step for ``duration_ms``; yields the time every ``every_ms``, for progress and tracks."""
        end_ms = self.now_ms + duration_ms
        while self.now_ms < end_ms:
            self.step()
            if self.now_ms % every_ms < self.tick_ms:
                yield self.now_ms

    def note(self, car: int, kind: str, at_ms: int, word: int, detail: int | str) -> None:
        """Record an event that a car's loop tells of."""
        extra: dict[str, Any] = {}
        if kind == "state":
            extra["index"] = detail
        elif kind == "lost":
            extra["why"] = detail
        self.events.append(Event(at_ms, car, kind, word, extra))

    def obstacle_mm(self, car: int) -> int:
        """Distance from the front of ``car`` to the nearest body that its ultrasonic cone touches."""
        body = self.profile.body
        radius_m = body.diameter_mm / 2000
        pose = self.poses[car]
        front_x = pose.x + radius_m * math.cos(pose.heading)
        front_y = pose.y + radius_m * math.sin(pose.heading)
        nearest_mm = NOTHING_IN_SIGHT_MM
        for index, other in enumerate(self.poses):
            if index == car:
                continue
            distance_m = math.hypot(other.x - front_x, other.y - front_y)
            if distance_m <= radius_m:
                return 0
            off_axis = _turn(math.atan2(other.y - front_y, other.x - front_x) - pose.heading)
            if abs(off_axis) <= math.radians(body.ultrasonic_cone_deg) + math.asin(radius_m / distance_m):
                nearest_mm = min(nearest_mm, int((distance_m - radius_m) * 1000))
        return nearest_mm if nearest_mm <= body.ultrasonic_range_mm else NOTHING_IN_SIGHT_MM

    def sees_person(self, car: int) -> bool:
        """Whether somebody stands in the PIR sector of ``car``."""
        body = self.profile.body
        pose = self.poses[car]
        for x, y in self.people:
            if math.hypot(x - pose.x, y - pose.y) * 1000 > body.pir_range_mm:
                continue
            off_axis = _turn(math.atan2(y - pose.y, x - pose.x) - pose.heading)
            if abs(off_axis) <= math.radians(body.pir_half_angle_deg):
                return True
        return False

    def _deliver(self) -> None:
        for frame in self.channel.ended(self.now_ms * 1000):
            for receiver in frame.receivers:
                if why := frame.lost.get(receiver):
                    extra = {"why": why, "sender": frame.sender}
                    self.events.append(Event(self.now_ms, receiver, "lost", frame.bits, extra))
                else:
                    self.boards[receiver].inbox.append(frame.bits)

    def _put_on_air(self) -> None:
        for board in self.boards:
            if board.outbox is not None:
                self.channel.begin(board.index, board.outbox, self.now_ms * 1000, self._in_range(board.index))
                board.outbox = None

    def _in_range(self, sender: int) -> list[int]:
        """The followers that a frame of ``sender`` reaches now; a leader never listens."""
        origin = self.poses[sender]
        reach_m = self.profile.infrared.range_mm / 1000
        return [
            index
            for index in range(1, len(self.poses))
            if index != sender and math.hypot(self.poses[index].x - origin.x, self.poses[index].y - origin.y) <= reach_m
        ]

    def _move(self) -> None:
        seconds = self.tick_ms / 1000
        for board, pose in zip(self.boards, self.poses, strict=True):
            if board.speed_level == 0:
                continue
            if board.direction in (LEFT, RIGHT):
                turn = math.radians(self.profile.turn_rates_deg_s[board.speed_level]) * seconds
                pose.heading = _turn(pose.heading + (turn if board.direction == LEFT else -turn))
            else:
                distance_m = self.profile.speeds_mm_s[board.speed_level] / 1000 * seconds
                pose.x += distance_m * math.cos(pose.heading)
                pose.y += distance_m * math.sin(pose.heading)


def _turn(angle: float) -> float:
    """``angle`` brought to -pi ... pi."""
    return math.remainder(angle, math.tau)
