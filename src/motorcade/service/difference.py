"""Where two runs part: they are simulated side by side, and the first word that a car begins in one alone is found.

Cars pass words on after random pauses, so frames differ between two seeds from the beginning, and mean nothing. Runs
part where a car begins another word than in the other run, or the same one later by half the time for which a word is
sent. Where all words agree, they part where a car stands elsewhere.
"""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from typing import Annotated, Any, Literal

from msgspec import Meta, Struct, field

from motorcade.engine.events import FRAME, HEARD, LOSS_REASONS, LOST, START, STATE
from motorcade.engine.moment import EVENT_BYTES, Event, unpack_events, unpack_moment
from motorcade.errors import MotorcadeError, Phrase
from motorcade.missions.goal import car_phrase
from motorcade.missions.odds import OpenWorlds
from motorcade.service.history import EVERY_MS, History, pack_picture
from motorcade.service.messages import Sentence, StreamAnswer, StreamMessage, sentences
from motorcade.service.studio_world import StudioWorld, open_world
from motorcade.service.world_messages import Milliseconds, SetWorld
from motorcade.words.image import parse_image_bytes
from motorcade.words.infrared import air_us, word_of

# A car that stands so far from where it stands in the other run is seen to do so.
_APART_M = 0.05
# A word that is this late is not begun, where no follower's words say how long one is sent.
_LATE_MS = 500
# Else one that is late by this part of the time for which it is sent.
_LATE_PART = 0.5
# How much of the words before and after a parting is told.
_AROUND_MS = 5_000
_TOLD_EVERY_MS = 5_000
# About so many cars times simulated ms are done in one call.
_WORK_MS = 1_000_000
_ROW_NUMBERS = EVENT_BYTES // 4


class Compare(StreamMessage):
    """Find where two runs part; what was compared before ends."""

    one: SetWorld
    other: SetWorld
    until_ms: Annotated[int, Meta(ge=100, le=600_000)] = 60_000


class Show(StreamMessage):
    """Send a picture of each of the two runs at a time."""

    t_ms: Milliseconds


class BegunWord(Struct):
    """A word that a car began, as eight hexadecimal digits."""

    t_ms: int
    word: str


class Difference(StreamAnswer):
    """Where two runs part.

    Attributes:
        kind: ``word``: a car begins a word in one run and not in the other; ``place``: words are the same, but a car
            comes to stand elsewhere; ``none``: neither; the runs may still differ in what nobody sees.
        t_ms: when.
        car: which car.
        exact_ms, exact_car: the first tick in which anything differs, and in which car; None: nothing does.
        missed: of ``word``, the run, 0 or 1, in which the car does not begin the word; None: it begins another one.
        late_ms: how much later it begins the word in the run ``missed``; None: not at all, as far as is known.
        words: of ``word``, the word that it begins in each run.
        cause: why, where the engine's events say it.
        begun: of ``word``, the words that this car begins in each run, around that time.
    """

    kind: Literal["word", "place", "none"]
    t_ms: int
    car: int
    exact_ms: int | None
    exact_car: int | None
    missed: int | None = None
    late_ms: int | None = None
    words: list[str | None] = field(default_factory=list)
    cause: Sentence | None = None
    begun: list[list[BegunWord]] = field(default_factory=list)


class Compared(StreamAnswer):
    """How far two runs are simulated."""

    t_ms: int


class _Run:
    """One of two runs, and what happened in it.

    Attributes:
        history: its past.
        begun: of each car the words that it began: when, and which.
    """

    def __init__(self, world: StudioWorld) -> None:
        self.world = world
        self.history = History()
        self.begun: list[list[tuple[int, int]]] = [[] for _ in range(world.cars)]
        image = parse_image_bytes(world.simulation.images[0])
        dwell_ms = world.simulation.profile.dwell_ms[image.dwell_level]
        # A word that comes so much later than in the other run is not begun.
        if image.followers:
            self.late_ms = int(dwell_ms * _LATE_PART)
        else:
            self.late_ms = _LATE_MS
        self.store()

    def advance(self) -> tuple[bytes, bytes]:
        """Simulate until the next moment; return the rows of events until then, and the moment."""
        events = self.world.run(EVERY_MS)
        self.history.add_events(events)
        numbers = memoryview(events).cast("I")
        for at, kind in enumerate(numbers[2::_ROW_NUMBERS].tolist()):
            if kind & 0xFF in (STATE, START):
                t_ms, car, _, word, _ = numbers[at * _ROW_NUMBERS : (at + 1) * _ROW_NUMBERS].tolist()
                self.begun[car].append((t_ms, word))
        return events, self.store()

    def store(self) -> bytes:
        """Store the moment, and return it."""
        moment = self.world.pictures.moment(is_stored=True)
        self.history.add_moment(self.world.now_ms, moment)
        return moment

    def picture(self, number: int, t_ms: int) -> bytes:
        """Return the picture of a stored moment."""
        at_ms, moment = self.history.moment_at(t_ms)
        events = self.history.events_between(at_ms - EVERY_MS, at_ms)
        return pack_picture(number, 0, at_ms, self.world.cars, 0, moment, events)


class Comparison:
    """Two runs, simulated a little in each call of `advance`.

    Args:
        message: which runs.
        most_cars: the most cars in one world.
        open_worlds: opens the world of a run.

    Raises MotorcadeError where the two can't be compared.
    """

    def __init__(self, message: Compare, most_cars: int, open_worlds: OpenWorlds) -> None:
        self._most_cars = most_cars
        self._open_worlds = open_worlds
        self._messages = (message.one, message.other)
        worlds = self._new_worlds()
        if worlds[0].cars != worlds[1].cars or worlds[0].tick_ms != worlds[1].tick_ms:
            raise MotorcadeError("runs-differ-in-cars")
        self._runs = _Run(worlds[0]), _Run(worlds[1])
        self._until_ms = message.until_ms
        self._late_ms = max(run.late_ms for run in self._runs)
        self._cars = worlds[0].cars
        # Of each car, how many words are known to be the same in both runs.
        self._same = [0] * self._cars
        # Where cars stand elsewhere, and the first tick that differs at all: time and car.
        self._place: tuple[int, int] | None = None
        self._exact: tuple[int, int] | None = None
        self._is_found = False

    def _new_worlds(self) -> list[StudioWorld]:
        return [open_world(message, self._most_cars, self._open_worlds) for message in self._messages]

    @property
    def is_busy(self) -> bool:
        return self._now_ms < self._until_ms

    @property
    def _now_ms(self) -> int:
        return self._runs[0].world.now_ms

    def advance(self) -> list[Difference | Compared]:
        """Simulate a part of both runs; return where they part as soon as that is known, and how far they are."""
        answers: list[Difference | Compared] = []
        for _ in range(max(1, _WORK_MS // (EVERY_MS * self._cars))):
            if not self.is_busy:
                break
            (rows, moment), (other_rows, other_moment) = [run.advance() for run in self._runs]
            now_ms = self._now_ms
            if self._exact is None and (rows, moment) != (other_rows, other_moment):
                self._exact = self._tick_of(now_ms - EVERY_MS)
            if self._place is None and moment != other_moment:
                self._place = _first_apart(now_ms, moment, other_moment, self._cars)
            # Runs that are the same so far, to the bit, have not parted.
            if self._exact and not self._is_found and (parting := self._parting(now_ms)):
                answers.append(self._told(*parting))
            elif now_ms % _TOLD_EVERY_MS == 0:
                answers.append(Compared(now_ms))
        if not self.is_busy:
            if not self._is_found:
                if self._place:
                    answers.append(self._difference("place", *self._place))
                else:
                    answers.append(self._difference("none", 0, 0))
            answers.append(Compared(self._now_ms))
        return answers

    def pictures(self, t_ms: int) -> list[bytes]:
        """Return a picture of each run at a time; the picture's number is that of the run, 0 or 1."""
        return [run.picture(number, t_ms) for number, run in enumerate(self._runs)]

    def _difference(self, kind: Literal["word", "place", "none"], t_ms: int, car: int, **more: Any) -> Difference:
        self._is_found = True
        return Difference(kind, t_ms, car, *(self._exact or (None, None)), **more)

    def _tick_of(self, after_ms: int) -> tuple[int, int]:
        """Run both again, tick by tick from ``after_ms`` on; return the time and the car of the first difference."""
        worlds = self._new_worlds()
        for world in worlds:
            if after_ms:
                world.run(after_ms)
            world.pictures.moment(is_stored=True)
        while True:
            rows = [world.run(world.tick_ms) for world in worlds]
            moments = [world.pictures.moment(is_stored=True) for world in worlds]
            if rows[0] != rows[1]:
                first = set(unpack_events(rows[0])) ^ set(unpack_events(rows[1]))
                return worlds[0].now_ms, min(first).car if first else 0
            if moments[0] != moments[1]:
                return worlds[0].now_ms, _first_differing(moments[0], moments[1], self._cars)

    def _parting(self, now_ms: int) -> tuple[int, int, int] | None:
        """When, and which car, first begins a word in one run alone, and the number of that word; None while unsure."""
        found = []
        for car, (ones, others) in enumerate(zip(*(run.begun for run in self._runs), strict=True)):
            at = self._same[car]
            while at < min(len(ones), len(others)) and self._agree(ones[at], others[at]):
                at += 1
            self._same[car] = at
            times = [begun[at][0] for begun in (ones, others) if at < len(begun)]
            # A word that only one of them has begun may still come in time.
            if times and (len(times) == 2 or now_ms - times[0] > self._late_ms or not self.is_busy):
                found.append((min(times), car, at))
        best = min(found, default=None)
        # A car that parted earlier may be found later.
        if best and (now_ms - best[0] > 2 * self._late_ms or not self.is_busy):
            return best
        return None

    def _agree(self, one: tuple[int, int], other: tuple[int, int]) -> bool:
        return one[1] == other[1] and abs(one[0] - other[0]) < self._late_ms

    def _told(self, t_ms: int, car: int, number: int) -> Difference:
        begun = [run.begun[car] for run in self._runs]
        words: list[int | None] = [None, None]
        for run, words_begun in enumerate(begun):
            if number < len(words_begun) and words_begun[number][0] - t_ms < self._late_ms:
                words[run] = words_begun[number][1]
        missed: int | None
        if None in words:
            missed = words.index(None)
        else:
            missed = self._skipped(begun, number)
        late_ms = None
        if missed is None:
            cause = self._cause_of_another(car)
        else:
            here = begun[missed]
            there = begun[1 - missed]
            words[missed] = None
            t_ms = there[number][0]
            if number < len(here) and here[number][1] == there[number][1]:
                late_ms = here[number][0] - t_ms
            cause = self._cause(car, missed, t_ms)
        return self._difference(
            "word",
            t_ms,
            car,
            missed=missed,
            late_ms=late_ms,
            words=[word if word is None else f"{word:08x}" for word in words],
            cause=cause and sentences(cause),
            begun=[_around(words_begun, t_ms) for words_begun in begun],
        )

    def _skipped(self, begun: list[list[tuple[int, int]]], number: int) -> int | None:
        """The run in which a car begins at once the word that comes next in the other run; None where it is neither."""
        for run, (here, there) in enumerate((begun, begun[::-1])):
            if number + 1 < len(there) and self._agree(here[number], there[number + 1]):
                return run
        return None

    def _cause(self, car: int, missed: int, t_ms: int) -> Phrase | None:
        """Why a car did not begin a word in the run ``missed``, that it began in the other."""
        heard = [event for event in self._around(1 - missed, t_ms) if event.car == car and event.kind == HEARD]
        near = list(self._around(missed, t_ms))
        lost = [event for event in near if event.car == car and event.kind == LOST]
        if heard:
            # What the car heard in the other run, it lost here: the frame of that word comes first.
            wanted = word_of(heard[-1].word)
            lost = [event for event in lost if word_of(event.word) == wanted] or lost
        if lost:
            first = lost[0]
            if LOSS_REASONS[first.why] == "collision" and (by := self._collided(missed, first, near)) is not None:
                return Phrase("parted-collision", other=car_phrase(first.other), by=car_phrase(by))
            return Phrase("parted-lost", other=car_phrase(first.other), why=Phrase(f"lost-{LOSS_REASONS[first.why]}"))
        if heard:
            sender = heard[-1].other
            if any(event.kind == FRAME and event.car == sender for event in near):
                return Phrase("parted-unreached", other=car_phrase(sender))
            return Phrase("parted-silent", other=car_phrase(sender))
        return None

    def _cause_of_another(self, car: int) -> Phrase | None:
        """Why a car begins another word in one run than in the other."""
        one, other = (run.world for run in self._runs)
        if one.simulation.images == other.simulation.images:
            return None
        if car in one.leads():
            return Phrase("parted-program")
        return Phrase("parted-words")

    def _collided(self, run: int, lost: Event, near: list[Event]) -> int | None:
        """The nearest car that sent at the same time as the one whose frame was lost."""
        frame_ms = air_us(lost.word, self._runs[run].world.simulation.profile.infrared.unit_us) / 1000
        columns = unpack_moment(self._runs[run].history.moment_at(lost.t_ms)[1], self._cars)
        x_m = columns["x_m"]
        y_m = columns["y_m"]
        sent = [event.car for event in near if event.kind == FRAME and 0 <= lost.t_ms - event.t_ms <= 2 * frame_ms]
        others = (car for car in sent if car not in (lost.other, lost.car))
        here = (x_m[lost.car], y_m[lost.car])
        away = {car: math.dist((x_m[car], y_m[car]), here) for car in others}
        return min(away, key=lambda car: (away[car], car), default=None)

    def _around(self, run: int, t_ms: int) -> Iterator[Event]:
        """The events of a run shortly before and after a time."""
        return unpack_events(self._runs[run].history.events_between(t_ms - self._late_ms, t_ms + EVERY_MS))


def _around(begun: list[tuple[int, int]], t_ms: int) -> list[BegunWord]:
    first = bisect_left(begun, t_ms - _AROUND_MS, key=lambda start: start[0])
    last = bisect_right(begun, t_ms + _AROUND_MS, key=lambda start: start[0])
    return [BegunWord(at_ms, f"{word:08x}") for at_ms, word in begun[max(first - 1, 0) : last]]


def _first_apart(t_ms: int, one: bytes, other: bytes, cars: int) -> tuple[int, int] | None:
    """The time and the first car that stands elsewhere than in the other run."""
    here, there = (unpack_moment(moment, cars) for moment in (one, other))
    for car in range(cars):
        if abs(here["x_m"][car] - there["x_m"][car]) + abs(here["y_m"][car] - there["y_m"][car]) > _APART_M:
            return t_ms, car
    return None


def _first_differing(one: bytes, other: bytes, cars: int) -> int:
    """The first car that shows anything else."""
    rows = [zip(*unpack_moment(moment, cars).values(), strict=True) for moment in (one, other)]
    return next((car for car, (row, another) in enumerate(zip(*rows, strict=True)) if row != another), 0)
