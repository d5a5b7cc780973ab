"""A room to drive in where nobody brought a mat: walls, obstacles, somebody who walks about, and a few cars."""

from motorcade.mats import Mat, Person, Pose, Starts

_SIZE_M = (4.0, 3.0)
_TICK_MS = 20
_FOLLOWERS = 4


def playground() -> Mat:
    """The room, with the car that is driven in front and leading."""
    poses = [Pose(0.9, 1.5), *(Pose(0.4, 0.9 + 0.4 * k) for k in range(_FOLLOWERS))]
    return Mat(
        "playground",
        Starts.of(poses, [True] + [False] * _FOLLOWERS),
        _TICK_MS,
        _SIZE_M,
        True,
        walls=((2.6, 0.0, 2.6, 0.7),),
        discs=((1.9, 2.1, 0.12), (3.2, 1.2, 0.18)),
        polygons=(((2.4, 2.4), (2.9, 2.4), (2.9, 2.6), (2.4, 2.6)),),
        people=(Person(((0.0, 3.6, 0.4), (8.0, 3.6, 2.6), (16.0, 3.6, 0.4)), repeats=True),),
    )
