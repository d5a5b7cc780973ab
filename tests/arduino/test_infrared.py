"""Emulated Unos send frames by infrared and hear each other: the waveform at the pin, and a convoy of three cars."""

from statistics import median

import pytest

from motorcade.car import frames
from motorcade.car.brain import NO_LED, STARTED_MS, WORD
from motorcade.engine.events import START
from motorcade.mats import Pose, open_table
from motorcade.words.image import words_to_bytes
from motorcade.words.infrared import to_frame
from support.emulated_chips import CYCLES_A_MS, EDGES, LIGHT, UNO, WATCHED, Chip, World
from support.emulated_uploads import held_image, image_of, upload
from support.infrared_waveform import checked_frames
from support.plain_world import PlainWorld
from support.strategies import CLASSROOM

# Registers of an ATmega328P: the ports of LEDs and motors, and the PWM at D5 and D6.
PORTB, PORTC, PORTD, TCCR0A, OCR0A, OCR0B = 0x25, 0x28, 0x2B, 0x44, 0x47, 0x48
REGISTERS = (PORTB, PORTC, PORTD, TCCR0A, OCR0A, OCR0B)
DUTIES = (0, 115, 180, 255)
FORWARD, LEFT, RIGHT = range(3)
# One frame that has begun is finished before the next word's; and a tick.
FRAME_MS = 86 + 5 + 3
# Both clocks and the way from a pin to the next tick.
TICKS_MS = 6
LONGEST_TICK_US = 5000
MOST_RAM_BYTES = 1638


def eeprom_with_number(number: int, content: bytes = b"\xff" * 1024) -> bytes:
    return content[:-8] + number.to_bytes(4, "big") + (number ^ 0xFFFFFFFF).to_bytes(4, "big")


class Convoy:
    """A leader and followers on chips, and the same cars in the plain world.

    Args:
        eeprom: of a leader to which ``image`` was uploaded.
        hears: for each car, the others that it hears.
    """

    def __init__(
        self, world: World, program, eeprom: bytes, image: bytes, places: list[Pose], hears: list[list[int]]
    ) -> None:
        self.begin_ms = 0
        self.memories: list[int] = []
        self.plain = PlainWorld(open_table(places), [image], CLASSROOM)
        # All are switched on at once, and the leader has its program.
        contents = [eeprom, *[b"\xff" * 1024] * (len(places) - 1)]
        self.chips = []
        for index, content in enumerate(contents):
            made = program(index == 0)
            number = self.plain.boards[index].number
            self.chips.append(world.add(UNO, made.elf, made.symbols, eeprom_with_number(number, content)))
        for chip in self.chips:
            pointer = chip.symbols["car"] + 1
            chip.watch(*REGISTERS, pointer, pointer + 1)
        # Each receiver sees its own car's light, too.
        for chip, heard in zip(self.chips, hears, strict=True):
            chip.hears([chip, *(self.chips[index] for index in heard)])

    def watch_words(self) -> list[int]:
        """Log the words that the followers hold; returns where the memory of each car begins."""
        addresses = []
        for chip in self.chips:
            low, high = chip.read(chip.symbols["car"] + 1, 2)
            addresses.append(high << 8 | low)
            chip.watch(*range(addresses[-1], addresses[-1] + 4 * (STARTED_MS + 1)))
        return addresses


@pytest.fixture
def leader_eeprom(chips_library, car_program):
    """Uploads an image to a leader; returns the EEPROM."""

    def made(image: bytes) -> bytes:
        world, program = World(chips_library), car_program(True)
        leader = world.add(UNO, program.elf, program.symbols)
        world.run(50)
        upload(world, leader, image)
        eeprom = leader.eeprom()
        world.close()
        return eeprom

    return made


def words_begun(chip: Chip, memory: int, begin_ms: float) -> list[tuple[int, float]]:
    """Each word that a chip began, and when."""
    held = bytearray(4 * (STARTED_MS + 1))
    begun: list[tuple[int, float]] = []
    last = None
    log = [each for each in chip.log(WATCHED) if memory <= each[1] < memory + len(held)]
    for (cycle, address, value), following in zip(log, [*log[1:], (None, 0, 0)], strict=True):
        held[address - memory] = value
        if following[0] is not None and following[0] - cycle < CYCLES_A_MS:
            continue
        word, started = (int.from_bytes(held[4 * at : 4 * at + 4], "little") for at in (WORD, STARTED_MS))
        if word and (word, started) != last:
            last = (word, started)
            begun.append((word, cycle / CYCLES_A_MS - begin_ms))
    return begun


def shown(chip: Chip, begin_ms: float) -> list[tuple[tuple[int, int, int], float]]:
    """What a chip does with its wheels and LEDs, and since when: (direction, speed level, LED)."""
    values = dict.fromkeys(REGISTERS, 0)
    states = []
    for cycle, address, value in chip.log(WATCHED):
        if address in values:
            values[address] = value
            state = _state(values)
            if not states or states[-1][0] != state:
                states.append((state, cycle / CYCLES_A_MS - begin_ms))
    return lasting(states)


def _state(values: dict[int, int]) -> tuple[int, int, int]:
    def duty(pin: int, com: int, compare: int) -> int:
        return values[compare] if values[TCCR0A] >> com & 2 else 255 * (values[PORTD] >> pin & 1)

    left, right = duty(5, 4, OCR0B), duty(6, 6, OCR0A)
    speed = DUTIES.index(left) if left == right and left in DUTIES else -1
    levels = (values[PORTD] >> 7 & 1, values[PORTB] & 1, values[PORTB] >> 1 & 1, values[PORTB] >> 2 & 1)
    direction = {(1, 0, 1, 0): FORWARD, (0, 1, 1, 0): LEFT, (1, 0, 0, 1): RIGHT}.get(levels, FORWARD)
    lit = [led for led in range(4) if values[PORTC] >> led & 1]
    return (direction, speed, lit[0] if lit else NO_LED)


def lasting(states: list[tuple[tuple[int, int, int], float]]) -> list[tuple[tuple[int, int, int], float]]:
    """The states that last: a wheel changes its pins one by one."""
    kept: list[tuple[tuple[int, int, int], float]] = []
    for (state, at_ms), following in zip(states, [*states[1:], (None, float("inf"))], strict=True):
        if following[1] - at_ms > 5 and (not kept or kept[-1][0] != state):
            kept.append((state, at_ms))
    return kept


def simulated(plain: PlainWorld, duration_ms: int) -> list[list[tuple[tuple[int, int, int], float]]]:
    """What each car of the plain world does, and since when."""
    states: list[list[tuple[tuple[int, int, int], float]]] = [[] for _ in plain.boards]
    for at_ms in range(duration_ms):
        plain.step()
        for board, log in zip(plain.boards, states, strict=True):
            state = (board.direction, board.speed_level, board.led)
            if not log or log[-1][0] != state:
                log.append((state, at_ms))
    return states


def agree(found, expected, within_ms: float) -> None:
    """Fail unless the same things happen in the same order, each at its time."""
    length = min(len(found), len(expected))
    assert abs(len(found) - len(expected)) <= 1
    assert [each for each, _ in found[:length]] == [each for each, _ in expected[:length]]
    late_ms = [mine - other for (_, mine), (_, other) in zip(found[:length], expected[:length], strict=True)]
    assert max(map(abs, late_ms)) <= within_ms, late_ms


def word(direction: int, speed: int, led: int, seconds: int = 3) -> int:
    """A word that drives and lights an LED for so long; infrared is accepted by followers alone."""
    return 1 << 29 | direction << 27 | speed << 25 | seconds << 23 | led << 21 | seconds << 19


# Cars turn on the spot, so they keep their distances. Followers' words last longer than a dwell, which is 2 s.
STATES = (word(LEFT, 2, 0, 1), word(FORWARD, 0, 2, 1), word(RIGHT, 3, 1, 2))
WORDS = tuple(1 << 31 | each for each in (word(LEFT, 1, 1), word(RIGHT, 2, 0), word(LEFT, 3, 3)))
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


@pytest.mark.soak
def test_a_leader_and_two_followers_drive_as_the_simulator_says_for_30_s(world, car_program, leader_eeprom) -> None:
    places = [Pose(0, 0), Pose(0.4, 0), Pose(0, 0.4)]
    convoy = Convoy(world, car_program, leader_eeprom(BARE), BARE, places, [[1, 2], [0, 2], [0, 1]])
    compare(world, convoy, 30_000, [FRAME_MS] * 3)


def test_a_follower_that_hears_only_another_one_gets_each_tagged_word(world, car_program, leader_eeprom) -> None:
    places = [Pose(0, 0), Pose(0.9, 0), Pose(1.8, 0)]
    convoy = Convoy(world, car_program, leader_eeprom(TAGGED), TAGGED, places, [[1], [0, 2], [1]])
    # A new word goes out at once. Random times are those of the simulator only as long as each car hears the same,
    # so a frame may collide with another one here and not there. The leader sends the word three times in OPENING_MS;
    # the first follower passes it on after a random time below the first interval.
    random_ms = CLASSROOM.infrared.first_interval_ms
    late_ms = frames.OPENING_MS + FRAME_MS
    compare(world, convoy, 30_000, [TICKS_MS, late_ms, late_ms + FRAME_MS + random_ms])
    # Most words come as they do in the simulator.
    expected = [at_ms for at_ms, car, kind, _, _, _ in convoy.plain.events if car == 1 and kind == START]
    begun = words_begun(convoy.chips[1], convoy.memories[1], convoy.begin_ms)
    assert median(abs(mine - other) for (_, mine), other in zip(begun, expected, strict=False)) <= TICKS_MS


def compare(world: World, convoy: Convoy, duration_ms: int, within_ms: list[int]) -> None:
    """Run chips and plain world: wheels, LEDs and words must be the same, each at its time."""
    begin_ms = world.now_ms
    world.run(20)
    convoy.memories, convoy.begin_ms = convoy.watch_words(), begin_ms
    world.run(duration_ms - 20)
    expected = simulated(convoy.plain, duration_ms)
    for index, chip in enumerate(convoy.chips):
        agree(shown(chip, begin_ms), lasting(expected[index]), within_ms[index])
        assert chip.longest_awake_us <= LONGEST_TICK_US
        assert chip.symbols["__bss_end"] - UNO.ram_begin + chip.stack_bytes() <= MOST_RAM_BYTES
        if index > 0:
            begun = words_begun(chip, convoy.memories[index], begin_ms)
            events = convoy.plain.events
            starts = [(word, at_ms) for at_ms, car, kind, _, word, _ in events if car == index and kind == START]
            assert len(starts) >= duration_ms // 2000 - 1
            agree(begun, starts, within_ms[index])


def test_no_byte_of_an_upload_is_lost_while_frames_come_and_go(world, car_program, leader_eeprom) -> None:
    places = [Pose(0, 0), Pose(0.4, 0), Pose(0, 0.4)]
    convoy = Convoy(world, car_program, leader_eeprom(TAGGED), TAGGED, places, [[1, 2], [0, 2], [0, 1]])
    world.run(100)
    edges = len(convoy.chips[1].log(LIGHT))
    for seed in range(3):
        # A follower keeps an image, too: it has one as soon as it is made a leader.
        image = image_of(100, seed)
        took_ms = upload(world, convoy.chips[1], image)
        assert took_ms < 600 + 2000
        assert held_image(world, convoy.chips[1]) == image
    assert len(convoy.chips[1].log(LIGHT)) - edges > 10 * 68
    assert convoy.chips[1].overruns == 0
    assert convoy.chips[1].longest_awake_us <= LONGEST_TICK_US
