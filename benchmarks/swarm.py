"""Crowds of cars: how many car-steps a second, and how that compares. Run it with ``python benchmarks/swarm.py``.

A car-step is one car and one tick of 20 ms. Every repetition resets a crowd, runs it for five seconds so that words
have spread, and times the next four seconds in one call; small crowds run many times in a row. The mat holds everything
that a mat can hold, and all physics is on except wheel noise (`crowd_scenario`). Contestants take turns. The figures
are medians of the repetitions during which other processes left the machine idle. Small and quiet worlds, of one
thread, are timed beside them.

``--kilombo FOLDER`` has Kilombo's sources: ``git clone https://github.com/JIC-CSB/kilombo`` (MIT), and libjansson-dev.
"""

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import mean

import numpy as np
from crowd_scenario import TICK_MS, crowd_mat, neighbours, programs
from peers import ir_sim, kilombo, memory_roof, plain_loop, vmas
from rich.console import Console
from rich.table import Table
from road_scenario import road_mat, road_programs
from small_worlds import small_worlds
from timing import Contestant, has_peer, take_turns

from motorcade.config.profile import built_in_profile
from motorcade.engine.layout import rules_of
from motorcade.engine.world import World

WARM_MS = 5_000
TIMED_MS = 4_000
FEWEST_STEPS = 12_000_000  # in a repetition, so that it is long enough to time
SHOWN_WORLDS = 200
TURNS, QUICK_TURNS = 5, 3
ONE_WORLD_GOALS = {1_000_000: (2, 40, 20), 100_000: (2, 40, 20), 1_000: (1, 15, 8), 100: (1, 12, 6)}
SCALING_GOAL = 1.3
BYTES_GOAL = 144
ROADS, ROADS_GOAL = "10,000 cars on rings of road, 1 thread", 12
TAGGED = "10,000 cars, tagged words, 1 thread"
START_GOAL_S, START_FLOOR_S = 1.0, 3.0
KILOMBO = "Kilombo, 100 robots that drive, without obstacles"
KILOMBO_FIGURE = "1,000 robots 100 × faster than real time, its authors say (arXiv:1511.04285): 2.4 M/s"
START = """
import sys
from motorcade.mats import formation, open_table
from motorcade.engine.world import World
World(open_table(formation(5)), [bytes.fromhex(sys.argv[1])]).step()
"""


class Crowd:
    """``worlds`` worlds of ``cars`` cars each, stepped by ``threads`` threads, in a hall or on rings of road."""

    def __init__(self, cars: int, threads: int, worlds: int = 1, on: str = "bare") -> None:
        mat, images = crowd_mat(cars), programs(on == "tagged")
        if on == "roads":
            mat, images = road_mat(cars), road_programs()
        copies = max(FEWEST_STEPS * TICK_MS // (cars * worlds * TIMED_MS), 1)
        seeds = np.arange(copies * worlds).reshape(copies, worlds)
        self.worlds = [World(mat, images, seeds=each.tolist(), threads=threads) for each in seeds]
        self.cars = cars * worlds * copies
        self.contestant = Contestant(self.cars * TIMED_MS / TICK_MS, self._run, self._prepare)

    def _prepare(self) -> None:
        for world in self.worlds:
            world.reset()
            world.run(WARM_MS)
        self._before = self._counts()

    def _run(self) -> None:
        for world in self.worlds:
            world.run(TIMED_MS)

    def _counts(self) -> dict[str, float]:
        counts = [world.counts() for world in self.worlds]
        return {name: float(sum(each[name].sum() for each in counts)) for name in counts[0]}

    def activity(self) -> str:
        """What the cars did during the last repetition."""
        shown = [(world, k) for world in self.worlds for k in range(world.worlds)][:SHOWN_WORLDS]
        snapshots = [world.snapshot(k) for world, k in shown]
        near = mean(neighbours(each.x_m, each.y_m) for each in snapshots)
        moving = mean(float((each.wheels & 3 > 0).mean()) for each in snapshots)
        a_car_second = {
            name: (count - self._before[name]) / self.cars / TIMED_MS * 1000 for name, count in self._counts().items()
        }
        frames, heard, touching = (a_car_second[name] for name in ("frames", "heard", "touching_ms"))
        return f"{near:.1f} · {moving:.0%} · {frames:.1f} · {heard:.1f} · {touching / 1000:.0%}"


def fresh_start() -> Contestant:
    command = [sys.executable, "-c", START, programs()[0].hex()]
    return Contestant(1, lambda: subprocess.run(command, check=True))


def result(figure: float, goal: float, floor: float | None = None, *, least: bool = True) -> str:
    """Say whether a figure is at least its goal, or at most its goal where ``least`` is False."""
    sign = 1 if least else -1
    if sign * figure >= sign * goal:
        return "[green]met[/]"
    if floor is not None and sign * figure >= sign * floor:
        return "[yellow]above floor[/]" if least else "[yellow]within floor[/]"
    return "[red]missed[/]"


def rates(contestant: Contestant, digits: int = 1) -> str:
    low, high = (each / 1e6 for each in contestant.rates)
    return f"{contestant.rate / 1e6:.{digits}f} ({low:.{digits}f}–{high:.{digits}f}) M/s"


def plural(count: int, noun: str) -> str:
    return f"{count:,} {noun}" + ("s" if count > 1 else "")


class Report:
    """The table, row by row."""

    def __init__(self, turns: int) -> None:
        title = f"Crowds of cars: medians (least–most) of {turns} quiet repetitions, or of all where too few were quiet"
        self.table = Table("", "figure", "goal", "floor", "result", "quiet", "the cars*", title=title)
        self.table.caption = (
            "* cars within 1 m of a car, share of cars that drive; frames begun and frames heard by a car in a second; "
            "share of time in touch with something"
        )

    def crowd(self, name: str, crowd: Crowd, goal: float, floor: float) -> None:
        it = crowd.contestant
        marks = (f"≥ {goal:g} M/s", f"{floor:g} M/s", result(it.rate / 1e6, goal, floor))
        self.table.add_row(name, rates(it), *marks, it.repetitions, crowd.activity())

    def figure(self, name: str, figure: str, goal: str = "", floor: str = "", met: str = "", quiet: str = "") -> None:
        self.table.add_row(name, figure, goal, floor, met, quiet)

    def peer(self, name: str, peer: Contestant, ours: Contestant) -> None:
        ratio = ours.rate / peer.rate
        self.table.add_row(name, rates(peer, 4), "", "", f"Motorcade: {ratio:,.0f} ×", peer.repetitions)


def one_world(cars: int, threads: int) -> str:
    return f"{cars:,} cars, {plural(threads, 'thread')}"


def crowds(quick: bool) -> dict[str, Crowd]:
    sizes = [(cars, threads) for cars, (threads, _, _) in ONE_WORLD_GOALS.items()]
    sizes += [(10_000, 1), (10_000, 2)]
    found = {one_world(*size): Crowd(*size) for size in sizes if not quick or size[0] < 1_000_000}
    return {**found, TAGGED: Crowd(10_000, 1, on="tagged"), ROADS: Crowd(10_000, 1, on="roads")}


def bytes_a_step(crowd: Crowd) -> float:
    """Estimate how many bytes a car-step moves between processor and memory.

    In a tick nearly every cache line of all arrays holds a car whose turn it is, and the place of every car is written;
    sorting gathers all rows and puts them back.
    """
    world = crowd.worlds[0]
    rules = rules_of(world.mat, built_in_profile("classroom"), world.images)
    return (world.nbytes + 4 * world.state.rows.nbytes / rules.sort_every) / world.cars + 8


def add_crowds(report: Report, one: dict[str, Crowd], many_name: str, many: Crowd) -> None:
    for cars, (threads, goal, floor) in ONE_WORLD_GOALS.items():
        name = one_world(cars, threads)
        if cars == 1_000:
            best, other = sorted(
                (one_world(10_000, each) for each in (1, 2)), key=lambda each: -one[each].contestant.rate
            )
            report.crowd(best, one[best], 25, 12)
            report.figure(other, rates(one[other].contestant), quiet=one[other].contestant.repetitions)
        if name in one:
            report.crowd(name, one[name], goal, floor)
    report.crowd(many_name, many, 45, 25)
    report.figure(TAGGED, rates(one[TAGGED].contestant), quiet=one[TAGGED].contestant.repetitions)
    report.crowd(ROADS, one[ROADS], ROADS_GOAL, ROADS_GOAL)
    report.table.add_section()


def add_scaling(report: Report, one: dict[str, Crowd], start: Contestant) -> None:
    large, small = next(iter(one.values())), one[one_world(10_000, 2)]
    ratio = small.contestant.rate / large.contestant.rate
    name = f"a car-step's cost, 10,000 → {large.cars:,}, 2 threads"
    met = result(ratio, SCALING_GOAL, least=False)
    report.figure(name, f"{ratio:.2f} ×", f"≤ {SCALING_GOAL} ×", "", met)
    each = large.worlds[0].nbytes / large.cars
    met = result(each, BYTES_GOAL, least=False)
    report.figure(f"memory a car, of {large.cars:,}", f"{each:.1f} bytes", f"≤ {BYTES_GOAL} bytes", "", met)
    start_s, least_s, most_s = 1 / start.rate, min(start.counted), max(start.counted)
    report.figure(
        "start to first step, compiled before",
        f"{start_s:.2f} ({least_s:.2f}–{most_s:.2f}) s",
        f"≤ {START_GOAL_S:g} s",
        f"{START_FLOOR_S:g} s",
        result(start_s, START_GOAL_S, START_FLOOR_S, least=False),
        start.repetitions,
    )
    report.table.add_section()


def add_roof(report: Report, large: Crowd, roof: Contestant) -> None:
    low, high = (each / 1e9 for each in roof.rates)
    name = "memory roof: triad, 2 threads"
    report.figure(name, f"{roof.rate / 1e9:.1f} ({low:.1f}–{high:.1f}) GB/s", quiet=roof.repetitions)
    each = bytes_a_step(large)
    share = each * large.contestant.rate / roof.rate
    report.figure(
        f"{large.cars:,} cars, about {each:.0f} bytes a step",
        f"{each * large.contestant.rate / 1e9:.1f} GB/s, {share:.0%} of the roof",
    )
    report.table.add_section()


def add_small_worlds(report: Report, small: dict[str, Contestant]) -> None:
    for name, it in small.items():
        figure = f"{1e6 / it.rate:,.2f} ({1e6 / it.rates[1]:,.2f}–{1e6 / it.rates[0]:,.2f}) µs a simulated second"
        report.figure(name, figure, quiet=it.repetitions)
    report.table.add_section()


def add_peers(report: Report, peers: dict[str, tuple[Contestant | None, Contestant]]) -> None:
    for name, (peer, ours) in peers.items():
        if peer:
            report.peer(name, peer, ours)
        else:
            report.figure(name, KILOMBO_FIGURE if name == KILOMBO else "[dim]not installed[/]")


def peers_of(
    one: dict[str, Crowd], many: Crowd, has_ir_sim: bool, has_vmas: bool, kilobots: Contestant | None
) -> dict[str, tuple[Contestant | None, Contestant]]:
    """Other simulators, each with the crowd that it is compared to; None in place of one that isn't installed."""
    hundred, thousand = one[one_world(100, 1)].contestant, one[one_world(1_000, 1)].contestant
    worlds = many.worlds[0].worlds

    def robots(cars: int, collisions: str, ticks: int) -> Contestant | None:
        return ir_sim(cars, collisions, ticks) if has_ir_sim else None

    return {
        "IR-SIM, 100 robots, collisions found": (robots(100, "unobstructed", 200), hundred),
        "IR-SIM, 100 robots, bodies push": (robots(100, "contact", 100), hundred),
        "IR-SIM, 1,000 robots, collisions found": (robots(1_000, "unobstructed", 10), thousand),
        "IR-SIM, 1,000 robots, bodies push": (robots(1_000, "contact", 8), thousand),
        f"VMAS, {worlds:,} worlds × 16 robots, 2 threads": (
            vmas(16, worlds, 4) if has_vmas else None,
            many.contestant,
        ),
        KILOMBO: (kilobots, hundred),
        "the plain loop (CPython), 100 cars": (plain_loop(100, 25), hundred),
    }


def contestants_of(
    one: dict[str, Crowd], peers: dict[str, tuple[Contestant | None, Contestant]]
) -> Iterator[tuple[str, Contestant]]:
    yield from ((name, crowd.contestant) for name, crowd in one.items())
    yield from ((name, peer) for name, (peer, _) in peers.items() if peer)


def measure(
    quick: bool, has_ir_sim: bool, has_vmas: bool, kilobots: Contestant | None, report_progress: Callable[[str], None]
) -> Table:
    turns, worlds = (QUICK_TURNS, 2_048) if quick else (TURNS, 32_768)
    many_name = f"{worlds:,} worlds × 16 cars, 2 threads"
    one, many = crowds(quick), Crowd(16, 2, worlds)
    peers, start, roof = peers_of(one, many, has_ir_sim, has_vmas, kilobots), fresh_start(), memory_roof()
    small = small_worlds()
    start.run()
    contestants = dict(contestants_of({**one, many_name: many}, peers))
    take_turns({**contestants, **small, "first step": start, "triad": roof}, turns, report_progress)
    report = Report(turns)
    add_crowds(report, one, many_name, many)
    add_scaling(report, one, start)
    add_roof(report, next(iter(one.values())), roof)
    add_small_worlds(report, small)
    add_peers(report, peers)
    return report.table


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure crowds of cars.")
    parser.add_argument("--quick", action="store_true", help="fewer repetitions, 100,000 cars at most")
    parser.add_argument("--kilombo", type=Path, metavar="FOLDER", help="Kilombo's sources")
    given = parser.parse_args()
    console = Console(width=160)
    has_ir_sim, has_vmas = has_peer(console, "IR-SIM", "irsim"), has_peer(console, "VMAS", "torch", "vmas")
    if given.kilombo is None:
        console.print("Kilombo is not compared: --kilombo names no sources", style="red")
    with tempfile.TemporaryDirectory() as folder, console.status("making the crowds") as status:
        kilobots = kilombo(100, given.kilombo.resolve(), Path(folder)) if given.kilombo else None
        table = measure(given.quick, has_ir_sim, has_vmas, kilobots, status.update)
    console.print(table)


if __name__ == "__main__":
    main()
