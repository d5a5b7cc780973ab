"""The JSON Schema, the golden vectors and the pages."""

import json

import jsonschema_rs
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scripts.exports import exported_files
from scripts.exports.fields import fingerprint_text
from scripts.exports.markdown import bit_diagram
from scripts.exports.schemas import json_schema
from scripts.exports.vectors import vectors

from motorcade.words.field import WordError
from motorcade.words.formats import DRIVE, FORMATS, FRAME
from motorcade.words.image import parse_image_bytes
from motorcade.words.infrared import parity_is_even

every_format = pytest.mark.parametrize("word_format", FORMATS, ids=lambda each: each.name)


def encodes(word_format, values):
    try:
        return word_format.encode(**values)
    except WordError:
        return None


# All files


@pytest.mark.parametrize("name", [name for name in exported_files() if "words" in name])
def test_an_exported_file_is_text_that_names_the_fingerprints(name):
    text = exported_files()[name]
    assert text.endswith("\n")
    assert not text.endswith("\n\n")
    assert "\r" not in text
    for word_format in FORMATS:
        assert fingerprint_text(word_format).lower() in text.lower()


# JSON Schema


SCHEMA = json.loads(json_schema())
SCHEMAS = {each.name: jsonschema_rs.validator_for(SCHEMA["$defs"][each.name]) for each in FORMATS}


def test_the_schema_is_one():
    jsonschema_rs.meta.validate(SCHEMA)


@every_format
@given(data=st.data())
def test_the_schema_accepts_just_what_can_be_encoded(word_format, data):
    values = word_format.decode(word_format.encode())._asdict()
    for name in data.draw(st.lists(st.sampled_from(list(values)), max_size=4)):
        field = word_format.field(name)
        near = st.sampled_from([-1, 0, 1, 2, 4, field.minimum, field.maximum, field.maximum + 1, field.raw_mask + 1])
        values[name] = data.draw(near | st.integers(-2, field.raw_mask + 2))
    assert SCHEMAS[word_format.name].is_valid(values) == (encodes(word_format, values) is not None)


def test_the_schema_refuses_what_is_missing_misspelt_or_no_whole_number():
    values = DRIVE.decode(DRIVE.encode())._asdict()
    whole = jsonschema_rs.validator_for(SCHEMA)
    assert whole.is_valid(values)
    for wrong in ({"angle": 90}, {**values, "sped": 1}, {**values, "speed": 1.5}, {**values, "speed": "1"}, [], 1):
        assert not SCHEMAS["drive"].is_valid(wrong)
        assert not whole.is_valid(wrong)


# Golden vectors


def test_the_vectors_hold():
    document = json.loads(vectors())
    formats = {word_format.name: word_format for word_format in FORMATS}
    words = [*document["words"], *(word for each in document.get("errata", ()) for word in each["words"])]
    for each in words:
        word_format = formats[each["format"]]
        assert word_format.encode(**each["fields"]) == each["word"] == int(each["hex"], 16) == int(each["bytes"], 16)
        assert word_format.decode(each["word"])._asdict() == each["fields"]
        reserved = [field for field in word_format.fields if field.reserved]
        assert all(each["fields"][field.name] <= field.defined for field in reserved) == each["strict"]
        assert [str(warning) for warning in word_format.warnings(each["word"])] == each["warnings"]
        assert [warning.key for warning in word_format.warnings(each["word"])] == each["warning_codes"]
        assert each.get("complete", each["word"]) == word_format.complete(each["word"])
    for each in document["refused_words"]:
        with pytest.raises(WordError) as caught:
            formats[each["format"]].decode(each["word"], each["strict"])
        assert (caught.value.field, caught.value.value) == (each["field"], each["value"])
    for each in document["refused_fields"]:
        with pytest.raises(WordError) as caught:
            formats[each["format"]].encode(**each["fields"])
        assert (caught.value.field, caught.value.value) == (each["field"], each["value"])


@every_format
def test_the_vectors_meet_every_field_at_its_limits_and_every_bit(word_format):
    document = json.loads(vectors())
    words = [each for each in document["words"] if each["format"] == word_format.name]
    unrestricted = []
    for field in word_format.fields:
        seen = {each["fields"][field.name] for each in words}
        allowed = [raw for raw in range(field.raw_mask + 1) if field.allows(raw)]
        assert min(allowed) in seen
        assert max(seen) == max(allowed)
        if len(allowed) > field.raw_mask:
            assert {1 << bit for bit in range(field.width)} <= seen
            unrestricted.append(field)
    refused = {each["field"] for each in document["refused_words"] if each["format"] == word_format.name}
    can_be_refused = [field for field in word_format.fields if field not in unrestricted or field.goes_with]
    can_be_refused += [field for field in word_format.fields if field.reserved and field.defined < field.raw_mask]
    assert refused == {field.name for field in can_be_refused}
    assert len({each["word"] for each in words}) == len(words)


def test_the_vectors_hold_images_and_frames():
    document = json.loads(vectors())
    for each in document["images"]:
        leader, followers, dwell_level, tagged, decides = parse_image_bytes(bytes.fromhex(each["bytes"]))
        assert [f"0x{word:08X}" for word in leader] == each["leader"]
        assert [f"0x{word:08X}" for word in followers] == each["followers"]
        assert (dwell_level, bool(tagged)) == (each["dwell_level"], each["tagged"])
        assert bool(decides) == each["decides"]
    assert "02000000658000006a800000" in {each["bytes"] for each in document["images"]}
    by_word = {each["word"]: each for each in document["infrared"] if not each["tag"]}
    # All zeros is the shortest frame, all ones the longest (protocol: 49.84 and 85.68 ms).
    assert by_word["0x00000000"]["air_us"] == 49_840
    assert by_word["0xFFFFFFFF"]["air_us"] == 85_680
    for each in document["infrared"]:
        assert sum(each["durations_us"]) == each["air_us"]
        assert parity_is_even(int(each["frame"], 16))
    for each in document["infrared"]:
        if each["tag"]:
            assert FRAME.decode(int(each["frame"], 16)).tag == each["tag"]
            assert [warning.key for warning in FRAME.warnings(int(each["frame"], 16))] == []
    assert {each["tag"] for each in document["infrared"]} == {0, 1, 2, 30, 31}


# Pages


def test_a_diagram_shows_each_field_at_its_bits():
    tens, ones, border, boxes, again = bit_diagram(DRIVE).splitlines()
    assert border == again == "+-------+---------------+-+---------------+---------------------+"
    assert boxes == "|   A   |       B       |C|       D       |          E          |"
    for letter, field in zip("ABCDE", DRIVE.fields, strict=True):
        for bit in (field.high, field.low):
            column = 2 * (31 - bit) + 1
            assert int((tens.ljust(65)[column] + ones.ljust(65)[column]).strip()) == bit
        assert 2 * (31 - field.high) < boxes.index(letter) < 2 * (32 - field.low)
