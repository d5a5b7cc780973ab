"""A run of the small world from an image to tracks, events and a picture."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from motorcade.profile import Profile, built_in_profile
from motorcade.sim.world import Pose, World, formation

TRACK_EVERY_MS = 100


@dataclass(frozen=True)
class Run:
    """What a simulation left: the world at its end, and where each car was every 100 ms, (x, y) in metres."""

    world: World
    tracks: list[list[tuple[float, float]]]

    def save_picture(self, path: str | Path) -> None:
        """Draw the tracks into a PNG, SVG or PDF file.

        Raises:
            ModuleNotFoundError: Matplotlib, of the extra ``sim``, isn't installed.
            OSError: the file can't be written.
            ValueError: Matplotlib can't write files with such an ending.
        """
        from motorcade.sim.picture import draw_tracks

        draw_tracks(self.tracks, self.world, Path(path))


def simulate(
    image: bytes,
    followers: int = 5,
    seconds: float = 30,
    seed: int = 0,
    profile: Profile | None = None,
    poses: list[Pose] | None = None,
    progress: Callable[[int], None] = lambda now_ms: None,
) -> Run:
    """Let a leader with ``image`` and its followers drive.

    Args:
        image: the image's bytes, as they would be uploaded.
        followers: how many; they stand around the leader, behind it first.
        seconds: simulated time.
        seed: the same seed gives the same run.
        profile: what the levels mean; the built-in ``classroom`` unless given.
        poses: where the cars stand at first, the leader first, in place of ``followers``.
        progress: called with the simulated time in ms, ten times a simulated second.
    """
    chosen = profile or built_in_profile("classroom")
    world = World(image, chosen, poses or formation(followers, chosen.infrared.range_mm / 1000), seed)
    tracks = [[(pose.x, pose.y)] for pose in world.poses]
    for now_ms in world.run(round(seconds * 1000), TRACK_EVERY_MS):
        for track, pose in zip(tracks, world.poses, strict=True):
            track.append((pose.x, pose.y))
        progress(now_ms)
    return Run(world, tracks)
