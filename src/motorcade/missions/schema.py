"""The schema of a mission's file: every key, what it is (its ``title``), what is allowed, and its default.

Each kind of goal is declared in GOALS; the watches in `motorcade.missions.goals` and `motorcade.missions.event_goals`
say when it is met.
"""

from functools import cache
from typing import Any, NamedTuple

from motorcade.config.check import Schema, allowed_as, choice, line, list_of, number, table, whole
from motorcade.locales import languages
from motorcade.mats.schema import FARTHEST_M, SHORTEST_M, mat_schema
from motorcade.program.model import program_schema
from motorcade.program.steps import KINDS

FORMAT = "motorcade-mission/1"
PATHS = ("first-drive", "swarm", "words-and-bits", "literature")
LEVELS = ("start", "words", "python")
EDITS = ("blocks", "bits")
GROUPS = ("leader", "followers", "all")
TIMES = ("end", "some-moment", "always")
STARS = 3
LONGEST_S = 600
# The kind of goal that other seeds decide.
WORKS = "works"
MOST_SEEDS = 10
_MOST_ZONES = 50
_MOST_GOALS = 30
_LONGEST_TEXT = 400
_MOST_HINTS = 5


class GoalKind(NamedTuple):
    """A kind of goal.

    Attributes:
        fields: the schema of each of its keys, beside ``kind`` and ``star``.
        optional: which of these may be left out though they have no default.
        one_of: keys of which at least one must be there; empty for none.
        is_static: the program alone decides it, not the run.
    """

    fields: dict[str, Schema]
    optional: tuple[str, ...] = ()
    one_of: tuple[str, ...] = ()
    is_static: bool = False


def _seconds(title: str, least: float = 0.1) -> Schema:
    return number(least, LONGEST_S, "seconds", title=title)


def _metres(title: str) -> Schema:
    return number(SHORTEST_M, FARTHEST_M, "metres", title=title)


def _at(first: str) -> Schema:
    return choice(*TIMES, title="when it must be so; at some-moment each car has a moment of its own", default=first)


_WHO: Schema = {
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
_SHARE = number(0.01, 1, title="the part of these cars that must", default=1)
_ZONE = line(40, title="the name of a zone")
_CARS = {"who": _WHO, "share": _SHARE}
_WINDOW = {"from_s": _seconds("moments before don't count", 0), "until_s": _seconds("moments after don't count", 0)}
_LEAST = number(0.01, 1_000_000, title="the score at least")
_APART = _metres("cars are linked that are nearer to each other") | {"default": 0.35}
_RADIUS = _metres("how far around it a car covers the zone") | {"default": 0.25}
_COUNT = whole(0, 255, title="how many at most")
_LED: Schema = {
    "title": "the number of an LED, or off: none is on",
    "type": ["integer", "string"],
    "minimum": 0,
    "maximum": 3,
    "pattern": "^off$",
    "x-allowed": ["mission-led", {}],
}

GOALS: dict[str, GoalKind] = {
    "in-zone": GoalKind({**_CARS, "zone": _ZONE, "at": _at("end"), **_WINDOW}, optional=(*_WINDOW,)),
    "out-of-zone": GoalKind({**_CARS, "zone": _ZONE, "at": _at("always"), **_WINDOW}, optional=(*_WINDOW,)),
    "travelled": GoalKind(
        {**_CARS, "least_m": _metres("how far at least"), "most_m": _metres("how far at most")},
        optional=("least_m", "most_m"),
        one_of=("least_m", "most_m"),
    ),
    "heading": GoalKind(
        {
            **_CARS,
            "degrees": number(-360, 360, "degrees", title="counter-clockwise from the x axis"),
            "tolerance_deg": number(1, 180, "degrees", title="how far off it may be", default=15),
            "at": _at("end"),
            **_WINDOW,
        },
        optional=(*_WINDOW,),
    ),
    "not-lit": GoalKind({**_CARS, "led": whole(0, 3, title="the number of an LED"), **_WINDOW}, optional=(*_WINDOW,)),
    "lit": GoalKind({**_CARS, "led": _LED, "at": _at("some-moment"), **_WINDOW}, optional=(*_WINDOW,)),
    "together": GoalKind(
        {"who": _WHO, "metres": _metres("the distance between any two of them at most"), "at": _at("end")}
    ),
    "in-step": GoalKind(
        {**_CARS, "within_ms": whole(1, 10_000, "milliseconds", title="how far apart they may begin a word")}
    ),
    "no-touch": GoalKind({}),
    "heard": GoalKind({"who": _WHO, "share": number(0.01, 1, title="the part of all words, car by car", default=1)}),
    "stopped-by-voice": GoalKind(_CARS),
    "words-at-most": GoalKind({"count": _COUNT}, is_static=True),
    "states-at-most": GoalKind({"count": _COUNT}, is_static=True),
    "seconds-at-most": GoalKind(
        {"seconds": _seconds("how long one round of the program lasts at most")}, is_static=True
    ),
    "gathered": GoalKind({"zone": _ZONE, "least": _LEAST}),
    "covered": GoalKind({"zone": _ZONE, "least": _LEAST}),
    "networked": GoalKind({"zone": _ZONE, "apart_m": _APART, "radius_m": _RADIUS, "least": _LEAST}),
    "stopped": GoalKind({"zone": _ZONE, "least": _LEAST}),
    "all-by": GoalKind(
        {"goal": whole(1, _MOST_GOALS, title="the number of another goal, from 1"), "seconds": _seconds("until when")}
    ),
    WORKS: GoalKind(
        {
            "share": number(
                0.01, 1, title="the part of these runs in which the first star's goals are met", default=0.9
            ),
            "seeds": whole(10, 200, title="on how many other seeds the program runs", default=100),
        }
    ),
}


@cache
def goal_schema(kind: str) -> Schema:
    """The schema of a goal of one kind."""
    known = GOALS[kind]
    common = {"kind": choice(*GOALS), "star": whole(1, STARS, title="which star it is for", default=1)}
    return table(("text", *known.optional), **common, text=_text("what the page says instead"), **known.fields)


@cache
def mission_schema() -> Schema:
    """The JSON Schema (draft 2020-12) of a mission in JSON, or in TOML after parsing.

    A goal has every key of every kind here; `goal_schema` has those of one kind.
    """
    fields = {name: part for kind in GOALS.values() for name, part in kind.fields.items()}
    keys = {name: {key: value for key, value in part.items() if key != "default"} for name, part in fields.items()}
    goal = table(("star", "text", *keys), **(goal_schema("no-touch")["properties"] | keys))
    goal["properties"] |= {"star": whole(1, STARS, title="which star it is for")}
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
            steps=list_of(choice(*KINDS), 1, len(KINDS), title="the kinds of steps that may be used", uniqueItems=True),
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
            goal=allowed_as("list-of-tables", list_of(goal, 1, _MOST_GOALS), name="goal"),
            start=program,
            solution=program,
            near_miss=program,
            notes=_notes(),
        ),
        "$defs": program_schema()["$defs"],
    }


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
        name=_ZONE,
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
