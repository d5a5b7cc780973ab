"""Measure a whole car on emulated Arduino boards: flash, RAM, longest tick, duty, and the time that an upload takes."""

import subprocess
import sys
import tempfile
from pathlib import Path

# For avr.py too, which imports this module first.
sys.path.append(str(Path(__file__).resolve().parents[1]))
sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))
from motorcade.firmware.arduino_library import library_files
from support import arduino_build, emulated_chips
from support.emulated_uploads import image_of, upload

CHIPS = Path(__file__).resolve().parents[1] / "tests" / "arduino" / "chips.c"
BOARDS = {
    "Uno": (arduino_build.UNO, emulated_chips.UNO, 125),
    "Mega": (arduino_build.MEGA, emulated_chips.MEGA, 509),
}
# The uploader is silent for so long before it begins.
SETTLE_MS = 600
DRIVE_MS = 10_000


def car_lines() -> list[str]:
    """Return a line for each figure of each board."""
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "chips.so"
        subprocess.run(["gcc", "-O2", "-shared", "-fPIC", "-o", library, CHIPS, "-lsimavr"], check=True)
        return [line for board in BOARDS for line in _board_lines(board, library)]


def _board_lines(board: str, library: Path) -> list[str]:
    target, kind, most_words = BOARDS[board]
    program = arduino_build.compile_sketch(library_files(), f"examples/{board}", target)
    world = emulated_chips.ChipWorld(library)
    car = world.add(kind, program.elf, program.symbols)
    world.run(100)
    # Both places are filled, so that the third image erases and writes.
    took_ms = [upload(world, car, image_of(most_words, seed)) - SETTLE_MS for seed in (1, 2, 3)]
    storing_us = car.longest_awake_us
    car.forget_longest()
    awake_ms = car.awake_ms
    world.run(DRIVE_MS)
    share = (car.awake_ms - awake_ms) / DRIVE_MS
    ram = program.ram_bytes + car.stack_bytes()
    lines = [
        f"{board}: flash {program.flash_bytes} bytes, RAM {ram} bytes, of which stack {car.stack_bytes()}",
        f"{board}: longest tick {car.longest_awake_us / 1000:.2f} ms; {storing_us / 1000:.2f} ms during an upload",
        f"{board}: leader with {most_words} words awake for {share:.0%} of the time",
        f"{board}: an image of {most_words} words is stored in {took_ms[0]} ms, over another one in {took_ms[2]} ms",
        f"{board}: bytes lost at the UART: {car.overruns}",
    ]
    world.close()
    return lines


if __name__ == "__main__":
    print("\n".join(car_lines()))
