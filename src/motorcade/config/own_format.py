"""A user's own word format, declared in TOML in the terms of `motorcade.words.field`.

::

    name = "walker"

    [[field]]                # most significant first, 32 bits in all
    name = "gait"
    width = 4                # bits
    range = [0, 9]           # raw values; all that the bits hold where it is absent
    unit = "deg"
    meaning = "how it walks"

A field may also have ``high`` (its first bit, as a check of its place), ``meaning_zh``, ``source``, ``default``,
``values`` (allowed raw values and their names), ``one_hot``, ``reserved``, ``needs`` and ``goes_with`` (names of other
fields).
"""

from functools import cache
from typing import Any, NoReturn

from motorcade.config.check import Place, Schema, flag, line, list_of, load, shown, table, whole
from motorcade.config.files import line_of, parse
from motorcade.config.vocabulary import Vocabulary, check_name
from motorcade.errors import MotorcadeError, Phrase
from motorcade.words.field import WORD_BITS, Field, Values, WordError, WordFormat
from motorcade.words.formats import FORMATS

# A field a bit, each of its keys on a line of its own, and as many comments again.
MOST_LINES = 1000
_LONGEST_TEXT = 200
_MOST_RAW = (1 << WORD_BITS) - 1
# Exported files and names in C would be those of Motorcade's own.
_NAMES_TAKEN = (*(word_format.name for word_format in FORMATS), "word", "words", "image")
_OPTIONAL = ("high", "range", "unit", "meaning_zh", "source", "default", "values", "needs", "goes_with")


@cache
def own_format_schema() -> Schema:
    """The JSON Schema of a format file, parsed; how fields depend on each other is not in it."""
    text = line(_LONGEST_TEXT)
    raw = whole(0, _MOST_RAW)
    field = table(
        _OPTIONAL,
        name={"type": "string"},
        width=whole(1, WORD_BITS),
        high=whole(0, WORD_BITS - 1),
        range=list_of(raw, 2, 2),
        unit=text,
        meaning=text,
        meaning_zh=text,
        source=text,
        default=raw,
        values={"type": "object", "additionalProperties": text, "x-allowed": ["named-numbers", {}]},
        one_hot=flag(default=False),
        reserved=flag(default=False),
        needs=text,
        goes_with=text,
    )
    fields = {"x-allowed": ["field-tables", {}]}
    return table(name={"type": "string"}, field=list_of(field, 1, WORD_BITS, **fields))


def read_format(text: str, file: str) -> Vocabulary:
    """Return the format that TOML ``text`` declares; ``file`` is what errors call it.

    Raises:
        MotorcadeError: it isn't TOML, or no 32-bit word, or holds a name or value that can't be.
    """
    if text.count("\n") >= MOST_LINES:
        raise MotorcadeError("too-many-lines", file=file, most=MOST_LINES)
    return _Reader(load(parse(text, "TOML", file), own_format_schema(), file, text), text, file).read()


class _Reader:
    """Makes the fields of a document that fits the schema, and checks what depends on several of them."""

    def __init__(self, document: dict[str, Any], text: str, file: str) -> None:
        self._document = document
        self._text = text
        self._file = file
        self._fields: list[Field] = []

    def read(self) -> Vocabulary:
        name, tables = self._document["name"], self._document["field"]
        self._check_name(("name",), name)
        if name in _NAMES_TAKEN:
            self._refuse(("name",), "format-name-taken", name=name)
        for number, given in enumerate(tables):
            self._fields.append(self._field(("field", number), given))
        if left := self._fields[-1].low:
            self._refuse(("field", len(tables) - 1), "bits-left", made=WORD_BITS - left, bits=WORD_BITS, left=left)
        self._check_links()
        chinese = {(name, given["name"]): given["meaning_zh"] for given in tables if "meaning_zh" in given}
        return Vocabulary(name, (self._format(name),), {"zh": chinese})

    def _format(self, name: str) -> WordFormat:
        word_format = WordFormat(name, self._fields)
        try:
            word_format.encode()
        except WordError as error:
            number = next(number for number, field in enumerate(self._fields) if field.name == error.field)
            self._refuse(("field", number), "defaults-make-no-word", reason=error)
        return word_format

    def _field(self, place: Place, given: dict[str, Any]) -> Field:
        name = given["name"]
        self._check_name((*place, "name"), name)
        if name in [field.name for field in self._fields]:
            self._refuse((*place, "name"), "field-twice", name=name)
        high, low = self._bits(place, given)
        most = (1 << high - low + 1) - 1
        minimum, maximum = self._range(place, given, most)
        field = Field(
            name,
            high,
            low,
            given["meaning"],
            given.get("source", ""),
            Values(
                minimum,
                maximum,
                one_hot=given["one_hot"],
                only=self._only(place, given, most),
                unit=given.get("unit", ""),
                reserved_above=0 if given["reserved"] else None,
            ),
            needs=given.get("needs", ""),
            goes_with=given.get("goes_with", ""),
        )
        field.default = self._default(place, given, field)
        return field

    def _bits(self, place: Place, given: dict[str, Any]) -> tuple[int, int]:
        name, width = given["name"], given["width"]
        free = self._fields[-1].low - 1 if self._fields else WORD_BITS - 1
        high = given.get("high", free)
        low = high - width + 1
        if "high" in given:
            for other in self._fields:
                if low <= other.high and high >= other.low:
                    bits = {"bits": f"{high}-{low}", "other": other.name, "other_bits": f"{other.high}-{other.low}"}
                    self._refuse((*place, "high"), "field-bits-overlap", name=name, **bits)
            if high > free:
                self._refuse((*place, "high"), "field-too-high", name=name)
            if high < free:
                self._refuse((*place, "high"), "bit-without-field", name=name, bit=free)
        if low < 0:
            self._refuse((*place, "width"), "field-too-wide", name=name, width=width, left=high + 1, bits=WORD_BITS)
        return high, low

    def _range(self, place: Place, given: dict[str, Any], most: int) -> tuple[int, int]:
        minimum, maximum = given.get("range", (0, most))
        for value in (minimum, maximum):
            if value > most:
                self._refuse_value((*place, "range"), value, most)
        if minimum > maximum:
            self._refuse((*place, "range"), "range-backwards", value=shown([minimum, maximum]))
        return minimum, maximum

    def _only(self, place: Place, given: dict[str, Any], most: int) -> tuple[tuple[int, str], ...]:
        if "values" not in given:
            return ()
        place = (*place, "values")
        if not given["values"]:
            self._refuse(place, "not-allowed", place="values", value="{}", allowed=Phrase("named-numbers"))
        if "range" in given or given["one_hot"]:
            self._refuse(place, "values-and-range")
        for key in given["values"]:
            if not (key.isascii() and key.isdigit() and len(key) <= 10 and int(key) <= most):
                self._refuse_value((*place, key), key, most)
        return tuple(sorted((int(key), name) for key, name in given["values"].items()))

    def _default(self, place: Place, given: dict[str, Any], field: Field) -> int:
        if "default" not in given:
            least = min((raw for raw, _ in field.only), default=field.minimum)
            return least if field.allows(least) else 1 << least.bit_length()
        default: int = given["default"]
        if not field.allows(default):
            place = (*place, "default")
            self._refuse(place, "not-allowed", place="default", value=default, allowed=field.allowed)
        return default

    def _check_links(self) -> None:
        others = {field.name: field for field in self._fields}
        for number, field in enumerate(self._fields):
            for key, name in (("needs", field.needs), ("goes_with", field.goes_with)):
                if not name:
                    continue
                if name not in others or name == field.name:
                    self._refuse(("field", number, key), "no-other-field", key=key, name=name)
                if key == "needs" and others[name].width > 1:
                    self._refuse(("field", number, key), "needs-several-bits", name=name)

    def _check_name(self, place: Place, name: str) -> None:
        try:
            check_name(name)
        except MotorcadeError as error:
            self._refuse(place, "format-name-refused", reason=error)

    def _refuse_value(self, place: Place, value: object, most: int) -> NoReturn:
        key = next(part for part in reversed(place) if part in ("range", "values"))
        allowed = Phrase("whole-range", minimum=0, maximum=most)
        self._refuse(place, "not-allowed", place=key, value=shown(value), allowed=allowed)

    def _refuse(self, at: Place, code: str, **details: object) -> NoReturn:
        file = Phrase("file-line", file=self._file, line=line_of(self._text, at))
        raise MotorcadeError(code, file=file, **details)
