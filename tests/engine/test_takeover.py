"""Native kernels are made ready in the background, and take over from WebAssembly between two ticks."""

import os
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

from motorcade.engine import choice
from motorcade.engine.choice import Background
from motorcade.engine.webassembly import WebAssemblyKernels
from support.waiting import wait_until
from support.worlds import ROAMING, World, crowd, go, ran

# A process whose child compiles, which takes long enough with an empty cache.
PARENT = """
from motorcade.engine import choice
from support.worlds import crowd, ran
choice.background = choice.Background(worth_car_steps=0)
ran(crowd(12), 80)
print("started", flush=True)
input()
"""


def at_once(monkeypatch: pytest.MonkeyPatch, **more: object) -> Background:
    """Let native kernels be made ready for the first world, as if this process had just begun."""
    made = Background(**{"worth_car_steps": 0, **more})
    monkeypatch.setattr(choice, "background", made)
    return made


def wait_for(background: Background) -> None:
    for takeover in background.takeovers.values():
        takeover.wait()


def test_calls_are_short_while_native_kernels_are_made_ready(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that they can take over in the middle of a long run."""
    compiled = threading.Event()
    background = at_once(monkeypatch, compile_native=lambda kind, threads: not compiled.wait(), slice_car_steps=60 * 4)
    lengths, call = [], WebAssemblyKernels.call

    def noted(self: WebAssemblyKernels, kernel: str, threads: int, *arguments: object) -> None:
        if kernel == "run":
            lengths.append(arguments[1])
        call(self, kernel, threads, *arguments)

    monkeypatch.setattr(WebAssemblyKernels, "call", noted)
    world = World(crowd(60), [ROAMING], seeds=5, threads=1)
    world.run(200)
    compiled.set()
    wait_for(background)
    world.run(200)
    assert lengths == [4, 4, 2, 10]


def test_where_the_compiler_fails_webassembly_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    background = at_once(monkeypatch)
    monkeypatch.setattr(sys, "executable", os.devnull)
    world = ran(crowd(60), 800)
    wait_for(background)
    go(world, 800)
    assert world.kernels == "webassembly"


def test_where_native_kernels_cannot_be_loaded_webassembly_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    background = at_once(monkeypatch, compile_native=lambda kind, threads: True)
    monkeypatch.setitem(sys.modules, "motorcade.engine.native", None)
    world = ran(crowd(60), 800)
    wait_for(background)
    go(world, 800)
    assert world.kernels == "webassembly"


@pytest.mark.parametrize("name", ["webassembly", "interpreted"])
def test_kernels_that_were_chosen_stay(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    background = at_once(monkeypatch)
    world = ran(crowd(12), 80, kernels=name)
    assert (world.kernels, background.takeovers) == (name, {})


def test_short_runs_start_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is worth the compiler is counted over all worlds of the process."""
    background = at_once(monkeypatch, compile_native=lambda kind, threads: False, worth_car_steps=60 * 100)
    for _ in range(2):
        World(crowd(60), [ROAMING]).run(49 * 20)
    assert background.takeovers == {}
    World(crowd(60), [ROAMING]).run(2 * 20)
    assert list(background.takeovers) == ["one"]


@pytest.mark.parametrize("end", [psutil.Process.kill, psutil.Process.terminate], ids=["killed", "ended"])
def test_the_compiler_has_a_low_priority_and_ends_with_its_parent(
    end: Callable[[psutil.Process], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(sys.path))
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", PARENT], stdin=pipe, stdout=pipe, text=True) as started:
        assert started.stdout.readline() == "started\n"
        parent = psutil.Process(started.pid)
        [child] = wait_until(parent.children)
        usual = parent.nice()
        wait_until(lambda: child.nice() != usual)
        assert child.is_running()
        end(parent)
        gone, alive = psutil.wait_procs([child], timeout=60)
    assert (gone, alive) == ([child], [])
