"""Emulated Unos send frames by infrared and hear each other: the waveform at the pin, and a convoy of three cars."""

import pytest

from motorcade.car.brain import NO_LED
from motorcade.words.image import words_to_bytes
from motorcade.words.infrared import to_frame
from support.emulated_chips import EDGES, LIGHT, UNO, Chip, World
from support.emulated_uploads import held_image, image_of, upload
from support.infrared_waveform import checked_frames

# Registers of an ATmega328P: the ports of LEDs and motors, and the PWM at D5 and D6.
PORTB, PORTC, PORTD, TCCR0A, OCR0A, OCR0B = 0x25, 0x28, 0x2B, 0x44, 0x47, 0x48
DUTIES = (0, 115, 180, 255)
FORWARD, LEFT, RIGHT = range(3)
LONGEST_TICK_US = 5000
MOST_RAM_BYTES = 1638


def convoy(world: World, program, image: bytes, hears: list[list[int]]) -> list[Chip]:
    """A leader, which has just begun ``image``, and followers; ``hears`` has for each car the others that it hears."""
    chips = []
    for index in range(len(hears)):
        made = program(index == 0)
        # Each has a number of its own, which it draws by.
        number = index.to_bytes(4, "big") + (index ^ 0xFFFFFFFF).to_bytes(4, "big")
        chips.append(world.add(UNO, made.elf, made.symbols, b"\xff" * (UNO.eeprom_bytes - len(number)) + number))
    for chip, heard in zip(chips, hears, strict=True):
        # Each receiver sees its own car's light, too.
        chip.hears([chip, *(chips[index] for index in heard)])
    world.run(50)
    upload(world, chips[0], image)
    chips[0].restart()
    return chips


def shown(chip: Chip) -> tuple[int, int, int]:
    """What a chip does with its wheels and LEDs: (direction, speed level, LED)."""
    portb, portc, portd, pwm, at_d6, at_d5 = (
        chip.read(each, 1)[0] for each in (PORTB, PORTC, PORTD, TCCR0A, OCR0A, OCR0B)
    )
    left = at_d5 if pwm >> 4 & 2 else 255 * (portd >> 5 & 1)
    right = at_d6 if pwm >> 6 & 2 else 255 * (portd >> 6 & 1)
    assert left == right
    levels = (portd >> 7 & 1, portb & 1, portb >> 1 & 1, portb >> 2 & 1)
    direction = {(1, 0, 1, 0): FORWARD, (0, 1, 1, 0): LEFT, (1, 0, 0, 1): RIGHT, (0, 0, 0, 0): FORWARD}[levels]
    return direction, DUTIES.index(left), {0: NO_LED, 1: 0, 2: 1, 4: 2, 8: 3}[portc & 15]


def word(direction: int, speed: int, led: int, seconds: int = 3) -> int:
    """A word that drives and lights an LED for so long; infrared is accepted by followers alone."""
    return 1 << 29 | direction << 27 | speed << 25 | seconds << 23 | led << 21 | seconds << 19


# Followers' words last longer than a dwell, which is 2 s.
LEADS = ((LEFT, 2, 0), (FORWARD, 0, 2), (RIGHT, 3, 1))
STATES = tuple(word(*does, seconds) for does, seconds in zip(LEADS, (1, 1, 2), strict=True))
FOLLOW = ((LEFT, 1, 1), (RIGHT, 2, 0), (LEFT, 3, 3))
WORDS = tuple(1 << 31 | word(*does) for does in FOLLOW)
BARE = words_to_bytes((0x03030200, *STATES, *WORDS))
FORWARD_BIT = 1 << 30
TAGGED = words_to_bytes((0x03030201, *STATES, *(word | FORWARD_BIT for word in WORDS)))


def test_the_waveform_at_the_pin_is_a_frame_on_a_carrier_of_38_khz(world, car_program) -> None:
    program = car_program(True)
    car = world.add(UNO, program.elf, program.symbols)
    world.run(50)
    upload(world, car, BARE)
    car.record_edges()
    world.run(1000)
    # Bytes come and go while it sends.
    held_image(world, car)
    world.run(500)
    sent = checked_frames([(cycle, level) for cycle, _, level in car.log(EDGES)])
    assert len(sent) >= 18
    assert set(sent) <= {to_frame(word) for word in WORDS}
    assert car.overruns == 0


@pytest.mark.parametrize(
    ("image", "hears"),
    [
        # The last one hears only the one before it.
        pytest.param(TAGGED, [[1], [0, 2], [1]], id="tagged"),
        pytest.param(BARE, [[1, 2], [0, 2], [0, 1]], id="bare", marks=pytest.mark.soak),
    ],
)
def test_a_convoy_does_what_its_words_say(world, car_program, image, hears) -> None:
    chips = convoy(world, car_program, image, hears)
    world.run(500)
    for second in range(12):
        assert shown(chips[0]) == LEADS[(0, 1, 2, 2)[second % 4]], second
        # By the second half of its time a word has come to all.
        if second % 2:
            assert [shown(chip) for chip in chips[1:]] == [FOLLOW[second // 2 % 3]] * 2, second
        world.run(1000)
    for chip in chips:
        assert chip.longest_awake_us <= LONGEST_TICK_US
        assert chip.symbols["__bss_end"] - UNO.ram_begin + chip.stack_bytes() <= MOST_RAM_BYTES


def test_no_byte_of_an_upload_is_lost_while_frames_come_and_go(world, car_program) -> None:
    follower = convoy(world, car_program, TAGGED, [[1, 2], [0, 2], [0, 1]])[1]
    world.run(100)
    edges = len(follower.log(LIGHT))
    for seed in range(3):
        # A follower keeps an image, too: it has one as soon as it is made a leader.
        image = image_of(100, seed)
        took_ms = upload(world, follower, image)
        assert took_ms < 600 + 2000
        assert held_image(world, follower) == image
    assert len(follower.log(LIGHT)) - edges > 10 * 68
    assert follower.overruns == 0
    assert follower.longest_awake_us <= LONGEST_TICK_US
