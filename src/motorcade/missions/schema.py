"""The schema of a mission's file: every key, what it is (its ``title``), what is allowed, and its default.

The keys of a goal are declared by the class of its kind; see `motorcade.missions.goal`.
"""

from functools import cache
from typing import Any

from motorcade.config.check import Schema, allowed_as, choice, line, list_of, number, table, whole
from motorcade.locales import languages
from motorcade.mats.schema import mat_schema
from motorcade.missions import car_goals, event_goals, other_goals, score_goals
from motorcade.missions.goal import LONGEST_S, MOST_GOALS, ZONE, GoalKind
from motorcade.missions.model import LEVELS
from motorcade.program.flow_steps import ALL_KINDS
from motorcade.program.schema import program_schema

FORMAT = "motorcade-mission/1"
PATHS = ("first-drive", "swarm", "words-and-bits", "leader-decides", "literature")
EDITS = ("blocks", "bits")
STARS = 3
MOST_SEEDS = 10
_MOST_ZONES = 50
_LONGEST_TEXT = 400
_MOST_HINTS = 5
# All kinds of goals, in the order in which their classes are declared.
_DECLARED = [
    declared
    for module in (car_goals, event_goals, score_goals, other_goals)
    for declared in vars(module).values()
    if isinstance(declared, type) and issubclass(declared, GoalKind) and "name" in vars(declared)
]
GOALS: dict[str, type[GoalKind]] = {kind.name: kind for kind in _DECLARED}


@cache
def goal_schema(kind: str) -> Schema:
    """The schema of a goal of one kind."""
    known = GOALS[kind]
    common = {"kind": choice(*GOALS), "star": whole(1, STARS, title="which star it is for", default=1)}
    return table(("text", *known.optional), **common, text=_goal_text(), **known.fields)


@cache
def mission_schema() -> Schema:
    """The JSON Schema (draft 2020-12) of a mission in JSON, or in TOML after parsing.

    A goal has every key of every kind here; `goal_schema` has those of one kind.
    """
    fields = {name: part for kind in GOALS.values() for name, part in kind.fields.items()}
    keys = {name: {key: value for key, value in part.items() if key != "default"} for name, part in fields.items()}
    common = {"kind": choice(*GOALS), "star": whole(1, STARS, title="which star it is for"), "text": _goal_text()}
    goal = table(("star", "text", *keys), **common, **keys)
    program = _program()
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Motorcade mission",
        "description": "A task with goals that a run is checked against. Lengths are metres, angles are degrees "
        "counter-clockwise from the x axis.",
        **table(
            ("story", "learned", "steps", "start", "solution", "near_miss", "notes"),
            format=choice(FORMAT, title="the format of this file"),
            name=_text("the mission's name"),
            story=_text("what the pupil reads first, in two sentences"),
            hints=list_of(
                _text("a hint"), 0, _MOST_HINTS, title="shown one after another, after two tries", default=[]
            ),
            learned=_text("what the pupil has learned, in one sentence"),
            path=choice(*PATHS, title="the path that it belongs to", default=PATHS[0]),
            order=whole(1, 1000, title="its place on the path", default=1000),
            level=choice(*LEVELS, title="what the page shows", default=LEVELS[0]),
            edits=choice(*EDITS, title="what the pupil changes", default=EDITS[0]),
            steps=list_of(
                choice(*ALL_KINDS), 1, len(ALL_KINDS), title="the kinds of steps that may be used", uniqueItems=True
            ),
            profile=line(100, title="the kind of cars", default="classroom"),
            seconds=number(1, LONGEST_S, "seconds", title="how long a run lasts", default=30),
            seeds=list_of(
                whole(0, (1 << 32) - 1),
                1,
                MOST_SEEDS,
                title="each goal must be met on every seed",
                uniqueItems=True,
                default=[0, 1, 2],
            ),
            mat=_mat(),
            zone=allowed_as("list-of-tables", list_of(_zone(), 0, _MOST_ZONES, default=[]), name="zone"),
            goal=allowed_as("list-of-tables", list_of(goal, 1, MOST_GOALS), name="goal"),
            start=program,
            solution=program,
            near_miss=program,
            notes=_notes(),
        ),
        "$defs": program_schema()["$defs"],
    }


def _goal_text() -> Schema:
    return _text("what the page says instead")


def _text(title: str) -> Schema:
    """A text in each language, or one for all of them."""
    text = line(_LONGEST_TEXT)
    return {
        "title": title,
        "type": ["string", "object"],
        **{key: value for key, value in text.items() if key != "type"},
        "properties": dict.fromkeys(languages(), text),
        "additionalProperties": False,
        "x-allowed": ["mission-text", {"most": _LONGEST_TEXT, "languages": ", ".join(languages())}],
    }


def _notes() -> Schema:
    mistake = table(
        ("hint",),
        text=_text("what goes wrong, and why"),
        hint=whole(1, _MOST_HINTS, title="the number of the hint that helps, from 1"),
    )
    return table(
        minutes=whole(1, 240, title="how long a class needs"),
        aim=_text("what pupils can do afterwards"),
        say=_text("what to say first"),
        mistakes=list_of(mistake, 0, 5, title="the usual mistakes", default=[]),
        further=_text("a way to go on"),
    ) | {"title": "what a teacher reads"}


def _mat() -> Schema:
    whole_file = mat_schema()
    properties = {key: part for key, part in whole_file["properties"].items() if key not in ("format", "name")}
    return table(("size_m",), **properties)


def _zone() -> Schema:
    mat = mat_schema()["properties"]
    corners = mat["polygon"]["items"]["properties"]["corners_m"]
    disc = mat["disc"]["items"]["properties"]
    area = table(
        ("title", "corners_m", "centre_m", "radius_m"),
        name=ZONE,
        title=_text("what the page and sentences call it"),
        corners_m=corners | {"title": "its corners, in order"},
        centre_m=disc["centre_m"] | {"title": "the centre of a round zone"},
        radius_m=disc["radius_m"] | {"title": "the radius of a round zone"},
    )
    pair = {"centre_m": ["radius_m"], "radius_m": ["centre_m"]}
    return area | {"oneOf": [{"required": ["corners_m"]}, {"required": ["centre_m"]}], "dependentRequired": pair}


def _program() -> Schema:
    """A program as in a project file, whose format may be left out; or ``program``, the name of such a file."""
    whole_file = program_schema()
    properties: dict[str, Any] = {
        key: part for key, part in whole_file["properties"].items() if key not in ("mat", "view", "profile")
    }
    properties["program"] = line(1000, title="a project file beside this one")
    return table(("format", "leader", "followers", "program"), **properties) | {
        "oneOf": [{"required": ["leader"]}, {"required": ["program"]}]
    }
