"""A run that an exception breaks off ends at a tick of all cars, from which it goes on with equal bits."""

import gc
import math
import os
import signal
import threading
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import Any

import pytest

from motorcade import Pose, Program, compile_program, forward, left
from motorcade.engine.world import World
from motorcade.mats import Mat, Starts
from support.interrupts import lines_until_interrupted
from support.soak import SOAK
from support.waiting import wait_until
from support.worlds import ROAMING, CrowdedWorld, contents, crowd

TICK_MS = crowd(2).tick_ms
DAYS_MS = 1_000_000_000
# Leaders drive, at first away from each other, and tell nobody anything: a world goes to a much later tick at once.
ALONE = compile_program(Program([forward(3), left(2)])).image
AROUND = [Pose(math.cos(turn), math.sin(turn), turn) for turn in range(6)]
QUIET = Mat("quiet", Starts.of(AROUND, [True] * 6), TICK_MS)
WORLDS: dict[str, dict[str, Any]] = {
    "one world": {"seeds": 3},
    "with events": {"seeds": 3, "events": True},
    "many worlds of two threads": {"seeds": range(5), "threads": 2},
    "many worlds of two threads, with events": {"seeds": range(5), "threads": 2, "events": True},
    "a large world of two threads": {"seeds": 3, "threads": 2},
    "a large world of two threads, with events": {"seeds": 3, "threads": 2, "events": True},
    "WebAssembly, with events": {"seeds": range(2), "events": True, "kernels": "webassembly"},
    "plain Python": {"seeds": range(2), "kernels": "interpreted"},
    "a quiet world": {"seeds": 3, "events": True},
    "a quiet world in plain Python": {"seeds": 3, "kernels": "interpreted"},
    "plain Python, with events": {"seeds": range(2), "events": True, "kernels": "interpreted"},
}


@pytest.fixture(autouse=True)
def _small_large_worlds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("motorcade.engine.world._LARGE", 40)


def made(name: str) -> World:
    """A world that has run for a moment, so that an interrupted run isn't its first."""
    mat, image = (QUIET, ALONE) if "quiet" in name else (crowd(40 if "large" in name else 6), ROAMING)
    world = CrowdedWorld(mat, [image], **WORLDS[name])
    world.run(3 * TICK_MS)
    world.say("stop")
    return world


def shown(world: World) -> list[Any]:
    """All that a world is, with its events."""
    columns = [{name: value.tolist() for name, value in contents(world, k).items()} for k in range(world.worlds)]
    return [*columns, world.take_events().tolist() if world._keeps_events else []]


@pytest.mark.parametrize("name", WORLDS)
def test_a_run_that_is_broken_off_anywhere_goes_on_with_equal_bits(name: str) -> None:
    ticks = 12
    expected = made(name)
    expected.run(ticks * TICK_MS)
    result, begun_ms = shown(expected), 3 * TICK_MS
    lines = lines_until_interrupted(lambda: made(name).run(ticks * TICK_MS), -1)
    # Without kernels each world takes ten times as long.
    step = 1 if SOAK else max(lines // (15 if "plain" in name.lower() else 60), 1)
    # At the end, where threads are waited for, each line counts.
    for at in (*range(1, lines, step), *range(max(lines - 5, 1), lines)):
        world = made(name)
        lines_until_interrupted(partial(world.run, ticks * TICK_MS), at)
        assert begun_ms <= world.now_ms <= begun_ms + ticks * TICK_MS
        # What it shows then is what a run until then shows.
        whole = made(name)
        whole.run(world.now_ms - begun_ms)
        assert whole.snapshot().x_m.tolist() == world.snapshot().x_m.tolist()
        world.run(begun_ms + ticks * TICK_MS - world.now_ms)
        assert shown(world) == result, at


CHANGES = {
    "move": lambda world: world.move(1, Pose(0.9, -0.7, 1.5)),
    "drive": lambda world: world.drive(1, 40, 1, 200),
    "give back": lambda world: world.give_back(0),
    "set an environment": lambda world: world.set_environment(replace(world.mat, people=(), voices=()), 900),
    "reset": lambda world: world.reset(list(range(7, 7 + world.worlds))),
}


@pytest.mark.parametrize("name", ["one world", "many worlds of two threads, with events", "plain Python"])
@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_a_change_that_is_broken_off_anywhere_is_made_whole_or_not_at_all(
    name: str, change: Callable[[World], None]
) -> None:
    def driven() -> World:
        world = made(name)
        world.drive(0, 120, 0, 150)
        return world

    def gone_on(world: World) -> list[Any]:
        world.run(6 * TICK_MS)
        return [shown(world), world.now_ms, world.run_number, world.seeds, world.mat, world.profile]

    without, with_it = driven(), driven()
    change(with_it)
    results = [gone_on(without), gone_on(with_it)]
    assert results[0] != results[1]
    lines, seen = lines_until_interrupted(partial(change, driven()), -1), set()
    for at in range(1, lines, 1 if SOAK else max(lines // 25, 1)):
        world = driven()
        lines_until_interrupted(partial(change, world), at)
        seen.add(results.index(gone_on(world)))
    assert 1 in seen


@contextmanager
def ctrl_c_after(seconds: float) -> Iterator[None]:
    """Interrupt this thread after a time, and again: Python drops an interrupt that meets some object's finalizer."""
    over = threading.Event()

    def interrupt() -> None:
        while not over.wait(seconds):
            os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    thread.start()
    try:
        yield
    except KeyboardInterrupt:
        over.set()
    else:
        pytest.fail("nothing was interrupted")
    finally:
        over.set()
        thread.join()


# A dropped interrupt is a warning.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("name", WORLDS)
def test_ctrl_c_ends_a_run_of_days_at_a_tick_that_the_clock_names(name: str) -> None:
    world = made(name)
    with ctrl_c_after(0.2):
        world.run(DAYS_MS)
    stopped_ms = world.now_ms
    place = world.snapshot().x_m.tolist()
    # Nothing goes on behind its back.
    assert (world.snapshot().x_m.tolist(), world.now_ms) == (place, stopped_ms)
    assert 3 * TICK_MS <= stopped_ms < 1 << 29
    whole = made(name)
    whole.run(stopped_ms - 3 * TICK_MS)
    assert shown(whole) == shown(world)


@pytest.mark.parametrize("name", [name for name in WORLDS if "threads" in name])
def test_a_world_that_nobody_needs_any_more_is_gone_at_once(name: str) -> None:
    """Threads that have worked for it keep nothing: its arrays may be large."""
    gc.collect()
    gc.disable()
    try:
        world = made(name)
        gone = weakref.ref(world)
        del world
        wait_until(lambda: gone() is None)
    finally:
        gc.enable()
