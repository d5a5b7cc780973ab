"""A world as bytes, from which it goes on with equal bits: here or on another computer, with any kernels and threads.

The bytes are MAGIC, the SHA-256 digest of all that follows, the length of a header, the header in JSON, and columns of
numbers, little-endian and in the order of worlds and car numbers. Where the cars are in memory, and which of them are
near each other, isn't saved: that depends on threads, and a sort finds it again.

Kernels check nothing that they read. So `load` checks what they use as an index, as a divisor or as a distance to
catch up with; whoever makes bytes by hand can make a world that never was, and nothing worse.
"""

import hashlib
import struct
from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import cache, partial
from importlib.metadata import version
from typing import Any, Self

import msgspec
import numpy as np
from numpy.typing import NDArray

from motorcade.car import brain, decisions
from motorcade.config.profile import Profile, levels_of, profile_from_dict
from motorcade.engine import bicycle, events
from motorcade.engine.backend import BackendName
from motorcade.engine.bodies import DISPLACEMENT_BITS
from motorcade.engine.linear_memory import PATH
from motorcade.engine.resting import RESTORED
from motorcade.engine.running import FARTHEST_UM
from motorcade.engine.simulation import Simulation, checked_images
from motorcade.engine.state import NOBODY, CarArrays
from motorcade.errors import MotorcadeError, Phrase
from motorcade.mats.document import MOST_HEADING, document_of, mat_without_cars
from motorcade.mats.model import Mat, Starts, flags, floats
from motorcade.mats.schema import FARTHEST_M
from motorcade.words.image import Image, image_words, parse_image_bytes
from motorcade.words.ticks import TICKS_MASK

MAGIC = b"motorcade-world/1\n"
_ANY_MAGIC = b"motorcade-world/"
_DIGEST_BYTES = 32
_LENGTH = struct.Struct("<Q")
# Fields of a car by their row behind the brain's memory.
_ROW = {name: brain.SIZE + number for number, name in enumerate(CarArrays._fields[2:-4])}
_ROWS = brain.SIZE + len(_ROW)
_CAR_BYTES = 4 * _ROWS + 2
# Rows that loading makes anew.
_MADE = _ROW["number"], _ROW["clear"]
# A leader catches up with its states and slots one by one. None is so far behind.
_MOST_BEHIND_MS = 1 << 22
_MOST_TICK = 1 << 40
_MOST_COUNT = 1 << 60


class _Header(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """All of a world that isn't a column; ``driven`` has world, number and motion of each driven car."""

    engine: str
    cars: int
    worlds: int
    mat: dict[str, Any]
    groups: list[tuple[str, int]]
    profile: dict[str, Any]
    images: list[bytes]
    events: bool
    run_number: int
    tick: int
    spoken_at: int
    spoken: int
    driven: list[tuple[int, ...]]


@cache
def engine_version() -> str:
    """The version of Motorcade, and what its kernels are: worlds of others may go on otherwise."""
    return f"{version('motorcade')} {hashlib.sha256(PATH.read_bytes()).hexdigest()[:16]}"


class SavableSimulation(Simulation):
    """A simulation that can be saved, copied and pickled; its arrays are NumPy's."""

    def save(self) -> bytes:
        """Return the world as bytes, from which `load` makes one that goes on with equal bits.

        They hold the mat, the programs, the profile, all cars, what was counted, and the events that were not taken.
        """
        tick = self.tick
        starts = self.mat.starts
        untaken = [self._sorted_rows(world) for world in range(self.worlds)]
        by_number = self._order_of_numbers()
        rows = np.asarray(self.state.rows)[:, by_number]
        rows[_MADE, :] = 0
        columns: list[Any] = [starts.x_m, starts.y_m, starts.heading, starts.leads, np.array(self.seeds, "<i8")]
        columns += [self._counts_of_worlds(), np.array(list(map(len, untaken)), "<i8"), rows.astype("<u4")]
        columns += [np.asarray(column)[by_number] for column in (self.state.wheels, self.state.program)]
        columns.append(np.asarray(self._decisions))
        columns += [rows.astype("<u4") for rows in untaken]
        driven = [
            (column[bicycle.WORLD], column[bicycle.NUMBER], *column[bicycle.AHEAD : bicycle.TURNED])
            for column in bicycle.columns_of(self.backend.read(self._driven))
        ]
        header = _Header(
            engine=engine_version(),
            cars=self.cars,
            worlds=self.worlds,
            mat=document_of(_mat_of(document_of(self.mat))),
            groups=list(starts.groups),
            profile=asdict(_profile_of(asdict(self.profile))),
            images=list(self.images),
            events=self._keeps_events,
            run_number=self.run_number,
            tick=tick,
            spoken_at=self._spoken_at,
            spoken=self._spoken,
            driven=sorted(driven),
        )
        text = msgspec.json.encode(header)
        body = b"".join([_LENGTH.pack(len(text)), text, *(np.asarray(column).tobytes() for column in columns)])
        return MAGIC + hashlib.sha256(body).digest() + body

    @classmethod
    def load(cls, data: bytes, *, threads: int | None = None, kernels: BackendName | None = None) -> Self:
        """Make the world that `save` returned as bytes; threads and kernels as for a new world.

        Raises:
            MotorcadeError: the bytes are no world, cut off or changed, or of another version of Motorcade; or the world
                can't be made here.
        """
        header, columns = _parse(data)
        x_m, y_m, heading = (floats(columns.take("<f8", header.cars)) for _ in range(3))
        leads = flags(columns.take("u1", header.cars).tolist())
        seeds = columns.take("<i8", header.worlds).tolist()
        _require(all(abs(length_m) <= FARTHEST_M for length_m in (*x_m, *y_m)))
        _require(all(abs(angle) <= MOST_HEADING for angle in heading))
        mat = replace(_mat_of(header.mat), starts=Starts(x_m, y_m, heading, leads, tuple(header.groups)))
        images = checked_images(header.images)
        profile = _profile_of(header.profile)
        world = cls.__new__(cls)
        # Cars may have started where something stands now.
        world._open(mat, images, profile, seeds, header.events, threads, kernels)
        world._restore(header, columns)
        return world

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(type(self).load, threads=self._given_threads, kernels=self._given_kernels), (self.save(),)

    def _open(
        self,
        mat: Mat,
        images: Sequence[bytes],
        profile: Profile,
        seeds: Sequence[int],
        events: bool,
        threads: int | None,
        kernels: BackendName | None,
    ) -> None:
        """Make the worlds on a mat that has been checked; keep what was given for threads and kernels."""
        raise NotImplementedError

    _given_threads: int | None
    _given_kernels: BackendName | None

    def _order_of_numbers(self) -> NDArray[np.intp]:
        """The index of each car, in the order of worlds and car numbers."""
        numbers = np.asarray(self.state.number).reshape(self.worlds, self.cars)
        return (np.argsort(numbers, axis=1) + np.arange(self.worlds)[:, None] * self.cars).reshape(-1)

    def _counts_of_worlds(self) -> NDArray[np.int64]:
        """What was counted in each world, whatever the parts are in which it was counted."""
        counts = np.frombuffer(self._read_counts(), np.int64).reshape(self.worlds, -1, events.COUNTS)
        summed: NDArray[np.int64] = counts.sum(axis=1)[:, : events.EVENTS].astype("<i8")
        return summed

    def _sorted_rows(self, world: int) -> NDArray[np.uint32]:
        rows = np.frombuffer(self.untaken_rows(world), np.uint32).reshape(-1, events.COLUMNS)
        return rows[np.lexsort((rows[:, events.CAR], rows[:, events.T_MS]))]

    def _restore(self, header: _Header, columns: "_Columns") -> None:
        """Put what was saved into a new world. Raises MotorcadeError where that can't be a world."""
        cars = self.worlds * self.cars
        counts = columns.take("<i8", self.worlds * events.EVENTS).reshape(self.worlds, events.EVENTS)
        lengths = columns.take("<i8", self.worlds)
        rows = columns.take("<u4", _ROWS * cars).reshape(_ROWS, cars).copy()
        wheels = columns.take("u1", cars)
        program = columns.take("u1", cars)
        remembered = columns.take("u1", self._decisions.size).reshape(self._decisions.shape)
        _require(bool((lengths >= 0).all()))
        untaken = [columns.take("<u4", int(length) * events.COLUMNS) for length in lengths]
        columns.end()
        _require(0 <= header.tick <= _MOST_TICK and 0 <= header.spoken_at <= header.tick)
        _require(header.spoken in (brain.NO_VOICE, brain.VOICE_STOP, brain.VOICE_GO))
        _require(bool((counts >= 0).all() and (counts < _MOST_COUNT).all()))
        _require(bool((wheels < 16).all() and (program <= len(self.images)).all()))
        for kept in untaken:
            self._check_rows(kept.reshape(-1, events.COLUMNS), header.events)
        self._check_memory(rows, remembered, program, header.tick)
        self.backend.write(self._decisions, remembered.tobytes())
        self._put(rows, wheels, program, counts, header)
        self._taken = [(None, kept.tobytes()) if len(kept) else None for kept in untaken]

    def _put(
        self,
        rows: NDArray[np.uint32],
        wheels: NDArray[np.uint8],
        program: NDArray[np.uint8],
        counts: NDArray[np.int64],
        header: _Header,
    ) -> None:
        rows[_ROW["number"]] = np.tile(np.arange(self.cars, dtype=np.uint32), self.worlds)
        state: Any = self.state
        state.rows[...] = rows
        state.wheels[...] = wheels
        state.program[...] = program
        of_parts = np.zeros((self.worlds, self._parts // self.worlds, events.COUNTS), np.int64)
        of_parts[:, 0, : events.EVENTS] = counts
        of_parts[:, :, events.TICK] = header.tick
        self.backend.write(self._counters.counts, of_parts.tobytes())
        self.run_number = header.run_number
        self._tick = header.tick
        self._spoken_at = header.spoken_at
        self._spoken = header.spoken
        most = int(self._rules.fastest * (1 << DISPLACEMENT_BITS)) + 1
        driven = []
        seen = set[tuple[int, int]]()
        for column in header.driven:
            _require(len(column) == 5)
            world, number, *motion = column
            _require(0 <= world < self.worlds and 0 <= number < self.cars and (world, number) not in seen)
            _require(max(map(abs, motion[:2])) <= most and abs(motion[2]) < 1 << 40)
            seen.add((world, number))
            driven.append([world, number, world * self.cars + number, *motion, 0])
        self._keep_driven(driven)
        self._wake(RESTORED)

    def _check_rows(self, rows: NDArray[np.uint32], keeps_events: bool) -> None:
        _require(keeps_events or not len(rows))
        limits = {events.CAR: self.cars, events.KIND: len(events.KINDS), events.WHY: len(events.LOSS_REASONS)}
        _require(all(bool((rows[:, column] < most).all()) for column, most in limits.items()))

    def _check_memory(
        self, rows: NDArray[np.uint32], remembered: NDArray[np.uint8], program: NDArray[np.uint8], tick: int
    ) -> None:
        """Check the cars' places, displacements and memories, and put the leaders' rows of Decisions into theirs."""
        leads = program > 0
        _require(np.count_nonzero(leads) == self.worlds * sum(self.mat.starts.leads))
        places = rows[[_ROW["x"], _ROW["y"]]].view(np.int32).astype(np.int64)
        # In its last tick a car may come a little farther.
        fastest_um = int(self._rules.fastest) + 2
        _require(bool((abs(places) <= FARTHEST_UM + fastest_um).all()))
        moves = rows[[_ROW["displacement_x"], _ROW["displacement_y"]]].view(np.int32).astype(np.int64)
        _require(bool((abs(moves) <= fastest_um << DISPLACEMENT_BITS).all()))
        sender = rows[_ROW["heard_from"]]
        _require(bool(((sender < self.cars) | (sender == NOBODY)).all()))
        if tick == 0:
            # They are switched on in their first tick.
            return
        rows[_ROW["heard_at"], leads] = np.arange(np.count_nonzero(leads))
        infrared = self.profile.infrared
        now_ms = tick * self.tick_ms
        interval = rows[brain.INTERVAL]
        _require(bool(((interval == 0) | (interval > 1) & (interval <= infrared.last_interval_ms)).all()))
        for number, image in enumerate(map(parse_image_bytes, self.images)):
            memory = rows[: brain.SIZE, program == number + 1].astype(np.int64)
            own = remembered[program[leads] == number + 1].T
            states = len(image.leader)
            slots = len(image.followers)
            _require(bool((memory[brain.STATE] < max(states, 1)).all() and (memory[brain.SLOT] < max(slots, 1)).all()))
            self._check_decisions(own, image)
            # A leader that decides may stand, or be silent, for any time.
            runs = memory[brain.RUNNING] > 0 if image.decides else np.full(own.shape[1], states > 0)
            sends = own[decisions.IS_TELLING] > 0 if own[decisions.TELLS].any() else np.full(own.shape[1], slots > 0)
            turns = own[decisions.TURNS] > 0 if own[decisions.TELLS].any() else sends
            caught_up = (brain.STARTED_MS, runs), (brain.SLOT_STARTED_MS, turns), (brain.NEXT_FRAME_MS, sends)
            for place, counts in caught_up:
                behind_ms = (now_ms - memory[place, counts]) & TICKS_MASK
                _require(bool(((behind_ms <= _MOST_BEHIND_MS) | (behind_ms >= TICKS_MASK - _MOST_BEHIND_MS)).all()))

    def _check_decisions(self, own: NDArray[np.uint8], image: Image) -> None:
        """Check what the leaders with an image remember of their decisions; a column for each of them."""
        words = image_words(image)
        expected = bytearray(decisions.SIZE)
        decisions.survey(expected, words, 0, len(words), levels_of(self.profile))
        for place in (decisions.WORDS, decisions.LOOKS, decisions.TELLS):
            _require(bool((own[place] == expected[place]).all()))
        states = max(len(image.leader), 1)
        slots = len(image.followers)
        limits = {decisions.NEXT: states, decisions.CALLS: decisions.MOST_CALLS + 1, decisions.TOLD: max(slots, 1)}
        limits[decisions.LAST_CALL] = decisions.MOST_CALLS
        limits |= {decisions.TURNS: slots + 1, decisions.TOLD_TURNS: slots + 1}
        limits |= {decisions.RETURNS + call: states for call in range(decisions.MOST_CALLS)}
        _require(all(bool((own[place] < limit).all()) for place, limit in limits.items()))


def _mat_of(document: dict[str, Any]) -> Mat:
    """Return the mat of a document, without cars. Raises MotorcadeError where a value isn't allowed."""
    mat, _ = mat_without_cars(document, Phrase("mat-named", name=str(document.get("name"))[:40]))
    for person in mat.people:
        times_s = [t_s for t_s, _, _ in person.path]
        _require(times_s == sorted(set(times_s)))
    return mat


def _profile_of(document: dict[str, Any]) -> Profile:
    """Return the profile of a document. Raises MotorcadeError where a value isn't allowed."""
    values = dict(document)
    return profile_from_dict(values, str(values.pop("name", ""))[:40])


class _Columns:
    """The columns of a saved world, which are taken one after the other. Raises MotorcadeError where one is missing."""

    def __init__(self, data: memoryview) -> None:
        self._data = data
        self._at = 0

    def take(self, dtype: str, count: int) -> NDArray[Any]:
        """Return the next column."""
        size = count * np.dtype(dtype).itemsize
        _require(count >= 0 and self._at + size <= len(self._data))
        begin, self._at = self._at, self._at + size
        return np.frombuffer(self._data[begin : self._at], dtype)

    def end(self) -> None:
        """Require that all has been taken."""
        _require(self._at == len(self._data))


def _parse(data: bytes) -> tuple[_Header, _Columns]:
    """Return the header and the columns of a saved world. Raises MotorcadeError."""
    if not isinstance(data, bytes | bytearray | memoryview):
        raise MotorcadeError("not-a-world")
    view = memoryview(data).cast("B")
    begin = len(MAGIC) + _DIGEST_BYTES
    if bytes(view[: len(_ANY_MAGIC)]) != _ANY_MAGIC:
        raise MotorcadeError("not-a-world")
    if bytes(view[: len(MAGIC)]) != MAGIC:
        raise MotorcadeError("world-of-another-version", version="?", ours=engine_version())
    body = view[begin:]
    _require(hashlib.sha256(body).digest() == bytes(view[len(MAGIC) : begin]) and len(body) >= _LENGTH.size)
    (length,) = _LENGTH.unpack(body[: _LENGTH.size])
    _require(length <= len(body) - _LENGTH.size)
    end = _LENGTH.size + length
    try:
        header = msgspec.json.decode(body[_LENGTH.size : end], type=_Header)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        raise MotorcadeError("world-damaged") from None
    if header.engine != engine_version():
        raise MotorcadeError("world-of-another-version", version=header.engine[:60], ours=engine_version())
    # So all memory that it takes follows from the length of the bytes.
    _require(header.cars > 0 and header.worlds > 0)
    _require(header.cars * header.worlds * _CAR_BYTES <= len(body))
    return header, _Columns(body[end:])


def _require(is_right: bool) -> None:
    if not is_right:
        raise MotorcadeError("world-damaged")
