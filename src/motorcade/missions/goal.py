"""What every kind of goal has: the class that a kind derives from, and what it is given.

A kind of goal is one class, in `car_goals`, `event_goals`, `score_goals` or `other_goals`; `schema` finds them there.
What belongs to the class says which keys such a goal has in a file, what it asks for in words, and what decides it. An
object of the class follows one goal during one run: it takes the moments, and says how it stands and how near the run
came.

What can be asked of cars at a moment (is one in a zone, which lamp does it show, how far apart are they) a class leaves
to `motorcade.engine.judging`: its ``question`` is asked in each moment of each run, and the object reads the answers.
All else it finds in the last moment, and in the words that cars began. An object is a pure function of what it was
given, so a page that plays a run and the command line come to the same result.
"""

import math
from abc import ABC, abstractmethod
from bisect import bisect_right
from collections.abc import Callable, Sequence
from functools import cached_property
from itertools import chain
from typing import Any, ClassVar, Literal, NamedTuple, TypeVar

from motorcade.config.check import Schema, choice, line, whole
from motorcade.config.check import number as a_number
from motorcade.engine import judging
from motorcade.engine.moment import Event, Moment
from motorcade.errors import Phrase
from motorcade.mats.model import Corners, Disc, Mat
from motorcade.mats.schema import FARTHEST_M, SHORTEST_M
from motorcade.missions.model import Goal, Mission, Wording, Zone
from motorcade.program.parts import length_ms
from motorcade.words.image import parse_image_bytes
from motorcade.words.positions import AVOID_ENABLE_AT

# A run is looked at every so many ms, beginning at 0.
EVERY_MS = 100
LONGEST_S = 600
MOST_GOALS = 30
GROUPS = ("leader", "followers", "all")
# When a car must meet a goal.
AT = {"end": judging.END, "some-moment": judging.SOME_MOMENT, "always": judging.ALWAYS}
TIMES = tuple(AT)
# The most that a goal can get that is not met.
MOST_UNMET = 0.99
# How it stands with a goal: not yet met, met at present but not for good, met for good, lost for good.
GoalProgress = Literal["open", "holds", "met", "lost"]
_Made = TypeVar("_Made")
# The goals of a mission in order, each with its kind.
Declared = Sequence[tuple[Goal, type["GoalKind"]]]


def seconds(title: str, least: float = 0.1) -> Schema:
    """The schema of a time."""
    return a_number(least, LONGEST_S, "seconds", title=title)


def metres(title: str) -> Schema:
    """The schema of a length."""
    return a_number(SHORTEST_M, FARTHEST_M, "metres", title=title)


def at(first: str) -> Schema:
    """The schema of when a car must meet a goal, and its default."""
    return choice(*TIMES, title="when it must be so; at some-moment each car has a moment of its own", default=first)


WHO: Schema = {
    "title": "which cars: a group, or a list of car numbers",
    "type": ["string", "array"],
    "pattern": "^(" + "|".join(GROUPS) + ")$",
    "items": whole(0, 1 << 20),
    "minItems": 1,
    "maxItems": 1000,
    "uniqueItems": True,
    "x-allowed": ["mission-who", {"groups": ", ".join(f'"{group}"' for group in GROUPS)}],
    "default": "all",
}
SHARE = a_number(0.01, 1, title="the part of these cars that must", default=1)
CARS: dict[str, Schema] = {"who": WHO, "share": SHARE}
ZONE = line(40, title="the name of a zone")
WINDOW: dict[str, Schema] = {
    "from_s": seconds("moments before don't count", 0),
    "until_s": seconds("moments after don't count", 0),
}


class GoalState(NamedTuple):
    """How it stands with a goal.

    Attributes:
        progress: see `GoalProgress`.
        t_ms: when it was met; where it is lost, a moment at which one can see why; None while neither.
        why: a phrase with numbers.
        cars: the cars that ``why`` is about, where it is not met.
    """

    progress: GoalProgress
    t_ms: int | None
    why: Phrase
    cars: tuple[int, ...] = ()


class GoalFault(NamedTuple):
    """What is wrong with a goal in a file: the code of the fault, the key, its value, and what is allowed.

    Attributes:
        keys: the key; none where it is the goal as a whole.
    """

    code: str
    keys: tuple[str, ...] = ()
    value: str = ""
    allowed: str = ""


class Question(NamedTuple):
    """What is asked of a goal's cars at each moment; see `motorcade.engine.judging`.

    Attributes:
        what: INSIDE to STOPPED.
        when: END, SOME_MOMENT or ALWAYS.
        figures: an angle and its tolerance in degrees, or the least and the most length in metres.
        window_ms: moments before and after don't count.
        corners: of no zone: what is asked instead.
        cars: which, where the goal names none.
    """

    what: int
    when: int = judging.END
    figures: tuple[float, float] = (0.0, 0.0)
    zone: Zone | None = None
    led: int = 0
    window_ms: tuple[int, int] = (0, 2 * LONGEST_S * 1000)
    corners: Corners = ()
    cars: Sequence[int] = ()

    @property
    def first_off(self) -> float:
        """How far a car is from meeting it before the first moment; how far it drove, or what it scored."""
        sums_up = self.what in (judging.TRAVELLED, judging.OBEYS, judging.GATHERED, judging.STOPPED)
        if self.when == judging.ALWAYS or sums_up:
            return 0.0
        return math.inf


class MadeOnce:
    """Keeps what is made once and used by several goals."""

    def __init__(self) -> None:
        self._made: dict[str, Any] = {}

    def once(self, key: str, make: Callable[[], _Made]) -> _Made:
        """Return what is kept under a key; make it where there is nothing yet."""
        if key not in self._made:
            self._made[key] = make()
        made: _Made = self._made[key]
        return made


class Attempt(MadeOnce):
    """A program that is to do a mission: what all runs of it have in common.

    Attributes:
        image: the program, parsed.
        kinds: the class of each goal, by the goal's number.
        asked: the question of each goal that has one, by the goal's number.
        questions: these questions as `motorcade.engine.judging` takes them, as lists.
    """

    def __init__(self, mission: Mission, image: bytes, kinds: Sequence[type["GoalKind"]]) -> None:
        super().__init__()
        self.mission = mission
        self.image = parse_image_bytes(image)
        self.kinds = kinds
        self.asked: dict[int, Question] = {}
        # Of each goal that is asked: its row, its first place among the answers, and how many it has.
        self.rows: dict[int, tuple[int, int, int]] = {}
        # Where the kernel has arrays there are lists here.
        rows: Any = []
        figures: Any = []
        corners: Any = []
        cars: Any = []
        self.questions = judging.Questions(rows, figures, corners, cars)
        for number, (goal, kind) in enumerate(zip(mission.goals, kinds, strict=True)):
            question = kind.question(goal, mission)
            if question is not None:
                self._ask(number, goal, question)

    def _ask(self, number: int, goal: Goal, question: Question) -> None:
        lists: Any = self.questions
        rows, figures, corners, who = lists
        self.asked[number] = question
        sides = question.corners
        disc: Disc = (0.0, 0.0, 0.0)
        if question.zone is not None:
            sides = question.zone.corners
            disc = question.zone.disc
        cars = question.cars or goal.cars
        self.rows[number] = len(rows), len(who), len(cars)
        needed = needed_of(goal.values.get("share", 1.0), len(cars))
        cars_of_it = needed, len(who), len(cars)
        area = len(corners), len(sides)
        rows.append([question.what, question.when, *question.window_ms, *cars_of_it, *area, question.led])
        figures.append([*question.figures, *disc])
        corners.extend(chain.from_iterable(sides))
        who.extend(cars)

    @cached_property
    def has_events(self) -> bool:
        """Whether any of the goals needs the beginnings of words."""
        return any(kind.has_events for kind in self.kinds)

    @cached_property
    def round_ms(self) -> int:
        """How long the states of the leader last in all: then it begins again, unless it decides."""
        return sum(length_ms(word, self.mission.profile) for word in self.image.leader)

    def no_answers(self) -> judging.Answers:
        """Return the answers of one run before its first moment, as lists."""
        off: Any = []
        for number, question in self.asked.items():
            off += [question.first_off] * self.rows[number][2]
        since: Any = [0 if question.when == judging.ALWAYS else -1 for question in self.asked.values()]
        places = len(off)
        nothing = [0.0] * 2 * places
        cars = len(self.mission.mat.starts)
        rows: list[Any] = [[off + nothing], [[0.0] * 3 * places], [since], [[0] * cars], [[0.0] * 4 * cars]]
        return judging.Answers(*rows)


class GoalRun(MadeOnce):
    """One run of an attempt, for its goals.

    Attributes:
        answers: to the attempt's questions, as lists of one run.
        times_ms: the moments so far.
        goals: what follows each goal, by the goal's number.
    """

    def __init__(self, attempt: Attempt, times_ms: list[int]) -> None:
        super().__init__()
        self.attempt = attempt
        self.answers = attempt.no_answers()
        self.times_ms = times_ms
        self.goals: dict[int, GoalKind] = {}


class GoalKind(ABC):
    """A kind of goal; an object follows one goal during one run.

    Args:
        number: of the goal in the mission.
        run: the run.

    Attributes:
        name: what a file calls it. A class without a name is no kind, but what several have in common.
        fields: the schema of each of its keys, beside ``kind``, ``star`` and ``text``.
        optional: which of these may be left out though they have no default.
        one_of: keys of which at least one must be there; empty for none.
        decided_by: the run; the program alone; or "others", another goal or other runs.
        is_reached: whether it can be met at a moment from which on it stays met.
        has_events: whether it needs the beginnings of words.
        tries_other_seeds: whether `motorcade.missions.check` decides it, by runs on other seeds.
    """

    name: ClassVar[str]
    fields: ClassVar[dict[str, Schema]] = {}
    optional: ClassVar[tuple[str, ...]] = ()
    one_of: ClassVar[tuple[str, ...]] = ()
    decided_by: ClassVar[Literal["run", "program", "others"]] = "run"
    is_reached: ClassVar[bool] = False
    has_events: ClassVar[bool] = False
    tries_other_seeds: ClassVar[bool] = False

    @classmethod
    def forbidden_zone(cls, goal: Goal) -> str:
        """Return the zone in which no car of the goal may be during the whole run; "" for none."""
        return ""

    def __init__(self, number: int, run: GoalRun) -> None:
        self.number = number
        self.run = run
        self.mission = run.attempt.mission
        self.goal = self.mission.goals[number]
        self.values = self.goal.values
        self.cars: Sequence[int] = self.goal.cars
        self.needed = needed_of(self.values.get("share", 1.0), len(self.cars))
        self.now_ms = 0
        # Since when it is met, and when it was lost for good.
        self.since_ms: int | None = None
        self.lost_ms: int | None = None
        self.prepare()

    def prepare(self) -> None:  # noqa: B027 - most kinds keep nothing
        """Set up what a kind keeps of the run beside this."""

    @classmethod
    def question(cls, goal: Goal, mission: Mission) -> Question | None:
        """What is asked of its cars at each moment; None where the run's last moment and words decide."""
        return None

    @classmethod
    def asks(cls, goal: Goal, details: dict[str, Any]) -> Phrase:
        """What a goal asks of its cars; ``details`` are its values, and ``zone`` and ``led`` by name."""
        when = ""
        if "at" in goal.values:
            when = f"-{goal.values['at']}"
        return Phrase(f"goal-{cls.name}{when}", **details)

    @classmethod
    def who(cls, goal: Goal) -> Phrase:
        """Name the cars of a goal, or how many of them must meet it."""
        group = goal.values["who"]
        count = len(goal.cars)
        if isinstance(group, list):
            key = "goal-who-cars" if count > 1 else "goal-who-one-car"
            name = Phrase(key, cars=", ".join(map(str, group)))
        elif count > 1:
            name = Phrase(f"goal-who-{group}", count=count)
        else:
            name = Phrase(f"goal-who-one-{group}")
        needed = needed_of(goal.values.get("share", 1), count)
        if needed < count:
            return Phrase("goal-who-some", needed=needed, who=name)
        return name

    @classmethod
    def fault(cls, goal: Goal, others: Declared, mat: Mat) -> GoalFault | None:
        """What is wrong with a goal beside its keys; ``others`` are all goals of the mission, in order."""
        return None

    @classmethod
    def other_runs(cls, document: dict[str, Any]) -> int:
        """On how many other seeds a goal with these keys makes the program run."""
        return 0

    @classmethod
    def compared(cls, goal: Goal, mission: Mission) -> int:
        """How many sides of zones, and obstacles, a goal compares with cars at a moment."""
        if "zone" not in goal.values:
            return 0
        return len(goal.cars) * max(len(mission.zone(goal.values["zone"]).corners), 1)

    def see(self, moment: Moment, begun: Sequence[Event]) -> None:
        """Take the next moment, and the events since the one before it in which cars begin words.

        Where many runs are judged at once it is the last one, the only one. To see more may shape sentences alone.
        """
        self.now_ms = moment.t_ms

    @abstractmethod
    def state(self, is_over: bool) -> GoalState:
        """How it stands now; ``is_over``: the run has ended, so nothing stays open."""

    @abstractmethod
    def nearness(self) -> float:
        """How near the run came to meeting the goal, 0 to 1. It is asked only of a goal that is not met."""

    def grade(self, is_over: bool) -> float:
        """1 where the goal is met; else how near the run came to it, 0 to `MOST_UNMET`."""
        if self.state(is_over).progress == "met":
            return 1.0
        return min(self.nearness(), MOST_UNMET)

    def kept(self, is_over: bool, why: Phrase) -> GoalState:
        """Return how it stands with a goal that is met as long as nothing goes wrong, which nothing has."""
        if is_over:
            return GoalState("met", self.now_ms, why)
        return GoalState("holds", None, why)

    def happened(self, t_ms: int, car: int, what: Phrase, *, stands: bool = False) -> Phrase:
        """Say when something went wrong with a car: after its program began again, or at ``t_ms``.

        Many programs shall begin again; so that counts in the second round alone, unless the car had to stand. One that
        avoids obstacles always shall.
        """
        attempt = self.run.attempt
        round_ms = attempt.round_ms
        again = car in self.mission.mat.starts.leaders and not attempt.image.decides
        if any(word >> AVOID_ENABLE_AT & 1 for word in attempt.image.leader):
            again = False
        if again and 0 < round_ms <= t_ms and (stands or t_ms < 2 * round_ms):
            return Phrase("goal-again", seconds=t_ms // round_ms * round_ms / 1000, what=what)
        return Phrase("goal-at", seconds=t_ms / 1000, what=what)

    def note(self, is_met: bool) -> None:
        """Note whether the goal is met at this moment."""
        if not is_met:
            self.since_ms = None
        elif self.since_ms is None:
            self.since_ms = self.now_ms


class AskedGoal(GoalKind):
    """A goal whose question `motorcade.engine.judging` asks; an object reads the answers of its run."""

    def prepare(self) -> None:
        self.asked = self.run.attempt.asked[self.number]
        self._row, self.first, self._count = self.run.attempt.rows[self.number]

    @property
    def off(self) -> list[float]:
        """How far each car is from meeting the goal; how far it drove, or what it scored."""
        return self.run.answers.off[0][self.first : self.first + self._count]  # type: ignore[no-any-return]

    def off_ms(self, place: int) -> int:
        """Since when the ``off`` of a car counts."""
        return int(self.run.answers.off[0][len(self.run.attempt.questions.who) + self.first + place])

    @property
    def met_since_ms(self) -> int | None:
        """Since when as many cars as needed meet the goal; None where they don't."""
        since: int = self.run.answers.since[0][self._row]
        if since >= 0:
            return since
        return None

    def met(self, is_over: bool, why: Phrase) -> GoalState:
        """Return how it stands with a goal that is met now, at the end or at some moment."""
        is_for_good = is_over or self.asked.when == judging.SOME_MOMENT
        return GoalState("met" if is_for_good else "holds", self.met_since_ms, why)

    @property
    def last_ms(self) -> int:
        """The last moment that counts; 0 before it."""
        from_ms, until_ms = self.asked.window_ms
        times_ms = self.run.times_ms
        counted = bisect_right(times_ms, until_ms)
        if counted and times_ms[counted - 1] >= from_ms:
            return times_ms[counted - 1]
        return 0

    @property
    def has_ended(self) -> bool:
        """Whether no later moment counts."""
        return bool(self.run.times_ms) and self.run.times_ms[-1] > self.asked.window_ms[1]


def car_phrase(car: int) -> Phrase:
    """Name a car."""
    return Phrase("car-number", number=car)


def named(car: int, count: int) -> Phrase:
    """Name a car that is one of ``count``: the only one needs no number."""
    if count == 1:
        return Phrase("the-car")
    return car_phrase(car)


def centimetres(metres: float) -> float:
    """A length in the unit of sentences."""
    return metres * 100


def lost_phrase(key: str, car: int, done: int, count: int, **details: Any) -> Phrase:
    """Say what one car did; of several cars also how many did what is asked."""
    tally = Phrase("nothing-more")
    if count > 1:
        tally = Phrase(f"{key}-tally", done=done, count=count)
    return Phrase(key, car=named(car, count), tally=tally, **details)


def done_phrase(done: int, count: int) -> Phrase:
    """Say how many cars did what is asked."""
    if done == count == 1:
        return Phrase("goal-done")
    return Phrase("goal-done-by", done=done, count=count)


def needed_of(share: float, count: int) -> int:
    """How many of ``count`` are the ``share``, rounded up."""
    return math.ceil(share * count - 1e-9)


def lamp_name(led: int | str) -> Wording:
    """Name a lamp as blocks do; "off" has no name."""
    return Wording.of_page("levels", "light", str(led))


def distance_to_zone_m(zone: Zone, x: float, y: float) -> float:
    """How far a point is from a zone; 0 inside."""
    if not zone.corners:
        return judging.to_disc_m(x, y, *zone.disc)
    return judging.to_outline_m([*chain.from_iterable(zone.corners)], 0, len(zone.corners), x, y)
