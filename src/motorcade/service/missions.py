"""Missions for the page: the list with an owner's stars, one with its mat and goals, and the check of a program."""

import json
from collections.abc import Mapping

from msgspec import Struct

from motorcade.errors import MotorcadeError
from motorcade.missions import document as documents
from motorcade.missions.check import STEPS, GoalResult, Play, check_program, simulate
from motorcade.missions.document import OWN, built_in_mission, mission_of, parse_mission
from motorcade.missions.watch import goal_phrase
from motorcade.program.blocks import blocks_of, program_of
from motorcade.program.compiler import compile_program
from motorcade.program.model import Followers, Program
from motorcade.service.messages import (
    MatDocument,
    MissionChoice,
    MissionDocument,
    Sentence,
    Text,
    WorkspaceState,
    sentences,
)

# The stars of an owner: of each mission's id those that were earned.
Stars = Mapping[str, list[int]]


class MissionZone(Struct):
    """A zone: ``corners_m``, or a disc. ``name`` is its name in the file, ``title`` what people read."""

    name: str
    title: Sentence
    corners_m: list[list[float]]
    centre_m: list[float] | None
    radius_m: float | None


class MissionEntry(Struct):
    """A mission in the map: ``stars`` are those that it has, ``earned`` those that the user has earned."""

    id: str
    name: Sentence
    path: str
    order: int
    stars: list[int]
    earned: list[int]
    mat: MatDocument
    zones: list[MissionZone]


class MissionGoal(Struct):
    """A goal, as the page tells it."""

    kind: str
    star: int
    text: Sentence


class Mission(Struct):
    """All that the page needs to play a mission.

    Attributes:
        edits: "blocks", or "bits" of the words.
        steps: the kinds of steps whose blocks are offered.
        seed: the seed that the page plays with first.
        leader, followers: the blocks that the user begins with.
        document: what the file holds.
    """

    id: str
    name: Sentence
    story: Sentence
    hints: list[Sentence]
    learned: Sentence
    path: str
    order: int
    level: str
    edits: str
    steps: list[str]
    seconds: float
    seed: int
    profile: str
    mat: MatDocument
    zones: list[MissionZone]
    goals: list[MissionGoal]
    leader: WorkspaceState
    followers: WorkspaceState | None
    earned: list[int]
    document: MissionDocument


class MissionAttempt(Struct):
    """The blocks that a mission is to be checked with."""

    mission: MissionChoice
    leader: WorkspaceState
    followers: WorkspaceState | None = None


class MissionToSave(Struct):
    """A mission of the user's own, and its name in the library."""

    name: str
    document: MissionDocument


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
    """What a program earned, and all that the user has earned; ``steps``: why its kinds of blocks are not allowed."""

    stars: list[int]
    earned: list[int]
    goals: list[CheckedGoal]
    steps: Sentence | None


def chosen_mission(choice: MissionChoice) -> documents.Mission:
    """Return the mission of a choice. Raises MotorcadeError where there is none, or its document isn't valid."""
    return mission_of(choice.document, OWN) if choice.document is not None else built_in_mission(choice.id)


def list_missions(stars: Stars) -> list[MissionEntry]:
    """Return the missions that come with Motorcade, path by path and in order."""
    return [
        MissionEntry(
            id=each.id,
            name=each.name.texts,
            path=each.document["path"],
            order=each.document["order"],
            stars=_stars_in(each),
            earned=stars.get(each.id, []),
            mat=each.mat_document,
            zones=mission_zones(each),
        )
        for each in documents.missions()
    ]


def open_mission(choice: MissionChoice, stars: Stars) -> Mission:
    """Return all of a mission. Raises MotorcadeError."""
    mission = chosen_mission(choice)
    document = mission.document
    start = mission.start or Program([], Followers([]) if _has_followers(mission) else None, document["profile"])
    leader, followers = blocks_of(start)
    return Mission(
        id=mission.id,
        name=mission.name.texts,
        story=mission.story.texts,
        hints=[hint.texts for hint in mission.hints],
        learned=mission.learned.texts,
        path=document["path"],
        order=document["order"],
        level=document["level"],
        edits=document["edits"],
        steps=mission.palette,
        seconds=document["seconds"],
        seed=mission.seeds[0],
        profile=document["profile"],
        mat=mission.mat_document,
        zones=mission_zones(mission),
        goals=mission_goals(mission),
        leader=leader,
        followers=followers,
        earned=stars.get(mission.id, []),
        document=document,
    )


def open_mission_text(file: Text) -> Mission:
    """Return the mission in a file's text, TOML or JSON. Raises MotorcadeError, which names the place of a fault."""
    if "motorcade-mission" not in file.text:
        raise MotorcadeError("not-a-mission")
    kind = "JSON" if file.text.lstrip("\ufeff \t\r\n").startswith("{") else "TOML"
    parsed = parse_mission(file.text, OWN, kind)  # type: ignore[arg-type]
    return open_mission(MissionChoice(document=parsed.document), {})


def mission_text(choice: MissionChoice) -> Text:
    """Return the text of a mission's file. Raises MotorcadeError where the document isn't valid."""
    return Text(json.dumps(chosen_mission(choice).document, indent=1, ensure_ascii=False) + "\n")


def check_attempt(attempt: MissionAttempt, play: Play | None) -> MissionResult:
    """Check the blocks on all seeds of the mission. Raises ProgramError where they make no program."""
    mission = chosen_mission(attempt.mission)
    program = program_of(attempt.leader, attempt.followers, mission.document["profile"])
    result = check_program(mission, program, play)
    steps = next((each for each in result.goals if each.kind == STEPS), None)
    return MissionResult(
        stars=sorted(result.stars),
        earned=[],
        goals=[_checked(goal) for goal in result.goals if goal.kind != STEPS],
        steps=None if steps is None or steps.met else sentences(steps.why),
    )


def warm_up() -> None:
    """Load the engine and the missions, so that the first check takes no longer than others."""
    mission = documents.missions()[0]
    next(iter(simulate(mission, compile_program(mission.start or Program([]), mission.profile).image)))


def _checked(goal: GoalResult) -> CheckedGoal:
    return CheckedGoal(goal.kind, goal.star, goal.met, goal.seed, goal.t_ms, sentences(goal.why), list(goal.cars))


def _stars_in(mission: documents.Mission) -> list[int]:
    return sorted({goal.star for goal in mission.goals})


def _has_followers(mission: documents.Mission) -> bool:
    return len(mission.mat.starts.leaders) < len(mission.mat.starts)


def mission_goals(mission: documents.Mission) -> list[MissionGoal]:
    """The goals of a mission, as pages tell them."""
    return [MissionGoal(goal.kind, goal.star, sentences(goal_phrase(goal, mission))) for goal in mission.goals]


def mission_zones(mission: documents.Mission) -> list[MissionZone]:
    """The zones of a mission, as pages draw them."""
    return [
        MissionZone(zone.name, zone.title.texts, [[x, y] for x, y in zone.corners], None, None)
        if zone.corners
        else MissionZone(zone.name, zone.title.texts, [], [*zone.disc[:2]], zone.disc[2])
        for zone in mission.zones
    ]
