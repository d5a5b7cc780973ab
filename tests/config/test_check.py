"""The check of a document against its schema, held against a validator of JSON Schema that others made."""

import jsonschema_rs
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.config.check import check, choice, flag, line, list_of, load, number, published, table, whole
from motorcade.config.files import parse
from motorcade.errors import MotorcadeError
from motorcade.locales import languages
from motorcade.mats.schema import mat_schema
from motorcade.missions.schema import mission_schema
from motorcade.program.schema import program_schema

STEP = {
    "type": "object",
    "properties": {"wait": number(0, 10), "steps": {"type": "array", "items": {"$ref": "#/$defs/step"}}},
    "oneOf": [{"required": ["wait"]}, {"required": ["steps"]}],
    "additionalProperties": False,
}
SCHEMA = table(
    ("at", "pair", "size"),
    name=line(10),
    count=whole(1, 5, default=2),
    edge=choice("open", "wall", default="open"),
    on=flag(default=False),
    at=list_of(number(-1, 1), 2, 2),
    pair={"type": "array", "prefixItems": [number(0, 1)], "items": whole(0, 3), "maxItems": 3},
    size={"type": ["number", "null"], "exclusiveMinimum": 0, "maximum": 9},
    steps={"type": "array", "items": {"$ref": "#/$defs/step"}, "default": []},
    inner=table(depth=whole(0, 9, default=4)) | {"default": {}},
) | {"dependentRequired": {"at": ["size"]}, "$defs": {"step": STEP}}
ORACLE = jsonschema_rs.validator_for(published(SCHEMA))

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-2, 11) | st.floats(-2, 11) | st.sampled_from(["open", "wall", "a", ""]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["wait", "steps", "depth"]), inner),
    max_leaves=6,
)
DOCUMENTS = st.dictionaries(st.sampled_from([*SCHEMA["properties"], "more"]), VALUES).map(
    lambda document: {"name": "n", **document}
)


def first_fault(document, schema=SCHEMA):
    with pytest.raises(MotorcadeError) as caught:
        load({"name": "n", **document}, schema, "it.toml")
    assert all(caught.value.sentence(language) for language in languages())
    return str(caught.value)


@given(DOCUMENTS)
def test_the_same_documents_are_good_as_for_another_validator_also_with_their_defaults(document):
    value, faults = check(document, SCHEMA)
    assert (faults == []) == ORACLE.is_valid(document)
    for fault in faults:
        assert all(fault.error("it.toml").sentence(language) for language in languages())
    if not faults:
        assert ORACLE.is_valid(value)
        assert check(value, SCHEMA) == (value, [])


def test_defaults_are_filled_in_on_every_level_and_a_whole_number_with_a_point_becomes_an_integer():
    defaults = {"count": 2, "edge": "open", "on": False, "steps": [], "inner": {"depth": 4}}
    assert load({"name": "n"}, SCHEMA, "it.toml") == {"name": "n", **defaults}
    count = load({"name": "n", "count": 3.0}, SCHEMA, "it.toml")["count"]
    assert (count, type(count)) == (3, int)


@pytest.mark.parametrize(
    ("document", "sentence"),
    [
        ({"cuont": 3, "count": 9}, "it.toml: cuont is not known; known are name, count, edge, on, at"),
        ({"a\tb": 3}, r"it.toml: 'a\tb' is not known"),
        ({"a" * 99: 3}, f"it.toml: '{'a' * 40}' is not known"),
        ({"count": 9}, "it.toml: count is 9; allowed: a whole number from 1 to 5"),
        ({"count": True}, "it.toml: count is true; allowed: a whole number from 1 to 5"),
        ({"count": 10**5000}, "it.toml: count is a very long number; allowed: a whole number from 1 to 5"),
        ({"size": float("nan")}, "it.toml: size is nan; allowed: a number above 0, up to 9, or null"),
        ({"edge": "moat"}, 'it.toml: edge is "moat"; allowed: "open", "wall"'),
        ({"name": "a\tb"}, r'it.toml: name is "a\tb"; allowed: a line of 1 to 10 characters in quotation marks'),
        ({"name": "\u202e"}, r'it.toml: name is "\u202e"; allowed: a line'),
        ({"at": [0, 2], "size": 1}, "it.toml: at[1] is 2; allowed: a number from -1 to 1"),
        ({"at": [0], "size": 1}, "it.toml: at is [0]; allowed: a list of 2, each a number from -1 to 1"),
        ({"at": [0, 0]}, "it.toml: size is missing; give a number above 0, up to 9, or null"),
        ({"inner": 3}, "it.toml: inner is 3; allowed: a table {...} of depth"),
        ({"inner": {"depht": 3}}, "it.toml: inner.depht is not known; known are depth"),
        ({"steps": [{}]}, "it.toml: steps[0] needs one of wait, steps"),
        ({"steps": [{"wait": 1, "steps": []}]}, "it.toml: steps[0] has wait, steps; keep one of wait, steps"),
        ({"steps": [{"steps": [{"wait": 11}]}]}, "it.toml: steps[0].steps[0].wait is 11; allowed: a number from 0"),
    ],
)
def test_the_first_fault_is_told_with_its_place_and_what_is_allowed(document, sentence):
    assert first_fault(document).startswith(sentence)


def test_a_text_without_bounds_may_be_empty():
    schema = table(("note",), name=line(10), note={"type": "string"})
    assert load({"name": "n", "note": ""}, schema, "it.toml")["note"] == ""


def test_a_value_may_be_told_by_a_phrase_of_its_own_with_a_unit_and_be_unique():
    schema = table(
        ("own", "far"),
        name=line(10),
        own=whole(0, 3, **{"x-allowed": ["list-of", {"count": 2, "items": "x"}]}),
        far=list_of(whole(0, 9, **{"x-unit": "boolean"}), uniqueItems=True),
    )
    assert first_fault({"own": 4}, schema).endswith("own is 4; allowed: a list of 2, each x")
    assert first_fault({"far": [10]}, schema).endswith("allowed: a whole number from 0 to 9 true or false")
    assert first_fault({"far": [1, 2, 1]}, schema).startswith("it.toml: far[2] is 1, which is in the list already")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ('name = "n"\n\n[inner]\ndepth = 10\n', "it.toml, line 4: inner.depth is 10"),
        ("\n\n", "it.toml, line 1: name is missing"),
    ],
)
def test_a_fault_in_toml_may_name_its_line(text, sentence):
    fault = check(parse(text, "TOML", "it.toml"), SCHEMA)[1][0]
    assert str(fault.error("it.toml", text)).startswith(sentence)


# Those that `check` reads, and those that say nothing about a document.
KEYWORDS = {
    *("$schema", "$defs", "$ref", "title", "description", "default", "type", "enum", "x-allowed", "x-unit"),
    *("minimum", "maximum", "exclusiveMinimum", "minLength", "maxLength", "pattern", "format"),
    *("items", "prefixItems", "minItems", "maxItems", "uniqueItems"),
    *("properties", "propertyNames", "required", "additionalProperties", "oneOf", "not", "dependentRequired"),
    *("if", "then", "else"),
}


def keywords_in(schema):
    for key, value in schema.items():
        yield key
        if key in ("properties", "$defs"):
            for part in value.values():
                yield from keywords_in(part)
        for part in (value if isinstance(value, list) else [value]) if key in ("items", "prefixItems", "oneOf") else ():
            yield from keywords_in(part)


@pytest.mark.parametrize("schema", [SCHEMA, mat_schema(), program_schema(), mission_schema()])
def test_every_keyword_of_a_schema_is_one_that_is_checked(schema):
    assert set(keywords_in(schema)) <= KEYWORDS


NO_CHARACTER = "is no character of TOML; type it with an English keyboard"


@pytest.mark.parametrize(
    ("data", "kind", "sentence"),
    [
        (b"\xff\xfe\x00", "TOML", "it is not TOML: it is not text in UTF-8 or UTF-16"),
        ("b = 1\na = “x”", "TOML", f"it is not TOML: line 2, column 5: “ {NO_CHARACTER}"),
        ("a = [1，2]", "TOML", f"it is not TOML: line 1, column 7: ， {NO_CHARACTER}"),
        ("a = ", "TOML", "it is not TOML: Invalid value (at its end, line 1)"),
        ("a = 1\na = 2", "TOML", "it is not TOML: Cannot overwrite a value (at its end, line 2)"),
        ("a = " + "9" * 5000, "TOML", "it is not TOML: it has a number with thousands of digits"),
        ("a = " + "[" * 100_000, "TOML", "it is not TOML: its brackets are nested too deeply"),
        ("a." * 200 + "a = 1", "TOML", "it is not TOML: its brackets are nested too deeply"),
        ('{"a": }', "JSON", "it is not JSON: line 1, column 7: a value is missing"),
        ('{"a": 1,}', "JSON", "it is not JSON: line 1, column 9: a key in double quotation marks is missing"),
        ('{"a": 1 "b": 2}', "JSON", "it is not JSON: line 1, column 9: a comma is missing"),
        ('{"a" 1}', "JSON", "it is not JSON: line 1, column 6: a colon is missing"),
        ("{} {}", "JSON", "it is not JSON: line 1, column 4: there is more text after the end"),
        ('["a', "JSON", "it is not JSON: line 1, column 2: a text has no closing quotation mark"),
        ('["a\nb"]', "JSON", "it is not JSON: line 1, column 4: a text has a line break or a tab"),
        (r'["\a"]', "JSON", "it is not JSON: line 1, column 3: a backslash is followed by what it can't be"),
        ('{"a": NaN}', "JSON", "it is not JSON: NaN is not a number of JSON's"),
        ('{"a": ' + "9" * 5000 + "}", "JSON", "it is not JSON: it has a number with thousands of digits"),
        ("[" * 100_000, "JSON", "it is not JSON: its brackets are nested too deeply"),
        ("[" * 200 + "]" * 200, "JSON", "it is not JSON: its brackets are nested too deeply"),
        ('{"a": "\\ud800"}', "JSON", "it is not JSON: it is not text in UTF-8 or UTF-16"),
        (r'{"\ud800": 1, "\ud800": 2}', "JSON", "it is not JSON: it is not text in UTF-8 or UTF-16"),
        ('{"a": 1, "b": {"c": 1, "c": 2}}', "JSON", "it: the key 'c' is twice in one pair of braces; keep one of them"),
    ],
)
def test_text_that_is_no_document_is_refused_with_the_reason(data, kind, sentence):
    with pytest.raises(MotorcadeError) as caught:
        parse(data, kind, "it")
    assert str(caught.value).startswith(sentence)
    assert all(caught.value.sentence(language) for language in languages())


def test_a_byte_order_mark_is_not_part_of_the_document():
    assert parse(b"\xef\xbb\xbf{}", "JSON", "it") == {}
