"""Goals about safety: no car touches anything, and cars stop when a voice says so."""

import math
from collections.abc import Sequence

from motorcade.car.brain import STILL
from motorcade.engine.moment import Event, Moment
from motorcade.errors import Phrase
from motorcade.mats.model import Mat
from motorcade.missions.goals import (
    GoalState,
    GoalWatch,
    car_phrase,
    distance_to_zone_m,
    done_phrase,
    lost_phrase,
)
from motorcade.missions.model import Goal, Mission, Wording, Zone

# Two bodies that stand nearer than this touch, for the sentence about a touch.
_TOUCH_M = 0.01
# A car has stopped by this time after a voice said so.
_VOICE_MS = 300


class NoTouchWatch(GoalWatch):
    """A goal: no car touches another, a wall or an obstacle. The engine counts every touch, also between moments."""

    def __init__(self, mission: Mission) -> None:
        super().__init__()
        self._mat = mission.mat
        self._diameter_m = mission.profile.body.diameter_mm / 1000
        self._touching_ms = 0
        self._who: tuple[int, ...] = ()

    def see(self, moment: Moment, events: Sequence[Event]) -> None:
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
        lines = [((x0, y0), (x1, y1)) for x0, y0, x1, y1 in self._mat.walls]
        name = Wording({})
        things = [Zone("", name, corners) for corners in (*lines, *self._mat.polygons)]
        things += [Zone("", name, disc=disc) for disc in self._mat.discs]
        apart = [distance_to_zone_m(each, x, y) for each in things]
        if self._mat.walled and self._mat.size_m:
            width, height = self._mat.size_m
            apart += [x, width - x, y, height - y]
        return min(apart, default=math.inf)

    def nearness(self) -> float:
        """1 for a run without touches, 1/2 for touches of one second in all."""
        return 1000 / (1000 + self._touching_ms)

    def state(self, is_over: bool) -> GoalState:
        if self._lost_ms is None:
            why = Phrase("goal-no-touch-done")
            return GoalState("met" if is_over else "holds", self._now_ms if is_over else None, 0, 0, why)
        seconds = {"seconds": self._lost_ms / 1000, "touching": self._touching_ms / 1000}
        one, *others = map(car_phrase, self._who)
        why = Phrase("goal-touched-wall", car=one, **seconds)
        if others:
            why = Phrase("goal-touched", car=one, other=others[0], **seconds)
        return GoalState("lost", self._lost_ms, 0, 0, why, self._who)


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

    def see(self, moment: Moment, events: Sequence[Event]) -> None:
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
            return GoalState("lost", failed_ms, done, self._needed, why, (car,))
        if not self._stops:
            t_ms = self._now_ms if is_over else None
            return GoalState("lost" if is_over else "open", t_ms, 0, self._needed, Phrase("goal-voice-open"))
        why = done_phrase(done, count)
        return GoalState("met" if is_over else "holds", self._now_ms if is_over else None, done, self._needed, why)
