"""Environments for learning: how many steps of an agent in a second, and how that compares with VMAS.

``python benchmarks/environments.py [--peers FOLDER]``. VMAS is not in the lock file, since PyTorch is many times larger
than all the rest; this puts both into a folder: ``pip install --target build/peers vmas``, with an index or a wheel of
PyTorch for processors alone if there is one.

Both drive the same number of agents in the same number of worlds by random actions, 0.1 s a step, on a walled square
with a round obstacle. Motorcade simulates bodies in five ticks, words by infrared frame by frame, and observes what a
car senses and hears. VMAS simulates bodies in one substep; it observes places, or places and a Lidar of three rays.
Contestants take turns; both may use two threads. Ratios are those of processor time.
"""

import argparse
import math
import sys
import time
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from timing import Contestant, has_peer, take_turns

from motorcade.lab import parallel_env, vector_env
from motorcade.mats import Mat, Pose, Starts

SIZES = ((4, 2_048), (16, 64))
STEPS, TURNS = 5, 1
RADIUS_M = 0.075
SPACE_M2 = 0.5  # for each agent


def square(agents: int) -> Mat:
    """A walled square; the agents stand in rows, and a round obstacle in a corner."""
    side = math.ceil(math.sqrt(agents))
    step = math.sqrt(SPACE_M2)
    poses = [
        Pose((number % side + 0.5) * step, (number // side + 0.5) * step, float(number)) for number in range(agents)
    ]
    size = side * step
    starts = Starts.of(poses, [False] * agents)
    return Mat("square", starts, 20, (size, size), walled=True, discs=((size - 0.1, size - 0.1, 0.1),))


def motorcade(agents: int, worlds: int, actions: Any) -> Contestant:
    env = vector_env(square(agents), worlds, actions=actions, seconds=1e5)
    env.reset(seed=1)
    env.action_space.seed(1)
    drawn = [env.action_space.sample() for _ in range(STEPS)]

    def run() -> None:
        for each in drawn:
            env.step(each)

    return Contestant(agents * worlds * STEPS, run)


def pettingzoo(agents: int) -> Contestant:
    env = parallel_env(square(agents), actions="wheels", seconds=1e5)
    env.reset(seed=1)
    drawn = [{agent: env.action_space(agent).sample() for agent in env.agents} for _ in range(STEPS)]

    def run() -> None:
        for each in drawn:
            env.step(each)

    return Contestant(agents * STEPS, run)


def vmas(agents: int, worlds: int, rays: int) -> Contestant:
    """Make the contestant VMAS."""
    import torch
    import vmas as library
    from vmas.simulator.core import Agent, Landmark, Sphere, World
    from vmas.simulator.dynamics.diff_drive import DiffDrive
    from vmas.simulator.scenario import BaseScenario
    from vmas.simulator.sensors import Lidar
    from vmas.simulator.utils import ScenarioUtils

    half = math.ceil(math.sqrt(agents)) * math.sqrt(SPACE_M2) / 2

    class Square(BaseScenario):
        def make_world(self, batch_dim: int, device: Any, **_: object) -> Any:
            world = World(batch_dim, device, dt=0.1, substeps=1, x_semidim=half, y_semidim=half)
            for number in range(agents):
                sensors = [Lidar(world, -0.26, 0.26, rays, max_range=2.0)] if rays else []
                drive = DiffDrive(world, integration="euler")
                ranges = {"u_range": [0.3, 1.6], "u_multiplier": [1, 1]}
                world.add_agent(Agent(str(number), shape=Sphere(RADIUS_M), dynamics=drive, sensors=sensors, **ranges))
            world.add_landmark(Landmark("obstacle", collide=True, movable=False, shape=Sphere(0.1)))
            return world

        def reset_world_at(self, env_index: int | None = None) -> None:
            bounds = {"x_bounds": (-half, half), "y_bounds": (-half, half)}
            ScenarioUtils.spawn_entities_randomly(self.world.entities, self.world, env_index, 2 * RADIUS_M, **bounds)

        def reward(self, agent: Any) -> Any:
            return torch.zeros(self.world.batch_dim)

        def observation(self, agent: Any) -> Any:
            seen = [agent.state.pos, agent.state.rot, *(sensor.measure() for sensor in agent.sensors)]
            return torch.cat(seen, dim=-1)

    torch.set_num_threads(2)
    env = library.make_env(Square(), num_envs=worlds, device="cpu", continuous_actions=True, seed=1)
    fastest = torch.tensor([0.3, 1.6])
    drawn = [[torch.rand(worlds, 2) * fastest for _ in range(agents)] for _ in range(STEPS)]

    def run() -> None:
        with torch.no_grad():
            for each in drawn:
                env.step(each)

    return Contestant(agents * worlds * STEPS, run)


def contestants(has_vmas: bool) -> dict[str, Contestant]:
    made: dict[str, Contestant] = {}
    for agents, worlds in SIZES:
        size = f"{worlds:,} worlds of {agents} agents"
        made[f"{size}, wheels"] = motorcade(agents, worlds, "wheels")
        made[f"{size}, words"] = motorcade(agents, worlds, "words")
        if has_vmas:
            made[f"{size}, VMAS"] = vmas(agents, worlds, 0)
            made[f"{size}, VMAS with Lidar"] = vmas(agents, worlds, 3)
    made["PettingZoo, 16 agents, wheels"] = pettingzoo(16)
    return made


def processor_s(contestant: Contestant) -> float:
    """The least time of processors that two repetitions took: others on the machine don't matter to it."""
    times = []
    for _ in range(2):
        begin_s = time.process_time()
        contestant.run()
        times.append(time.process_time() - begin_s)
    return min(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peers", type=Path, metavar="FOLDER", help="where VMAS and PyTorch are installed")
    if peers := parser.parse_args().peers:
        sys.path.append(str(peers))
    console = Console(width=120)
    has_vmas = has_peer(console, "VMAS (see --help)", "torch", "vmas")
    with console.status("making the worlds") as status:
        made = contestants(has_vmas)
        for each in made.values():
            each.run()
        take_turns(made, TURNS, status.update)
    table = Table("", "a second", "a second of a processor", "Motorcade, wheels", "quiet", title="Steps of an agent")
    cpu = {name: each.work / processor_s(each) for name, each in made.items()}
    for name, each in made.items():
        ours = cpu.get(f"{name.rpartition(', VMAS')[0]}, wheels")
        ratio = f"{ours / cpu[name]:.0f} ×" if ours else ""
        table.add_row(name, f"{each.rate / 1e3:,.0f} k", f"{cpu[name] / 1e3:,.0f} k", ratio, each.repetitions)
    console.print(table)


if __name__ == "__main__":
    main()
