"""Play a world: let its time pass, store its past, and make pictures of it. Real time is an argument."""

import math
from collections import deque
from collections.abc import Iterator

from motorcade.engine.moment import EVENT_BYTES
from motorcade.service.history import (
    EVERY_MS,
    FIRST,
    LATELY_MS,
    MOST_EVENTS,
    PAST,
    History,
    pack_picture,
)
from motorcade.service.messages import MatDocument
from motorcade.service.studio_world import StudioWorld
from motorcade.service.world_messages import CarDetails, Goals, State

PICTURE_S = 1 / 30
# A world that is late catches up with at most so much real time; the rest is dropped, so the world runs slower.
_MOST_BEHIND_S = 0.25
# Over about so much real time the speed is measured.
_RATED_S = 1.0
# The clock of a world wraps a little later.
_LAST_MS = (1 << 30) - 100_000


class Playback:
    """A world that a page plays, from its beginning; paused at first.

    Attributes:
        playing: whether time goes on.
        speed: simulated seconds in a real one.
        changed: whether there is something new to show.
    """

    def __init__(self, world: StudioWorld, history: History | None = None):
        self.world = world
        self.speed = 1.0
        self._watched: int | None = None
        self._begin(history or History())

    def _begin(self, history: History) -> None:
        self.playing = False
        # The real time of the last `advance`, and the simulated time that was due then but is not simulated yet.
        self._advanced_s: float | None = None
        self._behind_ms = 0.0
        # What the last `advance` simulated, and what the next one may simulate at most (0: no limit).
        self._ran_ms = self._most_ms = 0
        # Real and simulated time of about the last _RATED_S: older time counts less and less.
        self._real_s = self._simulated_s = 0.0
        # The time of the stored moment that is shown; None for the present.
        self._shown_ms: int | None = None
        self._history = history
        # The events since the last picture.
        self._new: deque[bytes] = deque()
        self._new_bytes = 0
        # The events since the last stored moment, for the referee.
        self._unseen: list[bytes] = []
        if self.world.referee:
            self.world.referee.restart()
        self._next_moment_ms = 0
        self._store_moment()
        self.show_all()

    # What a page requests.

    def play(self, speed: float) -> None:
        """Go on from the present, ``speed`` simulated seconds in a real one; after a mission's end begin again."""
        if self._is_over:
            self.reset(self.world.seed)
        self.speed = speed
        self.seek(None)
        self.playing = True

    def pause(self) -> None:
        """Stop the world's time."""
        self.playing = False
        self._advanced_s = None

    def step(self, ticks: int) -> None:
        """Go on by so many ticks from the present, then pause."""
        self.pause()
        self.seek(None)
        self._run(ticks)

    def reset(self, seed: int) -> None:
        """Begin again with a seed; what is around the cars stays as it is."""
        self.world.reset(seed)
        self._begin(History(*self._history.most_bytes))

    def furnish(self, mat: MatDocument, range_mm: int | None) -> None:
        """Change what is around the cars, and the range of infrared. Raises MotorcadeError."""
        self.world.furnish(mat, range_mm)
        self.changed = True

    def move(self, car: int, x_m: float, y_m: float, heading_deg: float) -> None:
        """Put a car elsewhere, in the present. Raises MotorcadeError."""
        self.world.move(car, x_m, y_m, heading_deg)
        self.seek(None)

    def seek(self, t_ms: int | None) -> None:
        """Show the stored moment at a time, and stop the world's time; None: show the present."""
        self._shown_ms = None if t_ms is None else self._history.moment_at(t_ms)[0]
        self.changed = True
        if t_ms is not None:
            self.pause()

    def watch(self, car: int | None) -> None:
        """Choose the car whose details `car` returns, or none. Raises MotorcadeError where there is no such car."""
        if car is not None:
            self.world.check_car(car)
        self._watched = car

    def show_all(self) -> None:
        """Make the next picture complete, for a page that has none yet: with as many events as fit."""
        self._next_is_first = self.changed = True
        self._new = deque([self._history.newest_events(MOST_EVENTS)])
        self._new_bytes = len(self._new[0])

    # Time.

    def advance(self, now_s: float) -> None:
        """Simulate what is due at a real time (seconds since any moment); call it for each picture, then `adapt_to`.

        On a slow computer each call simulates less: calls stay short, and simulated time runs slower.
        """
        if not self.playing:
            return
        elapsed_s = 0.0 if self._advanced_s is None else max(now_s - self._advanced_s, 0.0)
        self._advanced_s = now_s
        behind_ms = min(self._behind_ms + elapsed_s * 1000 * self.speed, _MOST_BEHIND_S * 1000 * self.speed)
        tick_ms = self.world.tick_ms
        ticks = int(min(behind_ms, self._most_ms or behind_ms) // tick_ms)
        self._ran_ms = ticks * tick_ms
        self._behind_ms = behind_ms - self._ran_ms
        fading = math.exp(-elapsed_s / _RATED_S)
        self._real_s = self._real_s * fading + elapsed_s
        self._simulated_s = self._simulated_s * fading + self._ran_ms / 1000
        was_over = self._is_over
        self._run(ticks)
        if self.world.now_ms >= _LAST_MS or self._is_over != was_over:
            self.pause()

    @property
    def _is_over(self) -> bool:
        """Whether the mission's run has ended; the world may go on after that."""
        return self.world.referee is not None and self.world.referee.is_over

    def adapt_to(self, seconds: float) -> None:
        """Bound the next call of `advance` to what fits between two pictures; the last call took ``seconds``."""
        if self._ran_ms:
            fits_ms = int(PICTURE_S * self._ran_ms / max(seconds, 1e-6))
            # At least a tick, so that a slow computer makes progress; a mean, as one slow call may be an accident.
            self._most_ms = max((fits_ms + self._most_ms) // 2, self.world.tick_ms)

    def _run(self, ticks: int) -> None:
        world = self.world
        was_over = self._is_over
        while ticks > 0 and self._is_over == was_over:
            until_moment = -(-(self._next_moment_ms - world.now_ms) // world.tick_ms)
            count = min(ticks, max(until_moment, 1))
            self._add_events(world.run(count * world.tick_ms))
            if world.now_ms >= self._next_moment_ms:
                self._store_moment()
            ticks -= count
            self.changed = True

    def _add_events(self, events: bytes) -> None:
        if not events:
            return
        self._history.add_events(events)
        if self.world.referee:
            self._unseen.append(events)
        self._new.append(events)
        self._new_bytes += len(events)
        while self._new_bytes - len(self._new[0]) >= MOST_EVENTS * EVENT_BYTES:
            self._new_bytes -= len(self._new.popleft())

    def _store_moment(self) -> None:
        now_ms = self.world.now_ms
        moment = self.world.moment(is_stored=True)
        self._history.add_moment(now_ms, moment, self._lost())
        if self.world.referee:
            self.world.referee.see(now_ms, moment, b"".join(self._unseen), self.world.counts()["touching_ms"])
            self._unseen.clear()
        while self._next_moment_ms <= now_ms:
            self._next_moment_ms += EVERY_MS

    def _lost(self) -> int:
        """How many frames were lost since the beginning."""
        counts = self.world.counts()
        return counts["deaf"] + sum(count for name, count in counts.items() if name.startswith("lost_"))

    # What is sent to a page.

    def picture(self, number: int) -> bytes:
        """Return a picture of what is shown now, with the events since the last one (`motorcade.service.history`)."""
        self.changed = False
        flags, self._next_is_first = FIRST if self._next_is_first else 0, False
        cars = self.world.cars
        if self._shown_ms is not None:
            t_ms, moment = self._history.moment_at(self._shown_ms)
            events = self._history.events_between(t_ms - EVERY_MS, t_ms)
            lost = self._history.lost_before(t_ms) - self._history.lost_before(t_ms - LATELY_MS)
            return pack_picture(number, flags | PAST, t_ms, cars, lost, moment, events)
        moment = self.world.moment(is_stored=False)
        events = b"".join(self._new)
        self._new.clear()
        self._new_bytes = 0
        lost = self._lost() - self._history.lost_before(self.world.now_ms - LATELY_MS)
        return pack_picture(number, flags, self.world.now_ms, cars, lost, moment, events)

    def state(self) -> State:
        """How time passes."""
        return State(
            playing=self.playing,
            speed=self.speed,
            t_ms=self.world.now_ms,
            shown_ms=self._shown_ms,
            earliest_ms=self._history.earliest_ms,
            seed=self.world.seed,
            counts=self.world.counts(),
            rate=self._simulated_s / self._real_s if self.playing and self._real_s else 0.0,
            driven=self.world.driven(),
        )

    def goals(self) -> Goals | None:
        """How it stands with the mission's goals at the shown time; None where there is no mission."""
        return self.world.referee.goals(self._shown_ms) if self.world.referee else None

    def car(self) -> CarDetails | None:
        """The details of the watched car at the shown time, why in the present; None where none is watched."""
        if self._watched is None:
            return None
        if self._shown_ms is None:
            return self.world.details(self._watched)
        t_ms, moment = self._history.moment_at(self._shown_ms)
        return self.world.details_then(self._watched, t_ms, moment, self._history.events_of(self._watched))

    def events(self) -> list[bytes]:
        """All stored rows of events, in batches."""
        return self._history.events()

    def newest(self) -> tuple[int, bytes]:
        """The time and the bytes of the newest stored moment."""
        return self._history.moment_at(_LAST_MS)

    def moments(self, seconds: float) -> Iterator[tuple[int, bytes]]:
        """The stored moments of the last so many simulated seconds."""
        return self._history.moments(self.world.now_ms - round(seconds * 1000))
