import subprocess
import sys

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.words import bulk
from motorcade.words.bulk import BLOCK_WORDS, decode_columns, encode_columns
from motorcade.words.field import WordError
from motorcade.words.formats import CONTROL, DRIVE, FORMATS, HEADER

KERNELS = ("numpy", "numba")
SIZES = (0, 1, 7, BLOCK_WORDS - 1, BLOCK_WORDS, BLOCK_WORDS + 1, 2 * BLOCK_WORDS + 3)
ANY_WORD = st.integers(0, 0xFFFFFFFF)
ANY_INTEGER = st.integers(-(1 << 63), (1 << 63) - 1)

every_kernel = pytest.mark.parametrize("kernel", KERNELS)
every_format = pytest.mark.parametrize("word_format", FORMATS, ids=lambda each: each.name)


@pytest.fixture(scope="module", autouse=True)
def one_thread():
    """Threads that wait for each other on a busy machine would take most of these tests' time."""
    numba.set_num_threads(1)
    yield
    numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)


@pytest.fixture
def all_threads():
    numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)
    yield
    numba.set_num_threads(1)


def refusal(function, *args, **kwargs):
    """What a WordError says, or None where there is none."""
    try:
        function(*args, **kwargs)
    except WordError as error:
        return error.field, error.value, error.allowed
    return None


def raws(field):
    return st.sampled_from([raw for raw in range(field.raw_mask + 1) if field.allows(raw)])


def narrow_type(field):
    return np.uint8 if field.width <= 8 else np.uint16


def good_words(word_format):
    def joined(values):
        return sum(raw << field.low for field, raw in zip(word_format.fields, values, strict=True))

    words = st.tuples(*(raws(field) for field in word_format.fields)).map(joined)
    return words.filter(lambda word: refusal(word_format.decode, word) is None)


def rows(word_format, columns):
    assert tuple(columns) == word_format.values._fields
    return list(zip(*(column.tolist() for column in columns.values()), strict=True))


def many_good_words(word_format, count):
    """Words that differ from one to the next, without asking a generator for each."""
    ordinals = np.arange(count, dtype=np.uint32)
    scattered = ordinals * np.uint32(2654435761)
    if word_format is HEADER:
        return (scattered | 0x00010000) & 0xFFFF00FF | np.uint32(1) << (8 + ordinals % 8)
    if word_format is DRIVE:
        return 1 << 28 | ordinals % 181 << 20 | scattered & 0x000FFFFF
    return scattered


@every_kernel
@every_format
@given(data=st.data())
def test_columns_hold_what_the_scalar_decodes(word_format, kernel, data):
    words = data.draw(st.lists(good_words(word_format), max_size=20))
    columns = decode_columns(word_format, words, kernel=kernel)
    assert rows(word_format, columns) == [tuple(word_format.decode(word)) for word in words]


@every_kernel
@every_format
@given(data=st.data())
def test_words_are_what_the_scalar_encodes(word_format, kernel, data):
    words = data.draw(st.lists(good_words(word_format), min_size=1, max_size=20))
    values = [word_format.decode(word)._asdict() for word in words]
    names = data.draw(st.sets(st.sampled_from(word_format.values._fields), min_size=1))
    if word_format is HEADER:
        names |= {"follower_words", "dwell"}
    columns = {name: [each[name] for each in values] for name in names}
    expected = [word_format.encode(**{name: each[name] for name in names}) for each in values]
    encoded = encode_columns(word_format, columns, kernel=kernel)
    assert encoded.dtype == np.uint32
    assert encoded.tolist() == expected


@every_kernel
@every_format
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.usefixtures("all_threads")
def test_every_size_goes_there_and_back(word_format, kernel, size):
    words = many_good_words(word_format, size)
    columns = decode_columns(word_format, words, kernel=kernel)
    assert rows(word_format, columns) == [tuple(word_format.decode(word)) for word in words.tolist()]
    assert np.array_equal(encode_columns(word_format, columns, kernel=kernel), words)


@every_kernel
@every_format
@given(data=st.data())
def test_a_refused_word_is_refused_as_the_scalar_does(word_format, kernel, data):
    strict = data.draw(st.booleans())
    bad = data.draw(ANY_WORD | st.integers(-1, 1 << 40))
    before, after = [
        [word for word in words if refusal(word_format.decode, word, strict) is None]
        for words in data.draw(st.tuples(*[st.lists(good_words(word_format), max_size=3)] * 2))
    ]
    refused = refusal(decode_columns, word_format, [*before, bad, *after], strict, kernel)
    assert refused == refusal(word_format.decode, bad, strict)


@every_kernel
@every_format
@given(data=st.data())
def test_a_refused_value_is_refused_as_the_scalar_does(word_format, kernel, data):
    words = data.draw(st.lists(good_words(word_format), min_size=1, max_size=5))
    values = [word_format.decode(word)._asdict() for word in words]
    bad = data.draw(st.sampled_from(values))
    field = data.draw(st.sampled_from(word_format.fields))
    narrow = data.draw(st.booleans())
    anything = st.integers(0, np.iinfo(narrow_type(field)).max) if narrow else ANY_INTEGER
    bad[field.name] = data.draw(anything | st.integers(0, field.raw_mask))
    columns = {
        each.name: np.array([value[each.name] for value in values], narrow_type(each) if narrow else np.int64)
        for each in word_format.fields
    }
    assert refusal(encode_columns, word_format, columns, kernel) == refusal(word_format.encode, **bad)


@every_kernel
def test_the_first_refused_row_is_named_whatever_its_field(kernel):
    angles, codes = [90, 200, 90], [1, 1, 9]
    words = [code << 28 | angle << 20 for code, angle in zip(codes, angles, strict=True)]
    expected = ("angle", 200, "0 to 180")
    assert refusal(decode_columns, DRIVE, words, kernel=kernel) == expected
    assert refusal(encode_columns, DRIVE, {"code": codes, "angle": angles}, kernel) == expected


@every_kernel
def test_the_first_word_that_breaks_the_rule_is_named(kernel):
    words = [0x01010100, 0x01000200, 0x01010000, 0x00000100]
    expected = ("dwell", 2, "0, as there are no follower words")
    assert refusal(decode_columns, HEADER, words, kernel=kernel) == expected
    columns = {"follower_words": [1, 0, 1, 0], "dwell": [1, 2, 0, 1]}
    assert refusal(encode_columns, HEADER, columns, kernel) == expected


@every_kernel
def test_reserved_bits_survive_unless_strict(kernel):
    words = [0, 5 << 1]
    columns = decode_columns(CONTROL, words, kernel=kernel)
    assert columns["reserved"].tolist() == [0, 5]
    assert encode_columns(CONTROL, columns, kernel).tolist() == words
    assert refusal(decode_columns, CONTROL, words, True, kernel) == ("reserved", 5, "0 (reserved)")


@every_kernel
@every_format
def test_columns_are_as_narrow_as_their_fields(word_format, kernel):
    columns = decode_columns(word_format, many_good_words(word_format, 3), kernel=kernel)
    for field in word_format.fields:
        assert columns[field.name].dtype == narrow_type(field)


@every_kernel
@pytest.mark.parametrize(
    "words",
    [
        np.frombuffer(bytes.fromhex("9234abcd 00000001 ffffffff"), ">u4"),
        np.array([0x9234ABCD, 7, 1, 7, 0xFFFFFFFF, 7], np.uint32)[::2],
        np.array([0x9234ABCD, 1, 0xFFFFFFFF], np.int64),
        np.array([0x9234ABCD, 1, 0xFFFFFFFF], np.uint64),
    ],
    ids=["big-endian", "strided", "signed", "64-bit"],
)
def test_words_may_lie_in_memory_in_any_way(words, kernel):
    columns = decode_columns(CONTROL, words, kernel=kernel)
    assert rows(CONTROL, columns) == [tuple(CONTROL.decode(word)) for word in (0x9234ABCD, 1, 0xFFFFFFFF)]
    mixed = {
        name: column.astype(np.int64) if index % 2 else column for index, (name, column) in enumerate(columns.items())
    }
    assert encode_columns(CONTROL, mixed, kernel).tolist() == [0x9234ABCD, 1, 0xFFFFFFFF]


def test_the_words_given_stay_as_they_are():
    words = np.array([0xFFFFFFFF], np.uint32)
    decode_columns(CONTROL, words)["pir"][0] = 0
    assert words.tolist() == [0xFFFFFFFF]
    assert words.flags.writeable


def test_no_columns_are_no_words():
    assert encode_columns(CONTROL, {}).tolist() == []


def test_a_column_that_is_no_field_is_named():
    with pytest.raises(TypeError, match="gait is no field of control"):
        encode_columns(CONTROL, {"pir": [1], "gait": [1]})


def test_columns_of_different_lengths_are_refused():
    with pytest.raises(ValueError, match="different lengths"):
        encode_columns(CONTROL, {"pir": [1], "voice": [1, 0]})


@pytest.mark.parametrize("column", [[1.0], ["1"], [None], [1 << 64]], ids=str)
def test_what_is_no_integer_is_refused(column):
    with pytest.raises(TypeError, match="pir: "):
        encode_columns(CONTROL, {"pir": column})
    with pytest.raises(TypeError, match="words: "):
        decode_columns(CONTROL, column)


def test_what_has_another_shape_is_refused():
    with pytest.raises(ValueError, match="words: of 2 dimensions"):
        decode_columns(CONTROL, [[1], [2]])


def test_an_unknown_kernel_is_refused():
    with pytest.raises(ValueError, match="kernel is 'cuda'; allowed: numpy, numba or None"):
        decode_columns(CONTROL, [1], kernel="cuda")


def ran(script):
    """What ``script`` prints in an interpreter of its own, where nothing is imported yet."""
    start = "import sys; from motorcade.words import bulk; from motorcade.words.formats import CONTROL\n"
    return subprocess.run(
        [sys.executable, "-c", start + script], check=True, capture_output=True, text=True
    ).stdout.strip()


def test_few_words_are_not_worth_importing_numba():
    assert ran("bulk.decode_columns(CONTROL, [1]); print('numba' in sys.modules)") == "False"


def test_many_words_are_worth_it():
    script = "bulk.NUMBA_WORDS = 2; bulk.decode_columns(CONTROL, [1, 2]); print('numba' in sys.modules)"
    assert ran(script) == "True"


def test_without_numba_numpy_does_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "numba", None)
    monkeypatch.setattr(bulk, "NUMBA_WORDS", 1)
    bulk._numba_loops.cache_clear()
    assert decode_columns(CONTROL, [1])["parity"].tolist() == [1]
    with pytest.raises(ImportError):
        decode_columns(CONTROL, [1], kernel="numba")
