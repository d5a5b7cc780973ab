"""An emulated Elegoo Smart Robot Car V4.0: it follows, its driver is awake, and its line sensors are analog."""

import pytest

from motorcade.words.infrared import frame_durations_us, to_frame
from support.emulated_chips import UNO, Chip, ChipWorld

FRAMES = 60
RECEIVER = ("B", 1)
# Which analog inputs see the floor, and what they give over a line and beside it.
LEFT_FLOOR, RIGHT_FLOOR = 2, 0
LINE_MV, FLOOR_MV = 2500, 500
# Registers of an ATmega328P: ports, and the PWM at D6 and D5.
PORTB, PORTD, TCCR0A, OCR0A, OCR0B = 0x25, 0x2B, 0x44, 0x47, 0x48
DUTIES = (0, 85, 170, 255)
FORWARD, LEFT, RIGHT = range(3)


def wheels(car: Chip) -> tuple[int, int]:
    """The direction and the speed level of its wheels; its driver has to be awake."""
    portb, portd, pwm, at_d6, at_d5 = (car.read(register, 1)[0] for register in (PORTB, PORTD, TCCR0A, OCR0A, OCR0B))
    assert portd >> 3 & 1
    duties = at_d6 if pwm >> 7 & 1 else 255 * (portd >> 6 & 1), at_d5 if pwm >> 5 & 1 else 255 * (portd >> 5 & 1)
    assert duties[0] == duties[1]
    directions = {(1, 1): FORWARD, (0, 1): LEFT, (1, 0): RIGHT}
    return directions[portb & 1, portd >> 7 & 1], DUTIES.index(duties[0])


def word(direction: int, speed: int) -> int:
    return 1 << 29 | direction << 27 | speed << 25 | 3 << 23


def hear(world: ChipWorld, car: Chip, frame: int) -> None:
    """Send a frame to the car's receiver, and let it pass."""
    at_us, level = 0.0, 1
    for duration_us in frame_durations_us(frame):
        level = 1 - level
        car.set_pin(*RECEIVER, level, at_us)
        at_us += duration_us
    car.set_pin(*RECEIVER, 1, at_us)
    world.run(at_us / 1000 + 5)


@pytest.fixture
def car(world, shop_program) -> Chip:
    program = shop_program("elegoo-v4")
    made = world.add(UNO, program.elf, program.symbols)
    world.run(50)
    return made


def test_it_follows(world, car) -> None:
    for number in range(FRAMES):
        expected = (LEFT, FORWARD, RIGHT)[number % 3], 1 + number % 2
        hear(world, car, to_frame(1 << 31 | word(*expected)))
        assert wheels(car) == expected


def test_it_follows_a_line_by_analog_sensors(world, car) -> None:
    hear(world, car, to_frame(1 << 31 | word(FORWARD, 2) | 1 << 11))
    for left, right, expected in ((0, 0, FORWARD), (1, 0, LEFT), (1, 1, FORWARD), (0, 1, RIGHT)):
        car.set_voltage(LEFT_FLOOR, LINE_MV if left else FLOOR_MV)
        car.set_voltage(RIGHT_FLOOR, LINE_MV if right else FLOOR_MV)
        world.run(5)
        assert wheels(car) == (expected, 2)
