"""A run from an image to what the cars did, with recordings, films and pictures on the way."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motorcade.config.profile import Profile, built_in_profile
from motorcade.engine.world import EVENT, World
from motorcade.mats import Mat, Pose, check_mat, formation, open_table
from motorcade.runs.description import Description
from motorcade.runs.recorder import EVERY_MS, draw, recorder
from motorcade.runs.recording import KINDS_OF_FILE, InMemoryRecording

# Of more cars, moments and events are recorded where that is asked for, and not kept.
MOST_KEPT = 1000


@dataclass(frozen=True)
class Run:
    """What a simulation left.

    Attributes:
        world: the world at its end.
        driven_m: how far each car drove, by its places every 100 ms; shape (cars,).
        kept: the moments, every 100 ms, and the events; None where there are more than MOST_KEPT cars.
    """

    world: World
    driven_m: NDArray[np.float64]
    kept: InMemoryRecording | None

    @property
    def events(self) -> NDArray[np.void]:
        """What happened, as `World.take_events` gives it; empty where it wasn't kept."""
        return np.concatenate([np.zeros(0, EVENT), *(self.kept.events() if self.kept else ())])

    def save_picture(self, path: str | Path) -> None:
        """Draw the tracks into a PNG, SVG or PDF file, or the run into an MP4 or GIF file.

        Raises:
            RecordingError: the file can't be written, or the run was not kept.
        """
        if self.kept is None:
            raise ValueError(f"a run of more than {MOST_KEPT} cars is not kept: give the picture to simulate's record")
        draw(self.kept, Path(path))


def simulate(
    image: bytes,
    followers: int = 5,
    seconds: float = 30,
    seed: int = 0,
    profile: Profile | None = None,
    poses: Sequence[Pose] | None = None,
    mat: Mat | None = None,
    record: Iterable[str | Path] = (),
    progress: Callable[[int], None] = lambda now_ms: None,
    drawn: Callable[[int], None] = lambda now_ms: None,
) -> Run:
    """Let leaders with ``image`` and their followers drive.

    Args:
        image: the image's bytes, as they would be uploaded.
        followers: how many; they stand around the leader on an empty table, behind it first.
        seconds: simulated time.
        seed: the same seed gives the same run.
        profile: what the levels mean; the built-in ``classroom`` unless given.
        poses: where the cars stand at first, the leader first, in place of ``followers``.
        mat: the whole place, in place of both.
        record: files to record the run in: .mcap, .parquet; .mp4, .gif; .png, .svg, .pdf.
        progress: called with the simulated time in ms, ten times a simulated second.
        drawn: called with the time that has been drawn, for each film and picture from 0.

    Raises:
        MatError, MotorcadeError: what can't be simulated.
        RecordingError: a file can't be written.
    """
    chosen = profile or built_in_profile("classroom")
    place = mat or open_table(poses or formation(followers, chosen.infrared.range_mm / 1000))
    check_mat(place, chosen)
    files = [Path(path) for path in record]
    keeps = len(place.starts) <= MOST_KEPT
    events = keeps or any(path.suffix.lower() in KINDS_OF_FILE for path in files)
    world = World(place, [image], chosen, seeds=seed, events=events)
    kept = InMemoryRecording(Description.of(world, EVERY_MS)) if keeps else None
    driven_m = np.zeros(world.cars)
    slice_ms = max(EVERY_MS // world.tick_ms, 1) * world.tick_ms
    with recorder([kept, *files], world, EVERY_MS, events) as take:
        before = world.snapshot()
        while world.now_ms < round(seconds * 1000):
            world.run(min(slice_ms, -(-round(seconds * 1000) // world.tick_ms) * world.tick_ms - world.now_ms))
            take(world)
            now = world.snapshot()
            driven_m += np.hypot(now.x_m - before.x_m, now.y_m - before.y_m)
            before = now
            progress(world.now_ms)
        take.draw(drawn)
    return Run(world, driven_m, kept)
