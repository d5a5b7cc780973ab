"""Goals about what cars do: where they are, how far they drove, which LEDs are on."""

import math
from abc import abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

from motorcade.car.brain import NO_LED
from motorcade.config.check import Schema, number, whole
from motorcade.engine import judging
from motorcade.engine.moment import Event, Moment
from motorcade.errors import Phrase
from motorcade.missions.goal import (
    AT,
    CARS,
    LONGEST_S,
    WHO,
    WINDOW,
    ZONE,
    AskedGoal,
    GoalState,
    Question,
    at,
    car_phrase,
    centimetres,
    done_phrase,
    lamp_name,
    lost_phrase,
    metres,
    named,
)
from motorcade.missions.model import Goal, Mission

# A car that is so near to its start has not driven off.
_STOOD_M = 0.02
# A car that is so far off counts half in the grade of a goal.
_HALF_M = 0.5
_HALF_DEG = 45.0
_LED: Schema = {
    "title": "the number of an LED, or off: none is on",
    "type": ["integer", "string"],
    "minimum": 0,
    "maximum": 3,
    "pattern": "^off$",
    "x-allowed": ["mission-led", {}],
}


def _window_ms(goal: Goal, least_ms: int = 0) -> tuple[int, int]:
    """From when and until when moments count."""
    from_ms = round(goal.values.get("from_s", 0) * 1000)
    return max(from_ms, least_ms), round(goal.values.get("until_s", 2 * LONGEST_S) * 1000)


def _told_of(why: Phrase) -> dict[str, Any]:
    """Which car a sentence is about, and how many cars do what is asked."""
    return {name: why.details[name] for name in ("car", "tally")}


def _mean_of_best(near: list[float], needed: int) -> float:
    """The mean of the cars that came nearest, as many as must meet the goal."""
    return sum(sorted(near)[-needed:]) / needed


class CarsGoal(AskedGoal):
    """A goal for each of some cars, of which a share must meet it: at the end, at some moment of its own, or always.

    Attributes:
        half: how far off a car is that counts half in a grade; 0: only cars that meet the goal count.
    """

    optional = tuple(WINDOW)
    half: ClassVar[float] = 0.0

    @property
    def _is_always(self) -> bool:
        return self.asked.when == judging.ALWAYS

    @abstractmethod
    def lost(self, off: float) -> tuple[str, dict[str, Any]]:
        """The key of the sentence for the car that misses it most, and what that says of how far it is off."""

    def nearness(self) -> float:
        """The mean of the cars that come nearest; for `always` by their first miss."""
        off = self.off
        last_ms = max(self.last_ms, 1)
        near = []
        for place, far in enumerate(off):
            if far == 0:
                near.append(1.0)
            elif self._is_always:
                near.append(self.off_ms(place) / last_ms)
            else:
                near.append(self.half / (self.half + far))
        return _mean_of_best(near, self.needed)

    def state(self, is_over: bool) -> GoalState:
        is_over = is_over or self.has_ended
        off = self.off
        done = off.count(0.0)
        count = len(off)
        if done >= self.needed:
            return self._met(is_over, done, count)
        # The first of those that are farthest off.
        place = off.index(max(off))
        key, details = self.lost(off[place])
        t_ms, why = self.seen(place, lost_phrase(key, self.cars[place], done, count, **details))
        cars = (self.cars[place],)
        if is_over or self._is_always:
            return GoalState("lost", t_ms, why, cars)
        return GoalState("open", None, why, cars)

    def seen(self, place: int, why: Phrase) -> tuple[int, Phrase]:
        """When one can see that a car misses the goal, and what is said of that; ``why`` says it of the run."""
        t_ms = self.off_ms(place)
        if self._is_always:
            why = self.happened(t_ms, self.cars[place], why)
        return t_ms, why

    def _met(self, is_over: bool, done: int, count: int) -> GoalState:
        why = done_phrase(done, count)
        if self._is_always:
            if is_over:
                return GoalState("met", self.last_ms, why)
            return GoalState("holds", None, why)
        return self.met(is_over, why)


class _ZoneGoal(CarsGoal):
    """A goal for the centres of cars."""

    is_reached = True
    what: ClassVar[int]

    @classmethod
    def question(cls, goal: Goal, mission: Mission) -> Question:
        zone = mission.zone(goal.values["zone"])
        return Question(cls.what, AT[goal.values["at"]], zone=zone, window_ms=_window_ms(goal))

    def lost(self, off: float) -> tuple[str, dict[str, Any]]:
        zone = self.mission.zone(self.values["zone"])
        return f"goal-{self.name}-{self.values['at']}-lost", {"cm": centimetres(off), "zone": zone.title}


class InZone(_ZoneGoal):
    """Cars are in a zone. Of a run whose moments it sees it knows which cars stood, and which drove out again."""

    name = "in-zone"
    fields: ClassVar = {**CARS, "zone": ZONE, "at": at("end"), **WINDOW}
    what = judging.INSIDE
    half = _HALF_M

    def prepare(self) -> None:
        super().prepare()
        self._inside: set[int] = set()
        self._left_ms: dict[int, int] = {}
        self._driven: set[int] = set()

    def see(self, moment: Moment, begun: Sequence[Event]) -> None:
        super().see(moment, begun)
        starts = self.mission.mat.starts
        for place, (car, far) in enumerate(zip(self.cars, self.off, strict=True)):
            start = starts.x_m[car], starts.y_m[car]
            if math.dist(start, (moment.x_m[car], moment.y_m[car])) > _STOOD_M:
                self._driven.add(place)
            if far == 0:
                self._inside.add(place)
            elif place in self._inside:
                self._inside.remove(place)
                self._left_ms[place] = moment.t_ms

    def seen(self, place: int, why: Phrase) -> tuple[int, Phrase]:
        car = self.cars[place]
        if self.asked.when == judging.END and place in self._left_ms:
            t_ms = self._left_ms[place]
            out = Phrase("goal-drove-out", zone=why.details["zone"], **_told_of(why))
            return t_ms, self.happened(t_ms, car, out, stands=True)
        if self.now_ms and not self._is_always and place not in self._driven:
            return self.now_ms, Phrase("goal-stood", **_told_of(why))
        return super().seen(place, why)


class OutOfZone(_ZoneGoal):
    """Cars are not in a zone."""

    name = "out-of-zone"
    fields: ClassVar = {**CARS, "zone": ZONE, "at": at("always"), **WINDOW}
    what = judging.OUTSIDE

    @classmethod
    def forbidden_zone(cls, goal: Goal) -> str:
        if goal.values["at"] == "always" and not WINDOW.keys() & goal.values:
            return str(goal.values["zone"])
        return ""


class Travelled(AskedGoal):
    """Cars drive so far, measured between moments."""

    name = "travelled"
    fields: ClassVar = {**CARS, "least_m": metres("how far at least"), "most_m": metres("how far at most")}
    optional = ("least_m", "most_m")
    one_of = ("least_m", "most_m")
    is_reached = True

    def prepare(self) -> None:
        super().prepare()
        self._least, self._most = self.asked.figures

    @classmethod
    def question(cls, goal: Goal, mission: Mission) -> Question:
        figures = goal.values.get("least_m", 0.0), goal.values.get("most_m", math.inf)
        return Question(judging.TRAVELLED, figures=figures)

    @classmethod
    def asks(cls, goal: Goal, details: dict[str, Any]) -> Phrase:
        bounds = [name for name in cls.one_of if name in goal.values]
        lengths = {name.replace("_m", "_cm"): centimetres(goal.values[name]) for name in bounds}
        return Phrase(f"goal-{cls.name}-{'-'.join(bounds)}", **lengths, **details)

    @property
    def _driven(self) -> list[float]:
        """How far each car drove, as sentences show it."""
        return [judging.shown_m(driven) for driven in self.off]

    def see(self, moment: Moment, begun: Sequence[Event]) -> None:
        too_far = sum(driven > self._most for driven in self._driven)
        if self.lost_ms is None and len(self.cars) - too_far < self.needed:
            self.lost_ms = moment.t_ms

    def state(self, is_over: bool) -> GoalState:
        driven = self._driven
        count = len(driven)
        done = sum(self._least <= metres <= self._most for metres in driven)
        if self.lost_ms is not None or (is_over and done < self.needed):
            return self._lost(driven)
        least = centimetres(min(driven, default=0.0))
        why = Phrase("goal-travelled-so-far", cm=least, done=done, count=count)
        if done < self.needed:
            return GoalState("open", None, why)
        is_final = is_over or self._most == math.inf
        return GoalState("met" if is_final else "holds", self.met_since_ms, why)

    def _lost(self, driven: list[float]) -> GoalState:
        """Of cars that drove too far or not far enough the one that is farthest off."""
        places = range(len(driven))
        if self.lost_ms is None:
            place = min(places, key=lambda place: (driven[place], place))
            t_ms = self.last_ms
            key = "goal-travelled-too-little"
            bound = self._least
        else:
            place = max(places, key=lambda place: (driven[place], -place))
            t_ms = self.lost_ms
            key = "goal-travelled-too-far"
            bound = self._most
        car = self.cars[place]
        name = named(car, len(driven))
        why = Phrase(key, car=name, cm=centimetres(driven[place]), bound=centimetres(bound))
        if self.lost_ms is not None:
            why = self.happened(t_ms, car, why, stands=True)
        return GoalState("lost", t_ms, why, (car,))

    def nearness(self) -> float:
        return _mean_of_best([self._near(driven) for driven in self._driven], self.needed)

    def _near(self, driven: float) -> float:
        if driven < self._least:
            return driven / self._least
        if driven > self._most:
            return self._most / driven
        return 1.0


class Heading(CarsGoal):
    """Cars face so."""

    name = "heading"
    fields: ClassVar = {
        **CARS,
        "degrees": number(-360, 360, "degrees", title="counter-clockwise from the x axis"),
        "tolerance_deg": number(1, 180, "degrees", title="how far off it may be", default=15),
        "at": at("end"),
        **WINDOW,
    }
    is_reached = True
    half = _HALF_DEG

    @classmethod
    def question(cls, goal: Goal, mission: Mission) -> Question:
        figures = goal.values["degrees"], goal.values["tolerance_deg"]
        return Question(judging.FACES, AT[goal.values["at"]], figures, window_ms=_window_ms(goal))

    def lost(self, off: float) -> tuple[str, dict[str, Any]]:
        # A car that never had a moment has no number.
        return f"goal-{self.name}-{self.values['at']}-lost", {"degrees": min(off, 180)}


class NotLit(CarsGoal):
    """Cars never show a lamp."""

    name = "not-lit"
    fields: ClassVar = {**CARS, "led": whole(0, 3, title="the number of an LED"), **WINDOW}

    @classmethod
    def question(cls, goal: Goal, mission: Mission) -> Question:
        return Question(judging.NOT_LIT, judging.ALWAYS, led=goal.values["led"], window_ms=_window_ms(goal))

    def lost(self, off: float) -> tuple[str, dict[str, Any]]:
        return f"goal-{self.name}-lost", {"led": lamp_name(self.values["led"])}


class Lit(CarsGoal):
    """Cars show a lamp, or none."""

    name = "lit"
    fields: ClassVar = {**CARS, "led": _LED, "at": at("some-moment"), **WINDOW}
    is_reached = True

    @classmethod
    def _key(cls, goal: Goal) -> str:
        which = "off" if goal.values["led"] == "off" else "on"
        return f"goal-{cls.name}-{which}-{goal.values['at']}"

    @classmethod
    def question(cls, goal: Goal, mission: Mission) -> Question:
        when = AT[goal.values["at"]]
        led = goal.values["led"]
        # Before the first tick no LED is on.
        window_ms = _window_ms(goal, least_ms=int(when == judging.ALWAYS))
        if led == "off":
            led = NO_LED
        return Question(judging.LIT, when, led=led, window_ms=window_ms)

    @classmethod
    def asks(cls, goal: Goal, details: dict[str, Any]) -> Phrase:
        return Phrase(cls._key(goal), **details)

    def lost(self, off: float) -> tuple[str, dict[str, Any]]:
        return f"{self._key(self.goal)}-lost", {"led": lamp_name(self.values["led"])}


class Together(AskedGoal):
    """Cars are near to each other: any two of them."""

    name = "together"
    fields: ClassVar = {"who": WHO, "metres": metres("the distance between any two of them at most"), "at": at("end")}
    is_reached = True

    @classmethod
    def question(cls, goal: Goal, mission: Mission) -> Question:
        return Question(judging.TOGETHER, AT[goal.values["at"]], (0.0, goal.values["metres"]))

    @classmethod
    def asks(cls, goal: Goal, details: dict[str, Any]) -> Phrase:
        return super().asks(goal, details | {"cm": centimetres(goal.values["metres"])})

    @property
    def _apart_m(self) -> float:
        """How far apart two cars are: now, or where they were nearest for a goal of some moment."""
        return self.off[0]

    def state(self, is_over: bool) -> GoalState:
        one, other = map(int, self.run.answers.before[0][3 * self.first :][:2])
        if not self.run.times_ms:
            one = other = self.cars[0]
        why = Phrase("goal-apart", car=car_phrase(one), other=car_phrase(other), cm=centimetres(self._apart_m))
        is_always = self.asked.when == judging.ALWAYS
        if self.met_since_ms is None or not self.run.times_ms:
            if is_over or (is_always and self.run.times_ms):
                return GoalState("lost", self.off_ms(0), why, (one, other))
            return GoalState("open", None, why, (one, other))
        if is_always:
            return self.kept(is_over, why)
        return self.met(is_over, why)

    def nearness(self) -> float:
        if self.asked.when == judging.ALWAYS:
            return self.off_ms(0) / max(self.last_ms, 1)
        most_m: float = self.values["metres"]
        return most_m / max(self._apart_m, most_m)
