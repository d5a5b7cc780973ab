"""Images and their bytes, and what is refused."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.words.field import WordError
from motorcade.words.formats import CONTROL
from motorcade.words.image import Image, image_words, parse_image, parse_image_bytes, refused_image
from motorcade.words.packing import ImageError, bytes_to_words, words_to_bytes

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
    assert f"announces {words} words, {words + len(more)} are here" in sentence


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        ("00 01 03 00  80 00 00 00", "dwell is 3"),
        ("00 01 81 00  80 00 00 00", "dwell is 129"),
        ("00 01 00 00  80 00 00 00", "dwell is 0; allowed: exactly one bit"),
        ("01 00 01 00  40 00 00 00", "dwell is 1; allowed: 0, as there are no follower words"),
        ("00 00 80 00", "dwell is 128; allowed: 0, as there are no follower words"),
        ("01 00 00 01  40 00 00 00", "reserved is 1; allowed: 0, as there are no follower words"),
        ("00 01 01 02  80 00 00 00", "reserved is 2; allowed: 0 to 1"),
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
