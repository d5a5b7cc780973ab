"""Watch a mission's goals while a page plays its world, and tell how it stands with them at any stored time."""

from bisect import bisect_right

from motorcade.engine.events import START
from motorcade.engine.moment import to_moment, unpack_events
from motorcade.missions.document import Mission
from motorcade.missions.goals import GoalState
from motorcade.missions.watch import EVERY_MS, MissionWatch
from motorcade.service import history
from motorcade.service.messages import sentences
from motorcade.service.world_messages import GoalNow, Goals

assert EVERY_MS == history.EVERY_MS


class Referee:
    """Watches the goals of one mission, from the beginning of each run.

    Args:
        mission: whose goals.
        image: the bytes that the leaders run.
    """

    def __init__(self, mission: Mission, image: bytes) -> None:
        self.mission = mission
        self._image = image
        self.restart()

    def restart(self) -> None:
        """A new run begins."""
        self._watch = MissionWatch(self.mission, self._image)
        # How it stood from which time on; a time is here only where something was new.
        self._times: list[int] = []
        self._states: list[list[GoalState]] = []

    @property
    def is_over(self) -> bool:
        """Whether the run has reached the mission's end."""
        return self._watch.is_over

    def see(self, t_ms: int, moment: bytes, events: bytes, touching_ms: int) -> None:
        """Take a stored moment and the rows of events since the one before, as `motorcade.service.history` has them."""
        if self.is_over:
            return
        begun = [event for event in unpack_events(events) if event.kind == START]
        shown = to_moment(t_ms, moment, len(self.mission.mat.starts), {"touching_ms": touching_ms})
        self._watch.see(shown, begun)
        states = self._watch.states()
        if not self._states or states != self._states[-1]:
            self._times.append(t_ms)
            self._states.append(states)

    def goals(self, shown_ms: int | None) -> Goals:
        """How it stood with the goals at a stored time; None: now."""
        at = len(self._times) if shown_ms is None else bisect_right(self._times, shown_ms)
        states = self._states[max(at - 1, 0)] if self._states else []
        is_last = at == len(self._times)
        return Goals(
            is_over=self.is_over and is_last,
            goals=[GoalNow(*each[:4], sentences(each.why), list(each.cars)) for each in states],
        )
