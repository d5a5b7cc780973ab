"""What is known of a pupil while the server runs: connected pages, the raised hand, and steps in a mission."""

from dataclasses import dataclass


@dataclass(slots=True)
class Presence:
    """A pupil who is here, or was. Times are seconds of the server's clock.

    Attributes:
        pages: how many pages are connected.
        left_s: when the last one left.
        hand_s: when the hand was raised; None where it isn't.
        mission: the mission that the pupil works on; None for none.
        met, goals: how many goals are met in the world in play, of how many.
        most_met: the most that have been met since the mission was opened.
        stars: all that the pupil has earned.
        step_s: when the last step in the mission was.
        stuck: there was no step for long.
        wrong_numbers: how often somebody tried to come in with a wrong number.
    """

    pages: int = 0
    left_s: float = 0.0
    hand_s: float | None = None
    mission: str | None = None
    met: int = 0
    goals: int = 0
    most_met: int = 0
    stars: int = 0
    step_s: float = 0.0
    stuck: bool = False
    wrong_numbers: int = 0

    def open_mission(self, mission: str | None, now_s: float) -> bool:
        """The pupil begins a mission, or none; opening it again is no step."""
        if mission == self.mission:
            return False
        self.mission, self.goals, self.met, self.most_met = mission, 0, 0, 0
        self._step(now_s)
        return True

    def see_goals(self, met: int, goals: int, now_s: float) -> bool:
        """So many goals are met in the pupil's world: more than ever before is a step."""
        if (met, goals) == (self.met, self.goals):
            return False
        self.met, self.goals = met, goals
        if met > self.most_met:
            self.most_met = met
            self._step(now_s)
        return True

    def earn(self, stars: int, now_s: float) -> bool:
        """The pupil has so many stars now."""
        if stars == self.stars:
            return False
        self.stars = stars
        self._step(now_s)
        return True

    def advance(self, now_s: float, stuck_s: float) -> bool:
        """Let time pass; return whether the pupil is stuck now and wasn't, or the reverse."""
        works = self.pages > 0 and self.mission is not None and not 0 < self.goals <= self.most_met
        stuck = works and now_s - self.step_s >= stuck_s
        changed = stuck != self.stuck
        self.stuck = stuck
        return changed

    def _step(self, now_s: float) -> None:
        self.step_s = now_s
        self.stuck = False
