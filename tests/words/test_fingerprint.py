"""What changes the fingerprint of a format, and what doesn't."""

from binascii import crc32

import pytest

from motorcade.words.field import Field, WordFormat
from motorcade.words.formats import DRIVE, FRAME, HEADER, canonical_text, fingerprint


def walker(name="walker", **changes):
    gait = Field(**{"name": "gait", "high": 31, "low": 28, "meaning": "how it walks", **changes})
    legs = Field("legs", gait.low - 1, 1, "how many")
    return WordFormat(name, [gait, legs, Field("on", 0, 0, "whether it walks")])


def test_the_canonical_text_has_a_line_for_each_field():
    assert canonical_text(HEADER) == (
        "header\n"
        "leader_states 31 24 0 255\n"
        "follower_words 23 16 0 255\n"
        "dwell 15 8 0 255 one-hot goes-with=follower_words\n"
        "reserved 7 0 0 255 reserved\n"
    )
    assert canonical_text(FRAME).splitlines()[-3:] == [
        "tag 10 6 0 31",
        "check 5 1 0 31 parities=0x001FFFC0,0x0FE03FC0,0x71E3C3C0,0xB66CCCC0,0xDAB55540 needs=tag",
        "parity 0 0 0 1 parities=0xFFFFFFFE",
    ]
    assert canonical_text(DRIVE).splitlines()[1:3] == ["code 31 28 0 15 only=1", "angle 27 20 0 180 unit=deg"]
    paces = walker(only=((2, "trot"), (1, "walk")), default=1)
    assert canonical_text(paces).splitlines()[1] == "gait 31 28 0 15 only=1,2"
    assert fingerprint(paces) == crc32(canonical_text(paces).encode())


@pytest.mark.parametrize(
    "change",
    [
        {"name": "pace"},
        {"low": 27},
        {"minimum": 1},
        {"maximum": 14},
        {"unit": "mm"},
        {"one_hot": True},
        {"only": ((1, "trot"),)},
        {"reserved": True},
        {"parity_masks": (1, 2, 4, 8)},
    ],
    ids=lambda change: next(iter(change)),
)
def test_what_changes_the_word_changes_the_fingerprint(change):
    assert fingerprint(walker(**change)) != fingerprint(walker())


def test_what_a_field_goes_with_changes_the_fingerprint():
    assert fingerprint(walker(one_hot=True, goes_with="legs")) != fingerprint(walker(one_hot=True))


@pytest.mark.parametrize("change", [{"meaning": "its gait"}, {"source": "a book"}, {"default": 3}, {"needs": "on"}])
def test_descriptions_of_a_field_do_not_change_the_fingerprint(change):
    assert fingerprint(walker(**change)) == fingerprint(walker())


def test_names_and_order_of_values_do_not_change_the_fingerprint():
    one, other = walker(only=((1, "trot"), (2, "walk"))), walker(only=((2, "step"), (1, "run")))
    assert fingerprint(one) == fingerprint(other)
