"""Encoding and decoding of the formats and of others, and what they refuse."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.words.field import Field, WordError, WordFormat
from motorcade.words.formats import CONTROL, DRIVE, FLOW, FORMATS, FRAME, HEADER, LIGHTS, STATE, format_named
from motorcade.words.infrared import check_is_good, tag_of, tagged_frame, to_frame

ANY_WORD = st.integers(0, 0xFFFFFFFF)
ONE_HOT = [1, 2, 4, 8, 16, 32, 64, 128]
NO_WORDS = [-(1 << 31), -1, 1 << 32, 1 << 40]

every_format = pytest.mark.parametrize("word_format", FORMATS, ids=lambda each: each.name)


def every_value(fields):
    return {field.name: st.integers(0, (1 << field.high - field.low + 1) - 1) for field in fields}


def good_values(word_format):
    """Values by name that make a good word, reserved bits included."""
    strategies = every_value(word_format.fields)
    if word_format is HEADER:
        none = st.just({"follower_words": 0, "dwell": 0})
        some = st.fixed_dictionaries({"follower_words": st.integers(1, 255), "dwell": st.sampled_from(ONE_HOT)})
        return st.builds(lambda any_value, pair: {**any_value, **pair}, st.fixed_dictionaries(strategies), none | some)
    if word_format is DRIVE:
        strategies |= {"code": st.just(1), "angle": st.integers(0, 180)}
    if word_format is LIGHTS:
        strategies |= {"code": st.just(2)}
    if word_format is STATE:
        strategies |= {"flow": st.just(0), "until": st.integers(0, 4)}
    if word_format is FLOW:
        strategies |= {"flow": st.just(1), "op": st.integers(0, 4), "condition": st.integers(0, 6)}
    return st.fixed_dictionaries(strategies)


def refusal(function, *args, error_code="word-value", **kwargs):
    """The field, value and allowed values that a WordError names; each must stand in its sentence too."""
    with pytest.raises(WordError) as caught:
        function(*args, **kwargs)
    error = caught.value
    assert error.code == error_code
    assert str(error).endswith(f" is {error.value!r}; allowed: {error.allowed}")
    assert error.field in str(error)
    return error.field, error.value, error.allowed


@every_format
@given(data=st.data())
def test_values_are_encoded_at_their_bits_and_decoded_again(word_format, data):
    values = data.draw(good_values(word_format))
    word = word_format.encode(**values)
    assert word_format.decode(word)._asdict() == values
    bits = f"{word:032b}"
    assert len(bits) == 32
    assert {field.name: int(bits[31 - field.high : 32 - field.low], 2) for field in word_format.fields} == values


@every_format
@given(word=ANY_WORD)
def test_any_word_is_refused_or_decoded_without_loss(word_format, word):
    try:
        values = word_format.decode(word)
    except WordError:
        return
    assert word_format.encode(**values._asdict()) == word


@pytest.mark.parametrize("word_format", [HEADER, CONTROL], ids=lambda each: each.name)
@given(data=st.data())
def test_reserved_bits_survive_unless_strict(word_format, data):
    field = word_format.field("reserved")
    reserved = data.draw(st.integers(field.defined + 1, field.raw_mask))
    word = word_format.encode(**{**data.draw(good_values(word_format)), "reserved": reserved})
    decoded = word_format.decode(word)
    assert decoded.reserved == reserved
    assert refusal(word_format.decode, word, strict=True) == ("reserved", reserved, str(field.reserved_allowed))
    good = word & ~field.word_mask
    assert word_format.decode(good, strict=True) == word_format.decode(good)


@pytest.mark.parametrize(
    ("word_format", "word"), [(HEADER, 0), (CONTROL, 0), (STATE, 0), (FLOW, 1 << 31), (DRIVE, 0x15A00000)]
)
def test_a_field_that_is_left_out_has_its_default(word_format, word):
    assert word_format.encode() == word


@every_format
@pytest.mark.parametrize("word", NO_WORDS)
def test_a_number_of_more_than_32_bits_is_refused(word_format, word):
    assert refusal(word_format.decode, word, error_code="not-32-bits") == (word_format.name, word, "0 to 4294967295")


@every_format
@given(data=st.data())
def test_a_value_that_does_not_fit_its_field_is_refused_by_name(word_format, data):
    good, field = data.draw(good_values(word_format)), data.draw(st.sampled_from(word_format.fields))
    value = data.draw(st.integers(max_value=-1) | st.integers(min_value=field.maximum + 1))
    assert refusal(word_format.encode, **{**good, field.name: value})[:2] == (field.name, value)


HOT = "0, or one of 1, 2, 4, 8, 16, 32, 64, 128 (exactly one bit)"
REFUSED = [
    # word, values, the field at fault, what it may hold
    (HEADER, 0x01010300, {"leader_states": 1, "follower_words": 1, "dwell": 3}, "dwell", HOT),
    (HEADER, 0x0001FF00, {"follower_words": 1, "dwell": 255}, "dwell", HOT),
    (HEADER, 0x01010000, {"leader_states": 1, "follower_words": 1, "dwell": 0}, "dwell", "exactly one bit"),
    (HEADER, 0x01000200, {"leader_states": 1, "dwell": 2}, "dwell", "0, as there are no follower words"),
    (STATE, 0x00000280, {"until": 5}, "until", "0 (none), or 1 (obstacle), or 2 (person), or 3 (voice), or 4 (floor)"),
    (FLOW, 0xD0000000, {"op": 5}, "op", "0 (jump), or 1 (call), or 2 (return), or 3 (count), or 4 (tell)"),
    (DRIVE, 0x1B500000, {"angle": 181}, "angle", "0 to 180"),
    (DRIVE, 0x25A00000, {"code": 2}, "code", "1 (speed and direction)"),
    (DRIVE, 0x00000000, {"code": 0, "angle": 0}, "code", "1 (speed and direction)"),
]


@pytest.mark.parametrize(("word_format", "word", "values", "field", "allowed"), REFUSED)
def test_a_refusal_names_field_value_and_what_is_allowed(word_format, word, values, field, allowed):
    expected = (field, values[field], allowed)
    assert refusal(word_format.decode, word) == expected
    assert refusal(word_format.encode, **values) == expected


def test_a_name_that_is_no_field_is_refused():
    with pytest.raises(TypeError, match="gait"):
        DRIVE.encode(gait=1)
    with pytest.raises(AttributeError, match="gait"):
        _ = DRIVE.gait
    assert refusal(DRIVE.field, "gait", error_code="no-such-field") == (
        "drive",
        "gait",
        "code, angle, direction, speed, reserved",
    )


def test_a_format_is_found_by_its_name():
    assert [format_named(name) for name in ("header", "control", "state", "flow", "drive", "lights", "frame")] == [
        HEADER,
        CONTROL,
        STATE,
        FLOW,
        DRIVE,
        LIGHTS,
        FRAME,
    ]
    assert refusal(format_named, "gait") == ("format", "gait", "header, control, state, flow, drive, lights, frame")


@pytest.mark.parametrize(
    ("word_format", "word", "sentences"),
    [
        (CONTROL, 0x18000000, ["motor_direction is 3, yet motor_enable is 0: it has no effect"]),
        (CONTROL, 0x06000000, ["motor_speed is 3, yet motor_enable is 0: it has no effect"]),
        (CONTROL, 0x00800000, ["motor_duration is 1, yet motor_enable is 0: it has no effect"]),
        (
            CONTROL,
            0x00014000,
            [
                "avoid_radius is 1, yet avoid_enable is 0: it has no effect",
                "avoid_duration is 1, yet avoid_enable is 0: it has no effect",
            ],
        ),
        (CONTROL, 0x00000002, ["reserved is 1, yet these bits are written 0"]),
        (HEADER, 0x000000FF, ["reserved is 255, yet these bits are written 0"]),
        (DRIVE, 0x100007FF, []),
        # All that a word may say, its parity as the air sets it.
        (CONTROL, 0xFFFFF001, []),
        (HEADER, 0xFFFF8000, []),
    ],
)
def test_bits_without_effect_are_decoded_with_a_warning(word_format, word, sentences):
    word_format.decode(word)
    assert [str(warning) for warning in word_format.warnings(word)] == sentences


# Words on the air


@given(word=ANY_WORD, tag=st.integers(0, 31))
def test_a_frame_is_completed_as_a_car_sends_it(word, tag):
    actions = word & 0xFFFFF800
    sent = tagged_frame(actions, tag) if tag else to_frame(actions)
    # What stands at check and parity before doesn't matter.
    assert FRAME.complete(actions | tag << 6 | word & 0x3F) == sent
    assert FRAME.decode(sent).tag == tag
    assert codes(sent) == []


def codes(word):
    return [warning.key for warning in FRAME.warnings(word) if warning.key.startswith("bad-")]


@given(word=ANY_WORD)
def test_a_frame_is_warned_of_exactly_where_a_follower_drops_it(word):
    expected = []
    if tag_of(word) == 0 and word & 0x3E:
        expected.append("bad-reserved")
    elif tag_of(word) and not check_is_good(word):
        expected.append("bad-check")
    if word.bit_count() % 2:
        expected.append("bad-parity")
    assert codes(word) == expected


@pytest.mark.parametrize(
    ("word", "sentence"),
    [
        (0x80280177, "check is 27, but bits 31 to 6 give 28: a follower drops this frame"),
        (0x80280179, "parity is 1, but the other bits give 0: a follower drops this frame"),
        (0x80280002, "check is 1, but tag is 0: these bits are reserved in a bare word, a follower drops this frame"),
    ],
)
def test_a_warning_of_a_frame_names_what_would_be_right(word, sentence):
    assert [str(warning) for warning in FRAME.warnings(word)] == [sentence]


# Formats of one's own


def declared(*places):
    return WordFormat("own", [Field(name, high, low, "for a test") for name, high, low in places])


@pytest.mark.parametrize(
    ("places", "reason"),
    [
        ([("upper", 31, 16), ("lower", 16, 0)], "lower begins at bit 16, not at bit 15"),
        ([("upper", 31, 17), ("lower", 15, 0)], "lower begins at bit 15, not at bit 16"),
        ([("upper", 31, 16), ("lower", 15, 1)], "no field holds bits 0 to 0"),
        ([("upper", 30, 16), ("lower", 15, 0)], "upper begins at bit 30, not at bit 31"),
        ([], "no field holds bits 31 to 0"),
        ([("upper", 32, 16), ("lower", 15, 0)], "bits 32-16 are not in a 32-bit word"),
        ([("upper", 31, 16), ("lower", 15, -1)], "bits 15--1 are not in a 32-bit word"),
        ([("upper", 31, 16), ("lower", 0, 15)], "bits 0-15 are not in a 32-bit word"),
        # Most significant first: the tables that decode by runs of fields rely on it.
        ([("a", 31, 24), ("d", 7, 0), ("b", 15, 8), ("c", 23, 16)], "field d begins at bit 7, not at bit 23"),
    ],
)
def test_a_format_whose_fields_make_no_word_cannot_be_defined(places, reason):
    with pytest.raises(ValueError, match=reason):
        declared(*places)


def test_a_field_that_goes_with_another_has_a_bit_for_each_value():
    """The sentence for a value that is refused says 'exactly one bit'."""
    fields = [Field("most", 31, 1, "for a test", goes_with="legs"), Field("legs", 0, 0, "for a test")]
    with pytest.raises(ValueError, match="most goes with legs, so it must be one-hot"):
        WordFormat("own", fields)


@pytest.mark.parametrize("link", ["needs", "goes_with"])
def test_a_format_with_a_link_to_a_missing_field_cannot_be_defined(link):
    with pytest.raises(ValueError, match="field most names leg, which is no field"):
        WordFormat("own", [Field("most", 31, 1, "for a test", **{link: "leg"}), Field("legs", 0, 0, "for a test")])
