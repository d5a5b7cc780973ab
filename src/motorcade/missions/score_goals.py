"""Goals about a score, as experiments on the automatic design of swarms publish it.

The scores are those of the loop functions of AutoMoDe-Chocolate (Francesca et al. 2015, Swarm Intelligence 9, 125-152)
and Gianduja (Hasselmann, Robert and Birattari 2018, ANTS), which count control steps of 100 ms; docs/lab/search.md says
where these differ from the papers.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from typing import Any, ClassVar

from motorcade.config.check import number as a_number
from motorcade.engine.moment import Event, Moment
from motorcade.errors import Phrase
from motorcade.missions.goal import EVERY_MS, ZONE, GoalKind, GoalState, distance_to_zone_m, metres
from motorcade.missions.model import Wording, Zone

# The diameter of the published arena as its loop function has it: a car that covers nothing is so far away.
_DIAMETER_M = 2.5
# A car that moves less between two moments, along x and along y, stands.
_STANDS_M = 0.005
# The points that stand for an area are so far apart: changes of a score by less than 1% are rounding.
_COVER_STEP_M, _NETWORK_STEP_M = 0.1, 0.05
_LEAST = a_number(0.01, 1_000_000, title="the score at least")


# x_m and y_m of a moment, as lists, arrays or other sequences.
_Columns = tuple[Any, Any]


class Score(ABC):
    """Scores one run. Goals of several stars share it, so it is told each moment once by each of them."""

    def __init__(self) -> None:
        self.now_ms = -1

    def see(self, moment: Moment) -> None:
        """Take the next moment; one that is not later than the one before changes nothing."""
        if moment.t_ms > self.now_ms:
            self.now_ms = moment.t_ms
            self.take(moment)

    @abstractmethod
    def take(self, moment: Moment) -> None:
        """Take a new moment."""

    @abstractmethod
    def value(self) -> float:
        """What was scored so far."""


class _Gathered(Score):
    """Count the cars in a zone at each moment but the first, and add them up."""

    def __init__(self, zone: Zone) -> None:
        super().__init__()
        self._is_in = partial(_is_in, zone)
        self._sum = 0

    def take(self, moment: Moment) -> None:
        if moment.t_ms:
            self._sum += sum(map(self._is_in, moment.x_m, moment.y_m))

    def value(self) -> float:
        return self._sum


class _Stopped(Score):
    """Count off each car and moment until a car finds a zone; also cars that stand till then, and that move later.

    Args:
        most: what is left if nothing is counted off.
    """

    def __init__(self, zone: Zone, most: int) -> None:
        super().__init__()
        self._is_in = partial(_is_in, zone)
        self._is_found = False
        self._before: _Columns = ((), ())
        self._left = most

    def take(self, moment: Moment) -> None:
        now: _Columns = (moment.x_m, moment.y_m)
        before = self._before
        self._before = now
        if not moment.t_ms:
            return
        pairs = zip(*before, *now, strict=True)
        standing = sum(abs(x1 - x0) < _STANDS_M and abs(y1 - y0) < _STANDS_M for x0, y0, x1, y1 in pairs)
        cars = len(now[0])
        if self._is_found:
            self._left -= cars - standing
        else:
            self._left -= cars + standing
            self._is_found = any(map(self._is_in, *now))

    def value(self) -> float:
        return self._left


class _AtEnd(Score):
    """Score where the cars are at the last moment, by a function of x_m and y_m."""

    def __init__(self, score_of: Callable[[Sequence[float], Sequence[float]], float]) -> None:
        super().__init__()
        self._score_of = score_of
        self._value: float | None = None

    def take(self, moment: Moment) -> None:
        self._last: _Columns = (moment.x_m, moment.y_m)
        self._value = None

    def value(self) -> float:
        if self._value is None:
            self._value = self._score_of(*self._last) if self.now_ms >= 0 else 0.0
        return self._value


def _covered(x_m: Sequence[float], y_m: Sequence[float], arena: Zone, dark: Sequence[Zone]) -> float:
    """100 for each metre by which points of the arena are nearer to a car on light floor than _DIAMETER_M; the mean."""
    cars = [car for car in zip(x_m, y_m, strict=True) if all(distance_to_zone_m(zone, *car) > 0 for zone in dark)]
    points = _points_in(arena, _COVER_STEP_M)
    total_m = sum(min((math.dist(point, car) for car in cars), default=_DIAMETER_M) for point in points)
    return 100 * max(_DIAMETER_M - total_m / len(points), 0.0)


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


def _is_in(zone: Zone, x_m: float, y_m: float) -> bool:
    """Whether a point is in a zone."""
    if zone.corners:
        return distance_to_zone_m(zone, x_m, y_m) == 0
    centre_x, centre_y, radius = zone.disc
    # Most points are far away, and this is asked for each car and moment.
    return abs(x_m - centre_x) <= radius and math.hypot(x_m - centre_x, y_m - centre_y) <= radius


class ScoreGoal(GoalKind):
    """A goal for a score of all cars at the end of the run. Goals with the same keys, but for ``least``, share it."""

    def prepare(self) -> None:
        self._least: float = self.values["least"]
        key = repr((self.name, self.values | {"least": 0}))
        self._score = self.run.once(key, self.score)

    @abstractmethod
    def score(self) -> Score:
        """Make what scores the run."""

    @property
    def zone(self) -> Zone:
        """The zone that the goal names."""
        return self.mission.zone(self.values["zone"])

    def see(self, moment: Moment, begun: Sequence[Event]) -> None:
        self._score.see(moment)

    def state(self, is_over: bool) -> GoalState:
        if not is_over:
            return GoalState("open", None, Phrase("goal-score-open", least=self._least))
        score = self._score.value()
        why = Phrase("goal-score", score=score, least=self._least)
        return GoalState("met" if score >= self._least else "lost", self._score.now_ms, why)

    def nearness(self) -> float:
        return max(self._score.value(), 0.0) / self._least


class Gathered(ScoreGoal):
    """Cars are in a zone, added up over time."""

    name = "gathered"
    fields: ClassVar = {"zone": ZONE, "least": _LEAST}

    def score(self) -> Score:
        return _Gathered(self.zone)


class Covered(ScoreGoal):
    """Cars cover a zone, but for its dark floor."""

    name = "covered"
    fields: ClassVar = {"zone": ZONE, "least": _LEAST}
    sees_all = False

    def score(self) -> Score:
        mat = self.mission.mat
        nowhere = Wording({})
        dark = [Zone("", nowhere, disc=spot) for spot in mat.spots]
        dark += [Zone("", nowhere, patch) for patch in mat.patches]
        return _AtEnd(partial(_covered, arena=self.zone, dark=dark))


class Networked(ScoreGoal):
    """Cars that are linked cover a zone."""

    name = "networked"
    fields: ClassVar = {
        "zone": ZONE,
        "apart_m": metres("cars are linked that are nearer to each other") | {"default": 0.35},
        "radius_m": metres("how far around it a car covers the zone") | {"default": 0.25},
        "least": _LEAST,
    }
    sees_all = False

    def score(self) -> Score:
        apart_m = self.values["apart_m"]
        radius_m = self.values["radius_m"]
        return _AtEnd(partial(_networked, arena=self.zone, apart_m=apart_m, radius_m=radius_m))


class StoppedAtZone(ScoreGoal):
    """Cars drive until one finds a zone, then stand."""

    name = "stopped"
    fields: ClassVar = {"zone": ZONE, "least": _LEAST}

    def score(self) -> Score:
        return _Stopped(self.zone, 2 * len(self.mission.mat.starts) * (self.mission.duration_ms // EVERY_MS))
