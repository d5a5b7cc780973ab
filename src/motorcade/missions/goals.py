"""Goals about what cars do: where they are, how far they drove, which LEDs are on. Each watch sees moment by moment.

A watch is a pure function of the moments and events that it was given, so a page that plays a run and the command line
come to the same result.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from functools import partial
from itertools import chain
from typing import Any, Literal, NamedTuple

from motorcade.car.brain import NO_LED
from motorcade.engine import judging
from motorcade.engine.moment import Event, Moment
from motorcade.errors import Phrase
from motorcade.missions.model import Goal, Mission, Wording, Zone

# A car that is so far off counts half in the grade of a goal.
_HALF_M, _HALF_DEG = 0.5, 45.0
# The most that a goal can get that is not met.
MOST_UNMET = 0.99
# What the watch of a goal says: not yet met, met at present but not for good, met for good, lost for good.
GoalProgress = Literal["open", "holds", "met", "lost"]
# When a car must meet a goal.
TIMES = {"end": judging.END, "some-moment": judging.SOME_MOMENT, "always": judging.ALWAYS}


class GoalState(NamedTuple):
    """How it stands with a goal.

    Attributes:
        progress: see `GoalProgress`.
        t_ms: when it was met; where it is lost, a moment at which one can see why; None while neither.
        why: a phrase with numbers.
        cars: the cars that ``why`` is about, where it is not met.
    """

    progress: GoalProgress
    t_ms: int | None
    why: Phrase
    cars: tuple[int, ...] = ()


class GoalWatch(ABC):
    """Watches one goal during one run.

    Args:
        cars: the cars that it is about.
        share: the part of them that must meet it.

    Attributes:
        sees_all: whether it needs every moment; else the last one of the run is enough.
    """

    sees_all = True

    def __init__(self, cars: Sequence[int] = (), share: float = 1.0) -> None:
        self._cars = cars
        self._needed = needed_of(share, len(cars))
        self._now_ms = 0
        # Since when it is met, and when it was lost for good.
        self._since_ms: int | None = None
        self._lost_ms: int | None = None

    def _note(self, is_met: bool) -> None:
        """Note whether the goal is met at this moment."""
        if not is_met:
            self._since_ms = None
        elif self._since_ms is None:
            self._since_ms = self._now_ms

    @abstractmethod
    def see(self, moment: Moment, begun: Sequence[Event]) -> None:
        """Take the next moment, and the events since the one before it in which cars begin words."""

    @abstractmethod
    def state(self, is_over: bool) -> GoalState:
        """How it stands now; ``is_over``: the run has ended, so nothing stays open."""

    @abstractmethod
    def nearness(self) -> float:
        """How near the run came to meeting the goal, 0 to 1. It is asked only of a goal that is not met."""

    def grade(self, is_over: bool) -> float:
        """1 where the goal is met; else how near the run came to it, 0 to `MOST_UNMET`."""
        return 1.0 if self.state(is_over).progress == "met" else min(self.nearness(), MOST_UNMET)


class FixedWatch(GoalWatch):
    """A goal that the run doesn't decide: the program alone does, or `motorcade.missions.check`, on other seeds."""

    sees_all = False

    def __init__(self, state: GoalState, nearness: float = 0.0) -> None:
        super().__init__()
        self._state, self._nearness = state, nearness

    def see(self, moment: Moment, begun: Sequence[Event]) -> None:
        """Nothing that happens changes it."""

    def state(self, is_over: bool) -> GoalState:
        return self._state

    def nearness(self) -> float:
        return self._nearness


def car_phrase(car: int) -> Phrase:
    """Name a car."""
    return Phrase("car-number", number=car)


def lost_phrase(key: str, car: int, done: int, count: int, **details: Any) -> Phrase:
    """Say what one car did; of several cars also how many did what is asked."""
    if count == 1:
        return Phrase(key, car=Phrase("the-car"), tally=Phrase("nothing-more"), **details)
    return Phrase(key, car=car_phrase(car), tally=Phrase(f"{key}-tally", done=done, count=count), **details)


def done_phrase(done: int, count: int) -> Phrase:
    """Say how many cars did what is asked."""
    return Phrase("goal-done") if done == count == 1 else Phrase("goal-done-by", done=done, count=count)


def needed_of(share: float, count: int) -> int:
    """How many of ``count`` are the ``share``, rounded up."""
    return math.ceil(share * count - 1e-9)


class CarsWatch(GoalWatch):
    """A goal for each of some cars, of which a share must meet it: at the end, at some moment of its own, or always.

    Moments before the goal's ``from_s`` and after its ``until_s`` don't count.

    Args:
        test: for a car's number and a moment how far the car is from meeting the goal, 0: it meets it.
        lost: the key of the sentence for the car that misses it most.
        details: what this sentence says of that car, from what ``test`` gave.
        half: how far off a car is that counts half in a grade; 0: only cars that meet the goal count.
    """

    def __init__(
        self,
        goal: Goal,
        test: Callable[[int, Moment], float],
        lost: str,
        details: Callable[[float], dict[str, Any]],
        half: float = 0.0,
    ) -> None:
        super().__init__(goal.cars, goal.values["share"])
        self._half, self._at = half, goal.at
        self._test, self._key, self._details = test, lost, details
        self._from_ms, self._until_ms = goal.window_ms
        # How far each car is from meeting the goal, and since when: now, at best, or when it first missed it.
        self._off = [first_off(self._at)] * len(goal.cars)
        self._off_ms = [0] * len(goal.cars)
        self._ended = False

    def see(self, moment: Moment, begun: Sequence[Event]) -> None:
        self._ended = moment.t_ms > self._until_ms
        if moment.t_ms < self._from_ms or self._ended:
            return
        self._now_ms = moment.t_ms
        for place, car in enumerate(self._cars):
            off = self._test(car, moment)
            before = self._off[place]
            if judging.replaces(off, before, TIMES[self._at]):
                self._off[place], self._off_ms[place] = off, moment.t_ms
        self._note(self._done >= self._needed)

    def nearness(self) -> float:
        """The mean of the cars that come nearest, as many as must meet the goal; for `always` by their first miss."""
        if self._at == "always":
            now_ms = max(self._now_ms, 1)
            near = [1.0 if off == 0 else at_ms / now_ms for off, at_ms in zip(self._off, self._off_ms, strict=True)]
        else:
            near = [1.0 if off == 0 else self._half / (self._half + off) for off in self._off]
        return sum(sorted(near)[-self._needed :]) / self._needed

    @property
    def _done(self) -> int:
        return sum(off == 0 for off in self._off)

    def state(self, is_over: bool) -> GoalState:
        is_over = is_over or self._ended
        done, count = self._done, len(self._cars)
        if done >= self._needed:
            is_met = is_over or self._at == "some-moment"
            t_ms = self._since_ms if self._at != "always" else self._now_ms if is_over else None
            return GoalState("met" if is_met else "holds", t_ms, done_phrase(done, count))
        is_lost = is_over or self._at == "always"
        place = max((at for at in range(count) if self._off[at] > 0), key=lambda at: (self._off[at], -at))
        why = lost_phrase(self._key, self._cars[place], done, count, **self._details(self._off[place]))
        cars = (self._cars[place],)
        return GoalState("lost", self._off_ms[place], why, cars) if is_lost else GoalState("open", None, why, cars)


def lamp_name(led: int | str) -> Wording:
    """Name a lamp as blocks do; "off" has no name."""
    return Wording.of_page("levels", "light", str(led))


def first_off(at: str) -> float:
    """How far a car is from meeting a goal before the first moment."""
    return 0.0 if at == "always" else math.inf


def distance_to_zone_m(zone: Zone, x: float, y: float) -> float:
    """How far a point is from a zone; 0 inside."""
    if not zone.corners:
        return judging.to_disc_m(x, y, *zone.disc)
    return judging.to_outline_m([*chain.from_iterable(zone.corners)], 0, len(zone.corners), x, y)


def cars_watch(goal: Goal, mission: Mission) -> GoalWatch:
    """The watch of in-zone, out-of-zone, heading, lit or not-lit."""
    lost = f"goal-{goal.kind}-{goal.at}-lost"
    match goal.kind:
        case "in-zone" | "out-of-zone":
            return _zone_watch(goal, mission.zone(goal.values["zone"]), lost)
        case "heading":
            return _heading_watch(goal, lost)
    led, lamp = goal.values["led"], {"led": lamp_name(goal.values["led"])}
    if goal.kind == "not-lit":
        lost = "goal-not-lit-lost"
        return CarsWatch(goal, partial(_shows, led), lost, partial(_always, lamp))
    number, which = (NO_LED, "off") if led == "off" else (led, "on")
    lost = f"goal-lit-{which}-{goal.at}-lost"
    return CarsWatch(goal, partial(_shows_another, number), lost, partial(_always, lamp))


# What watches call are functions that have a name, so that watches can be pickled.


def _shows(led: int, car: int, now: Moment) -> float:
    return float(now.led[car] == led)


def _shows_another(led: int, car: int, now: Moment) -> float:
    return float(now.led[car] != led)


def _always(details: dict[str, Any], off: float) -> dict[str, Any]:
    return details


def _zone_watch(goal: Goal, zone: Zone, lost: str) -> GoalWatch:
    """Watch the centres of cars, which must be in a zone, or out of it."""
    off, half_m = (_metres_out_of, _HALF_M) if goal.kind == "in-zone" else (_is_in, 0.0)
    return CarsWatch(goal, partial(off, zone), lost, partial(_told_zone, zone), half_m)


def _metres_out_of(zone: Zone, car: int, now: Moment) -> float:
    return judging.shown_m(distance_to_zone_m(zone, now.x_m[car], now.y_m[car]))


def _is_in(zone: Zone, car: int, now: Moment) -> float:
    return float(distance_to_zone_m(zone, now.x_m[car], now.y_m[car]) == 0)


def _told_zone(zone: Zone, off: float) -> dict[str, Any]:
    return {"metres": off, "zone": zone.title}


def _heading_watch(goal: Goal, lost: str) -> GoalWatch:
    off = partial(_degrees_off, goal.values["degrees"], goal.values["tolerance_deg"])
    return CarsWatch(goal, off, lost, _told_degrees, half=_HALF_DEG)


def _degrees_off(wanted: float, tolerance: float, car: int, now: Moment) -> float:
    apart = judging.turned_deg(now.heading[car], wanted)
    return 0.0 if apart <= tolerance else apart


def _told_degrees(off: float) -> dict[str, Any]:
    # One that never had a moment has no number.
    return {"degrees": min(off, 180)}


class TravelledWatch(GoalWatch):
    """A goal for how far cars drove, measured between moments."""

    def __init__(self, goal: Goal) -> None:
        super().__init__(goal.cars, goal.values["share"])
        self._least, self._most = goal.values.get("least_m", 0.0), goal.values.get("most_m", math.inf)
        self._before: list[tuple[float, float]] | None = None
        self._driven = [0.0] * len(goal.cars)
        # As sentences show it.
        self._shown = list(self._driven)

    def see(self, moment: Moment, begun: Sequence[Event]) -> None:
        now = [(moment.x_m[car], moment.y_m[car]) for car in self._cars]
        for place, (one, other) in enumerate(zip(self._before or now, now, strict=True)):
            self._driven[place] += judging.apart_m(*one, *other)
        self._before = now
        self._now_ms = moment.t_ms
        self._shown = [judging.shown_m(each) for each in self._driven]
        if self._lost_ms is None and len(self._cars) - sum(each > self._most for each in self._shown) < self._needed:
            self._lost_ms = moment.t_ms
        self._note(self._done >= self._needed)

    @property
    def _done(self) -> int:
        return sum(self._least <= driven <= self._most for driven in self._shown)

    def state(self, is_over: bool) -> GoalState:
        done, count = self._done, len(self._cars)
        if self._lost_ms is not None or (is_over and done < self._needed):
            # Of cars that drove too far or not far enough the one that is farthest off.
            at = max(range(count), key=lambda at: (self._shown[at], -at))
            if self._lost_ms is None:
                at = min(range(count), key=lambda at: (self._shown[at], at))
            car, t_ms = self._cars[at], self._now_ms if self._lost_ms is None else self._lost_ms
            name = Phrase("the-car") if count == 1 else car_phrase(car)
            allowed = Phrase("number-range", minimum=self._least, maximum=self._most)
            if self._most == math.inf:
                allowed = Phrase("number-from", minimum=self._least)
            why = Phrase("goal-travelled-lost", car=name, metres=self._shown[at], allowed=allowed)
            return GoalState("lost", t_ms, why, (car,))
        driven = min(self._shown, default=0.0)
        why = Phrase("goal-travelled-so-far", metres=driven, done=done, count=count)
        if done < self._needed:
            return GoalState("open", None, why)
        is_final = is_over or self._most == math.inf
        return GoalState("met" if is_final else "holds", self._since_ms, why)

    def nearness(self) -> float:
        near = [
            min(driven / self._least if self._least else 1.0, self._most / driven if driven else 1.0, 1.0)
            for driven in self._shown
        ]
        return sum(sorted(near)[-self._needed :]) / self._needed


class TogetherWatch(GoalWatch):
    """A goal for how near cars are to each other: any two of them."""

    def __init__(self, goal: Goal) -> None:
        super().__init__(goal.cars)
        self._metres: float = goal.values["metres"]
        self._at = goal.values["at"]
        # How far apart which two cars are, and when: now, or where they were nearest for a goal of some moment.
        self._apart, self._apart_ms = (math.inf, self._cars[0], self._cars[0]), 0

    def see(self, moment: Moment, begun: Sequence[Event]) -> None:
        self._now_ms = moment.t_ms
        if self._lost_ms is not None or (self._at == "some-moment" and self._since_ms is not None):
            return
        apart = self._farthest(moment)
        if self._at != "some-moment" or apart[0] <= self._apart[0]:
            self._apart, self._apart_ms = apart, moment.t_ms
        is_met = apart[0] <= self._metres
        self._note(is_met)
        if self._at == "always" and not is_met:
            self._lost_ms = moment.t_ms

    def _farthest(self, moment: Moment) -> tuple[float, int, int]:
        """The two cars that are farthest from each other, and how far."""
        x, y = moment.x_m, moment.y_m
        # Only a car that is outermost in one of many directions can be one of the two.
        outer = set()
        for step in range(16):
            cosine, sine = math.cos(step * math.pi / 8), math.sin(step * math.pi / 8)
            outer.add(max(self._cars, key=lambda car: x[car] * cosine + y[car] * sine))
        pairs = [(math.dist((x[one], y[one]), (x[other], y[other])), one, other) for one in outer for other in outer]
        metres, one, other = max(pairs, key=lambda pair: (pair[0], -pair[1], -pair[2]))
        return judging.shown_m(metres), one, other

    def state(self, is_over: bool) -> GoalState:
        metres, one, other = self._apart
        why = Phrase("goal-apart", car=car_phrase(one), other=car_phrase(other), metres=metres)
        if self._since_ms is None:
            if is_over or self._lost_ms is not None:
                return GoalState("lost", self._apart_ms, why, (one, other))
            return GoalState("open", None, why, (one, other))
        is_met = is_over or self._at == "some-moment"
        t_ms = self._since_ms if self._at != "always" else self._now_ms if is_over else None
        return GoalState("met" if is_met else "holds", t_ms, why)

    def nearness(self) -> float:
        if self._at == "always":
            return (self._lost_ms or 0) / max(self._now_ms, 1)
        return self._metres / max(self._apart[0], self._metres)
