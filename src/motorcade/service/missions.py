"""Missions for the page: the list with an owner's stars, one with its mat and goals, and the check of a program."""

import json
from bisect import bisect_right
from collections.abc import Mapping
from typing import Any

from msgspec import Struct

from motorcade.engine.events import START
from motorcade.engine.moment import to_moment, unpack_events
from motorcade.errors import MotorcadeError
from motorcade.missions import document as documents
from motorcade.missions import model
from motorcade.missions.check import STEPS, check_program, open_worlds_here, usual_mistake, watched
from motorcade.missions.document import OWN, built_in_mission, mission_of, parse_mission
from motorcade.missions.goal import GoalState
from motorcade.missions.odds import OpenWorlds
from motorcade.missions.schema import GOALS
from motorcade.missions.watch import MissionWatch, goal_phrase
from motorcade.program.blocks import blocks_of
from motorcade.program.blocks_reader import program_of
from motorcade.program.compiler import compile_program
from motorcade.program.model import Followers, Program
from motorcade.program.reactions import minding
from motorcade.service.documents import text_format
from motorcade.service.messages import (
    MatDocument,
    MissionChoice,
    MissionDocument,
    Sentence,
    Text,
    WorkspaceState,
    sentences,
)
from motorcade.service.world_messages import GoalNow, Goals

# The stars of an owner: of each mission's id those that were earned.
Stars = Mapping[str, list[int]]


class MissionZone(Struct):
    """A zone: ``corners_m``, or a disc. ``name`` is its name in the file, ``title`` what people read.

    ``avoid`` says that a goal keeps cars out of it for the whole run.
    """

    name: str
    title: Sentence
    corners_m: list[list[float]]
    centre_m: list[float] | None
    radius_m: float | None
    avoid: bool = False


class _ShownMission(Struct, kw_only=True):
    id: str
    name: Sentence
    path: str
    order: int
    mat: MatDocument
    zones: list[MissionZone]


class MissionEntry(_ShownMission, kw_only=True):
    """A mission in the map.

    Attributes:
        stars: those that it has.
        earned: those that the user has earned.
        minutes: how long it takes a class, by its notes; None where it has none.
    """

    stars: list[int]
    earned: list[int]
    minutes: int | None


class MissionGoal(Struct):
    """A goal, as the page tells it."""

    kind: str
    star: int
    text: Sentence


class _ToldMission(_ShownMission, kw_only=True):
    """What everybody is told of a mission.

    Attributes:
        steps: the kinds of steps whose blocks are offered.
    """

    story: Sentence
    hints: list[Sentence]
    learned: Sentence
    level: str
    steps: list[str]
    goals: list[MissionGoal]


class Mission(_ToldMission, kw_only=True):
    """All that the page needs to play a mission.

    Attributes:
        edits: "blocks", or "bits" of the words.
        seed: the seed that the page plays with first.
        next: the id of the mission after this one on its path; "" where it is the last, or on no path.
        leader, followers: the blocks that the user begins with.
        document: what the file holds.
    """

    edits: str
    seconds: float
    seed: int
    next: str
    profile: str
    leader: WorkspaceState
    followers: WorkspaceState | None
    earned: list[int]
    document: MissionDocument


class NotedMistake(Struct):
    """A usual mistake, and the hint that helps."""

    text: Sentence
    hint: Sentence | None


class MissionNotes(_ToldMission, kw_only=True):
    """A mission for a teacher; what a mission without notes says nothing of is None.

    Attributes:
        further: a way to go on.
    """

    minutes: int | None
    aim: Sentence | None
    say: Sentence | None
    mistakes: list[NotedMistake]
    further: Sentence | None


class MissionAttempt(Struct):
    """The blocks that a mission is to be checked with."""

    mission: MissionChoice
    leader: WorkspaceState
    followers: WorkspaceState | None = None


class CheckedGoal(Struct):
    """The result of a goal on all seeds: met, or why it was lost on the first seed on which it was.

    ``t_ms`` is the moment that shows it, and ``cars`` are the cars that ``why`` is about.
    """

    kind: str
    star: int
    met: bool
    seed: int
    t_ms: int
    why: Sentence
    cars: list[int]


class MissionResult(Struct):
    """What a program earned, and all that the user has earned.

    Attributes:
        steps: why its kinds of blocks are not allowed.
        mistake: the usual mistake that it makes, where it is one that the mission's notes know.
    """

    stars: list[int]
    earned: list[int]
    goals: list[CheckedGoal]
    steps: Sentence | None
    mistake: Sentence | None


def chosen_mission(choice: MissionChoice) -> model.Mission:
    """Return the mission of a choice. Raises MotorcadeError where there is none, or its document isn't valid."""
    if choice.document is not None:
        return mission_of(choice.document, OWN)
    return built_in_mission(choice.id)


def list_missions(stars: Stars) -> list[MissionEntry]:
    """Return the missions that come with Motorcade, path by path and in order."""
    entries = []
    for mission in documents.missions():
        possible = sorted({goal.star for goal in mission.goals})
        entry = MissionEntry(**_shown(mission), stars=possible, earned=stars.get(mission.id, []), minutes=None)
        if mission.notes:
            entry.minutes = mission.notes.minutes
        entries.append(entry)
    return entries


def open_mission(choice: MissionChoice, stars: Stars) -> Mission:
    """Return all of a mission. Raises MotorcadeError."""
    mission = chosen_mission(choice)
    document = mission.document
    has_followers = len(mission.mat.starts.leaders) < len(mission.mat.starts)
    start = mission.start or Program([], Followers([]) if has_followers else None, document["profile"])
    leader, followers = blocks_of(minding(start))
    return Mission(
        **_told(mission),
        edits=document["edits"],
        seconds=document["seconds"],
        seed=mission.seeds[0],
        next=_next_of(mission),
        profile=document["profile"],
        leader=leader,
        followers=followers,
        earned=stars.get(mission.id, []),
        document=document,
    )


def mission_notes(choice: MissionChoice) -> MissionNotes:
    """Return what a teacher reads of a mission. Raises MotorcadeError."""
    mission = chosen_mission(choice)
    notes = mission.notes
    if notes is None:
        return MissionNotes(**_told(mission), minutes=None, aim=None, say=None, mistakes=[], further=None)
    mistakes = []
    for text, hint in notes.mistakes:
        noted = NotedMistake(text.texts, None)
        if hint is not None:
            noted.hint = mission.hints[hint - 1].texts
        mistakes.append(noted)
    return MissionNotes(
        **_told(mission),
        minutes=notes.minutes,
        aim=notes.aim.texts,
        say=notes.say.texts,
        mistakes=mistakes,
        further=notes.further.texts,
    )


def _shown(mission: model.Mission) -> dict[str, Any]:
    """Return the fields of `_ShownMission`."""
    return {
        "id": mission.id,
        "name": mission.name.texts,
        "path": mission.document["path"],
        "order": mission.document["order"],
        "mat": mission.mat_document,
        "zones": mission_zones(mission),
    }


def _told(mission: model.Mission) -> dict[str, Any]:
    """Return the fields of `_ToldMission`."""
    return {
        **_shown(mission),
        "story": mission.story.texts,
        "hints": [hint.texts for hint in mission.hints],
        "learned": mission.learned.texts,
        "level": mission.document["level"],
        "steps": mission.palette,
        "goals": mission_goals(mission),
    }


def mission_in(text: str) -> model.Mission:
    """Return the mission in a file's text, TOML or JSON. Raises MotorcadeError, which names the place of a fault."""
    if "motorcade-mission" not in text:
        raise MotorcadeError("not-a-mission")
    return parse_mission(text, OWN, text_format(text))


def open_mission_text(text: str) -> Mission:
    """Return what the page shows of the mission in a file's text. Raises MotorcadeError as `mission_in`."""
    return open_mission(MissionChoice(document=mission_in(text).document), {})


def mission_text(choice: MissionChoice) -> Text:
    """Return the text of a mission's file. Raises MotorcadeError where the document isn't valid."""
    return Text(json.dumps(chosen_mission(choice).document, indent=1, ensure_ascii=False) + "\n")


def check_attempt(attempt: MissionAttempt, open_worlds: OpenWorlds) -> MissionResult:
    """Check the blocks on all seeds of the mission. Raises ProgramError where they make no program."""
    mission = chosen_mission(attempt.mission)
    program = program_of(attempt.leader, attempt.followers, mission.document["profile"])
    result = check_program(mission, program, open_worlds)
    too_long = next((goal for goal in result.goals if goal.kind == STEPS and not goal.met), None)
    goals = [goal for goal in result.goals if goal.kind != STEPS]
    shown = (min((goals[number] for number in together), key=lambda goal: goal.met) for together in _as_told(mission))
    number = usual_mistake(mission, result, program)
    mistake = None
    if number is not None and mission.notes:
        mistake = mission.notes.mistakes[number][0].texts
    return MissionResult(
        stars=sorted(result.stars),
        earned=[],
        goals=[
            CheckedGoal(goal.kind, goal.star, goal.met, goal.seed, goal.t_ms, sentences(goal.why), list(goal.cars))
            for goal in shown
        ],
        steps=too_long and sentences(too_long.why),
        mistake=mistake,
    )


def warm_up() -> None:
    """Load the engine and the missions, so that the first check takes no longer than others."""
    mission = documents.missions()[0]
    image = compile_program(mission.start or Program([]), mission.profile).image
    next(watched(open_worlds_here(mission.mat, [image], mission.profile, mission.seeds, True), mission))


def mission_goals(mission: model.Mission) -> list[MissionGoal]:
    """The goals of a mission, as pages tell them."""
    goals = (mission.goals[together[0]] for together in _as_told(mission))
    return [MissionGoal(goal.kind, goal.star, sentences(goal_phrase(goal, mission))) for goal in goals]


def _as_told(mission: model.Mission) -> list[list[int]]:
    """The numbers of the goals that pages tell as one: those in a row with the same text of the author's."""
    told: list[list[int]] = []
    before = None
    for number, goal in enumerate(mission.goals):
        if goal.text is not None and before is not None and (goal.text, goal.star) == (before.text, before.star):
            told[-1].append(number)
        else:
            told.append([number])
        before = goal
    return told


def _next_of(mission: model.Mission) -> str:
    """The id of the mission after this one on its path, or ""."""
    document = mission.document
    if mission.id == OWN:
        return ""
    places = {(other.document["path"], other.document["order"]): other.id for other in documents.missions()}
    return places.get((document["path"], document["order"] + 1), "")


def mission_zones(mission: model.Mission) -> list[MissionZone]:
    """The zones of a mission, as pages draw them."""
    avoided = {GOALS[goal.kind].forbidden_zone(goal) for goal in mission.goals}
    zones = []
    for zone in mission.zones:
        corners = [[x, y] for x, y in zone.corners]
        centre = None
        radius = None
        if not corners:
            x, y, radius = zone.disc
            centre = [x, y]
        zones.append(MissionZone(zone.name, zone.title.texts, corners, centre, radius, zone.name in avoided))
    return zones


def _how_well(state: GoalState) -> int:
    """Sorts how it stands with goals, the worst first."""
    return ("lost", "open", "holds", "met").index(state.progress)


class Referee:
    """Watches the goals of one mission, from the beginning of each run.

    Args:
        mission: whose goals.
        image: the bytes that the leaders run.
    """

    def __init__(self, mission: model.Mission, image: bytes) -> None:
        self.mission = mission
        self._image = image
        self.restart()

    def restart(self) -> None:
        """Watch a new run."""
        self._watch = MissionWatch(self.mission, self._image)
        # How it stood from which time on; a time is here only where something was new.
        self._times: list[int] = []
        self._states: list[list[GoalState]] = []

    @property
    def is_over(self) -> bool:
        """Whether the run has reached the mission's end."""
        return self._watch.is_over

    def see(self, t_ms: int, moment: bytes, events: bytes, touching_ms: int) -> None:
        """Take a stored moment and the rows of events since the one before, as `motorcade.service.history` has them."""
        if self.is_over:
            return
        begun = [event for event in unpack_events(events) if event.kind == START]
        shown = to_moment(t_ms, moment, len(self.mission.mat.starts), {"touching_ms": touching_ms})
        self._watch.see(shown, begun)
        found = self._watch.states()
        states = [min((found[goal] for goal in together), key=_how_well) for together in _as_told(self.mission)]
        if not t_ms:
            # Nobody has earned anything before a car drives.
            states = [state._replace(progress="open", t_ms=None) for state in states]
        if not self._states or states != self._states[-1]:
            self._times.append(t_ms)
            self._states.append(states)

    def goals(self, shown_ms: int | None) -> Goals:
        """How it stood with the goals at a stored time; None: now."""
        if shown_ms is None:
            at = len(self._times)
        else:
            at = bisect_right(self._times, shown_ms)
        states = []
        if self._states:
            states = self._states[max(at - 1, 0)]
        is_last = at == len(self._times)
        return Goals(
            is_over=self.is_over and is_last,
            goals=[GoalNow(state.progress, state.t_ms, sentences(state.why), list(state.cars)) for state in states],
        )
