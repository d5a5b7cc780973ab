"""Emulated Unos: what a car does when somebody speaks, when it sees somebody or a wall; and a convoy by infrared."""

from itertools import pairwise

import pytest

from motorcade.car.brain import NO_LED, VOICE_GO, VOICE_STOP
from motorcade.config.pins import VoiceMap, parse_pins
from motorcade.firmware.arduino_library import library_files, library_folder, sketch_files
from motorcade.words.infrared import FrameReceiver, frame_durations_us, to_frame
from motorcade.words.packing import words_to_bytes
from support import arduino_build
from support.emulated_chips import EDGES, LIGHT, UNO, Chip, ChipWorld
from support.emulated_uploads import held_image, image_of, upload
from support.strategies import CLASSROOM

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


def convoy(world: ChipWorld, program, image: bytes, hears: list[list[int]]) -> list[Chip]:
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
    # LED 3 is at D13.
    lit = portc & 7 | portb >> 2 & 8
    return direction, DUTIES.index(left), {0: NO_LED, 1: 0, 2: 1, 4: 2, 8: 3}[lit]


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
        assert chip.symbols["_end"] - UNO.ram_begin + chip.stack_bytes() <= MOST_RAM_BYTES


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


STOP, GO = b"\xaa\x01", b"\xaa\x02"
VOICE_BAUD = 9600
# PC5 is A5, PB4 is D12, PD3 is D3, PC4 is A4, PB5 is D13.
VOICE_PIN, PIR_PIN, ECHO_PIN = ("C", 5), ("B", 4), ("D", 3)
LEFT_FLOOR_PIN, RIGHT_FLOOR_PIN = ("C", 4), ("C", 3)
US_A_MM = 2000 / 343
DRIVES, TURNS_RIGHT, STILL = (FORWARD, 2, NO_LED), (RIGHT, 2, NO_LED), (FORWARD, 0, NO_LED)
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


def speak(car, data: bytes) -> None:
    at_us = 0.0
    for byte in data:
        for bit in (0, *(byte >> place & 1 for place in range(8)), 1):
            car.set_pin(*VOICE_PIN, bit, at_us)
            at_us += 1e6 / VOICE_BAUD


def test_the_car_stops_and_goes_on_at_a_word_that_somebody_speaks(world, car) -> None:
    assert shown(car) == DRIVES
    for data, expected in ((STOP, STILL), (GO, DRIVES), (b"\x00" + STOP, STILL), (b"\xaa", STILL), (b"\x02", DRIVES)):
        speak(car, data)
        world.run(10)
        assert shown(car) == expected
    assert car.overruns == 0


def test_the_car_stands_while_a_person_is_near(world, car) -> None:
    for level, expected in ((1, STILL), (0, DRIVES), (1, STILL)):
        car.set_pin(*PIR_PIN, level)
        world.run(5)
        assert shown(car) == expected


def test_the_car_follows_a_line(world, car) -> None:
    for left, right, expected in ((0, 1, TURNS_RIGHT), (1, 1, DRIVES), (0, 1, TURNS_RIGHT), (0, 0, DRIVES)):
        car.set_pin(*LEFT_FLOOR_PIN, left)
        car.set_pin(*RIGHT_FLOOR_PIN, right)
        world.run(5)
        assert shown(car) == expected


def test_the_car_turns_away_from_a_wall_and_forgets_it(world, car) -> None:
    def echoes(distance_mm: int, times: int) -> None:
        for _ in range(times):
            car.set_pin(*ECHO_PIN, 1)
            car.set_pin(*ECHO_PIN, 0, distance_mm * US_A_MM)
            world.run(60)

    echoes(150, 4)
    assert shown(car) == TURNS_RIGHT
    echoes(260, 3)
    assert shown(car) == DRIVES
    echoes(180, 3)
    assert shown(car) == TURNS_RIGHT
    # No echo comes any more.
    world.run(250)
    assert shown(car) == DRIVES
