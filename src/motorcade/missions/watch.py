"""Watch all goals of a mission while a run goes on, one moment after another; and say what each goal asks for."""

from collections.abc import Sequence
from typing import cast

from motorcade.engine.events import COLUMNS, KIND, START
from motorcade.engine.moment import Event, Moment
from motorcade.engine.simulation import Simulation
from motorcade.engine.slots import Slots
from motorcade.errors import MotorcadeError, Phrase
from motorcade.missions import event_goals, goals, scores
from motorcade.missions.goals import GoalState, GoalWatch
from motorcade.missions.model import Goal, Mission, Wording
from motorcade.words.image import Image, parse_image_bytes

# A run is watched every so many ms, beginning at 0.
EVERY_MS = scores.STEP_MS
# For each car sides of zones, and obstacles, that goals compare in a moment: some 20 ms.
_MOST_COMPARED = 20_000
# What watches need of a moment.
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


class MissionWatch:
    """Watches one run of a mission.

    Call `see` with the moments at 0, EVERY_MS, 2 * EVERY_MS … up to the mission's duration. Moments may hold lists,
    arrays or any other sequences; positions are taken in single precision, as recordings and pages have them.

    Args:
        mission: whose goals to watch.
        image: the bytes that the leaders run.

    Raises MotorcadeError where the goals take too long.
    """

    def __init__(self, mission: Mission, image: bytes) -> None:
        _check_work(mission)
        self._mission = mission
        parsed = parse_image_bytes(image)
        slots = Slots(parsed, mission.profile, mission.duration_ms)
        known: dict[str, scores.Score] = {}
        found = [
            None if goal.kind == "all-by" else watch_of(goal, mission, parsed, slots, known) for goal in mission.goals
        ]
        self._watches = [
            watch or _AllByWatch(goal, cast(GoalWatch, found[goal.values["goal"] - 1]))
            for goal, watch in zip(mission.goals, found, strict=True)
        ]
        # Those that look at another goal's watch see a moment after it.
        self._in_order = sorted(self._watches, key=lambda watch: isinstance(watch, _AllByWatch))
        self._now_ms, self._end_ms = -1, mission.duration_ms

    @property
    def sees_all(self) -> bool:
        """Whether its goals need every moment; else the last one is enough."""
        return any(watch.sees_all for watch in self._watches)

    @property
    def is_over(self) -> bool:
        """Whether the run has reached the mission's duration."""
        return self._now_ms >= self._end_ms

    def see(self, moment: Moment, begun: Sequence[Event] = ()) -> None:
        """Take the next moment, and the events since the one before it in which cars begin words.

        Moments after the end, and a moment that is not later than the one before, change nothing.
        """
        if self.is_over or moment.t_ms <= self._now_ms:
            return
        self._now_ms = moment.t_ms
        plain = with_lists(moment)
        for watch in self._in_order:
            watch.see(plain, begun)

    def states(self) -> list[GoalState]:
        """How it stands with each goal, in the order of the file."""
        return [watch.state(self.is_over) for watch in self._watches]

    def grades(self) -> list[float]:
        """How near the run came to each goal, in the order of the file; exactly 1 where it is met."""
        return [watch.grade(self.is_over) for watch in self._watches]


class _AllByWatch(GoalWatch):
    """A goal that another one is met by some time, and from then on to the end of the run.

    Args:
        other: the watch of the other goal.
    """

    def __init__(self, goal: Goal, other: GoalWatch) -> None:
        super().__init__()
        self._number, self._seconds = goal.values["goal"], goal.values["seconds"]
        self._by_ms = round(self._seconds * 1000)
        self._other = other
        # How the other goal stood last, at the time, and when it was lost again after it was met in time.
        self._before: GoalState | None = None
        self._then: GoalState | None = None
        self._gone: GoalState | None = None

    def see(self, moment: Moment, begun: Sequence[Event]) -> None:
        """Look at the other goal, which has seen this moment."""
        t_ms = moment.t_ms
        before, now = self._before, self._other.state(False)
        if before and before.progress == "holds" and now.progress == "open" and self._in_time(before):
            self._gone = now._replace(t_ms=t_ms)
        if t_ms <= self._by_ms:
            self._then = now._replace(t_ms=t_ms)
        self._before, self._now_ms = now, t_ms

    def _in_time(self, other: GoalState) -> bool:
        return other.t_ms is not None and other.t_ms <= self._by_ms

    def state(self, is_over: bool) -> GoalState:
        other = self._other.state(is_over)
        details = {"goal": self._number, "most": self._seconds}
        is_met = other.progress in ("met", "holds") and other.t_ms is not None
        why = Phrase("goal-all-by-not", **details)
        if is_met:
            why = Phrase("goal-all-by-when", seconds=(other.t_ms or 0) / 1000, **details)
            if self._in_time(other):
                return GoalState(other.progress, other.t_ms, why)
        elif not (is_over or self._now_ms > self._by_ms or other.progress == "lost"):
            return GoalState("open", None, why)
        # What is wrong is seen where the other goal was lost again, or else at the time itself.
        seen = self._gone or self._then or other
        if self._gone:
            why = Phrase("goal-all-by-gone", seconds=(self._gone.t_ms or 0) / 1000, reason=self._gone.why, **details)
        return GoalState("lost", seen.t_ms, why, seen.cars)

    def nearness(self) -> float:
        """Half the grade of the other goal, and more where that was met soon after the time."""
        other = self._other.state(True)
        is_late = other.progress in ("met", "holds") and other.t_ms is not None
        late = self._by_ms / (2 * max(other.t_ms or 0, self._by_ms + 1)) if is_late else 0.0
        return self._other.grade(True) / 2 + late


def _check_work(mission: Mission) -> None:
    mat = mission.mat
    sides = {zone.name: max(len(zone.corners), 1) for zone in mission.zones}
    things = len(mat.walls) + len(mat.discs) + sum(map(len, mat.polygons))
    count = sum(len(goal.cars) * sides[goal.values["zone"]] for goal in mission.goals if "zone" in goal.values)
    count += sum(len(mat.starts) * things for goal in mission.goals if goal.kind == "no-touch")
    if count > _MOST_COMPARED:
        raise MotorcadeError("goals-too-detailed", count=count, most=_MOST_COMPARED)


def watch_of(goal: Goal, mission: Mission, image: Image, slots: Slots, known: dict[str, scores.Score]) -> GoalWatch:
    """The watch of a goal of another kind than all-by. Goals for the same score share it in ``known``.

    Raises MotorcadeError where nothing judges goals of this kind.
    """
    match goal.kind:
        case "gathered" | "covered" | "networked" | "stopped":
            key = repr((goal.kind, goal.values | {"least": 0}))
            return scores.ScoreWatch(goal, known.setdefault(key, scores.score_of(goal, mission)))
        case "works":
            # The check tries other seeds.
            return goals.FixedWatch(GoalState("open", None, Phrase("goal-works-open")))
        case "travelled":
            return goals.TravelledWatch(goal)
        case "together":
            return goals.TogetherWatch(goal)
        case "no-touch":
            return event_goals.NoTouchWatch(mission)
        case "stopped-by-voice":
            return event_goals.VoiceWatch(goal, mission.mat)
        case "heard":
            return event_goals.HeardWatch(goal, mission, slots)
        case "in-step":
            return event_goals.InStepWatch(goal, mission, slots)
        case "words-at-most" | "states-at-most" | "seconds-at-most":
            return event_goals.static_watch(goal, image, mission.profile)
        case "in-zone" | "out-of-zone" | "heading" | "lit" | "not-lit":
            return goals.cars_watch(goal, mission)
    # A kind that is declared, and that nothing judges yet.
    raise MotorcadeError("goal-not-judged", kind=goal.kind)


def with_lists(moment: Moment) -> Moment:
    """The moment with what goals need as lists, which are read faster than arrays and hold plain numbers."""
    is_array = (name for name in _COLUMNS if hasattr(getattr(moment, name), "tolist"))
    return moment._replace(**{name: getattr(moment, name).tolist() for name in is_array})


def goal_phrase(goal: Goal, mission: Mission) -> Phrase | Wording:
    """What a goal asks for: the author's text, or a description of it."""
    if goal.text is not None:
        return goal.text
    window = [name for name in ("from_s", "until_s") if name in goal.values]
    if window:
        times = {name: goal.values[name] for name in window}
        return Phrase("goal-" + "-".join(window), goal=_whole_phrase(goal, mission), **times)
    return _whole_phrase(goal, mission)


def _whole_phrase(goal: Goal, mission: Mission) -> Phrase:
    """What a goal asks for, without its times."""
    details = {name: value for name, value in goal.values.items() if name not in ("who", "zone", "share", "at")}
    if "who" in goal.values:
        details["who"] = _who_phrase(goal)
    if "zone" in goal.values:
        details["zone"] = mission.zone(goal.values["zone"]).title
    if "led" in goal.values:
        details["led"] = goals.lamp_name(goal.values["led"])
    if goal.kind == "travelled":
        bounds = [name for name in ("least_m", "most_m") if name in goal.values]
        return Phrase("goal-travelled-" + "-".join(bounds), **details)
    if goal.kind == "lit":
        which = "off" if goal.values["led"] == "off" else "on"
        return Phrase(f"goal-lit-{which}-{goal.values['at']}", **details)
    if goal.kind == "works":
        return Phrase("goal-works", percent=goal.values["share"] * 100, count=goal.values["seeds"])
    if goal.kind == "heard":
        return Phrase("goal-heard", percent=goal.values["share"] * 100, **details)
    at = f"-{goal.values['at']}" if "at" in goal.values else ""
    return Phrase(f"goal-{goal.kind}{at}", **details)


def _who_phrase(goal: Goal) -> Phrase:
    who, count = goal.values["who"], len(goal.cars)
    if isinstance(who, list):
        name = Phrase("goal-who-cars" if count > 1 else "goal-who-one-car", cars=", ".join(map(str, who)))
    else:
        name = Phrase(f"goal-who-{who}", count=count) if count > 1 else Phrase(f"goal-who-one-{who}")
    needed = goals.needed_of(goal.values.get("share", 1), count)
    return Phrase("goal-who-some", needed=needed, who=name) if needed < count and goal.kind != "heard" else name
