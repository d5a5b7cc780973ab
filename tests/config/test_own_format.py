"""A format of one's own in TOML: what it may say, and the line of what it may not."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.config.own_format import MOST_LINES, read_format
from motorcade.errors import MotorcadeError
from support.vocabularies import WALKER_FILE

WALKER = WALKER_FILE.read_text(encoding="utf-8")


def refusal(text):
    """Line and reason; the file's name stands before them."""
    with pytest.raises(MotorcadeError) as caught:
        read_format(text, "own.toml")
    place, _, reason = str(caught.value).partition(": ")
    return int(place.removeprefix("own.toml, line ")), reason


def test_the_example_is_read_field_by_field():
    vocabulary = read_format(WALKER, "walker.toml")
    assert (vocabulary.name, vocabulary.file_stem) == ("walker", "motorcade_walker")
    (walker,) = vocabulary.formats
    assert [(field.name, field.high, field.low) for field in walker.fields] == [
        ("walks", 31, 31),
        ("gait", 30, 29),
        ("heading", 28, 20),
        ("legs", 19, 16),
        ("lift", 15, 11),
        ("pause", 10, 3),
        ("free", 2, 0),
    ]
    gait, heading = walker.field("gait"), walker.field("heading")
    assert gait.only == ((0, "amble"), (1, "trot"), (3, "gallop"))
    assert (gait.needs, walker.field("lift").goes_with, walker.field("lift").one_hot) == ("walks", "legs", True)
    assert (heading.minimum, heading.maximum, heading.unit, heading.default) == (0, 359, "deg", 90)
    assert walker.field("free").reserved
    assert vocabulary.meaning(walker, gait, "zh") == "步态"
    assert (
        walker.encode(walks=1, gait=3, heading=270, legs=2, lift=4, pause=20)
        == 0b1_11_100001110_0010_00100_00010100_000
    )
    assert [str(warning) for warning in walker.warnings(0b1 << 29)] == ["gait is 1, yet walks is 0: it has no effect"]


def one(*lines):
    """A format whose second field ends with ``lines``, from line 8 on; the word is full where they don't change it."""
    head = ['name = "own"', "[[field]]", 'name = "first"', "width = 8", 'meaning = "the upper"']
    return "\n".join([*head, "[[field]]", 'meaning = "the rest"', *lines])


@pytest.mark.parametrize(
    ("lines", "line", "reason"),
    [
        (['name = "rest"', "width = 23"], 6, "the widths make 31 of 32 bits; add a field of 1"),
        (['name = "rest"', "width = 25"], 9, "rest has 25 bits, but only 24 of 32 are left"),
        (['name = "rest"', "width = 0"], 9, "field[1].width is 0; allowed: a whole number from 1 to 32"),
        (['name = "rest"', "width = 24.5"], 9, "width is 24.5; allowed"),
        (['name = "rest"', "width = true"], 9, "width is true; allowed"),
        (['name = "rest"', "width = 24", "high = 24"], 10, "rest's bits 24-1 overlap first's, 31-24"),
        (['name = "rest"', "width = 4", "high = 31"], 10, "rest's bits 31-28 overlap first's, 31-24"),
        (['name = "rest"', "width = 23", "high = 22"], 10, "no field holds bit 23, above rest"),
        (['name = "rest"'], 6, "field[1].width is missing; give a whole number from 1 to 32"),
        (["width = 24"], 6, "field[1].name is missing; give text in quotation marks"),
        (['name = "first"', "width = 24"], 8, "there are two fields named 'first'"),
        (['name = "the rest"', "width = 24"], 8, "the name 'the rest' is no identifier"),
        (['name = "Rest"', "width = 24"], 8, "the name 'Rest' is no identifier"),
        (['name = "2nd"', "width = 24"], 8, "the name '2nd' is no identifier"),
        (['name = "a_1"', "width = 24"], 8, "the name 'a_1' is no identifier"),
        (['name = "_rest"', "width = 24"], 8, "the name '_rest' is no identifier"),
        (['name = "速度"', "width = 24"], 8, "the name '速度' is no identifier"),
        (['name = ""', "width = 24"], 8, "the name '' is no identifier"),
        ([f'name = "{"a" * 41}"', "width = 24"], 8, "is no identifier"),
        (["name = 5", "width = 24"], 8, "name is 5; allowed: text in quotation marks"),
        (['name = "int"', "width = 24"], 8, "the name 'int' is a word of C"),
        (['name = "class"', "width = 24"], 8, "is a word of C"),
        (['name = "errno"', "width = 24"], 8, "is a word of C (headers define it)"),
        (['name = "elseif"', "width = 24"], 8, "is a word of Lua"),
        (['name = "lambda"', "width = 24"], 8, "is a word of Python"),
        (['name = "debugger"', "width = 24"], 8, "is a word of JavaScript"),
        (['name = "close"', "width = 24"], 8, "is a word of Kaitai"),
        (['name = "word"', "width = 24"], 8, "is a word of the Wireshark dissector"),
        (['name = "rest"', "width = 24", "wdith = 3"], 10, "field[1].wdith is not known; known are name, width"),
        (['name = "rest"', "width = 24", "range = [0]"], 10, "range is [0]; allowed: a list of 2, each a whole number"),
        (['name = "rest"', "width = 24", "range = [5, 2]"], 10, "range is [5, 2]; the smaller number"),
        (['name = "rest"', "width = 24", "range = [0, 16777216]"], 10, "range is 16777216; allowed"),
        (['name = "rest"', "width = 24", "range = [-1, 5]"], 10, "range[0] is -1; allowed"),
        (['name = "rest"', "width = 24", "range = [", "0,", '"a"]'], 12, 'range[1] is "a"; allowed'),
        (['name = "rest"', "width = 24", "default = -1"], 10, "default is -1; allowed"),
        (['name = "rest"', "width = 24", "range = [1, 5]", "default = 6"], 11, "default is 6; allowed: 1 to 5"),
        (['name = "rest"', "width = 24", "values = {}"], 10, "values is {}; allowed: numbers with names"),
        (
            ['name = "rest"', "width = 24", 'values = {x = "a"}'],
            10,
            'values is "x"; allowed: a whole number from 0 to 16777215',
        ),
        (
            ['name = "rest"', "width = 24", "[field.values]", '0 = "a"', "99999999 = 'b'"],
            12,
            'values is "99999999"; allowed',
        ),
        (
            ['name = "rest"', "width = 24", "values = {1 = 2}"],
            10,
            "values.1 is 2; allowed: a line of 1 to 200 characters",
        ),
        (['name = "rest"', "width = 24", "range = [0, 1]", 'values = {1 = "a"}'], 11, "leave out range and one_hot"),
        (['name = "rest"', "width = 24", "one_hot = 1"], 10, "one_hot is 1; allowed: true or false"),
        (['name = "rest"', "width = 24", 'needs = "legs"'], 10, "needs is 'legs', which is no other field"),
        (['name = "rest"', "width = 24", 'needs = "first"'], 10, "needs is 'first', which has more than one bit"),
        (['name = "rest"', "width = 24", 'goes_with = "rest"'], 10, "goes_with is 'rest', which is no other field"),
        (['name = "rest"', "width = 24", "unit = 3"], 10, "unit is "),
        (['name = "rest"', "width = 24", 'source = "a\\nb"'], 10, "source is "),
        (['name = "rest"', "width = 24", 'unit = "\\u202E"'], 10, "unit is "),
        (
            ['name = "rest"', "width = 24", "range = [1, 9]", 'goes_with = "first"'],
            6,
            "the defaults make no word: rest is 1; allowed: 0, as there are no first",
        ),
    ],
)
def test_what_can_not_be_is_refused_with_its_line(lines, line, reason):
    found, sentence = refusal(one(*lines))
    assert reason in sentence
    assert found == line


def test_a_field_without_a_meaning_is_refused():
    line, reason = refusal('name = "own"\n\n[[field]]\nname = "all_bits"\nwidth = 32\n')
    assert (line, reason[:27]) == (3, "field[0].meaning is missing")
    assert refusal('name = "own"\n[[field]]\nname = "all_bits"\nmeaning = " "\nwidth = 32\n')[0] == 4


FIELD = '\n[[field]]\nname = "all_bits"\nmeaning = "all"\nwidth = 32'


@pytest.mark.parametrize(
    ("text", "line", "reason"),
    [
        ("", 1, "name is missing"),
        ('name = "own"', 1, "field is missing; give 1 to 32 tables; begin each field with a line [[field]]"),
        ('name = "own"\nfield = 3', 2, "field is 3; allowed: 1 to 32 tables; begin each field with a line [[field]]"),
        ('name = "own"\nfield = []', 2, "field is []; allowed: 1 to 32 tables"),
        ('name = "own"\nfield = [1]', 2, "field[0] is 1; allowed: a table"),
        ('# mine\nname = "own"\nfeild = 1', 3, "feild is not known; known are name, field"),
        (
            '# mine\nname = "drive"' + FIELD,
            2,
            "name is 'drive', which Motorcade has already",
        ),
        (
            'name = "own car"' + FIELD,
            1,
            "the name 'own car' is no identifier",
        ),
        (
            '# mine\nname = "while"' + FIELD,
            2,
            "the name 'while' is a word of",
        ),
    ],
)
def test_what_is_no_format_at_all_is_refused(text, line, reason):
    found, sentence = refusal(text)
    assert reason in sentence
    assert found == line


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("name = own", "line 1"),
        ('name = "a"\nname = "b"', "line 2"),
        ('name = "a"\n[[field]\n', "line 2"),
        ("a = " + "[" * 5000, "too deeply"),
    ],
)
def test_what_is_not_toml_is_refused_with_its_line(text, place):
    with pytest.raises(MotorcadeError, match=r"own\.toml is not TOML") as caught:
        read_format(text, "own.toml")
    assert place in str(caught.value)


def test_a_text_that_is_far_too_long_is_refused():
    with pytest.raises(MotorcadeError, match="more than 1000 lines"):
        read_format(WALKER + "\n" * MOST_LINES, "own.toml")


def test_a_line_is_found_behind_what_only_looks_like_fields():
    text = WALKER.replace("# A word", '# [[field]] name = "no"\n# A word').replace('"ms"', '"int\\n"')
    line, _ = refusal(text)
    assert text.split("\n")[line - 1] == 'unit = "int\\n"'
    quoted = 'name = "own"\n[[field]]\nname = "a"\nwidth = 31\nmeaning = """\\\n[[field]]\\\nwidth = 2"""\n'
    assert refusal(quoted + '[[field]]\nname = "b"\nmeaning = "b"\nwidth = 2\n')[0] == 11


@given(st.text())
def test_any_text_gets_a_sentence(text):
    with pytest.raises(MotorcadeError, match=r"^own\.toml"):
        read_format(text, "own.toml")


@given(st.data())
def test_any_damage_is_read_or_gets_a_sentence(data):
    lines = WALKER.split("\n")
    number = data.draw(st.integers(0, len(lines) - 1))
    values = ["", "1", "-1", "99", "true", '"x"', "[]", "[0, 1]", "{}", "1979-05-27", "nan", '"""', "]", '"sizeof"']
    key = lines[number].partition("=")[0]
    lines[number] = data.draw(st.sampled_from([f"{key}= {value}" for value in values] + ["", "[[field]]", "[field]"]))
    text = "\n".join(lines)
    try:
        (word_format,) = read_format(text, "own.toml").formats
    except MotorcadeError:
        return
    assert word_format.decode(word_format.encode())
