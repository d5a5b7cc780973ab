"""Stop a world when a car touches something, loses a message, enters a zone, begins a block, or is stuck, or when a
condition of a leader is met.

What is looked at is what a page draws, the columns of a picture and rows of events, every LOOK_MS.
"""

from collections.abc import Iterator, Sequence
from typing import Any

from motorcade.engine.events import LOSS_REASONS, LOST, START, STATE
from motorcade.engine.judging import to_disc_m, to_outline_m
from motorcade.engine.moment import STUCK, unpack_events, unpack_moment
from motorcade.errors import Phrase
from motorcade.mats.geometry import Obstacle
from motorcade.missions.goal import car_phrase
from motorcade.service.messages import sentences
from motorcade.service.studio_world import StudioWorld
from motorcade.service.why import touched
from motorcade.service.world_messages import StopCondition, Stopped

# A picture shows more.
LOOK_MS = 20
# A car, another one that it has to do with (_NOBODY: none), and what tells this from other such things.
_Key = tuple[int, int, str]
_NOBODY = -1


class Breakpoints:
    """The conditions on which a page's world stops; each when it begins to hold, not as long as it does.

    Args:
        world: is looked at from now on.
        conditions: any of them stops the world.
    """

    def __init__(self, world: StudioWorld, conditions: Sequence[StopCondition] = ()) -> None:
        self._world = world
        self.conditions = conditions
        self._stopped: Stopped | None = None
        # What held at the last look, of each condition; None: nothing was seen yet.
        self._held: list[set[_Key] | None] = [None] * len(conditions)
        self._touching_ms = world.simulation.totals()["touching_ms"]
        # What the cars show now, where a condition asked for it.
        self._columns: dict[str, Any] | None = None

    def take(self) -> list[Stopped]:
        """Return the stop that was not told yet, if there is one."""
        stopped = self._stopped
        self._stopped = None
        if stopped:
            return [stopped]
        return []

    def see(self, events: bytes) -> bool:
        """Look at the world, with the rows of events since the last look; return whether it has to stop."""
        self._columns = self._stopped = None
        for number, condition in enumerate(self.conditions):
            before = self._held[number]
            now = dict(self._holding(condition, events))
            self._held[number] = set(now)
            # A car that is in the zone when the condition is set doesn't enter it.
            if before is None and condition.kind in ("zone", "stuck", "condition"):
                first = set(now)
            else:
                first = before or set()
            begun = sorted(set(now) - first)
            if begun and self._stopped is None:
                car, other, *_ = begun[0]
                others = []
                if other >= 0:
                    others = [other]
                self._stopped = Stopped(self._world.now_ms, number, car, others, sentences(now[begun[0]]))
        if any(condition.kind == "touch" for condition in self.conditions):
            self._touching_ms = self._world.simulation.totals()["touching_ms"]
        return self._stopped is not None

    def _now(self) -> dict[str, Any]:
        """What the cars show now."""
        if self._columns is None:
            self._columns = unpack_moment(self._world.pictures.look(), self._world.cars)
        return self._columns

    def _holding(self, condition: StopCondition, events: bytes) -> Iterator[tuple[_Key, Phrase]]:
        """What holds now, and the sentence about it."""
        world = self._world
        cars = range(world.cars)
        if condition.car is not None:
            cars = cars[condition.car : condition.car + 1]
        match condition.kind:
            case "touch" if world.simulation.totals()["touching_ms"] > self._touching_ms:
                x_m = self._now()["x_m"]
                y_m = self._now()["y_m"]
                for car, thing in touched(world.simulation.mat, cars, x_m, y_m, world.radius_m):
                    if condition.thing in ("", thing.kind) and condition.number in (None, thing.number):
                        other = _NOBODY
                        if thing.kind == "car":
                            other = thing.number
                        yield (car, other, f"{thing}"), Phrase("stop-touch", car=car_phrase(car), thing=_named(thing))
            case "stuck":
                for car in cars:
                    if self._now()["flags"][car] & STUCK:
                        yield (car, _NOBODY, ""), Phrase("stop-stuck", car=car_phrase(car))
            case "zone":
                for car in cars:
                    if self._is_inside(condition, self._now()["x_m"][car], self._now()["y_m"][car]):
                        yield (car, _NOBODY, ""), Phrase("stop-zone", car=car_phrase(car), zone=condition.name)
            case "lost":
                for event in unpack_events(events):
                    if event.kind == LOST and event.car in cars:
                        why = Phrase(f"lost-{LOSS_REASONS[event.why]}")
                        phrase = Phrase("stop-lost", car=car_phrase(event.car), other=car_phrase(event.other), why=why)
                        yield (event.car, event.other, f"{event.t_ms}"), phrase
            case "block":
                for event in unpack_events(events):
                    if event.kind in (STATE, START) and event.car in cars:
                        # A leader's event names its state; a follower's word is found by its bits.
                        if event.kind == STATE:
                            index = event.other + 1
                        else:
                            index = self._now()["index"][event.car]
                        if index in condition.words:
                            yield (event.car, _NOBODY, f"{event.t_ms}"), Phrase("stop-block", car=car_phrase(event.car))

            case "condition":
                for car in cars:
                    for word in set(self._world.deciding.holding(car)) & set(condition.words):
                        reason = self._world.deciding.phrase_of(word)
                        yield (car, _NOBODY, ""), Phrase("stop-condition", car=car_phrase(car), reason=reason)

    def _is_inside(self, condition: StopCondition, x: float, y: float) -> bool:
        if len(condition.disc) == 3:
            return to_disc_m(x, y, *condition.disc) == 0
        flat = [length for corner in condition.corners_m for length in corner]
        return bool(flat) and to_outline_m(flat, 0, len(flat) // 2, x, y) == 0


def _named(thing: Obstacle) -> Phrase:
    if thing.kind == "car":
        return car_phrase(thing.number)
    return Phrase(f"thing-{thing.kind}")
