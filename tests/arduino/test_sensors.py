"""Sensors at the pins of an emulated Uno: what the car does when somebody speaks, when it sees somebody, or a wall."""

import pytest

from motorcade.car.brain import VOICE_GO, VOICE_STOP
from motorcade.config.pins import VoiceMap, parse_pins
from motorcade.firmware.arduino_library import library_files, library_folder, sketch_files
from motorcade.words.image import words_to_bytes
from support import arduino_build
from support.emulated_chips import UNO
from support.emulated_uploads import upload
from support.strategies import CLASSROOM

PORTB, PORTD, TCCR0A, OCR0A, OCR0B = 0x25, 0x2B, 0x44, 0x47, 0x48
FORWARD, RIGHT, STILL = "forward", "right", "still"
STOP, GO = b"\xaa\x01", b"\xaa\x02"
VOICE_BAUD = 9600
# PC5 is A5, PB4 is D12, PD3 is D3, PC4 is A4, PB5 is D13.
VOICE_PIN, PIR_PIN, ECHO_PIN = ("C", 5), ("B", 4), ("D", 3)
LEFT_FLOOR_PIN, RIGHT_FLOOR_PIN = ("C", 4), ("B", 5)
US_A_MM = 2000 / 343
# Along a line at level 2 for 3 s, listening, looking for persons, and avoiding what is nearer than 200 mm.
ALERT = 1 << 29 | 2 << 25 | 3 << 23 | 1 << 18 | 1 << 16 | 3 << 14 | 1 << 13 | 1 << 12 | 1 << 11


@pytest.fixture
def car(world, compiled):
    pins = (library_folder() / "uno.toml").read_text(encoding="utf-8") + "[voice]\nreceive = 19\n"
    voice = VoiceMap(VOICE_BAUD, ((STOP, VOICE_STOP), (GO, VOICE_GO)))
    own = sketch_files(parse_pins(pins, "uno.toml"), CLASSROOM, is_leader=True, number=1, voice=voice)
    program = compiled("examples/Car", arduino_build.UNO, {**library_files(), **own})
    made = world.add(UNO, program.elf, program.symbols)
    made.set_pin(*VOICE_PIN, 1)
    world.run(50)
    # Followers' words, too: it sends infrared all the while.
    upload(world, made, words_to_bytes((0x01010100, ALERT, 0xA5280000)))
    world.run(20)
    return made


def does(car) -> str:
    """What the motors' pins say."""
    portb, portd = car.read(PORTB, 1)[0], car.read(PORTD, 1)[0]
    left, right = portd >> 7 & 1, portb >> 1 & 1
    if not left and not right:
        return STILL
    assert car.read(OCR0A, 1) == car.read(OCR0B, 1) == bytes([180])
    assert left
    assert right != (portb >> 2 & 1)
    return FORWARD if right else RIGHT


def speak(car, data: bytes) -> None:
    at_us = 0.0
    for byte in data:
        for bit in (0, *(byte >> place & 1 for place in range(8)), 1):
            car.set_pin(*VOICE_PIN, bit, at_us)
            at_us += 1e6 / VOICE_BAUD


def test_the_car_stops_and_goes_on_at_a_word_that_somebody_speaks(world, car) -> None:
    assert does(car) == FORWARD
    for data, expected in ((STOP, STILL), (GO, FORWARD), (b"\x00" + STOP, STILL), (b"\xaa", STILL), (b"\x02", FORWARD)):
        speak(car, data)
        world.run(10)
        assert does(car) == expected
    assert car.overruns == 0


def test_the_car_stands_while_a_person_is_near(world, car) -> None:
    for level, expected in ((1, STILL), (0, FORWARD), (1, STILL)):
        car.set_pin(*PIR_PIN, level)
        world.run(5)
        assert does(car) == expected


def test_the_car_follows_a_line(world, car) -> None:
    for left, right, expected in ((0, 1, RIGHT), (1, 1, FORWARD), (0, 1, RIGHT), (0, 0, FORWARD)):
        car.set_pin(*LEFT_FLOOR_PIN, left)
        car.set_pin(*RIGHT_FLOOR_PIN, right)
        world.run(5)
        assert does(car) == expected


def test_the_car_turns_away_from_a_wall_and_forgets_it(world, car) -> None:
    def echoes(distance_mm: int, times: int) -> None:
        for _ in range(times):
            car.set_pin(*ECHO_PIN, 1)
            car.set_pin(*ECHO_PIN, 0, distance_mm * US_A_MM)
            world.run(60)

    echoes(150, 4)
    assert does(car) == RIGHT
    echoes(260, 3)
    assert does(car) == FORWARD
    echoes(180, 3)
    assert does(car) == RIGHT
    # No echo comes any more.
    world.run(250)
    assert does(car) == FORWARD
