"""What cars think: the short form of the answer to 'Why?', for the few cars that have a reason to say it unasked.

A car has such a reason where it has pushed against something for a while, follows a line and has seen none for a while,
or stands without a word that runs and has heard nothing lately. Its thought is that of the answer's code (`THOUGHTS`),
so that the bubble above a car and its card never disagree. The cars that are told of are asked again with each look,
all others with a look at all; what was told at a time is kept, so that a page which shows the past shows it again.
"""

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType

from motorcade.engine import agents
from motorcade.engine.moment import NO_INDEX, RUNS, STUCK, unpack_moment
from motorcade.service.history import Timed
from motorcade.service.studio_world import StudioWorld
from motorcade.service.why import SILENT_MS, follows_line
from motorcade.service.world_messages import CarThought, Thought

# So many at once can be read.
MOST_THOUGHTS = 5
# To ask each car takes too long for more; of a crowd whose cars all stand, these are asked.
MOST_CARS = 200
_MOST_ASKED = 20
# Nobody thinks before: the first messages are on their way.
_BEGIN_MS = 1500
# Who touches something, or loses the line, for less does not speak of it.
_AWHILE_MS = 700

THOUGHTS: Mapping[str, Thought] = MappingProxyType(
    {
        "why-against-car": "blockedByCar",
        "why-against-leader": "blockedByCar",
        "why-against-edge": "blocked",
        "why-against-wall": "blocked",
        "why-against-disc": "blocked",
        "why-against-polygon": "blocked",
        "why-no-line": "noLine",
        "why-hidden": "hidden",
        "why-outside-beam": "outsideBeam",
        "why-not-passed-on": "notPassedOn",
        "why-too-far": "tooFar",
        "why-lost-deaf": "deaf",
        "why-does-not-listen": "deaf",
        "why-lost-collision": "collisions",
        "why-behind-collision": "collisions",
        "why-lost": "damaged",
        "why-garbled": "damaged",
        "why-no-program": "noProgram",
        "why-nothing-sent": "nothing",
        "why-no-leader": "nothing",
        "why-no-words": "nothing",
        "why-not-yet": "waiting",
        "why-waits": "waiting",
    }
)
"""The thought of a car by the code of its answer; a car with another answer thinks nothing."""
# First what can be seen, then what can be changed.
_ORDER = tuple(dict.fromkeys(THOUGHTS.values()))
# What has to last for a while.
_LASTING = ("blockedByCar", "blocked", "noLine")


class Thinking:
    """What the cars of a world think from one beginning on.

    Args:
        world: the world; make this object anew where it begins again.

    Attributes:
        told: what was told, by time.
    """

    def __init__(self, world: StudioWorld) -> None:
        self._world = world
        # Since when a car is stuck, or follows a line that it doesn't see.
        self._since_ms: dict[int, int] = {}
        self.told = Timed[list[CarThought]]([])

    def look(self, *, at_all: bool) -> list[CarThought]:
        """Return what cars think now, the most telling thoughts first.

        Without ``at_all`` only the cars that were told of are asked, so that what is no longer true goes at once.
        """
        now_ms = self._world.now_ms
        if now_ms < _BEGIN_MS or self._world.cars > MOST_CARS:
            return []
        cars = [told.car for told in self.told.now]
        if at_all:
            cars = list(self._wondering())
        found = []
        lasting = {}
        for car in cars:
            thought = THOUGHTS.get(self._world.why(car).code)
            if thought is None:
                continue
            if thought in _LASTING:
                lasting[car] = self._since_ms.get(car, now_ms)
                if now_ms - lasting[car] < _AWHILE_MS:
                    continue
            else:
                counted = self._world.pictures.counted(car)
                if counted.heard > 0 and counted.last_ms > now_ms - SILENT_MS:
                    continue
            found.append(CarThought(car, thought))
        if at_all:
            self._since_ms = lasting
        found.sort(key=lambda told: (_ORDER.index(told.thought), told.car))
        self.told.keep(now_ms, found[:MOST_THOUGHTS])
        return self.told.now

    def _wondering(self) -> Iterator[int]:
        """Yield the cars that have a reason to say what they do."""
        columns = unpack_moment(self._world.pictures.look(), self._world.cars)
        flags = columns["flags"]
        index = columns["index"]
        following = {number for number, word in enumerate(self._world.words) if follows_line(word)}
        dark = self._over_dark(bool(following))
        standing = 0
        for car in range(self._world.cars):
            is_idle = index[car] == NO_INDEX or not flags[car] & RUNS
            may_miss_line = index[car] in following and not is_idle and not dark[car]
            if flags[car] & STUCK or may_miss_line:
                yield car
            elif is_idle and standing < _MOST_ASKED:
                standing += 1
                yield car

    def _over_dark(self, matters: bool) -> Sequence[int]:
        """Return which floor sensors of each car are over dark floor; nothing of it where it doesn't matter."""
        if not matters:
            return bytes(self._world.cars)
        simulation = self._world.simulation
        senses = memoryview(simulation.backend.read(simulation.read_senses())).cast("q")
        return senses[agents.DARK_FLOOR :: agents.SENSED]
