"""Who comes into a class: codes, names and numbers, right and wrong ones."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.classroom.names import CODE_CHARACTERS, LEAST_OF_A_PASSWORD, likeness, typed_code
from motorcade.classroom.room import MOST_OF_AN_ADDRESS, MOST_PUPILS
from motorcade.errors import MotorcadeError
from motorcade.locales import catalogue, languages
from motorcade.service.library import MOST_OF_A_NAME, checked_user_name
from motorcade.timing import Attempts
from support.classrooms import BUS, a_class, refused, with_pupils


def test_a_code_has_six_characters_of_which_none_is_taken_for_another():
    codes = [a_class(seed=seed).record.code for seed in range(200)]
    assert {len(code) for code in codes} == {6}
    assert set("".join(codes)) == set(CODE_CHARACTERS)
    assert not set(CODE_CHARACTERS) & set("01258BILOSUZ")


def test_a_code_is_right_in_small_letters_and_with_spaces():
    room = a_class()
    code = room.record.code
    room.check_code(f" {code[:3].lower()} - {code[3:].lower()}", "a", 0.0)
    refused("wrong-class-code", room.check_code, code[:-1], "a", 0.0)
    refused("wrong-class-code", room.check_code, code + "A", "a", 0.0)


def test_sixty_attempts_of_an_address_are_its_last_for_ten_minutes():
    room = with_pupils("Mia")
    code, number = room.record.code, room.pupil("01").number
    for _ in range(MOST_OF_AN_ADDRESS):
        refused("wrong-class-code", room.check_code, "AAAAAA", "eve", 0.0)
    for right in (
        lambda: room.check_code(code, "eve", 1.0),
        lambda: room.come_back("Mia", number, "d", "eve", 1.0),
        lambda: room.join("Eve", BUS, "d", "eve", 1.0),
    ):
        assert refused("too-many-attempts", right).details["seconds"] == 599
    room.check_code(code, "mia", 1.0)
    room.check_code(code, "eve", 600.0)
    assert room.record.code == code


def test_a_class_behind_one_router_comes_in_although_each_mistypes_the_code_once():
    room = a_class()
    for number in range(30):
        refused("wrong-class-code", room.check_code, "AAAAAA", "router", number / 10)
        room.check_code(room.record.code, "router", number / 10)
        room.join(f"pupil {number}", BUS, f"device {number}", "router", number / 10)


def test_a_computer_that_joins_again_and_again_leaves_half_of_the_class_to_others():
    room = a_class()
    for number in range(MOST_OF_AN_ADDRESS):
        room.join(f"eve {number}", BUS, f"eve {number}", "eve", 0.0)
    assert refused("too-many-attempts", room.join, "eve", BUS, "device", "eve", 1.0).details["seconds"] == 599
    for number in range(MOST_PUPILS // 2):
        room.join(f"Mia {number}", BUS, f"tablet {number}", f"mia {number}", 1.0)
    refused("class-full", room.join, "eve", BUS, "device", "eve", 600.0)


def test_a_flood_of_addresses_takes_no_memory():
    attempts = Attempts(1, 60.0)
    for address in range(10_000):
        attempts.add(str(address), 0.0)
    attempts.check("0", 0.0)
    refused("too-many-attempts", attempts.check, "9999", 0.0)


def test_a_newcomer_gets_a_number_and_comes_back_with_it():
    room = with_pupils("Mia")
    mia = room.pupil_at("device 0")
    assert (mia.id, mia.name, len(mia.number)) == ("01", "Mia", 4)
    assert room.pupil_at("another") is None
    assert room.come_back(" mia ", f"{mia.number[:2]} {mia.number[2:]}", "tablet", "a", 0.0) is mia
    assert room.pupil_at("tablet") is room.pupil_at("device 0") is mia
    room.leave("tablet")
    assert room.pupil_at("tablet") is None
    assert room.pupil_at("device 0") is mia


def test_ten_wrong_numbers_of_a_name_are_its_last_for_five_minutes():
    room = with_pupils("Mia", "Ben")
    wrong = f"{(int(room.pupil('01').number) + 1) % 10_000:04}"
    for number in range(10):
        refused("wrong-number", room.come_back, "Mia", wrong, "d", f"guesser {number}", 0.0)
    refused("too-many-attempts", room.come_back, "Mia", room.pupil("01").number, "d", "guesser 0", 1.0)
    room.come_back("Ben", room.pupil("02").number, "e", "guesser 0", 1.0)
    refused("wrong-number", room.come_back, "Nobody", "0000", "d", "another", 1.0)
    room.come_back("Mia", room.pupil("01").number, "d", "mia's other tablet", 300.0)
    before = room.pupil("01").number
    assert room.reset_number("01").number != before


def test_who_guesses_by_name_after_name_has_sixty_guesses():
    room = with_pupils("Mia")
    for number in range(MOST_OF_AN_ADDRESS):
        refused("wrong-number", room.come_back, f"Pupil {number}", "0000", "d", "guesser", 0.0)
    refused("too-many-attempts", room.come_back, "Mia", room.pupil("01").number, "d", "guesser", 599.0)
    room.come_back("Mia", room.pupil("01").number, "d", "guesser", 600.0)


def test_a_pupil_has_at_most_eight_devices_and_the_oldest_is_signed_out():
    room = with_pupils("Mia")
    for number in range(8):
        room.come_back("Mia", room.pupil("01").number, f"new {number}", "a", 0.0)
    assert room.pupil_at("device 0") is None
    assert all(room.pupil_at(f"new {number}") for number in range(8))


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
    refused("nickname-taken", room.join, second, BUS, "d", "a", 0.0)
    room.rename("01", second)


def test_the_page_says_how_long_a_password_has_to_be():
    for language in languages():
        assert f"{LEAST_OF_A_PASSWORD} " in catalogue(language)["page"]["class"]["passwordHint"]


@pytest.mark.parametrize("name", ["teacher", " Teacher ", "T.e.a.c.h.e.r", "Lehrer", "lehrerin", "老师", "теасher"])
def test_nobody_is_called_as_a_teacher(name):
    room = with_pupils("Mia")
    refused("nickname-reserved", room.join, name, BUS, "d", "a", 0.0)
    refused("nickname-reserved", room.rename, "01", name)


@pytest.mark.parametrize("name", ["", "   ", "\n", "\u200b"])
def test_a_name_is_needed(name):
    with pytest.raises(MotorcadeError):
        a_class().join(name, BUS, "d", "a", 0.0)


INVISIBLE = ["\u3164", "Mia\u3164", "Mi\ufe0fa", "Mia\u034f", "Mi\U000e0101a", "\u2800", "Mi\u200da"]


@pytest.mark.parametrize(
    "name",
    [
        *("<b>Mia</b>", "a&b", '"', "a/b", "..", "a" * 25, "Mia\u202e", "a\x00b", "{x}", "a`b", "-a"),
        *INVISIBLE,
        "Z" + "\u0301" * 23,
        "a" * 1_000_000,
    ],
    ids=lambda name: ascii(name[:20]),
)
def test_a_name_with_markup_or_control_characters_is_refused(name):
    refused("bad-user-name", a_class().join, name, BUS, "d", "a", 0.0)


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


@given(st.text(max_size=300))
def test_any_text_may_be_typed_as_a_code(text):
    assert len(typed_code(text)) <= 12


def test_an_avatar_is_one_of_the_list():
    refused("no-such-avatar", a_class().join, "Mia", "../bus", "d", "a", 0.0)


def test_a_class_is_full_or_closed():
    room = a_class()
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
