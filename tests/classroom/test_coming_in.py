"""Who comes into a class: codes, names and numbers, right and wrong ones."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.classroom.names import CODE_CHARACTERS, LEAST_OF_A_PASSWORD, likeness
from motorcade.classroom.room import MOST_OF_AN_ADDRESS, MOST_PUPILS
from motorcade.errors import MotorcadeError
from motorcade.locales import catalogue, languages
from motorcade.service.library import MOST_OF_A_NAME, checked_user_name
from motorcade.timing import Attempts
from support.classrooms import BUS, a_class, refused, with_pupils


def test_a_flood_of_addresses_takes_no_memory():
    attempts = Attempts(1, 60.0)
    for address in range(10_000):
        attempts.add(str(address), 0.0)
    attempts.check("0", 0.0)
    refused("too-many-attempts", attempts.check, "9999", 0.0)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("Mia", "mia"),
        ("สำเร็จ", "สำเร็จ"),
        ("हिन्दी", "हिन्दी"),
        ("Mia", "M i a"),
        ("José", "Jose\u0301"),
        ("Ａda", "ada"),
        ("小明", "小 明"),
        ("Straße", "STRASSE"),
        ("Mia", "Міа"),
        ("Mia", "Miа"),
        ("Hope", "НОРЕ"),
        ("Otto", "Οττο"),
    ],
)
def test_names_that_look_alike_are_taken(first, second):
    room = with_pupils(first)
    other = room.join("Ben", BUS, "d", "a", 0.0)
    refused("nickname-taken", room.join, second, BUS, "d", "a", 0.0)
    refused("nickname-taken", room.rename, other.id, second)
    room.rename("01", second)


def test_the_page_says_how_long_a_password_has_to_be():
    for language in languages():
        assert f"{LEAST_OF_A_PASSWORD} " in catalogue(language)["page"]["class"]["passwordHint"]


@pytest.mark.parametrize("name", ["teacher", " Teacher ", "T.e.a.c.h.e.r", "Lehrer", "lehrerin", "老师", "теасher"])
def test_nobody_is_called_as_a_teacher(name):
    room = with_pupils("Mia")
    refused("nickname-reserved", room.join, name, BUS, "d", "a", 0.0)
    refused("nickname-reserved", room.rename, "01", name)


@given(st.text(max_size=200))
def test_any_name_is_refused_or_plain(text):
    try:
        name = checked_user_name(text)
    except MotorcadeError:
        return
    assert len(name) <= MOST_OF_A_NAME
    assert not set(name) & set('<>&"`{}[]/\\\n\r\t')
    assert checked_user_name(name) == name
    assert likeness(likeness(name)) == likeness(name)


def test_a_class_is_full_or_closed():
    room = a_class()
    refused("no-such-avatar", room.join, "Mia", "../bus", "d", "a", 0.0)
    for number in range(MOST_PUPILS):
        room.join(f"pupil {number}", BUS, f"d{number}", f"a{number}", 0.0)
    refused("class-full", room.join, "one more", BUS, "d", "a", 0.0)
    room.remove("01")
    room.set(is_open=False)
    refused("class-closed", room.join, "one more", BUS, "d", "a", 0.0)
    room.set(is_open=True, title=" 4b ", stuck_minutes=3)
    assert room.join("one more", BUS, "d", "a", 0.0).id == f"{MOST_PUPILS + 1}"
    assert (room.record.title, room.record.stuck_minutes) == ("4b", 3)
    assert len({pupil.number for pupil in room.record.pupils}) == MOST_PUPILS


@given(st.text(max_size=300))
def test_a_code_is_right_in_small_letters_and_with_spaces_and_any_text_may_be_typed(text):
    room = a_class()
    code = room.record.code
    assert len(code) == 6
    assert set(code) <= set(CODE_CHARACTERS) - set("01258BILOSUZ")
    room.check_code(f" {code[:3].lower()} - {code[3:].lower()}", "a", 0.0)
    for wrong in (code[:-1], code + "A", text):
        refused("wrong-class-code", room.check_code, wrong, "a", 0.0)


def test_sixty_attempts_of_an_address_are_its_last_for_ten_minutes():
    room = with_pupils("Mia")
    code, number = room.record.code, room.pupil("01").number
    # As many as where each of 20 pupils behind one router mistypes the code and the number once, and joins.
    for attempt in range(MOST_OF_AN_ADDRESS // 3):
        refused("wrong-class-code", room.check_code, "AAAAAA", "eve", 0.0)
        refused("wrong-number", room.come_back, f"pupil {attempt}", "0000", "d", "eve", 0.0)
        room.join(f"pupil {attempt}", BUS, f"device of {attempt}", "eve", 0.0)
    for right in (
        lambda: room.check_code(code, "eve", 1.0),
        lambda: room.come_back("Mia", number, "d", "eve", 1.0),
        lambda: room.join("Eve", BUS, "d", "eve", 1.0),
    ):
        assert refused("too-many-attempts", right).details["seconds"] == 599
    room.check_code(code, "mia", 1.0)
    room.check_code(code, "eve", 600.0)


def test_a_newcomer_gets_a_number_and_comes_back_with_it_and_the_oldest_of_nine_devices_is_signed_out():
    room = with_pupils("Mia")
    mia = room.pupil_at("device 0")
    assert (mia.id, mia.name, len(mia.number)) == ("01", "Mia", 4)
    assert room.pupil_at("another") is None
    for number in range(7):
        assert room.come_back(" mia ", f"{mia.number[:2]} {mia.number[2:]}", f"new {number}", "a", 0.0) is mia
    assert room.pupil_at("new 6") is room.pupil_at("device 0") is mia
    room.come_back("Mia", mia.number, "new 7", "a", 0.0)
    assert room.pupil_at("device 0") is None
    room.leave("new 7")
    assert room.pupil_at("new 7") is None
    assert room.pupil_at("new 0") is mia


def test_ten_wrong_numbers_of_a_name_are_its_last_for_five_minutes():
    room = with_pupils("Mia", "Ben")
    mia, ben = (room.pupil(each).number for each in ("01", "02"))
    wrong = f"{(int(mia) + 1) % 10_000:04}"
    for number in range(10):
        refused("wrong-number", room.come_back, "Mia", wrong, "d", f"guesser {number}", 0.0)
    refused("too-many-attempts", room.come_back, "Mia", mia, "d", "guesser 0", 1.0)
    room.come_back("Ben", ben, "e", "guesser 0", 1.0)
    refused("wrong-number", room.come_back, "Nobody", "0000", "d", "another", 1.0)
    room.come_back("Mia", mia, "d", "mia's other tablet", 300.0)
    new = room.reset_number("01").number
    refused("wrong-number", room.come_back, "Mia", mia, "d", "a", 300.0)
    assert room.come_back("Mia", new, "d", "a", 300.0).id == "01"


@pytest.mark.parametrize(
    ("name", "code"),
    [
        *((name, "nickname-missing") for name in ("", "   ", "\n")),
        *((name, "bad-user-name") for name in ("<b>Mia</b>", "a&b", '"', "a/b", "..", "a" * 25, "{x}", "a`b", "-a")),
        *((name, "bad-user-name") for name in ("Mia\u202e", "a\x00b", "Z" + "\u0301" * 23, "a" * 1_000_000)),
        # Characters that nobody sees.
        *((name, "bad-user-name") for name in ("\u3164", "Mia\u3164", "Mi\ufe0fa", "Mia\u034f", "Mi\U000e0101a")),
        *((name, "bad-user-name") for name in ("\u200b", "\u2800", "Mi\u200da")),
    ],
    ids=lambda value: ascii(value[:20]),
)
def test_a_name_is_needed_without_markup_and_control_characters(name, code):
    refused(code, a_class().join, name, BUS, "d", "a", 0.0)
