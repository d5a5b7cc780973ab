"""Let the time of worlds pass: a run of any length, which an exception may break off at any moment.

A run is a number of slices (`motorcade.engine.slices`), each one call of the kernels or a few. The kernels themselves
write which tick the cars have come to (column TICK of the counts), so cars and clock can't come apart. What an
exception broke off is then brought to one tick of all cars: back to the beginning of the slice, where the contents of
the arrays were kept, or else ahead to its end, which is the same call again.
"""

from array import array
from collections.abc import Callable
from functools import partial, wraps
from typing import Any, ParamSpec

from motorcade.car.brain import NO_VOICE
from motorcade.config.arguments import to_whole
from motorcade.engine import events, layout
from motorcade.engine.backend import Backend, BackendArray
from motorcade.engine.judging import Asked
from motorcade.engine.slices import Slices
from motorcade.engine.state import Arrays, CarArrays, Cells, Counters, Decisions, Driven, Rules
from motorcade.errors import MotorcadeError
from motorcade.words.ticks import TICKS_MASK

# No car is farther from 0 in x or y: places are 32 bits of µm, and a car drives on for a tick before it is seen there.
FARTHEST_UM = 2_147_000_000
# Kernels that were cut off are called again with more room, so the room is enough for most calls.
_MOST_MS_WITH_EVENTS = 1000
# When the clock of cars wraps.
_MOST_RUN_MS = TICKS_MASK
Given = ParamSpec("Given")
# The events of a world that were not taken yet: those before a call of the kernels, and the rows of the call.
Untaken = tuple[Any, bytes] | None


def done_whole(change: Callable[Given, None]) -> Callable[Given, None]:
    """Make a method that changes a world whole: where an interrupt breaks it off, it is called once more.

    So the method changes nothing where it raises MotorcadeError, and a second call leaves what the first one left.
    """

    @wraps(change)
    def changed(*arguments: Given.args, **named: Given.kwargs) -> None:
        try:
            change(*arguments, **named)
        except MotorcadeError:
            raise
        except BaseException:
            change(*arguments, **named)
            raise

    return changed


class Running:
    """Cars whose time passes; `motorcade.engine.simulation.Simulation` makes the arrays."""

    worlds: int
    cars: int
    tick_ms: int
    backend: Backend
    state: CarArrays
    _keeps_events: bool
    _parts: int
    _cells: Cells
    _driven: Driven
    _decisions: Decisions
    _rules: Rules
    _counters: Counters
    _seeds: BackendArray
    _slices: Slices
    _can_go_back: bool
    _asked: Asked

    def arrays(self) -> Arrays:
        """All that a kernel reads and writes."""
        raise NotImplementedError

    def _begin_ticks(self, farthest_um: int) -> None:
        """Begin with tick 0; the farthest car is so far away."""
        self._tick = 0
        # What an exception broke off, and the contents of all arrays before it where they were kept.
        self._is_torn = False
        self._before = list[tuple[BackendArray, Any]]()
        # Until this tick no car can be beyond FARTHEST_UM.
        self._within_until = self._ticks_within(farthest_um)
        # The word that is spoken in a tick.
        self._spoken_at = 0
        self._spoken = NO_VOICE
        self._taken: list[Untaken] = [None for _ in range(self.worlds)]

    @property
    def tick(self) -> int:
        """How many ticks have passed since the world began."""
        if self._is_torn:
            self._mend()
        return self._tick

    @property
    def now_ms(self) -> int:
        """The simulated time in ms."""
        return self.tick * self.tick_ms & TICKS_MASK

    def step(self) -> None:
        """Simulate one tick."""
        self.run(self.tick_ms)

    def run(self, duration_ms: int) -> None:
        """Simulate ``duration_ms``, rounded down to whole ticks.

        KeyboardInterrupt, or any other exception that comes meanwhile, ends the run soon, at a tick of all cars that
        `now_ms` names; the next run goes on from there.

        Raises:
            MotorcadeError: it is no whole number from 0 to 2^30 - 1, or it is less than a tick, so that nothing would
                ever happen; or a car has left the plane, 2,147 m around 0, where the run ends.
        """
        duration_ms = to_whole("duration_ms", duration_ms, 0, _MOST_RUN_MS)
        if 0 < duration_ms < self.tick_ms:
            raise MotorcadeError("run-shorter-than-tick", duration_ms=duration_ms, tick_ms=self.tick_ms)
        until = self.tick + duration_ms // self.tick_ms
        while self.tick < until:
            if self._tick >= self._within_until:
                self._check_places()
            ticks = min(until, self._within_until) - self._tick
            ticks = min(ticks, self._longest_slice())
            try:
                self._slices.measure(ticks, partial(self._advance, self._tick + ticks))
            except BaseException:
                self._is_torn = True
                self._mend()
                raise

    def untaken_rows(self, world: int) -> bytes:
        """Return the rows of the events that `take_rows` will sort.

        Raises:
            MotorcadeError: there is no such world.
        """
        parts = []
        rest = self._taken[self._checked_world(world)]
        while rest:
            rest, rows = rest
            parts.append(rows)
        return b"".join(reversed(parts))

    def _checked_world(self, world: int) -> int:
        return to_whole("world", world, 0, self.worlds - 1)

    def _read_counts(self) -> "array[int]":
        return array("q", self.backend.read(self._counters.counts))

    def _with_room(self, counts: BackendArray, room: int) -> Counters:
        """Counters with room for events, ``room`` for each part of the world."""
        shape = self._parts, room, events.COLUMNS
        return Counters(counts, self.backend.zeros("events", shape, "uint32"))

    def _longest_slice(self) -> int:
        """How many ticks a call of the kernels may simulate."""
        if not self._keeps_events:
            return self._slices.ticks
        # All events of a call have to fit into the array. Shorter calls would copy the cars more often.
        fit = max(self.tick_ms, _MOST_MS_WITH_EVENTS) // self.tick_ms
        return min(fit, self._slices.ticks) if self.backend.interruptible else fit

    def _ticks_within(self, farthest_um: int) -> int:
        """For how many ticks no car can come farther than FARTHEST_UM, where the farthest is so far away."""
        return int((FARTHEST_UM - farthest_um) // self._rules.fastest)

    def _check_places(self) -> None:
        """Find out until when all cars stay within FARTHEST_UM. Raises MotorcadeError: one is beyond it."""
        x_um, y_um = (array("i", self.backend.read(places)) for places in (self.state.x, self.state.y))
        farthest_um = layout.farthest_um(x_um, y_um)
        if farthest_um > FARTHEST_UM:
            index = next(i for i, place in enumerate(zip(x_um, y_um, strict=True)) if farthest_um in map(abs, place))
            number = int.from_bytes(self.backend.read(self.state.number[index : index + 1]), "little")
            time_s = self._tick * self.tick_ms / 1000
            world = index // self.cars
            most = FARTHEST_UM // 1_000_000
            raise MotorcadeError("car-left-plane", car=number, world=world, time=time_s, most=most)
        self._within_until = self._tick + max(self._ticks_within(farthest_um), 1)

    def _advance(self, until: int) -> None:
        """Simulate up to a tick; fewer ticks where another thread does it and is told to stop.

        A call of a kernel changes cars and clock together. Where one can be broken off, has to be repeated with more
        room for events, or is one of many that together take long, all that changes is kept before it.
        """
        if not (self._keeps_events or self.backend.interruptible or self._can_go_back):
            self._tick = self._call(until)
            return
        self._before = self._contents()
        self._call(until)
        taken, counted = self._collected(until) if self._keeps_events else (self._taken, self._read_counts())
        self._taken = taken
        self._tick = counted[events.TICK]
        self._before = []

    def _collected(self, until: int) -> "tuple[list[Untaken], array[int]]":
        """The events that were not taken yet, with those of the call that simulated up to a tick; and the counts."""
        counts = self._counters.counts
        counted = self._read_counts()
        while max(counted[events.EVENTS :: events.COUNTS]) > self._counters.events.shape[1]:
            self._put_back()
            self._counters = self._with_room(counts, self._counters.events.shape[1] * 2)
            self._call(until)
            counted = self._read_counts()
        taken = self._taken.copy()
        for part, count in enumerate(counted[events.EVENTS :: events.COUNTS]):
            if count:
                world = part if self._parts == self.worlds else 0
                taken[world] = taken[world], self.backend.read(self._counters.events[part, :count])
                counted[part * events.COUNTS + events.EVENTS] = 0
        self.backend.write(counts, counted.tobytes())
        return taken, counted

    def _changing(self) -> list[BackendArray]:
        """The arrays that a run changes."""
        cars = self.state
        of_cars = cars.rows, cars.push, cars.wheels, cars.program, self._decisions
        changing = [*of_cars, *self._cells, self._driven, self._counters.counts]
        if self._asked.every_ms:
            answers = self._asked.answers
            changing += [answers.off, answers.before, answers.since]
        return changing

    def _contents(self) -> list[tuple[BackendArray, Any]]:
        """The arrays that a run changes, and their contents now."""
        return [(column, self.backend.read(column)) for column in self._changing()]

    def _put_back(self) -> None:
        for column, contents in self._before:
            self.backend.write(column, contents)

    def _mend(self) -> None:
        """Bring all cars of all worlds to one tick, after an exception broke off a run: back, or else ahead."""
        self.backend.join()
        self._put_back()
        ticks = self._read_counts()[events.TICK :: events.COUNTS]
        if min(ticks) < max(ticks):
            self._call(max(ticks))
        self._tick = max(ticks)
        self._before = []
        self._is_torn = False

    def _call(self, until: int) -> int:
        """Call the kernels; return the tick that all cars have come to."""
        spoken = self._spoken_at, self._spoken
        self.backend.call("run", 0, 1, until, *spoken, self._seeds, self.arrays(), self._asked)
        return until
