"""Run other simulators on the same crowd, as far as they can, and measure the speed of the memory.

**IR-SIM** drives robots with differential wheels at given velocities among the same obstacles. It either detects
collisions without any reaction, or bodies push each other (``contact``). **VMAS** drives as many bodies in batches of
worlds by PyTorch, with one round obstacle in each. Neither has words, infrared, programs or people. **Kilombo**
simulates Kilobots in C, without obstacles: they drive, push each other, send messages twice a second and run programs.
Its sources are compiled without its window, as its authors do (``-O2``). **The plain loop** is Motorcade's
`motorcade.car.loop`, one car after the other, with the whole task.
"""

import contextlib
import io
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numba
import numpy as np
from crowd_scenario import TICK_MS, crowd_mat, programs
from timing import Contestant

from motorcade.config.profile import built_in_profile
from motorcade.mats import Mat

sys.path.append(str(Path(__file__).parent.parent / "tests"))
from support.plain_world import PlainWorld

RADIUS_M = 0.075
FASTEST_M_S = 0.3
FASTEST_RAD_S = 1.6
TRIAD_ITEMS = 1 << 24
# Of Kilombo: its example in which robots drive all the time, and simulated seconds of a repetition.
KILOMBO_EXAMPLE, KILOMBO_S, KILOMBO_STEPS_A_SECOND = "orbit", 600, 24
KILOMBO_SOURCES = ("skilobot", "kbapi", "params", "stateio", "runsim", "neighbors", "distribution")


def ir_sim(cars: int, collisions: str, ticks: int) -> Contestant:
    """Make the contestant IR-SIM; ``collisions`` is its mode, ``unobstructed`` or ``contact``."""
    with contextlib.redirect_stdout(io.StringIO()):
        import irsim
    # JSON is YAML.
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "crowd.yaml"
        path.write_text(json.dumps(_ir_sim_world(crowd_mat(cars), collisions)), encoding="utf-8")
        env = irsim.make(str(path), display=False, disable_all_plot=True, log_level="ERROR", seed=1)
    dice = np.random.RandomState(1)
    velocities = [
        np.array([[dice.uniform(0, FASTEST_M_S)], [dice.uniform(-FASTEST_RAD_S, FASTEST_RAD_S)]]) for _ in range(cars)
    ]
    numbers = list(range(cars))

    def run() -> None:
        for _ in range(ticks):
            env.step(velocities, numbers)

    return Contestant(cars * ticks, run)


def kilombo(robots: int, sources: Path, folder: Path) -> Contestant:
    """Make the contestant Kilombo: compile its sources, for which libjansson-dev has to be installed, into a folder.

    The work is a robot's step of 1/24 s, in place of a tick of 20 ms.
    """
    example = sources / "examples" / KILOMBO_EXAMPLE
    # Programs include kilombo/kilolib.h.
    (folder / "kilombo").symlink_to(sources / "src")
    files = [sources / "src" / f"{name}.c" for name in KILOMBO_SOURCES] + [example / f"{KILOMBO_EXAMPLE}.c"]
    options = ["-std=gnu99", "-O2", "-w", "-fcommon", "-DSKILO_HEADLESS", "-DSIMULATOR", f"-I{folder}"]
    command = ["gcc", *options, f"-I{sources / 'src'}", "-o", "kilombo.exe", *map(str, files), "-ljansson", "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    changed = {"nBots": robots, "GUI": 0, "formation": "random", "simulationTime": KILOMBO_S, "storeHistory": 0}
    settings = json.loads((example / "kilombo.json").read_text(encoding="utf-8")) | changed
    (folder / "kilombo.json").write_text(json.dumps(settings), encoding="utf-8")

    def run() -> None:
        subprocess.run([folder / "kilombo.exe"], cwd=folder, check=True, capture_output=True)

    return Contestant(robots * KILOMBO_S * KILOMBO_STEPS_A_SECOND, run)


def _ir_sim_world(mat: Mat, collisions: str) -> dict[str, object]:
    starts = mat.starts
    assert mat.size_m
    width, height = mat.size_m
    corners = [(0, 0), (width, 0), (width, height), (0, height)]
    walls = [*((wall[:2], wall[2:]) for wall in mat.walls), *zip(corners, corners[1:] + corners[:1], strict=True)]
    obstacles: list[dict[str, Any]] = [{"shape": {"name": "linestring", "vertices": wall}} for wall in walls]
    obstacles += [{"shape": {"name": "circle", "radius": radius}, "state": [x, y, 0]} for x, y, radius in mat.discs]
    obstacles += [{"shape": {"name": "polygon", "vertices": corners}} for corners in mat.polygons]
    robots = {
        "number": len(starts),
        "kinematics": {"name": "diff"},
        "shape": {"name": "circle", "radius": RADIUS_M},
        "mass": 1,
        "state": np.stack([starts.x_m, starts.y_m, starts.heading], axis=1).tolist(),
        "vel_min": [-FASTEST_M_S, -FASTEST_RAD_S],
        "vel_max": [FASTEST_M_S, FASTEST_RAD_S],
    }
    tick_s = TICK_MS / 1000
    world = {
        "width": width,
        "height": height,
        "step_time": tick_s,
        "sample_time": tick_s,
        "collision_mode": collisions,
    }
    return {"world": world, "robot": [robots], "obstacle": obstacles}


def vmas(cars: int, worlds: int, ticks: int) -> Contestant:
    """Make the contestant VMAS."""
    import torch
    import vmas as library
    from vmas.simulator.core import Agent, Landmark, Sphere, World
    from vmas.simulator.dynamics.diff_drive import DiffDrive
    from vmas.simulator.scenario import BaseScenario
    from vmas.simulator.utils import ScenarioUtils

    size_m = crowd_mat(cars).size_m
    assert size_m
    half = size_m[0] / 2

    class Crowd(BaseScenario):
        def make_world(self, batch_dim: int, device: torch.device, **_: object) -> World:
            world = World(batch_dim, device, dt=TICK_MS / 1000, substeps=1, x_semidim=half, y_semidim=half)
            ranges = {"u_range": [FASTEST_M_S, FASTEST_RAD_S], "u_multiplier": [1, 1]}
            for number in range(cars):
                drive = DiffDrive(world, integration="euler")
                world.add_agent(Agent(str(number), shape=Sphere(RADIUS_M), dynamics=drive, **ranges))
            world.add_landmark(Landmark("obstacle", collide=True, movable=False, shape=Sphere(0.2)))
            return world

        def reset_world_at(self, env_index: int | None = None) -> None:
            bounds = (-half, half)
            ScenarioUtils.spawn_entities_randomly(
                self.world.entities, self.world, env_index, 2 * RADIUS_M, x_bounds=bounds, y_bounds=bounds
            )

        def reward(self, agent: Agent) -> torch.Tensor:
            return torch.zeros(self.world.batch_dim)

        def observation(self, agent: Agent) -> torch.Tensor:
            return agent.state.pos

    torch.set_num_threads(2)
    env = library.make_env(Crowd(), num_envs=worlds, device="cpu", continuous_actions=True, seed=1)
    fastest = torch.tensor([FASTEST_M_S, FASTEST_RAD_S])
    velocities = [torch.rand(worlds, 2) * fastest for _ in range(cars)]

    def run() -> None:
        with torch.no_grad():
            for _ in range(ticks):
                env.step(velocities)

    return Contestant(cars * worlds * ticks, run)


def plain_loop(cars: int, ticks: int) -> Contestant:
    world = PlainWorld(crowd_mat(cars), programs(), built_in_profile("classroom"))
    return Contestant(cars * ticks, lambda: world.run(ticks * TICK_MS))


@numba.njit(parallel=True)
def _triad(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> None:
    for i in numba.prange(a.shape[0]):
        a[i] = b[i] + 3.0 * c[i]


def memory_roof() -> Contestant:
    """Make the contestant STREAM's triad: its work is bytes, two reads and one write, as STREAM counts them."""
    a, b, c = np.zeros(TRIAD_ITEMS), np.ones(TRIAD_ITEMS), np.ones(TRIAD_ITEMS)
    repetitions = 8

    def run() -> None:
        numba.set_num_threads(2)
        for _ in range(repetitions):
            _triad(a, b, c)

    run()
    return Contestant(repetitions * 3 * a.nbytes, run)
