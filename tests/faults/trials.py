"""Change the code of uploads, driving, classes, fleets and servers by machine, and see what the simulated room notices.

`tests.faults.reached` tells which seeds and tests reach a changed line. A few of those seeds come first, in a child of
this process, which has imported what doesn't change; then the tests, in a process of their own; then more seeds. What
survives all is printed, except what ``equal_places.txt`` lists.
"""

import os
import re
import resource
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from random import Random
from typing import NamedTuple

from tests.faults.reached import FOLDERS, Reach

from support.changed_places import ChangedModule, changed, changes_of

_ROOT = Path(__file__).parents[2]
_SOURCE, _TESTS = _ROOT / "src" / "motorcade", _ROOT / "tests"
_EQUAL = _TESTS / "equal_places.txt"
# Those first that notice most in the least time.
_KINDS = ("uploads", "track", "shelf", "keys", "driving", "lesson", "fleet", "class")
# So many seeds that reach a line come before the tests.
_FIRST_SEEDS = 12
# What imports nothing of these folders needn't be imported anew.
_CORE = (
    *("errors", "outcomes", "locales", "words", "devices", "car", "config", "program", "mats", "engine", "runs"),
    *("missions", "timing", "sockets", "extras"),
)
_KEPT = (
    *("tests", "tests.faults", "tests.faults.trials", "tests.faults.reached", "tests.mutants", "support"),
    "support.changed_places",
)
# At most so many of the changes may survive.
MOST_SURVIVORS = 0.15
# Of CPU time: a child that computes on is noticed by that. A seed takes a third of a second.
_MOST_S, _MOST_TEST_S = 20, 240
# Of time: tests that wait for ever are ended.
_MOST_WAIT_S = 1800
# So many tests run at once: a limit holds for these.
_TESTS_AT_ONCE = 60
# Runs pytest where a module is changed. Nothing of the tests is imported before.
_RUN_TESTS = """
import sys
folder, module, file, number = sys.argv[1:5]
from pathlib import Path
if module:
    sys.path.insert(0, folder)
    from changed_places import ChangedModule, changed
    sys.path.remove(folder)
    ChangedModule(module, Path(file), changed(Path(file), int(number))[0]).install()
import pytest
sys.exit(pytest.main(sys.argv[5:]))
"""
# What pytest returns where the names of tests are wrong, or there are none.
_NO_TESTS = (4, 5)
# What a child prints of a change that nothing noticed.
_SURVIVES = "-"
# In place of a test: none failed before a limit came.
_NO_TIME = "no time"


class Place(NamedTuple):
    """A change: the file, its number there, its line and what it is."""

    file: Path
    number: int
    line: int
    kind: str
    what: str

    @property
    def name(self) -> str:
        return f"{self.file.relative_to(_SOURCE)} | {self.kind} | {self.what}"

    @property
    def module(self) -> str:
        return ".".join(("motorcade", *self.file.relative_to(_SOURCE).with_suffix("").parts))


def places(folders: tuple[str, ...]) -> Iterator[Place]:
    """All changes of these folders."""
    import ast

    for folder in folders:
        for file in sorted((_SOURCE / folder).rglob("*.py")):
            if "page" in file.relative_to(_SOURCE).parts:
                continue
            tree = ast.parse(file.read_text(encoding="utf-8"))
            for number, change in enumerate(changes_of(tree)):
                yield Place(file, number, change.line, change.kind, change.what)


def drawn(count: int, seed: int, folders: tuple[str, ...]) -> list[Place]:
    """So many places by chance, those that change nothing left out; all for 0."""
    equal = set()
    if _EQUAL.exists():
        equal = {line.rpartition(" | ")[0] for line in _EQUAL.read_text(encoding="utf-8").splitlines()}
    found = [place for place in places(folders) if place.name not in equal]
    if not count:
        return found
    return Random(seed).sample(found, min(count, len(found)))


def _forget() -> None:
    """Forget what the tests and the program have imported of themselves."""
    for name in [name for name in sys.modules if name.partition(".")[0] in ("motorcade", "tests", "support")]:
        wing = name.partition(".")[2].partition(".")[0]
        is_core = name.startswith("motorcade.") and wing in _CORE
        if not is_core and name not in _KEPT:
            package, _, last = name.rpartition(".")
            # A package that stays would give the module of before to who imports it from there.
            vars(sys.modules.get(package, sys)).pop(last, None)
            del sys.modules[name]


def _install(place: Place) -> None:
    tree, _ = changed(place.file, place.number)
    ChangedModule(place.module, place.file, tree).install()


def _in_child(job: Callable[[], str], most_s: float) -> str:
    """What a job prints that runs in a child with a limit of CPU time."""
    reads, writes = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reads)
        null = os.open(os.devnull, os.O_WRONLY)
        for handle in (1, 2):
            os.dup2(null, handle)
        resource.setrlimit(resource.RLIMIT_CPU, (int(time.process_time() + most_s) + 1, resource.RLIM_INFINITY))
        try:
            said = job()
        except BaseException as problem:  # noqa: BLE001 - whatever ends it is noticed
            said = f"import {type(problem).__name__}"
        os.write(writes, said.encode()[:200])
        os._exit(0)
    os.close(writes)
    with os.fdopen(reads, "rb") as pipe:
        said = pipe.read().decode()
    os.waitpid(child, 0)
    return said or "killed"


def by_room(place: Place, seeds_of: Mapping[str, Sequence[int]]) -> str:
    """What of the room notices a change: a scenario, its seed and the promise."""

    def job() -> str:
        _install(place)
        from tests.faults.run import run

        for kind, seeds in seeds_of.items():
            for seed in seeds:
                # It ends this process: an error may end one of many tasks that compute on.
                signal.setitimer(signal.ITIMER_VIRTUAL, _MOST_S)
                broken = run(kind, seed).broken
                if broken is not None:
                    return f"{kind} {seed} {getattr(broken, 'promise', type(broken).__name__)}"
        return _SURVIVES

    return _in_child(job, 10_000)


def by_tests(place: Place, tests: Sequence[str]) -> str:
    """Which of these tests notices a change: it fails twice, and not where nothing is changed.

    Tests that come to a limit notice it only where they come to none without the change: the computer may be busy.
    """
    for first in range(0, len(tests), _TESTS_AT_ONCE):
        left = list(tests[first : first + _TESTS_AT_ONCE])
        while left and (test := _failing_test(left, place)) != _SURVIVES:
            if test == _NO_TIME:
                if _failing_test(left) == _SURVIVES:
                    return f"{_NO_TIME}: {left[0]}"
                break
            if _failing_test((test,), place) != _SURVIVES and _failing_test((test,)) == _SURVIVES:
                return test
            left.remove(test)
    return _SURVIVES


def _failing_test(tests: Sequence[str], place: Place | None = None) -> str:
    """The first test that fails where a place is changed, or nothing.

    It runs in a process of its own, which has imported nothing: pytest rewrites modules when they are imported.
    """
    options = ["-x", "-q", "-rfE", "-p", "no:cacheprovider", "-n", "0", "--hypothesis-profile", "few"]
    change = [place.module, str(place.file), str(place.number)] if place else ["", "", "0"]
    command = [sys.executable, "-c", _RUN_TESTS, str(_TESTS / "support"), *change, *options, *tests]
    limit = partial(resource.setrlimit, resource.RLIMIT_CPU, (_MOST_TEST_S, resource.RLIM_INFINITY))
    try:
        done = subprocess.run(
            command, cwd=_ROOT, capture_output=True, text=True, preexec_fn=limit, check=False, timeout=_MOST_WAIT_S
        )
    except subprocess.TimeoutExpired:
        return _NO_TIME
    if done.returncode == 0:
        return _SURVIVES
    if done.returncode == -signal.SIGXCPU:
        return _NO_TIME
    if done.returncode in _NO_TESTS and not place:
        sys.exit(done.stdout[-2000:])
    found = re.search(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", done.stdout, re.MULTILINE)
    # A change may end the process.
    return found[1] if found and found[1] in tests else tests[0]


def noticed_by(place: Place, reach: Reach, most_seeds: int, tests: bool) -> tuple[str, str]:
    """What notices a change, and which seed or test of it."""
    reaching = {kind: reach.seeds(kind, place.file, place.line) for kind in _KINDS}
    first = {kind: seeds[:_FIRST_SEEDS] for kind, seeds in reaching.items() if seeds}
    more = {kind: [seed for seed in range(most_seeds) if seed not in seeds] for kind, seeds in first.items()}
    said = by_room(place, first)
    if said != _SURVIVES:
        return "room", said
    if tests:
        said = by_tests(place, reach.tests(place.file, place.line))
        if said != _SURVIVES:
            return "tests", said
    said = by_room(place, more)
    return "room" if said != _SURVIVES else "nothing", said


def main(count: int, seed: int, seeds: int, folders: tuple[str, ...], tests: bool = True) -> int:
    """Try changes, print what survives, and return 1 where too many do."""
    chosen = drawn(count, seed, folders or FOLDERS)
    reach = Reach(_KINDS)
    # What the children import anew is motorcade and the scenarios; all libraries are there.
    import pytest  # noqa: F401
    from tests.faults.run import run

    for kind in _KINDS:
        broken = run(kind, 0).broken
        if broken:
            print(f"{kind} 0 is broken though nothing is changed: {broken}")
    _forget()
    noticed: Counter[str] = Counter()
    for number, place in enumerate(chosen, 1):
        begin_s = time.monotonic()
        by, said = noticed_by(place, reach, seeds, tests)
        noticed[by] += 1
        took_s = time.monotonic() - begin_s
        print(f"{number}/{len(chosen)} {by} | {said} | {took_s:.0f} s | {place.line} | {place.name}", flush=True)
    share = noticed["nothing"] / max(1, len(chosen))
    print(f"{len(chosen)} changes: {noticed['room']} the room, {noticed['tests']} the tests, {share:.1%} survive")
    return 1 if share > MOST_SURVIVORS else 0
