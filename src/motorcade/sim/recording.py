"""Runs of the simulator in files: streamed while they run, read back afterwards.

A recording holds moments (where each car was and what it did, and what was
counted by then) and events. The file's ending says its kind: ``.mcap`` opens in
Foxglove, ``.parquet`` in pandas and DuckDB. Endings of pictures and films are
drawn from the recording once the run is over.
"""

import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from motorcade.sim.description import Description

if TYPE_CHECKING:
    from motorcade.sim.world import Snapshot, World

EVERY_MS = 100
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


class Kept:
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


class Recorder:
    """Call it with the world after each slice of a run; see `recorder`."""

    def __init__(self, targets: Iterable[str | Path | Kept], world: "World", every_ms: int, events: bool, index: int):
        self._world = world
        self._events = events
        self._every_ms = every_ms
        self._index = index
        self._due_ms = world.now_ms
        self._last_ms = -1
        self._sinks: list[Sink] = [target for target in targets if isinstance(target, Kept)]
        paths = [Path(target) for target in targets if not isinstance(target, Kept)]
        for path in paths:
            check_writable(path, (*KINDS_OF_FILE, *FILMS, *PICTURES))
        files = [path for path in paths if path.suffix.lower() in KINDS_OF_FILE]
        self._drawings = [path for path in paths if path not in files]
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        if self._drawings and not files:
            self._folder = tempfile.TemporaryDirectory(prefix="motorcade-")
            files = [Path(self._folder.name) / "run.parquet"]
        self._files = files
        about = Description.of(world, every_ms, index)
        try:
            for path in files:
                self._sinks.append(_new_file(path, about))
        except BaseException:
            self._finish()
            self._clean_up()
            raise

    def __enter__(self) -> Self:
        self(self._world)
        return self

    def __call__(self, world: "World") -> None:
        """Take the events since the last call and, where a moment is due, what the cars do now.

        Raises:
            RecordingError: a file can't be written any more.
        """
        try:
            if self._events:
                self._take_events(world)
            if world.now_ms >= self._due_ms:
                self._take(world)
        except OSError as problem:
            raise _unwritable(self._files, problem) from None

    def draw(self, progress: Progress = lambda done_ms: None) -> None:
        """End the recording and draw the films and pictures, if any; without this, leaving the context does so.

        Args:
            progress: called with the simulated time in ms that has been drawn, for each drawing from 0.

        Raises:
            RecordingError: one can't be drawn.
        """
        if self._sinks and self._last_ms < self._world.now_ms:
            self._take(self._world)
        self._finish()
        drawings, self._drawings = self._drawings, []
        for path in drawings:
            draw(open_recording(self._files[0]), path, progress)

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                self.draw()
            else:
                self._finish()
        finally:
            self._clean_up()

    def _take_events(self, world: "World") -> None:
        events = world.take_events()
        if world.worlds > 1:
            events = events[events["world"] == self._index]
        if len(events):
            for sink in self._sinks:
                sink.write_events(world.now_ms, events)

    def _take(self, world: "World") -> None:
        counts = {name: int(values[self._index]) for name, values in world.counts().items()}
        frame = Frame.of(world.snapshot(self._index), counts)
        for sink in self._sinks:
            sink.write(frame)
        self._last_ms = world.now_ms
        while self._due_ms <= world.now_ms:
            self._due_ms += self._every_ms

    def _finish(self) -> None:
        sinks, self._sinks = self._sinks, []
        try:
            with ExitStack() as closing:
                for sink in sinks:
                    closing.callback(sink.close)
        except OSError as problem:
            raise _unwritable(self._files, problem) from None

    def _clean_up(self) -> None:
        if self._folder:
            self._folder.cleanup()


def recorder(
    targets: str | Path | Kept | Iterable[str | Path | Kept | None],
    world: "World",
    every_ms: int = EVERY_MS,
    events: bool = True,
    index: int = 0,
) -> Recorder:
    """A context that records a run, or several files of one run::

        with recorder("run.mcap", world) as record:
            while world.now_ms < 30_000:
                world.run(100)
                record(world)

    The moment on entering is recorded too, and the last one in any case. Memory
    stays bounded: what was recorded goes to the disk while the run goes on.

    Args:
        targets: files, whose endings say their kinds: .mcap and .parquet record, .mp4 and .gif
            are films, .png, .svg and .pdf pictures of the tracks. None is passed over. A
            `Kept` keeps the run in memory.
        every_ms: how far apart recorded moments are; run slices that divide it.
        events: whether to record events too; the world was made with ``events=True`` then.
        index: which of the worlds, where there are several.

    Raises:
        RecordingError: a file can't be written, or has another ending.
        ModuleNotFoundError: a library of the extra ``sim`` isn't installed.
    """
    if isinstance(targets, str | Path | Kept):
        targets = [targets]
    return Recorder([target for target in targets if target is not None], world, every_ms, events, index)


def open_recording(path: str | Path) -> Recording:
    """The recording in a file, of either kind.

    Raises:
        RecordingError: it can't be read, or is no recording of a run.
        ModuleNotFoundError: a library of the extra ``sim`` isn't installed.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending == ".mcap":
        from motorcade.sim.mcap_file import McapRecording

        return McapRecording(path)
    if ending in (".parquet", ".part"):
        from motorcade.sim.parquet_file import ParquetRecording

        return ParquetRecording(path)
    raise RecordingError(f"{path} is no recording: its name would end in {' or '.join(KINDS_OF_FILE)}")


def draw(recording: Recording, path: Path, progress: Progress = lambda done_ms: None) -> None:
    """Draw a film, or a picture of the tracks, as the file's ending says. Raises RecordingError."""
    if path.suffix.lower() in FILMS:
        from motorcade.sim.video import draw_film

        draw_film(recording, path, progress=progress)
    else:
        from motorcade.sim.picture import draw_tracks

        draw_tracks(recording, path, progress=progress)


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


def _new_file(path: Path, about: Description) -> Sink:
    try:
        if path.suffix.lower() == ".mcap":
            from motorcade.sim.mcap_file import McapSink

            return McapSink(path, about)
        from motorcade.sim.parquet_file import ParquetSink

        return ParquetSink(path, about)
    except OSError as problem:
        raise _unwritable([path], problem) from None


def _unwritable(files: list[Path], problem: OSError) -> RecordingError:
    if isinstance(problem, RecordingError):
        return problem
    return RecordingError(f"{' or '.join(map(str, files))} can't be written: {problem.strerror or problem}")
