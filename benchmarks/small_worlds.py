"""The worlds that people use, which are small and mostly quiet: the page's first one, missions, cars that stand.

`benchmarks/swarm.py` shows them beside crowds, so that tuning for crowds alone shows. Run alone, this prints what a
simulated second of each takes of a processor; other programs disturb that little.
"""

import time

from rich.console import Console
from rich.table import Table
from timing import Contestant

from motorcade.engine.world import World
from motorcade.mats import Mat, formation, open_table
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
MANY = 10_000


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
        "wander": Program([wander(3)], Followers([wander(3)])),
    }
    for what, program in programs.items():
        made[f"{CARS} cars, {what}"] = _contestant(open_table(formation(CARS - 1)), program)
    made["1 car, wanders"] = _contestant(open_table(formation(0)), programs["wander"])
    for what in ("nobody is told anything", "wander"):
        made[f"{MANY:,} cars, {what}"] = _contestant(open_table(formation(MANY - 1)), programs[what], 1, 1)
    return made


def _contestant(mat: Mat, program: Program, worlds: int = WORLDS, seconds: int = SECONDS) -> Contestant:
    world = World(mat, [compile_program(program).image], seeds=range(worlds), threads=1)
    return Contestant(worlds * seconds, lambda: world.run(seconds * 1000), world.reset)


def main() -> None:
    table = Table("", "µs of a processor for a simulated second", title="Small worlds, one thread")
    for name, world in small_worlds().items():
        took_s = []
        for _ in range(TURNS):
            world.prepare()
            began_s = time.process_time()
            world.run()
            took_s.append(time.process_time() - began_s)
        table.add_row(name, f"{min(took_s) / world.work * 1e6:,.1f}")
    Console().print(table)


if __name__ == "__main__":
    main()
