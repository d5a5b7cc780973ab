"""All targets give the same bits; only this file compiles the native kernels, which takes half a minute."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motorcade import Pose
from motorcade.engine import choice
from motorcade.engine.choice import Background
from motorcade.engine.targets import NAMES, Name
from motorcade.engine.webassembly import WebAssemblyKernels
from motorcade.engine.world import World
from motorcade.errors import MotorcadeError
from support.soak import SOAK
from support.worlds import ROAMING, Case, cases, contents, crowd, digest, go, ran

FEW = settings(max_examples=max(settings().max_examples // 5, 1))
SLICE_MS = 200


def everything(world: World) -> dict[str, object]:
    """All arrays of a world, in the order of the cars' numbers, what it shows, and its events."""
    shown = {name: np.asarray(value).tolist() for name, value in world.snapshot()._asdict().items() if name != "counts"}
    held = {name: value.tolist() for name, value in contents(world).items()}
    return {**shown, **held, "events": world.take_events().tolist()}


@FEW
@given(cases(tick_ms=20), cases(tick_ms=20), st.data())
def test_every_target_gives_the_same_bits(case: Case, other: Case, data: st.DataObject) -> None:
    """Worlds in which cars drive, are driven, moved and given back, walls are replaced, and all begins again."""
    worlds = [World(case.mat, case.images, case.profile, seeds=case.seed, events=True, kernels=name) for name in NAMES]
    cars = st.integers(0, worlds[0].cars - 1)
    for number in range(6):
        moved, driven, angle = data.draw(cars), data.draw(cars), data.draw(st.integers(0, 180))
        pose = Pose(float(other.mat.starts.x_m[number]), float(other.mat.starts.y_m[number]), 0.3 * number)
        for world in worlds:
            if number == 2:
                world.furnish(other.mat, other.profile.infrared.range_mm)
            if number == 4:
                world.reset(case.seed + 1)
            world.move(moved, pose)
            world.drive(driven, angle, number % 2, 200)
            if number % 3 == 2:
                world.give_back(driven)
            if number == 3:
                world.say("stop")
            world.run(SLICE_MS)
        native, webassembly, interpreted = (everything(world) for world in worlds)
        assert webassembly == native, number
        assert interpreted == native, number


def elsewhere(expression: str, **environment: str) -> object:
    """The value of an expression of `worlds` in another Python process, as JSON."""
    script = f"import json; from support import worlds; print(json.dumps({expression}))"
    path = os.pathsep.join([str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-c", script]
    ran = subprocess.run(
        command, env={**os.environ, "PYTHONPATH": path, **environment}, check=True, stdout=subprocess.PIPE, text=True
    )
    return json.loads(ran.stdout)


def test_any_number_of_threads_gives_the_same_bits_as_webassembly() -> None:
    """One thread steps a large world as a whole, several threads step it in strips."""
    runs = [(1, "native"), (2, "native"), (3, "native"), (8, "native"), (1, "webassembly"), (2, "webassembly")]
    by_threads = elsewhere(f"[worlds.large_and_many(*run) for run in {runs}]", NUMBA_NUM_THREADS="8")
    assert by_threads == [by_threads[0]] * len(runs)
    assert len(set(by_threads[0])) == 6


# To compile kernels for several threads takes half a minute each; two threads of a large world are tried below.
test_any_number_of_threads_gives_the_same_bits_as_webassembly.__test__ = SOAK


@pytest.mark.parametrize("kind", ["one", "many", "large"] if SOAK else ["one", "large"])
def test_native_kernels_take_over_without_a_change_of_a_bit(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    background = Background(worth_car_steps=0)
    monkeypatch.setattr(choice, "background", background)
    seeds, threads, cars = {"one": (5, 1, 60), "many": ([5, 6], 2, 60), "large": (5, 2, 20_000)}[kind]
    world = World(crowd(cars), [ROAMING], seeds=seeds, threads=threads)
    expected = World(crowd(cars), [ROAMING], seeds=seeds, threads=threads, kernels="webassembly")
    for each in (world, expected):
        go(each, 800)
    assert list(background.takeovers) == [kind]
    background.takeovers[kind].wait()
    for each in (world, expected):
        go(each, 800)
    assert (world.kernels, expected.kernels) == ("native", "webassembly")
    assert [digest(world, k) for k in range(world.worlds)] == [digest(expected, k) for k in range(world.worlds)]


@pytest.mark.parametrize("name", ["webassembly", "interpreted"])
def test_worlds_run_where_numba_is_missing(name: Name, monkeypatch: pytest.MonkeyPatch) -> None:
    expected = ran(crowd(12), 400, kernels="native")
    monkeypatch.setitem(sys.modules, "numba", None)
    assert digest(ran(crowd(12), 400, kernels=name)) == digest(expected)


def test_many_worlds_have_memories_of_their_own() -> None:
    worlds = [ran(crowd(12), 400, seeds=seed) for seed in range(40)]
    assert [digest(world) for world in worlds] == [digest(ran(crowd(12), 400, seeds=seed)) for seed in range(40)]


def test_arrays_stay_usable_after_their_world_is_gone() -> None:
    state = ran(crowd(12), 400).state
    rows = state.rows.copy()
    for seed in range(5):
        ran(crowd(12), 400, seeds=seed)
    assert (state.rows == rows).all()


@pytest.mark.parametrize("name", ["numba", "", "WebAssembly"])
def test_unknown_kernels_are_refused(name: str) -> None:
    with pytest.raises(MotorcadeError, match="native, webassembly, interpreted"):
        ran(crowd(12), 20, kernels=name)


def sort_events(target: WebAssemblyKernels, *in_order: object) -> None:
    """Call the kernel ``sort_events`` for three events, with ``in_order`` as its last argument."""
    rows = target.zeros("rows", (3, 6), "uint32")
    rows[:, 0] = 5, 4, 4
    target.call("sort_events", 1, rows, target.zeros("order", (2, 3), "int64"), *in_order)


class TestArguments:
    """engine.wasm is called with the arguments that it was made for, or not at all."""

    def test_good_arguments_pass(self) -> None:
        target = WebAssemblyKernels()
        in_order = target.zeros("in order", (3, 6), "uint32")
        sort_events(target, in_order)
        assert in_order[:, 0].tolist() == [4, 4, 5]

    def test_an_array_in_another_memory_is_refused(self) -> None:
        for other in (np.zeros((3, 6), np.uint32), WebAssemblyKernels().zeros("in order", (3, 6), "uint32")):
            with pytest.raises(MotorcadeError, match="isn't in its memory"):
                sort_events(WebAssemblyKernels(), other)

    @pytest.mark.parametrize(
        "changed",
        [
            np.zeros((3, 6), np.int32),
            np.zeros(18, np.uint32),
            np.zeros((3, 12), np.uint32)[:, ::2],
            6,
            0.5,
        ],
        ids=["dtype", "rank", "strides", "integer", "float"],
    )
    def test_others_are_refused_by_name(self, changed: object) -> None:
        with pytest.raises(MotorcadeError, match=r"sort_events of engine\.wasm expects in_order: uint32, 2-d, C"):
            sort_events(WebAssemblyKernels(), changed)

    def test_too_few_and_too_many_are_refused(self) -> None:
        with pytest.raises(MotorcadeError, match="None was given"):
            sort_events(WebAssemblyKernels())
        target = WebAssemblyKernels()
        in_order = target.zeros("in order", (3, 6), "uint32")
        with pytest.raises(MotorcadeError, match="expects None"):
            sort_events(target, in_order, 1)
