"""The power of an emulated Uno is cut at 1,000 random moments of an upload: the old image or the new one is whole."""

import random

from motorcade.words.upload import READBACK_REQUEST
from support.emulated_chips import CYCLES_A_MS, EEPROM, RECEIVED, UNO, World
from support.emulated_uploads import image_of, upload

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
    world = World(library)
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
