"""The JSON Schema of project files, made from the declarations of steps and conditions."""

from functools import cache

from motorcade.config.check import (
    Schema,
    choice,
    flag,
    table,
)
from motorcade.program.conditions import CONDITION, NAME, condition_schema
from motorcade.program.flow_steps import (
    FLOW_KINDS,
    IN_TURN,
    DoStep,
    IfStep,
    SetStep,
    TellStep,
)
from motorcade.program.steps import (
    COMMON,
    SECONDS,
    SHORTEST_DWELL_S,
    SIMPLE_KINDS,
    DrivingStep,
    RepeatStep,
    Step,
    TogetherStep,
    own_fields,
)

FORMAT = "motorcade-program/1"
# What may stand beside a program in its file, for the page alone.
BESIDE = {
    "mat": "The mat that it drives on; see docs/mats.md.",
    "view": "Where the page's blocks stand, and comments on them.",
}

PROFILE: Schema = {"type": "string", "default": "classroom"}
# The followers' settings; the compiler chooses those that have no default.
SETTINGS: dict[str, Schema] = {
    "accept_ir": flag(default=True),
    "forward": flag(default=False),
    "tagged": {"enum": [True, False, "auto"], "default": "auto"},
    "dwell_seconds": {**SECONDS, "minimum": SHORTEST_DWELL_S},
}


@cache
def program_schema() -> Schema:
    """Return the JSON Schema (draft 2020-12) of ``*.motorcade.json``, made from the steps' declarations."""
    follower_steps = {"type": "array", "items": {"$ref": "#/$defs/follower_step"}}
    followers = table(("dwell_seconds",), **SETTINGS, steps=follower_steps)
    leader_steps: Schema = {"type": "array", "items": {"$ref": "#/$defs/leader_step"}}
    functions = {"type": "object", "propertyNames": NAME, "additionalProperties": leader_steps, "default": {}}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Motorcade program",
        "description": "What a leader car and its followers do.",
        **table(
            tuple(BESIDE),
            format=choice(FORMAT),
            profile=PROFILE,
            leader=leader_steps,
            followers={**followers, "type": ["object", "null"], "default": None},
            functions=functions,
            **{name: {"type": "object", "description": what} for name, what in BESIDE.items()},
        ),
        "$defs": _definitions(),
    }


def _definitions() -> dict[str, Schema]:
    """Return the schemas of steps and conditions: those of a step that a condition ends need no seconds."""
    leader = {key: schema for key, schema in COMMON.items() if key != "forward"}
    ended = {**leader, "until": CONDITION}
    follower = _kinds() | {RepeatStep.kind: _fields_of(RepeatStep, more=_steps_of("follower_step"))}
    steps = _steps_of("leader_step")
    repeat = _fields_of(RepeatStep, more={**steps, "until": CONDITION})
    neither = {"not": {"anyOf": [{"required": ["times"]}, {"required": ["until"]}]}}
    repeat |= {"required": ["steps"], "oneOf": [{"required": ["times"]}, {"required": ["until"]}, neither]}
    deciding = {kind.kind: _fields_of(kind) for kind in FLOW_KINDS}
    deciding[SetStep.kind] |= {"required": ["counter"], "oneOf": [{"required": ["to"]}, {"required": ["random"]}]}
    lists = {"then": steps["steps"], "else": {**steps["steps"], "default": []}}
    deciding[IfStep.kind] = table(when=CONDITION, **lists)
    deciding[TellStep.kind] = table(step={"$ref": "#/$defs/told"})
    deciding[DoStep.kind] = NAME
    told = {kind.kind: _fields_of(kind) for kind in SIMPLE_KINDS}
    told[TogetherStep.kind] = _parts("part")
    return {
        "leader_step": {
            "if": {"required": ["until"]},
            "then": {"$ref": "#/$defs/ended_step"},
            "else": {"$ref": "#/$defs/timed_step"},
        },
        "timed_step": _one_of(_kinds() | {RepeatStep.kind: repeat} | deciding, leader),
        "ended_step": _one_of(_kinds(is_ended=True), ended),
        "follower_step": _one_of(follower, COMMON),
        "told": {
            "if": {"type": "string"},
            "then": {"$ref": "#/$defs/in_turn"},
            "else": {"$ref": "#/$defs/told_step"},
        },
        "in_turn": choice(IN_TURN),
        "told_step": _one_of(told, COMMON),
        "part": _one_of(_simple(inside=True), {"id": COMMON["id"]}),
        "ended_part": _one_of(_simple(inside=True, is_ended=True), {"id": COMMON["id"]}),
        "condition": condition_schema(),
    }


def _simple(inside: bool = False, is_ended: bool = False) -> dict[str, Schema]:
    """Return the schemas of the kinds of steps that hold no others."""
    kinds = {kind.kind: _fields_of(kind, inside=inside) for kind in SIMPLE_KINDS}
    if is_ended:
        for schema in kinds.values():
            schema["required"] = [name for name in schema["required"] if name != "seconds"]
    return kinds


def _kinds(is_ended: bool = False) -> dict[str, Schema]:
    """Return the schemas of the kinds of steps that take time."""
    return _simple(is_ended=is_ended) | {TogetherStep.kind: _parts("ended_part" if is_ended else "part")}


def _parts(name: str) -> Schema:
    return {"type": "array", "items": {"$ref": f"#/$defs/{name}"}}


def _steps_of(name: str) -> dict[str, Schema]:
    return {"steps": {"type": "array", "items": {"$ref": f"#/$defs/{name}"}}}


def _one_of(kinds: dict[str, Schema], common: dict[str, Schema]) -> Schema:
    return {
        "type": "object",
        "properties": {**kinds, **common},
        "oneOf": [{"required": [kind]} for kind in kinds],
        "additionalProperties": False,
    }


def _fields_of(kind: type[Step], inside: bool = False, more: dict[str, Schema] | None = None) -> Schema:
    """Return the schema of a step's own object; a step that accompanies others has no fields inside a together."""
    own = own_fields(kind)
    if inside and kind.accompanies:
        own = ()
    schemas = {own_field.name: own_field.metadata["schema"] for own_field in own} | (more or {})
    if issubclass(kind, DrivingStep):
        schemas["unless"] = CONDITION
    return table(("unless",), **schemas)
