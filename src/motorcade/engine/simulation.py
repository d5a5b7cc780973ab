"""A world of cars, or many side by side, wherever its kernels run: this module needs no NumPy, threads or files.

`motorcade.engine.world.World` adds what NumPy makes convenient, and several threads.
"""

import struct
from array import array
from collections.abc import Sequence
from dataclasses import replace

from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.car.brain import SIZE
from motorcade.car.decisions import COUNTS
from motorcade.car.decisions import SIZE as DECISIONS
from motorcade.car.drive_limits import released_mm
from motorcade.config.arguments import MOST_SEED, instance_of, not_allowed, to_list, to_number, to_whole
from motorcade.config.profile import Profile, built_in_profile
from motorcade.engine import agents, bicycle, events, floor, layout
from motorcade.engine.backend import Backend, BackendArray, allocate_all
from motorcade.engine.geometry import to_heading
from motorcade.engine.judging import Asked, nothing
from motorcade.engine.moment import COLUMNS, Columns, Moment, allocate_columns, view_column
from motorcade.engine.resting import ALL
from motorcade.engine.running import Running, done_whole
from motorcade.engine.slices import Slices
from motorcade.engine.state import DRIVEN, Arrays, Buffer
from motorcade.errors import MotorcadeError, Phrase
from motorcade.mats import Mat, Pose, Starts
from motorcade.mats.document import MOST_HEADING, check_starts
from motorcade.mats.schema import FARTHEST_M
from motorcade.words.flow import COUNTERS
from motorcade.words.image import parse_image_bytes

COUNTED = {
    "frames": events.FRAMES,
    "heard": events.FRAMES_HEARD,
    "lost_collision": events.COLLISION,
    "lost_sending": events.SENDING,
    "lost_parity": events.PARITY,
    "lost_reserved": events.RESERVED,
    "lost_check": events.CHECK,
    "lost_remote": events.REMOTE,
    "deaf": events.DEAF,
    "undetected": events.UNDETECTED,
    "touching_ms": events.TOUCHING_MS,
}
_MOST_MM = FARTHEST_M * 1000


class Simulation(Running):
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
        run_number: how often the worlds have been reset.
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
        self.mat = mat
        self.images = checked_images(images)
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
        self._decisions = layout.decisions_of(self.worlds, self._standing, backend)
        self._farthest_um = layout.farthest_um(self._standing.x.items, self._standing.y.items)
        self._shown: Columns | None = None
        self._set_environment(mat, self.profile)
        self._slices, self._can_go_back = Slices(self.worlds * self.cars, backend.interruptible), False
        self._asked = nothing(backend)
        self._begin(seeds, 0)

    def reset(self, seeds: int | Sequence[int] | None = None) -> None:
        """Begin again, with other seeds where they are given (as many as there are worlds)."""
        given = self.seeds if seeds is None else (seeds,) if isinstance(seeds, int) else seeds
        if len(given) != self.worlds:
            raise MotorcadeError("seeds-differ-from-worlds", count=len(given), worlds=self.worlds)
        self.backend.join()
        self._begin(given, self.run_number + 1)

    @done_whole
    def _begin(self, seeds: Sequence[int], run_number: int) -> None:
        memory = self.backend
        self.seeds = tuple(to_whole("seeds", seed, 0, MOST_SEED) for seed in seeds)
        self._seeds = memory.allocate("seeds", Buffer.of("int64", self.seeds))
        layout.put_in_place(self.state, self._standing, self.worlds, memory)
        memory.clear(self._decisions)
        self._keep_driven([])
        room = 64 * self.cars + 1024 if self._keeps_events else 0
        counts = memory.zeros("counts", (self._parts, events.COUNTS), "int64")
        self._counters = self._with_room(counts, room * self.worlds // self._parts)
        self._begin_ticks(self._farthest_um)
        self.run_number = run_number

    @done_whole
    def assign_images(self, images: Sequence[int]) -> None:
        """Give each world a program of its own, before the first tick: all its leaders run image ``images[world]``.

        `reset` gives the leaders the images of the mat's order again.
        """
        images = [to_whole("images", image, 0, len(self.images) - 1) for image in to_list("images", images)]
        if len(images) != self.worlds:
            raise MotorcadeError("images-differ-from-worlds", count=len(images), worlds=self.worlds)
        all_leads = [program > 0 for program in self._standing.program.items]
        programs = b"".join(bytes(image + 1 if leads else 0 for leads in all_leads) for image in images)
        self.backend.write(self.state.program, programs)

    @done_whole
    def place_cars(self, starts: Sequence[Starts]) -> None:
        """Let the cars of each world start in places of their own, before the first tick; who leads stays as it is.

        `reset` gives the cars their places on the mat again. Raises MotorcadeError: they are not as many as there are
        worlds and cars, a tick has passed, or a car stands in a wall or in another car.
        """
        starts = [instance_of(Starts, "starts", given) for given in to_list("starts", starts)]
        if self.tick or [len(places) for places in starts] != [self.cars] * self.worlds:
            raise MotorcadeError("places-differ-from-cars", cars=self.cars, worlds=self.worlds)
        for places in starts:
            check_starts(replace(self.mat, starts=places), self.profile)
        standing = [layout.standing_of(replace(self.mat, starts=places), 1) for places in starts]
        for name in ("x", "y", "heading"):
            written = b"".join(getattr(cars, name).items.tobytes() for cars in standing)
            self.backend.write(getattr(self.state, name), written)
        self._within_until = 0

    @done_whole
    def say(self, word: str) -> None:
        """Let every car hear ``stop`` or ``go`` in the next tick. Raises MotorcadeError: it is another word."""
        if not isinstance(word, str) or word not in layout.VOICES:
            raise not_allowed("word", word, ", ".join(layout.VOICES))
        self._spoken_at, self._spoken = self.tick, layout.VOICES[word]

    @done_whole
    def set_environment(self, mat: Mat, range_mm: int | None = None) -> None:
        """Replace walls, obstacles, people, voices and physics; the cars stay where they are and go on.

        Args:
            mat: what is around the cars from now on; its own starts and tick are ignored.
            range_mm: the range of infrared; default: as before.

        Raises:
            MotorcadeError: the mat can't be simulated; nothing has changed then.
        """
        mat = replace(instance_of(Mat, "mat", mat), starts=self.mat.starts, tick_ms=self.tick_ms)
        if range_mm is not None:
            range_mm = to_whole("range_mm", range_mm, 1, _MOST_MM)
        infrared = self.profile.infrared
        profile = replace(self.profile, infrared=replace(infrared, range_mm=range_mm or infrared.range_mm))
        self._set_environment(mat, profile)
        self.mat = mat
        self.profile = profile
        self._wake()

    def _set_environment(self, mat: Mat, profile: Profile) -> None:
        backend = self.backend
        rules = layout.rules_of(mat, profile, self.images)
        self._look_mm = released_mm(profile.drive.obstacle_stop_mm)
        self._obstacles = layout.obstacles_of(mat, rules, backend, self._look_mm)
        self._rules = allocate_all(backend, rules)
        self._floor = backend.allocate("floor", floor.floor_of(mat, rules.floor_aside))
        self._people = allocate_all(backend, layout.people_of(mat, self._parts))
        self._voices = allocate_all(backend, layout.voices_of(mat))

    @done_whole
    def move(self, car: int, pose: Pose, world: int = 0) -> None:
        """Move a car to another place, where it goes on with what it does.

        Raises:
            MotorcadeError: there is no such car or place.
        """
        car, world = self._checked_car(car, world)
        instance_of(Pose, "pose", pose)
        x, y = (to_number(name, getattr(pose, name), -FARTHEST_M, FARTHEST_M) for name in ("x", "y"))
        heading = to_number("heading", pose.heading, -MOST_HEADING, MOST_HEADING)
        index = self._index(car, world)
        self._write(self.state.x, index, struct.pack("<i", round(x * 1e6)))
        self._write(self.state.y, index, struct.pack("<i", round(y * 1e6)))
        self._write(self.state.heading, index, struct.pack("<I", to_heading(heading)))
        self._wake(index)

    @done_whole
    def drive(self, car: int, angle_deg: int = 90, direction: int = 1, speed: int = 0, world: int = 0) -> None:
        """Drive a car by hand. Its own program goes on, but its wheels obey these values until `give_back`.

        Args:
            car: the number of the car, a leader or a follower.
            angle_deg: the angle of the steering servo, 0 (right) to 180 (left).
            direction: 1 for forward, 0 for backward.
            speed: the motor's duty, 0 to the profile's ``motor.pwm_max``.
            world: the index of the car's world.

        Raises:
            MotorcadeError: there is no such car, or a value is out of its range.
        """
        car, world = self._checked_car(car, world)
        angle_deg = to_whole("angle_deg", angle_deg, 0, 180)
        direction = to_whole("direction", direction, 0, 1)
        speed = to_whole("speed", speed, 0, self.profile.motor.pwm_max)
        motion = bicycle.motion_of(angle_deg, direction, speed, self.profile, self.tick_ms)
        index = self._index(car, world)
        self._keep_driven([*self._others_driven(car, world), [world, car, index, *motion, 0]])
        self._write(self.state.wheels, index, bytes([DRIVEN]))

    @done_whole
    def give_back(self, car: int, world: int = 0) -> None:
        """Give the wheels of a car back to its own program. Raises MotorcadeError: there is no such car."""
        car, world = self._checked_car(car, world)
        if (world, car) in self._drivers:
            self.backend.call("give_back", self._index(car, world), self.tick, self.state, self._rules)
            self._keep_driven(self._others_driven(car, world))

    def _others_driven(self, car: int, world: int) -> list[list[int]]:
        """The columns of the other driven cars, whose indices a sort may have changed."""
        columns = bicycle.columns_of(self.backend.read(self._driven))
        return [column for column in columns if column[: bicycle.NUMBER + 1] != [world, car]]

    def _keep_driven(self, columns: list[list[int]]) -> None:
        self._driven = self.backend.allocate("driven", bicycle.matrix_of(columns))
        self._drivers = {(column[bicycle.WORLD], column[bicycle.NUMBER]) for column in columns}

    def obstacle_mm(self, car: int) -> int:
        """What a car's ultrasonic sensor measures for its driver, as far as the profile's limits ask; in world 0."""
        if not self._look_mm or self.tick == 0:
            return NOTHING_IN_SIGHT_MM
        return self.look_ahead(car, self._look_mm)

    def look_ahead(self, car: int, look_mm: int) -> int:
        """What a car's ultrasonic sensor measures up to ``look_mm``, in world 0 and after the first tick."""
        self._check_begun()
        car, world = self._checked_car(car, 0)
        look_mm = to_whole("look_mm", look_mm, 0, _MOST_MM)
        answer = self.backend.zeros("answer", (1,), "int64")
        self.backend.call("read_obstacle", self._index(car, world), look_mm, self.arrays(), answer)
        return int.from_bytes(self.backend.read(answer), "little")

    def begin_words(self, words: bytes) -> None:
        """Let followers begin words in the next tick, after the first one, as if each had just heard its own.

        Args:
            words: four bytes a car, little-endian, in the order of worlds and car numbers: a control word without
                parity, or `motorcade.engine.agents.KEEP`.

        Raises:
            MotorcadeError: they are not as many as there are cars, or no tick has passed.
        """
        self._check_begun()
        if not isinstance(words, bytes) or len(words) != 4 * self.worlds * self.cars:
            raise MotorcadeError("words-differ-from-cars", needed=4 * self.worlds * self.cars)
        given = self.backend.zeros("words", (self.worlds * self.cars,), "uint32")
        self.backend.write(given, words)
        self.begin_given(given)

    def begin_given(self, given: BackendArray) -> None:
        """Let followers begin words as `begin_words`, from an array of one number a car."""
        self.backend.call("begin_words", self.tick, self.worlds, given, self.arrays())

    def read_senses(self, sensed: BackendArray | None = None) -> BackendArray:
        """Return what every car senses, after the first tick: (worlds * cars, SENSED) int64; a new array unless given.

        The columns are those of `motorcade.engine.agents`. Sensors are on whatever a car's word asks for.
        """
        self._check_begun()
        if sensed is None:
            sensed = self.backend.zeros("sensed", (self.worlds * self.cars, agents.SENSED), "int64")
        look_mm = self.profile.body.ultrasonic_range_mm
        self.backend.call("read_senses", self.tick, self.worlds, look_mm, self.arrays(), sensed)
        return sensed

    def observe(self, given_ms: int, *arrays: BackendArray) -> None:
        """Write what every car observes; the arrays are those of `motorcade.engine.agents.observe`, ``given`` first."""
        range_m = self.profile.body.ultrasonic_range_mm / 1000
        self.backend.call("observe", given_ms, range_m, *arrays)

    def snapshot(self, world: int = 0) -> Moment:
        """What the cars of a world show now, and what was counted in it since reset; columns are memory views."""
        world = self._checked_world(world)
        shown = self.read_moment(world)
        columns = {name: view_column(name, self.backend.read(getattr(shown, name))) for name in COLUMNS}
        return Moment(t_ms=self.now_ms, counts=self.totals(world), world=world, run=self.run_number, **columns)

    def read_moment(self, world: int = 0, into: Columns | None = None) -> Columns:
        """Write what the cars of a world show now into arrays; default: arrays that the next call overwrites."""
        if into is None:
            if self._shown is None:
                self._shown, _ = allocate_columns(self.backend, "moment", self.cars)
            into = self._shown
        shown = self._checked_world(world), self.tick, self.state, self._driven, self._rules
        self.backend.call("read_moment", *shown, into)
        return into

    def take_rows(self, world: int = 0) -> BackendArray:
        """Return the events of a world since the last call, by time and car.

        Each is a row of `motorcade.engine.events.COLUMNS` numbers. The next call overwrites the array.

        Raises:
            MotorcadeError: the world keeps no events.
        """
        if not self._keeps_events:
            raise MotorcadeError("world-keeps-no-events")
        world = self._checked_world(world)
        taken = array("I", self.untaken_rows(world))
        memory = self.backend
        count = len(taken) // events.COLUMNS
        rows = memory.allocate("taken", Buffer.of("uint32", taken, events.COLUMNS))
        order = memory.zeros("order of events", (2, count), "int64")
        in_order = memory.zeros("events in order", (count, events.COLUMNS), "uint32")
        self.backend.call("sort_events", rows, order, in_order)
        self._taken[world] = None
        return in_order

    def memory_of(self, car: int, rows: Sequence[int]) -> list[int]:
        """Return numbers of the memory of a car's brain (`motorcade.car.brain`) in world 0, by their rows."""
        car, world = self._checked_car(car, 0)
        index = self._index(car, world)
        rows = [to_whole("rows", row, 0, SIZE - 1) for row in to_list("rows", rows)]
        fields = (self.state.memory[row, index : index + 1] for row in rows)
        return [int.from_bytes(self.backend.read(field), "little") for field in fields]

    def decisions_of(self, car: int) -> bytes:
        """Return a leader's memory of its decisions (`motorcade.car.decisions`) in world 0; zeros of another car."""
        car, _ = self._checked_car(car, 0)
        leads = self._standing.program.items[: car + 1]
        if not leads[car]:
            return bytes(DECISIONS)
        row = sum(program > 0 for program in leads) - 1
        return self.backend.read(self._decisions[row])

    def counters_of(self, car: int) -> list[int]:
        """Return the four counters of a leader that decides in world 0; zeros of another car."""
        return list(self.decisions_of(car)[COUNTS : COUNTS + COUNTERS])

    def totals(self, world: int = 0) -> dict[str, int]:
        """Count what has happened in a world since reset.

        ``frames`` are the frames begun. At each receiver a frame is ``heard`` or lost: ``lost_collision``,
        ``lost_sending``, ``lost_parity``, ``lost_reserved``, ``lost_check``, ``lost_remote``, ``deaf``.
        ``undetected`` are frames that were heard with flipped bits. ``touching_ms`` is the time in which cars touched
        something, summed over cars.
        """
        world = self._checked_world(world)
        counts = self._read_counts()
        parts = range(world, world + 1) if self._parts == self.worlds else range(self._parts)
        return {name: sum(counts[part * events.COUNTS + k] for part in parts) for name, k in COUNTED.items()}

    def ask(self, asked: Asked) -> None:
        """Ask questions of the cars at each moment that a run passes from now on, and write the answers.

        A moment at which a run ends is judged by the next run, or by `judge`. A large world of several threads asks
        nothing.
        """
        self._asked = asked

    def judge(self) -> None:
        """Ask the questions at the moment to which the worlds have come, after the last run."""
        self.backend.call("judge", self.tick, self.state, self._rules, self._asked.questions, self._asked.answers)

    def arrays(self) -> Arrays:
        """All that a kernel reads and writes."""
        mat = self._obstacles, self._people, self._voices
        of_cars = self.state, self._cells, *mat, self._driven
        return Arrays(*of_cars, self._decisions, self._floor, self._around, self._rules, self._counters)

    def _checked_car(self, car: int, world: int) -> tuple[int, int]:
        return to_whole("car", car, 0, self.cars - 1), self._checked_world(world)

    def _check_begun(self) -> None:
        if self.tick == 0:
            raise MotorcadeError("no-tick-has-passed")

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


def checked_images(images: Sequence[bytes]) -> tuple[bytes, ...]:
    """Return the bytes of each image. Raises MotorcadeError where one is damaged, or where these are no images."""
    if isinstance(images, bytes | bytearray | memoryview):
        raise MotorcadeError("images-not-in-a-list")
    checked = []
    for number, image in enumerate(to_list("images", images)):
        if not isinstance(image, bytes | bytearray | memoryview):
            raise not_allowed(f"images[{number}]", image, Phrase("bytes-of-an-image"))
        checked.append(bytes(image))
        parse_image_bytes(checked[-1])
    return tuple(checked)


def _check(mat: Mat, images: tuple[bytes, ...]) -> None:
    if len(mat.starts) == 0:
        raise MotorcadeError("mat-without-cars")
    if any(mat.starts.leads) and not images:
        raise MotorcadeError("leaders-without-program")
    if len(images) > 255:
        raise MotorcadeError("too-many-programs", count=len(images))
