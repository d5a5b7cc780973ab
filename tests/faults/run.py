"""Run scenarios by their seeds."""

import argparse
import gc
import signal
import subprocess
import sys
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

from anyio._backends._asyncio import _task_states
from anyio.lowlevel import _run_vars
from tests.faults import promises
from tests.faults.class_room import run_class
from tests.faults.driving import run_driving
from tests.faults.fleet import run_fleet
from tests.faults.keys import run_keys
from tests.faults.lesson import run_lesson
from tests.faults.shelf import run_shelf
from tests.faults.system import logs_read
from tests.faults.track import run_track
from tests.faults.uploads import run_uploads
from tests.faults.world import BrokenPromiseError, World

SCENARIOS: dict[str, Callable[[World], None]] = {
    "uploads": run_uploads,
    "driving": run_driving,
    "track": run_track,
    "fleet": run_fleet,
    "shelf": run_shelf,
    "class": run_class,
    "lesson": run_lesson,
    "keys": run_keys,
}

# As many as take a minute in all, and those that notice a break of broken_places.py which none of these notices.
SEEDS: dict[str, tuple[int, ...]] = {
    "uploads": (*range(100), 100, 122),
    "driving": (*range(80), 157),
    "track": (*range(40),),
    "fleet": (*range(70), 147, 159),
    "shelf": (*range(40),),
    "class": (*range(60),),
    # With the last ones each request was sent by who may, by others and by strangers.
    "lesson": (*range(20), 22, 26, 29),
    "keys": (*range(30),),
}
# Of CPU time, for a program that was broken on purpose.
_MOST_S = 20


class Result(NamedTuple):
    """How a run went: its digest, the promises that were tried, faults that were made, what was asked and broken."""

    digest: str
    tried: dict[str, int]
    counts: dict[str, int]
    asked: set[tuple[str, str]]
    broken: BrokenPromiseError | None
    last: list[str]


def run(kind: str, seed: int) -> Result:
    """Run one seed of a scenario."""
    with _own_garbage(), logs_read():
        return _run(kind, seed)


def _run(kind: str, seed: int) -> Result:
    world, broken = World(seed, kind), None
    try:
        SCENARIOS[kind](world)
    except BrokenPromiseError as problem:
        broken = problem
    finally:
        world.close()
    return Result(world.digest(), world.tried, world.counts, world.asked, broken, list(world.last))


@contextmanager
def _own_garbage() -> Iterator[None]:
    """Collect garbage only behind a run, and without a word: when it is collected mustn't change what happens."""
    was_on, hook = gc.isenabled(), sys.unraisablehook
    gc.disable()
    gc.freeze()
    sys.unraisablehook = lambda problem: None
    try:
        yield
    finally:
        # anyio holds the tasks of a killed loop. A collection lets coroutines end, and only a later one frees them.
        _task_states.clear()
        _run_vars.clear()
        with warnings.catch_warnings(action="ignore"):
            while gc.collect():
                pass
        gc.unfreeze()
        sys.unraisablehook = hook
        if was_on:
            gc.enable()


def main(arguments: list[str]) -> int:
    """Run one seed or many, and print what happened."""
    parser = argparse.ArgumentParser(prog="python -m tests.faults")
    parser.add_argument("--seed", type=int, default=None, help="one seed, to replay it")
    parser.add_argument("--seeds", type=int, default=0, help="as many as in `make test`, unless given")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--until-broken", action="store_true", help="stop at the first seed that breaks a promise")
    parser.add_argument("--promises", action="store_true", help="print the table of README.md with the figures of now")
    parser.add_argument("kinds", nargs="*")
    given = parser.parse_args(arguments)
    failed = 0
    if given.promises:
        by_name, faults = Counter[str](), Counter[str]()
        for kind, seeds in SEEDS.items():
            for seed in seeds:
                result = run(kind, seed)
                by_name.update({f"{kind}:{name}": times for name, times in result.tried.items()})
                faults.update(result.counts)
        now = promises.figures_now(sum(map(len, SEEDS.values())), by_name, faults)
        print(promises.table(now))
        return 0
    if hasattr(signal, "SIGVTALRM"):
        signal.signal(signal.SIGVTALRM, _give_up)
    for kind in given.kinds or SCENARIOS:
        if given.seed is not None:
            result = run(kind, given.seed)
            print(*result.last[-60:], sep="\n")
            print(kind, given.seed, result.digest, result.tried, result.counts)
            if result.broken:
                traceback.print_exception(result.broken)
                failed += 1
            continue
        begin_s, tried, counts = time.process_time(), Counter[str](), Counter[str]()
        seeds = range(given.first, given.first + given.seeds) if given.seeds else SEEDS[kind]
        for seed in seeds:
            if hasattr(signal, "SIGVTALRM"):
                signal.setitimer(signal.ITIMER_VIRTUAL, _MOST_S)
            result = run(kind, seed)
            tried.update(result.tried)
            counts.update(result.counts)
            if result.broken:
                failed += 1
                print(f"{kind} --seed {seed} at {commit()}: {result.broken}")
                if given.until_broken:
                    return 1
        print(f"{kind}: {len(seeds)} seeds in {time.process_time() - begin_s:.1f} s of CPU time")
        print("  tried:", dict(tried))
        print("  faults:", dict(counts))
    return 1 if failed else 0


def _give_up(*_: object) -> None:
    raise BrokenPromiseError("goes-on", f"a program computes for {_MOST_S} s")


def commit() -> str:
    """The commit that is checked out."""
    done = subprocess.run(["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False)
    return done.stdout.strip() or "no commit"
