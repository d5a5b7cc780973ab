"""What a run is measured by: the columns behind its parameters in a sweep's table."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from motorcade.car.brain import NEXT_FRAME_MS, QUIET_MS, SIZE, frame_ms, leader_sends, leader_start, sent_word
from motorcade.profile import Profile
from motorcade.sim.levels import levels_of
from motorcade.words.image import bytes_to_words
from motorcade.words.infrared import to_frame

if TYPE_CHECKING:
    from motorcade.sim.world import Snapshot, World

Numbers = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Measure:
    """A measure of a run: its column, what it is in a picture's label, and whether it counts something."""

    name: str
    label: str
    counts: bool


MEASURES = (
    Measure("frames", "frames sent", True),
    Measure("heard", "frames heard", True),
    Measure("lost_collision", "frames lost to other frames", True),
    Measure("lost_sending", "frames lost to own sending", True),
    Measure("lost_parity", "frames lost to wrong parity", True),
    Measure("lost_reserved", "frames lost to reserved bits", True),
    Measure("deaf", "frames missed while deaf", True),
    Measure("undetected", "wrong frames taken for good", True),
    Measure("touching_ms", "cars touching (ms)", True),
    Measure("lost_share", "share of frames lost", False),
    Measure("informed_share", "share of followers that hold the leader's word", False),
    Measure("leader_distance_m", "distance to the nearest leader (m)", False),
    Measure("spread_m", "spread of the cars (m)", False),
    Measure("alignment", "alignment of the cars", False),
    Measure("moved_m", "distance from start to end (m)", False),
)
_LOST = ("lost_collision", "lost_sending", "lost_parity", "lost_reserved", "deaf")


def run_and_measure(world: "World", image: bytes, duration_ms: int) -> dict[str, Sequence[float | None]]:
    """Let every world run for ``duration_ms``; each measure's values, one a world, None where it has no meaning."""
    starts = world.mat.starts
    world.run(duration_ms)
    counts = world.counts()
    columns: dict[str, Sequence[float | None]] = {
        measure.name: counts[measure.name].tolist() for measure in MEASURES if measure.counts
    }
    lost = np.sum([counts[name] for name in _LOST], axis=0)
    reached = lost + counts["heard"]
    columns["lost_share"] = [_share(some, all_) for some, all_ in zip(lost.tolist(), reached.tolist(), strict=True)]
    word = last_word(image, world.profile, duration_ms, world.tick_ms)
    ends = [_end(world.snapshot(index), starts.leads, (starts.x_m, starts.y_m), word) for index in range(world.worlds)]
    names = [measure.name for measure in MEASURES if not measure.counts and measure.name != "lost_share"]
    columns.update(zip(names, zip(*ends, strict=True), strict=True))
    return columns


def _end(
    snapshot: "Snapshot", leads: NDArray[np.bool_], start: tuple[Numbers, Numbers], word: int | None
) -> tuple[float | None, ...]:
    """informed_share, leader_distance_m, spread_m, alignment and moved_m of one world."""
    x_m, y_m, follows = snapshot.x_m, snapshot.y_m, ~leads
    informed = distance_m = None
    if follows.any() and word is not None:
        informed = float(np.mean(snapshot.word[follows] == word))
    if follows.any() and leads.any():
        distance_m = float(np.mean(_to_nearest(x_m[follows], y_m[follows], x_m[leads], y_m[leads])))
    spread_m = float(np.sqrt(np.var(x_m) + np.var(y_m)))
    alignment = float(np.hypot(np.mean(np.cos(snapshot.heading)), np.mean(np.sin(snapshot.heading))))
    moved_m = float(np.mean(np.hypot(x_m - start[0], y_m - start[1])))
    return informed, distance_m, spread_m, alignment, moved_m


def _to_nearest(x_m: Numbers, y_m: Numbers, leaders_x_m: Numbers, leaders_y_m: Numbers) -> Numbers:
    """The distance of each place from the nearest of the leaders."""
    nearest_m = np.full(len(x_m), np.inf)
    for leader_x_m, leader_y_m in zip(leaders_x_m, leaders_y_m, strict=True):
        np.minimum(nearest_m, np.hypot(x_m - leader_x_m, y_m - leader_y_m), out=nearest_m)
    return nearest_m


def _share(some: int, all_: int) -> float | None:
    return some / all_ if all_ else None


@lru_cache(maxsize=1024)
def last_word(image: bytes, profile: Profile, duration_ms: int, tick_ms: int) -> int | None:
    """The follower word in the last frame that a leader with ``image`` has ended by ``duration_ms``.

    None where it has ended none. The brain itself says so, frame by frame.
    """
    words, levels, memory = bytes_to_words(image), levels_of(profile), [0] * SIZE
    leader_start(memory, words, 0)
    now_ms, last = 0, None
    while now_ms < duration_ms and leader_sends(memory, words, now_ms, levels):
        word = sent_word(memory, words)
        if now_ms + frame_ms(to_frame(word), levels) > duration_ms:
            break
        last = word
        due_ms = max(memory[NEXT_FRAME_MS], memory[QUIET_MS])
        now_ms = -(-due_ms // tick_ms) * tick_ms
    return last
