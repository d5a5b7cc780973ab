"""What is asked of each scenario: its promises hold, a seed gives the same run again, and nothing of a run stays."""

import gc
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import NamedTuple

from tests.faults.run import SCENARIOS, SEEDS, commit, main, run
from tests.faults.world import World

from support.soak import SOAK

ALL_SEEDS, PART = 50_000 if SOAK else 0, 500
# Two files of tests run them, since two processes share the work: half of it is that of classes.
OF_CLASSES = ("class", "lesson")
OF_CARS = tuple(kind for kind in SCENARIOS if kind not in OF_CLASSES)


class Tried(NamedTuple):
    """How often each promise was tried, each fault made, what was asked with what outcome, and each run's digest."""

    by_name: Counter[str]
    faults: Counter[str]
    asked: set[tuple[str, str]]
    digests: dict[int, str]


def try_seeds(kind):
    """Try a scenario's first seeds; fails with the promise that was broken."""
    found = Tried(Counter(), Counter(), set(), {})
    for seed in SEEDS[kind]:
        result = run(kind, seed)
        assert result.broken is None, f"{result.broken}; python -m tests.faults --seed {seed} {kind}, at {commit()}"
        found.by_name.update({f"{kind}:{name}": times for name, times in result.tried.items()})
        found.faults.update(result.counts)
        found.asked.update(result.asked)
        found.digests[seed] = result.digest
    return found


def try_all_seeds(kind):
    """Try those of `make soak`, in processes."""
    if ALL_SEEDS:
        with ProcessPoolExecutor(mp_context=get_context("spawn"), max_tasks_per_child=1) as processes:
            parts = [[kind, "--first", str(first), "--seeds", str(PART)] for first in range(0, ALL_SEEDS, PART)]
            assert not any(processes.map(main, parts))


def left_in_memory(kind):
    """The seeds of worlds that are there after a run."""
    run(kind, SEEDS[kind][0])
    # Not isinstance, which asks a weak proxy of some library for an object that may be gone.
    return [each.seed for each in gc.get_objects() if type(each) is World]
