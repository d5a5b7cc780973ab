"""The public interface of the engine: a world of cars, or many worlds side by side."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import psutil
from numpy.typing import NDArray

from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.car.brain import NO_VOICE, RUNNING, WORD
from motorcade.car.drive_limits import released_mm
from motorcade.config.profile import Profile, built_in_profile
from motorcade.engine import bicycle, bodies, channel, events, layout
from motorcade.engine.choice import KernelChoice, Kind, processors
from motorcade.engine.events import EVENT
from motorcade.engine.geometry import FULL_TURN, to_heading
from motorcade.engine.kernels import ALL, give_back
from motorcade.engine.layout import VOICES
from motorcade.engine.state import DRIVEN, MOST_PARTS, Arrays, Moment
from motorcade.engine.targets import Name, keep_all
from motorcade.errors import MotorcadeError
from motorcade.mats import Mat, Pose, formation, open_table
from motorcade.mats.schema import FARTHEST_M
from motorcade.words.image import parse_image_bytes
from motorcade.words.ticks import TICKS_MASK

# One thread is faster for a single world of fewer cars.
_LARGE = 20_000
_COUNTED = {
    "frames": events.FRAMES,
    "heard": events.FRAMES_HEARD,
    "lost_collision": events.COLLISION,
    "lost_sending": events.SENDING,
    "lost_parity": events.PARITY,
    "lost_reserved": events.RESERVED,
    "lost_check": events.CHECK,
    "deaf": events.DEAF,
    "undetected": events.UNDETECTED,
    "touching_ms": events.TOUCHING_MS,
}


class World:
    """Simulate cars on a mat.

    Args:
        mat: where the cars start, and what is around them.
        images: the leaders' programs, as the bytes that are uploaded to cars; the mat's k-th leader runs
            ``images[k % len(images)]``.
        profile: what the levels in words mean; default: the built-in profile ``classroom``.
        seeds: one seed for one world, or several for as many worlds side by side. The same seed gives the same run, to
            the last bit, with any number of threads.
        events: whether to keep events for `take_events`.
        threads: how many threads to use; default: one per processor. WebAssembly uses one.
        kernels: what runs the cars, with the same bits: ``"webassembly"``, ``"native"`` (machine code, compiled once
            on each computer), or ``"interpreted"``. By default WebAssembly runs at once; where there is much to
            simulate, native kernels are compiled in the background and take over between two ticks.

    Attributes:
        cars: how many there are in each world.
        worlds: how many worlds there are.
        now_ms: the simulated time; wraps at 2^30.
        state: the arrays of the cars (`motorcade.engine.state.Cars`), not in the order of car numbers.

    Raises:
        MotorcadeError: an image is damaged, the world can't be simulated, or it doesn't fit into the memory.
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
        kernels: Name | None = None,
    ) -> None:
        for image in images:
            parse_image_bytes(image)
        self.mat = mat
        self.images = tuple(images)
        self.profile = profile or built_in_profile("classroom")
        self.tick_ms = mat.tick_ms
        self.cars = len(mat.starts)
        self.worlds = len(seeds) if isinstance(seeds, Sequence) else np.size(seeds)
        most = processors()
        self.threads = min(threads or most, most)
        self._keeps_events = events
        self._check()
        kind: Kind = "large" if self._is_large else "many" if self.worlds > 1 and self.threads > 1 else "one"
        self._kernels = KernelChoice(kernels, self._estimated_bytes, kind, self.threads, compile_native)
        self._parts = MOST_PARTS if self._is_large else self.worlds
        self.state = layout.cars_of(self.worlds, self.cars, self._kernels.memory)
        self._cells = layout.cells_of(self.worlds, self.cars, self._kernels.memory)
        self._standing = layout.standing_of(mat, len(self.images))
        self._furnish(mat, self.profile)
        self.reset(seeds)

    def reset(self, seeds: int | Sequence[int] | None = None) -> None:
        """Begin again, with other seeds where they are given (as many as there are worlds)."""
        if seeds is not None:
            if len(_seed_list(seeds)) != self.worlds:
                raise MotorcadeError("seeds-differ-from-worlds", count=len(_seed_list(seeds)), worlds=self.worlds)
            self.seeds = self._kernels.memory.keep("seeds", _seed_list(seeds))
        layout.put_in_place(self.state, self._standing, self.worlds)
        self._driven = self._kernels.memory.keep("driven", bicycle.nobody())
        room = 64 * self.cars + 1024 if self._keeps_events else 0
        counts = self._kernels.memory.zeros("counts", (self._parts, events.COUNTS), np.int64)
        self._counters = self._with_room(counts, room // (self._parts if self._is_large else 1))
        self._tick = 0
        self._spoken = NO_VOICE
        self._taken: list[NDArray[np.void]] = []

    @property
    def kernels(self) -> Name:
        """What runs the cars now; native kernels may have taken over from WebAssembly."""
        return self._kernels.now.name

    @property
    def now_ms(self) -> int:
        """The simulated time in ms."""
        return self._tick * self.tick_ms & TICKS_MASK

    @property
    def nbytes(self) -> int:
        """The bytes that all arrays of the world occupy."""
        state = (self.state.rows, self.state.push, self.state.order, self.state.wheels, self.state.program)
        arrays = (*state, *self._cells, *self._place, *self._people, *self._voices, self._driven, *self._counters)
        return sum(np.asarray(array).nbytes for array in arrays)

    def say(self, word: str) -> None:
        """Let every car hear ``stop`` or ``go`` in the next tick."""
        self._spoken = VOICES[word]

    def furnish(self, mat: Mat, range_mm: int | None = None) -> None:
        """Replace walls, obstacles, people, voices and physics; the cars stay where they are and go on.

        Args:
            mat: what is around the cars from now on; its own starts and tick are ignored.
            range_mm: the range of infrared; default: as before.

        Raises:
            MotorcadeError: the mat can't be simulated; nothing has changed then.
        """
        mat = replace(mat, starts=self.mat.starts, tick_ms=self.tick_ms)
        infrared = self.profile.infrared
        profile = replace(self.profile, infrared=replace(infrared, range_mm=range_mm or infrared.range_mm))
        self._furnish(mat, profile)
        self.mat, self.profile = mat, profile
        self._wake()

    def _furnish(self, mat: Mat, profile: Profile) -> None:
        rules = layout.rules_of(mat, profile, self.images)
        people = layout.people_of(mat, self._parts)
        self._look_mm = released_mm(profile.drive.obstacle_stop_mm)
        self._place = layout.place_of(mat, rules, self._kernels.memory, self._look_mm)
        self._rules = keep_all(self._kernels.memory, rules)
        self._people, self._voices = (
            keep_all(self._kernels.memory, people),
            keep_all(self._kernels.memory, layout.voices_of(mat)),
        )

    def _with_room(self, counts: NDArray[np.int64], room: int) -> events.Counters:
        """Counters with room for events, ``room`` for each part of the world."""
        return events.Counters(
            counts, self._kernels.memory.zeros("events", (self._parts, room, events.COLUMNS), np.uint32)
        )

    def move(self, car: int, pose: Pose, world: int = 0) -> None:
        """Move a car to another place, where it goes on with what it does.

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
        """Drive a car by hand. Its own program goes on, but its wheels obey these values until `give_back`.

        Args:
            car: the number of the car, a leader or a follower.
            angle_deg: the angle of the steering servo, 0 (right) to 180 (left).
            direction: 1 for forward, 0 for backward.
            speed: the motor's duty, 0 to the profile's ``motor.pwm_max``.
            world: the index of the car's world.

        Raises:
            MotorcadeError: there is no such car.
        """
        self._check_car(car)
        motion = bicycle.motion_of(angle_deg, direction, speed, self.profile, self.tick_ms)
        index = self._index(car, world)
        self._driven = self._kernels.memory.keep("driven", bicycle.with_driver(self._driven, world, car, index, motion))
        self.state.wheels[index] = DRIVEN

    def give_back(self, car: int, world: int = 0) -> None:
        """Give the wheels of a car back to its own program. Raises MotorcadeError: there is no such car."""
        self._check_car(car)
        index = self._index(car, world)
        if self.state.wheels[index] == DRIVEN:
            self._driven = self._kernels.memory.keep("driven", bicycle.without_driver(self._driven, world, car))
            give_back(index, self._tick, self.state, self._rules)

    def obstacle_mm(self, car: int) -> int:
        """What a car's ultrasonic sensor measures for its driver, as far as the profile's limits ask; in world 0."""
        if not self._look_mm or self._tick == 0:
            return NOTHING_IN_SIGHT_MM
        return bodies.obstacle_ahead_mm(self._index(car, 0), 0, self._look_mm, self._arrays())

    def step(self) -> None:
        """Simulate one tick."""
        self.run(self.tick_ms)

    def run(self, duration_ms: int) -> None:
        """Simulate ``duration_ms``, rounded down to whole ticks."""
        ticks, cars = duration_ms // self.tick_ms, self.cars * self.worlds
        while ticks > 0:
            most = max(self._kernels.begin(ticks * cars) // cars, 1)
            # With events the calls are short, because all events of a call have to fit into the array.
            count = min(ticks, most, max(self.tick_ms, 200) // self.tick_ms if self._keeps_events else most)
            self._advance(count)
            ticks -= count

    def snapshot(self, world: int = 0) -> Moment:
        """What the cars of a world show now, and what was counted in it since reset."""
        part = slice(world * self.cars, (world + 1) * self.cars)
        state = self.state
        order = np.argsort(state.number[part])
        led = self._kernels.memory.zeros("leds", (self.cars,), np.uint8)
        # The LEDs as the last tick set them; the next tick may switch some off.
        last_ms = self.now_ms - self.tick_ms & TICKS_MASK
        self._kernels.now.call("read_leds", 1, part.start, last_ms, state, self._rules, led)
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
        """The events since the last call, as an array of EVENT, sorted by time, world and car.

        ``kind`` and ``why`` are indices into KINDS and LOSS_REASONS: state (a leader begins a state), start (a follower
        begins a word), over (the word's length is over), frame (a car begins a frame), heard, lost. ``word`` is the
        control word, for a lost frame the bits on the air; ``other`` is the index of a state, or the number of a
        frame's sender. The time of an event may lie before the tick that found it.

        Raises:
            MotorcadeError: the world keeps no events.
        """
        if not self._keeps_events:
            raise MotorcadeError("world-keeps-no-events")
        taken = np.concatenate([np.zeros(0, EVENT), *self._taken])
        self._taken = []
        return taken[np.argsort(taken, order=("t_ms", "world", "car"), kind="stable")]

    def counts(self) -> dict[str, NDArray[np.int64]]:
        """Count what has happened since reset; each array has the shape (worlds,).

        ``frames`` are the frames begun. At each receiver a frame is ``heard`` or lost: ``lost_collision``,
        ``lost_sending``, ``lost_parity``, ``lost_reserved``, ``lost_check``, ``deaf``. ``undetected`` are frames
        that were heard with flipped bits. ``touching_ms`` is the time in which cars touched something, summed over
        cars.
        """
        counts = self._counters.counts
        return {
            name: counts[:, k].sum(keepdims=True) if self._is_large else counts[:, k].copy()
            for name, k in _COUNTED.items()
        }

    @property
    def _estimated_bytes(self) -> int:
        return self.cars * self.worlds * layout.BYTES_A_CAR

    @property
    def _is_large(self) -> bool:
        return self.worlds == 1 and self.threads > 1 and self.cars >= _LARGE

    def _check_car(self, car: int) -> None:
        if not 0 <= car < self.cars:
            raise MotorcadeError("no-such-car-in-world", car=car, last=self.cars - 1)

    def reach(self, sender: int, receiver: int, world: int = 0) -> channel.Reach:
        """Whether a frame of one car would reach another now; both are cars of this world."""
        return channel.reach(self._index(sender, world), self._index(receiver, world), world, self._arrays())

    def _index(self, car: int, world: int) -> int:
        begin = world * self.cars
        return begin + int(np.flatnonzero(self.state.number[begin : begin + self.cars] == car)[0])

    def _shown_wheels(self, world: int) -> NDArray[np.uint8]:
        begin = world * self.cars
        wheels = self.state.wheels[begin : begin + self.cars].copy()
        for its_world, _, place, ahead, aside, *_ in self._driven.T.tolist():
            if its_world == world:
                wheels[place - begin] = bicycle.shown_wheels(ahead, aside, self._rules.speeds)
        return wheels

    def _arrays(self) -> Arrays:
        around = self._place, self._people, self._voices
        return Arrays(self.state, self._cells, *around, self._driven, self._rules, self._counters)

    def _wake(self, moved: int = ALL) -> None:
        self._kernels.now.call("wake", 1, self._tick, moved, self.worlds, self._arrays())

    def _advance(self, ticks: int) -> None:
        while True:
            before = [array.copy() for array in self._changing()] if self._keeps_events else None
            self._call(ticks)
            if before is None or not self._overflows():
                break
            for array, value in zip(self._changing(), before, strict=True):
                array[...] = value
            self._counters = self._with_room(self._counters.counts, self._counters.events.shape[1] * 2)
        self._tick += ticks
        self._spoken = NO_VOICE
        if self._keeps_events:
            self._collect()

    def _call(self, ticks: int) -> None:
        is_large = self._is_large and self._kernels.now.threaded
        threads = self.threads if self._is_large or self.worlds > 1 else 1
        moment = self._tick, ticks, self._spoken, self.seeds, self._arrays()
        self._kernels.now.call("run_large" if is_large else "run", threads, *moment)

    def _changing(self) -> list[NDArray[np.generic]]:
        cars = self.state
        return [cars.rows, cars.push, cars.wheels, cars.program, *self._cells, self._driven, self._counters.counts]

    def _overflows(self) -> bool:
        return bool(self._counters.counts[:, events.EVENTS].max() > self._counters.events.shape[1])

    def _collect(self) -> None:
        counts = self._counters.counts[:, events.EVENTS]
        for part, count in enumerate(counts.tolist()):
            rows = self._counters.events[part, :count]
            taken = np.zeros(count, EVENT)
            taken["world"] = 0 if self._is_large else part
            for k, name in enumerate(("t_ms", "car", "kind", "why", "word", "other")):
                taken[name] = rows[:, k]
            self._taken.append(taken)
        counts[:] = 0

    def _check(self) -> None:
        if self.cars == 0:
            raise MotorcadeError("mat-without-cars")
        if any(self.mat.starts.leads) and not self.images:
            raise MotorcadeError("leaders-without-program")
        if len(self.images) > 255:
            raise MotorcadeError("too-many-programs", count=len(self.images))
        needed, free = self._estimated_bytes, psutil.virtual_memory().available
        if needed > free:
            raise MotorcadeError(
                "world-exceeds-memory", cars=self.cars * self.worlds, needed=needed / 1e9, free=free / 1e9
            )


def _seed_list(seeds: int | Sequence[int]) -> NDArray[np.int64]:
    return np.atleast_1d(np.asarray(seeds, np.int64))


def warm_up(world: World) -> None:
    """Call every kernel that runs while a world like this one is played, driven cars included.

    ``world`` itself is not changed. Native kernels are compiled then, which takes some 20 s the first time on a
    computer, then half a second; other threads can be delayed meanwhile, for up to 0.2 s at a time.
    """
    _play(World(world.mat, world.images, world.profile, threads=world.threads, kernels=world.kernels))


def compile_native(kind: Kind, threads: int) -> None:
    """Compile the native kernels for worlds of one kind, or load them where this computer has compiled them before."""
    followers = _LARGE - 1 if kind == "large" else 0
    seeds = (0, 1) if kind == "many" else (0,)
    mat = open_table(formation(followers))
    _play(World(mat, [bytes(4)], seeds=seeds, threads=1 if kind == "one" else threads, kernels="native"))


def _play(world: World) -> None:
    world.drive(0)
    world.step()
    world.move(0, Pose(0, 0))
    world.snapshot()
