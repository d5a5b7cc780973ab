"""Check a document against its JSON Schema, fill in defaults, and say what is wrong in every language.

A document is what JSON or TOML holds: tables, lists, texts, numbers, true, false and null. The schema that Motorcade
publishes is the one that is read here. It may use the keywords in KEYWORDS and no others; `x-` keywords are
Motorcade's own, and `published` leaves them out. Pure Python, so that it also runs in a browser.
"""

import json
import re
from collections.abc import Mapping, Sequence
from copy import deepcopy
from math import inf
from typing import Any, NamedTuple

from motorcade.config.files import line_of, place_text
from motorcade.errors import MotorcadeError, Phrase

Schema = dict[str, Any]
Place = tuple[str | int, ...]
Text = str | Phrase

KEYWORDS = frozenset(
    (
        *("$schema", "$defs", "$ref", "title", "description", "default", "type", "enum"),
        *("minimum", "maximum", "exclusiveMinimum", "minLength", "maxLength", "pattern", "format"),
        *("items", "prefixItems", "minItems", "maxItems", "uniqueItems"),
        *("properties", "required", "additionalProperties", "oneOf", "dependentRequired"),
        *("x-allowed", "x-unit"),
    )
)
_LONGEST_SHOWN = 40
_TYPES: dict[str, tuple[type, ...]] = {
    "boolean": (bool,),
    "integer": (int,),
    "number": (int, float),
    "string": (str,),
    "array": (list, tuple),
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
    """

    code: str
    place: Place
    value: Text = ""
    allowed: Text = ""

    def error(self, file: Text, text: str | None = None) -> MotorcadeError:
        """The error that tells this fault.

        Args:
            file: what the sentence calls the document.
            text: the TOML that the document comes from, to name the line; without it the sentence names no line.
        """
        if text is not None:
            # What is missing belongs into the table around it.
            place = self.place[:-1] if self.code == "missing-key" else self.place
            file = Phrase("file-line", file=file, line=line_of(text, place))
        return MotorcadeError(
            self.code, file=file, place=place_text(self.place), value=self.value, allowed=self.allowed
        )


def load(document: Any, schema: Schema, file: Text, text: str | None = None) -> Any:
    """Return ``document`` with defaults filled in.

    Raises:
        MotorcadeError: the first fault, as `Fault.error` tells it. A wrong ``format`` comes before all others, since
            files of another format have other keys; then a key that isn't known, since a misspelt key is missing too.
    """
    value, faults = check(document, schema)
    if faults:
        first = min(faults, key=lambda fault: (fault.place != ("format",), fault.code != "unknown-key"))
        raise first.error(file, text)
    return value


def check(document: Any, schema: Schema) -> tuple[Any, list[Fault]]:
    """Return ``document`` with the default of each key that is absent, and all its faults.

    A whole number that is written with a point, such as 2.0, becomes an integer where the schema wants one. The value
    is of use only where there are no faults. The schema is prepared when it is first used, and must not change then.
    """
    if id(schema) not in _PREPARED:
        _PREPARED[id(schema)] = _Node(schema, schema.get("$defs", {}), {})
    faults: list[Fault] = []
    return _PREPARED[id(schema)].check(document, None, faults), faults


# Where a value is, as it is built up on the way there: its key and the place around it.
_At = tuple[Any, str | int] | None


def _place(at: _At) -> Place:
    keys: list[str | int] = []
    while at is not None:
        at, key = at
        keys.append(key)
    return tuple(reversed(keys))


class _Node:
    """A schema that is prepared for checking; ``nodes`` holds those of the definitions that it refers to."""

    def __init__(self, schema: Schema, definitions: Mapping[str, Schema], nodes: dict[str, "_Node"]) -> None:
        def node_of(part: Schema) -> _Node:
            if "$ref" not in part:
                return _Node(part, definitions, nodes)
            name = part["$ref"].rpartition("/")[2]
            if name not in nodes:
                nodes[name] = _Node.__new__(_Node)
                nodes[name].__init__(definitions[name], definitions, nodes)  # type: ignore[misc]
            return nodes[name]

        self.schema = schema
        # What fits at a glance, for speed; `fits` decides the rest.
        plain = {"integer": (int,), "number": (int, float)} if "exclusiveMinimum" not in schema else {}
        self._numbers = plain.get(schema.get("type", ""), ()) if isinstance(schema.get("type"), str) else ()
        self._least, self._most = schema.get("minimum", -inf), schema.get("maximum", inf)
        self._texts = frozenset(each for each in schema.get("enum", ()) if isinstance(each, str))
        self._is_table = schema.get("type") == "object"
        self._properties = {key: node_of(part) for key, part in schema.get("properties", {}).items()}
        others = schema.get("additionalProperties", True)
        self._is_closed = others is False
        self._others = node_of(others) if isinstance(others, dict) else None
        self._required = tuple(schema.get("required", ()))
        self._dependent = tuple(schema.get("dependentRequired", {}).items())
        self._kinds = frozenset(each["required"][0] for each in schema.get("oneOf", ()))
        parts = schema.get("properties", {}).items()
        self._defaults = tuple((key, part["default"]) for key, part in parts if "default" in part)
        self._first = tuple(node_of(part) for part in schema.get("prefixItems", ()))
        self._rest = node_of(schema["items"]) if "items" in schema else None

    def check(self, value: Any, at: _At, faults: list[Fault]) -> Any:
        """Return ``value`` with its defaults; what is wrong is appended to ``faults``."""
        kind = type(value)
        if kind is dict and self._is_table:
            return self._table(value, at, faults)
        if kind in self._numbers and self._least <= value <= self._most and value < inf:
            return value
        if kind is str and value in self._texts:
            return value
        if not fits(value, self.schema):
            faults.append(Fault("not-allowed", _place(at), shown(value), allowed(self.schema)))
        elif kind is dict:
            return self._table(value, at, faults)
        elif kind is list or kind is tuple:
            return self._list(value, at, faults)
        elif isinstance(value, float) and self.schema.get("type") == "integer":
            return int(value)
        return value

    def _table(self, table: dict[str, Any], at: _At, faults: list[Fault]) -> dict[str, Any]:
        checked, properties, is_known, present = {}, self._properties, True, 0
        for key, value in table.items():
            node = properties.get(key, self._others)
            if key in self._kinds:
                present += 1
            if node is not None:
                checked[key] = node.check(value, (at, key), faults)
            elif self._is_closed:
                is_known = False
                known = ", ".join(properties) or Phrase("nothing")
                faults.append(Fault("unknown-key", _place((at, key)), "", known))
            else:
                checked[key] = value
        needed = self._required
        if self._dependent:
            needed += tuple(key for given, keys in self._dependent if given in table for key in keys)
        for key in needed:
            if key not in table:
                faults.append(Fault("missing-key", _place((at, key)), "", allowed(properties[key].schema)))
        if present != 1 and self._kinds:
            kinds = ", ".join(key for key in properties if key in self._kinds)
            if present:
                given = ", ".join(key for key in table if key in self._kinds)
                faults.append(Fault("several-keys", _place(at), given, kinds))
            elif is_known:
                faults.append(Fault("no-key", _place(at), "", kinds))
        for key, default in self._defaults:
            if key not in table:
                checked[key] = properties[key].check(deepcopy(default), (at, key), faults)
        return checked

    def _list(self, values: Sequence[Any], at: _At, faults: list[Fault]) -> list[Any]:
        if self.schema.get("uniqueItems"):
            seen: set[str] = set()
            for index, value in enumerate(values):
                if (text := json.dumps(value, default=str)) in seen:
                    faults.append(Fault("repeated-value", _place((at, index)), shown(value)))
                seen.add(text)
        checked = []
        for index, value in enumerate(values):
            node = self._first[index] if index < len(self._first) else self._rest
            checked.append(value if node is None else node.check(value, (at, index), faults))
        return checked


_PREPARED: dict[int, _Node] = {}


def fits(value: Any, schema: Schema) -> bool:
    """Whether ``value`` fits the schema, without what stands inside a table or a list."""
    if "enum" in schema:
        return any(type(value) is type(each) and value == each for each in schema["enum"])
    kinds = schema.get("type", ())
    if kinds and not any(_is(value, kind) for kind in ((kinds,) if isinstance(kinds, str) else kinds)):
        return False
    if isinstance(value, int | float) and not isinstance(value, bool):
        above = schema.get("exclusiveMinimum", -inf) < value
        return bool(above and schema.get("minimum", -inf) <= value <= schema.get("maximum", inf) and value < inf)
    if isinstance(value, str):
        return _text_fits(value, schema)
    if isinstance(value, list | tuple):
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
    try:
        text.encode()
    except UnicodeEncodeError:  # half a surrogate pair, which no file can hold
        return False
    return "pattern" not in schema or re.search(schema["pattern"], text) is not None


def allowed(schema: Schema) -> Text:
    """What may stand where ``schema`` holds. Its ``x-allowed``, a phrase's key and details, comes before all else."""
    if "x-allowed" in schema:
        key, details = schema["x-allowed"]
        return Phrase(key, **details)
    if "enum" in schema:
        return ", ".join(json.dumps(each, ensure_ascii=False) for each in schema["enum"])
    kinds = schema.get("type", "object")
    if isinstance(kinds, list):
        first, *others = (allowed({**schema, "type": kind}) for kind in kinds)
        for other in others:
            first = Phrase("either", first=first, second=other)
        return first
    phrase = _number(schema, kinds) if kinds in ("integer", "number") else _other(schema, kinds)
    return Phrase("with-unit", allowed=phrase, unit=Phrase(schema["x-unit"])) if "x-unit" in schema else phrase


def _number(schema: Schema, kind: str) -> Phrase:
    bounds = {"minimum": schema.get("minimum", schema.get("exclusiveMinimum")), "maximum": schema.get("maximum")}
    given = {name: bound for name, bound in bounds.items() if bound is not None}
    ending = "-above" if "exclusiveMinimum" in schema else {2: "-range", 1: "-from", 0: ""}[len(given)]
    return Phrase(("whole" if kind == "integer" else "number") + ending, **given)


def _other(schema: Schema, kind: str) -> Phrase:
    if kind == "string" and schema.get("format") == "line":
        return Phrase("line-of-text", minimum=schema.get("minLength", 1), maximum=schema["maxLength"])
    if kind == "object" and schema.get("properties"):
        return Phrase("table-of", names=", ".join(schema["properties"]))
    if kind == "array" and "maxItems" in schema and "$ref" not in schema.get("items", {}):
        least, most, items = schema.get("minItems", 0), schema["maxItems"], allowed(schema["items"])
        return (
            Phrase("list-of", count=most, items=items)
            if least == most
            else Phrase("list-from-to", minimum=least, maximum=most, items=items)
        )
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
    text = text if text.isprintable() else json.dumps(value, default=str)
    return text if len(text) <= _LONGEST_SHOWN else text[: _LONGEST_SHOWN - 3] + "..."


def published(schema: Any) -> Any:
    """The schema without Motorcade's own keywords."""
    if isinstance(schema, dict):
        return {key: published(value) for key, value in schema.items() if not key.startswith("x-")}
    return [published(each) for each in schema] if isinstance(schema, list) else schema


def table(optional: tuple[str, ...] = (), /, **properties: Schema) -> Schema:
    """The schema of a table that holds these keys and no others.

    Each key is required that has no default and isn't among ``optional``.
    """
    required = [key for key, part in properties.items() if "default" not in part and key not in optional]
    return {"type": "object", "properties": properties, "required": required, "additionalProperties": False}


def whole(minimum: int, maximum: int, **more: Any) -> Schema:
    """The schema of an integer."""
    return {"type": "integer", "minimum": minimum, "maximum": maximum, **more}


def number(minimum: float, maximum: float, **more: Any) -> Schema:
    """The schema of a number."""
    return {"type": "number", "minimum": minimum, "maximum": maximum, **more}


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
    bounds = {"minItems": least} | ({} if most is None else {"maxItems": most})
    return {"type": "array", "items": items, **bounds, **more}
