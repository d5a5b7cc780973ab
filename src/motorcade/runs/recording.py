"""What a recording is: the description of a run, its moments and events, its words' colours; and the form in memory.

`motorcade.runs.recorder` writes and opens the files.
"""

import json
import os
import pickle
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, fields, replace
from itertools import cycle, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Protocol

import numpy as np
from numpy.typing import NDArray

from motorcade.config.files import check_no_device
from motorcade.config.profile import Profile, profile_from_dict
from motorcade.engine.events import KINDS, LOSS_REASONS
from motorcade.engine.layout import people_at
from motorcade.engine.moment import Event, Moment
from motorcade.engine.native import InterpretedKernels
from motorcade.errors import InputError, MotorcadeError, Phrase
from motorcade.mats import Mat, Starts
from motorcade.mats.document import document_of, mat_of
from motorcade.words.image import parse_image_bytes
from motorcade.words.infrared import tag_of, word_of

if TYPE_CHECKING:
    from motorcade.engine.simulation import Simulation

FORMAT = "motorcade-recording/1"
# Of which of the worlds side by side, and after how many resets, something is.
WHICH = ("world", "run")
EVENT_FIELDS = (*Event._fields, *WHICH)
DATA_ENDING = ".mcap"
FILM_ENDING = ".gif"
PICTURE_ENDINGS = (".png", ".svg", ".pdf")
PART = ".part"

LEADER = "#d62728"
# Matplotlib's ten colours without red, which is for leaders, and grey, which is for cars without a word.
FOLLOWERS = ("#1f77b4", "#ff7f0e", "#2ca02c", "#9467bd", "#17becf", "#bcbd22", "#8c564b", "#e377c2")
_LEADER_SHADES = ("#d62728", "#f0797a", "#9c1a1b", "#f9b3b3")
_NO_WORD = "#c4c4c4"
_UNKNOWN = "#6e6e6e"
_PALER = 0.68

OnProgress = Callable[[int], None]


@dataclass(frozen=True, slots=True)
class Description:
    """What a recording says about its run: the mat, the cars and their programs.

    Attributes:
        mat: where the cars drive, without their starts.
        profile: the cars' profile, which gives the levels in words their meaning.
        images: the leaders' images in hexadecimal; leader k runs image k modulo their number.
        leaders: the numbers of the cars that lead.
        cars: the number of cars.
        seeds: the seeds of the random numbers, one for each of the worlds side by side.
        every_ms: the interval between recorded moments.
    """

    mat: Mat
    profile: Profile
    images: tuple[str, ...]
    leaders: tuple[int, ...]
    cars: int
    seeds: tuple[int, ...]
    every_ms: int

    @classmethod
    def of(cls, world: "Simulation", every_ms: int) -> "Description":
        """Describe a world, or several side by side."""
        return cls(
            mat=replace(world.mat, starts=Starts.of([], [])),
            profile=world.profile,
            images=tuple(image.hex() for image in world.images),
            leaders=tuple(world.mat.starts.leaders),
            cars=world.cars,
            seeds=tuple(world.seeds),
            every_ms=every_ms,
        )

    @classmethod
    def from_texts(cls, texts: Mapping[str, str]) -> "Description":
        """Read what `to_texts` made.

        Raises MotorcadeError, ValueError, KeyError or TypeError where it is something else.
        """
        if texts.get("format") != FORMAT:
            raise ValueError(f"the format is not {FORMAT}")
        values = {field.name: json.loads(texts[field.name]) for field in fields(cls)}
        mat = dict(values["mat"])
        profile = dict(values["profile"])
        values["mat"] = mat_of(mat, Phrase("mat-named", name=mat["name"]))
        name = profile.pop("name")
        values["profile"] = profile_from_dict(profile, name)
        whole = (values["cars"], values["every_ms"], *values["leaders"], *values["seeds"])
        if not all(type(number) is int for number in whole) or values["every_ms"] < 1:
            raise ValueError("a number of the run is no whole number")
        if not all(0 <= leader < values["cars"] for leader in values["leaders"]):
            raise ValueError("a leader is no car")
        for image in values["images"]:
            parse_image_bytes(bytes.fromhex(image))
        return cls(**values | {name: tuple(values[name]) for name in ("images", "leaders", "seeds")})

    def to_texts(self) -> dict[str, str]:
        """The description as one text a name: ``format`` as it is, all others as JSON."""
        values = self.to_dict()
        return {"format": values.pop("format"), **{key: json.dumps(value) for key, value in values.items()}}

    def to_dict(self) -> dict[str, Any]:
        """The description for JSON."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {"format": FORMAT, **values, "mat": document_of(self.mat), "profile": asdict(self.profile)}

    @property
    def diameter_m(self) -> float:
        """The diameter of a car's body."""
        return self.profile.body.diameter_mm / 1000

    def is_leader(self) -> NDArray[np.bool_]:
        """For each car, whether it leads."""
        leads = np.zeros(self.cars, bool)
        leads[list(self.leaders)] = True
        return leads

    def people_at(self, t_ms: int) -> list[tuple[float, float]]:
        """The position of each person at a moment, (x, y) in metres."""
        return people_at(self.mat, t_ms, InterpretedKernels())


def shown_moments(recording: "Recording") -> Iterator[Moment]:
    """The moments that pictures and films show: those of the first world."""
    return (moment for moment in recording.moments() if not moment.world)


class Recording(Protocol):
    """A recorded run, which can be read any number of times, one moment and one batch of events at a time.

    Attributes:
        name: the file's name, or another name for error sentences.
        about: the run's description.
        damage: what is missing, once reading has stopped before the end of a cut-off or damaged file; else None.
    """

    name: str
    about: Description
    damage: MotorcadeError | None

    @property
    def last_ms(self) -> int:
        """The time of the last moment."""

    def moments(self) -> Iterator[Moment]:
        """The moments in order of runs, time and worlds."""

    def events(self) -> Iterator[NDArray[np.void]]:
        """Arrays of `motorcade.engine.events.EVENT` in order of runs and time."""


class Sink:
    """Takes moments and events while a run goes on; a subclass does something with them."""

    def write(self, moment: Moment) -> None:
        """Take a moment."""

    def write_events(self, t_ms: int, events: NDArray[np.void]) -> None:
        """Take the events up to ``t_ms``."""

    def close(self) -> None:
        """Finish."""


class InMemoryRecording(Sink):
    """A recording in memory, for short runs of few cars; it is a `Recording`, too."""

    name = "the run"

    def __init__(self, about: Description):
        self.about = about
        self.damage: MotorcadeError | None = None
        self.last_ms = 0
        self._moments: list[Moment] = []
        self._events: list[NDArray[np.void]] = []

    def write(self, moment: Moment) -> None:
        self._moments.append(moment)
        self.last_ms = moment.t_ms

    def write_events(self, t_ms: int, events: NDArray[np.void]) -> None:
        self._events.append(events)

    def moments(self) -> Iterator[Moment]:
        return iter(self._moments)

    def events(self) -> Iterator[NDArray[np.void]]:
        return iter(self._events)


class SpooledRecording(InMemoryRecording):
    """The moments of a run in a temporary file; for drawings of runs that nobody keeps.

    It takes no events: no drawing needs them.
    """

    def __init__(self, about: Description, file: BinaryIO):
        super().__init__(about)
        self._file = file

    def write(self, moment: Moment) -> None:
        pickle.dump(tuple(moment), self._file, pickle.HIGHEST_PROTOCOL)
        self.last_ms = moment.t_ms

    def write_events(self, t_ms: int, events: NDArray[np.void]) -> None:
        """Leave them out."""

    def moments(self) -> Iterator[Moment]:
        end = self._file.seek(0, os.SEEK_END)
        self._file.seek(0)
        while self._file.tell() < end:
            # Only this process wrote it.
            yield Moment(*pickle.load(self._file))


def events_as_dicts(events: NDArray[np.void]) -> list[dict[str, Any]]:
    """Events of `motorcade.engine.events.EVENT` for JSON: EVENT_FIELDS by name, with the names of kinds and reasons."""
    dicts = [dict(zip(EVENT_FIELDS, row, strict=True)) for row in events[list(EVENT_FIELDS)].tolist()]
    for event in dicts:
        event["kind"] = KINDS[event["kind"]]
        event["why"] = LOSS_REASONS[event["why"]]
    return dicts


def with_tag(event: dict[str, Any]) -> dict[str, Any]:
    """Return an event of `events_as_dicts` for people: a tagged frame as its control word and the key ``tag``."""
    kind = event["kind"]
    word = event["word"]
    tag = 0
    if kind == "start":
        tag = event["other"]
    elif kind in ("frame", "heard") and tag_of(word):
        word, tag = word_of(word), tag_of(word)
    if tag:
        return event | {"word": word, "tag": tag}
    return event


def part_of(path: Path) -> Path:
    """Where a run is recorded until it is complete: then that file replaces ``path``."""
    return path.with_name(path.name + PART)


def check_writable(path: Path, endings: Iterable[str]) -> None:
    """Raise MotorcadeError unless ``path`` has one of the endings and a file can be written there."""
    endings = tuple(endings)
    if path.suffix.lower() not in endings:
        raise InputError("run-file-ending", file=path, allowed=_one_of(endings))
    if path.is_dir():
        raise InputError("run-file-is-folder", file=path)
    if not path.parent.is_dir():
        raise InputError("run-file-without-folder", file=path, folder=path.parent)
    place = path
    if not path.exists():
        place = path.parent
    if not os.access(place, os.W_OK):
        raise InputError("run-file-forbidden", file=path)
    with writing(path):
        check_no_device(path)


def _one_of(names: Sequence[object]) -> object:
    """Name one of several, or the only one."""
    if len(names) == 1:
        return names[0]
    return Phrase("list-or", first=", ".join(map(str, names[:-1])), last=names[-1])


@contextmanager
def writing(*files: Path) -> Iterator[None]:
    """Raise MotorcadeError, which names the files, where the block can't write them."""
    try:
        yield
    except OSError as problem:
        raise MotorcadeError("run-file-unwritable", file=_one_of(files), reason=problem) from None


def rgb(colour: str) -> tuple[float, float, float]:
    """Convert ``#rrggbb`` to three numbers from 0 to 1."""
    red, green, blue = (int(colour[place : place + 2], 16) / 255 for place in (1, 3, 5))
    return red, green, blue


class WordColours:
    """The colours of the words in images, the same in every picture: reds for leaders' words, others for followers'.

    Args:
        images: the images in hexadecimal.

    Attributes:
        shades: float32 of shape (words + 2, 2, 3): red, green and blue of each word, at index 0 after its duration
            and at 1 while it runs. The first row is for no word, the last for a word that is in no image.
    """

    def __init__(self, images: Sequence[str]):
        parts = [parse_image_bytes(bytes.fromhex(image)) for image in dict.fromkeys(images)]
        followers = dict.fromkeys(word for part in parts for word in part.followers)
        leaders = dict.fromkeys(word for part in parts for word in part.leader if word not in followers)
        colours = (*islice(cycle(FOLLOWERS), len(followers)), *islice(cycle(_LEADER_SHADES), len(leaders)))
        strong = np.array([rgb(colour) for colour in (_NO_WORD, *colours, _UNKNOWN)], np.float32)
        pale = strong + (1 - strong) * _PALER
        pale[0] = strong[0]
        self.shades: NDArray[np.float32] = np.stack([pale, strong], axis=1)
        words = np.array([0, *followers, *leaders], np.uint32)
        self._rows = np.argsort(words, kind="stable")
        self._words = words[self._rows]

    def of(self, words: NDArray[np.uint32], runs: NDArray[np.bool_]) -> NDArray[np.float32]:
        """Red, green and blue for each word; paler where it no longer runs."""
        found = np.minimum(np.searchsorted(self._words, words), len(self._words) - 1)
        rows = np.where(self._words[found] == words, self._rows[found], -1)
        return self.shades[rows, runs.astype(np.intp)]
