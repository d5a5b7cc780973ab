"""The studio's worlds: the engine's state, packed for a page (`motorcade.service.playback.SimulatedWorld`)."""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from motorcade.boards.simulated_drive import DrivenCars
from motorcade.cameras.simulated import Scene, to_jpeg
from motorcade.car.brain import HOLDS, RUNNING, SLOT, STARTED_MS, STATE, WORD
from motorcade.config.profile import Profile
from motorcade.engine.events import KINDS, LOSS_REASONS
from motorcade.engine.state import Moment
from motorcade.engine.world import World
from motorcade.errors import MotorcadeError, Phrase
from motorcade.mats import Mat, Pose, check_mat
from motorcade.mats.document import mat_of
from motorcade.runs.recording import Description
from motorcade.service.history import EVENT_BYTES, EVERY_MS, HEARD, LOST, NO_INDEX, RUNS, SENDS
from motorcade.service.messages import MatDocument, sentences
from motorcade.service.missions import chosen_mission
from motorcade.service.playback import SimulatedWorld
from motorcade.service.programs import profile_named
from motorcade.service.referee import Referee
from motorcade.service.why import Facts, Sender, why
from motorcade.service.world_messages import CarDetails, Hello, ReceivedFrame, SetWorld, Why
from motorcade.words.formats import CONTROL, FRAME
from motorcade.words.image import bytes_to_words, parse_image_bytes, words_to_bytes
from motorcade.words.infrared import word_of
from motorcade.words.ticks import elapsed_ms

# With more a moment takes so long to compute that one world delays the others.
MOST_FURNITURE = 400
_NO_PROGRAM = words_to_bytes((0,))
_FRAME, _HEARD, _LOST = (KINDS.index(kind) for kind in ("frame", "heard", "lost"))
_T = TypeVar("_T")

EVENT_ROW = np.dtype(
    [
        ("t_ms", "<u4"),
        ("car", "<u4"),
        ("kind", "u1"),
        ("why", "u1"),
        ("reserved", "<u2"),
        ("word", "<u4"),
        ("other", "<u4"),
    ]
)
assert EVENT_ROW.itemsize == EVENT_BYTES
# The columns of a moment; wide ones come first, so that each begins at a multiple of its width.
_COLUMNS = ("<f4", "<f4", "<f4", "<u2", "u1", "u1", "u1")


def pack_moment(*columns: NDArray[Any]) -> bytes:
    """Pack the columns x_m, y_m, heading, index of the word, wheels, led and flags (`motorcade.service.history`)."""
    pairs = zip(columns, _COLUMNS, strict=True)
    packed = b"".join([np.asarray(column).astype(kind).tobytes() for column, kind in pairs])
    return packed + bytes(-len(packed) % 4)


def unpack_moment(data: bytes, cars: int) -> list[NDArray[Any]]:
    """Return the columns that `pack_moment` packed."""
    columns: list[NDArray[Any]] = []
    at = 0
    for kind in _COLUMNS:
        columns.append(np.frombuffer(data, kind, cars, at))
        at += columns[-1].nbytes
    return columns


def event_rows(events: NDArray[np.void]) -> NDArray[np.void]:
    """Return events of `motorcade.engine.events.EVENT` as the rows of a picture."""
    rows = np.zeros(len(events), EVENT_ROW)
    for name in ("t_ms", "car", "kind", "why", "word", "other"):
        rows[name] = events[name]
    return rows


# The answer to 'why' looks at so many cars around one.
_NEAREST = 8


class StudioWorld(SimulatedWorld):
    """A world that a page plays.

    Args:
        world: one world that stores events, and whose leaders run one image.
        driven: the boards of those of its cars that somebody drives.
        referee: watches the goals of its mission.
    """

    def __init__(self, world: World, driven: DrivenCars | None = None, referee: Referee | None = None) -> None:
        self.referee = referee
        self.cars = world.cars
        self.tick_ms = world.tick_ms
        self._world = world
        self._driven = driven or DrivenCars()
        self._scene: tuple[Mat, Scene] | None = None
        self._words = _WordIndex(world)
        self._counters = _Counters(self.cars)

    @property
    def now_ms(self) -> int:
        return self._world.now_ms

    @property
    def seed(self) -> int:
        return int(self._world.seeds[0])

    @property
    def profile(self) -> Profile:
        """The cars' profile."""
        return self._world.profile

    def run(self, duration_ms: int) -> bytes:
        self._driven.steer(self._world)
        self._world.run(duration_ms)
        events = event_rows(self._world.take_events())
        self._counters.add(events)
        return events.tobytes()

    def reset(self, seed: int) -> None:
        self._world.reset(seed)
        self._counters = _Counters(self.cars)

    def speak(self, word: str) -> None:
        self._world.say(word)

    def furnish(self, mat: MatDocument, range_mm: int | None) -> None:
        furniture = mat_from({**mat, "car": [], "crowd": []}, 0)
        _check_furniture(furniture)
        _or_refuse("bad-world", lambda: self._world.furnish(furniture, range_mm))

    def move(self, car: int, x_m: float, y_m: float, heading_deg: float) -> None:
        _or_refuse("bad-world", lambda: self._world.move(car, Pose(x_m, y_m, math.radians(heading_deg))))

    def check_car(self, car: int) -> None:
        if not 0 <= car < self.cars:
            raise MotorcadeError(
                "bad-world", reason=MotorcadeError("no-such-car-in-world", car=car, last=self.cars - 1)
            )

    def moment(self, is_stored: bool) -> bytes:
        now = self._world.snapshot()
        flags = now.runs * np.uint8(RUNS) | now.sends * np.uint8(SENDS) | self._counters.take_marks(is_stored)
        return pack_moment(now.x_m, now.y_m, now.heading, self._words.indices(), now.wheels, now.led, flags)

    def details(self, car: int) -> CarDetails:
        counted = self._counters.of(car)
        phrase, cure, value = why(self._facts(car, counted))
        reason = Why(phrase.key, sentences(phrase), phrase.details.get("car"), cure, value)
        return CarDetails(car=car, **self._words.details(car), **counted, why=reason)

    def _facts(self, car: int, counted: dict[str, Any]) -> Facts:
        """What `why` needs to know of a car."""
        now = self._world.snapshot()
        distance_mm = np.hypot(now.x_m - now.x_m[car], now.y_m - now.y_m[car]) * 1000
        sent, heard = self._counters.frames > 0, self._counters.heard > 0

        def nearest(cars: NDArray[np.bool_]) -> tuple[Sender, ...]:
            found = np.flatnonzero(cars & (np.arange(self.cars) != car))
            found = found[np.argsort(distance_mm[found])][:_NEAREST]
            return tuple(
                Sender(int(each), math.ceil(distance_mm[each]), self._world.reach(int(each), car)) for each in found
            )

        return Facts(
            leads=car in self.leads(),
            driven=car in self.driven(),
            followers_words=self._words.followers,
            leaders=len(self.leads()),
            t_ms=self.now_ms,
            range_mm=self.profile.infrared.range_mm,
            senders=nearest(sent),
            listeners=nearest(heard & ~sent),
            lost=counted["lost"],
            last_frame=counted["last_frame"],
        )

    def counts(self) -> dict[str, int]:
        return {name: int(values[0]) for name, values in self._world.counts().items()}

    def driven(self) -> list[int]:
        return self._driven.driven(self.cars)

    def leads(self) -> list[int]:
        """The cars that lead."""
        return self._world.mat.starts.leaders

    def hello(self, session: str, resumed: bool) -> Hello:
        radius_m = self.profile.body.diameter_mm / 2000
        range_m = self.profile.infrared.range_mm / 1000
        return Hello(session, resumed, self.cars, self.leads(), self.tick_ms, radius_m, range_m)

    def view(self, car: int) -> bytes:
        """What a car's camera sees in the present, as a JPEG file. Raises MotorcadeError where there is no such car."""
        self.check_car(car)
        mat = self._world.mat
        if self._scene is None or self._scene[0] is not mat:
            self._scene = mat, Scene(self.description())
        return to_jpeg(self._scene[1].draw(self._world.snapshot(), car))

    def description(self) -> Description:
        """What a recording holds beside the moments of the run."""
        return Description.of(self._world, EVERY_MS)

    def frames(self, moments: Iterator[tuple[int, bytes]]) -> Iterator[Moment]:
        """Stored moments for a film."""
        words = self._words.words
        for t_ms, data in moments:
            x_m, y_m, heading, index, wheels, led, flags = unpack_moment(data, self.cars)
            is_known = index != NO_INDEX
            word = np.where(is_known, words[np.where(is_known, index, 0)], 0).astype(np.uint32)
            runs, sends = (flags & flag > 0 for flag in (RUNS, SENDS))
            # An empty dict, not the default: a mappingproxy can't be sent to the process that draws.
            yield Moment(t_ms, x_m, y_m, heading, word, runs, wheels, led, sends, {})


def build_world(
    message: SetWorld, driven: DrivenCars, most_cars: int, images: Sequence[bytes] | None = None
) -> StudioWorld:
    """Build a page's world; with ``images`` the k-th leader has the k-th of them. Raises MotorcadeError.

    Goals about words, and the words that pages show, are those of the message's image.
    """
    mat = mat_from(message.mat, most_cars)
    _check_furniture(mat)
    profile = profile_named(message.profile)
    image = _NO_PROGRAM if message.image is None else message.image
    parse_image_bytes(image)

    def build() -> World:
        world = World(mat, images or [image], profile, seeds=message.seed, events=True, threads=1)
        if message.range_mm is not None:
            world.furnish(mat, message.range_mm)
        return world

    _or_refuse("bad-mat", lambda: check_mat(mat, profile))
    referee = Referee(chosen_mission(message.mission), image) if message.mission else None
    if referee and len(referee.mission.mat.starts) != len(mat.starts):
        raise MotorcadeError("mat-is-not-the-missions")
    return StudioWorld(_or_refuse("bad-world", build), driven, referee)


def mat_from(document: Any, most_cars: int) -> Mat:
    """Return the mat in a page's ``document``. Raises MotorcadeError."""
    # Checked before cars are placed: a crowd is one line, yet it may have millions of cars.
    count = _cars_in(document)
    if count > most_cars:
        raise MotorcadeError("too-many-cars", count=count, most=most_cars)
    return _or_refuse("bad-mat", lambda: mat_of(document, Phrase("mat-of-page")))


def _or_refuse(code: str, work: Callable[[], _T]) -> _T:
    """Call ``work``; where it raises a MotorcadeError, raise the error ``code`` with that as its reason."""
    try:
        return work()
    except MotorcadeError as problem:
        raise MotorcadeError(code, reason=problem) from None


def _cars_in(document: Any) -> float:
    """Count the cars in the document; 0 where it isn't a mat, which another check refuses."""
    if not isinstance(document, dict):
        return 0
    cars, crowds = document.get("car"), document.get("crowd")
    count: float = len(cars) if isinstance(cars, list) else 0
    for crowd in crowds if isinstance(crowds, list) else ():
        crowd_cars = crowd.get("cars") if isinstance(crowd, dict) else None
        count += crowd_cars if isinstance(crowd_cars, int | float) else 0
    return count


def _check_furniture(mat: Mat) -> None:
    corners = sum(map(len, mat.polygons))
    steps = sum(len(person.path) for person in mat.people)
    count = len(mat.walls) + len(mat.discs) + corners + steps + len(mat.voices)
    if count > MOST_FURNITURE:
        raise MotorcadeError("too-much-furniture", count=count, most=MOST_FURNITURE)


class _WordIndex:
    """For each car the index of the image's word that it executes or holds."""

    def __init__(self, world: World) -> None:
        self._world = world
        self.words: NDArray[np.uint32] = np.array(bytes_to_words(world.images[0]), np.uint32)
        self._states = int(self.words[0]) >> 24
        self.followers = len(self.words) - 1 - self._states
        self._sent, self._place = np.unique(self.words[1 + self._states :], return_inverse=True)
        self._by_slot: dict[int, NDArray[np.uint16]] = {}
        self._leaders = world.mat.starts.leaders

    def _memory(self) -> NDArray[np.uint32]:
        """The memory of each car's program, in columns sorted by the number of the car."""
        state = self._world.state
        columns: NDArray[np.uint32] = state.memory[:, np.argsort(state.number)]
        return columns

    def indices(self) -> NDArray[np.uint16]:
        """The index, among the image's words, of what each car executes or holds; NO_INDEX for none.

        Where the image has a follower's word more than once, the index of the one that the leader sent last.
        """
        memory = self._memory()
        index = np.full(self._world.cars, NO_INDEX, np.uint16)
        if len(self._sent):
            slot = int(memory[SLOT, self._leaders[0]]) if len(self._leaders) else 0
            place = np.minimum(np.searchsorted(self._sent, memory[WORD]), len(self._sent) - 1)
            is_known = (memory[HOLDS] > 0) & (self._sent[place] == memory[WORD])
            index[is_known] = self._latest(slot)[place[is_known]]
        leaders = self._leaders
        index[leaders] = np.where(memory[RUNNING, leaders] > 0, memory[STATE, leaders] + 1, NO_INDEX)
        return index

    def _latest(self, slot: int) -> NDArray[np.uint16]:
        """For each distinct follower word its latest index in a round that ends with ``slot``."""
        if slot not in self._by_slot:
            count = len(self._place)
            latest = np.zeros(len(self._sent), np.uint16)
            for k in range(slot + 1, slot + 1 + count):
                latest[self._place[k % count]] = 1 + self._states + k % count
            self._by_slot[slot] = latest
        return self._by_slot[slot]

    def details(self, car: int) -> dict[str, Any]:
        """The word that a car executes or holds: by fields, its index, and since when."""
        memory = self._memory()[:, car]
        is_leader = self._world.mat.starts.leads[car]
        holds = bool(memory[RUNNING if is_leader else HOLDS])
        word = int(memory[WORD])
        return {
            "leads": is_leader,
            "word": f"{word:08x}" if holds else None,
            "values": CONTROL.decode(word)._asdict() if holds else None,
            "index": int(self.indices()[car]),
            "runs": bool(memory[RUNNING]),
            "since_ms": elapsed_ms(self._world.now_ms, int(memory[STARTED_MS])) if holds else None,
        }


class _Counters:
    """Count the frames that each car sent, received and lost; store the last one received."""

    def __init__(self, cars: int) -> None:
        self._cars = cars
        self.frames = np.zeros(cars, np.int64)
        self.heard = np.zeros(cars, np.int64)
        self._lost = np.zeros((len(LOSS_REASONS), cars), np.int64)
        self._last = np.zeros((3, cars), np.int64)
        # The flags LOST and HEARD since the last picture, and since the last stored moment.
        self._marks = np.zeros((2, cars), np.uint8)

    def add(self, events: NDArray[np.void]) -> None:
        """Count the rows of events."""
        cars, kinds = events["car"], events["kind"]
        heard, lost = events[kinds == _HEARD], events[kinds == _LOST]
        self._marks[:, lost["car"]] |= np.uint8(LOST)
        self._marks[:, heard["car"]] |= np.uint8(HEARD)
        self.frames += np.bincount(cars[kinds == _FRAME], minlength=self._cars)
        self.heard += np.bincount(heard["car"], minlength=self._cars)
        for row, name in enumerate(("word", "other", "t_ms")):
            self._last[row, heard["car"]] = heard[name]
        np.add.at(self._lost, (lost["why"], lost["car"]), 1)

    def take_marks(self, is_stored: bool) -> NDArray[np.uint8]:
        """The flags LOST and HEARD since the last call with the same ``is_stored``."""
        marks: NDArray[np.uint8] = self._marks[int(is_stored)].copy()
        self._marks[int(is_stored)] = 0
        return marks

    def of(self, car: int) -> dict[str, Any]:
        """The counts of a car by name, and the last frame that it received."""
        frame, sender, t_ms = self._last[:, car].tolist()
        on_air = FRAME.decode(frame)
        heard = int(self.heard[car])
        last = ReceivedFrame(f"{word_of(frame):08x}", on_air.tag, on_air.check, sender, t_ms)
        return {
            "frames": int(self.frames[car]),
            "heard": heard,
            "lost": {why: int(self._lost[k, car]) for k, why in enumerate(LOSS_REASONS) if why},
            "last_frame": last if heard else None,
        }
