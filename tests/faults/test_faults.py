"""The promises of docs/security.md in the simulated room; tests/README.md says how to replay a seed."""

import gc
import re
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import pytest
from starlette.routing import Route, WebSocketRoute
from tests.faults import lesson, promises
from tests.faults.broken_places import BREAKS
from tests.faults.browsers import DONE
from tests.faults.run import SCENARIOS, SEEDS, commit, main, run
from tests.faults.world import World

from motorcade.classroom.app import AUTHORITY, PAGES, REQUESTS, make_class_app
from motorcade.classroom.folder import ClassFolder
from motorcade.classroom.running import ClassServerSettings
from support.soak import SOAK

ROOT = Path(__file__).parents[2]
ALL_SEEDS, PART = 50_000 if SOAK else 0, 500
# Seeds that found a hole, with what it was. What a seed does changes with the scenarios; what it found stays fixed.
KEPT = (
    ("uploads", 90, "a save was acknowledged although the disk could not store the file's name"),
    ("driving", 961, "a car moved without its guard after its hardware had refused to stop"),
    ("driving", 2514, "a horn sounded 8 s after it was sent, at the end of a stall that began with the connection"),
    ("fleet", 11, "a car had the new program, and was said to have the old one after a further try was refused"),
    ("fleet", 94, "a car counted as away after an upload, in which nobody had asked it"),
    ("shelf", 5, "the answer to a stop confirmed a later one, which a car whose power failed never got"),
)


class Tried(NamedTuple):
    """How often each promise was tried, each fault made, what was asked with what outcome, and each run's digest."""

    by_name: Counter[str]
    faults: Counter[str]
    asked: set[tuple[str, str]]
    digests: dict[int, str]


@cache
def tried(kind):
    """What the first seeds tried."""
    found = Tried(Counter(), Counter(), set(), {})
    for seed in SEEDS[kind]:
        result = run(kind, seed)
        assert result.broken is None, f"{result.broken}; python -m tests.faults --seed {seed} {kind}, at {commit()}"
        found.by_name.update({f"{kind}:{name}": times for name, times in result.tried.items()})
        found.faults.update(result.counts)
        found.asked.update(result.asked)
        found.digests[seed] = result.digest
    return found


@cache
def asked_in_lesson(seed):
    return run("lesson", seed).asked


@pytest.mark.parametrize("kind", SCENARIOS)
def test_all_promises_hold_whatever_goes_wrong(kind):
    tried(kind)
    if ALL_SEEDS:
        with ProcessPoolExecutor(mp_context=get_context("spawn"), max_tasks_per_child=1) as processes:
            parts = [[kind, "--first", str(first), "--seeds", str(PART)] for first in range(0, ALL_SEEDS, PART)]
            assert not any(processes.map(main, parts))


@pytest.mark.parametrize(("kind", "seed", "hole"), KEPT)
def test_a_hole_stays_fixed(kind, seed, hole):
    assert run(kind, seed).broken is None, hole


@pytest.mark.parametrize("kind", SCENARIOS)
def test_a_seed_gives_the_same_run_to_the_byte(kind):
    digests = tried(kind).digests
    assert run(kind, 7).digest == digests[7] != digests[8]


@pytest.mark.parametrize("kind", SCENARIOS)
def test_a_run_leaves_nothing_in_memory(kind):
    tried(kind)
    # Not isinstance, which asks a weak proxy of some library for an object that may be gone.
    assert [each.seed for each in gc.get_objects() if type(each) is World] == []


def test_all_requests_of_a_class_are_sent_by_who_may_and_by_who_must_not():
    asked, more = set(tried("lesson").asked), iter(range(100, 200))
    # A change of the code changes what a seed does, and rare requests may be in none of the first seeds.
    while any((missing := _never_sent(asked)).values()):
        seed = next(more, None)
        assert seed is not None, missing
        asked |= asked_in_lesson(seed)


def test_all_routes_of_a_class_are_asked_by_who_may_and_by_who_must_not(tmp_path):
    settings = ClassServerSettings(library=tmp_path, page=tmp_path, port=7710)
    app = make_class_app(settings, ClassFolder(tmp_path))._app
    routes = {route.path for route in app.routes if isinstance(route, Route | WebSocketRoute)}
    # What is behind these a table has: it is compared with the requests below.
    routes -= {"/api/class/{name:path}", "/api/teacher/{name:path}", "/api/{name:path}"}
    # Pages are for everybody. Of cars without a camera there is no picture.
    routes -= {"/", "/drive", *PAGES, AUTHORITY}
    asked, more = set(tried("lesson").asked), iter(range(100, 200))
    refused = {"class-session-needed", "teacher-session-needed"}
    while missing := [
        (route, wanted)
        for route in routes
        for wanted in ({DONE, "no-camera-here"}, refused)
        if not wanted & {outcome for path, outcome in asked if path == route}
    ]:
        seed = next(more, None)
        assert seed is not None, missing
        asked |= asked_in_lesson(seed)


def _never_sent(asked):
    """The requests that nobody has sent who may, that no stranger has sent, or nobody else."""
    outcomes = {name: {outcome for request, outcome in asked if request == name} for name in lesson.TABLE}
    refused = {"class-session-needed", "teacher-session-needed"}
    guarded = [name for name in lesson.TABLE if name not in REQUESTS or not REQUESTS[name][1].is_open]
    return {
        "by who may": [name for name in REQUESTS if DONE not in outcomes[name]],
        "by a stranger": [name for name in guarded if not outcomes[name] & refused],
        "by others": [name for name in guarded if not outcomes[name] - refused],
    }


def plain(text):
    return re.sub(r"\s|\*\*", "", text)


def test_the_table_in_the_readme_is_true():
    runs, by_name, faults = sum(map(len, SEEDS.values())), Counter(), Counter()
    for kind in SCENARIOS:
        by_name += tried(kind).by_name
        faults += tried(kind).faults
    now = promises.figures_now(runs, by_name, faults)
    written = promises.written_table()
    # Each figure is about as large: other versions of Python draw otherwise.
    for count, was in zip(now, promises.figures(written), strict=True):
        assert was / 2 <= count <= was * 2, f"{was} is {count} now; python -m tests.faults --promises"
    assert promises.table(promises.figures(written)) == written
    assert {name for name in by_name if by_name[name]} <= {
        name for names in promises.PROMISES for name in names
    } | BASIC


def test_each_promise_that_is_tried_stands_in_the_documentation():
    pages = (ROOT / "docs" / f"{name}.md" for name in ("security", "drive", "cars", "classroom"))
    documents = plain("".join(page.read_text(encoding="utf-8") for page in pages))
    rows = [line.strip("|").split("|")[0] for line in promises.written_table().splitlines()[4:]]
    assert [row for row in rows if plain(row) not in documents] == []


# Tried in each scenario, and part of every promise.
BASIC = {f"{kind}:no-traceback" for kind in SCENARIOS}


def test_each_break_names_a_place_that_is_there():
    for each in BREAKS:
        assert each.before in (ROOT / "src" / "motorcade" / each.file).read_text(encoding="utf-8"), each.name
