"""Emulated mBots as they come out of the box: button, lamps, sensors and motors, and three that drive together."""

from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path

import pytest

from motorcade.car.brain import NO_LED
from motorcade.engine.world import World
from motorcade.mats import formation, open_table
from motorcade.program.files import compile_project
from motorcade.words.infrared import frame_durations_us, to_frame
from motorcade.words.packing import words_to_bytes
from motorcade.words.request import BLINK, car_request
from support import arduino_build
from support.emulated_chips import MBOT, OUTPUTS, Chip, ChipWorld
from support.emulated_uploads import upload
from support.soak import SOAK
from support.strategies import CLASSROOM

PARADE = Path(__file__).parents[2] / "examples" / "parade.motorcade.json"
CYCLES_A_US, CYCLES_A_MS = 16, 16_000
BUTTON, PRESSED_MV, FREE_MV = 7, 0, 4900
PIXELS, PIXEL_COUNT, BITS = ("B", 5), 2, 24
LATCH_US, BURST_US = 13, 300
# Low over a line; the receiver; the ultrasonic sensor's only wire.
LEFT_FLOOR, RIGHT_FLOOR, RECEIVER, ECHO = ("B", 1), ("B", 2), ("D", 2), ("C", 3)
# Registers of an ATmega328P: the motors' port, and the PWM at D6 and D5.
PORTD, TCCR0A, OCR0A, OCR0B = 0x2B, 0x44, 0x47, 0x48
REGISTERS = OCR0B + 1 - PORTD
DUTIES = (0, 85, 170, 255)
FORWARD, LEFT, RIGHT = range(3)
# Green, red and blue of LEDs 0 to 3, and of none.
COLOURS = {(24, 32, 0): 0, (0, 0, 40): 1, (32, 0, 0): 2, (0, 32, 12): 3, (0, 0, 0): NO_LED}
US_A_MM = 2000 / 343
# What a car does in the simulation before its first word.
NOTHING_YET = ((FORWARD, 0), NO_LED)
# So late may a follower be.
MOST_MS = 10
LONGEST_TICK_US = 5000
MOST_RAM_BYTES = 1638


@pytest.fixture
def program(compiled):
    return compiled("examples/mBot", arduino_build.UNO)


def switched_on(world: ChipWorld, program, leads: bool = False, number: int = 1) -> Chip:
    """A car that is switched on, its button held or not; whose number is in its EEPROM."""
    content = b"\xff" * (MBOT.eeprom_bytes - 8) + number.to_bytes(4, "big") + (number ^ 0xFFFFFFFF).to_bytes(4, "big")
    car = world.add(MBOT, program.elf, program.symbols, content)
    car.set_voltage(BUTTON, PRESSED_MV if leads else FREE_MV)
    car.watch(*PIXELS)
    for floor in (LEFT_FLOOR, RIGHT_FLOOR):
        car.set_pin(*floor, 1)
    return car


def lamps(car: Chip) -> list[tuple[int, int]]:
    """When all pixels began to show another colour, in cycles, and which LED it stands for.

    Fails unless a 0 is high for 5 cycles and a 1 for 11, a pixel takes at most 30 µs, and all pixels show the same
    after each burst; those that hear nothing for LATCH_US take what came for all there is.
    """
    edges = car.log(OUTPUTS)
    highs = [(begin, end - begin) for (begin, _, level), (end, _, _) in pairwise(edges) if level]
    assert {cycles for _, cycles in highs} <= {5, 11}
    shown: list[tuple[int, int]] = []
    chain = [NO_LED] * PIXEL_COUNT
    place, ended = 0, 0
    for at in range(0, len(highs), BITS):
        pixel = highs[at : at + BITS]
        begin, (last, cycles) = pixel[0][0], pixel[-1]
        assert last + cycles - begin <= 30 * CYCLES_A_US
        if begin - ended > BURST_US * CYCLES_A_US:
            assert len(set(chain)) == 1
        if begin - ended > LATCH_US * CYCLES_A_US:
            place = 0
        ended = last + cycles
        bits = int("".join("1" if cycles == 11 else "0" for _, cycles in pixel), 2)
        led = COLOURS[bits >> 16, bits >> 8 & 255, bits & 255]
        chain[place:] = [led, *chain[place + 1 :]][: len(chain) - place]
        place += 1
        if set(chain) == {led} and (not shown or shown[-1][1] != led):
            shown.append((begin, led))
    return shown


def wheels(car: Chip) -> tuple[int, int] | None:
    """The direction and the speed level of its wheels; None in the moment in which only one has changed."""
    registers = car.read(PORTD, REGISTERS)
    port, pwm, at_d6, at_d5 = (registers[address - PORTD] for address in (PORTD, TCCR0A, OCR0A, OCR0B))
    left = at_d6 if pwm >> 6 & 2 else 255 * (port >> 6 & 1)
    right = at_d5 if pwm >> 4 & 2 else 255 * (port >> 5 & 1)
    if left != right:
        return None
    if left == 0:
        return FORWARD, 0
    # Left forward is low at D7, right forward high at D4.
    directions = {(0, 1): FORWARD, (1, 1): LEFT, (0, 0): RIGHT}
    return directions[port >> 7 & 1, port >> 4 & 1], DUTIES.index(left)


def word(direction: int, speed: int, led: int, *senses: int) -> int:
    """A word that drives and lights an LED for 3 s."""
    driven = 1 << 29 | direction << 27 | speed << 25 | 3 << 23 | led << 21 | 3 << 19
    return driven | sum(1 << bit for bit in senses)


def test_the_button_at_power_on_makes_a_leader(world, program) -> None:
    cars = [switched_on(world, program, leads, number) for leads, number in ((True, 7), (False, 8))]
    world.run(50)
    for car in cars:
        car.send(car_request("a", 1))
    world.run(600)
    for car, number, role, colour in zip(cars, (7, 8), (b"leader", b"follower"), (0, 1), strict=True):
        answer = car.received()
        assert b" role=" + role in answer
        assert b" number=%08x" % number in answer
        assert [led for _, led in lamps(car)] == [colour]


def test_a_leader_stays_one_when_its_port_is_opened(world, program) -> None:
    """Which resets the chip, while nobody holds the button."""
    car = switched_on(world, program, leads=True)
    world.run(50)
    car.set_voltage(BUTTON, FREE_MV)
    for _ in range(2):
        car.restart()
        world.run(50)
    car.send(car_request("a", 1))
    world.run(600)
    assert b" role=leader" in car.received()


def test_no_frame_is_lost_while_pixels_are_written(world, program) -> None:
    """Two words in turn, at each of which the wheels turn another way; a car that blinks lights an LED each 100 ms."""
    car = switched_on(world, program)
    world.run(50)
    directions = (LEFT, RIGHT)
    frames = 600 if SOAK else 60
    for number in range(frames):
        if number % 60 == 0:
            car.send(car_request(BLINK, number % 256))
        direction = directions[number % 2]
        at_us, level = 0.0, 1
        for duration_us in frame_durations_us(to_frame(1 << 31 | word(direction, 1 + number % 3, number % 4))):
            level = 1 - level
            car.set_pin(*RECEIVER, level, at_us)
            at_us += duration_us
        car.set_pin(*RECEIVER, 1, at_us)
        world.run(at_us / 1000 + 5)
        assert wheels(car) == (direction, 1 + number % 3), number
    assert len(lamps(car)) >= frames * 0.6


def test_a_ping_is_no_echo_of_itself(world, program) -> None:
    """At the only wire of the ultrasonic sensor its own 10 µs come back, too."""
    car = switched_on(world, program, leads=True)
    world.run(50)
    avoids = word(FORWARD, 2, 0) | 1 << 18 | 1 << 16 | 3 << 14
    upload(world, car, words_to_bytes((0x01000000, avoids)))
    car.watch(*ECHO)
    for echo_mm, expected in ((None, FORWARD), (150, RIGHT), (250, FORWARD)):
        shown = set()
        for _ in range(8):
            if echo_mm:
                car.set_pin(*ECHO, 1)
                car.set_pin(*ECHO, 0, echo_mm * US_A_MM)
            for _ in range(12):
                world.run(5)
                shown.add(wheels(car)[0])
        assert wheels(car) == (expected, 2)
        if echo_mm is None:
            assert shown == {FORWARD}


def test_the_line_sensors_are_low_over_a_line(world, program) -> None:
    car = switched_on(world, program, leads=True)
    world.run(50)
    upload(world, car, words_to_bytes((0x01000000, word(FORWARD, 2, 0, 11))))
    for left, right, expected in ((1, 1, FORWARD), (0, 1, LEFT), (0, 0, FORWARD), (1, 0, RIGHT)):
        car.set_pin(*LEFT_FLOOR, left)
        car.set_pin(*RIGHT_FLOOR, right)
        world.run(5)
        assert wheels(car)[0] == expected


# When a car begins to do something, in ms, and what: the direction and the level of its wheels, and its LED.
Does = tuple[int, tuple[int, int], int]


def begins(shown: Iterable[Does]) -> list[Does]:
    """Only the moments at which a car begins to do something else, and does it for longer than a moment."""
    found: list[Does] = []
    for moment in shown:
        if found and found[-1][1:] == moment[1:]:
            continue
        # Its wheels were set, and its LED a little later.
        if len(found) > 1 and moment[0] - found[-1][0] <= 1:
            found.pop()
        found.append(moment)
    return found


def simulated(image: bytes, duration_ms: int) -> list[list[Does]]:
    """What a leader and two followers do in a simulation."""
    world = World(open_table(formation(2, 1.0)), [image], CLASSROOM)
    shown: list[list[Does]] = [[], [], []]
    while world.now_ms < duration_ms:
        world.run(world.tick_ms)
        now = world.snapshot()
        for car, moments in enumerate(shown):
            code = int(now.wheels[car])
            direction = code >> 2 if code & 3 else FORWARD
            moments.append((world.now_ms, (direction, code & 3), int(now.led[car])))
    return list(map(begins, shown))


def emulated(world: ChipWorld, cars: list[Chip], duration_ms: int) -> list[list[Does]]:
    """What cars do from now on."""
    begin_ms = world.now_ms
    turned: list[list[tuple[int, tuple[int, int]]]] = [[] for _ in cars]
    while world.now_ms < begin_ms + duration_ms:
        world.run(1)
        for car, moments in zip(cars, turned, strict=True):
            if does := wheels(car):
                moments.append((world.now_ms, does))
    shown = []
    for car, moments in zip(cars, turned, strict=True):
        lit = lamps(car)
        shown.append(begins((at_ms, turns, _lit(lit, at_ms)) for at_ms, turns in moments))
    return shown


def _lit(lamps: list[tuple[int, int]], at_ms: int) -> int:
    return next((led for cycle, led in reversed(lamps) if cycle <= at_ms * CYCLES_A_MS), NO_LED)


def test_three_mbots_do_what_the_simulation_does(world, program) -> None:
    """Infrared crosses from D3 to D2."""
    image = compile_project(PARADE.read_bytes(), PARADE)[0].image
    # A leader of bare words sends all the time, which takes long to emulate.
    duration_ms = 40_000 if SOAK else 2_000
    cars = [switched_on(world, program, number == 0, number) for number in range(3)]
    for car in cars:
        car.hears(cars)
    world.run(50)
    upload(world, cars[0], image)
    cars[0].restart()
    real = emulated(world, cars, duration_ms)
    # Both begin with the leader's first state; the colours of their roles come before that.
    begin_ms = real[0][1][0] - 1
    for does, expected in zip(real, simulated(image, world.now_ms - begin_ms), strict=True):
        done, due = does[1:], expected
        if due[0][1:] == NOTHING_YET:
            due = due[1:]
        assert [moment[1:] for moment in done] == [moment[1:] for moment in due]
        late_ms = [now[0] - begin_ms - then[0] for now, then in zip(done, due, strict=True)]
        assert max(map(abs, late_ms)) <= MOST_MS
    for car in cars:
        assert car.longest_awake_us <= LONGEST_TICK_US
        assert car.symbols["_end"] - MBOT.ram_begin + car.stack_bytes() <= MOST_RAM_BYTES
