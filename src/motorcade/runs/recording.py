"""Recorded runs: what they hold, and how they are read back.

A recording holds moments (where each car was and what it did, and what was
counted by then) and events. The file's ending says its kind: ``.mcap`` opens in
Foxglove, ``.parquet`` in pandas and DuckDB.
"""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from motorcade.runs.description import Description

if TYPE_CHECKING:
    from motorcade.engine.world import Snapshot

KINDS_OF_FILE = (".mcap", ".parquet")
FILMS = (".mp4", ".gif")
PICTURES = (".png", ".svg", ".pdf")

Progress = Callable[[int], None]


class RecordingError(OSError):
    """A recording, film or picture that can't be written or read; its text is a sentence for the user."""


class Frame(NamedTuple):
    """One moment; arrays are in the order of the cars' numbers.

    ``wheels`` is direction * 4 + speed level (directions forward, left, right),
    ``led`` the one that is lit or 4, ``runs`` whether the held word runs now,
    ``sends`` whether the car's frame is on the air. ``counts`` are sums since the run began.
    """

    t_ms: int
    x_m: NDArray[np.float32]
    y_m: NDArray[np.float32]
    heading: NDArray[np.float32]
    word: NDArray[np.uint32]
    runs: NDArray[np.bool_]
    wheels: NDArray[np.uint8]
    led: NDArray[np.uint8]
    sends: NDArray[np.bool_]
    counts: Mapping[str, int]

    @classmethod
    def of(cls, snapshot: "Snapshot", counts: Mapping[str, int]) -> "Frame":
        """A snapshot as it is recorded: positions and headings in single precision."""
        x_m, y_m, heading = (np.asarray(each, np.float32) for each in (snapshot.x_m, snapshot.y_m, snapshot.heading))
        held = (snapshot.word, snapshot.runs, snapshot.wheels, snapshot.led, snapshot.sends)
        return cls(snapshot.t_ms, x_m, y_m, heading, *held, counts)

    def as_dict(self) -> dict[str, Any]:
        """The moment for JSON: lists in the order of car numbers, lengths and angles to a millionth."""
        x_m, y_m, heading = (np.round(each.astype(float), 6).tolist() for each in (self.x_m, self.y_m, self.heading))
        return {
            "t_ms": self.t_ms,
            "number": list(range(len(self.x_m))),
            "x_m": x_m,
            "y_m": y_m,
            "heading_rad": heading,
            "word": self.word.tolist(),
            "runs": self.runs.tolist(),
            "wheels": self.wheels.tolist(),
            "led": self.led.tolist(),
            "sends": self.sends.tolist(),
            "counts": dict(self.counts),
        }


class Recording(Protocol):
    """A run that can be read as often as one likes; a moment and a batch of events at a time.

    Attributes:
        name: what to call it.
        about: the run's description.
        complaint: a sentence once reading came to an end before the file's own; else empty.
    """

    name: str
    about: Description
    complaint: str

    @property
    def last_ms(self) -> int:
        """When its last moment is."""

    def frames(self) -> Iterator[Frame]:
        """The moments in order."""

    def events(self) -> Iterator[NDArray[np.void]]:
        """Arrays of EVENT in order of time."""


class Sink(Protocol):
    """What takes moments and events while a run goes on."""

    def write(self, frame: Frame) -> None:
        """Take a moment."""

    def write_events(self, t_ms: int, events: NDArray[np.void]) -> None:
        """Take the events up to ``t_ms``."""

    def close(self) -> None:
        """Finish."""


class InMemoryRecording:
    """A recording that is kept in memory: for short runs of few cars."""

    def __init__(self, about: Description, name: str = "the run"):
        self.name = name
        self.about = about
        self.complaint = ""
        self._frames: list[Frame] = []
        self._events: list[NDArray[np.void]] = []

    def write(self, frame: Frame) -> None:
        self._frames.append(frame)

    def write_events(self, t_ms: int, events: NDArray[np.void]) -> None:
        self._events.append(events)

    def close(self) -> None:
        """Nothing is left to do."""

    @property
    def last_ms(self) -> int:
        return self._frames[-1].t_ms if self._frames else 0

    def frames(self) -> Iterator[Frame]:
        return iter(self._frames)

    def events(self) -> Iterator[NDArray[np.void]]:
        return iter(self._events)


def open_recording(path: str | Path) -> Recording:
    """The recording in a file, of either kind.

    Raises:
        RecordingError: it can't be read, or is no recording of a run.
        ModuleNotFoundError: a library of the extra ``sim`` isn't installed.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending == ".mcap":
        from motorcade.runs.mcap_file import McapRecording

        return McapRecording(path)
    if ending in (".parquet", ".part"):
        from motorcade.runs.parquet_file import ParquetRecording

        return ParquetRecording(path)
    raise RecordingError(f"{path} is no recording: its name would end in {' or '.join(KINDS_OF_FILE)}")


def check_writable(path: Path, endings: Iterable[str]) -> None:
    """Raise RecordingError unless ``path`` has one of the endings and a file can be written there."""
    endings = tuple(endings)
    if path.suffix.lower() not in endings:
        raise RecordingError(
            f"{path} can't be written: its name must end in {', '.join(endings[:-1])} or {endings[-1]}"
        )
    if path.is_dir():
        raise RecordingError(f"{path} can't be written: it is a folder")
    if not path.parent.is_dir():
        raise RecordingError(f"{path} can't be written: there is no folder {path.parent}")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise RecordingError(f"{path} can't be written: you may not write there")
