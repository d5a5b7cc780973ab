"""The promises of docs/security.md in the simulated room; tests/README.md says how to replay a seed."""

import gc
import re
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from multiprocessing import get_context
from pathlib import Path

import pytest
from tests.faults.broken_places import BREAKS
from tests.faults.run import SCENARIOS, SEEDS, commit, main, run
from tests.faults.world import World

from support.soak import SOAK

ROOT = Path(__file__).parents[2]
ALL_SEEDS, PART = 50_000 if SOAK else 0, 500
# Seeds that found a hole, with what it was. What a seed does changes with the scenarios; what it found stays mended.
KEPT = (
    ("uploads", 90, "a save was acknowledged although the disk could not store the file's name"),
    ("driving", 961, "a car moved without its guard after its hardware had refused to stop"),
    ("driving", 2514, "a horn sounded 8 s after it was sent, at the end of a stall that began with the connection"),
    ("fleet", 11, "a car had the new program, and was said to have the old one after a further try was refused"),
    ("fleet", 94, "a car counted as away after an upload, in which nobody had asked it"),
    ("fleet", 3397, "the answer to a stop confirmed a later one, which a car whose power failed never got"),
)

# By which scenarios each row of the table in docs/security.md is tried, with the scenario before a colon.
PROMISES = (
    ("uploads:image-whole", "class:class-whole", "uploads:no-rubbish"),
    ("uploads:acknowledged-stays", "uploads:verified"),
    ("uploads:says-what-it-holds", "uploads:upload-ends", "uploads:goes-on"),
    ("driving:stands-in-time", "driving:gone-stops"),
    ("driving:guarded",),
    ("driving:no-old-command", "driving:sent"),
    ("driving:stop-gets-through", "driving:stop-holds"),
    ("driving:one-driver", "driving:leaves-standing", "driving:drives-again"),
    ("driving:armed", "driving:held-stick"),
    ("driving:horn-ends",),
    ("fleet:image-whole", "fleet:verified", "fleet:says-what-it-holds"),
    ("fleet:stop-gets-through", "fleet:stop-holds", "fleet:away-first"),
    ("fleet:nobody-waits", "fleet:found", "fleet:goes-on"),
    ("class:answered-stays", "class:in-the-class", "class:class-goes-on"),
    ("class:work-of-others", "class:own-view", "class:teacher-only"),
    ("class:stop-gets-through",),
    ("class:connections-bounded", "class:memory-bounded", "driving:connections-bounded", "driving:memory-bounded"),
    ("class:strangers-stay-out", "class:no-traceback"),
)
# What is done in the runs, in the order of the sentence above the table.
FAULTS = (
    *("kill", "power failure", "full disk", "disk error", "cut", "half-open", "stall", "pulled cable", "freeze"),
    *("busy loop", "guard", "hardware fails", "hardware hangs", "stranger"),
)


@cache
def tried(kind):
    """How often each promise was tried in the first seeds, and each fault made."""
    promises, faults = Counter(), Counter()
    for seed in SEEDS[kind]:
        result = run(kind, seed)
        assert result.broken is None, f"{result.broken}; python -m tests.faults --seed {seed} {kind}, at {commit()}"
        promises.update({f"{kind}:{name}": times for name, times in result.tried.items()})
        faults.update(result.counts)
    return promises, faults


@pytest.mark.parametrize("kind", SCENARIOS)
def test_all_promises_hold_whatever_goes_wrong(kind):
    tried(kind)
    if ALL_SEEDS:
        with ProcessPoolExecutor(mp_context=get_context("spawn"), max_tasks_per_child=1) as processes:
            parts = [[kind, "--first", str(first), "--seeds", str(PART)] for first in range(100, ALL_SEEDS, PART)]
            assert not any(processes.map(main, parts))


@pytest.mark.parametrize(("kind", "seed", "hole"), KEPT)
def test_a_hole_stays_mended(kind, seed, hole):
    assert run(kind, seed).broken is None, hole


@pytest.mark.parametrize("kind", SCENARIOS)
def test_a_seed_gives_the_same_run_to_the_byte(kind):
    first, again = (run(kind, 7) for _ in range(2))
    assert first.digest == again.digest
    assert first.last == again.last
    assert run(kind, 8).digest != first.digest


@pytest.mark.parametrize("kind", SCENARIOS)
def test_a_run_leaves_nothing_in_memory(kind):
    for seed in (5, 6):
        run(kind, seed)
    # Not isinstance, which asks a weak proxy of some library for an object that may be gone.
    assert [each.seed for each in gc.get_objects() if type(each) is World] == []


def plain(text):
    return re.sub(r"\s|\*\*", "", text)


@pytest.mark.parametrize("ending", ["", ".zh"])
def test_the_table_in_the_documentation_is_true(ending):
    names = ("security", "uploads", "drive", "cars")
    security, *others = ((ROOT / "docs" / f"{name}{ending}.md").read_text(encoding="utf-8") for name in names)
    before, _, rest = security.partition("<!-- tests/faults/test_faults.py -->")
    shown, _, behind = rest.partition("<!-- end -->")
    lead, *lines = shown.strip().splitlines()
    rows = [line.strip("|").split("|") for line in lines[3:]]
    promises, faults = Counter(), Counter()
    for kind in SCENARIOS:
        promises += tried(kind)[0]
        faults += tried(kind)[1]
    now = [sum(map(len, SEEDS.values())), *(faults[name] for name in FAULTS)]
    now += [sum(promises[name] for name in tried_by) for tried_by in PROMISES]
    told = re.findall(r"\d[\d,]*", lead) + [row[-1] for row in rows]
    # Each figure is about as large: other versions of Python draw otherwise.
    for count, figure in zip(now, told, strict=True):
        was = int(figure.replace(",", ""))
        assert was / 2 <= count <= was * 2, f"{figure} is {count} now"
    documents = plain(before + behind + "".join(others))
    assert [row[0] for row in rows if plain(row[0]) not in documents] == []
    assert {name for name in promises if promises[name]} <= {name for names in PROMISES for name in names} | BASIC


# Tried in each scenario, and part of every promise.
BASIC = {f"{kind}:no-traceback" for kind in SCENARIOS}


def test_each_break_names_a_place_that_is_there():
    for each in BREAKS:
        assert each.before in (ROOT / "src" / "motorcade" / each.file).read_text(encoding="utf-8"), each.name
