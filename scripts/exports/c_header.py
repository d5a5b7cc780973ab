"""Make a header for C99 and C++ that encodes, decodes and checks words, from a 16-bit AVR to a desktop computer.

It only shifts uint32_t by fewer than 32 bits, so neither the width of int nor the order of bytes or of bit fields
matters. What is the same for all formats is in `templates/c_header.h`.
"""

from motorcade.words.field import WORD_MASK, Field, WordFormat
from motorcade.words.formats import FORMATS

from .fields import FILE_STEM, field_notes, fingerprint_text
from .templates import filled_template

_TYPE_BITS = (8, 16, 32)


def c_header() -> str:
    """Return the text of the header."""
    first = FORMATS[0]
    return filled_template(
        "c_header.h",
        NAMES=", ".join(word_format.name for word_format in FORMATS),
        FIRST=_prefix(first),
        FIRST_CAPITALS=_prefix(first).upper(),
        FIRST_FIELD=first.fields[0].name,
        GUARD=f"{FILE_STEM.upper()}_H",
        FORMATS="\n".join(_format(word_format) for word_format in FORMATS),
    )


def _prefix(word_format: WordFormat) -> str:
    return f"motorcade_{word_format.name}"


def _fault(word_format: WordFormat, field: Field) -> str:
    return f"{_prefix(word_format)}_FAULT_{field.name}".upper()


def _type_bits(field: Field) -> int:
    return next(bits for bits in _TYPE_BITS if field.width <= bits)


def _left(value: str, bits: int) -> str:
    return f"{value} << {bits}" if bits else value


def _right(value: str, bits: int) -> str:
    return f"{value} >> {bits}" if bits else value


def _comment(text: str) -> str:
    """Change ``text`` so that it neither ends a comment nor begins another."""
    return text.replace("*/", "* /").replace("/*", "/ *")


def _format(word_format: WordFormat) -> str:
    prefix = _prefix(word_format)
    capitals = prefix.upper()
    members = []
    for field in word_format.fields:
        bits = f"bits {field.high}-{field.low}" if field.width > 1 else f"bit {field.high}"
        members.append(f"    uint{_type_bits(field)}_t {field.name}; /* {bits}: {_comment(field_notes(field))} */")
    faults = [f"    {capitals}_OK = 0", *(f"    {_fault(word_format, field)}" for field in word_format.fields)]
    defaults = ", ".join(str(field.default) for field in word_format.fields)
    return "\n".join(
        [
            f"/* {word_format.name} */",
            "",
            "/* Two ends with the same fingerprint give these words the same meaning. */",
            f"#define {capitals}_FINGERPRINT {fingerprint_text(word_format)}UL",
            f"#define {capitals}_DEFAULTS {{ {defaults} }}",
            "",
            f"struct {prefix} {{",
            *members,
            "};",
            "",
            f"enum {prefix}_fault {{",
            ",\n".join(faults),
            "};",
            "",
            _check(word_format),
            _encode(word_format),
            _decode(word_format),
            *_computed(word_format),
        ]
    )


def _check(word_format: WordFormat) -> str:
    prefix = _prefix(word_format)
    lines = []
    for field in word_format.fields:
        if condition := _refused(field):
            lines.append(f"    if ({condition}) return {_fault(word_format, field)};")
    for field in word_format.paired:
        condition = f"(values->{field.name} == 0) != (values->{field.goes_with} == 0)"
        lines.append(f"    if ({condition}) return {_fault(word_format, field)};")
    return f"""\
/* Return ..._OK where `values` make a word, else the first field at fault. */
static inline enum {prefix}_fault {prefix}_check(const struct {prefix} *values)
{{
{chr(10).join(lines)}
    return {prefix.upper()}_OK;
}}
"""


def _refused(field: Field) -> str:
    """Return a condition that is true for a refused value; empty where every value of the C type is allowed."""
    value = f"values->{field.name}"
    conditions = []
    if field.only:
        conditions.append(" && ".join(f"{value} != {raw}UL" for raw, _ in field.only))
    if field.one_hot:
        conditions.append(f"({value} & ({value} - 1U)) != 0")
    if field.minimum > 0:
        conditions.append(f"{value} < {field.minimum}UL")
    most = min(field.maximum, field.raw_mask)
    if most < (1 << _type_bits(field)) - 1:
        conditions.append(f"{value} > {most}UL")
    if len(conditions) > 1:
        return " || ".join(f"({condition})" for condition in conditions)
    return "".join(conditions)


def _encode(word_format: WordFormat) -> str:
    prefix = _prefix(word_format)
    shifted = [_left(f"(uint32_t)values->{field.name}", field.low) for field in word_format.fields]
    made = "\n          | ".join(shifted)
    return f"""\
/* Write the word that holds `values` to `word`; leave `word` unchanged where a field is at fault. */
static inline enum {prefix}_fault {prefix}_encode(const struct {prefix} *values, uint32_t *word)
{{
    const enum {prefix}_fault fault = {prefix}_check(values);
    if (fault != {prefix.upper()}_OK) return fault;
    *word = {made};
    return {prefix.upper()}_OK;
}}
"""


def _computed(word_format: WordFormat) -> list[str]:
    """Return the functions of the fields that are computed from others; none where there are no such fields."""
    prefix = _prefix(word_format)
    fields = [field for field in word_format.fields if field.parity_masks]
    if not fields:
        return []
    functions = []
    for field in fields:
        name, result = f"{prefix}_{field.name}", f"uint{_type_bits(field)}_t"
        bits = [f"motorcade_is_odd(word & 0x{mask:08X}UL)" for mask in field.parity_masks]
        made = "\n        | ".join(_left(bit, len(bits) - 1 - number) for number, bit in enumerate(bits))
        lines = [f"    return ({result})({made});"]
        if field.needs:
            lines.insert(0, f"    if ((word & 0x{word_format.field(field.needs).word_mask:08X}UL) == 0) return 0;")
        functions.append(
            f"""\
/* Return the value of `{field.name}` that belongs to the other bits of `word`. */
static inline {result} {name}_of(uint32_t word)
{{
{chr(10).join(lines)}
}}

/* Return 1 where `word` holds that value, else 0. */
static inline int {name}_is_good(uint32_t word)
{{
    return ({_right("word", field.low)} & 0x{field.raw_mask:X}UL) == {name}_of(word);
}}
"""
        )
    steps = [
        f"    word = (uint32_t)(word & 0x{WORD_MASK & ~field.word_mask:08X}UL)"
        f" | {_left(f'(uint32_t){prefix}_{field.name}_of(word)', field.low)};"
        for field in fields
    ]
    names = " and ".join(f"`{field.name}`" for field in fields)
    functions.append(
        f"""\
/* Return `word` with the right {names}. */
static inline uint32_t {prefix}_complete(uint32_t word)
{{
{chr(10).join(steps)}
    return word;
}}
"""
    )
    return functions


def _decode(word_format: WordFormat) -> str:
    prefix = _prefix(word_format)
    lines = []
    for field in word_format.fields:
        raw = f"{_right('word', field.low)} & 0x{field.raw_mask:X}UL"
        lines.append(f"    values->{field.name} = (uint{_type_bits(field)}_t)({raw});")
    strict = [
        f"    if (strict && values->{field.name} > {field.defined}) return {_fault(word_format, field)};"
        for field in word_format.fields
        if field.reserved
    ] or ["    (void)strict;"]
    return f"""\
/* Read the fields of `word` into `values`, also where one of them is at fault. */
static inline enum {prefix}_fault {prefix}_decode(uint32_t word, int strict, struct {prefix} *values)
{{
    enum {prefix}_fault fault;
{chr(10).join(lines)}
    fault = {prefix}_check(values);
    if (fault != {prefix.upper()}_OK) return fault;
{chr(10).join(strict)}
    return {prefix.upper()}_OK;
}}
"""
