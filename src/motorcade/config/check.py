"""Check a document against its JSON Schema, fill in defaults, and describe faults in every language.

A document is what JSON or TOML holds: tables, lists, texts, numbers, true, false and null. The schema that Motorcade
publishes is the one that is read here. It may use the keywords that this file reads and no others; `x-` keywords are
Motorcade's own, and `published` leaves them out. Pure Python, so that it also runs in a browser.
"""

import json
import re
from collections.abc import Mapping, Sequence
from copy import deepcopy
from difflib import get_close_matches
from itertools import chain, repeat
from math import inf
from typing import Any, NamedTuple

from motorcade.config.files import line_of, place_text
from motorcade.errors import InputError, MotorcadeError, Phrase

Schema = dict[str, Any]
KeyPath = tuple[str | int, ...]
Text = str | Phrase

_LONGEST_SHOWN = 40
# Beyond it, not every whole number is a float.
_EXACT = 2**53
_NUMBERS = (int, float)
_LISTS = (list, tuple)
_TYPES: dict[str, tuple[type, ...]] = {
    "boolean": (bool,),
    "integer": (int,),
    "number": _NUMBERS,
    "string": (str,),
    "array": _LISTS,
    "object": (dict,),
    "null": (type(None),),
}


class Fault(NamedTuple):
    """One thing that is wrong with a document.

    Attributes:
        code: the key of its sentence: unknown-key, missing-key, no-key (none of several, one of which is needed),
            several-keys, not-allowed or repeated-value.
        place: where it is; it ends with the key that is unknown or missing.
        value: what stands there, shortened; the keys of several-keys.
        allowed: what may stand there; the keys of unknown-key, no-key and several-keys.
        nearest: what may stand there and is most like it: the bound for a number that is too small or too large, the
            number for one in quotes, the word for one that is misspelt; None where nothing is like it.
    """

    code: str
    place: KeyPath
    value: Text = ""
    allowed: Text = ""
    nearest: float | str | None = None

    def error(self, file: Text, text: str | None = None) -> MotorcadeError:
        """The error for this fault in a document that its sentence calls ``file``.

        The sentence names the line where ``text`` is the TOML that the document comes from.
        """
        if text is not None:
            # What is missing belongs into the table around it.
            place = self.place
            if self.code == "missing-key":
                place = place[:-1]
            file = Phrase("file-line", file=file, line=line_of(text, place))
        return InputError(self.code, file=file, place=place_text(self.place), value=self.value, allowed=self.allowed)


def load(document: Any, schema: Schema, file: Text) -> Any:
    """Return ``document`` with defaults filled in. Raises MotorcadeError for the first fault; see `Fault.error`."""
    value, faults = check(document, schema)
    if faults:
        raise first_fault(faults).error(file)
    return value


def first_fault(faults: Sequence[Fault]) -> Fault:
    """Return the fault of a document that a sentence is about.

    A wrong ``format`` comes before all others, since files of another format have other keys; then a key that isn't
    known, since a misspelt key is missing too.
    """
    return min(faults, key=lambda fault: (fault.place != ("format",), fault.code != "unknown-key"))


def check(document: Any, schema: Schema) -> tuple[Any, list[Fault]]:
    """Return ``document`` with the default of each key that is absent, and all its faults.

    A whole number that is written with a point, such as 2.0, becomes an integer where the schema wants one. The value
    is of use only where there are no faults.
    """
    checker = _Checker(schema.get("$defs", {}))
    return checker.check(document, schema, ()), checker.faults


class _Checker:
    """Checks one document; ``definitions`` are the schemas that others refer to."""

    def __init__(self, definitions: Mapping[str, Schema]) -> None:
        self.faults: list[Fault] = []
        self._definitions = definitions

    def check(self, value: Any, schema: Schema, at: KeyPath) -> Any:
        """Return ``value`` with its defaults; what is wrong is appended to ``faults``."""
        while "$ref" in schema or "if" in schema:
            if "if" in schema:
                schema = schema["then" if _is_as(value, schema["if"]) else "else"]
            else:
                schema = self._definitions[schema["$ref"].rpartition("/")[2]]
        if not fits(value, schema):
            self.faults.append(Fault("not-allowed", at, shown(value), allowed(schema), _nearest(value, schema)))
        elif isinstance(value, dict):
            return self._table(value, schema, at)
        elif isinstance(value, _LISTS):
            return self._list(value, schema, at)
        elif isinstance(value, float) and schema.get("type") == "integer":
            return int(value)
        return value

    def _table(self, table: dict[str, Any], schema: Schema, at: KeyPath) -> dict[str, Any]:
        properties = schema.get("properties", {})
        others = schema.get("additionalProperties", True)
        checked = {}
        is_known = True
        names = schema.get("propertyNames", {})
        for key, value in table.items():
            if not fits(key, names):
                self.faults.append(Fault("not-allowed", (*at, key), shown(key), allowed(names)))
            part = properties.get(key, others)
            if part is False:
                is_known = False
                self.faults.append(Fault("unknown-key", (*at, key), "", ", ".join(properties) or Phrase("nothing")))
            elif part is True:
                checked[key] = value
            else:
                checked[key] = self.check(value, part, (*at, key))
        needed = list(schema.get("required", ()))
        for given, keys in schema.get("dependentRequired", {}).items():
            if given in table:
                needed += keys
        for key in needed:
            if key not in table:
                self.faults.append(Fault("missing-key", (*at, key), "", allowed(properties[key])))
        if "oneOf" in schema:
            self._one_of(table, schema, at, is_known)
        for key, part in properties.items():
            if key not in table and "default" in part:
                checked[key] = self.check(deepcopy(part["default"]), part, (*at, key))
        return checked

    def _one_of(self, table: dict[str, Any], schema: Schema, at: KeyPath, is_known: bool) -> None:
        """Check that the table has exactly one of the keys of which one is needed, or may have one."""
        kinds = [kind["required"][0] for kind in schema["oneOf"] if "required" in kind]
        present = [key for key in table if key in kinds]
        if len(present) > 1:
            self.faults.append(Fault("several-keys", at, ", ".join(present), ", ".join(kinds)))
        elif not present and is_known and len(kinds) == len(schema["oneOf"]):
            self.faults.append(Fault("no-key", at, "", ", ".join(kinds)))

    def _list(self, values: Sequence[Any], schema: Schema, at: KeyPath) -> list[Any]:
        if schema.get("uniqueItems"):
            seen: set[str] = set()
            for index, value in enumerate(values):
                if (text := json.dumps(value, default=str)) in seen:
                    self.faults.append(Fault("repeated-value", (*at, index), shown(value)))
                seen.add(text)
        parts = chain(schema.get("prefixItems", ()), repeat(schema.get("items", {})))
        numbered = enumerate(zip(values, parts, strict=False))
        return [self.check(value, part, (*at, index)) for index, (value, part) in numbered]


def _is_as(value: Any, question: Schema) -> bool:
    """Whether a value is what the ``if`` of a schema asks: of a type, or a table with some keys."""
    if "type" in question:
        return fits(value, question)
    return isinstance(value, dict) and all(key in value for key in question["required"])


def _nearest(value: Any, schema: Schema) -> float | str | None:
    """What fits the schema and is most like ``value``, as in `Fault`."""
    meant: float | str | None = None
    if isinstance(value, str):
        words = [word for word in schema.get("enum", ()) if isinstance(word, str)]
        similar = get_close_matches(value[:_LONGEST_SHOWN], words, 1)
        meant = similar[0] if similar else _plain_value(value)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        meant = _bounded(value, schema)
    if meant is None or not fits(meant, schema):
        return None
    return meant


def _bounded(value: float, schema: Schema) -> float:
    """The number that the schema's bounds allow and is nearest to ``value``."""
    meant = value
    if schema.get("maximum") is not None:
        meant = min(meant, schema["maximum"])
    if schema.get("minimum") is not None:
        meant = max(schema["minimum"], meant)
    if schema.get("type") == "integer" and isinstance(meant, float) and abs(meant) < inf:
        return round(meant)
    if schema.get("type") == "boolean" and meant in (0, 1):
        return bool(meant)
    return meant


def _plain_value(text: str) -> float | None:
    """The number, true or false that ``text`` is; None where it is neither."""
    flags = {"true": True, "yes": True, "false": False, "no": False}
    if (flag := flags.get(text.strip().lower())) is not None:
        return flag
    try:
        number = float(text)
    except ValueError:
        return None
    if number.is_integer() and abs(number) < _EXACT:
        return int(number)
    return number


def fits(value: Any, schema: Schema) -> bool:
    """Whether ``value`` fits the schema, without what stands inside a table or a list."""
    if "enum" in schema:
        # True equals 1, yet it is another value.
        values = schema["enum"]
        return value in values and type(value) is type(values[values.index(value)])
    kinds = schema.get("type", ())
    if isinstance(kinds, str):
        if not _is(value, kinds):
            return False
    elif kinds and not any(_is(value, kind) for kind in kinds):
        return False
    if isinstance(value, _NUMBERS) and not isinstance(value, bool):
        above = schema.get("exclusiveMinimum", -inf) < value
        return bool(above and schema.get("minimum", -inf) <= value <= schema.get("maximum", inf) and value < inf)
    if isinstance(value, str):
        return _text_fits(value, schema)
    if isinstance(value, _LISTS):
        return bool(schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", inf))
    return True


def _is(value: Any, kind: str) -> bool:
    if isinstance(value, bool):
        return kind == "boolean"
    return isinstance(value, _TYPES[kind]) or (kind == "integer" and isinstance(value, float) and value.is_integer())


def _text_fits(text: str, schema: Schema) -> bool:
    if not schema.get("minLength", 0) <= len(text) <= schema.get("maxLength", inf):
        return False
    if schema.get("format") == "line" and not (text.isprintable() and text.strip()):
        return False
    if not text.isascii() and any("\ud800" <= character <= "\udfff" for character in text):
        return False  # half a surrogate pair, which no file can hold
    return "pattern" not in schema or re.search(schema["pattern"], text) is not None


def allowed(schema: Schema) -> Text:
    """What may stand where ``schema`` holds. Its ``x-allowed``, a phrase's key and details, comes before all else."""
    if "x-allowed" in schema:
        key, details = schema["x-allowed"]
        return Phrase(key, **details)
    if "enum" in schema:
        return ", ".join(json.dumps(value, ensure_ascii=False) for value in schema["enum"])
    kinds = schema.get("type", "object")
    if isinstance(kinds, list):
        first, *others = (allowed({**schema, "type": kind}) for kind in kinds)
        for other in others:
            first = Phrase("either", first=first, second=other)
        return first
    phrase = _other(schema, kinds)
    if kinds == "integer":
        phrase = _number(schema, "whole")
    elif kinds == "number":
        phrase = _number(schema, "number")
    if "x-unit" in schema:
        return Phrase("with-unit", allowed=phrase, unit=Phrase(schema["x-unit"]))
    return phrase


def _number(schema: Schema, beginning: str) -> Phrase:
    """The phrase for a number; ``beginning`` is that of the phrase's key."""
    bounds = {"minimum": schema.get("minimum", schema.get("exclusiveMinimum")), "maximum": schema.get("maximum")}
    given = {name: bound for name, bound in bounds.items() if bound is not None}
    ending = ("", "-from", "-range")[len(given)]
    if "exclusiveMinimum" in schema:
        ending = "-above"
    return Phrase(beginning + ending, **given)


def _other(schema: Schema, kind: str) -> Phrase:
    if kind == "string" and schema.get("format") == "line":
        return Phrase("line-of-text", minimum=schema.get("minLength", 1), maximum=schema["maxLength"])
    if kind == "object" and schema.get("properties"):
        return Phrase("table-of", names=", ".join(schema["properties"]))
    if kind == "array" and "maxItems" in schema and "$ref" not in schema.get("items", {}):
        least = schema.get("minItems", 0)
        most = schema["maxItems"]
        items = allowed(schema["items"])
        if least == most:
            return Phrase("list-of", count=most, items=items)
        return Phrase("list-from-to", minimum=least, maximum=most, items=items)
    return Phrase(kind)


def shown(value: Any) -> Text:
    """``value`` as it might stand in the file, shortened."""
    if isinstance(value, dict):
        return "{...}"
    try:
        text = json.dumps(value, ensure_ascii=False, default=str)
    except ValueError:  # thousands of digits
        return Phrase("very-long-number")
    text = {"NaN": "nan", "Infinity": "inf", "-Infinity": "-inf"}.get(text, text)
    if not text.isprintable():
        text = json.dumps(value, default=str)
    if len(text) > _LONGEST_SHOWN:
        text = text[: _LONGEST_SHOWN - 3] + "..."
    return text


def published(schema: Any) -> Any:
    """The schema without Motorcade's own keywords."""
    if isinstance(schema, dict):
        return {key: published(value) for key, value in schema.items() if not key.startswith("x-")}
    if isinstance(schema, list):
        return list(map(published, schema))
    return schema


def table(optional: tuple[str, ...] = (), /, **properties: Schema) -> Schema:
    """The schema of a table that holds these keys and no others.

    Each key is required that has no default and isn't among ``optional``.
    """
    required = [key for key, part in properties.items() if "default" not in part and key not in optional]
    return {"type": "object", "properties": properties, "required": required, "additionalProperties": False}


def whole(minimum: int, maximum: int, unit: str = "", **more: Any) -> Schema:
    """The schema of an integer; sentences name its ``unit``, a phrase."""
    return number(minimum, maximum, unit, **more) | {"type": "integer"}


def number(minimum: float, maximum: float, unit: str = "", **more: Any) -> Schema:
    """The schema of a number; sentences name its ``unit``, a phrase."""
    schema: Schema = {"type": "number", "minimum": minimum, "maximum": maximum}
    if unit:
        schema["x-unit"] = unit
    return schema | more


def allowed_as(key: str, schema: Schema, **details: Any) -> Schema:
    """Return the schema with a phrase for what is allowed, where its bounds alone are not clear enough."""
    return {**schema, "x-allowed": [key, details]}


def line(longest: int, **more: Any) -> Schema:
    """The schema of a text of one line that is not blank, of at most ``longest`` characters."""
    return {"type": "string", "format": "line", "minLength": 1, "maxLength": longest, **more}


def choice(*values: str, **more: Any) -> Schema:
    """The schema of one of these texts."""
    return {"enum": list(values), **more}


def flag(**more: Any) -> Schema:
    """The schema of true or false."""
    return {"type": "boolean", **more}


def list_of(items: Schema, least: int = 0, most: int | None = None, **more: Any) -> Schema:
    """The schema of a list; of any length where ``most`` is None."""
    schema: Schema = {"type": "array", "items": items, "minItems": least}
    if most is not None:
        schema["maxItems"] = most
    return schema | more
