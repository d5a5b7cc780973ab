"""Compare searches for programs with each other, and with a program written by hand, on a mission of the literature.

    python benchmarks/search.py                                  # cfa, at 1,000, 10,000 and 50,000 runs: 45 minutes
    python benchmarks/search.py --mission stop --runs 1000 --methods racing

Each line is the best program that a method has found after so many runs. Its score, as published, is the mean of the
mission's seeds. 'Elsewhere' it starts from other places with ten other seeds, twice the noise of the wheels, and one
damaged bit in a thousand. Wall clock and CPU seconds are those of all runs so far, with as many processes as cores.
"""

import argparse
import os
import tempfile
import time
from pathlib import Path
from typing import Any, get_args

from motorcade.lab.run import on_this_computer
from motorcade.lab.search import Method, Search, do_task, opened_archive
from motorcade.missions.check import check_program
from motorcade.missions.document import built_in_mission, mission_of
from motorcade.missions.model import Mission
from motorcade.program.model import Program, count_blocks

ELSEWHERE = {"wheel_noise": 0.1, "bit_error_rate": 0.001}
SEEDS = list(range(1000, 1010))


def elsewhere(mission: Mission) -> Mission:
    """The mission with other noise, seeds and starts."""
    mat: dict[str, Any] = mission.document["mat"]
    crowds = [{**crowd, "seed": 7} for crowd in mat["crowd"]]
    changed = {**mat, "crowd": crowds, "physics": {**mat["physics"], **ELSEWHERE}}
    return mission_of({**mission.document, "mat": changed, "seeds": SEEDS}, mission.id)


def score(mission: Mission, program: Program) -> float:
    """The mean score; the grade of the last goal is the score's share of what that goal asks for."""
    result = check_program(mission, program).goals[-1]
    return float(result.grade * mission.goals[-1].values["least"])


def line(*cells: object) -> None:
    """Print a line of the table."""
    widths = (10, 7, 7, 8, 9, 6, 7, 7, 12)
    print(*(f"{each:>{width}}" for each, width in zip(cells, widths, strict=True)), flush=True)


def cpu_s() -> float:
    """CPU seconds of this process and of those that it has waited for."""
    return sum(os.times()[:4])


def compare(mission: Mission, methods: list[Method], budgets: list[int]) -> None:
    """Print the table."""
    other, by_hand = elsewhere(mission), mission.solution
    assert by_hand is not None
    line("method", "runs", "grade", "score", "elsewhere", "blocks", "wall s", "CPU s", "CPU ms a run")
    grade = check_program(mission, by_hand).grade
    scores = f"{score(mission, by_hand):.5g}", f"{score(other, by_hand):.5g}"
    line("by hand", "", f"{grade:.4f}", *scores, count_blocks(by_hand), "", "", "")
    for method in methods:
        wall = used = 0.0
        with tempfile.TemporaryDirectory() as folder:
            for budget in budgets:
                begun, cpu = time.perf_counter(), cpu_s()
                search = Search(mission, method, budget)
                with opened_archive(Path(folder), search.contents) as archive:
                    search.run(archive, on_this_computer(0, do_task))
                wall, used = wall + time.perf_counter() - begun, used + cpu_s() - cpu
                times = f"{wall:.0f}", f"{used:.0f}", f"{used / search.done * 1000:.1f}"
                ranked = search.best.ranked()
                if not ranked:
                    line(method, search.done, "none yet", "", "", "", *times)
                    continue
                best = ranked[0]
                scores = f"{score(mission, best.program):.5g}", f"{score(other, best.program):.5g}"
                line(method, search.done, f"{best.mean.grade:.4f}", *scores, best.blocks, *times)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Compare searches for programs.")
    parser.add_argument("--mission", default="cfa", choices=["aac", "cfa", "lcn", "stop"])
    parser.add_argument("--runs", type=int, nargs="+", default=[1_000, 10_000, 50_000])
    parser.add_argument("--methods", nargs="+", default=list(get_args(Method)), choices=get_args(Method))
    given = parser.parse_args()
    wanted = built_in_mission(given.mission)
    print(f"{wanted.name}, {len(wanted.mat.starts)} cars, {wanted.document['seconds']} s; {os.cpu_count()} cores")
    compare(wanted, given.methods, sorted(given.runs))
