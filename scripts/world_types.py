"""Write what a world is made of as TypeScript: the text of world.ts in web/src/generated/."""

import json
import struct
from itertools import accumulate
from typing import Any

from scripts.typescript import constant

from motorcade.car.brain import NO_LED
from motorcade.config.check import Schema
from motorcade.devices.declaration import Column
from motorcade.engine import moment
from motorcade.engine.events import KINDS, LOSS_REASONS
from motorcade.mats.schema import FLOORS, THINGS, mat_schema
from motorcade.service import history

_HEAD = """/** Mats and pictures of worlds. Written by scripts/generate.py; don't edit. */

import type { MatDocument } from "./messages";

export type Point = readonly [number, number];
"""
_ARRAYS = {"float32": "Float32Array", "uint16": "Uint16Array", "uint8": "Uint8Array"}
_EVENT = {"tMs": 0, "car": 1, "kind": 2, "word": 3, "other": 4}


def world_types() -> str:
    """Return the text of world.ts."""
    properties = mat_schema()["properties"]
    lists = {key: value["items"] for key, value in properties.items() if _holds_tables(value)}
    fields = {
        key: f"readonly {key.capitalize()}[]" if key in lists else "FloorName" if key == "floor" else _type(value)
        for key, value in properties.items()
        if key not in ("format", "name")
    }
    mat = [f"  {key}?: {kind};" for key, kind in fields.items()]
    # A voice has no body that could be drawn.
    placed = [each for each in THINGS if each.shape != "speech"]
    return "\n".join(
        [
            _HEAD,
            *(_interface(key.capitalize(), schema) for key, schema in lists.items()),
            _constant(
                "SHAPES", {each.key: each.shape for each in placed}, "How things on a mat are given, the lowest first."
            ),
            _constant("FLAT", [each.key for each in placed if each.is_flat], "Marks on the floor, in nobody's way."),
            _constant("FLOOR_NAMES", FLOORS, "What a floor and the things on it may look like."),
            "export type FloorName = (typeof FLOOR_NAMES)[number];\n",
            "/** A motorcade-mat/1 document with all its keys. */\nexport interface Mat extends MatDocument {",
            *mat,
            "}\n",
            _columns(),
            _constant("NO_INDEX", moment.NO_INDEX, "The index of a car that holds none of the image's words."),
            _constant("NO_LED", NO_LED, "The LED of a car that lights none."),
            _constant("LATELY_S", history.LATELY_MS // 1000, "The time whose lost frames a picture counts."),
            _constant("MOST_EVENTS", history.MOST_EVENTS, "A picture has the newest events, at most so many."),
            _constant("HEADER", _header(), "Where the fields of a picture's header are."),
            _constant("HEADER_BYTES", history.HEADER_BYTES, "Where the columns of a picture begin."),
            _constant("EVENT_COLUMNS", moment.EVENT_BYTES // 4, "The numbers of an event in a picture."),
            _constant(
                "EventColumn", _EVENT, "`kind` has the kind in its lowest byte, and the reason in the one above."
            ),
            _constant("Flag", moment.FLAGS, "A car's flags in a picture."),
            _constant("KINDS", KINDS, "The kinds of events, by number."),
            _constant("LOSS_REASONS", LOSS_REASONS, "Why a frame was lost, by number."),
        ]
    )


def _columns() -> str:
    """Return what the cars' columns in a picture are, and how they are found in its bytes."""
    names = {name: name.removesuffix("_m") for name in moment.PICTURED}
    arrays = {name: _ARRAYS[dtype] for name, dtype in moment.PICTURED.items()}
    fields = [f"  {names[name]}: {array};{_limits(moment.COLUMNS.get(name))}" for name, array in arrays.items()]
    read = [
        f"  {names[name]}: new {arrays[name]}(bytes, begin + {at} * cars, cars)," for name, at, _ in moment.places(1)
    ]
    return "\n".join(
        [
            "/** What all cars show at a moment; the arrays lie in the received bytes. */\nexport interface Columns {",
            *fields,
            "}\n\n/** How many bytes the columns of so many cars take, up to a multiple of four. */",
            f"export const columnBytes = (cars: number): number => Math.ceil(({moment.CAR_BYTES} * cars) / 4) * 4;\n",
            "/** The columns of so many cars, which begin at a place of the bytes. */",
            "export const columnsOf = (bytes: ArrayBuffer, begin: number, cars: number): Columns => ({",
            *read,
            "});\n",
        ]
    )


def _limits(column: Column | None) -> str:
    if column is None:
        return ""
    limits = "{:.3g} to {:.3g}".format(*column.limits) if column.limits else ""
    return f"  // {' '.join(part for part in (column.unit, limits) if part)}" if column.unit or limits else ""


def _header() -> dict[str, int]:
    """Return where each field of a picture's header begins."""
    widths = [struct.calcsize(kind) for kind in history.HEADER.values()]
    return dict(zip(history.HEADER, accumulate(widths, initial=0), strict=False))


def _constant(name: str, value: object, about: str) -> str:
    return f"/** {about} */\n{constant(name, value)}"


def _holds_tables(schema: Schema) -> bool:
    return bool(schema.get("type") == "array" and schema["items"].get("type") == "object")


def _interface(name: str, schema: Schema) -> str:
    return f"export interface {name} {_fields(schema)}\n"


def _fields(schema: Schema) -> str:
    lines = []
    for key, value in schema["properties"].items():
        if title := value.get("title"):
            lines.append(f"  /** {title[0].upper()}{title[1:]}. */")
        lines.append(f"  {key}{'' if key in schema['required'] else '?'}: {_type(value)};")
    return "\n".join(["{", *lines, "}"])


def _type(schema: Schema) -> str:
    """Return the TypeScript type of what a schema allows."""
    if "enum" in schema:
        return " | ".join(json.dumps(each) for each in schema["enum"])
    if schema["type"] == "array":
        count = schema["minItems"] if schema["minItems"] == schema.get("maxItems") else None
        if count is None:
            item = _type(schema["items"])
            return f"readonly ({item})[]" if " " in item else f"readonly {item}[]"
        return "Point" if count == 2 else f"readonly [{', '.join(['number'] * count)}]"
    if schema["type"] == "object":
        return "{ " + " ".join(f"{key}?: {_type(value)};" for key, value in schema["properties"].items()) + " }"
    kinds: Any = schema["type"] if isinstance(schema["type"], list) else [schema["type"]]
    return " | ".join({"integer": "number"}.get(kind, kind) for kind in kinds)
