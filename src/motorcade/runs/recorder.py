"""Record a run into files while it goes on, draw films and pictures of it at its end, and open recordings.

A file's ending chooses its kind: `.mcap` records, `.gif` is a film, `.png`, `.svg` and `.pdf` are pictures.
"""

from collections.abc import Iterable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Self

from motorcade.config.arguments import instance_of, not_allowed, to_function, to_list, to_whole
from motorcade.engine.simulation import Simulation
from motorcade.errors import InputError, Phrase
from motorcade.extras import needs_extra
from motorcade.runs.recording import (
    DATA_ENDING,
    FILM_ENDING,
    PART,
    PICTURE_ENDINGS,
    Description,
    InMemoryRecording,
    OnProgress,
    Recording,
    Sink,
    SpooledRecording,
    check_writable,
    writing,
)
from motorcade.words.ticks import TICKS_MASK

if TYPE_CHECKING:
    from motorcade.engine.world import World

EVERY_MS = 100

Target = str | Path | Sink


def targets_of(what: str, given: Target | Iterable[Target | None]) -> list[Target]:
    """Return one target, or several, as a list without None. Raises MotorcadeError: something is no target."""
    targets = [given] if isinstance(given, str | Path | Sink) else to_list(what, given)
    for target in targets:
        if not isinstance(target, str | Path | Sink | None):
            raise not_allowed(what, target, Phrase("recording-targets"))
    return [target for target in targets if target is not None]


@needs_extra("recording", "runs")
def open_recording(path: str | Path) -> Recording:
    """Open the recording in an .mcap file.

    Raises:
        MotorcadeError: it can't be read, is not the recording of a run, or needs an extra that isn't installed.
    """
    path = Path(path)
    if path.suffix.lower() != DATA_ENDING and path.suffixes[-2:] != [DATA_ENDING, PART]:
        raise InputError("not-a-recording", file=path, allowed=DATA_ENDING)
    from motorcade.runs.mcap_file import McapRecording

    return McapRecording(path)


@needs_extra("drawing", "runs")
def draw(recording: Recording, path: Path, progress: OnProgress = lambda done_ms: None, speed: float = 1.0) -> None:
    """Draw a film, or a picture of the tracks, as the file's ending says. Raises MotorcadeError.

    ``speed`` is of a film: simulated seconds in a second of it.
    """
    from motorcade.runs.plots import draw_film, draw_tracks

    check_writable(path, (FILM_ENDING, *PICTURE_ENDINGS))
    if path.suffix.lower() == FILM_ENDING:
        draw_film(recording, path, speed, progress)
    else:
        draw_tracks(recording, path, progress)


class Recorder:
    """Records a run: call it with the world after each slice of the run, as a context manager.

    ::

        with Recorder("run.mcap", world) as record:
            while world.now_ms < 30_000:
                world.run(100)
                record(world)

    The moment at which it is made and the last one are recorded in any case. Of several worlds all are recorded;
    films and pictures show the first. After a reset of the world the next run follows in the same recording: call the
    recorder before and after it. Memory is bounded: moments and events go to the disk while the run goes on.

    Args:
        targets: files; .mcap records, .gif is a film, .png, .svg and .pdf are pictures of the tracks. An
            `InMemoryRecording` keeps the run in memory; any other `Sink` gets what a file gets. None is ignored.
        world: the world, before the first slice.
        every_ms: the interval between recorded moments, 1 or more; choose slices that divide it.
        events: whether to record events too, for which the world was made with ``events=True``.
        progress: called while films and pictures are drawn at the end, with the simulated time in ms that has been
            drawn, added up over all of them.

    Raises:
        MotorcadeError: a file can't be written or drawn, has another ending, or needs an extra that isn't installed;
            an argument isn't allowed, or the world keeps no events.
    """

    def __init__(
        self,
        targets: Target | Iterable[Target | None],
        world: "World",
        every_ms: int = EVERY_MS,
        events: bool = True,
        progress: OnProgress = lambda done_ms: None,
    ):
        targets = targets_of("targets", targets)
        instance_of(Simulation, "world", world)
        to_function("progress", progress)
        every_ms = to_whole("every_ms", every_ms, 1, TICKS_MASK)
        self._world = world
        self._events = events
        self._progress = progress
        self._every_ms = every_ms
        self._run = world.run_number
        self._due_ms = world.now_ms
        self._last_ms = -1
        self._sinks = [target for target in targets if isinstance(target, Sink)]
        self._kept = next((target for target in self._sinks if isinstance(target, InMemoryRecording)), None)
        # A file that is named twice is written once.
        named = {Path(target).resolve(): Path(target) for target in targets if isinstance(target, str | Path)}
        paths = list(named.values())
        for path in paths:
            check_writable(path, (DATA_ENDING, FILM_ENDING, *PICTURE_ENDINGS))
        self._files = [path for path in paths if path.suffix.lower() == DATA_ENDING]
        self._drawings = [path for path in paths if path not in self._files]
        about = Description.of(world, every_ms)
        with ExitStack() as opened:
            if self._drawings and not self._files and not self._kept:
                self._kept = SpooledRecording(about, opened.enter_context(TemporaryFile(prefix="motorcade-")))
                self._sinks.append(self._kept)
            opened.callback(self._close)
            for path in self._files:
                with needs_extra("recording", "runs"), writing(path):
                    from motorcade.runs.mcap_file import McapSink

                    self._sinks.append(McapSink(path, about))
            self(world)
            self._opened = opened.pop_all()

    def __enter__(self) -> Self:
        return self

    def __call__(self, world: "World") -> None:
        """Record the events since the last call and, where a moment is due, what the cars show now.

        Raises:
            MotorcadeError: a file can no longer be written, or this is another world.
        """
        if world is not self._world:
            raise InputError("recorder-of-another-world")
        with writing(*self._files):
            if self._events and len(events := world.take_events()):
                for sink in self._sinks:
                    sink.write_events(world.now_ms, events)
            if world.run_number != self._run:
                self._run = world.run_number
                self._due_ms = 0
            if world.now_ms >= self._due_ms:
                self._record_moment(world)

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        with self._opened:
            if kind is not None:
                return
            if (self._run, self._last_ms) != (self._world.run_number, self._world.now_ms):
                self._record_moment(self._world)
            self._close()
            for number, path in enumerate(self._drawings):
                recording = self._kept or open_recording(self._files[0])
                draw(recording, path, partial(self._drawn, number * self._last_ms))

    def _drawn(self, before_ms: int, done_ms: int) -> None:
        self._progress(before_ms + done_ms)

    def _record_moment(self, world: "World") -> None:
        for number in range(world.worlds):
            moment = world.snapshot(number).in_single_precision()
            for sink in self._sinks:
                sink.write(moment)
        self._last_ms = world.now_ms
        while self._due_ms <= world.now_ms:
            self._due_ms += self._every_ms

    def _close(self) -> None:
        sinks = self._sinks
        self._sinks = []
        with writing(*self._files), ExitStack() as closing:
            for sink in sinks:
                closing.callback(sink.close)
