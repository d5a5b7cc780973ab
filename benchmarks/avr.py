"""Measure the brain in C on an emulated ATmega328P. Run ``python benchmarks/avr.py``.

It needs Debian's gcc-avr, avr-libc and simavr. The table has the figures of the brain and the receiver of uploads
alone, with the image in RAM and a board that does nothing; cycles are the chip's own, counted by its timer 1. The
figures of the whole car follow (`avr_car.py`).
"""

import re
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from avr_car import car_lines
from rich.console import Console
from rich.table import Table
from scripts.exports.brain_c import brain_c

from motorcade.car import brain, decisions
from motorcade.words import receiver
from support.arduino_build import CORE

HERE = Path(__file__).parent
MEGAHERTZ = 16
OPTIONS = ("-std=c99", "-Os", "-mmcu=atmega328p", "-DF_CPU=16000000UL", "-Wall", "-Wextra", "-Werror")
NAMES = {
    "follower-bare": "follower, bare words",
    "follower-tagged": "follower, tagged words",
    "leader-bare": "leader, bare words",
    "leader-tagged": "leader, tagged words",
    "leader-decides": "leader, 16 flow words in each tick, and frames",
    "receiver": "receiver, 8 words",
}


class Ticks(NamedTuple):
    """The cycles of one kind of tick."""

    name: str
    mean: int
    worst: int


def missing() -> list[str]:
    """Return the programs that are not installed."""
    return [program for program in ("avr-gcc", "simavr") if shutil.which(program) is None]


def sizes(folder: Path) -> dict[str, int]:
    """Return the bytes of flash of the brain, of its static RAM, and of the memories that a board gives to it."""
    _compile(folder, "brain.o", "-c", "motorcade_brain.c")
    printed = subprocess.check_output(["avr-size", "brain.o"], cwd=folder, encoding="utf-8")
    text, data, bss = (int(each) for each in printed.splitlines()[1].split()[:3])
    return {
        "flash": text + data,
        "RAM": data + bss,
        "RAM of its memories": 4 * (brain.SIZE + receiver.SIZE) + decisions.SIZE,
    }


def measured(folder: Path) -> list[Ticks]:
    """Return the cycles of each kind of tick, from a run in simavr."""
    _compile(folder, "ticks.elf", "avr_ticks.c", "motorcade_brain.c")
    command = ["simavr", "-m", "atmega328p", "-f", str(MEGAHERTZ * 1_000_000), "ticks.elf"]
    run = subprocess.run(command, cwd=folder, capture_output=True, encoding="utf-8", check=True, timeout=300)
    # simavr prints in colour.
    found = re.findall(r"([a-z-]+) (\d+) (\d+)", re.sub(r"\x1b\[\d*m", "", run.stdout + run.stderr))
    return [Ticks(NAMES[name], int(mean), int(worst)) for name, mean, worst in found if name in NAMES]


def _compile(folder: Path, output: str, *arguments: str) -> None:
    subprocess.run(["avr-gcc", *OPTIONS, *arguments, "-o", output], cwd=folder, check=True, timeout=300)


def brain_table() -> Table:
    """Return the figures of the brain as a table."""
    table = Table("a tick on an ATmega328P", "mean cycles", "worst")
    with TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copy(HERE / "avr_ticks.c", folder)
        for file, text in brain_c().items():
            (folder / file).write_text(text, encoding="utf-8")
        for kind, count in sizes(folder).items():
            table.add_row(kind, f"{count:,} bytes", "")
        for ticks in measured(folder):
            table.add_row(ticks.name, _told(ticks.mean), _told(ticks.worst))
    return table


def _told(cycles: int) -> str:
    return f"{cycles:,} · {cycles / MEGAHERTZ / 1000:.2f} ms"


def main() -> int:
    """Print the figures; return the exit code, 0 also where the tools are missing."""
    if programs := missing():
        print(f"skipped: no {', no '.join(programs)} (on Debian: apt-get install gcc-avr avr-libc simavr)")
        return 0
    Console().print(brain_table())
    if CORE.is_dir():
        Console().print("\n".join(car_lines()))
    else:
        print("The whole car is skipped: no Arduino core (on Debian: apt-get install arduino-core-avr libsimavr-dev)")
    return 0


if __name__ == "__main__":
    sys.exit(main())
