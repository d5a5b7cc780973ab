"""Emulated Unos send frames by infrared and hear each other: the waveform at the pin, and a convoy of three cars."""

from itertools import pairwise

import pytest

from motorcade.car.brain import NO_LED
from motorcade.words.image import words_to_bytes
from motorcade.words.infrared import FrameReceiver, frame_durations_us, to_frame
from support.emulated_chips import EDGES, LIGHT, UNO, Chip, World
from support.emulated_uploads import held_image, image_of, upload

CYCLES_A_US = 16
CARRIER_HZ = 38_000
# A longer pause between two pulses is a space.
SPACE_US = 40
_HALF_PERIOD_US = 1e6 / CARRIER_HZ / 2
_MARKS_AND_SPACES = 67


def checked_frames(edges: list[tuple[int, int]]) -> list[int]:
    """Return the frames in a pin's edges, each the cycle and the level.

    Fails unless the carrier is 38 kHz ± 1%, and each mark and space of a frame is as long as it should be ± 5%.
    """
    rises_us = [cycle / CYCLES_A_US for cycle, level in edges if level]
    periods_us = [later - earlier for earlier, later in pairwise(rises_us) if later - earlier < SPACE_US]
    carrier_hz = 1e6 * len(periods_us) / sum(periods_us)
    assert abs(carrier_hz - CARRIER_HZ) <= CARRIER_HZ / 100
    assert max(periods_us) - min(periods_us) < 1
    # The first mark may have begun before the record.
    marks = _marks(edges)[1:]
    first = next(index for index, (begin, end) in enumerate(marks) if end - begin > 5000)
    durations = [edge for (begin, end), (after, _) in pairwise(marks[first:]) for edge in (end - begin, after - end)]
    receiver, frames = FrameReceiver(), []
    for index, duration_us in enumerate(durations):
        (receiver.receive_space if index % 2 else receiver.receive_mark)(round(duration_us))
        frame = receiver.next_frame()
        frames += [frame] if frame is not None else []
    # A pause follows the last mark of each.
    for frame, begin in zip(frames, range(0, len(durations), _MARKS_AND_SPACES + 1), strict=False):
        for index, nominal_us in enumerate(frame_durations_us(frame)):
            measured_us = durations[begin + index] + (-_HALF_PERIOD_US if index % 2 else _HALF_PERIOD_US)
            assert abs(measured_us - nominal_us) <= nominal_us * 0.05
    return frames


def _marks(edges: list[tuple[int, int]]) -> list[tuple[float, float]]:
    """Where each mark begins and ends, in µs: from its first pulse to the end of its last one."""
    marks: list[tuple[float, float]] = []
    for cycle, level in edges:
        at_us = cycle / CYCLES_A_US
        if level and (not marks or at_us - marks[-1][1] > SPACE_US):
            marks.append((at_us, at_us))
        elif marks:
            marks[-1] = (marks[-1][0], at_us)
    return marks


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
