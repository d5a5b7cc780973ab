"""A word format of a user's own, declared in TOML in the terms of `motorcade.words.field`.

::

    name = "walker"

    [[field]]                # most significant first, 32 bits in all
    name = "gait"
    width = 4                # bits
    range = [0, 9]           # raw values; all that the bits hold unless told
    unit = "deg"
    meaning = "how it walks"

A field may also have ``high`` (its first bit, to make sure of its place), ``meaning_zh``,
``source``, ``default``, ``values`` (allowed raw values and their names), ``one_hot``,
``reserved``, ``needs`` and ``goes_with`` (names of other fields).
"""

import tomllib
from typing import Any, NoReturn

from motorcade.config.toml_lines import Path, TomlLines
from motorcade.export.names import name_fault
from motorcade.export.vocabulary import Vocabulary
from motorcade.words.field import WORD_BITS, Field, FormatError, Values, WordError, WordFormat
from motorcade.words.formats import FORMATS

# A field a bit, each of its keys on a line of its own, and as many comments again.
MOST_LINES = 1000
_LONGEST_TEXT = 200
_TOP_KEYS = ("name", "field")
_FIELD_KEYS = (
    "name",
    "width",
    "high",
    "range",
    "unit",
    "meaning",
    "meaning_zh",
    "source",
    "default",
    "values",
    "one_hot",
    "reserved",
    "needs",
    "goes_with",
)
# Exported files and names in C would be those of Motorcade's own.
_NAMES_TAKEN = (*(word_format.name for word_format in FORMATS), "word", "words", "image")


class FormatFileError(ValueError):
    """A file that declares no format; the sentence names file and line."""


def read_format(text: str, called: str) -> Vocabulary:
    """The format that TOML ``text`` declares; ``called`` is the file's name for sentences.

    Raises:
        FormatFileError: it isn't TOML, or no 32-bit word, or holds a name or value that can't be.
    """
    return _Reader(text, called).read()


class _Reader:
    def __init__(self, text: str, called: str) -> None:
        self._called = called
        self._lines = TomlLines(text)
        if text.count("\n") >= MOST_LINES:
            raise FormatFileError(f"{called} has more than {MOST_LINES} lines; a format has at most 32 fields")
        try:
            self._table = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            reason = str(error).replace("end of document", f"its end, line {len(text.splitlines())}")
            raise FormatFileError(f"{called} is not TOML: {reason}") from None
        except RecursionError:
            raise FormatFileError(f"{called} is not a format: its lists stand too deep in each other") from None

    def read(self) -> Vocabulary:
        self._check_keys(self._table, _TOP_KEYS, ())
        name = self._name(("name",), self._needed(self._table, "name", ()))
        if name in _NAMES_TAKEN:
            self._refuse(("name",), f"name is '{name}', which Motorcade has already; choose another one")
        tables = self._needed(self._table, "field", ())
        if not isinstance(tables, list) or not tables or not all(isinstance(table, dict) for table in tables):
            self._refuse(("field",), "field is no list of tables; begin each field with a line [[field]]")
        fields: list[Field] = []
        for number, table in enumerate(tables):
            fields.append(self._field(number, table, fields))
        left = fields[-1].low
        if left:
            made = f"the widths make {WORD_BITS - left} of {WORD_BITS} bits"
            self._refuse(("field", len(fields) - 1), f"{made}; add a field of {left}, reserved = true where it is free")
        self._check_links(fields)
        chinese = {(name, table["name"]): table["meaning_zh"] for table in tables if "meaning_zh" in table}
        return Vocabulary(name, (self._format(name, fields),), chinese)

    def _format(self, name: str, fields: list[Field]) -> WordFormat:
        try:
            word_format = WordFormat(name, fields)
            word_format.encode()
        except FormatError as error:
            self._refuse(("field",), str(error))
        except WordError as error:
            number = next(number for number, field in enumerate(fields) if field.name == error.field)
            self._refuse(("field", number), f"the defaults make no word: {error}")
        return word_format

    def _field(self, number: int, table: dict[str, Any], before: list[Field]) -> Field:
        at: Path = ("field", number)
        self._check_keys(table, _FIELD_KEYS, at)
        name = self._name((*at, "name"), self._needed(table, "name", at))
        if name in [field.name for field in before]:
            self._refuse((*at, "name"), f"there are two fields named '{name}'")
        self._needed(table, "meaning", at)
        self._text(table, "meaning_zh", at)
        high, low = self._bits(table, at, name, before)
        most = (1 << high - low + 1) - 1
        minimum, maximum = self._range(table, at, most)
        field = Field(
            name,
            high,
            low,
            self._text(table, "meaning", at),
            self._text(table, "source", at),
            Values(
                minimum,
                maximum,
                one_hot=self._flag(table, "one_hot", at),
                only=self._only(table, at, most),
                unit=self._text(table, "unit", at),
                reserved=self._flag(table, "reserved", at),
            ),
            needs=self._text(table, "needs", at),
            goes_with=self._text(table, "goes_with", at),
        )
        field.default = self._default(table, at, field)
        return field

    def _bits(self, table: dict[str, Any], at: Path, name: str, before: list[Field]) -> tuple[int, int]:
        width = self._whole(self._needed(table, "width", at), (*at, "width"), 1, WORD_BITS)
        free = before[-1].low - 1 if before else WORD_BITS - 1
        high = free
        if "high" in table:
            high = self._whole(table["high"], (*at, "high"), 0, WORD_BITS - 1)
            for field in before:
                if high - width < field.high and high >= field.low:
                    bits = f"{name}'s bits {high}-{high - width + 1}"
                    self._refuse((*at, "high"), f"{bits} overlap {field.name}'s, {field.high}-{field.low}")
            if high > free:
                self._refuse((*at, "high"), f"{name} stands behind less significant fields; fields go from bit 31 down")
            if high < free:
                self._refuse((*at, "high"), f"no field holds bit {free}, above {name}; add a reserved one")
        if high - width < -1:
            self._refuse((*at, "width"), f"{name} has {width} bits, but only {high + 1} of {WORD_BITS} are left for it")
        return high, high - width + 1

    def _range(self, table: dict[str, Any], at: Path, most: int) -> tuple[int, int]:
        given = table.get("range", [0, most])
        if not isinstance(given, list) or len(given) != 2:
            self._refuse((*at, "range"), f"range is {given!r}; allowed: two numbers, such as [0, {most}]")
        minimum, maximum = (self._whole(value, (*at, "range"), 0, most) for value in given)
        if minimum > maximum:
            self._refuse((*at, "range"), f"range is {given!r}; the smaller number stands first")
        return minimum, maximum

    def _only(self, table: dict[str, Any], at: Path, most: int) -> tuple[tuple[int, str], ...]:
        if "values" not in table:
            return ()
        path: Path = (*at, "values")
        values = table["values"]
        if not isinstance(values, dict) or not values:
            self._refuse(
                path, f'values is {values!r}; allowed: numbers with names, such as {{ 0 = "walk", 1 = "run" }}'
            )
        if "range" in table or table.get("one_hot"):
            self._refuse(path, "values says all that is allowed; leave out range and one_hot")
        only = []
        for key in values:
            if not (key.isascii() and key.isdigit() and len(key) <= 10 and int(key) <= most):
                self._refuse((*path, key), f"values has '{key}'; allowed: 0 to {most}")
            only.append((int(key), self._text(values, key, path)))
        return tuple(sorted(only))

    def _default(self, table: dict[str, Any], at: Path, field: Field) -> int:
        if "default" not in table:
            least = min((raw for raw, _ in field.only), default=field.minimum)
            return least if field.allows(least) else 1 << least.bit_length()
        default = self._whole(table["default"], (*at, "default"), 0, field.raw_mask)
        if not field.allows(default):
            self._refuse((*at, "default"), f"default is {default}; allowed: {field.allowed}")
        return default

    def _check_links(self, fields: list[Field]) -> None:
        others = {field.name: field for field in fields}
        for number, field in enumerate(fields):
            for key, name in (("needs", field.needs), ("goes_with", field.goes_with)):
                if not name:
                    continue
                if name not in others or name == field.name:
                    self._refuse(("field", number, key), f"{key} is '{name}', which is no other field")
                if key == "needs" and others[name].width > 1:
                    self._refuse(("field", number, key), f"needs is '{name}', which has more than one bit")

    def _check_keys(self, table: dict[str, Any], known: tuple[str, ...], at: Path) -> None:
        for key in table:
            if key not in known:
                self._refuse((*at, key), f"'{key}' is not known; known are {', '.join(known)}")

    def _needed(self, table: dict[str, Any], key: str, at: Path) -> Any:
        if key not in table:
            self._refuse(at, f"'{key}' is missing" + (" in this field" if at else ""))
        return table[key]

    def _name(self, path: Path, name: Any) -> str:
        if not isinstance(name, str):
            self._refuse(path, f"name is {name!r}; allowed: text in quotes")
        if fault := name_fault(name):
            self._refuse(path, f"the name '{name[:60]}' {fault}")
        return str(name)

    def _text(self, table: dict[str, Any], key: str, at: Path) -> str:
        text = table.get(key, "")
        is_line = isinstance(text, str) and text.isprintable() and len(text) <= _LONGEST_TEXT
        if not is_line or (key in table and not text.strip()):
            self._refuse((*at, key), f"{key} is no text of one line and 1 to {_LONGEST_TEXT} characters")
        return str(text)

    def _flag(self, table: dict[str, Any], key: str, at: Path) -> bool:
        flag = table.get(key, False)
        if not isinstance(flag, bool):
            self._refuse((*at, key), f"{key} is {flag!r}; allowed: true or false")
        return bool(flag)

    def _whole(self, value: Any, path: Path, least: int, most: int) -> int:
        if type(value) is not int or not least <= value <= most:
            self._refuse(path, f"{path[-1]} is {value!r}; allowed: whole numbers from {least} to {most}")
        return int(value)

    def _refuse(self, path: Path, reason: str) -> NoReturn:
        raise FormatFileError(f"{self._called}, line {self._lines.line_of(path)}: {reason}")
