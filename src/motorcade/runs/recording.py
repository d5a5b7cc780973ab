"""Recorded runs: what they hold, and how they are read back.

A recording holds moments (where each car was and what it did, and what was
counted by then) and events. The file's ending says its kind: ``.mcap`` opens in
Foxglove, ``.parquet`` in pandas and DuckDB.
"""

import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from motorcade.engine.moment import Moment
from motorcade.runs.description import Description

KINDS_OF_FILE = (".mcap", ".parquet")
FILMS = (".mp4", ".gif")
PICTURES = (".png", ".svg", ".pdf")

Progress = Callable[[int], None]


class RecordingError(OSError):
    """A recording, film or picture that can't be written or read; its text is a sentence for the user."""


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

    def frames(self) -> Iterator[Moment]:
        """The moments in order."""

    def events(self) -> Iterator[NDArray[np.void]]:
        """Arrays of EVENT in order of time."""


class Sink(Protocol):
    """What takes moments and events while a run goes on."""

    def write(self, frame: Moment) -> None:
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
        self._frames: list[Moment] = []
        self._events: list[NDArray[np.void]] = []

    def write(self, frame: Moment) -> None:
        self._frames.append(frame)

    def write_events(self, t_ms: int, events: NDArray[np.void]) -> None:
        self._events.append(events)

    def close(self) -> None:
        """Nothing is left to do."""

    @property
    def last_ms(self) -> int:
        return self._frames[-1].t_ms if self._frames else 0

    def frames(self) -> Iterator[Moment]:
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
