"""A world of cars, or many side by side: what `motorcade.engine.kernels` steps, with a face for people."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numba
import numpy as np
import psutil
from numpy.typing import NDArray

from motorcade.car.brain import NO_VOICE, RUNNING, WORD
from motorcade.config.profile import Profile, built_in_profile
from motorcade.engine import bicycle, layout
from motorcade.engine import counters as tally
from motorcade.engine import kernels as engine
from motorcade.engine.events import EVENT as EVENT
from motorcade.engine.events import KINDS as KINDS
from motorcade.engine.events import LOSS_REASONS as LOSS_REASONS
from motorcade.engine.geometry import FULL_TURN, to_heading
from motorcade.engine.layout import VOICES
from motorcade.engine.moment import Moment
from motorcade.engine.state import DRIVEN, MOST_PARTS
from motorcade.errors import MotorcadeError
from motorcade.mats import Mat, Pose
from motorcade.mats.schema import FARTHEST_M
from motorcade.words.image import parse_image_bytes
from motorcade.words.ticks import TICKS_MASK

# One world of fewer cars is stepped faster by one thread.
_LARGE = 20_000
_COUNTED = {
    "frames": tally.FRAMES,
    "heard": tally.HEARD,
    "lost_collision": tally.LOST_COLLISION,
    "lost_sending": tally.LOST_SENDING,
    "lost_parity": tally.LOST_PARITY,
    "lost_reserved": tally.LOST_RESERVED,
    "deaf": tally.DEAF,
    "undetected": tally.UNDETECTED,
    "touching_ms": tally.TOUCHING_MS,
}


class World:
    """Cars on a mat.

    Args:
        mat: where they start, and what is around them.
        images: the leaders' programs, the very bytes that are uploaded; the mat's
            k-th leader runs ``images[k % len(images)]``.
        profile: what the levels in words mean; the built-in ``classroom`` unless given.
        seeds: one seed for one world, or several for as many worlds side by side. The
            same seed gives the same run, to the last bit, with any number of threads.
        events: whether to keep events for `take_events`.
        threads: how many may work; as many as there are processors unless given.

    Attributes:
        cars: how many there are in each world.
        worlds: how many worlds there are.
        now_ms: simulated time; wraps at 2^30.
        state: the arrays themselves (`motorcade.engine.state.Cars`), not in the order of car numbers.

    Raises:
        ImageError: an image that is none.
        MotorcadeError: what can't be simulated, or doesn't fit into the memory.
    """

    def __init__(
        self,
        mat: Mat,
        images: Sequence[bytes] = (),
        profile: Profile | None = None,
        *,
        seeds: int | Sequence[int] = 0,
        events: bool = False,
        threads: int | None = None,
    ) -> None:
        for image in images:
            parse_image_bytes(image)
        self.mat = mat
        self.images = tuple(images)
        self.profile = profile or built_in_profile("classroom")
        self.tick_ms = mat.tick_ms
        self.cars = len(mat.starts)
        self.worlds = len(seeds) if isinstance(seeds, Sequence) else np.size(seeds)
        most = int(numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]  # it comes from the environment
        self.threads = min(threads or most, most)
        self._keeps_events = events
        self._check()
        self._parts = MOST_PARTS if self._is_large else self.worlds
        self._rules = layout.rules_of(mat, self.profile, images)
        self.state = layout.cars_of(self.worlds, self.cars)
        self._cells = layout.cells_of(self.worlds, self.cars)
        self._place = layout.place_of(mat, self._rules)
        self._people = layout.people_of(mat, self._parts)
        self._voices = layout.voices_of(mat)
        self.reset(seeds)

    def reset(self, seeds: int | Sequence[int] | None = None) -> None:
        """Everything as at the beginning, with other seeds where they are given (as many as there are worlds)."""
        if seeds is not None:
            if len(_seed_list(seeds)) != self.worlds:
                raise MotorcadeError("seeds-differ-from-worlds", count=len(_seed_list(seeds)), worlds=self.worlds)
            self.seeds = _seed_list(seeds)
        layout.put_in_place(self.state, self.mat, self.worlds, len(self.images))
        self._driven = bicycle.nobody()
        room = 64 * self.cars + 1024 if self._keeps_events else 0
        self._tally = tally.Counters(
            np.zeros((self._parts, tally.COUNTS), np.int64),
            np.zeros((self._parts, room // (self._parts if self._is_large else 1), tally.COLUMNS), np.uint32),
        )
        self._tick = 0
        self._said = NO_VOICE
        self._taken: list[NDArray[np.void]] = []

    @property
    def now_ms(self) -> int:
        """Simulated time in ms."""
        return self._tick * self.tick_ms & TICKS_MASK

    @property
    def nbytes(self) -> int:
        """Bytes that the world's state occupies, scratch included."""
        state = (self.state.rows, self.state.push, self.state.order, self.state.wheels, self.state.program)
        arrays = (*state, *self._cells, *self._place, *self._people, *self._voices, self._driven, *self._tally)
        return sum(np.asarray(array).nbytes for array in arrays)

    def say(self, word: str) -> None:
        """Every car hears ``stop`` or ``go`` in the next tick."""
        self._said = VOICES[word]

    def furnish(self, mat: Mat, range_mm: int | None = None) -> None:
        """Put other walls, obstacles, people, voices and physics around the cars, which stay where they are and go on.

        Args:
            mat: what is around them from now on; where its own cars start and how long its tick is doesn't matter.
            range_mm: how far infrared reaches; as far as before unless given.

        Raises:
            MotorcadeError: what can't be simulated; everything is as before then.
        """
        mat = replace(mat, starts=self.mat.starts, tick_ms=self.tick_ms)
        infrared = self.profile.infrared
        profile = replace(self.profile, infrared=replace(infrared, range_mm=range_mm or infrared.range_mm))
        rules = layout.rules_of(mat, profile, self.images)
        self._place = layout.place_of(mat, rules)
        self._people = layout.people_of(mat, self._parts)
        self._voices = layout.voices_of(mat)
        self.mat, self.profile, self._rules = mat, profile, rules
        self._wake()

    def move(self, car: int, pose: Pose, world: int = 0) -> None:
        """Lift a car and put it down elsewhere, where it goes on with what it does.

        Raises:
            MotorcadeError: there is no such car or place.
        """
        self._check_car(car)
        if not (abs(pose.x) <= FARTHEST_M and abs(pose.y) <= FARTHEST_M and math.isfinite(pose.heading)):
            raise MotorcadeError("car-place-too-far", x=pose.x, y=pose.y, most=FARTHEST_M)
        index = self._index(car, world)
        self.state.x[index], self.state.y[index] = round(pose.x * 1e6), round(pose.y * 1e6)
        self.state.heading[index] = to_heading(pose.heading)
        self._wake(index)

    def drive(self, car: int, angle_deg: int = 90, direction: int = 1, speed: int = 0, world: int = 0) -> None:
        """Have a driver at a car's wheels, in place of its own program, which goes on but for them.

        Args:
            car: which one; it may lead or follow.
            angle_deg: where the steering servo stands, 0 (right) to 180 (left).
            direction: 1 for forward, 0 for backward.
            speed: the motor's duty, 0 to the profile's ``motor.pwm_max``.
            world: which world's car.

        Raises:
            MotorcadeError: there is no such car.
        """
        self._check_car(car)
        motion = bicycle.motion_of(angle_deg, direction, speed, self.profile, self.tick_ms)
        index = self._index(car, world)
        self._driven = bicycle.with_driver(self._driven, world, car, index, motion)
        self.state.wheels[index] = DRIVEN

    def give_back(self, car: int, world: int = 0) -> None:
        """Let a car's own program have the wheels again, where it has come to by now. Raises MotorcadeError."""
        self._check_car(car)
        index = self._index(car, world)
        if self.state.wheels[index] == DRIVEN:
            self._driven = bicycle.without_driver(self._driven, world, car)
            engine.give_back(index, self._tick, self.state, self._rules)

    def step(self) -> None:
        """One tick."""
        self._advance(1)

    def run(self, duration_ms: int) -> None:
        """Step for ``duration_ms``, all in one compiled call; a part of a tick is left out."""
        ticks = duration_ms // self.tick_ms
        while ticks > 0:
            # With events a call is short, since there has to be room for all of them.
            now = min(ticks, max(self.tick_ms, 200) // self.tick_ms) if self._keeps_events else ticks
            self._advance(now)
            ticks -= now

    def snapshot(self, world: int = 0) -> Moment:
        """What the cars of a world show now, and what was counted in it since reset."""
        part = slice(world * self.cars, (world + 1) * self.cars)
        state = self.state
        order = np.argsort(state.number[part])
        led = np.empty(self.cars, np.uint8)
        # As the last tick set them; the next one may put some out.
        engine.read_leds(part.start, self.now_ms - self.tick_ms & TICKS_MASK, state, self._rules, led)
        heading = state.heading[part][order] / FULL_TURN * math.tau
        return Moment(
            t_ms=self.now_ms,
            x_m=state.x[part][order] / 1e6,
            y_m=state.y[part][order] / 1e6,
            heading=np.where(heading > math.pi, heading - math.tau, heading),
            word=state.memory[WORD, part][order],
            runs=state.memory[RUNNING, part][order].astype(bool),
            wheels=self._shown_wheels(world)[order],
            led=led[order],
            sends=((self.now_ms - state.sends_until[part][order].astype(np.int64)) & TICKS_MASK) >= 1 << 29,
            counts={name: int(counted[world]) for name, counted in self.counts().items()},
        )

    def take_events(self) -> NDArray[np.void]:
        """The events since the last call, as an array of EVENT, by time and then car.

        ``kind`` and ``why`` are indices into KINDS and LOSS_REASONS: state (the leader begins
        a state), start (a follower begins a word), over (its length is over), frame (a
        frame was begun), heard, lost. ``word`` is the control word, for a lost frame the
        bits on the air; ``other`` the index of a state, or the number of a frame's sender.
        An event's time may lie before the tick that noticed it.
        """
        if not self._keeps_events:
            raise MotorcadeError("world-keeps-no-events")
        events = np.concatenate([np.zeros(0, EVENT), *self._taken])
        self._taken = []
        return events[np.argsort(events, order=("t_ms", "world", "car"), kind="stable")]

    def counts(self) -> dict[str, NDArray[np.int64]]:
        """What has happened since reset, each of shape (worlds,).

        ``frames`` were begun; frames were ``heard``, or lost at a receiver: ``lost_collision``, ``lost_sending``,
        ``lost_parity``, ``lost_reserved``, ``deaf``; of those heard, ``undetected`` had flipped bits. ``touching_ms``
        is the time that cars were in touch with something, summed over cars.
        """
        counts = self._tally.counts
        return {
            name: counts[:, k].sum(keepdims=True) if self._is_large else counts[:, k].copy()
            for name, k in _COUNTED.items()
        }

    @property
    def _is_large(self) -> bool:
        return self.worlds == 1 and self.threads > 1 and self.cars >= _LARGE

    def _check_car(self, car: int) -> None:
        if not 0 <= car < self.cars:
            raise MotorcadeError("no-such-car-in-world", car=car, last=self.cars - 1)

    def _index(self, car: int, world: int) -> int:
        begin = world * self.cars
        return begin + int(np.flatnonzero(self.state.number[begin : begin + self.cars] == car)[0])

    def _shown_wheels(self, world: int) -> NDArray[np.uint8]:
        begin = world * self.cars
        wheels = self.state.wheels[begin : begin + self.cars].copy()
        for which, _, place, ahead, aside, *_ in self._driven.T.tolist():
            if which == world:
                wheels[place - begin] = bicycle.shown_wheels(ahead, aside, self._rules.speeds)
        return wheels

    def _wake(self, put: int = engine.ALL) -> None:
        engine.wake(self._tick, put, self.cars, self.worlds, self.state, self._cells, self._driven, self._rules)

    def _advance(self, ticks: int) -> None:
        while True:
            before = self._backup() if self._keeps_events else None
            self._call(ticks)
            if before is None or not self._overflows():
                break
            self._restore(before)
            old = self._tally
            room = old.events.shape[1] * 2
            self._tally = tally.Counters(old.counts, np.zeros((self._parts, room, tally.COLUMNS), np.uint32))
        self._tick += ticks
        self._said = NO_VOICE
        if self._keeps_events:
            self._collect()

    def _call(self, ticks: int) -> None:
        kernel = engine.run_many if self.worlds > 1 and self.threads > 1 else engine.run_one
        if self._is_large:
            kernel = engine.run_large
        before = numba.get_num_threads()
        numba.set_num_threads(self.threads)
        try:
            kernel(
                self._tick,
                ticks,
                self._said,
                self.cars,
                self.seeds,
                self.state,
                self._cells,
                self._place,
                self._people,
                self._voices,
                self._driven,
                self._rules,
                self._tally,
            )
        finally:
            numba.set_num_threads(before)

    def _backup(self) -> list[NDArray[np.generic]]:
        return [array.copy() for array in self._changing()]

    def _restore(self, backup: list[NDArray[np.generic]]) -> None:
        for array, before in zip(self._changing(), backup, strict=True):
            array[...] = before

    def _changing(self) -> list[NDArray[np.generic]]:
        state = self.state
        return [
            state.rows,
            state.push,
            state.wheels,
            state.program,
            *self._cells,
            self._driven,
            self._tally.counts,
        ]

    def _overflows(self) -> bool:
        return bool(self._tally.counts[:, tally.EVENTS].max() > self._tally.events.shape[1])

    def _collect(self) -> None:
        counts = self._tally.counts[:, tally.EVENTS]
        for part, count in enumerate(counts.tolist()):
            rows = self._tally.events[part, :count]
            events = np.zeros(count, EVENT)
            events["world"] = 0 if self._is_large else part
            for k, name in enumerate(("t_ms", "car", "kind", "why", "word", "other")):
                events[name] = rows[:, k]
            self._taken.append(events)
        counts[:] = 0

    def _check(self) -> None:
        if self.cars == 0:
            raise MotorcadeError("mat-without-cars")
        if self.mat.starts.leads.any() and not self.images:
            raise MotorcadeError("leaders-without-program")
        if len(self.images) > 255:
            raise MotorcadeError("too-many-programs", count=len(self.images))
        needed, free = self.cars * self.worlds * layout.BYTES_A_CAR, psutil.virtual_memory().available
        if needed > free:
            raise MotorcadeError(
                "world-exceeds-memory", cars=self.cars * self.worlds, needed=needed / 1e9, free=free / 1e9
            )


def _seed_list(seeds: int | Sequence[int]) -> NDArray[np.int64]:
    return np.atleast_1d(np.asarray(seeds, np.int64))


def warm_up(world: World) -> None:
    """Compile everything that runs while a world like this one is played, driven cars included; ``world`` itself stays.

    This takes some 20 s the first time on a computer, then half a second. Other threads can be held up meanwhile, for
    up to 0.2 s at a time.
    """
    other = World(world.mat, world.images, world.profile, threads=world.threads)
    other.drive(0)
    other.step()
    other.move(0, Pose(0, 0))
    other.snapshot()
