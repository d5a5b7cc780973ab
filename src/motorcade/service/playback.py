"""One page's world: its clock, what it has shown and told, and what the page may do to it.

Pure of HTTP and of clocks: real time comes in as an argument.
"""

import math
from collections import deque
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motorcade.boards.simulated_drive import DrivenCars
from motorcade.cameras.simulated import Scene, to_jpeg
from motorcade.config.profile import Profile
from motorcade.engine.moment import Moment
from motorcade.engine.world import World
from motorcade.errors import MotorcadeError
from motorcade.mats import Mat, Pose
from motorcade.runs.recording import Description
from motorcade.service.history import EVERY_MS, History
from motorcade.service.pictures import (
    EVENT_ROW,
    FIRST,
    MOST_EVENTS,
    NO_INDEX,
    PAST,
    RUNS,
    SENDS,
    PictureColumns,
    event_rows,
    pack_picture,
)
from motorcade.service.word_index import Counters, WordIndex

PICTURE_S = 1 / 30
# So much that is owed is made up for when there is time; what is more is lost, and the world runs slower.
_MOST_OWED_S = 0.25
_RATED_S = 1.0
# Before the clock wraps.
_LAST_MS = (1 << 30) - 100_000


class Playback:
    """A world in play. It stands still at first.

    Args:
        world: one world that keeps events, whose leaders run one image, at its beginning.
        driven: the boards of those of its cars that somebody drives.

    Attributes:
        playing: whether time goes on.
        speed: simulated seconds in a real one.
        changed: whether there is something new to show.
    """

    def __init__(self, world: World, driven: DrivenCars | None = None):
        self._world = world
        self._driven = driven or DrivenCars()
        self._scene: tuple[Mat, Scene] | None = None
        self.speed = 1.0
        self._watched: int | None = None
        self._carried = WordIndex(world)
        self._begin()

    def _begin(self) -> None:
        cars = self._world.cars
        self.playing = False
        self._at_s: float | None = None
        self._owed_ms = 0.0
        self._ran_ms = self._most_ms = 0
        self._real_s = self._simulated_s = 0.0
        self._shown_ms: int | None = None
        self._history = History()
        self._counters = Counters(cars)
        self._new: deque[NDArray[np.void]] = deque()
        self._new_count = 0
        self._since_picture, self._since_moment = np.zeros(cars, np.uint8), np.zeros(cars, np.uint8)
        self._due_ms = 0
        self._keep_moment()
        self.look_anew()

    @property
    def now_ms(self) -> int:
        """Simulated time."""
        return self._world.now_ms

    @property
    def profile(self) -> Profile:
        """The cars' kind."""
        return self._world.profile

    # What a page may do

    def play(self, speed: float) -> None:
        """Let time go on from the present, so many simulated seconds in a real one."""
        self.speed = speed
        self.seek(None)
        self.playing = True

    def pause(self) -> None:
        """Let time stand still."""
        self.playing = False
        self._at_s = None

    def step(self, ticks: int) -> None:
        """So many ticks from the present; then time stands still."""
        self.pause()
        self.seek(None)
        self._run(ticks)

    def reset(self, seed: int) -> None:
        """Everything as at the beginning but for the furniture, with a seed."""
        self._world.reset(seed)
        self._begin()

    def say(self, word: str) -> None:
        """Every car hears ``stop`` or ``go``."""
        self._world.say(word)

    def furnish(self, mat: Mat, range_mm: int | None) -> None:
        """Other walls, obstacles, people, voices, physics and infrared range. Raises MotorcadeError."""
        self._world.furnish(mat, range_mm)
        self.changed = True

    def move(self, car: int, x_m: float, y_m: float, heading_deg: float) -> None:
        """Put a car elsewhere, in the present. Raises MotorcadeError."""
        self._world.move(car, Pose(x_m, y_m, math.radians(heading_deg)))
        self.seek(None)

    def seek(self, t_ms: int | None) -> None:
        """Show the stored moment at a time, and let time stand still meanwhile; None: show the present."""
        self._shown_ms = None if t_ms is None else self._history.moment_at(t_ms)[0]
        self.changed = True
        if t_ms is not None:
            self.pause()

    def watch(self, car: int | None) -> None:
        """Ask for the details of a car, or of none. Raises MotorcadeError: there is no such car."""
        if car is not None:
            self._check_car(car)
        self._watched = car

    def look_anew(self) -> None:
        """The next picture is for somebody who has seen none: it tells all that there is room for."""
        self._first = self.changed = True
        self._new = deque([self._history.newest_events(MOST_EVENTS)])
        self._new_count = len(self._new[0])

    # What goes on

    def advance(self, now_s: float) -> None:
        """Simulate what is due at a real time, in seconds from whenever; call it once a picture, and then `took`.

        Where it can't keep up it simulates less at a call, so that calls stay short, and time runs slower.
        """
        if not self.playing:
            return
        elapsed_s = 0.0 if self._at_s is None else max(now_s - self._at_s, 0.0)
        self._at_s = now_s
        owed = min(self._owed_ms + elapsed_s * 1000 * self.speed, _MOST_OWED_S * 1000 * self.speed)
        tick_ms = self._world.tick_ms
        ticks = int(min(owed, self._most_ms or owed) // tick_ms)
        self._ran_ms = ticks * tick_ms
        self._owed_ms = owed - self._ran_ms
        fading = math.exp(-elapsed_s / _RATED_S)
        self._real_s = self._real_s * fading + elapsed_s
        self._simulated_s = self._simulated_s * fading + self._ran_ms / 1000
        self._run(ticks)
        if self.now_ms >= _LAST_MS:
            self.pause()

    def took(self, seconds: float) -> None:
        """The last call of `advance` took so long: the next one simulates no more than fits between two pictures."""
        if self._ran_ms:
            fits_ms = int(PICTURE_S * self._ran_ms / max(seconds, 1e-6))
            # A tick at least, or the slowest would never move at all; and one slow call isn't all.
            self._most_ms = max((fits_ms + self._most_ms) // 2, self._world.tick_ms)

    def _run(self, ticks: int) -> None:
        self._driven.steer(self._world)
        while ticks > 0:
            until_moment = -(-(self._due_ms - self.now_ms) // self._world.tick_ms)
            now = min(ticks, max(until_moment, 1))
            self._world.run(now * self._world.tick_ms)
            self._take_events()
            if self.now_ms >= self._due_ms:
                self._keep_moment()
            ticks -= now
            self.changed = True

    def _take_events(self) -> None:
        events = event_rows(self._world.take_events())
        if not len(events):
            return
        self._counters.take(events, (self._since_picture, self._since_moment))
        self._history.keep_events(events)
        self._new.append(events)
        self._new_count += len(events)
        while self._new_count - len(self._new[0]) >= MOST_EVENTS:
            self._new_count -= len(self._new.popleft())

    def _check_car(self, car: int) -> None:
        if not 0 <= car < self._world.cars:
            raise MotorcadeError("no-such-car-in-world", car=car, last=self._world.cars - 1)

    def _keep_moment(self) -> None:
        self._history.keep_moment(self.now_ms, self._moment(self._since_moment).pack())
        self._since_moment[:] = 0
        while self._due_ms <= self.now_ms:
            self._due_ms += EVERY_MS

    def _moment(self, marks: NDArray[np.uint8]) -> PictureColumns:
        now = self._world.snapshot()
        flags = now.runs * np.uint8(RUNS) | now.sends * np.uint8(SENDS) | marks
        x_m, y_m, heading = (each.astype(np.float32) for each in (now.x_m, now.y_m, now.heading))
        return PictureColumns(now.t_ms, x_m, y_m, heading, self._carried.indices(), now.wheels, now.led, flags)

    # What a page is told

    def picture(self, number: int) -> bytes:
        """What is shown now, as bytes, with what happened since the picture before."""
        self.changed = False
        flags, self._first = FIRST if self._first else 0, False
        cars = self._world.cars
        if self._shown_ms is not None:
            t_ms, moment = self._history.moment_at(self._shown_ms)
            events = self._history.events_between(t_ms - EVERY_MS, t_ms)
            return pack_picture(number, flags | PAST, t_ms, cars, moment, events)
        moment = self._moment(self._since_picture).pack()
        events = np.concatenate([np.zeros(0, EVENT_ROW), *self._new])
        self._new.clear()
        self._new_count = 0
        self._since_picture[:] = 0
        return pack_picture(number, flags, self.now_ms, cars, moment, events)

    def view(self, car: int) -> bytes:
        """What a car's camera sees in the present, as a JPEG file. Raises MotorcadeError: there is no such car."""
        self._check_car(car)
        mat = self._world.mat
        if self._scene is None or self._scene[0] is not mat:
            self._scene = mat, Scene(self.about())
        return to_jpeg(self._scene[1].draw(self._world.snapshot(), car))

    def hello(self) -> dict[str, Any]:
        """The cars, and what doesn't change from picture to picture."""
        world = self._world
        return {
            "cars": world.cars,
            "leads": np.flatnonzero(world.mat.starts.leads).tolist(),
            "tick_ms": world.tick_ms,
            "radius_m": world.profile.body.diameter_mm / 2000,
            "range_m": world.profile.infrared.range_mm / 1000,
        }

    def state(self) -> dict[str, Any]:
        """How time goes: ``rate`` is how many simulated seconds a real one brings at present.

        ``held`` are the cars whose wheels are not their program's: somebody drives them, or has left them standing.
        """
        return {
            "playing": self.playing,
            "speed": self.speed,
            "t_ms": self.now_ms,
            "shown_ms": self._shown_ms,
            "earliest_ms": self._history.earliest_ms,
            "seed": int(self._world.seeds[0]),
            "counts": {name: int(values[0]) for name, values in self._world.counts().items()},
            "rate": self._simulated_s / self._real_s if self.playing and self._real_s else 0.0,
            "held": self._driven.held(self._world.cars),
        }

    def car(self) -> dict[str, Any] | None:
        """The details of the watched car in the present; None where none is watched."""
        if self._watched is None:
            return None
        return {"car": self._watched} | self._carried.details(self._watched) | self._counters.of(self._watched)

    # What is kept

    def events(self) -> list[NDArray[np.void]]:
        """All that is kept of what happened, in batches of rows as pictures have them."""
        return self._history.events()

    def about(self) -> Description:
        """What a recording says about the run."""
        return Description.of(self._world, EVERY_MS)

    def frames(self, seconds: float) -> Iterator[Moment]:
        """The last so many simulated seconds, for a film."""
        words = self._carried.words
        for moment in self._history.moments(self._world.cars, self.now_ms - round(seconds * 1000)):
            known = moment.held != NO_INDEX
            word = np.where(known, words[np.where(known, moment.held, 0)], 0).astype(np.uint32)
            runs, sends = (moment.flags & flag > 0 for flag in (RUNS, SENDS))
            held = (word, runs, moment.wheels, moment.led, sends)
            yield Moment(moment.t_ms, moment.x_m, moment.y_m, moment.heading, *held)
