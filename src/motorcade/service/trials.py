"""Behind a page: its program is tried on many seeds, and two runs are compared. Without I/O, a little in each call.

A shell calls `receive` for each message, and `advance` as long as `is_busy`; each returns what is to be sent, in order.
"""

from collections import deque
from collections.abc import Iterator
from typing import Annotated

from msgspec import Meta

from motorcade.missions.check import open_worlds_here, own_stars, watched
from motorcade.missions.model import Mission
from motorcade.missions.odds import Odds, OpenWorlds, Trial, other_seeds, works
from motorcade.missions.watch import MissionWatch
from motorcade.service.difference import Compare, Compared, Comparison, Difference, Show
from motorcade.service.messages import MissionChoice, Sentence, StreamAnswer, StreamMessage, sentences
from motorcade.service.missions import chosen_mission
from motorcade.service.studio_world import check_mission_size
from motorcade.service.world_messages import Refused, Seed
from motorcade.words.image import parse_image_bytes

# With large worlds fewer runs are tried: about so many car-seconds in all, some ten seconds of work.
_MOST_CAR_SECONDS = 1_500_000
_FEWEST_RUNS = 20
# A page shows no more.
_MOST_FAILED = 100
# Of a run that is explained so many moments are looked at in one call, fewer where there are many cars.
_MOMENTS = 10
_MOMENTS_OF_CARS = 2_000


class Try(StreamMessage):
    """Run a mission on its own seeds, then on others, with this image; what was tried before ends."""

    mission: MissionChoice
    image: bytes
    runs: Annotated[int, Meta(ge=1, le=200)] = 200


class Explain(StreamMessage):
    """Say what went wrong in a run that was tried."""

    seed: Seed


class Luck(StreamAnswer):
    """In how many runs the goals of the first star were met.

    Attributes:
        works: in so many of those ``tried`` so far.
        of: how many runs there will be.
        failed: the seeds of the others.
        stars: those that the program earns on all of the mission's own seeds, without those for which other seeds are
            tried when the run ends; None as long as that isn't known.
    """

    works: int
    tried: int
    of: int
    failed: list[int]
    stars: list[int] | None = None


class Failure(StreamAnswer):
    """What went wrong in a run: at ``t_ms`` one can see it, and ``cars`` are the cars that ``why`` is about."""

    seed: int
    t_ms: int
    why: Sentence
    cars: list[int]


TrialMessage = Try | Explain | Compare | Show
TrialAnswer = Luck | Failure | Difference | Compared | Refused


class _Try:
    """A program that is tried."""

    def __init__(self, message: Try, open_worlds: OpenWorlds, most_cars: int) -> None:
        check_mission_size(message.mission, most_cars)
        self._mission: Mission = chosen_mission(message.mission)
        self._image = message.image
        self._open_worlds = open_worlds
        parse_image_bytes(message.image)
        size = len(self._mission.mat.starts) * self._mission.duration_ms / 1000
        self._runs = min(message.runs, max(_FEWEST_RUNS, int(_MOST_CAR_SECONDS / size)))
        seeds = other_seeds(self._mission, self._runs)
        # The mission's own seeds are few: how they end is told at once.
        self._own = Odds(self._mission, message.image, self._mission.seeds, open_worlds)
        self._stars: list[int] | None = None
        self._own_trials: list[Trial] = []
        self._odds = Odds(self._mission, message.image, seeds, open_worlds)
        self._trials: list[Trial] = []
        # The seeds whose failures are to be told, and the one that is looked at.
        self.asked: deque[int] = deque(maxlen=_MOST_FAILED)
        self._explaining: Iterator[Failure | None] | None = None

    @property
    def is_busy(self) -> bool:
        return self._explaining is not None or bool(self.asked) or not self._odds.is_over

    def advance(self) -> list[Luck | Failure]:
        if self._explaining is None and self.asked:
            self._explaining = self._explain(self.asked.popleft())
        if self._explaining is not None:
            failure = next(self._explaining)
            if failure is None:
                return []
            self._explaining = None
            return [failure]
        if not self._own.is_over:
            self._own_trials += self._own.advance()
            if self._own.is_over:
                self._stars = own_stars(self._mission, self._own_trials)
                return [self.luck()]
            return []
        ended = self._odds.advance()
        self._trials += ended
        if ended:
            return [self.luck()]
        return []

    def luck(self) -> Luck:
        failed = [trial.seed for trial in self._trials if not works(self._mission, trial)]
        tried = len(self._trials)
        return Luck(tried - len(failed), tried, self._runs, failed[:_MOST_FAILED], self._stars)

    def _explain(self, seed: int) -> Iterator[Failure | None]:
        """Run one seed again, watched as in the page; yield None while there is more to do."""
        world = self._open_worlds(self._mission.mat, [self._image], self._mission.profile, [seed], True)
        watch = MissionWatch(self._mission, self._image)
        in_a_call = max(1, min(_MOMENTS, _MOMENTS_OF_CARS // len(self._mission.mat.starts)))
        for number, sight in enumerate(watched(world, self._mission), start=1):
            watch.see(sight.moment, sight.begun)
            if number % in_a_call == 0:
                yield None
        states = [state for goal, state in zip(self._mission.goals, watch.states(), strict=True) if goal.star == 1]
        state = next((state for state in states if state.progress != "met"), states[0])
        yield Failure(seed, state.t_ms or 0, sentences(state.why), list(state.cars))


class TrialSession:
    """The trials of one page.

    Args:
        most_cars: the most cars in one world.
        open_worlds: opens the worlds of a mission, and those of two runs that are compared.
    """

    def __init__(self, most_cars: int, open_worlds: OpenWorlds = open_worlds_here) -> None:
        self._most_cars = most_cars
        self._open_worlds = open_worlds
        self._try: _Try | None = None
        self._comparison: Comparison | None = None

    @property
    def is_busy(self) -> bool:
        """Whether `advance` has something to do."""
        return any(work is not None and work.is_busy for work in (self._try, self._comparison))

    def receive(self, message: TrialMessage) -> list[TrialAnswer | bytes]:
        """Do what the page asks. Raises MotorcadeError where that isn't possible."""
        match message:
            case Try():
                # What is tried ends also where the next can't begin.
                self._try = None
                self._try = _Try(message, self._open_worlds, self._most_cars)
                return [self._try.luck()]
            case Explain():
                if self._try:
                    self._try.asked.append(message.seed)
            case Compare():
                self._comparison = None
                self._comparison = Comparison(message, self._most_cars, self._open_worlds)
            case Show():
                if self._comparison:
                    return [*self._comparison.pictures(message.t_ms)]
                return []
        return []

    def advance(self) -> list[TrialAnswer | bytes]:
        """Go on for some milliseconds of computing."""
        # Somebody waits for the comparison.
        busy = next((work for work in (self._comparison, self._try) if work is not None and work.is_busy), None)
        if busy:
            return [*busy.advance()]
        return []
