"""Simulate a run from an image to what the cars did, with recordings, films and pictures on the way."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motorcade.config.profile import Profile, built_in_profile
from motorcade.engine.events import EVENT
from motorcade.engine.world import World
from motorcade.mats import Mat, check_mat, formation, open_table
from motorcade.runs.recorder import EVERY_MS, Recorder, draw
from motorcade.runs.recording import DATA_ENDINGS, Description, InMemoryRecording, Progress
from motorcade.runs.slots import Slot, SlotCounts

# Runs of more cars are recorded into files where that is asked for, and not in memory.
MOST_CARS_IN_MEMORY = 1000


@dataclass(frozen=True)
class Run:
    """The result of a simulation.

    Attributes:
        world: the world at its end.
        driven_m: how far each car drove, measured between its positions every 100 ms; shape (cars,).
        recording: the moments, every 100 ms, and the events; None for more than MOST_CARS_IN_MEMORY cars.
        slots: the slots of the leaders, and how many followers began the word of each.
    """

    world: World
    driven_m: NDArray[np.float64]
    recording: InMemoryRecording | None
    slots: list[Slot]

    @property
    def events(self) -> NDArray[np.void]:
        """What happened, as from `World.take_events`; empty where there is no recording."""
        return np.concatenate([np.zeros(0, EVENT), *(self.recording.events() if self.recording else ())])

    def save_picture(self, path: str | Path) -> None:
        """Draw the tracks into a PNG, SVG or PDF file, or the run into an MP4 or GIF file.

        Raises:
            MotorcadeError: the file can't be written.
            ValueError: the run was not recorded in memory.
        """
        if self.recording is None:
            raise ValueError(
                f"a run of more than {MOST_CARS_IN_MEMORY} cars is not in memory: name the picture in simulate's record"
            )
        draw(self.recording, Path(path))


def simulate(
    image: bytes,
    followers: int = 5,
    seconds: float = 30,
    seed: int = 0,
    profile: Profile | None = None,
    mat: Mat | None = None,
    record: Iterable[str | Path] = (),
    progress: Progress = lambda done_ms: None,
) -> Run:
    """Simulate leaders that run ``image``, and their followers.

    Args:
        image: the image's bytes, as they would be uploaded.
        followers: the number of followers, which stand around one leader on an empty table, behind it first.
        seconds: simulated time.
        seed: the same seed gives the same run.
        profile: the meaning of the levels in words; the built-in ``classroom`` unless given.
        mat: the place with all cars, in place of ``followers``; `open_table` makes one from poses.
        record: files to record the run in: .mcap, .parquet; .mp4, .gif; .png, .svg, .pdf.
        progress: called with the simulated time in ms that is done: of the run, then also of each film and picture.

    Raises:
        MotorcadeError: the run can't be simulated, or a file can't be written.
    """
    chosen = profile or built_in_profile("classroom")
    place = mat or open_table(formation(followers, chosen.infrared.range_mm / 1000))
    check_mat(place, chosen)
    files = [Path(path) for path in record]
    is_small = len(place.starts) <= MOST_CARS_IN_MEMORY
    slots = SlotCounts(image, place, chosen)
    events = is_small or slots.counts_anything or any(path.suffix.lower() in DATA_ENDINGS for path in files)
    world = World(place, [image], chosen, seeds=seed, events=events)
    recording = InMemoryRecording(Description.of(world, EVERY_MS)) if is_small else None
    driven_m = np.zeros(world.cars)
    slice_ms = max(EVERY_MS // world.tick_ms, 1) * world.tick_ms
    duration_ms = round(seconds * 1000)
    with Recorder([recording, slots if slots.counts_anything else None, *files], world, EVERY_MS, events) as recorder:
        before = world.snapshot()
        while world.now_ms < duration_ms:
            world.run(min(slice_ms, -(-duration_ms // world.tick_ms) * world.tick_ms - world.now_ms))
            recorder(world)
            now = world.snapshot()
            driven_m += np.hypot(now.x_m - before.x_m, now.y_m - before.y_m)
            before = now
            progress(world.now_ms)
        recorder.draw(_after(duration_ms, progress))
    return Run(world, driven_m, recording, slots.slots(duration_ms) if slots.counts_anything else [])


def _after(run_ms: int, progress: Progress) -> Progress:
    """Add up the progress of drawings that follow a run; each drawing begins again from 0."""
    done_ms, last_ms = run_ms, 0

    def add(now_ms: int) -> None:
        nonlocal done_ms, last_ms
        if now_ms < last_ms:
            done_ms += run_ms
        last_ms = now_ms
        progress(done_ms + now_ms)

    return add
