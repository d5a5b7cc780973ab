"""A world in a browser, without NumPy; here wasmtime stands for the browser. More worlds: test_backends.py."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.browser.kernels import BrowserKernels, LinearArray, open_worlds
from motorcade.engine.simulation import Simulation
from motorcade.errors import MotorcadeError
from motorcade.service.studio_world import open_world
from motorcade.service.world_messages import SetWorld
from support.linear_instance import MockInstance
from support.strategies import BRISK
from support.world_hash import page_hash, state_hash
from support.worlds import ROAMING, CrowdedWorld, crowd, go

TESTS = Path(__file__).parents[1]


def test_a_crowd_in_a_browser_has_the_same_bits_though_its_room_for_events_grows() -> None:
    """Each of the cars begins a state in each millisecond, which is more than there is room for at first."""
    mat = crowd(60)
    mat = replace(mat, starts=replace(mat.starts, leads=[True] * 60))
    two_idle_states = bytes.fromhex("02000000 40000000 40000000")
    profile = replace(BRISK, idle_state_ms=1)
    instance = MockInstance()
    worlds = [
        CrowdedWorld(mat, [two_idle_states], profile, seeds=3, events=True, threads=1, kernels="webassembly"),
        Simulation(mat, [two_idle_states], profile, BrowserKernels(instance), seeds=(3,), events=True),
    ]
    for world in worlds:
        go(world, 800)
    assert state_hash(worlds[1]) == state_hash(worlds[0])
    assert sum(name == "run" for name in instance.calls) > 5


def test_a_page_gets_the_same_bytes_from_both_shells() -> None:
    mat = {
        "format": "motorcade-mat/1",
        "name": "a hall",
        "size_m": [3, 3],
        "edge": "wall",
        "crowd": [{"cars": 30, "leaders": 2, "placement": "random", "seed": 4}],
        "wall": [{"from_m": [1, 1], "to_m": [2, 1]}],
        "voice": [{"at_s": 2, "word": "stop"}],
    }
    message = SetWorld(mat, ROAMING, seed=5, range_mm=700)
    worlds = [open_world(message, 100), open_world(message, 100, open_worlds(MockInstance))]
    for seed in (5, 6):
        server, browser = (page_hash(world, 1500, 7) for world in worlds)
        assert browser == server
        for world in worlds:
            world.set_environment({**mat, "wall": []}, None)
            world.move(3, 1.5, 1.5, 90)
            world.reset(seed + 1)


def test_a_picture_needs_few_calls_between_python_and_javascript() -> None:
    """For 40 ms: one call that steps all cars, and no more calls for many cars than for few."""
    counts = []
    for cars in (10, 200):
        mat = {
            "format": "motorcade-mat/1",
            "name": "a hall",
            "size_m": [9, 9],
            "crowd": [{"cars": cars, "placement": "grid"}],
        }
        instances = []

        def opened(instances=instances):
            instances.append(MockInstance())
            return instances[-1]

        world = open_world(SetWorld(mat, ROAMING), 300, open_worlds(opened))
        world.run(40), world.pictures.moment(is_stored=False)
        [instance] = instances
        instance.calls.clear()
        world.run(40), world.pictures.moment(is_stored=False)
        assert instance.calls.count("run") == 1
        counts.append(len(instance.calls))
    assert counts[0] == counts[1] < 60


def test_a_world_that_exceeds_the_memory_is_refused() -> None:
    """Its memory ends at 4 GiB; here it ends earlier."""

    class SmallInstance(MockInstance):
        def grow(self, end):
            return end < 1 << 19 and super().grow(end)

    with pytest.raises(MotorcadeError, match="WebAssembly") as caught:
        Simulation(crowd(5000), [ROAMING], None, BrowserKernels(SmallInstance()))
    assert caught.value.code == "world-exceeds-webassembly"


@given(st.lists(st.integers(0, 5), min_size=1, max_size=3), st.data())
def test_a_part_of_an_array_is_what_numpy_has(shape: list[int], data: st.DataObject) -> None:
    import numpy as np

    size = 4
    strides = tuple(size * int(np.prod(shape[number + 1 :])) for number in range(len(shape)))
    linear, array = LinearArray("uint32", tuple(shape), strides, 0), np.zeros(shape, np.uint32)
    base = array.__array_interface__["data"][0]
    bounds = st.none() | st.integers(-6, 6)
    index = tuple(
        data.draw(st.builds(slice, bounds, bounds) | (st.integers(0, length - 1) if length else st.just(slice(None))))
        for length in shape[: data.draw(st.integers(1, len(shape)))]
    )
    part, expected = linear[index], array[(*index, ...)]
    assert part.shape == expected.shape
    assert part.is_contiguous == expected.flags.c_contiguous
    if expected.size:
        assert part.address == expected.__array_interface__["data"][0] - base
        assert [stride for stride, length in zip(part.strides, part.shape, strict=True) if length > 1] == [
            stride for stride, length in zip(expected.strides, expected.shape, strict=True) if length > 1
        ]


WITHOUT = """
import sys
BLOCKED = ("numpy", "numba", "psutil", "starlette", "uvicorn", "anyio", "serial", "rich", "typer")
for name in BLOCKED:
    sys.modules[name] = None
from support.linear_instance import MockInstance as open_instance
"""
PLAYED = """
from motorcade.browser.kernels import open_worlds
from motorcade.missions.check import check_program
from motorcade.missions.document import built_in_mission
from motorcade.service.messages import MissionChoice
from motorcade.service.studio_world import open_world
from motorcade.service.world_messages import Play, SetWorld, Shown, Watch
from motorcade.service.world_session import WorldSession
from motorcade.program.compiler import compile_program

mission = built_in_mission("follow-me")
image = compile_program(mission.solution, mission.profile).image
session = WorldSession("0", lambda message: open_world(message, 1000, open_worlds(open_instance)))
session.connect()
answers = [*session.receive(SetWorld(mission.mat_document, image, seed=3, mission=MissionChoice(mission.id)))]
answers += session.receive(Play(4)) + session.receive(Watch(1))
for frame in range(100):
    answers += session.advance(frame / 30)
    session.receive(Shown(1 << 20))
result = check_program(mission, mission.solution, open_worlds(open_instance))
why = [each.why.code for each in answers if type(each).__name__ == "CarDetails"][-1]
pictures = [each for each in answers if isinstance(each, bytes)]
stars = sorted(result.stars)
"""


def test_a_page_plays_a_mission_where_there_is_no_numpy() -> None:
    code = f"""
import sys
sys.path.insert(0, {str(TESTS)!r})
{WITHOUT}{PLAYED}
assert why == "why-heard", why
assert len(pictures) > 30
# The instance alone is made of it.
assert "motorcade.engine.webassembly" not in sys.modules
print(stars)
"""
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout.strip()) == (0, "[1, 2, 3]"), ran.stderr
