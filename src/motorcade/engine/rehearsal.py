"""Doing once beforehand what compiles the simulator, where nobody may wait for it later."""

from motorcade.engine.world import World
from motorcade.mats import Pose


def warm_up(world: World) -> None:
    """Compile all that is called while a world like this one goes on, drivers included; it stays as it is.

    It takes some 20 s where this computer does it for the first time, else half a second. Other threads get fewer turns
    meanwhile: none for up to 0.2 s.
    """
    other = World(world.mat, world.images, world.profile, threads=world.threads)
    other.drive(0)
    other.step()
    other.move(0, Pose(0, 0))
    other.snapshot()
