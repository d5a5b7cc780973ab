"""What a run is measured by: the columns behind its parameters in a sweep's table."""

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from motorcade.car.brain import NEXT_FRAME_MS, QUIET_MS, SIZE, frame_ms, leader_sends, leader_start, sent_word
from motorcade.config.profile import Profile, levels_of
from motorcade.words.image import bytes_to_words
from motorcade.words.infrared import to_frame

if TYPE_CHECKING:
    from motorcade.engine.world import World

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


def run_and_measure(world: "World", image: bytes, duration_ms: int) -> dict[str, list[int] | list[float | None]]:
    """Let every world run for ``duration_ms``; each measure's values, one a world, None where it has no meaning."""
    world.run(duration_ms)
    counts = world.counts()
    columns: dict[str, list[int] | list[float | None]] = {
        measure.name: counts[measure.name].tolist() for measure in MEASURES if measure.counts
    }
    lost = np.sum([counts[name] for name in _LOST], axis=0)
    columns["lost_share"] = _known(lost / np.maximum(lost + counts["heard"], 1), lost + counts["heard"] > 0)
    return columns | _ends(world, last_word(image, world.profile, duration_ms, world.tick_ms))


def _ends(world: "World", word: int | None) -> dict[str, list[int] | list[float | None]]:
    """The measures of the moment; ``word`` is what the informed hold."""
    starts, ends = world.mat.starts, [world.snapshot(index) for index in range(world.worlds)]
    x_m, y_m, heading, words = (
        np.stack([getattr(end, name) for end in ends]) for name in ("x_m", "y_m", "heading", "word")
    )
    leads, follows = starts.leads, ~starts.leads
    some = np.full(world.worlds, follows.any())
    distance_m = _to_nearest(x_m[:, follows], y_m[:, follows], x_m[:, leads], y_m[:, leads])
    informed = words[:, follows] == (0 if word is None else word)
    spread_m = np.sqrt(np.var(x_m, axis=1) + np.var(y_m, axis=1))
    alignment = np.hypot(np.mean(np.cos(heading), axis=1), np.mean(np.sin(heading), axis=1))
    moved_m = np.mean(np.hypot(x_m - starts.x_m, y_m - starts.y_m), axis=1)
    return {
        "informed_share": _known(_mean(informed), some & (word is not None)),
        "leader_distance_m": _known(_mean(distance_m), some & leads.any()),
        "spread_m": spread_m.tolist(),
        "alignment": alignment.tolist(),
        "moved_m": moved_m.tolist(),
    }


def _mean(values: NDArray[np.generic]) -> Numbers:
    """The mean of each world's values, of which there may be none."""
    mean: Numbers = np.sum(values, axis=1, dtype=np.float64) / max(values.shape[1], 1)
    return mean


def _known(values: Numbers, known: NDArray[np.bool_]) -> list[float | None]:
    return [value if is_known else None for value, is_known in zip(values.tolist(), known.tolist(), strict=True)]


def _to_nearest(x_m: Numbers, y_m: Numbers, leaders_x_m: Numbers, leaders_y_m: Numbers) -> Numbers:
    """The distance of each place from the nearest of its world's leaders; all arrays have a row a world."""
    nearest_m = np.full(x_m.shape, np.inf)
    for leader_x_m, leader_y_m in zip(leaders_x_m.T, leaders_y_m.T, strict=True):
        np.minimum(nearest_m, np.hypot(x_m - leader_x_m[:, None], y_m - leader_y_m[:, None]), out=nearest_m)
    return nearest_m


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
