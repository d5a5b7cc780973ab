"""Simulate a run from an image to what the cars did and how words spread, with recordings and drawings on the way."""

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from motorcade.config.arguments import instance_of, to_function, to_number
from motorcade.config.profile import Profile, built_in_profile
from motorcade.engine.events import EVENT, START
from motorcade.engine.simulation import checked_images
from motorcade.engine.slots import Slots
from motorcade.engine.world import World
from motorcade.mats import Mat, formation, open_table
from motorcade.runs.recorder import EVERY_MS, Recorder, targets_of
from motorcade.runs.recording import DATA_ENDING, Description, InMemoryRecording, OnProgress, Sink
from motorcade.words.image import parse_image_bytes
from motorcade.words.infrared import TAGS

# Runs of more cars are recorded into files where that is asked for, and not in memory.
MOST_CARS_IN_MEMORY = 1000
LONGEST_S = 86_400
_NEVER_MS = np.iinfo(np.int32).max


class Slot(NamedTuple):
    """One slot of a leader: the time in which it sends one follower word.

    Attributes:
        leader: the number of the leader.
        tag: 1 to 31; 0 for a bare word.
        begin_ms: when the slot began.
        once, again, never: how many of all followers began its word once, more than once, and not at all, whichever
            car they received it from.
        lag_p50_ms, lag_p95_ms: the time from the slot's beginning until half and 95% of those that began the word had
            begun it; None where none did.
    """

    leader: int
    tag: int
    begin_ms: int
    once: int
    again: int
    never: int
    lag_p50_ms: int | None
    lag_p95_ms: int | None


class SlotCounts(Sink):
    """Count the beginnings of words by slot, as `motorcade.engine.slots` assigns them.

    Args:
        image: the bytes that the leaders run.
        mat: which cars lead.
        profile: the meaning of the dwell level.
    """

    def __init__(self, image: bytes, mat: Mat, profile: Profile):
        self._slots = Slots(parse_image_bytes(image), profile)
        self._leads = np.asarray(mat.starts.leads)
        cars = len(self._leads)
        # Of each open slot: how often each car has begun its word, at most 2, and how late it did so first.
        self._open = defaultdict[int, tuple[NDArray[np.uint8], NDArray[np.int32]]](
            lambda: (np.zeros(cars, np.uint8), np.full(cars, _NEVER_MS, np.int32))
        )
        self._closed: list[tuple[int, int, int, int | None, int | None]] = []

    @property
    def counts_anything(self) -> bool:
        """Whether there are slots and followers."""
        return self._slots.dwell_ms > 0 and not self._leads.all()

    def write_events(self, t_ms: int, events: NDArray[np.void]) -> None:
        """Count the words that began; ``t_ms`` is the time until which the run has come."""
        started = events[events["kind"] == START]
        at_ms = started["t_ms"].astype(np.int64)
        cars = started["car"].astype(np.int64)
        # Few words begin in the same slot: each of them is looked up once.
        alike = np.stack([at_ms // self._slots.dwell_ms, started["word"], started["other"]])
        kinds, kind_of = np.unique(alike, axis=1, return_inverse=True)
        found = [self._slots.of(now * self._slots.dwell_ms, word, tag) for now, word, tag in kinds.T.tolist()]
        slots = np.array(found, np.int64)[kind_of.reshape(-1)]
        for slot in np.unique(slots[slots >= len(self._closed)]).tolist():
            of_slot = slots == slot
            counts, lags_ms = self._open[slot]
            begun = np.bincount(cars[of_slot], minlength=len(counts))
            counts[:] = np.minimum(counts + begun, 2)
            np.minimum.at(lags_ms, cars[of_slot], (at_ms[of_slot] - slot * self._slots.dwell_ms).astype(np.int32))
        # A tag is used again after so many slots.
        while len(self._closed) <= (t_ms - 1) // self._slots.dwell_ms - TAGS:
            self._close_one()

    def slots(self, until_ms: int) -> list[Slot]:
        """The slots that began before ``until_ms``, each once for every leader."""
        while len(self._closed) < -(-until_ms // self._slots.dwell_ms):
            self._close_one()
        return [
            Slot(leader, self._slots.tag(number), number * self._slots.dwell_ms, *counted)
            for number, counted in enumerate(self._closed)
            for leader in np.flatnonzero(self._leads).tolist()
        ]

    def _close_one(self) -> None:
        counts, lags_ms = self._open[len(self._closed)]
        del self._open[len(self._closed)]
        followers = counts[~self._leads]
        once = int((followers == 1).sum())
        never = int((followers == 0).sum())
        begun_ms = lags_ms[~self._leads & (lags_ms < _NEVER_MS)]
        p50_ms: int | None = None
        p95_ms: int | None = None
        if len(begun_ms):
            p50_ms, p95_ms = (int(np.percentile(begun_ms, share, method="inverted_cdf")) for share in (50, 95))
        self._closed.append((once, len(followers) - once - never, never, p50_ms, p95_ms))


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
        nothing = np.zeros(0, EVENT)
        if self.recording is None:
            return nothing
        return np.concatenate([nothing, *self.recording.events()])


def simulate(
    image: bytes,
    followers: int = 5,
    seconds: float = 30,
    seed: int = 0,
    profile: Profile | None = None,
    mat: Mat | None = None,
    record: str | Path | Iterable[str | Path] = (),
    progress: OnProgress = lambda done_ms: None,
) -> Run:
    """Simulate leaders that run ``image``, and their followers.

    Args:
        image: the image's bytes, as they would be uploaded.
        followers: the number of followers, which stand around one leader on an empty table, behind it first.
        seconds: simulated time, 0 to 86400.
        seed: the same seed gives the same run.
        profile: the meaning of the levels in words; the built-in ``classroom`` unless given.
        mat: the place with all cars, in place of ``followers``; `open_table` makes one from poses.
        record: a file, or several, to record the run in: .mcap; .gif; .png, .svg, .pdf.
        progress: called with the simulated time in ms that is done: of the run, then also of each film and picture.

    Raises:
        MotorcadeError: an argument isn't allowed, the run can't be simulated, or a file can't be written.
    """
    if profile is None:
        profile = built_in_profile("classroom")
    chosen = instance_of(Profile, "profile", profile)
    if mat is None:
        mat = open_table(formation(followers, chosen.infrared.range_mm / 1000))
    (image,) = checked_images([image])
    duration_ms = round(to_number("seconds", seconds, 0, LONGEST_S) * 1000)
    files = targets_of("record", record)
    is_small = len(instance_of(Mat, "mat", mat).starts) <= MOST_CARS_IN_MEMORY
    slots = SlotCounts(image, mat, chosen)
    takes_events = any(isinstance(target, Sink) or Path(target).suffix.lower() == DATA_ENDING for target in files)
    events = is_small or slots.counts_anything or takes_events
    world = World(mat, [image], chosen, seeds=seed, events=events)
    recording = InMemoryRecording(Description.of(world, EVERY_MS)) if is_small else None
    driven_m = np.zeros(world.cars)
    slice_ms = max(EVERY_MS // world.tick_ms, 1) * world.tick_ms
    to_function("progress", progress)
    counted = slots if slots.counts_anything else None
    targets = [recording, counted, *files]
    with Recorder(targets, world, EVERY_MS, events, lambda done_ms: progress(duration_ms + done_ms)) as recorder:
        before = world.snapshot()
        while world.now_ms < duration_ms:
            world.run(min(slice_ms, -(-duration_ms // world.tick_ms) * world.tick_ms - world.now_ms))
            recorder(world)
            now = world.snapshot()
            driven_m += np.hypot(now.x_m - before.x_m, now.y_m - before.y_m)
            before = now
            progress(world.now_ms)
    counts = []
    if counted:
        counts = counted.slots(duration_ms)
    return Run(world, driven_m, recording, counts)
