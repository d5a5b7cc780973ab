"""Goals about other goals, and about other runs."""

from collections.abc import Sequence
from typing import Any, ClassVar

from motorcade.config.check import number as a_number
from motorcade.config.check import whole
from motorcade.engine.moment import Event, Moment
from motorcade.errors import Phrase
from motorcade.mats.model import Mat
from motorcade.missions.goal import MOST_GOALS, Declared, GoalFault, GoalKind, GoalState, seconds
from motorcade.missions.model import Goal

_MOST_TRIED = 200
_TRIED = 100


class AllBy(GoalKind):
    """Another goal is met by some time, and from then on to the end of the run."""

    name = "all-by"
    fields: ClassVar = {
        "goal": whole(1, MOST_GOALS, title="the number of another goal, from 1"),
        "seconds": seconds("until when"),
    }
    decided_by = "others"

    def prepare(self) -> None:
        self._number = self.values["goal"]
        self._seconds = self.values["seconds"]
        self._by_ms = round(self._seconds * 1000)
        # How the other goal stood last, at the time, and when it was lost again after it was met in time.
        self._before: GoalState | None = None
        self._then: GoalState | None = None
        self._gone: GoalState | None = None

    @classmethod
    def fault(cls, goal: Goal, others: Declared, mat: Mat) -> GoalFault | None:
        number = goal.values["goal"]
        if number <= len(others):
            other, kind = others[number - 1]
            if kind.is_reached and other.values.get("at") != "always":
                return None
        return GoalFault("mission-goal-not-reached", ("goal",))

    @property
    def _other(self) -> GoalKind:
        return self.run.goals[self._number - 1]

    def see(self, moment: Moment, begun: Sequence[Event]) -> None:
        """Look at the other goal, which has seen this moment."""
        super().see(moment, begun)
        t_ms = moment.t_ms
        before = self._before
        now = self._other.state(False)
        if before and before.progress == "holds" and now.progress == "open" and self._in_time(before):
            self._gone = now._replace(t_ms=t_ms)
        if t_ms <= self._by_ms:
            self._then = now._replace(t_ms=t_ms)
        self._before = now

    def _in_time(self, other: GoalState) -> bool:
        return other.t_ms is not None and other.t_ms <= self._by_ms

    def state(self, is_over: bool) -> GoalState:
        other = self._other.state(is_over)
        most = {"most": self._seconds}
        why = Phrase("goal-all-by-not", **most)
        if other.progress in ("met", "holds") and other.t_ms is not None:
            why = Phrase("goal-all-by-when", seconds=other.t_ms / 1000, **most)
            if self._in_time(other):
                return GoalState(other.progress, other.t_ms, why)
        elif not (is_over or self.now_ms > self._by_ms or other.progress == "lost"):
            return GoalState("open", None, why)
        # What is wrong is seen where the other goal was lost again, or else at the time itself.
        seen = self._gone or self._then or other
        if self._gone:
            why = Phrase("goal-all-by-gone", reason=self._gone.why, **most)
        return GoalState("lost", seen.t_ms, why, seen.cars)

    def nearness(self) -> float:
        """Half the grade of the other goal, and more where that was met soon after the time."""
        other = self._other.state(True)
        late = 0.0
        if other.progress in ("met", "holds") and other.t_ms is not None:
            late = self._by_ms / (2 * max(other.t_ms, self._by_ms + 1))
        return self._other.grade(True) / 2 + late


class Works(GoalKind):
    """On other seeds the first star's goals are met, too; `motorcade.missions.check` tries them."""

    name = "works"
    fields: ClassVar = {
        "share": a_number(0.01, 1, title="the part of these runs in which the first star's goals are met", default=0.9),
        "seeds": whole(10, _MOST_TRIED, title="on how many other seeds the program runs", default=_TRIED),
    }
    decided_by = "others"
    tries_other_seeds = True

    @classmethod
    def fault(cls, goal: Goal, others: Declared, mat: Mat) -> GoalFault | None:
        if goal.star == 1:
            return GoalFault("not-allowed", ("star",), "1", "2, 3")
        return None

    @classmethod
    def other_runs(cls, document: dict[str, Any]) -> int:
        runs: int = document.get("seeds", _TRIED)
        return runs

    @classmethod
    def asks(cls, goal: Goal, details: dict[str, Any]) -> Phrase:
        return Phrase(f"goal-{cls.name}", percent=goal.values["share"] * 100, count=goal.values["seeds"])

    def state(self, is_over: bool) -> GoalState:
        return GoalState("open", None, Phrase("goal-works-open"))

    def nearness(self) -> float:
        return 0.0
