"""Measure the CPU time of short commands, most of which is their start. Run ``python benchmarks/start.py``.

CPU time is the user and system time of the child process as the system counts it. Commands take turns, so that a
machine that is slow for a while is slow for all of them. A Python that does nothing is measured too: no command can be
faster. Windows doesn't count a child's time, so this runs on Linux and macOS only.
"""

import resource
import shutil
import subprocess
import sys
from pathlib import Path
from statistics import median

from rich.console import Console
from rich.table import Table

RUNS = 11
GOALS_MS = {"motorcade --version": 200}
PARADE = str(Path(__file__).parent.parent / "examples" / "parade.motorcade.json")


def contestants() -> dict[str, list[str]]:
    motorcade = shutil.which("motorcade", path=str(Path(sys.executable).parent))
    if motorcade is None:
        sys.exit("motorcade is not installed beside this Python: make setup")
    return {
        "python, nothing": [sys.executable, "-c", "pass"],
        "motorcade --version": [motorcade, "--version"],
        "motorcade --help": [motorcade, "--help"],
        "motorcade decode": [motorcade, "decode", "control", "-5"],
        "motorcade compile": [motorcade, "compile", PARADE],
        "motorcade simulate, 1 s": [motorcade, "simulate", PARADE, "--seconds", "1"],
    }


def children_ms() -> float:
    """Return the user and system time of all child processes that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (usage.ru_utime + usage.ru_stime) * 1000


def cpu_ms(command: list[str]) -> float:
    before_ms = children_ms()
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
    return children_ms() - before_ms


def result(median_ms: float, goal_ms: float | None) -> tuple[str, str]:
    if goal_ms is None:
        return "", ""
    return f"median ≤ {goal_ms}", "[green]met[/]" if median_ms <= goal_ms else "[red]missed[/]"


def main() -> None:
    commands = contestants()
    times_ms: dict[str, list[float]] = {name: [] for name in commands}
    for _ in range(RUNS):
        for name, command in commands.items():
            times_ms[name].append(cpu_ms(command))
    table = Table("command", "fastest", "median", "slowest", "goal", "", title=f"CPU time of {RUNS} starts, ms")
    for name, each in times_ms.items():
        figures = [f"{figure:.0f}" for figure in (min(each), median(each), max(each))]
        table.add_row(name, *figures, *result(median(each), GOALS_MS.get(name)))
    Console().print(table)


if __name__ == "__main__":
    main()
