"""The check of a parsed file against the schema of a mat, and the defaults of what isn't in it."""

import json
from functools import cache
from typing import Any

import jsonschema_rs

from motorcade.engine.errors import MatError
from motorcade.mats.allowed import allowed
from motorcade.mats.schema import Schema, mat_schema

Place = tuple[str | int, ...]
_DEEPEST = 8
_LARGEST = 1e15
_VERY_LONG = {"en": "a very long number", "zh": "一个很长的数"}
_A_TABLE = {"en": "a table", "zh": "表"}


@cache
def _schema_and_validator() -> tuple[Schema, Any]:
    schema = mat_schema()
    return schema, jsonschema_rs.validator_for(schema)


def check_shape(document: Any, mat: str) -> None:
    """Raises MatError, about the mat called ``mat``, where ``document`` doesn't fit the schema."""
    _check_values(document, mat)
    schema, validator = _schema_and_validator()
    if validator.is_valid(document):
        return
    # A misspelt key comes first: it also makes its right spelling missing.
    problem = min(
        validator.iter_errors(document),
        key=lambda each: (each.kind.name != "additionalProperties", list(each.instance_path)),
    )
    place = tuple(problem.instance_path)
    owner = _schema_of(schema, place)
    if problem.kind.name == "additionalProperties":
        known = ", ".join(owner["properties"])
        unknown = _text((*place, min(problem.kind.unexpected)))
        raise MatError("unknown-key", mat=mat, place=unknown, known=known)
    if problem.kind.name == "required":
        missing = problem.kind.property
        part = owner["properties"][missing]
        figures = {"place": _text((*place, missing)), "title": part["title"], "allowed": allowed(part)}
        raise MatError("missing-key", mat=mat, **figures)
    value = _shown(_value_at(document, place))
    raise MatError("not-allowed", mat=mat, place=_text(place), value=value, allowed=allowed(owner))


def filled(document: dict[str, Any], schema: Schema | None = None) -> dict[str, Any]:
    """``document``, which fits the schema, with the default of each key that isn't there and has one."""
    result = {}
    for name, part in (schema or _schema_and_validator()[0])["properties"].items():
        if name not in document and "default" not in part:
            continue
        value = document.get(name, part.get("default"))
        if part.get("type") == "object":
            value = filled(value, part)
        elif part.get("items", {}).get("type") == "object":
            value = [filled(each, part["items"]) for each in value]
        result[name] = value
    return result


def _check_values(document: Any, mat: str) -> None:
    """Refuse what no schema can: numbers that aren't, dates, broken text, and nesting without end."""
    waiting: list[tuple[Place, Any]] = [((), document)]
    while waiting:
        place, value = waiting.pop()
        if isinstance(value, dict | list | tuple):
            if len(place) >= _DEEPEST:
                raise MatError("nested-too-deep", mat=mat, place=_text(place))
            waiting.extend(
                ((*place, key), value[key]) for key in (value if isinstance(value, dict) else range(len(value)))
            )
        elif isinstance(value, int | float):
            if not abs(value) <= _LARGEST:
                shown = value if isinstance(value, float) else _VERY_LONG
                raise MatError("unusual-number", mat=mat, place=_text(place), value=shown)
        elif not isinstance(value, str | None):
            raise MatError("unusual-value", mat=mat, place=_text(place), value=value)
        for text in (value, *place[-1:]):
            if isinstance(text, str) and not text.isprintable():
                raise MatError("unprintable", mat=mat, place=_text(place))


def _text(place: Place) -> str | dict[str, str]:
    """``("wall", 2, "to_m")`` -> ``wall[2].to_m``; the whole document has a name in each language."""
    text = ""
    for part in place:
        shown = part if isinstance(part, int) or (part.isprintable() and len(part) <= 40) else ascii(part[:40])
        text += f"[{shown}]" if isinstance(part, int) else f".{shown}" if text else str(shown)
    return text or {"en": "the whole of it", "zh": "整个场地"}


def _schema_of(schema: Schema, place: Place) -> Schema:
    """The schema of what stands at ``place``, or of the nearest around it that says what is allowed."""
    found = here = schema
    for part in place:
        if isinstance(part, int):
            first = here.get("prefixItems", ())
            here = first[part] if part < len(first) else here.get("items", {})
        else:
            here = here["properties"][part]
        if "description" in here:
            found = here
    return found


def _value_at(document: Any, place: Place) -> Any:
    for part in place:
        document = document[part]
    return document


def _shown(value: Any) -> str | dict[str, str]:
    """``value`` as it might stand in the file, shortened."""
    if isinstance(value, dict):
        return _A_TABLE
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 40 else text[:37] + "..."
