"""Recording a run while it goes on, and drawing it once it is over."""

import tempfile
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from motorcade.runs.description import Description
from motorcade.runs.recording import (
    FILMS,
    KINDS_OF_FILE,
    PICTURES,
    InMemoryRecording,
    Progress,
    Recording,
    RecordingError,
    Sink,
    check_writable,
    open_recording,
)

if TYPE_CHECKING:
    from motorcade.engine.world import World

EVERY_MS = 100


class Recorder:
    """Call it with the world after each slice of a run; see `recorder`."""

    def __init__(
        self, targets: Iterable[str | Path | InMemoryRecording], world: "World", every_ms: int, events: bool, index: int
    ):
        self._world = world
        self._events = events
        self._every_ms = every_ms
        self._index = index
        self._due_ms = world.now_ms
        self._last_ms = -1
        kept = [target for target in targets if isinstance(target, InMemoryRecording)]
        self._kept = kept[0] if kept else None
        self._sinks: list[Sink] = [*kept]
        paths = [Path(target) for target in targets if not isinstance(target, InMemoryRecording)]
        for path in paths:
            check_writable(path, (*KINDS_OF_FILE, *FILMS, *PICTURES))
        files = [path for path in paths if path.suffix.lower() in KINDS_OF_FILE]
        self._drawings = [path for path in paths if path not in files]
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        if self._drawings and not files and not kept:
            self._folder = tempfile.TemporaryDirectory(prefix="motorcade-", ignore_cleanup_errors=True)
            files = [Path(self._folder.name) / "run.parquet"]
        self._files = files
        about = Description.of(world, every_ms, index)
        try:
            for path in files:
                self._sinks.append(_new_file(path, about))
            self(world)
        except BaseException:
            self._finish()
            self._clean_up()
            raise

    def __enter__(self) -> Self:
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
            draw(self._kept or open_recording(self._files[0]), path, progress)

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
        frame = world.snapshot(self._index).in_single_precision()
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
    targets: str | Path | InMemoryRecording | Iterable[str | Path | InMemoryRecording | None],
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

    The present moment is recorded too, and the last one in any case. Memory
    stays bounded: what was recorded goes to the disk while the run goes on.

    Args:
        targets: files, whose endings say their kinds: .mcap and .parquet record, .mp4 and .gif
            are films, .png, .svg and .pdf pictures of the tracks. None is passed over. A
            `InMemoryRecording` keeps the run in memory.
        every_ms: how far apart recorded moments are; run slices that divide it.
        events: whether to record events too; the world was made with ``events=True`` then.
        index: which of the worlds, where there are several.

    Raises:
        RecordingError: a file can't be written, or has another ending.
        ModuleNotFoundError: a library of the extra ``sim`` isn't installed.
    """
    if isinstance(targets, str | Path | InMemoryRecording):
        targets = [targets]
    return Recorder([target for target in targets if target is not None], world, every_ms, events, index)


def draw(recording: Recording, path: Path, progress: Progress = lambda done_ms: None) -> None:
    """Draw a film, or a picture of the tracks, as the file's ending says. Raises RecordingError."""
    if path.suffix.lower() in FILMS:
        from motorcade.runs.video import draw_film

        draw_film(recording, path, progress=progress)
    else:
        from motorcade.runs.picture import draw_tracks

        draw_tracks(recording, path, progress=progress)


def _new_file(path: Path, about: Description) -> Sink:
    try:
        if path.suffix.lower() == ".mcap":
            from motorcade.runs.mcap_file import McapSink

            return McapSink(path, about)
        from motorcade.runs.parquet_file import ParquetSink

        return ParquetSink(path, about)
    except OSError as problem:
        raise _unwritable([path], problem) from None


def _unwritable(files: list[Path], problem: OSError) -> RecordingError:
    if isinstance(problem, RecordingError):
        return problem
    return RecordingError(f"{' or '.join(map(str, files))} can't be written: {problem.strerror or problem}")
