"""Images and their bytes, and what is refused."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.words.field import WordError
from motorcade.words.flow import CALL, CHANCE, COUNT, COUNTER, IN_TURN, JUMP, PERSON, RETURN, TELL, VOICE
from motorcade.words.formats import CONTROL, FLOW, STATE
from motorcade.words.image import Image, image_words, parse_image, parse_image_bytes, refused_image
from motorcade.words.packing import ImageError, bytes_to_words, words_to_bytes
from motorcade.words.upload import CarEnd

MOST = 255
LEVELS = st.integers(0, 7)
# Control words as an image holds them: bits 11-1 (reserved) and 0 (parity) are 0.
CONTROLS = st.integers(0, 0xFFFFF).map(lambda upper_bits: upper_bits << 12)
ROWS = st.lists(CONTROLS, max_size=6).map(tuple)
LONG_ROWS = st.builds(lambda word, count: (word,) * count, CONTROLS, st.sampled_from([MOST - 1, MOST]))


@st.composite
def images(draw):
    leader, followers = draw(ROWS | LONG_ROWS), draw(ROWS | LONG_ROWS)
    return Image(leader, followers, draw(LEVELS) if followers else -1, draw(st.integers(0, 1)) if followers else 0)


def image_bytes(image):
    return words_to_bytes(image_words(image))


def fault(data):
    """The code and the sentence of the ImageError that ``data`` gives."""
    with pytest.raises(ImageError) as caught:
        parse_image_bytes(data)
    return caught.value.code, str(caught.value)


@given(image=images())
def test_an_image_is_the_same_after_packing_and_parsing(image):
    data = image_bytes(image)
    assert len(data) == 4 * (1 + len(image.leader) + len(image.followers))
    assert parse_image_bytes(data) == image
    assert parse_image(bytes_to_words(data)) == image


@pytest.mark.parametrize(
    ("image", "data"),
    [
        (Image((), (), -1, 0), "00 00 00 00"),
        (Image((0x65800000,), (), -1, 0), "01 00 00 00  65 80 00 00"),
        (Image((), (0xA3000000,), 0, 0), "00 01 01 00  a3 00 00 00"),
        (Image((), (0xA3000000,), 7, 0), "00 01 80 00  a3 00 00 00"),
        (Image((), (0xA3000000,), 7, 1), "00 01 80 01  a3 00 00 00"),
        (Image((0x65800000,), (0xA3000000, 0x80000000), 2, 0), "01 02 04 00  65 80 00 00  a3 00 00 00  80 00 00 00"),
    ],
)
def test_the_bytes_of_an_image(image, data):
    assert image_bytes(image) == bytes.fromhex(data)
    assert parse_image_bytes(bytes.fromhex(data)) == image


@pytest.mark.parametrize(
    ("image", "field", "value"),
    [
        (Image((0,) * 256, (), -1, 0), "leader_states", 256),
        (Image((), (0,) * 256, 0, 0), "follower_words", 256),
        (Image((), (0,), 8, 0), "dwell", 256),
    ],
)
def test_what_a_header_cannot_hold_is_refused(image, field, value):
    with pytest.raises(WordError) as caught:
        image_words(image)
    assert (caught.value.field, caught.value.value) == (field, value)


@given(image=images(), data=st.data())
def test_an_image_that_is_cut_off_anywhere_is_refused(image, data):
    whole = image_bytes(image)
    part = whole[: data.draw(st.integers(0, len(whole) - 1))]
    assert fault(part)[0] == "image-cut-off"


def test_the_error_of_a_cut_off_image_counts_what_is_there():
    assert "announces 511 words, 2 are here" in fault(bytes.fromhex("ffff0100 40000000"))[1]
    assert "6 bytes" in fault(bytes.fromhex("ffff0100 4000"))[1]
    assert "empty" in fault(b"")[1]


@given(image=images(), more=st.lists(CONTROLS, min_size=1, max_size=3).map(tuple))
def test_an_image_that_is_too_long_is_refused(image, more):
    code, sentence = fault(image_bytes(image) + words_to_bytes(more))
    words = 1 + len(image.leader) + len(image.followers)
    assert code == "image-too-long"
    assert f"announces {words} word" in sentence
    assert f", {words + len(more)} are here" in sentence


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        ("00 01 03 00  80 00 00 00", "dwell is 3"),
        ("00 01 81 00  80 00 00 00", "dwell is 129"),
        ("00 01 00 00  80 00 00 00", "dwell is 0; allowed: exactly one bit"),
        ("01 00 01 00  40 00 00 00", "dwell is 1; allowed: 0, as there are no follower words"),
        ("00 00 80 00", "dwell is 128; allowed: 0, as there are no follower words"),
        ("01 00 00 01  40 00 00 00", "reserved is 1; allowed: 0, as there are no follower words"),
        ("00 01 01 04  80 00 00 00", "reserved is 4; allowed: 0 to 3"),
        ("00 01 01 02  80 00 00 00", "reserved is 2; allowed: 0, as there are no leader words"),
        ("01 00 00 03  40 00 00 00", "reserved is 3; allowed: 0, as there are no follower words"),
        ("00 00 00 ff", "reserved is 255"),
    ],
)
def test_the_error_of_a_bad_header_shows_the_word_and_the_reason(data, reason):
    header = bytes.fromhex(data)[:4]
    code, sentence = fault(bytes.fromhex(data))
    assert code == "image-header"
    assert reason in sentence
    assert f"0x{header.hex().upper()}" in sentence


@given(
    image=images().filter(lambda image: image.leader or image.followers),
    bit=st.integers(0, CONTROL.field("reserved").high),
    data=st.data(),
)
def test_a_reserved_or_parity_bit_in_any_word_is_refused_with_its_place(image, bit, data):
    words = list(image_words(image))
    place = data.draw(st.integers(1, len(words) - 1))
    words[place] |= 1 << bit
    code, sentence = fault(words_to_bytes(tuple(words)))
    assert code == "image-word"
    assert f"word {place} (0x{words[place]:08X})" in sentence
    assert ("parity is 1" if bit == 0 else f"reserved is {1 << bit - 1}") in sentence


@pytest.mark.parametrize("word", [-1, 1 << 32])
def test_an_image_holds_32_bit_words_only(word):
    for words in ((word,), (0x01000000, word)):
        with pytest.raises(ImageError, match="0 to 4294967295"):
            parse_image(words)


@st.composite
def damaged_images(draw):
    """An image's bytes with a few of them changed."""
    data = bytearray(image_bytes(draw(images())))
    for position, byte in draw(st.dictionaries(st.integers(0, 40), st.integers(0, 255), max_size=3)).items():
        data[position % len(data)] = byte
    return bytes(data)


def parsed(data):
    """The Image in ``data``, or the ImageError that says why it is none."""
    try:
        return parse_image_bytes(data)
    except ImageError as error:
        return error


@given(data=st.binary(max_size=64) | damaged_images())
def test_any_bytes_are_an_image_or_an_image_error(data):
    result = parsed(data)
    if isinstance(result, ImageError):
        assert result.code in {"image-cut-off", "image-too-long", "image-header", "image-word"}
        assert str(result).isprintable()
    else:
        assert image_bytes(result) == data


@pytest.mark.parametrize(
    "data", ["00 00 00 ff", "00 01 00 00  80 00 00 00", "01 00 00 00  40 00 00 01", "01 00 00 00  40 00 00 02"]
)
def test_an_image_error_is_found_again_from_its_brief_form(data):
    problem = parsed(bytes.fromhex(data))
    assert str(refused_image(problem.brief())) == str(problem)


def test_an_image_that_a_car_has_no_room_for_is_named_with_both_sizes():
    assert refused_image("image-too-large most=126 words=200").details == {"words": 200, "most": 126}


@pytest.mark.parametrize(
    "reason",
    ["", "busy", "image-word", "image-word word=x position=1", "image-header word", "image-word word=0 position=1"],
)
def test_another_reason_names_no_image_error(reason):
    assert refused_image(reason) is None


# Leaders that decide: the protocol's section "A leader that decides".


def state(**fields):
    return STATE.encode(forward=1, motor_enable=1, motor_speed=2, motor_duration=1, **fields)


GOOD_WORDS = [
    state(),
    *(state(until=until, until_not=1, until_level=level) for until, level in [(1, 3), (2, 0), (3, 1), (4, 3)]),
    FLOW.encode(op=JUMP, target=2),
    FLOW.encode(op=CALL, target=0, condition=COUNTER, if_not=1, level=2, counter=3, value=255),
    FLOW.encode(op=JUMP, target=1, condition=CHANCE, value=128),
    FLOW.encode(op=RETURN),
    FLOW.encode(op=COUNT, level=3, counter=3, value=255),
    FLOW.encode(op=TELL, target=1),
    FLOW.encode(op=TELL, target=IN_TURN),
    FLOW.encode(op=TELL, target=IN_TURN, value=2),
]
BAD_WORDS = [
    # word, the reason, in English and Chinese
    (0xD0000000, "op is 5; allowed: 0 (jump), or 1 (call)", "op 的值 5 无效"),
    (0xF0000000, "op is 7; allowed", "op 的值 7 无效"),
    (FLOW.encode(target=3), "target is 3; allowed: 0 to 2", "target 的值 3 无效；允许：0 至 2"),
    (FLOW.encode(op=CALL, target=254), "target is 254; allowed: 0 to 2", "target 的值 254 无效"),
    (FLOW.encode(op=TELL, target=2), "target is 2; allowed: 0 to 1, or 255 for in turn", "或 255（轮流）"),
    (FLOW.encode(op=TELL, target=IN_TURN, value=3), "value is 3; allowed: 0 to 2", "value 的值 3 无效"),
    (0x80070000, "condition is 7; allowed: 0 (always), or", "condition 的值 7 无效"),
    (FLOW.encode(condition=PERSON, level=1), "level is 1; allowed: 0 to 0", "level 的值 1 无效"),
    (FLOW.encode(condition=COUNTER, level=3), "level is 3; allowed: 0 to 2", "level 的值 3 无效"),
    (FLOW.encode(reserved=1), "reserved is 1; allowed: 0 (reserved)", "0（保留）"),
    (FLOW.encode(unused=1), "unused is 1; allowed: 0 (reserved)", "0（保留）"),
    (state(reserved=1), "reserved is 1; allowed: 0 (reserved)", "0（保留）"),
    (state() | COUNTER << 7, "until is 5; allowed: 0 (none), or", "until 的值 5 无效"),
    (state(until=VOICE, until_level=2), "until_level is 2; allowed: 0 to 1", "until_level 的值 2 无效"),
]


def deciding(word, reserved=3):
    """The bytes of an image whose second leader word is ``word``; it has three of them and two for followers."""
    return words_to_bytes((0x03020100 | reserved, state(), word, state(), 0x80280000, 0x80480000))


@pytest.mark.parametrize("word", GOOD_WORDS, ids=hex)
def test_an_image_of_a_leader_that_decides_is_the_same_after_packing_and_parsing(word):
    image = parse_image_bytes(deciding(word))
    assert image == Image((state(), word, state()), (0x80280000, 0x80480000), 0, 1, 1)
    assert image_bytes(image) == deciding(word)


@pytest.mark.parametrize(("word", "english", "chinese"), BAD_WORDS, ids=[hex(word) for word, _, _ in BAD_WORDS])
def test_a_leader_word_without_a_meaning_is_refused_with_its_place_and_a_sentence(word, english, chinese):
    problem = parsed(deciding(word))
    assert problem.code == "image-word"
    assert f"word 2 (0x{word:08X}) is not valid: {english}" in str(problem)
    assert chinese in problem.sentence("zh")
    assert str(refused_image(problem.brief())) == str(problem)


def test_a_tell_needs_tags():
    problem = parsed(deciding(FLOW.encode(op=TELL), reserved=2))
    assert "op is 4; allowed: 4 only where the follower words travel with a tag (reserved 3)" in str(problem)
    assert str(refused_image(problem.brief())) == str(problem)
    assert parsed(deciding(FLOW.encode(op=JUMP), reserved=2)).tagged == 0


@pytest.mark.parametrize("word", [word for word in GOOD_WORDS if CONTROL.decode(word).reserved])
def test_without_its_bit_in_the_header_no_leader_decides(word):
    for reserved in (0, 1):
        assert parsed(deciding(word, reserved)).code == "image-word"


@given(word=st.integers(0, 0xFFFFFFFF), reserved=st.integers(2, 3))
def test_the_receiver_of_a_car_and_the_check_of_an_image_refuse_the_same(word, reserved):
    data = deciding(word, reserved)
    car = CarEnd()
    car.receive_data(data, 0)
    answer = car.next_event().answer.decode()
    result = parsed(data)
    if isinstance(result, ImageError):
        assert answer == f"ERR {result.brief()}\n"
    else:
        assert answer.startswith("OK words=6 ")
