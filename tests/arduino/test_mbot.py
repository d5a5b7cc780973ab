"""Emulated mBots: who leads is decided by a button, three of them are a swarm, and their parts are of another kind."""

import pytest

from motorcade.car.brain import NO_LED
from motorcade.words.packing import words_to_bytes
from support import arduino_build
from support.arduino_cars import (
    BARE,
    FOLLOW,
    FORWARD,
    LEADS,
    LEFT,
    LONGEST_TICK_US,
    MOST_FLASH_BYTES,
    MOST_RAM_BYTES,
    RIGHT,
    TAGGED,
    checked_frames,
)
from support.emulated_chips import EDGES, MBOT, WATCHED, Chip, ChipWorld
from support.emulated_uploads import upload

# Registers of an ATmega328P.
PORTD, TCCR0A, OCR0A, OCR0B, DDRC = 0x2B, 0x44, 0x47, 0x48, 0x27
DUTIES = (0, 115, 180, 255)
BUTTON_CHANNEL, PIXELS, ULTRASONIC = 7, ("B", 5), ("C", 3)
LEFT_FLOOR, RIGHT_FLOOR = ("B", 1), ("B", 2)
# Green, red, blue of LED 0 to 3 and of none, as MotorcadeAvr.cpp has them.
COLOURS = {(28, 40, 0): 0, (0, 0, 48): 1, (40, 0, 0): 2, (6, 40, 20): 3, (0, 0, 0): NO_LED}
CYCLES_A_US, US_A_MM = 16, 2000 / 343


@pytest.fixture(scope="module")
def program(compiled) -> arduino_build.ArduinoProgram:
    return compiled("examples/mBot", arduino_build.UNO)


def switched_on(world: ChipWorld, program, number: int, is_held: bool = False) -> Chip:
    """An mBot that was just switched on; somebody may hold its button."""
    own = number.to_bytes(4, "big") + (number ^ 0xFFFFFFFF).to_bytes(4, "big")
    chip = world.add(MBOT, program.elf, program.symbols, b"\xff" * (MBOT.eeprom_bytes - len(own)) + own)
    chip.set_analog(BUTTON_CHANNEL, 0 if is_held else 5000)
    for pin in (LEFT_FLOOR, RIGHT_FLOOR):
        chip.set_pin(*pin, 1)
    chip.watch(*PIXELS)
    return chip


def lit(chip: Chip) -> list[int]:
    """The LEDs that the pixels showed one after the other; fails unless each pulse is one of a WS2812."""
    edges = [(cycle, level) for cycle, _, level in chip.log(WATCHED)]
    shown: list[int] = []
    bits: list[int] = []
    for (rise, level), (fall, _), *after in zip(edges, edges[1:], [*edges[2:], None], strict=False):
        if not level:
            continue
        high_us = (fall - rise) / CYCLES_A_US
        assert 0.2 <= high_us <= 0.5 or 0.55 <= high_us <= 0.95, high_us
        bits.append(int(high_us > 0.5))
        low_us = (after[0][0] - fall) / CYCLES_A_US if after[0] else 1000
        assert low_us >= 0.3
        if low_us > 50:
            assert len(bits) == 48
            pixels = [int("".join(map(str, bits[at : at + 8])), 2) for at in range(0, 48, 8)]
            assert pixels[:3] == pixels[3:]
            shown.append(COLOURS[pixels[0], pixels[1], pixels[2]])
            bits = []
        else:
            # Between two pixels edges of infrared may be stored.
            assert low_us <= 5 or len(bits) % 24 == 0
    return shown


def wheels(chip: Chip) -> tuple[int, int]:
    """What the wheels do: (direction, speed level)."""
    portd, pwm, at_d6, at_d5 = (chip.read(register, 1)[0] for register in (PORTD, TCCR0A, OCR0A, OCR0B))
    left = at_d6 if pwm >> 6 & 2 else 255 * (portd >> 6 & 1)
    right = at_d5 if pwm >> 4 & 2 else 255 * (portd >> 5 & 1)
    assert left == right
    # D7 low is forward on the left, D4 high on the right.
    turns = (not portd >> 7 & 1, bool(portd >> 4 & 1))
    direction = {(True, True): FORWARD, (False, True): LEFT, (True, False): RIGHT}[turns]
    return direction, DUTIES.index(left)


def test_whoever_holds_the_button_at_power_on_makes_it_lead(world, program) -> None:
    leader, follower = switched_on(world, program, 1, is_held=True), switched_on(world, program, 2)
    world.run(900)
    assert (lit(leader)[-1], lit(follower)[-1]) == (0, 1)
    leader.set_analog(BUTTON_CHANNEL, 5000)
    world.run(200)
    assert lit(leader)[-1] == lit(follower)[-1] == NO_LED
    for chip in (leader, follower):
        chip.record_edges()
        upload(world, chip, BARE)
    world.run(500)
    assert checked_frames([(cycle, level) for cycle, _, level in leader.log(EDGES)])
    assert not follower.log(EDGES)


@pytest.mark.parametrize(
    "image", [pytest.param(BARE, id="bare", marks=pytest.mark.soak), pytest.param(TAGGED, id="tagged")]
)
def test_three_of_them_are_a_swarm(world, program, image) -> None:
    chips = [switched_on(world, program, number, is_held=number == 0) for number in range(3)]
    for chip in chips:
        chip.hears(chips)
    world.run(1100)
    upload(world, chips[0], image)
    chips[0].restart()
    world.run(500)
    for second in range(6):
        led = LEADS[(0, 1, 2, 2)[second % 4]][2]
        assert (*wheels(chips[0]), led) == LEADS[(0, 1, 2, 2)[second % 4]], second
        if second % 2:
            direction, speed, led = FOLLOW[second // 2 % 3]
            assert [(*wheels(chip), lit(chip)[-1]) for chip in chips[1:]] == [(direction, speed, led)] * 2, second
        world.run(1000)
    for chip in chips:
        assert chip.longest_awake_us <= LONGEST_TICK_US
        assert chip.symbols["__bss_end"] - MBOT.ram_begin + chip.stack_bytes() <= MOST_RAM_BYTES
    assert program.flash_bytes <= MOST_FLASH_BYTES


DRIVES, TURNS_RIGHT = (FORWARD, 2), (RIGHT, 2)
# Along a line at level 2 for 3 s, and away from what is nearer than 200 mm.
ALERT = words_to_bytes((0x01000000, 1 << 29 | 2 << 25 | 3 << 23 | 1 << 18 | 1 << 16 | 3 << 14 | 1 << 11))


def test_the_sensor_with_one_wire_hears_no_echo_in_its_own_ping(world, program) -> None:
    car = switched_on(world, program, 1, is_held=True)
    car.set_pin(*ULTRASONIC, 0)
    world.run(50)
    upload(world, car, ALERT)
    for _ in range(250):
        world.run(1)
        assert wheels(car) == DRIVES
    for distance_mm, expected in ((150, TURNS_RIGHT), (260, DRIVES), (180, TURNS_RIGHT)):
        for _ in range(4):
            car.set_pin(*ULTRASONIC, 1)
            car.set_pin(*ULTRASONIC, 0, distance_mm * US_A_MM)
            world.run(60)
        assert wheels(car) == expected


def test_a_line_is_low(world, program) -> None:
    car = switched_on(world, program, 1, is_held=True)
    world.run(50)
    upload(world, car, ALERT)
    for left, right, expected in ((1, 0, TURNS_RIGHT), (0, 0, DRIVES), (1, 0, TURNS_RIGHT), (1, 1, DRIVES)):
        car.set_pin(*LEFT_FLOOR, left)
        car.set_pin(*RIGHT_FLOOR, right)
        world.run(5)
        assert wheels(car) == expected
