"""A word format: a table of fields, and the functions that encode and decode words by it.

A format generates the source of its ``encode`` and ``decode`` from its fields, as the dataclasses of the standard
library do, when one of them is first used. So they are as fast as shifts written by hand. No car needs a format: it has
`motorcade.words.positions`.
"""

from collections import namedtuple
from collections.abc import Callable, Iterable
from typing import Any

from motorcade.errors import MotorcadeError, Phrase

WORD_BITS = 32
WORD_MASK = 0xFFFFFFFF
# Up to how many bits at once decode looks up in a table.
TABLE_BITS = 9


class WordError(MotorcadeError):
    """A word, or a value of a field, that the format doesn't allow.

    Args:
        field: name of the field at fault, or the format's name where it is the whole word.
        value: the value that is not allowed.
        allowed: which values are allowed: a Phrase, or names, which are the same in every language.
        code: the code of the error.
    """

    def __init__(self, field: str, value: object, allowed: Phrase | str, code: str = "word-value") -> None:
        super().__init__(code, field=field, value=value, allowed=allowed)
        self.field = field
        self.value = value

    @property
    def allowed(self) -> str:
        """Which values are allowed, in English."""
        return str(self.details["allowed"])


class Field:
    """Consecutive bits of a word.

    Args:
        name: its name in code, tables and JSON.
        high, low: its first and last bit; bit 31 is the most significant.
        meaning: one phrase for tables and documentation.
        source: the document that defines it, such as ``"seed 000, c3"``.
        needs: name of the one-bit field without which this one should be 0.
        goes_with: name of the field that is 0 exactly where this one, which is one-hot, is 0.
        values: the raw values that it may hold, by the names below.

    Attributes:
        minimum, maximum: the allowed range; all that the bits hold unless given.
        one_hot: at most one bit may be set.
        only: allowed raw values by name, as ``((1, "speed and direction"),)``; others are refused.
        default: the raw value where a caller gives none.
        unit: the unit of the raw value, such as ``"deg"``; empty for levels, counts and flags.
        reserved: the bits have no meaning yet.
        defined: of a reserved field, the largest value with a meaning; strict decoding refuses larger ones.
        parity_masks: of a field that is computed from other bits, a mask for each bit, most significant first: the
            bit is 1 where the number of ones under its mask is odd; 0 where what the field ``needs`` is 0.

    Raises:
        ValueError: the bits are not in a 32-bit word, or there is no such value.
    """

    minimum = 0
    one_hot = False
    only: tuple[tuple[int, str], ...] = ()
    default = 0
    unit = ""
    reserved = False
    defined = 0
    parity_masks: tuple[int, ...] = ()

    def __init__(
        self,
        name: str,
        high: int,
        low: int,
        meaning: str,
        source: str = "",
        needs: str = "",
        goes_with: str = "",
        **values: Any,
    ) -> None:
        if not 0 <= low <= high < WORD_BITS:
            raise ValueError(f"field {name}: bits {high}-{low} are not in a 32-bit word")
        self.name = name
        self.high = high
        self.low = low
        self.width = high - low + 1
        self.raw_mask = (1 << self.width) - 1
        self.word_mask = self.raw_mask << low
        self.meaning = meaning
        self.source = source
        self.needs = needs
        self.goes_with = goes_with
        self.maximum = self.raw_mask
        for key in values:
            if not hasattr(self, key):
                raise ValueError(f"field {name}: there is no {key}")
            setattr(self, key, values[key])

    @property
    def reserved_allowed(self) -> Phrase:
        """The values of this reserved field that strict decoding takes."""
        if self.defined:
            return Phrase("values-from-to", minimum=0, maximum=self.defined)
        return Phrase("zero-reserved")

    @property
    def allowed(self) -> Phrase:
        """The values that this field may hold."""
        if self.only:
            choices = [Phrase("value-with-name", value=value, name=name) for value, name in self.only]
            phrase = choices[0]
            for choice in choices[1:]:
                phrase = Phrase("either", first=phrase, second=choice)
            return phrase
        if self.one_hot:
            return Phrase("zero-or-one-bit", values=", ".join([str(1 << bit) for bit in range(self.width)]))
        return Phrase("values-from-to", minimum=self.minimum, maximum=self.maximum)

    def allowed_beside(self, other: int) -> Phrase:
        """Return the values that this field, of which one bit is set, may hold beside ``other`` in ``goes_with``."""
        if other:
            return Phrase("exactly-one-bit")
        return Phrase("zero-without-others", others=self.goes_with.replace("_", " "))

    def allows(self, raw: int) -> bool:
        """Return whether this field may hold the integer ``raw``."""
        if self.only:
            return any(raw == value for value, _ in self.only)
        if self.one_hot and raw & (raw - 1):
            return False
        return self.minimum <= raw <= self.maximum


class WordFormat:
    """A 32-bit word as a table of fields, most significant first.

    Args:
        name: the name of the format for users.
        fields: the Fields; they must cover bits 31 to 0 without overlap or hole.

    Attributes:
        paired: the fields that have ``goes_with``.
        values: the named tuple that ``decode`` returns, one raw integer a field.
        decode: ``decode(word, strict=False)`` -> values. Reserved bits are kept;
            ``strict`` refuses them. Raises WordError.
        encode: ``encode(name=raw, ...)`` -> word; fields left out take their
            default. Raises WordError for a value out of range and TypeError for
            a name that is no field. Values may also be given without names, in the
            order of the fields. CPython makes a dict of more than 15 names, which
            takes as long as all else: leave out fields that have their default.

    Raises:
        ValueError: the fields don't make one 32-bit word.
    """

    def __init__(self, name: str, fields: Iterable[Field]) -> None:
        self.name = name
        self.fields = tuple(fields)
        self._check_layout()
        self.values: Callable[..., Any] = namedtuple(name[0].upper() + name[1:], [field.name for field in self.fields])  # type: ignore[misc]
        self.reserved_mask = sum(field.word_mask for field in self.fields if field.reserved)
        self.paired = tuple(field for field in self.fields if field.goes_with)

    decode: Callable[..., Any]
    encode: Callable[..., int]

    def __getattr__(self, name: str) -> Any:
        """Generate ``decode`` and ``encode`` when one of them is first used."""
        if name not in ("decode", "encode"):
            raise AttributeError(name)
        # Fields are the parameters of encode: the underscores keep these names different from theirs.
        space: dict[str, Any] = {key: getattr(self, key) for key in ("_refuse_word", "_refuse", "_encode_plain")}
        space["_values"] = self.values
        # It skips the constructor of the named tuple, which is half of the cost of a decode.
        space["_new"] = tuple.__new__
        exec(self._decode_source(space) + "\n" + self._encode_source(), space)
        self.decode, self.encode = space["decode"], space["encode"]
        return space[name]

    def field(self, name: str) -> Field:
        """Return the Field called ``name``. Raises WordError."""
        for field in self.fields:
            if field.name == name:
                return field
        raise WordError(self.name, name, ", ".join([field.name for field in self.fields]), "no-such-field")

    def computed(self, field: Field, word: int) -> int:
        """Return the value that the other bits of ``word`` give to a field with ``parity_masks``."""
        if field.needs and not word & self.field(field.needs).word_mask:
            return 0
        raw = 0
        for mask in field.parity_masks:
            raw = raw << 1 | bin(word & mask).count("1") & 1
        return raw

    def complete(self, word: int) -> int:
        """Return ``word`` with the right values in its computed fields."""
        for field in self.fields:
            if field.parity_masks:
                word = word & ~field.word_mask | self.computed(field, word) << field.low
        return word

    def warnings(self, word: int) -> list[Phrase]:
        """Return a Phrase, its key stable, for each field of ``word`` that has no effect or a wrong computed value."""
        phrases = []
        for field in self.fields:
            raw = word >> field.low & field.raw_mask
            without = field.needs and not word & self.field(field.needs).word_mask
            if field.parity_masks and raw != self.computed(field, word):
                key = "bad-reserved" if without else f"bad-{field.name}"
                details = {"field": field.name, "value": raw, "expected": self.computed(field, word)}
                phrases.append(Phrase(key, needs=field.needs, **details))
            elif field.reserved and raw > field.defined:
                phrases.append(Phrase("reserved-bits-set", field=field.name, value=raw))
            elif raw and without:
                phrases.append(Phrase("field-without-effect", field=field.name, value=raw, needs=field.needs))
        return phrases

    def _check_layout(self) -> None:
        high = WORD_BITS - 1
        for field in self.fields:
            if field.high != high:
                raise ValueError(f"{self.name}: field {field.name} begins at bit {field.high}, not at bit {high}")
            high = field.low - 1
        if high >= 0:
            raise ValueError(f"{self.name}: no field holds bits {high} to 0")
        names = [field.name for field in self.fields]
        for field in self.fields:
            for other in (field.needs, field.goes_with):
                if other and other not in names:
                    raise ValueError(f"{self.name}: field {field.name} names {other}, which is no field")
            if field.goes_with and not field.one_hot:
                raise ValueError(f"{self.name}: field {field.name} goes with {field.goes_with}, so it must be one-hot")

    def _decode_source(self, space: dict[str, Any]) -> str:
        refused = self._conditions("found.")
        unknown = [f"({_bits('word', field)}) > {field.defined}" for field in self.fields if field.reserved]
        if unknown:
            refused.append("strict and ({})".format(" or ".join(unknown)))
        lines = ["def decode(word, strict=False):"]
        lines.append("    if word >> 32: _refuse_word(word)")
        lines.append(f"    found = _new(_values, {self._decoded_runs(space)})")
        lines.append("    if {}: _refuse(found)".format(" or ".join(refused) or "False"))
        lines.append("    return found")
        return "\n".join(lines)

    def _decoded_runs(self, space: dict[str, Any]) -> str:
        """Return the source of a tuple of all raw values; put the tables that it needs into ``space``.

        A run of three or more narrow fields is looked up in a table of tuples, which halves the time to decode a
        control word.
        """
        runs: list[list[Field]] = []
        for field in self.fields:
            if runs and runs[-1][0].high - field.low < TABLE_BITS:
                runs[-1].append(field)
            else:
                runs.append([field])
        tuples = []
        for run in runs:
            whole = Field("run", run[0].high, run[-1].low, "")
            if len(run) < 3:
                tuples += ["({},)".format(_bits("word", field)) for field in run]
                continue
            table = f"table_{whole.low}"
            space[table] = [
                tuple(bits >> f.low - whole.low & f.raw_mask for f in run) for bits in range(whole.raw_mask + 1)
            ]
            tuples.append("{}[{}]".format(table, _bits("word", whole)))
        # Neighbours become one tuple.
        return " + ".join(tuples).replace(",) + (", ", ")

    def _encode_source(self) -> str:
        made = "({},)".format(", ".join([field.name for field in self.fields]))
        refused = " or ".join([f"bits >> {self._widest}", *self._conditions("")])
        # The upper half is combined before it is shifted: CPython is fastest with integers below 2^30.
        upper = [field for field in self.fields if field.low >= WORD_BITS // 2]
        lower = [field for field in self.fields if field.low < WORD_BITS // 2]
        word = _joined(lower, 0)
        if upper:
            word = f"({_joined(upper, WORD_BITS // 2)}) << {WORD_BITS // 2} | {word}"
        parameters = ", ".join([f"{field.name}={field.default}" for field in self.fields])
        return f"""
def encode({parameters}):
    try:
        bits = {self._aligned()}
        if type(bits) is not int: return _encode_plain({made})
        if {refused}: _refuse({made})
    except TypeError: _refuse({made})
    return {word}
"""

    @property
    def _widest(self) -> int:
        return max(field.width for field in self.fields)

    def _aligned(self) -> str:
        """Return the source of an integer that has a bit above those of the widest field where a value doesn't fit.

        Values of one width are combined, and shifted so that their first bits are where the widest field's is. What is
        no integer can't be combined, and of NumPy's numbers, which may be too narrow for a word, one of theirs comes.
        """
        groups = []
        for width in sorted({field.width for field in self.fields}):
            values = " | ".join([field.name for field in self.fields if field.width == width])
            groups.append(f"({values})" + _shift("<<", self._widest - width))
        return " | ".join(groups)

    def _conditions(self, prefix: str) -> list[str]:
        """Return sources that are true where values that fit are refused; ``prefix`` stands before a field's name."""
        conditions = []
        for field in self.fields:
            name = prefix + field.name
            if field.only:
                conditions.append(" and ".join([f"{name} != {value}" for value, _ in field.only]))
            if field.one_hot:
                conditions.append(f"{name} & ({name} - 1)")
            if field.minimum > 0:
                conditions.append(f"{name} < {field.minimum}")
            if field.maximum < field.raw_mask:
                conditions.append(f"{name} > {field.maximum}")
            if field.goes_with:
                conditions.append(f"({name} == 0) != ({prefix}{field.goes_with} == 0)")
        return conditions

    def _refuse_word(self, word: int) -> None:
        raise WordError(self.name, word, Phrase("values-from-to", minimum=0, maximum=WORD_MASK), "not-32-bits")

    def _encode_plain(self, raws: tuple[int, ...]) -> int:
        """Encode numbers of other kinds, such as NumPy's."""
        plain = tuple(map(_plain, raws))
        self._refuse(plain)
        return self.encode(*plain)

    def _refuse(self, raws: tuple[int, ...]) -> None:
        """Raise the WordError for the first of these values that is refused.

        Reserved bits come last: where there is another reason to refuse a word, the error gives that one.
        """
        by_name = dict(zip([field.name for field in self.fields], map(_plain, raws)))
        for field in self.fields:
            raw = by_name[field.name]
            if not isinstance(raw, int) or not field.allows(raw):
                raise WordError(field.name, raw, field.allowed)
        for field in self.paired:
            raw, other = by_name[field.name], by_name[field.goes_with]
            if (raw == 0) != (other == 0):
                raise WordError(field.name, raw, field.allowed_beside(other))
        for field in self.fields:
            if field.reserved and by_name[field.name] > field.defined:
                raise WordError(field.name, by_name[field.name], field.reserved_allowed)


def _plain(raw: Any) -> Any:
    """Return a whole number of another kind, such as NumPy's, as an int; all else as it is."""
    try:
        return raw.__index__()
    except (AttributeError, TypeError):
        return raw


def _joined(fields: list[Field], base: int) -> str:
    """Return the source of the bits of neighbouring fields, above bit ``base``.

    Each is added to twice, four times, ... the ones before: CPython is quicker at that than at shifts of each.
    """
    source = fields[0].name
    for field in fields[1:]:
        source = f"({source}) * {1 << field.width} + {field.name}"
    zeros = fields[-1].low - base
    return f"({source}) * {1 << zeros}" if zeros else source


def _bits(name: str, field: Field) -> str:
    """Return the source of the bits of ``field`` in the word called ``name``."""
    shifted = name + _shift(">>", field.low)
    return shifted if field.high == WORD_BITS - 1 else f"{shifted} & {field.raw_mask}"


def _shift(operator: str, bits: int) -> str:
    return f" {operator} {bits}" if bits else ""
