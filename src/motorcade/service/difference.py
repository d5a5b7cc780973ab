"""Where two runs part: they are simulated side by side, and the first word that a car begins in one alone is found.

Cars pass words on after random pauses, so frames differ between two seeds from the beginning, and mean nothing. Runs
part where a car begins another word than in the other run, or the same one later by half the time for which a word is
sent. Where all words agree, they part where a car stands elsewhere.
"""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator
from typing import Annotated, Literal, NamedTuple

from msgspec import Meta, Struct

from motorcade.engine.events import FRAME, HEARD, LOSS_REASONS, LOST, START, STATE
from motorcade.engine.moment import EVENT_BYTES, Event, unpack_events, unpack_moment
from motorcade.errors import MotorcadeError, Phrase
from motorcade.missions.goals import car_phrase
from motorcade.service.history import EVERY_MS, History, pack_picture
from motorcade.service.messages import Sentence, sentences
from motorcade.service.studio_world import StudioWorld
from motorcade.service.world_messages import SetWorld
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
Pair = tuple[StudioWorld, StudioWorld]


class TrialMessageBase(Struct, tag_field="do", tag=str.lower, forbid_unknown_fields=True):
    """What a page sends over the stream ``trials``."""


class Compare(TrialMessageBase):
    """Find where two runs part; what was compared before ends."""

    one: SetWorld
    other: SetWorld
    until_ms: Annotated[int, Meta(ge=100, le=600_000)] = 60_000


class Show(TrialMessageBase):
    """Send a picture of each of the two runs at a time."""

    t_ms: Annotated[int, Meta(ge=0, lt=1 << 30)]


class TrialAnswerBase(Struct, tag_field="is", tag=str.lower):
    """What a page is sent over the stream ``trials``."""


class BegunWord(Struct):
    """A word that a car began, as eight hexadecimal digits."""

    t_ms: int
    word: str


class Difference(TrialAnswerBase):
    """Where two runs part.

    Attributes:
        kind: ``word``: a car begins a word in one run and not in the other; ``place``: words are the same, but a car
            comes to stand elsewhere; ``none``: neither; the runs may still differ in what nobody sees.
        t_ms: when.
        car: which car.
        missed: of ``word``, the run, 0 or 1, in which the car does not begin the word; None: it begins another one.
        late_ms: how much later it begins the word in the run ``missed``; None: not at all, as far as is known.
        words: of ``word``, the word that it begins in each run.
        cause: why, where the engine's events say it.
        exact_ms, exact_car: the first tick in which anything differs, and in which car; None: nothing does.
        begun: the words that this car begins in each run, around that time.
        until_ms: both runs are simulated until then.
    """

    kind: Literal["word", "place", "none"]
    t_ms: int
    car: int
    missed: int | None
    late_ms: int | None
    words: list[str | None]
    cause: Sentence | None
    exact_ms: int | None
    exact_car: int | None
    begun: list[list[BegunWord]]
    until_ms: int


class Compared(TrialAnswerBase):
    """How far two runs are simulated."""

    t_ms: int


class _Parting(NamedTuple):
    t_ms: int
    car: int
    # Of the word in which the car parts, among those that it begins.
    number: int


class Comparison:
    """Two runs, simulated a little in each call of `advance`.

    Args:
        message: which runs.
        make_world: builds the world of a run. Raises MotorcadeError.

    Raises MotorcadeError where the two can't be compared.
    """

    def __init__(self, message: Compare, make_world: Callable[[SetWorld], StudioWorld]) -> None:
        self._worlds: Pair = make_world(message.one), make_world(message.other)
        one, other = self._worlds
        if one.cars != other.cars or one.tick_ms != other.tick_ms:
            raise MotorcadeError("runs-differ-in-cars")
        self._make_world, self._messages = make_world, (message.one, message.other)
        self._until_ms = message.until_ms
        self._late_ms = max(map(_late_ms, self._worlds))
        self._histories = History(), History()
        # For each run and car the words that it began: when, and which.
        self._begun: tuple[list[list[tuple[int, int]]], ...] = tuple([[] for _ in range(one.cars)] for _ in "01")
        # Of each car, how many words are known to be the same in both runs.
        self._same = [0] * one.cars
        self._place: tuple[int, int] | None = None
        # The first moment that differs at all, in tick and car.
        self._exact: tuple[int, int] | None = None
        self._found: Difference | None = None
        self._store()

    @property
    def is_busy(self) -> bool:
        return self._worlds[0].now_ms < self._until_ms

    def advance(self) -> list[Difference | Compared]:
        """Simulate a part of both runs; return where they part as soon as that is known, and how far they are."""
        one = self._worlds[0]
        answers: list[Difference | Compared] = []
        for _ in range(max(1, _WORK_MS // (EVERY_MS * one.cars))):
            if not self.is_busy:
                break
            rows = [world.run(EVERY_MS) for world in self._worlds]
            for history, begun, events in zip(self._histories, self._begun, rows, strict=True):
                history.add_events(events)
                _note_words(begun, events)
            moments = self._store()
            now_ms = one.now_ms
            if self._exact is None and (rows[0] != rows[1] or moments[0] != moments[1]):
                self._exact = self._tick_of(now_ms - EVERY_MS)
            if self._place is None and moments[0] != moments[1]:
                self._place = _first_apart(now_ms, *moments, one.cars)
            # Runs that are the same so far, to the bit, have not parted.
            if self._exact and self._found is None and (parting := self._parting(now_ms)):
                self._found = self._told(parting)
                answers.append(self._found)
            elif now_ms % _TOLD_EVERY_MS == 0:
                answers.append(Compared(now_ms))
        if not self.is_busy:
            if self._found is None:
                self._found = self._place_told()
                answers.append(self._found)
            answers.append(Compared(one.now_ms))
        return answers

    def pictures(self, t_ms: int) -> list[bytes]:
        """Return a picture of each run at a time; the picture's number is that of the run, 0 or 1."""
        return [
            pack_picture(run, 0, *_shown(history, t_ms, world))
            for run, (history, world) in enumerate(zip(self._histories, self._worlds, strict=True))
        ]

    def _store(self) -> tuple[bytes, bytes]:
        one, other = self._worlds
        moments = one.pictures.moment(is_stored=True), other.pictures.moment(is_stored=True)
        for history, world, moment in zip(self._histories, self._worlds, moments, strict=True):
            history.add_moment(world.now_ms, moment)
        return moments

    def _tick_of(self, after_ms: int) -> tuple[int, int]:
        """Run both again, tick by tick from ``after_ms`` on; return the time and the car of the first difference."""
        one, other = map(self._make_world, self._messages)
        for world in (one, other):
            if after_ms:
                world.run(after_ms)
            world.pictures.moment(is_stored=True)
        while True:
            rows = one.run(one.tick_ms), other.run(other.tick_ms)
            moments = one.pictures.moment(is_stored=True), other.pictures.moment(is_stored=True)
            if rows[0] != rows[1]:
                first = set(unpack_events(rows[0])) ^ set(unpack_events(rows[1]))
                return one.now_ms, min(first).car if first else 0
            if moments[0] != moments[1]:
                return one.now_ms, _first_differing(*moments, one.cars)

    def _parting(self, now_ms: int) -> _Parting | None:
        """The earliest word that a car begins in one run alone; None while that can't be said yet."""
        best: _Parting | None = None
        for car, (ones, others) in enumerate(zip(*self._begun, strict=True)):
            at = self._same[car]
            while at < min(len(ones), len(others)) and self._agree(ones[at], others[at]):
                at += 1
            self._same[car] = at
            times = [begun[at][0] for begun in (ones, others) if at < len(begun)]
            # A word that only one of them has begun may still come in time.
            if times and (len(times) == 2 or now_ms - times[0] > self._late_ms or not self.is_busy):
                best = min(filter(None, (best, _Parting(min(times), car, at))))
        # A car that parted earlier may be found later.
        return best if best and (now_ms - best.t_ms > 2 * self._late_ms or not self.is_busy) else None

    def _agree(self, one: tuple[int, int], other: tuple[int, int]) -> bool:
        return one[1] == other[1] and abs(one[0] - other[0]) < self._late_ms

    def _told(self, parting: _Parting) -> Difference:
        t_ms, car, number = parting
        words: list[int | None] = []
        for begun in self._begun:
            is_there = number < len(begun[car]) and begun[car][number][0] - t_ms < self._late_ms
            words.append(begun[car][number][1] if is_there else None)
        missed = words.index(None) if None in words else self._skipped(car, number)
        if missed is not None:
            words[missed], t_ms = None, self._begun[1 - missed][car][number][0]
        late_ms = None
        if missed is not None:
            there, here = self._begun[1 - missed][car], self._begun[missed][car]
            if number < len(here) and here[number][1] == there[number][1]:
                late_ms = here[number][0] - there[number][0]
        cause = self._cause(car, missed, t_ms) if missed is not None else self._cause_of_another(car)
        return Difference(
            kind="word",
            t_ms=t_ms,
            car=car,
            missed=missed,
            late_ms=late_ms,
            words=[None if word is None else f"{word:08x}" for word in words],
            cause=sentences(cause) if cause else None,
            exact_ms=self._exact[0] if self._exact else None,
            exact_car=self._exact[1] if self._exact else None,
            begun=[_around(begun[car], t_ms) for begun in self._begun],
            until_ms=self._until_ms,
        )

    def _skipped(self, car: int, number: int) -> int | None:
        """The run in which a car begins at once the word that comes next in the other run; None where it is neither."""
        for run in range(2):
            here, there = self._begun[run][car], self._begun[1 - run][car]
            if number + 1 < len(there) and self._agree(here[number], there[number + 1]):
                return run
        return None

    def _cause(self, car: int, missed: int, t_ms: int) -> Phrase | None:
        """Why a car did not begin a word in the run ``missed``, that it began in the other."""
        heard = [each for each in self._around(1 - missed, t_ms) if each.car == car and each.kind == HEARD]
        near = list(self._around(missed, t_ms))
        lost = [each for each in near if each.car == car and each.kind == LOST]
        if heard:
            # What the car heard in the other run, it lost here: the frame of that word comes first.
            wanted = word_of(heard[-1].word)
            lost = [each for each in lost if word_of(each.word) == wanted] or lost
        if lost:
            first = lost[0]
            if LOSS_REASONS[first.why] == "collision" and (by := self._collided(missed, first, near)) is not None:
                return Phrase("parted-collision", other=car_phrase(first.other), by=car_phrase(by))
            return Phrase("parted-lost", other=car_phrase(first.other), why=Phrase(f"lost-{LOSS_REASONS[first.why]}"))
        if heard:
            sender = heard[-1].other
            sent = any(each.kind == FRAME and each.car == sender for each in near)
            return Phrase("parted-unreached" if sent else "parted-silent", other=car_phrase(sender))
        return None

    def _cause_of_another(self, car: int) -> Phrase | None:
        """Why a car begins another word in one run than in the other."""
        images = [world.simulation.images for world in self._worlds]
        if images[0] == images[1]:
            return None
        leads = car in self._worlds[0].leads()
        return Phrase("parted-program" if leads else "parted-words")

    def _collided(self, run: int, lost: Event, near: list[Event]) -> int | None:
        """The nearest car that sent at the same time as the one whose frame was lost."""
        world = self._worlds[run]
        frame_ms = air_us(lost.word, world.simulation.profile.infrared.unit_us) / 1000
        columns = unpack_moment(self._histories[run].moment_at(lost.t_ms)[1], world.cars)
        x_m, y_m = columns["x_m"], columns["y_m"]
        sent = [each.car for each in near if each.kind == FRAME and 0 <= lost.t_ms - each.t_ms <= 2 * frame_ms]
        others = (car for car in sent if car not in (lost.other, lost.car))
        away = {car: math.dist((x_m[car], y_m[car]), (x_m[lost.car], y_m[lost.car])) for car in others}
        return min(away, key=lambda car: (away[car], car), default=None)

    def _around(self, run: int, t_ms: int) -> Iterator[Event]:
        """The events of a run shortly before and after a time."""
        between = self._histories[run].events_between(t_ms - self._late_ms, t_ms + EVERY_MS)
        return unpack_events(between)

    def _place_told(self) -> Difference:
        exact_ms, exact_car = self._exact or (None, None)
        t_ms, car = self._place or (0, 0)
        begun: list[list[BegunWord]] = [[], []]
        kind = "place" if self._place else "none"
        return Difference(
            kind,  # type: ignore[arg-type]
            t_ms,
            car,
            None,
            None,
            [None, None],
            None,
            exact_ms,
            exact_car,
            begun,
            self._until_ms,
        )


def _late_ms(world: StudioWorld) -> int:
    image = parse_image_bytes(world.simulation.images[0])
    return int(world.simulation.profile.dwell_ms[image.dwell_level] * _LATE_PART) if image.followers else _LATE_MS


def _note_words(begun: list[list[tuple[int, int]]], events: bytes) -> None:
    """Add the words that cars began to those of each car."""
    numbers = memoryview(events).cast("I")
    for at, kind in enumerate(numbers[2::_ROW_NUMBERS].tolist()):
        if kind & 0xFF in (STATE, START):
            t_ms, car, _, word, _ = numbers[at * _ROW_NUMBERS : (at + 1) * _ROW_NUMBERS].tolist()
            begun[car].append((t_ms, word))


def _around(begun: list[tuple[int, int]], t_ms: int) -> list[BegunWord]:
    first = bisect_left(begun, t_ms - _AROUND_MS, key=lambda each: each[0])
    last = bisect_right(begun, t_ms + _AROUND_MS, key=lambda each: each[0])
    return [BegunWord(at_ms, f"{word:08x}") for at_ms, word in begun[max(first - 1, 0) : last]]


def _first_apart(t_ms: int, one: bytes, other: bytes, cars: int) -> tuple[int, int] | None:
    """The time and the first car that stands elsewhere than in the other run."""
    columns = [unpack_moment(moment, cars) for moment in (one, other)]
    for car, (x0, x1, y0, y1) in enumerate(
        zip(columns[0]["x_m"], columns[1]["x_m"], columns[0]["y_m"], columns[1]["y_m"], strict=True)
    ):
        if abs(x0 - x1) + abs(y0 - y1) > _APART_M:
            return t_ms, car
    return None


def _first_differing(one: bytes, other: bytes, cars: int) -> int:
    """The first car that shows anything else."""
    rows = [zip(*unpack_moment(moment, cars).values(), strict=True) for moment in (one, other)]
    return next((car for car, (row, another) in enumerate(zip(*rows, strict=True)) if row != another), 0)


def _shown(history: History, t_ms: int, world: StudioWorld) -> tuple[int, int, int, bytes, bytes]:
    """The arguments of `pack_picture` from its time on."""
    at_ms, moment = history.moment_at(t_ms)
    return at_ms, world.cars, 0, moment, history.events_between(at_ms - EVERY_MS, at_ms)
