"""The worlds that people use, which are small and mostly quiet: the page's first one, missions, cars that stand.

`benchmarks/swarm.py` shows them beside crowds, so that tuning for crowds alone shows. Run alone, this prints what a
simulated second of each takes of a processor; other programs disturb that little. What nothing happens to is to cost
nothing: a world whose cars have neither a program nor a word, at most QUIET of one of as many cars that all wander.
"""

import time
from dataclasses import replace

from rich.console import Console
from rich.table import Table
from timing import Contestant

from motorcade.engine.world import World
from motorcade.mats import Mat, Starts, formation, open_table
from motorcade.mats.document import mat_of
from motorcade.missions.document import built_in_mission
from motorcade.program.compiler import compile_program
from motorcade.program.model import Followers, Program
from motorcade.program.steps import led, wait, wander
from motorcade.service.documents import opening, whole_program

WORLDS, SECONDS = 100, 60
MISSIONS = ("forward-and-stop", "pass-it-on", "a-hundred-cars")
TURNS = 5
CARS = 12
# Of worlds in which nothing happens, and of as many cars that wander: worlds, seconds, and seconds before them. In the
# first tick of the large world cars are switched on and look around.
SIZES = {1: (100, 60, 0), CARS: (100, 60, 0), 10_000: (1, 1, 1)}
QUIET = 1 / 20


def small_worlds() -> dict[str, Contestant]:
    """Name each kind of world, and time it; its work are simulated seconds of a world."""
    project = opening()
    assert project.mat
    made = {"the page's first world": _contestant(mat_of(project.mat, "town"), whole_program(project))}
    for name in MISSIONS:
        mission = built_in_mission(name)
        assert mission.solution
        made[f"mission {name}"] = _contestant(mission.mat, mission.solution)
    programs = {
        "nobody is told anything": Program([wait(3)]),
        "stand with words": Program([wait(3)], Followers([led(1, 2), led(2, 2)])),
        "those in reach wander": Program([wander(3)], Followers([wander(3)])),
    }
    for what, program in programs.items():
        made[f"{CARS} cars, {what}"] = _contestant(open_table(formation(CARS - 1)), program)
    for cars, how_long in SIZES.items():
        made[quiet(cars)] = _contestant(_leaders(cars), Program([]), *how_long)
        made[wandering(cars)] = _contestant(_leaders(cars), Program([wander(3)]), *how_long)
    return made


def quiet(cars: int) -> str:
    """The name of a world in which nothing happens."""
    return f"cars without a program: {cars:,}"


def wandering(cars: int) -> str:
    """The name of a world in which all cars wander."""
    return f"cars that all wander: {cars:,}"


def _leaders(cars: int) -> Mat:
    """A plane with nothing but cars that all lead."""
    poses = formation(cars - 1)
    return replace(open_table(poses), starts=Starts.of(poses, [True] * cars))


def _contestant(
    mat: Mat, program: Program, worlds: int = WORLDS, seconds: int = SECONDS, warm_s: int = 0
) -> Contestant:
    world = World(mat, [compile_program(program).image], seeds=range(worlds), threads=1)

    def prepare() -> None:
        world.reset()
        world.run(warm_s * 1000)

    return Contestant(worlds * seconds, lambda: world.run(seconds * 1000), prepare)


def main() -> None:
    table = Table("", "µs of a processor for a simulated second", title="Small worlds, one thread")
    took_us = {}
    for name, world in small_worlds().items():
        took_s = []
        for _ in range(TURNS):
            world.prepare()
            began_s = time.process_time()
            world.run()
            took_s.append(time.process_time() - began_s)
        took_us[name] = min(took_s) / world.work * 1e6
        table.add_row(name, f"{took_us[name]:,.2f}")
    for cars in SIZES:
        times = took_us[wandering(cars)] / took_us[quiet(cars)]
        table.add_row(f"{cars:,} cars: wandering against quiet", f"{times:,.0f} ×, ≥ {1 / QUIET:.0f} wanted")
    Console().print(table)


if __name__ == "__main__":
    main()
