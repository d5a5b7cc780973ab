"""A page's world in the server, with what needs NumPy there: the views of cameras, and the moments of films."""

from collections.abc import Iterator, Sequence

import numpy as np

from motorcade.boards.simulated_drive import DrivenCars
from motorcade.cameras.simulated import Scene, to_jpeg
from motorcade.config.profile import Profile
from motorcade.engine.moment import NO_INDEX, RUNS, SENDS, Moment, to_moment, unpack_moment
from motorcade.engine.simulation import Simulation
from motorcade.engine.world import World
from motorcade.mats import Mat
from motorcade.runs.recording import Description
from motorcade.service.history import EVERY_MS
from motorcade.service.referee import Referee
from motorcade.service.studio_world import StudioWorld, prepare_world
from motorcade.service.world_messages import SetWorld
from motorcade.words.image import bytes_to_words


class ServerWorld(StudioWorld):
    """A page's world in the server."""

    def __init__(self, world: Simulation, referee: Referee | None = None, driven: DrivenCars | None = None) -> None:
        super().__init__(world, referee, driven or DrivenCars())
        self._scene: tuple[Mat, Scene] | None = None
        self._words = np.array(bytes_to_words(world.images[0]), np.uint32)

    def view(self, car: int) -> bytes:
        """What a car's camera sees in the present, as a JPEG file. Raises MotorcadeError where there is no such car."""
        self.check_car(car)
        mat = self._world.mat
        if self._scene is None or self._scene[0] is not mat:
            self._scene = mat, Scene(self.description())
        return to_jpeg(self._scene[1].draw(self._world.snapshot(), car))

    def description(self) -> Description:
        """What a recording holds beside the moments of the run."""
        return Description.of(self._world, EVERY_MS)

    def frames(self, moments: Iterator[tuple[int, bytes]]) -> Iterator[Moment]:
        """Stored moments for a film."""
        for t_ms, data in moments:
            columns = unpack_moment(data, self.cars)
            index, flags = np.asarray(columns["index"]), np.asarray(columns["flags"])
            word = np.where(index == NO_INDEX, 0, self._words[np.where(index == NO_INDEX, 0, index)])
            shown = to_moment(t_ms, data, self.cars)._replace(word=word, runs=flags & RUNS > 0, sends=flags & SENDS > 0)
            # An empty dict, not the default: a mappingproxy can't be sent to the process that draws.
            yield shown.map(lambda name, column: np.array(column))._replace(counts={})


def build_world(
    message: SetWorld, driven: DrivenCars, most_cars: int, images: Sequence[bytes] | None = None
) -> ServerWorld:
    """Build a page's world; ``images`` as `prepare_world` takes them. Raises MotorcadeError."""
    return ServerWorld(*prepare_world(message, most_cars, _make, images), driven)


def _make(mat: Mat, images: Sequence[bytes], profile: Profile, seed: int) -> World:
    return World(mat, images, profile, seeds=seed, events=True, threads=1)
