"""The JSON Schema of a project file, generated from the steps' own declarations, and its check."""

import json
from functools import cache
from typing import Any

import jsonschema_rs

from motorcade.program.diagnostics import Diagnostic, Phrase, error, phrase
from motorcade.program.steps import (
    KINDS,
    SECONDS,
    SHORTEST_DWELL_S,
    SIMPLE_KINDS,
    PirStep,
    RepeatStep,
    Step,
    TogetherStep,
    VoiceStep,
)

FORMAT = "motorcade-program/1"
# What may stand beside a program in its file, for the page alone.
BESIDE = {
    "mat": "The mat that it drives on, as docs/mats.md says.",
    "view": "Where the page's blocks stand, and comments on them.",
}
_ID = {"type": "string"}
_FLAG = {"type": "boolean"}


def program_schema() -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of ``*.motorcade.json``."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Motorcade program",
        "description": "What a leader car and its followers do.",
        "type": "object",
        "properties": {
            "format": {"enum": [FORMAT]},
            "profile": {"type": "string"},
            "leader": {"type": "array", "items": {"$ref": "#/$defs/leader_step"}},
            "followers": {
                "type": ["object", "null"],
                "properties": {
                    "accept_ir": _FLAG,
                    "forward": _FLAG,
                    "dwell_seconds": {**SECONDS, "minimum": SHORTEST_DWELL_S},
                    "steps": {"type": "array", "items": {"$ref": "#/$defs/follower_step"}},
                },
                "required": ["steps"],
                "additionalProperties": False,
            },
            **{name: {"type": "object", "description": what} for name, what in BESIDE.items()},
        },
        "required": ["format", "leader"],
        "additionalProperties": False,
        "$defs": {
            "leader_step": _step("leader_step", {"id": _ID, "accept_ir": _FLAG}),
            "follower_step": _step("follower_step", {"id": _ID, "accept_ir": _FLAG, "forward": _FLAG}),
            "part": _one_of_kinds({kind.kind: _fields_of(kind, inside=True) for kind in SIMPLE_KINDS}, {"id": _ID}),
        },
    }


def _step(name: str, common: dict[str, Any]) -> dict[str, Any]:
    kinds: dict[str, Any] = {kind.kind: _fields_of(kind, inside=False) for kind in SIMPLE_KINDS}
    kinds[TogetherStep.kind] = {"type": "array", "items": {"$ref": "#/$defs/part"}}
    repeat = _fields_of(RepeatStep, inside=False)
    repeat["properties"]["steps"] = {"type": "array", "items": {"$ref": f"#/$defs/{name}"}}
    repeat["required"].append("steps")
    kinds[RepeatStep.kind] = repeat
    return _one_of_kinds(kinds, common)


def _one_of_kinds(kinds: dict[str, Any], common: dict[str, Any]) -> dict[str, Any]:
    return {
        "type": "object",
        "properties": {**kinds, **common},
        "oneOf": [{"required": [kind]} for kind in kinds],
        "additionalProperties": False,
    }


def _fields_of(kind: type[Step], inside: bool) -> dict[str, Any]:
    """Schema of a step's own object; inside a together, voice and pir take their length from the others."""
    own = kind.own_schemas()
    if inside and kind in (VoiceStep, PirStep):
        own = {}
    return {"type": "object", "properties": own, "required": list(own), "additionalProperties": False}


@cache
def _validator() -> Any:
    return jsonschema_rs.validator_for(program_schema())


def check_shape(document: Any) -> list[Diagnostic]:
    """What in ``document`` (parsed JSON) doesn't fit the schema; empty where all fits."""
    validator = _validator()
    if validator.is_valid(document):
        return []
    found = []
    unknown_at = set()
    for problem in validator.iter_errors(document):
        place = tuple(problem.instance_path)
        if problem.kind.name == "additionalProperties":
            unknown_at.add(place)
        found.append((place, problem))
    diagnostics = []
    for place, problem in found:
        if problem.kind.name == "oneOf" and not isinstance(problem.instance, dict):
            continue
        if problem.kind.name == "oneOf" and place in unknown_at and not _kinds_in(problem.instance):
            continue
        diagnostics.extend(_diagnose(document, place, problem))
    return diagnostics


def path_text(place: tuple[str | int, ...]) -> str:
    """``("leader", 2, "drive")`` -> ``leader[2].drive``."""
    text = ""
    for part in place:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


def _diagnose(document: Any, place: tuple[str | int, ...], problem: Any) -> list[Diagnostic]:
    path, step_id = path_text(place), _id_at(document, place)
    kind = problem.kind.name
    schema = _schema_at(problem.schema_path[:-1])
    if kind == "additionalProperties":
        allowed: str | Phrase = ", ".join(schema["properties"]) or phrase("nothing")
        return [
            error("unknown-field", f"{path}.{name}".lstrip("."), step_id, name=name, allowed=allowed)
            for name in problem.kind.unexpected
        ]
    if kind == "required":
        return [error("missing-field", path, step_id, name=problem.kind.property)]
    if kind == "oneOf":
        present = _kinds_in(problem.instance)
        kinds = ", ".join(option["required"][0] for option in schema["oneOf"])
        if present:
            return [error("several-kinds", path, step_id, kinds=kinds, present=", ".join(present))]
        return [error("missing-field", path, step_id, name=phrase("one-kind", kinds=kinds))]
    return [error("out-of-range", path, step_id, value=_shown(_value_at(document, place)), allowed=_allowed(schema))]


def _kinds_in(step: Any) -> list[str]:
    return [key for key in step if key in KINDS]


def _value_at(document: Any, place: tuple[str | int, ...]) -> Any:
    """What stands at ``place``; the validator's own copy has lost numbers that are too large."""
    here = document
    for part in place:
        here = here[part]
    return here


def _id_at(document: Any, place: tuple[str | int, ...]) -> str | None:
    """The id of the innermost step around ``place``."""
    found, here = None, document
    for part in place:
        here = here[part]
        if isinstance(here, dict) and isinstance(here.get("id"), str):
            found = here["id"]
    return found


def _schema_at(schema_path: list[str | int]) -> Any:
    here: Any = program_schema()
    for part in schema_path:
        here = here[part]
        if isinstance(here, dict) and "$ref" in here:
            here = program_schema()["$defs"][here["$ref"].rpartition("/")[2]]
    return here


def _allowed(schema: dict[str, Any]) -> str | Phrase:
    if "enum" in schema:
        return ", ".join(schema["enum"])
    types = schema["type"]
    if types == "integer":
        return phrase("whole-range", minimum=schema["minimum"], maximum=schema["maximum"])
    if types == "number":
        return phrase("range", minimum=schema["minimum"], maximum=schema["maximum"])
    if isinstance(types, list):
        return phrase("object-or-null")
    return phrase({"array": "list"}.get(types, types))


def _shown(value: Any) -> str:
    """``value`` as a pupil would have typed it, shortened."""
    text = "{...}" if isinstance(value, dict) else json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 40 else text[:37] + "..."
