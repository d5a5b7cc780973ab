"""The promises of docs/security.md in the simulated room; tests/README.md says how to replay a seed."""

import re
from collections import Counter
from pathlib import Path

import pytest
from tests.faults import promises
from tests.faults.broken_places import BREAKS
from tests.faults.run import SCENARIOS, SEEDS, run
from tests.faults.tried import OF_CARS, left_in_memory, try_all_seeds

ROOT = Path(__file__).parents[2]
# Seeds that found a hole, with what it was. What a seed does changes with the scenarios; what it found stays fixed.
KEPT = (
    ("uploads", 90, "a save was acknowledged although the disk could not store the file's name"),
    ("driving", 961, "a car moved without its guard after its hardware had refused to stop"),
    ("driving", 2514, "a horn sounded 8 s after it was sent, at the end of a stall that began with the connection"),
    ("fleet", 11, "a car had the new program, and was said to have the old one after a further try was refused"),
    ("fleet", 94, "a car counted as away after an upload, in which nobody had asked it"),
    ("shelf", 5, "the answer to a stop confirmed a later one, which a car whose power failed never got"),
)


@pytest.mark.parametrize("kind", OF_CARS)
def test_all_promises_hold_whatever_goes_wrong(tried, kind):
    tried(kind)
    try_all_seeds(kind)


@pytest.mark.parametrize("kind", OF_CARS)
def test_a_seed_gives_the_same_run_to_the_byte(tried, kind):
    digests = tried(kind).digests
    assert run(kind, 7).digest == digests[7] != digests[8]


@pytest.mark.parametrize("kind", OF_CARS)
def test_a_run_leaves_nothing_in_memory(kind):
    assert left_in_memory(kind) == []


@pytest.mark.parametrize(("kind", "seed", "hole"), KEPT)
def test_a_hole_stays_fixed(kind, seed, hole):
    assert run(kind, seed).broken is None, hole


def plain(text):
    return re.sub(r"\s|\*\*", "", text)


def test_the_table_in_the_readme_is_true(tried):
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
