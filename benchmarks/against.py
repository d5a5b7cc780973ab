"""Compare crowds of this checkout with those of another, in turns: ``python benchmarks/against.py FOLDER``.

FOLDER is a checkout of another commit (``git worktree add --detach FOLDER COMMIT``). Both run in processes of their
own, by the Python that runs this, and take turns; a figure is the median of the pairs' ratios. Other programs disturb
the processors' time little. They disturb the clock's, and the more where threads wait for each other.
"""

import argparse
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from statistics import median

from rich.console import Console
from rich.table import Table

HERE = Path(__file__).resolve().parent
# For each: cars of a world, worlds, threads, seconds of its time in a turn, the goal.
CROWDS = {
    "10,000 cars, 1 thread": (10_000, 1, 1, 4.0, 1.5),
    "2,048 worlds of 16 cars, 1 thread": (16, 2_048, 1, 1.0, 2.0),
    "100,000 cars, 2 threads": (100_000, 1, 2, 1.0, 1.5),
    "1,000,000 cars, 2 threads": (1_000_000, 1, 2, 0.2, 1.5),
    "32,768 worlds of 16 cars, 2 threads": (16, 32_768, 2, 0.4, 2.0),
}
WARM_MS = 5_000
# Runs in a process of either checkout, and knows only what both have.
CROWD = """
import sys, time
from crowd_scenario import crowd_mat, programs
from motorcade.engine.world import World
cars, worlds, threads, is_tagged, ms, warm_ms = map(int, sys.argv[1:])
seeds = list(range(worlds)) if worlds > 1 else 0
given = crowd_mat(cars), programs(bool(is_tagged))
try:
    world = World(*given, seeds=seeds, threads=threads, kernels="native")
except TypeError:
    # An older commit would begin in WebAssembly and compile meanwhile.
    world = World(*given, seeds=seeds, threads=threads, target="native")
for _ in sys.stdin:
    world.reset()
    world.run(warm_ms)
    began_s, used_s = time.perf_counter(), time.process_time()
    world.run(ms)
    print(time.perf_counter() - began_s, time.process_time() - used_s, flush=True)
"""


class Side:
    """A process that runs a crowd with the sources of one checkout."""

    def __init__(self, folder: Path, arguments: list[str]) -> None:
        # The scenario is this checkout's: an older one may not know tagged words.
        paths = os.pathsep.join((str(folder / "src"), str(HERE)))
        command = [sys.executable, "-c", CROWD, *arguments]
        self._process = subprocess.Popen(
            command, env={**os.environ, "PYTHONPATH": paths}, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def turn(self) -> tuple[float, float]:
        """Run the crowd once; return the seconds of a clock and of processors."""
        assert self._process.stdin
        assert self._process.stdout
        self._process.stdin.write("\n")
        self._process.stdin.flush()
        clock_s, used_s = map(float, self._process.stdout.readline().split())
        return clock_s, used_s

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin
        self._process.stdin.close()
        self._process.wait()


def rows(other: Path, turns: int, wanted: str) -> Iterator[tuple[str, ...]]:
    for name, (cars, worlds, threads, timed_s, goal) in CROWDS.items():
        for words, is_tagged in (("tagged", 1), ("bare", 0)):
            if wanted not in f"{name}, {words}":
                continue
            numbers = (cars, worlds, threads, is_tagged, round(timed_s * 1000), WARM_MS)
            sides = [Side(folder, [str(each) for each in numbers]) for folder in (HERE.parent, other)]
            pairs = [[side.turn() for side in sides] for _ in range(turns)]
            for side in sides:
                side.close()
            rate = cars * worlds * timed_s * 50 / median(ours[0] for ours, _ in pairs) / 1e6
            ratios = [[theirs[k] / ours[k] for ours, theirs in pairs] for k in range(2)]
            spreads = [f"{median(each):.2f} ({min(each):.2f}–{max(each):.2f}) ×" for each in ratios]
            yield f"{name}, {words} words", f"{rate:.1f} M/s", *spreads, f"≥ {goal} ×"


def main() -> None:
    parser = argparse.ArgumentParser(description="Compare crowds with those of another checkout.")
    parser.add_argument("folder", type=Path, help="the other checkout")
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("--only", default="", help="a part of the name of the crowds that are wanted")
    arguments = parser.parse_args()
    if not (arguments.folder / "src" / "motorcade" / "engine").is_dir():
        # Python would take the installed package, which is this checkout.
        parser.error(f"{arguments.folder} is no checkout of Motorcade")
    table = Table("", "this checkout", "against the other: clock", "processors' time", "goal")
    for row in rows(arguments.folder.resolve(), arguments.turns, arguments.only):
        table.add_row(*row)
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
