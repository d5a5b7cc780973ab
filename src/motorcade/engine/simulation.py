"""A world of cars, or many side by side, wherever its kernels run: this module needs no NumPy, threads or files.

`motorcade.engine.world.World` adds what NumPy makes convenient, and several threads.
"""

import struct
from array import array
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.car.brain import NO_VOICE
from motorcade.car.drive_limits import released_mm
from motorcade.config.profile import Profile, built_in_profile
from motorcade.engine import agents, bicycle, events, floor, layout
from motorcade.engine.backend import Backend, BackendArray, allocate_all
from motorcade.engine.geometry import to_heading
from motorcade.engine.judging import Answers, Questions
from motorcade.engine.kernels import ALL
from motorcade.engine.moment import COLUMNS, Columns, Moment, allocate_columns, view_column
from motorcade.engine.slices import Slices
from motorcade.engine.state import DRIVEN, Arrays, Buffer, Counters
from motorcade.errors import MotorcadeError
from motorcade.mats import Mat, Pose
from motorcade.mats.schema import FARTHEST_M, MOST_HEADING
from motorcade.words.image import parse_image_bytes
from motorcade.words.ticks import TICKS_MASK

COUNTED = {
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
# No car is farther from 0 in x or y: places are 32 bits of µm, and a car drives on for a tick before it is seen there.
FARTHEST_UM = 2_147_000_000
# Kernels that were cut off are called again with more room, so the room is enough for most calls.
_MOST_MS_WITH_EVENTS = 200
# The events of a world that were not taken yet: those before a call of the kernels, and the rows of the call.
Untaken = tuple[Any, bytes] | None


class Simulation:
    """Simulate cars on a mat.

    Args:
        mat: where the cars start, and what is around them.
        images: the leaders' programs, as the bytes that are uploaded to cars; the mat's k-th leader runs
            ``images[k % len(images)]``.
        profile: what the levels in words mean; default: the built-in profile ``classroom``.
        backend: what runs the kernels, and allocates the arrays.
        seeds: one for each world. The same seed gives the same run, to the last bit, whatever runs the kernels.
        events: whether to keep events for `take_rows`.
        parts: how many parts of a single world count by themselves; default: one for each world.
        shares: into how many shares the work is divided at most.

    Attributes:
        cars: how many there are in each world.
        worlds: how many worlds there are.
        seeds: of each world.
        now_ms: the simulated time; wraps at 2^30.
        state: the arrays of the cars (`motorcade.engine.state.CarArrays`), not in the order of car numbers.

    Raises:
        MotorcadeError: an image is damaged, the world can't be simulated, or it doesn't fit into the memory.
    """

    def __init__(
        self,
        mat: Mat,
        images: Sequence[bytes],
        profile: Profile | None,
        backend: Backend,
        *,
        seeds: Sequence[int] = (0,),
        events: bool = False,
        parts: int | None = None,
        shares: int = 1,
    ) -> None:
        for image in images:
            parse_image_bytes(image)
        self.mat = mat
        self.images = tuple(images)
        self.profile = profile or built_in_profile("classroom")
        self.tick_ms = mat.tick_ms
        self.cars = len(mat.starts)
        self.worlds = len(seeds)
        _check(mat, self.images)
        self.backend = backend
        self._keeps_events = events
        self._parts = parts or self.worlds
        self.state = layout.cars_of(self.worlds, self.cars, backend)
        self._cells = layout.cells_of(self.worlds, self.cars, backend)
        self._around = layout.around_of(shares, self.cars, backend)
        self._standing = layout.standing_of(mat, len(self.images))
        self._farthest_um = layout.farthest_um(self._standing.x.items, self._standing.y.items)
        self._shown: Columns | None = None
        self._set_environment(mat, self.profile)
        self._slices, self._can_go_back = Slices(self.worlds * self.cars, backend.interruptible), False
        self._begin(seeds)

    def reset(self, seeds: int | Sequence[int] | None = None) -> None:
        """Begin again, with other seeds where they are given (as many as there are worlds)."""
        given = self.seeds if seeds is None else (seeds,) if isinstance(seeds, int) else seeds
        if len(given) != self.worlds:
            raise MotorcadeError("seeds-differ-from-worlds", count=len(given), worlds=self.worlds)
        self.backend.join()
        self._begin(given)

    def _begin(self, seeds: Sequence[int]) -> None:
        memory = self.backend
        self.seeds = tuple(int(seed) for seed in seeds)
        self._seeds = memory.allocate("seeds", Buffer.of("int64", self.seeds))
        layout.put_in_place(self.state, self._standing, self.worlds, memory)
        self._keep_driven([])
        room = 64 * self.cars + 1024 if self._keeps_events else 0
        counts = memory.zeros("counts", (self._parts, events.COUNTS), "int64")
        self._counters = self._with_room(counts, room * self.worlds // self._parts)
        self._tick = 0
        # What an exception broke off, and the contents of all arrays before it where they were kept.
        self._is_torn, self._before = False, list[tuple[BackendArray, Any]]()
        # Until this tick no car can be beyond FARTHEST_UM.
        self._within_until = self._ticks_within(self._farthest_um)
        # The word that is spoken in a tick.
        self._spoken_at, self._spoken = 0, NO_VOICE
        self._taken: list[Untaken] = [None for _ in self.seeds]

    def assign_images(self, images: Sequence[int]) -> None:
        """Give each world a program of its own, before the first tick: all its leaders run image ``images[world]``.

        `reset` gives the leaders the images of the mat's order again.
        """
        leads = [program > 0 for program in self._standing.program.items]
        programs = b"".join(bytes(image + 1 if each else 0 for each in leads) for image in images)
        self.backend.write(self.state.program, programs)

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

    def say(self, word: str) -> None:
        """Let every car hear ``stop`` or ``go`` in the next tick."""
        self._spoken_at, self._spoken = self.tick, layout.VOICES[word]

    def set_environment(self, mat: Mat, range_mm: int | None = None) -> None:
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
        self._set_environment(mat, profile)
        self.mat, self.profile = mat, profile
        self._wake()

    def _set_environment(self, mat: Mat, profile: Profile) -> None:
        backend, rules = self.backend, layout.rules_of(mat, profile, self.images)
        self._look_mm = released_mm(profile.drive.obstacle_stop_mm)
        self._obstacles = layout.obstacles_of(mat, rules, backend, self._look_mm)
        self._rules = allocate_all(backend, rules)
        self._floor = backend.allocate("floor", floor.floor_of(mat, rules.floor_aside))
        self._people = allocate_all(backend, layout.people_of(mat, self._parts))
        self._voices = allocate_all(backend, layout.voices_of(mat))

    def _with_room(self, counts: BackendArray, room: int) -> Counters:
        """Counters with room for events, ``room`` for each part of the world."""
        shape = self._parts, room, events.COLUMNS
        return Counters(counts, self.backend.zeros("events", shape, "uint32"))

    def move(self, car: int, pose: Pose, world: int = 0) -> None:
        """Move a car to another place, where it goes on with what it does.

        Raises:
            MotorcadeError: there is no such car or place.
        """
        self._check_car(car)
        _check_pose(pose.x, pose.y, pose.heading)
        index = self._index(car, world)
        self._write(self.state.x, index, struct.pack("<i", round(pose.x * 1e6)))
        self._write(self.state.y, index, struct.pack("<i", round(pose.y * 1e6)))
        self._write(self.state.heading, index, struct.pack("<I", to_heading(pose.heading)))
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
        self._keep_driven([*self._others_driven(car, world), [world, car, index, *motion, 0]])
        self._write(self.state.wheels, index, bytes([DRIVEN]))

    def give_back(self, car: int, world: int = 0) -> None:
        """Give the wheels of a car back to its own program. Raises MotorcadeError: there is no such car."""
        self._check_car(car)
        if (world, car) in self._drivers:
            self._keep_driven(self._others_driven(car, world))
            index = self._index(car, world)
            self.backend.call("give_back", index, self.tick, self.state, self._rules)

    def _others_driven(self, car: int, world: int) -> list[list[int]]:
        """The columns of the other driven cars, whose indices a sort may have changed."""
        columns = bicycle.columns_of(self.backend.read(self._driven))
        return [column for column in columns if column[: bicycle.NUMBER + 1] != [world, car]]

    def _keep_driven(self, columns: list[list[int]]) -> None:
        self._drivers = {(column[bicycle.WORLD], column[bicycle.NUMBER]) for column in columns}
        self._driven = self.backend.allocate("driven", bicycle.matrix_of(columns))

    def obstacle_mm(self, car: int) -> int:
        """What a car's ultrasonic sensor measures for its driver, as far as the profile's limits ask; in world 0."""
        if not self._look_mm or self.tick == 0:
            return NOTHING_IN_SIGHT_MM
        return self.look_ahead(car, self._look_mm)

    def look_ahead(self, car: int, look_mm: int) -> int:
        """What a car's ultrasonic sensor measures up to ``look_mm``, in world 0 and after the first tick."""
        answer = self.backend.zeros("answer", (1,), "int64")
        self.backend.call("read_obstacle", self._index(car, 0), look_mm, self.arrays(), answer)
        return int.from_bytes(self.backend.read(answer), "little")

    def begin_words(self, words: bytes) -> None:
        """Let followers begin words in the next tick, after the first one, as if each had just heard its own.

        Args:
            words: four bytes a car, little-endian, in the order of worlds and car numbers: a control word without
                parity, or `motorcade.engine.agents.KEEP`.
        """
        given = self.backend.zeros("words", (self.worlds * self.cars,), "uint32")
        self.backend.write(given, words)
        self.backend.call("begin_words", self.tick, self.worlds, given, self.arrays())

    def read_senses(self) -> BackendArray:
        """Return what every car senses, after the first tick: (worlds * cars, SENSED) int64.

        The columns are those of `motorcade.engine.agents`. Sensors are on whatever a car's word asks for.
        """
        sensed = self.backend.zeros("sensed", (self.worlds * self.cars, agents.SENSED), "int64")
        look_mm = self.profile.body.ultrasonic_range_mm
        self.backend.call("read_senses", self.tick, self.worlds, look_mm, self.arrays(), sensed)
        return sensed

    def step(self) -> None:
        """Simulate one tick."""
        self.run(self.tick_ms)

    def run(self, duration_ms: int) -> None:
        """Simulate ``duration_ms``, rounded down to whole ticks.

        KeyboardInterrupt, or any other exception that comes meanwhile, ends the run soon, at a tick of all cars that
        `now_ms` names; the next run goes on from there.

        Raises:
            MotorcadeError: a car has left the plane, 2,147 m around 0; the run ends there.
        """
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

    def snapshot(self, world: int = 0) -> Moment:
        """What the cars of a world show now, and what was counted in it since reset; columns are memory views."""
        shown = self.read_moment(world)
        columns = {name: view_column(name, self.backend.read(getattr(shown, name))) for name in COLUMNS}
        return Moment(t_ms=self.now_ms, counts=self.totals(world), **columns)

    def read_moment(self, world: int = 0, into: Columns | None = None) -> Columns:
        """Write what the cars of a world show now into arrays; default: arrays that the next call overwrites."""
        if into is None:
            if self._shown is None:
                self._shown, _ = allocate_columns(self.backend, "moment", self.cars)
            into = self._shown
        self.backend.call("read_moment", world, self.tick, self.state, self._driven, self._rules, into)
        return into

    def take_rows(self, world: int = 0) -> BackendArray:
        """Return the events of a world since the last call, by time and car.

        Each is a row of `motorcade.engine.events.COLUMNS` numbers. The next call overwrites the array.

        Raises:
            MotorcadeError: the world keeps no events.
        """
        if not self._keeps_events:
            raise MotorcadeError("world-keeps-no-events")
        taken = array("I", self.untaken_rows(world))
        memory, count = self.backend, len(taken) // events.COLUMNS
        rows = memory.allocate("taken", Buffer.of("uint32", taken, events.COLUMNS))
        order = memory.zeros("order of events", (2, count), "int64")
        in_order = memory.zeros("events in order", (count, events.COLUMNS), "uint32")
        self.backend.call("sort_events", rows, order, in_order)
        self._taken[world] = None
        return in_order

    def untaken_rows(self, world: int) -> bytes:
        """Return the rows of the events that `take_rows` will sort."""
        parts, rest = [], self._taken[world]
        while rest:
            rest, rows = rest
            parts.append(rows)
        return b"".join(reversed(parts))

    def memory_of(self, car: int, rows: Sequence[int]) -> list[int]:
        """Return numbers of the memory of a car's brain (`motorcade.car.brain`) in world 0, by their rows."""
        index = self._index(car, 0)
        fields = (self.state.memory[row, index : index + 1] for row in rows)
        return [int.from_bytes(self.backend.read(field), "little") for field in fields]

    def totals(self, world: int = 0) -> dict[str, int]:
        """Count what has happened in a world since reset.

        ``frames`` are the frames begun. At each receiver a frame is ``heard`` or lost: ``lost_collision``,
        ``lost_sending``, ``lost_parity``, ``lost_reserved``, ``lost_check``, ``deaf``. ``undetected`` are frames
        that were heard with flipped bits. ``touching_ms`` is the time in which cars touched something, summed over
        cars.
        """
        counts = self._read_counts()
        parts = range(world, world + 1) if self._parts == self.worlds else range(self._parts)
        return {name: sum(counts[part * events.COUNTS + k] for part in parts) for name, k in COUNTED.items()}

    def judge(self, questions: Questions, answers: Answers) -> None:
        """Ask what `motorcade.engine.judging` can ask of the cars of all worlds now."""
        self.backend.call("judge", self.tick, self.state, self._rules, questions, answers)

    def arrays(self) -> Arrays:
        """All that a kernel reads and writes."""
        mat = self._obstacles, self._people, self._voices
        more = self._driven, self._floor, self._around
        return Arrays(self.state, self._cells, *mat, *more, self._rules, self._counters)

    def _read_counts(self) -> "array[int]":
        return array("q", self.backend.read(self._counters.counts))

    def _check_car(self, car: int) -> None:
        if not 0 <= car < self.cars:
            raise MotorcadeError("no-such-car-in-world", car=car, last=self.cars - 1)

    def _index(self, car: int, world: int) -> int:
        """Where a car is in the arrays now."""
        begin = world * self.cars
        return begin + array("I", self.backend.read(self.state.number[begin : begin + self.cars])).index(car)

    def _write(self, field: BackendArray, index: int, value: bytes) -> None:
        self.backend.write(field[index : index + 1], value)

    def _wake(self, moved: int = ALL) -> None:
        # How far the cars are has to be found out again.
        self._within_until = 0
        self.backend.call("wake", self.tick, moved, self.worlds, self.arrays())

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
            world, most = index // self.cars, FARTHEST_UM // 1_000_000
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
        self._taken, self._tick, self._before = taken, counted[events.TICK], []

    def _collected(self, until: int) -> "tuple[list[Untaken], array[int]]":
        """The events that were not taken yet, with those of the call that simulated up to a tick; and the counts."""
        counts, counted = self._counters.counts, self._read_counts()
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
        return [cars.rows, cars.push, cars.wheels, cars.program, *self._cells, self._driven, self._counters.counts]

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
        self._tick, self._before, self._is_torn = max(ticks), [], False

    def _call(self, until: int) -> int:
        """Call the kernels; return the tick that all cars have come to."""
        spoken = self._spoken_at, self._spoken
        self.backend.call("run", 0, 1, until, *spoken, self._seeds, self.arrays())
        return until


def _check_pose(x_m: float, y_m: float, heading: float) -> None:
    if not (abs(x_m) <= FARTHEST_M and abs(y_m) <= FARTHEST_M):
        raise MotorcadeError("car-place-too-far", x=x_m, y=y_m, most=FARTHEST_M)
    if not abs(heading) <= MOST_HEADING:
        raise MotorcadeError("heading-too-large", heading=heading, most=MOST_HEADING)


def _check(mat: Mat, images: tuple[bytes, ...]) -> None:
    if len(mat.starts) == 0:
        raise MotorcadeError("mat-without-cars")
    if any(mat.starts.leads) and not images:
        raise MotorcadeError("leaders-without-program")
    starts = mat.starts
    for pose in zip(starts.x_m, starts.y_m, starts.heading, strict=True):
        _check_pose(*pose)
    if len(images) > 255:
        raise MotorcadeError("too-many-programs", count=len(images))
