"""Goals about what happens: words that cars begin, touches, and what a voice says; and about the program's words.

A slot is the time in which the leader sends one word.
"""

import math
from abc import abstractmethod
from collections.abc import Sequence

from motorcade.car.brain import STILL
from motorcade.config.profile import Profile
from motorcade.engine.moment import Event, Moment
from motorcade.engine.slots import Slots
from motorcade.errors import Phrase
from motorcade.mats.geometry import surfaces
from motorcade.mats.model import Mat
from motorcade.missions.goals import (
    FixedWatch,
    GoalProgress,
    GoalState,
    GoalWatch,
    car_phrase,
    done_phrase,
    lost_phrase,
    needed_of,
)
from motorcade.missions.model import Goal, Mission
from motorcade.program.compiler import length_ms
from motorcade.words.image import Image

# Two bodies that stand nearer than this touch, for the sentence about a touch.
_TOUCH_M = 0.01
# A car has stopped by this time after a voice said so.
_VOICE_MS = 300


class SlotWatch(GoalWatch):
    """A goal that is decided slot by slot: when the slot after it is over, or the run.

    Args:
        goal: a goal of followers; leaders among its cars don't count.
    """

    def __init__(self, goal: Goal, mission: Mission, slots: Slots) -> None:
        leaders = set(mission.mat.starts.leaders)
        super().__init__([car for car in goal.cars if car not in leaders], goal.values["share"])
        self._slots = slots
        # When each car first began the word of each slot that is not judged yet.
        self._begun: dict[int, dict[int, int]] = {}
        self._judged = 0

    def see(self, moment: Moment, begun: Sequence[Event]) -> None:
        self._now_ms = moment.t_ms
        cars = set(self._cars)
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
        if not (self._slots.count and self._cars):
            why = Phrase("goal-no-words") if self._cars else Phrase("goal-no-followers")
            # Nobody has lost anything before they first play.
            return GoalState("lost" if self._now_ms else "open", 0 if self._now_ms else None, why)
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
        return min((slot + 1) * self._slots.dwell_ms, self._now_ms)


class HeardWatch(SlotWatch):
    """A goal: cars begin a share of all words, counted car by car."""

    def __init__(self, goal: Goal, mission: Mission, slots: Slots) -> None:
        super().__init__(goal, mission, slots)
        self._heard = dict.fromkeys(self._cars, 0)
        # The first slot whose word each car missed.
        self._missed: dict[int, int] = {}
        self._pairs = slots.count * len(self._cars)
        self._needed = needed_of(goal.values["share"], self._pairs)

    def judge(self, slot: int, begun: dict[int, int]) -> None:
        for car in begun:
            self._heard[car] += 1
        for car in self._cars:
            if car not in begun:
                self._missed.setdefault(car, slot)
        missed = (slot + 1) * len(self._cars) - sum(self._heard.values())
        if missed > self._pairs - self._needed and self._lost_ms is None:
            self._lost_ms = min((slot + 2) * self._slots.dwell_ms, self._now_ms)

    def judged_state(self, is_over: bool) -> GoalState:
        done = sum(self._heard.values())
        if self._lost_ms is not None:
            car = min(self._cars, key=lambda car: (self._heard[car], car))
            why = Phrase("goal-never-heard", car=car_phrase(car), count=self._judged)
            if self._heard[car]:
                why = Phrase("goal-heard-few", car=car_phrase(car), done=self._heard[car], count=self._judged)
            return GoalState("lost", self._end_ms(self._missed[car]), why, (car,))
        progress: GoalProgress = "met" if done >= self._needed else "holds" if self._judged else "open"
        why = Phrase("goal-heard-so-far", done=done, count=self._judged * len(self._cars))
        return GoalState(progress, self._now_ms if progress == "met" else None, why)

    def nearness(self) -> float:
        return sum(self._heard.values()) / self._needed if self._needed else 0.0


class InStepWatch(SlotWatch):
    """A goal: in every slot cars begin the word at nearly the same time."""

    def __init__(self, goal: Goal, mission: Mission, slots: Slots) -> None:
        super().__init__(goal, mission, slots)
        self._within_ms = goal.values["within_ms"]
        self._worst_ms = self._done = 0
        self._lost: GoalState | None = None

    def judge(self, slot: int, begun: dict[int, int]) -> None:
        times = sorted(begun.values())
        need = self._needed
        if len(times) < need:
            silent = min(car for car in self._cars if car not in begun)
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
        return self._done / self._slots.count if self._slots.count else 0.0

    def judged_state(self, is_over: bool) -> GoalState:
        if self._lost:
            return self._lost
        progress: GoalProgress = "met" if is_over else "holds" if self._judged else "open"
        why = Phrase("goal-step-so-far", late_ms=self._worst_ms)
        return GoalState(progress, self._now_ms if is_over else None, why)


def static_watch(goal: Goal, image: Image, profile: Profile) -> GoalWatch:
    """The watch of a goal that the program alone decides."""
    if goal.kind == "seconds-at-most":
        leader_ms = sum(length_ms(word, profile) for word in image.leader)
        followers_ms = len(image.followers) * (profile.dwell_ms[image.dwell_level] if image.followers else 0)
        value, most = max(leader_ms, followers_ms) / 1000, goal.values["seconds"]
        why = Phrase("goal-seconds-count", seconds=value, most=most)
    else:
        value, most = len(image.followers if goal.kind == "words-at-most" else image.leader), goal.values["count"]
        why = Phrase(f"goal-{goal.kind}-count", count=value, most=most)
    state = GoalState("met" if value <= most else "lost", 0, why)
    return FixedWatch(state, most / max(value, most) if most else 0.0)


class NoTouchWatch(GoalWatch):
    """A goal: no car touches another, a wall or an obstacle. The engine counts every touch, also between moments."""

    def __init__(self, mission: Mission) -> None:
        super().__init__()
        self._mat = mission.mat
        self._diameter_m = mission.profile.body.diameter_mm / 1000
        self._touching_ms = 0
        self._who: tuple[int, ...] = ()

    def see(self, moment: Moment, begun: Sequence[Event]) -> None:
        self._now_ms = moment.t_ms
        self._touching_ms = moment.counts.get("touching_ms", 0)
        if self._touching_ms and self._lost_ms is None:
            self._lost_ms = moment.t_ms
            self._who = self._nearest(moment)

    def _nearest(self, moment: Moment) -> tuple[int, ...]:
        """The two cars that touch, or else the one that is nearest to a wall or an obstacle."""
        places = sorted(zip(moment.x_m, moment.y_m, range(len(moment.x_m)), strict=True))
        best = self._diameter_m + _TOUCH_M
        found: tuple[int, ...] = (min(places, key=lambda each: self._clearance_m(*each[:2]))[2],)
        for at, (x, y, car) in enumerate(places):
            for other_x, other_y, other in places[at + 1 :]:
                if other_x - x > best:
                    break
                apart = math.hypot(other_x - x, other_y - y)
                if apart < best:
                    best, found = apart, (min(car, other), max(car, other))
        return found

    def _clearance_m(self, x: float, y: float) -> float:
        """How far a point is from what stands on the mat, or from its walled edge."""
        apart = (math.hypot(each.x_m - x, each.y_m - y) - each.thick_m for each in surfaces(self._mat, x, y))
        return min(apart, default=math.inf)

    def nearness(self) -> float:
        """1 for a run without touches, 1/2 for touches of one second in all."""
        return 1000 / (1000 + self._touching_ms)

    def state(self, is_over: bool) -> GoalState:
        if self._lost_ms is None:
            why = Phrase("goal-no-touch-done")
            return GoalState("met" if is_over else "holds", self._now_ms if is_over else None, why)
        seconds = {"seconds": self._lost_ms / 1000, "touching": self._touching_ms / 1000}
        one, *others = map(car_phrase, self._who)
        why = Phrase("goal-touched-wall", car=one, **seconds)
        if others:
            why = Phrase("goal-touched", car=one, other=others[0], **seconds)
        return GoalState("lost", self._lost_ms, why, self._who)


class VoiceWatch(GoalWatch):
    """A goal: cars that drive when the mat's voice says 'stop' stand still from then until it says 'go'."""

    def __init__(self, goal: Goal, mat: Mat) -> None:
        super().__init__(goal.cars, goal.values["share"])
        self._voices = [(round(voice.at_s * 1000), voice) for voice in sorted(mat.voices, key=lambda each: each.at_s)]
        self._next = 0
        self._before: Moment | None = None
        # Of each car that has to stand still: since when.
        self._told: dict[int, int] = {}
        # Of each car that failed: how, and when.
        self._failed: dict[int, tuple[str, int]] = {}
        self._stops = 0

    def see(self, moment: Moment, begun: Sequence[Event]) -> None:
        self._now_ms = moment.t_ms
        before = self._before or moment
        while self._next < len(self._voices) and self._voices[self._next][0] < moment.t_ms:
            at_ms, voice = self._voices[self._next]
            self._next += 1
            for car in self._cars:
                apart = math.hypot(before.x_m[car] - voice.x_m, before.y_m[car] - voice.y_m)
                if voice.radius_m is not None and apart > voice.radius_m:
                    continue
                if voice.word == "go":
                    self._told.pop(car, None)
                elif before.wheels[car] == STILL and car not in self._told:
                    self._failed.setdefault(car, ("stood", before.t_ms))
                else:
                    self._told.setdefault(car, at_ms)
            self._stops += voice.word == "stop"
        for car, at_ms in self._told.items():
            if moment.t_ms >= at_ms + _VOICE_MS and moment.wheels[car] != STILL:
                self._failed.setdefault(car, ("drove", moment.t_ms))
        if self._lost_ms is None and len(self._cars) - len(self._failed) < self._needed:
            self._lost_ms = moment.t_ms
        self._before = moment

    def nearness(self) -> float:
        return (len(self._cars) - len(self._failed)) / self._needed if self._stops else 0.0

    def state(self, is_over: bool) -> GoalState:
        count = len(self._cars)
        done = count - len(self._failed) if self._stops else 0
        if self._lost_ms is not None:
            car = min(self._failed)
            how, failed_ms = self._failed[car]
            why = lost_phrase(f"goal-voice-{how}", car, done, count)
            return GoalState("lost", failed_ms, why, (car,))
        if not self._stops:
            t_ms = self._now_ms if is_over else None
            return GoalState("lost" if is_over else "open", t_ms, Phrase("goal-voice-open"))
        why = done_phrase(done, count)
        return GoalState("met" if is_over else "holds", self._now_ms if is_over else None, why)
