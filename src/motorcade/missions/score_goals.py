"""Goals about a score, as experiments on the automatic design of swarms publish it.

The scores are those of the loop functions of AutoMoDe-Chocolate (Francesca et al. 2015, Swarm Intelligence 9, 125-152)
and Gianduja (Hasselmann, Robert and Birattari 2018, ANTS), which count control steps of 100 ms; docs/lab/search.md says
where these differ from the papers.
"""

import math
from abc import abstractmethod
from collections.abc import Sequence
from functools import lru_cache
from operator import add
from typing import Any, ClassVar

from motorcade.config.check import number as a_number
from motorcade.engine import judging
from motorcade.engine.moment import Event, Moment
from motorcade.errors import Phrase
from motorcade.missions.goal import (
    EVERY_MS,
    ZONE,
    AskedGoal,
    GoalKind,
    GoalState,
    Question,
    distance_to_zone_m,
    metres,
)
from motorcade.missions.model import Goal, Mission, Wording, Zone

# x_m and y_m of a moment, as lists, arrays or other sequences.
_Columns = tuple[Any, Any]
# The diameter of the published arena as its loop function has it: a car that covers nothing is so far away.
_DIAMETER_M = 2.5
# The points that stand for an area are so far apart: changes of a score by less than 1% are rounding.
_COVER_STEP_M = 0.1
_NETWORK_STEP_M = 0.05
_LEAST = a_number(0.01, 1_000_000, title="the score at least")


def _covered(x_m: Sequence[float], y_m: Sequence[float], arena: Zone, dark: Sequence[Zone]) -> float:
    """100 for each metre by which points of the arena are nearer to a car on light floor than _DIAMETER_M; the mean."""
    cars = [car for car in zip(x_m, y_m, strict=True) if all(distance_to_zone_m(zone, *car) > 0 for zone in dark)]
    points = _points_in(arena, _COVER_STEP_M)
    if not cars:
        return 0.0
    # Most of a search's time is spent here: squares are enough to find the nearest, and points share their x and y.
    squares_x, squares_y = map(_squares, zip(*points, strict=True), zip(*cars, strict=True))
    total_m = 0.0
    for x, y in points:
        total_m += math.sqrt(min(map(add, squares_x[x], squares_y[y])))
    return 100 * max(_DIAMETER_M - total_m / len(points), 0.0)


def _squares(places: Sequence[float], of_cars: Sequence[float]) -> dict[float, list[float]]:
    """The squares of what cars are away from each place, all along x or all along y."""
    return {place: [(place - of_car) * (place - of_car) for of_car in of_cars] for place in set(places)}


def _networked(x_m: Sequence[float], y_m: Sequence[float], arena: Zone, apart_m: float, radius_m: float) -> float:
    """How many m² of the arena the largest group of cars covers: nearer than ``apart_m`` to one of it each."""
    cars = list(zip(x_m, y_m, strict=True))
    left = set(range(len(cars)))
    groups = list[list[int]]()
    while left:
        group = [min(left)]
        left.discard(group[0])
        for one in group:
            near = sorted(other for other in left if math.dist(cars[one], cars[other]) < apart_m)
            group += near
            left.difference_update(near)
        groups.append(group)
    members = [cars[car] for car in max(groups, key=len)]
    points = _points_in(arena, _NETWORK_STEP_M)
    seen = sum(any(math.dist(point, car) <= radius_m for car in members) for point in points)
    return seen * _NETWORK_STEP_M**2


@lru_cache(maxsize=16)
def _points_in(zone: Zone, step_m: float) -> list[tuple[float, float]]:
    """Points of a square grid in a zone, in the middle of their cells."""
    left, bottom, right, top = zone.box()
    columns, rows = (math.ceil((end - begin) / step_m) for begin, end in ((left, right), (bottom, top)))
    grid = ((left + (k + 0.5) * step_m, bottom + (j + 0.5) * step_m) for j in range(rows) for k in range(columns))
    return [point for point in grid if distance_to_zone_m(zone, *point) == 0] or [(left, bottom)]


class ScoreGoal(GoalKind):
    """A goal for a score of all cars at the end of the run."""

    @abstractmethod
    def score(self) -> float:
        """What was scored so far."""

    @property
    def zone(self) -> Zone:
        """The zone that the goal names."""
        return self.mission.zone(self.values["zone"])

    def state(self, is_over: bool) -> GoalState:
        least: float = self.values["least"]
        if not is_over:
            return GoalState("open", None, Phrase("goal-score-open", least=least))
        score = self.score()
        why = Phrase("goal-score", score=score, least=least)
        return GoalState("met" if score >= least else "lost", self.now_ms, why)

    def nearness(self) -> float:
        least: float = self.values["least"]
        return max(self.score(), 0.0) / least


class _SummedGoal(ScoreGoal, AskedGoal):
    """A score to which each car adds something at each moment."""

    fields: ClassVar = {"zone": ZONE, "least": _LEAST}
    what: ClassVar[int]

    @classmethod
    def question(cls, goal: Goal, mission: Mission) -> Question:
        zone = mission.zone(goal.values["zone"])
        return Question(cls.what, zone=zone, cars=range(len(mission.mat.starts)))


class Gathered(_SummedGoal):
    """Cars are in a zone, counted at each moment but the first, and added up."""

    name = "gathered"
    what = judging.GATHERED

    def score(self) -> float:
        return sum(self.off)


class StoppedAtZone(_SummedGoal):
    """Cars drive until one finds a zone, then stand.

    Each car and moment is counted off until then; also cars that stand till then, and that move later.
    """

    name = "stopped"
    what = judging.STOPPED

    def score(self) -> float:
        moments = self.mission.duration_ms // EVERY_MS
        return 2 * len(self.mission.mat.starts) * moments - sum(self.off)


class _PlacedGoal(ScoreGoal):
    """A score of where the cars are at the last moment. Goals with the same keys, but for ``least``, share it."""

    def prepare(self) -> None:
        self._last: _Columns = ((), ())

    def see(self, moment: Moment, begun: Sequence[Event]) -> None:
        super().see(moment, begun)
        self._last = moment.x_m, moment.y_m

    def score(self) -> float:
        if not self.run.times_ms:
            return 0.0
        key = repr((self.name, self.values | {"least": 0}, self.now_ms))
        return self.run.once(key, lambda: self.score_of(*self._last))

    @abstractmethod
    def score_of(self, x_m: Sequence[float], y_m: Sequence[float]) -> float:
        """The score of cars at these places."""


class Covered(_PlacedGoal):
    """Cars cover a zone, but for its dark floor."""

    name = "covered"
    fields: ClassVar = {"zone": ZONE, "least": _LEAST}

    def score_of(self, x_m: Sequence[float], y_m: Sequence[float]) -> float:
        mat = self.mission.mat
        nowhere = Wording({})
        dark = [Zone("", nowhere, disc=spot) for spot in mat.spots]
        dark += [Zone("", nowhere, patch) for patch in mat.patches]
        return _covered(x_m, y_m, self.zone, dark)


class Networked(_PlacedGoal):
    """Cars that are linked cover a zone."""

    name = "networked"
    fields: ClassVar = {
        "zone": ZONE,
        "apart_m": metres("cars are linked that are nearer to each other") | {"default": 0.35},
        "radius_m": metres("how far around it a car covers the zone") | {"default": 0.25},
        "least": _LEAST,
    }

    def score_of(self, x_m: Sequence[float], y_m: Sequence[float]) -> float:
        return _networked(x_m, y_m, self.zone, self.values["apart_m"], self.values["radius_m"])
