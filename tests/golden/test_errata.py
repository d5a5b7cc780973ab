"""The errata of seeds 000 and 001, each as a vector that was computed by hand, most significant bit first."""

import pytest

from motorcade import Program, compile_program, forward, led, left, repeat, together
from motorcade.locales import catalogue
from motorcade.words.field import WordError
from motorcade.words.formats import CONTROL, DRIVE, FRAME, HEADER, fingerprint
from motorcade.words.image import parse_image
from motorcade.words.packing import ImageError, pack, unpack

# Seed 000: c3 has 7 bits and c8 has 11, not 6 and 12 as in the table; so all items together have 32.
ITEMS = [
    # item, bits, the item's fields at their maximum, the word
    ("c1", 1, {"accept_ir": 1}, 0b1_0_0000000_0000_00000_0_0_00000000000_0),
    ("c2", 1, {"forward": 1}, 0b0_1_0000000_0000_00000_0_0_00000000000_0),
    (
        "c3",
        7,  # the table has 6: it lacks the bit that enables the motor
        {"motor_enable": 1, "motor_direction": 3, "motor_speed": 3, "motor_duration": 3},
        0b0_0_1111111_0000_00000_0_0_00000000000_0,
    ),
    ("c4", 4, {"led_which": 3, "led_duration": 3}, 0b0_0_0000000_1111_00000_0_0_00000000000_0),
    ("c5", 5, {"avoid_enable": 1, "avoid_radius": 3, "avoid_duration": 3}, 0b0_0_0000000_0000_11111_0_0_00000000000_0),
    ("c6", 1, {"voice": 1}, 0b0_0_0000000_0000_00000_1_0_00000000000_0),
    ("c7", 1, {"pir": 1}, 0b0_0_0000000_0000_00000_0_1_00000000000_0),
    ("c8", 11, {"floor": 1, "reserved": 1023}, 0b0_0_0000000_0000_00000_0_0_11111111111_0),  # the table has 12
    ("c9", 1, {"parity": 1}, 0b0_0_0000000_0000_00000_0_0_00000000000_1),
]


def test_the_formats_keep_their_fingerprints():
    # Cars and firmware in use have them: a change means that old and new cars read words differently.
    assert (fingerprint(HEADER), fingerprint(CONTROL), fingerprint(DRIVE)) == (0x71B74BB1, 0x52D8BFD2, 0xA066A390)
    assert fingerprint(FRAME) == 0x7DB4FBDA


def word_of(*fields):
    """Return the word whose bits are written field by field, bit 31 first."""
    bits = "".join(fields)
    assert len(bits) == 32
    return int(bits, 2)


@pytest.mark.parametrize(("item", "width", "fields", "word"), ITEMS, ids=[each[0] for each in ITEMS])
def test_each_item_of_the_control_word_has_its_own_bits(item, width, fields, word):
    assert CONTROL.encode(**fields) == word
    assert word.bit_count() == width
    decoded = CONTROL.decode(word)._asdict()
    assert {name: raw for name, raw in decoded.items() if raw} == fields


def test_the_parts_of_a_control_word_stand_in_the_order_of_the_list():
    word = word_of(
        "1",  # c1 a follower that listens
        "0",  # c2 and doesn't pass on
        "1",  # c3 the motor is driven:
        "10",  # right
        "01",  # at speed 1
        "11",  # for the longest time
        "01",  # c4 LED 1
        "10",  # for duration 2
        "1",  # c5 obstacles are avoided:
        "11",  # from afar
        "01",  # for duration 1
        "0",  # c6 no voice
        "1",  # c7 PIR
        "10000000000",  # c8: its first bit is the floor
        "0",  # c9
    )
    assert word == 0xB3B75800
    assert CONTROL.decode(word) == (1, 0, 1, 2, 1, 3, 1, 2, 1, 3, 1, 0, 1, 1, 0, 0)


@pytest.mark.parametrize("bit", range(1, 11))
def test_c8_is_filled_with_zeros_in_all_of_its_11_bits_but_the_floor(bit):
    with pytest.raises(WordError, match=r"reserved is \d+; allowed: 0 \(reserved\)"):
        CONTROL.decode(1 << bit, strict=True)
    with pytest.raises(ImageError):
        parse_image((0x01000000, 1 << bit))


def test_an_image_is_in_the_order_of_the_list_and_big_endian():
    compiled = compile_program(Program([forward(3), left(1, speed=1)]))
    header = bytes(
        [
            0x02,  # h1: 2 states, one for each serial step
            0x00,  # h2: no words for followers
            0x00,  # h2: so no dwell either
            0x00,  # h3
        ]
    )
    first = word_of("0", "1", "1001011", "0" * 23)  # c1, c2, c3: driven, forward, speed 2, duration 3
    second = word_of("0", "1", "1010101", "0" * 23)  # c1, c2, c3: driven, left, speed 1, duration 1
    assert (first, second) == (0x65800000, 0x6A800000)
    assert compiled.image == header + bytes.fromhex("65800000") + bytes.fromhex("6a800000")


def test_the_message_about_256_steps_speaks_of_serial_modules():
    # h1 counts serial steps, and not parallel ones.
    assert compile_program(Program([repeat(255, together(forward(1), led(0, 1)))])).words[0] == 0xFF000000
    compiled = compile_program(Program([repeat(256, forward(1))]))
    (diagnostic,) = compiled.diagnostics
    assert (diagnostic.code, diagnostic.severity) == ("too-many-states", "error")
    assert "所用的串行模块数目已经大于255" in diagnostic.sentence("zh")
    assert "serial modules in use are more than 255" in diagnostic.sentence("en")
    assert "并行" not in catalogue("zh")["errors"]["too-many-states"]
    assert "parallel" not in catalogue("en")["errors"]["too-many-states"]
    assert compiled.words == ()


# 001
VECTORS = [
    # The text of the worked example: a = 40.
    (311209984, 0x128CB000, ("0001", "00101000", "1", "10010110"), (1, 40, 1, 150, 0)),
    # The bits of the worked example: a = 42.
    (313307136, 0x12ACB000, ("0001", "00101010", "1", "10010110"), (1, 42, 1, 150, 0)),
    # The test program's struct with {40, false, 150}: angle 40, backward, speed 150.
    (310685696, 0x1284B000, ("0001", "00101000", "0", "10010110"), (1, 40, 0, 150, 0)),
    # The meaning of the test program's text: speed 40, backward, angle 150.
    (425803776, 0x19614000, ("0001", "10010110", "0", "00101000"), (1, 150, 0, 40, 0)),
    # Unpacking uses "and" where the text has "or": `cmd | mask` would find 255, 1 and 255 in here.
    (0x10000000, 0x10000000, ("0001", "00000000", "0", "00000000"), (1, 0, 0, 0, 0)),
]


@pytest.mark.parametrize(("number", "hexadecimal", "fields", "values"), VECTORS, ids=[str(each[0]) for each in VECTORS])
def test_a_drive_command_of_seed_001_there_and_back(number, hexadecimal, fields, values):
    code, angle, direction, speed = fields
    word = word_of(code, angle, direction, speed, "00000000000")
    assert word == number == hexadecimal
    assert DRIVE.decode(word, strict=True) == values
    assert DRIVE.encode(code=values[0], angle=values[1], direction=values[2], speed=values[3]) == word


def test_a_drive_command_is_big_endian_unless_little_is_asked_for():
    assert pack(311209984) == bytes([0x12, 0x8C, 0xB0, 0x00])
    assert pack(311209984, "little") == bytes([0x00, 0xB0, 0x8C, 0x12])
    assert unpack(bytes([0x00, 0xB0, 0x8C, 0x12]), "little") == 311209984
