"""Watch the goals of a mission while runs go on, one moment after another; and say what each goal asks for.

`MissionWatch` follows one run by the moments that it is shown. `ManyRuns` follows runs side by side in their worlds:
while they run, the kernel asks the questions of `motorcade.engine.judging` at each moment. When the runs end, each has
a watch with the kernel's answers, which sees the last moment and all words; so goals and grades are the same.
"""

from array import array
from collections.abc import Sequence
from typing import Any

from motorcade.engine import judging
from motorcade.engine.backend import BackendArray
from motorcade.engine.events import COLUMNS, KIND, START
from motorcade.engine.moment import Event, Moment
from motorcade.engine.simulation import Simulation
from motorcade.engine.state import CODES, Buffer
from motorcade.errors import InputError, Phrase
from motorcade.missions.goal import EVERY_MS, Attempt, GoalRun, GoalState, lamp_name
from motorcade.missions.model import Goal, Mission, Wording
from motorcade.missions.schema import GOALS

# For each car sides of zones, and obstacles, that goals compare in a moment: some 20 ms.
_MOST_COMPARED = 20_000
# The arrays with the answers of many runs.
_ANSWERS = {"off": "float64", "before": "float32", "since": "int64", "led": "int64", "shown": "float32"}
# What goals need of a moment.
_COLUMNS = ("x_m", "y_m", "heading", "wheels", "led")


def run_to_next(world: Simulation, end_ms: int, every_ms: int = EVERY_MS) -> None:
    """Run worlds to their next moment that is watched, at most to the end of a mission."""
    next_ms = min((world.now_ms // every_ms + 1) * every_ms, end_ms)
    world.run(-(-(next_ms - world.now_ms) // world.tick_ms) * world.tick_ms)


def begun_words(world: Simulation, number: int) -> list[Event]:
    """Return the events of one of the worlds, since the last call, in which a car begins a word."""
    rows = memoryview(world.backend.read(world.take_rows(number))).cast("I")
    firsts = (at * COLUMNS for at, kind in enumerate(rows[KIND::COLUMNS].tolist()) if kind == START)
    return [Event(*rows[first : first + COLUMNS]) for first in firsts]


def attempt_of(mission: Mission, image: bytes) -> Attempt:
    """Return what all runs of a program in a mission share. Raises MotorcadeError where the goals take too long."""
    kinds = [GOALS[goal.kind] for goal in mission.goals]
    count = sum(kind.compared(goal, mission) for goal, kind in zip(mission.goals, kinds, strict=True))
    if count > _MOST_COMPARED:
        raise InputError("goals-too-detailed", count=count, most=_MOST_COMPARED)
    return Attempt(mission, image, kinds)


class RunWatch:
    """Follows the goals of one run.

    Args:
        attempt: of whose runs it is one.
        times_ms: the moments of the run; grows with each.

    Attributes:
        run: what its goals share.
    """

    def __init__(self, attempt: Attempt, times_ms: list[int]) -> None:
        self.run = GoalRun(attempt, times_ms)
        for number, kind in enumerate(attempt.kinds):
            self.run.goals[number] = kind(number, self.run)
        # Those that look at another goal see a moment after it.
        self._in_order = sorted(self.run.goals.values(), key=lambda goal: goal.decided_by == "others")

    @property
    def is_over(self) -> bool:
        """Whether the run has reached the mission's duration."""
        times_ms = self.run.times_ms
        return bool(times_ms) and times_ms[-1] >= self.run.attempt.mission.duration_ms

    def show(self, moment: Moment, begun: Sequence[Event]) -> None:
        """Show the goals a moment, and the words begun since the one before it."""
        for goal in self._in_order:
            goal.see(moment, begun)

    def states(self) -> list[GoalState]:
        """How it stands with each goal, in the order of the file."""
        is_over = self.is_over
        return [goal.state(is_over) for goal in self.run.goals.values()]

    def grades(self) -> list[float]:
        """How near the run came to each goal, in the order of the file; exactly 1 where it is met."""
        is_over = self.is_over
        return [goal.grade(is_over) for goal in self.run.goals.values()]


class MissionWatch(RunWatch):
    """Follows one run of a mission by what it is shown.

    Call `see` with the moments at 0, EVERY_MS, 2 * EVERY_MS … up to the mission's duration. Moments may hold lists,
    arrays or any other sequences; positions are taken in single precision, as recordings and pages have them.

    Args:
        mission: whose goals to watch.
        image: the bytes that the leaders run.

    Raises MotorcadeError where the goals take too long.
    """

    def __init__(self, mission: Mission, image: bytes) -> None:
        super().__init__(attempt_of(mission, image), [])

    def see(self, moment: Moment, begun: Sequence[Event] = ()) -> None:
        """Take the next moment, and the events since the one before it in which cars begin words.

        Moments after the end, and a moment that is not later than the one before, change nothing.
        """
        times_ms = self.run.times_ms
        if self.is_over or (times_ms and moment.t_ms <= times_ms[-1]):
            return
        times_ms.append(moment.t_ms)
        plain = with_lists(moment)
        answers = self.run.answers
        questions = self.run.attempt.questions
        if questions.rows:
            answers.led[0][:] = plain.led
            answers.shown[0][:] = [*plain.x_m, *plain.y_m, *plain.heading, *plain.wheels]
            judging.judge_run(0, moment.t_ms, questions, answers)
        self.show(plain, begun)


class ManyRuns:
    """Follows runs side by side, each in a world of its own, while the worlds run.

    A watch sees the last moment alone; so sentences may name another moment than those of a `MissionWatch`, but who met
    what, and the grades, are the same.

    Args:
        world: the worlds, at the beginning of their run.
        attempts: of each world; all of the same mission.
        every_ms: how often the runs are judged.
    """

    def __init__(self, world: Simulation, attempts: Sequence[Attempt], every_ms: int = EVERY_MS) -> None:
        self._world = world
        self._attempts = attempts
        self._every_ms = every_ms
        memory = world.backend
        rows, figures, corners, who = attempts[0].questions
        self._questions = judging.Questions(
            rows=memory.allocate("Questions.rows", _table("int64", rows, judging.COLUMNS)),
            figures=memory.allocate("Questions.figures", _table("float64", figures, judging.FIGURES)),
            corners=memory.allocate("Questions.corners", Buffer.of("float64", corners)),
            who=memory.allocate("Questions.who", Buffer.of("int64", who)),
        )
        self.begin()

    def begin(self) -> None:
        """Follow runs from their beginning, after the worlds were reset."""
        self._times_ms: list[int] = []
        self._watches = [RunWatch(attempt, self._times_ms) for attempt in self._attempts]
        memory = self._world.backend
        first = self._attempts[0].no_answers()
        runs = len(self._attempts)
        arrays = {}
        for name, dtype in _ANSWERS.items():
            arrays[name] = memory.allocate(f"Answers.{name}", _table(dtype, getattr(first, name) * runs))
        self._answers = judging.Answers(**arrays)
        # Where nothing is asked, nothing interrupts the worlds.
        every_ms = self._every_ms if first.since[0] else 0
        self._world.ask(judging.Asked(every_ms, self._questions, self._answers))

    def end(self) -> list[RunWatch]:
        """Return the watches of the runs, which end now."""
        world = self._world
        world.judge()
        tick = 0
        while tick < world.tick:
            self._times_ms.append(tick * world.tick_ms)
            tick = judging.next_moment(tick, self._every_ms, world.tick_ms)
        self._times_ms.append(world.now_ms)
        found = {name: self._rows_of(getattr(self._answers, name)) for name in _ANSWERS}
        for number, watch in enumerate(self._watches):
            for name in ("off", "before", "since"):
                getattr(watch.run.answers, name)[0][:] = found[name][number]
            begun = begun_words(world, number) if watch.run.attempt.has_events else ()
            watch.show(self._last_moment(number, found["shown"][number]), begun)
        return self._watches

    def _last_moment(self, number: int, shown: list[float]) -> Moment:
        """What goals need of the last moment of a run."""
        count = self._world.cars
        x_m, y_m, heading, wheels = (shown[at * count : (at + 1) * count] for at in range(4))
        nothing: Any = dict.fromkeys(Moment._fields, ())
        given = {"t_ms": self._times_ms[-1], "counts": self._world.totals(number)}
        return Moment(**nothing | given | {"x_m": x_m, "y_m": y_m, "heading": heading, "wheels": wheels})

    def _rows_of(self, table: BackendArray) -> list[list[float]]:
        """The numbers of an array, for each run."""
        numbers = array(CODES[str(table.dtype)], self._world.backend.read(table)).tolist()
        size = len(numbers) // len(self._watches)
        return [numbers[at * size : (at + 1) * size] for at in range(len(self._watches))]


def _table(dtype: str, rows: Any, columns: int = 0) -> Buffer:
    """A buffer of rows, of which all are equally long; ``columns`` says how long where there are none."""
    numbers = [number for row in rows for number in row]
    if rows:
        columns = len(rows[0])
    table: Buffer = Buffer.of(dtype, numbers, columns, len(rows))
    return table


def with_lists(moment: Moment) -> Moment:
    """The moment with what goals need as lists, which are read faster than arrays and hold plain numbers."""
    is_array = (name for name in _COLUMNS if hasattr(getattr(moment, name), "tolist"))
    return moment._replace(**{name: getattr(moment, name).tolist() for name in is_array})


def goal_phrase(goal: Goal, mission: Mission) -> Phrase | Wording:
    """What a goal asks for: the author's text, or a description of it."""
    if goal.text is not None:
        return goal.text
    kind = GOALS[goal.kind]
    values = goal.values
    window = [name for name in ("from_s", "until_s") if name in values]
    details = {name: value for name, value in values.items() if name not in ("who", "zone", "share", "at", *window)}
    if "zone" in values:
        details["zone"] = mission.zone(values["zone"]).title
    if "goal" in values:
        details["goal"] = goal_phrase(mission.goals[values["goal"] - 1], mission)
    if "led" in values:
        details["led"] = lamp_name(values["led"])
    phrase = kind.asks(goal, details)
    is_the_only_car = values.get("who") == "all" and len(goal.cars) == 1
    if "who" in values and not is_the_only_car:
        phrase = Phrase("goal-of", goal=phrase, who=kind.who(goal))
    if not window:
        return phrase
    times = {name: values[name] for name in window}
    return Phrase("goal-" + "-".join(window), goal=phrase, **times)
