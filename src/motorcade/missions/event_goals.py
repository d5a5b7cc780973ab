"""Goals about what happens: words that cars begin, touches, and what a voice says; and about the program's words.

A slot is the time in which the leader sends one word.
"""

import math
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, ClassVar

from motorcade.config.check import number as a_number
from motorcade.config.check import whole
from motorcade.engine import judging
from motorcade.engine.moment import Event, Moment
from motorcade.engine.slots import Slots
from motorcade.errors import Phrase
from motorcade.mats.geometry import surfaces
from motorcade.mats.model import Mat
from motorcade.missions.goal import (
    CARS,
    WHO,
    AskedGoal,
    Attempt,
    Declared,
    GoalFault,
    GoalKind,
    GoalState,
    Question,
    car_phrase,
    done_phrase,
    lost_phrase,
    named,
    needed_of,
    seconds,
)
from motorcade.missions.model import Goal, Mission

# Two bodies that stand nearer than this touch, for the sentence about a touch.
_TOUCH_M = 0.01
_COUNT = whole(0, 255, title="how many at most")


def _slots_of(attempt: Attempt) -> Slots:
    mission = attempt.mission
    return attempt.once("slots", lambda: Slots(attempt.image, mission.profile, mission.duration_ms))


class SlotGoal(GoalKind):
    """A goal that is decided slot by slot: when the slot after it is over, or the run. Leaders don't count."""

    has_events = True

    def prepare(self) -> None:
        leaders = set(self.mission.mat.starts.leaders)
        self.cars = [car for car in self.goal.cars if car not in leaders]
        self.needed = needed_of(self.values["share"], len(self.cars))
        self._slots = _slots_of(self.run.attempt)
        # When each car first began the word of each slot that is not judged yet.
        self._begun: dict[int, dict[int, int]] = {}
        self._judged = 0

    def see(self, moment: Moment, begun: Sequence[Event]) -> None:
        super().see(moment, begun)
        cars = set(self.cars)
        for event in begun:
            if event.car in cars:
                slot = self._slots.of(event.t_ms, event.word, event.other)
                if slot >= self._judged:
                    self._begun.setdefault(slot, {}).setdefault(event.car, event.t_ms)
        self._judge_until(moment.t_ms)

    def _judge_until(self, t_ms: float) -> None:
        """Judge the slots whose following slot is over by then."""
        while self._judged < self._slots.count and (self._judged + 2) * self._slots.dwell_ms <= t_ms:
            self.judge(self._judged, self._begun.pop(self._judged, {}))
            self._judged += 1

    def state(self, is_over: bool) -> GoalState:
        if not (self._slots.count and self.cars):
            why = Phrase("goal-no-words" if self.cars else "goal-no-followers")
            # Nobody has lost anything before they first play.
            if not self.now_ms:
                return GoalState("open", None, why)
            return GoalState("lost", 0, why)
        if is_over:
            self._judge_until(math.inf)
        return self.judged_state(is_over)

    @abstractmethod
    def judge(self, slot: int, begun: dict[int, int]) -> None:
        """Take the result of a slot: when each car that did so began its word, in ms."""

    @abstractmethod
    def judged_state(self, is_over: bool) -> GoalState:
        """How it stands with the slots that were judged."""

    def _end_ms(self, slot: int) -> int:
        """The end of a slot: who has not begun its word by then is seen to miss it."""
        return min((slot + 1) * self._slots.dwell_ms, self.now_ms)


class InStep(SlotGoal):
    """In every slot cars begin the word at nearly the same time."""

    name = "in-step"
    fields: ClassVar = {
        **CARS,
        "within_ms": whole(1, 10_000, "milliseconds", title="how far apart they may begin a word"),
    }

    def prepare(self) -> None:
        super().prepare()
        self._within_ms = self.values["within_ms"]
        self._worst_ms = self._done = 0
        self._lost: GoalState | None = None

    def judge(self, slot: int, begun: dict[int, int]) -> None:
        times = sorted(begun.values())
        need = self.needed
        if len(times) < need:
            silent = min(car for car in self.cars if car not in begun)
            why = Phrase("goal-step-unheard", car=car_phrase(silent), seconds=slot * self._slots.dwell_ms / 1000)
            self._lost = self._lost or GoalState("lost", self._end_ms(slot), why, (silent,))
            return
        spread_ms = min((times[at + need - 1] - times[at] for at in range(len(times) - need + 1)), default=0)
        self._worst_ms = max(self._worst_ms, spread_ms)
        if spread_ms > self._within_ms:
            last = max(begun, key=lambda car: (begun[car], -car))
            late_ms = begun[last] - times[0]
            why = Phrase("goal-step-late", car=car_phrase(last), late_ms=late_ms, most_ms=self._within_ms)
            self._lost = self._lost or GoalState("lost", begun[last], why, (last,))
        else:
            self._done += 1

    def nearness(self) -> float:
        count = self._slots.count
        return self._done / max(count, 1)

    def judged_state(self, is_over: bool) -> GoalState:
        if self._lost:
            return self._lost
        why = Phrase("goal-step-so-far", late_ms=self._worst_ms)
        if is_over:
            return GoalState("met", self.now_ms, why)
        return GoalState("holds" if self._judged else "open", None, why)


class NoTouch(GoalKind):
    """No car touches another, a wall or an obstacle. The engine counts every touch, also between moments."""

    name = "no-touch"

    def prepare(self) -> None:
        self._mat = self.mission.mat
        self._diameter_m = self.mission.profile.body.diameter_mm / 1000
        self._touching_ms = 0
        self._who: tuple[int, ...] = ()

    def see(self, moment: Moment, begun: Sequence[Event]) -> None:
        super().see(moment, begun)
        self._touching_ms = moment.counts.get("touching_ms", 0)
        if self._touching_ms and self.lost_ms is None:
            self.lost_ms = moment.t_ms
            self._who = self._nearest(moment)

    @classmethod
    def compared(cls, goal: Goal, mission: Mission) -> int:
        mat = mission.mat
        return len(mat.starts) * (len(mat.walls) + len(mat.discs) + sum(map(len, mat.polygons)))

    def _nearest(self, moment: Moment) -> tuple[int, ...]:
        """The two cars that touch, or else the one that is nearest to a wall or an obstacle."""
        places = sorted(zip(moment.x_m, moment.y_m, range(len(moment.x_m)), strict=True))
        best = self._diameter_m + _TOUCH_M
        nearest = min(places, key=lambda place: self._clearance_m(place[0], place[1]))
        found: tuple[int, ...] = (nearest[2],)
        for at, (x, y, car) in enumerate(places):
            for other_x, other_y, other in places[at + 1 :]:
                if other_x - x > best:
                    break
                apart = math.hypot(other_x - x, other_y - y)
                if apart < best:
                    best = apart
                    found = (min(car, other), max(car, other))
        return found

    def _clearance_m(self, x: float, y: float) -> float:
        """How far a point is from what stands on the mat, or from its walled edge."""
        nearest_m = math.inf
        for surface in surfaces(self._mat, x, y):
            nearest_m = min(nearest_m, math.hypot(surface.x_m - x, surface.y_m - y) - surface.thick_m)
        return nearest_m

    def nearness(self) -> float:
        """1 for a run without touches, 1/2 for touches of one second in all."""
        return 1000 / (1000 + self._touching_ms)

    def state(self, is_over: bool) -> GoalState:
        if self.lost_ms is None:
            return self.kept(is_over, Phrase("goal-no-touch-done"))
        one, *others = (named(car, len(self._mat.starts)) for car in self._who)
        what = Phrase("goal-touched-wall", car=one)
        if others:
            what = Phrase("goal-touched", car=one, other=others[0])
        why = self.happened(self.lost_ms, self._who[0], what)
        return GoalState("lost", self.lost_ms, why, self._who)


class Heard(SlotGoal):
    """Cars begin a share of all words, counted car by car."""

    name = "heard"
    fields: ClassVar = {"who": WHO, "share": a_number(0.01, 1, title="the part of all words, car by car", default=1)}

    def prepare(self) -> None:
        super().prepare()
        self._heard = dict.fromkeys(self.cars, 0)
        # The first slot whose word each car missed.
        self._missed: dict[int, int] = {}
        self._pairs = self._slots.count * len(self.cars)
        self.needed = needed_of(self.values["share"], self._pairs)

    @classmethod
    def who(cls, goal: Goal) -> Phrase:
        """Name the cars; the share is one of words."""
        return super().who(replace(goal, values=goal.values | {"share": 1}))

    @classmethod
    def asks(cls, goal: Goal, details: dict[str, Any]) -> Phrase:
        return Phrase(f"goal-{cls.name}", percent=goal.values["share"] * 100, **details)

    def judge(self, slot: int, begun: dict[int, int]) -> None:
        for car in begun:
            self._heard[car] += 1
        for car in self.cars:
            if car not in begun:
                self._missed.setdefault(car, slot)
        missed = (slot + 1) * len(self.cars) - sum(self._heard.values())
        if missed > self._pairs - self.needed and self.lost_ms is None:
            self.lost_ms = min((slot + 2) * self._slots.dwell_ms, self.now_ms)

    def judged_state(self, is_over: bool) -> GoalState:
        done = sum(self._heard.values())
        if self.lost_ms is not None:
            car = min(self.cars, key=lambda car: (self._heard[car], car))
            why = Phrase("goal-never-heard", car=car_phrase(car), count=self._judged)
            if self._heard[car]:
                why = Phrase("goal-heard-few", car=car_phrase(car), done=self._heard[car], count=self._judged)
            return GoalState("lost", self._end_ms(self._missed[car]), why, (car,))
        why = Phrase("goal-heard-so-far", done=done, count=self._judged * len(self.cars))
        if done >= self.needed:
            return GoalState("met", self.now_ms, why)
        return GoalState("holds" if self._judged else "open", None, why)

    def nearness(self) -> float:
        return sum(self._heard.values()) / max(self.needed, 1)


class StoppedByVoice(AskedGoal):
    """Cars that drive when the mat's voice says 'stop' stand still from then until it says 'go'."""

    name = "stopped-by-voice"
    fields: ClassVar = CARS

    @classmethod
    def question(cls, goal: Goal, mission: Mission) -> Question:
        voices: list[tuple[float, float]] = []
        for voice in sorted(mission.mat.voices, key=lambda voice: voice.at_s):
            radius_m = voice.radius_m
            if radius_m is None:
                radius_m = -1.0
            voices += [(round(voice.at_s * 1000), voice.x_m), (voice.y_m, radius_m), (float(voice.word == "go"), 0.0)]
        return Question(judging.OBEYS, corners=tuple(voices))

    @classmethod
    def fault(cls, goal: Goal, others: Declared, mat: Mat) -> GoalFault | None:
        is_heard = any(voice.word == "stop" for voice in mat.voices)
        if is_heard:
            return None
        return GoalFault("mission-without-voice")

    @property
    def _is_told(self) -> bool:
        """Whether a voice has said 'stop' before the last moment."""
        stops = (round(voice.at_s * 1000) for voice in self.mission.mat.voices if voice.word == "stop")
        return bool(self.run.times_ms) and min(stops) < self.run.times_ms[-1]

    def nearness(self) -> float:
        if not self._is_told:
            return 0.0
        return self.off.count(0.0) / self.needed

    def state(self, is_over: bool) -> GoalState:
        off = self.off
        count = len(off)
        if not self._is_told:
            why = Phrase("goal-voice-open")
            if is_over:
                return GoalState("lost", self.run.times_ms[-1], why)
            return GoalState("open", None, why)
        done = off.count(0.0)
        if done < self.needed:
            # Of the cars that failed the one with the lowest number.
            car, place = min((car, place) for place, car in enumerate(self.cars) if off[place])
            how = "stood" if off[place] == judging.STOOD else "drove"
            why = lost_phrase(f"goal-voice-{how}", car, done, count)
            return GoalState("lost", self.off_ms(place), why, (car,))
        return self.kept(is_over, done_phrase(done, count))


class ProgramGoal(GoalKind):
    """A goal that the program alone decides: something of it is at most so large."""

    decided_by = "program"

    @abstractmethod
    def value(self) -> float:
        """What the program has."""

    @abstractmethod
    def most(self) -> float:
        """What it may have."""

    def state(self, is_over: bool) -> GoalState:
        value = self.value()
        most = self.most()
        if value <= most:
            return GoalState("met", 0, Phrase("goal-done"))
        return GoalState("lost", 0, Phrase(f"goal-{self.name}-lost", value=value, most=most))

    def nearness(self) -> float:
        most = self.most()
        return most / max(self.value(), most, 1e-9)


class _CountGoal(ProgramGoal):
    fields: ClassVar = {"count": _COUNT}

    def most(self) -> int:
        count: int = self.values["count"]
        return count


class WordsAtMost(_CountGoal):
    """The program has so many words for followers."""

    name = "words-at-most"

    def value(self) -> int:
        return len(self.run.attempt.image.followers)


class StatesAtMost(_CountGoal):
    """The leader has so many states."""

    name = "states-at-most"

    def value(self) -> int:
        return len(self.run.attempt.image.leader)


class SecondsAtMost(ProgramGoal):
    """One round of the program is so long."""

    name = "seconds-at-most"
    fields: ClassVar = {"seconds": seconds("how long one round of the program lasts at most")}

    def value(self) -> float:
        attempt = self.run.attempt
        followers_ms = len(attempt.image.followers) * _slots_of(attempt).dwell_ms
        return max(attempt.round_ms, followers_ms) / 1000

    def most(self) -> float:
        most_s: float = self.values["seconds"]
        return most_s
