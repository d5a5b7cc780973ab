"""Uploads to an emulated Uno and Mega, by the project's own uploader through the chip's UART at 115200 baud."""

import itertools
import random

import pytest

from motorcade.upload.transfer import UploadTransfer
from motorcade.words.flow import JUMP
from motorcade.words.formats import FLOW
from motorcade.words.image import refused_image
from motorcade.words.packing import bytes_to_words, words_to_bytes
from motorcade.words.upload import READBACK_REQUEST
from motorcade.words.uploader import REFUSED, VERIFIED
from support import arduino_build, emulated_chips
from support.emulated_chips import CYCLES_A_MS, EEPROM, RECEIVED, UNO, ChipWorld
from support.emulated_uploads import BAUD, flow_image_of, held_image, image_of, run, upload
from support.faulty_line import Faults

SMALL = words_to_bytes((0x03030200, 0x65880000, 0x64800000, 0x6B000000, 0xA5A80000, 0xA5000000, 0xAB500000))
# What an Uno and a Mega can hold.
MOST = {"uno": 125, "mega": 509}
KINDS = {"uno": (arduino_build.UNO, emulated_chips.UNO), "mega": (arduino_build.MEGA, emulated_chips.MEGA)}
# The limits.
MOST_FLASH_BYTES = 26 * 1024
MOST_RAM_BYTES = 1638
LONGEST_TICK_US = 5000


@pytest.fixture
def add(world, car_program):
    """Adds a car to the world."""

    def add_car(board: str = "uno", is_leader: bool = True, eeprom: bytes | None = None):
        target, kind = KINDS[board]
        program = car_program(is_leader, target)
        chip = world.add(kind, program.elf, program.symbols, eeprom)
        world.run(100)
        return chip

    return add_car


@pytest.mark.parametrize("board", KINDS)
def test_an_image_is_uploaded_verified_and_read_back_also_the_largest(world, add, car_program, board) -> None:
    car = add(board)
    for image in (SMALL, image_of(MOST[board]), image_of(MOST[board], seed=1), words_to_bytes((0,))):
        upload(world, car, image)
        assert held_image(world, car) == image
    assert car.overruns == 0
    assert car.longest_awake_us <= LONGEST_TICK_US
    if board == "uno":
        program = car_program(True)
        assert program.flash_bytes <= MOST_FLASH_BYTES
        assert program.ram_bytes + car.stack_bytes() <= MOST_RAM_BYTES


@pytest.mark.parametrize("board", KINDS)
def test_a_leader_that_decides_keeps_within_the_limits(world, add, car_program, board) -> None:
    """It executes 16 flow words in most ticks, most of which draw a number, and tells its followers words."""
    car = add(board)
    image = flow_image_of(MOST[board])
    upload(world, car, image)
    world.run(3000)
    assert held_image(world, car) == image
    assert car.longest_awake_us <= LONGEST_TICK_US
    if board == "uno":
        assert car_program(True).ram_bytes + car.stack_bytes() <= MOST_RAM_BYTES


def test_a_word_that_a_leader_can_not_execute_is_refused_with_its_place_and_a_sentence(world, add) -> None:
    car = add()
    upload(world, car, SMALL)
    words = list(bytes_to_words(flow_image_of(20)))
    words[4] = FLOW.encode(op=JUMP, target=words[0] >> 24)
    done = run(world, car, UploadTransfer(words_to_bytes(tuple(words)), BAUD))
    assert done.outcome.kind == REFUSED
    count = (words[0] >> 24) - 1
    assert f"word 4 (0x{words[4]:08X}) is not valid: target is {count + 1}; allowed: 0 to {count}" in str(
        refused_image(str(done.outcome.detail))
    )
    assert held_image(world, car) == SMALL


@pytest.mark.parametrize("board", KINDS)
def test_a_larger_image_is_refused_by_name_and_the_car_keeps_its_own(world, add, board) -> None:
    car = add(board)
    upload(world, car, SMALL)
    most = MOST[board]
    done = run(world, car, UploadTransfer(image_of(most + 1), BAUD))
    assert str(done.outcome.detail) in (f"image-too-large most={most} words={most + 1}",)
    assert done.holds == "old"
    assert held_image(world, car) == SMALL


@pytest.mark.parametrize("seed", [0, 2, 5])
def test_damage_on_the_line_leaves_the_old_image_or_the_new_one(world, add, seed) -> None:
    car = add()
    old, new = SMALL, image_of(40, seed)
    upload(world, car, old)
    done = run(world, car, UploadTransfer(new, BAUD, number=seed), Faults(*[0.001 * (seed + 1)] * 3))
    world.run(3000)
    held = held_image(world, car)
    allowed = {"old": [old], "new": [new], "either": [old, new]}[done.holds]
    assert held in allowed
    assert (done.outcome.kind == VERIFIED) == (done.holds == "new")


def test_half_uploads_and_babble_change_nothing(world, add) -> None:
    car = add()
    upload(world, car, SMALL)
    world.run(600)
    draw = random.Random(3)
    for count in (1, 3, 17, 100):
        car.send(image_of(60)[:count])
        world.run(700)
    assert car.received().count(b"ERR cut off after") == 4
    # A line that never stops, such as one with the wrong baud rate.
    for _ in range(40):
        car.send(bytes(draw.randrange(1, 256) for _ in range(500)))
        world.run(50)
    world.run(1200)
    car.received()
    assert held_image(world, car) == SMALL
    upload(world, car, image_of(30))
    assert car.overruns == 0
    assert car.longest_awake_us <= LONGEST_TICK_US


def test_a_program_that_hangs_is_restarted_by_the_watchdog(world, car_program) -> None:
    hangs = """
#include <Motorcade.h>
#include "car.h"
motorcade::AvrBoard<CAR> board(true, 1);
motorcade::Car car(board);
void setup() { board.begin(motorcade::MOST_WORDS); car.begin(); Serial.write('!'); }
void loop() {
  car.tick();
  board.rest();
  while (millis() > 2000) {
  }
}
"""
    program = car_program(True, extra={"examples/Car/Car.ino": hangs.encode()})
    car = world.add(emulated_chips.UNO, program.elf, program.symbols)
    world.run(9000)
    starts = [cycle / emulated_chips.CYCLES_A_MS for cycle, _, _ in car.log(emulated_chips.RECEIVED)]
    assert len(starts) == 4
    for earlier, later in itertools.pairwise(starts):
        assert 2400 < later - earlier < 2800


def test_an_uno_that_restarts_when_its_port_is_opened_gets_its_program(world, add, tmp_path) -> None:
    car = add()
    car.install_boot_loader(*arduino_build.compile_boot_loader(tmp_path))
    world.run(3000)
    for transfer, image in (
        (UploadTransfer(SMALL, BAUD), SMALL),
        (UploadTransfer(image_of(20), BAUD, verify=False), image_of(20)),
    ):
        car.restart()
        run(world, car, transfer)
        world.run(1000)
        car.restart()
        assert held_image(world, car) == image


CUTS = 1000
# The data sheet's time for erasing and writing one byte.
WRITE_CYCLES = int(3.4 * CYCLES_A_MS)
BOOT_MS = 15
READ_MS = 55


def cut_at(cycle: int, before: bytes, writes: list[tuple[int, int, int]], draw: random.Random) -> bytes:
    """The EEPROM when the power goes: a byte that is being written may then hold anything."""
    content = bytearray(before)
    for begin, what, new in writes:
        if begin > cycle:
            break
        at, old = what >> 8, what & 255
        is_written = begin + WRITE_CYCLES <= cycle
        content[at] = new if is_written else draw.choice((old, new, 0xFF, draw.randrange(256)))
    return bytes(content)


def held_after_boot(library, program, eeprom: bytes) -> bytes:
    """The image of a car that is switched on with this EEPROM."""
    world = ChipWorld(library)
    car = world.add(UNO, program.elf, program.symbols, eeprom)
    world.run(BOOT_MS)
    car.send(READBACK_REQUEST)
    world.run(READ_MS)
    image = car.received()
    world.close()
    return image


def test_a_cut_at_any_moment_leaves_the_old_image_or_the_new_one(world, chips_library, car_program) -> None:
    program = car_program(True)
    car = world.add(UNO, program.elf, program.symbols)
    world.run(50)
    forgotten, old, new = (image_of(125, seed) for seed in (1, 2, 3))
    # The new image goes where the one before the old one is still whole.
    for image in (forgotten, old):
        upload(world, car, image)
    before, begin, already = car.eeprom(), world.cycle, len(car.log(EEPROM))
    upload(world, car, new)
    answered = max(cycle for cycle, _, _ in car.log(RECEIVED))
    world.run(50)
    writes = car.log(EEPROM)[already:]
    assert len(writes) > 350
    draw = random.Random(14)
    # Half of the moments are near the last writes, where the new image begins to count.
    last = [draw.randrange(writes[-8][0], world.cycle) for _ in range(CUTS // 2)]
    moments = sorted([*last, *(draw.randrange(begin, world.cycle) for _ in range(CUTS - len(last)))])
    held: dict[bytes, bytes] = {}
    found = []
    for moment in moments:
        content = cut_at(moment, before, writes, draw)
        if content not in held:
            held[content] = held_after_boot(chips_library, program, content)
        found.append(held[content])
        assert held[content] in (old, new)
        if moment > answered:
            assert held[content] == new
    assert {old, new} == set(found)
    assert len(held) > CUTS // 4
