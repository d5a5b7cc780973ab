"""Change the code of uploads, driving, classes, fleets and servers by machine, and see what the simulated room notices.

Seeds of the scenarios that run the changed file come first, in a child of this process, which has imported what doesn't
change; where no seed notices it, the tests that name the module may. What survives both is printed, except what
``equal_places.txt`` lists.
"""

import os
import re
import resource
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from random import Random
from typing import NamedTuple

from support.changed_places import ChangedModule, changed, changes_of

_ROOT = Path(__file__).parents[2]
_SOURCE, _TESTS = _ROOT / "src" / "motorcade", _ROOT / "tests"
_EQUAL = _TESTS / "equal_places.txt"
# The scenarios that run each folder, those first that notice most in the least time.
SCENARIOS_OF = {
    "upload": ("uploads", "fleet"),
    "fleet": ("fleet",),
    "drive": ("keys", "driving", "lesson"),
    "classroom": ("lesson", "class"),
    "server": ("lesson", "class"),
}
# What imports nothing of these folders needn't be imported anew.
_CORE = (
    *("errors", "outcomes", "locales", "words", "devices", "car", "config", "program", "mats", "engine", "runs"),
    *("missions", "timing", "sockets", "extras"),
)
_KEPT = ("tests", "tests.faults", "tests.faults.trials", "tests.mutants", "support", "support.changed_places")
# At most so many of the changes may survive.
MOST_SURVIVORS = 0.15
# Of CPU time: a child that computes on is noticed by that.
_MOST_S, _MOST_TEST_S = 20, 240
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
# What a child prints of a change that nothing noticed.
_SURVIVES = "-"


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


def by_room(place: Place, seeds: int) -> str:
    """What of the room notices a change: a scenario, its seed and the promise."""

    def job() -> str:
        _install(place)
        from tests.faults.run import _give_up, run

        signal.signal(signal.SIGVTALRM, _give_up)
        folder = place.file.relative_to(_SOURCE).parts[0]
        for first in range(0, seeds, 10):
            for kind in SCENARIOS_OF[folder]:
                for seed in range(first, min(first + 10, seeds)):
                    signal.setitimer(signal.ITIMER_VIRTUAL, _MOST_S)
                    broken = run(kind, seed).broken
                    if broken is not None:
                        return f"{kind} {seed} {getattr(broken, 'promise', type(broken).__name__)}"
        return _SURVIVES

    return _in_child(job, 10_000)


def tests_of(place: Place) -> list[str]:
    """The files of tests that name the changed module, the nearest first."""
    own = _TESTS / place.file.relative_to(_SOURCE).parent
    files = [file for file in sorted(_TESTS.rglob("test_*.py")) if "browser" not in file.parts]
    stem = place.file.stem
    naming = []
    for file in files:
        text = file.read_text(encoding="utf-8")
        is_named = place.module in text or (f"from {place.module.rpartition('.')[0]} import" in text and stem in text)
        is_own = own in file.parents and stem in file.stem
        if is_named or is_own:
            naming.append((own not in file.parents, not is_own, str(file)))
    return [file for _, _, file in sorted(naming)][:8]


def by_tests(place: Place) -> str:
    """Which test notices a change."""
    files = tests_of(place)
    if not files:
        return _SURVIVES
    test = _failing_test(files, place)
    if test == _SURVIVES or _failing_test((test,)) == _SURVIVES:
        return test
    sys.exit(f"{test} fails though nothing is changed")


def _failing_test(files: Sequence[str], place: Place | None = None) -> str:
    """The first test that fails where a place is changed, or nothing.

    It runs in a process of its own, which has imported nothing: pytest rewrites modules when they are imported.
    """
    options = ["-x", "-q", "-rfE", "-p", "no:cacheprovider", "-n", "0", "--hypothesis-profile", "few"]
    change = [place.module, str(place.file), str(place.number)] if place else ["", "", "0"]
    command = [sys.executable, "-c", _RUN_TESTS, str(_TESTS / "support"), *change, *options, *files]
    limit = partial(resource.setrlimit, resource.RLIMIT_CPU, (_MOST_TEST_S, resource.RLIM_INFINITY))
    done = subprocess.run(command, cwd=_ROOT, capture_output=True, text=True, preexec_fn=limit, check=False)
    if done.returncode == 0:
        return _SURVIVES
    found = re.search(r"^(?:FAILED|ERROR) (\S+)", done.stdout, re.MULTILINE)
    # A change may end the process, or have it compute on.
    return found[1] if found else files[0]


def main(count: int, seed: int, seeds: int, folders: tuple[str, ...], tests: bool = True) -> int:
    """Try changes, print what survives, and return 1 where too many do."""
    chosen = drawn(count, seed, folders or tuple(SCENARIOS_OF))
    # What the children import anew is motorcade and the scenarios; all libraries are there.
    import pytest  # noqa: F401
    from tests.faults.run import run

    for kind in {kind for kinds in SCENARIOS_OF.values() for kind in kinds}:
        broken = run(kind, 0).broken
        if broken:
            print(f"{kind} 0 is broken though nothing is changed: {broken}")
    _forget()
    noticed: Counter[str] = Counter()
    for number, place in enumerate(chosen, 1):
        begin_s = time.monotonic()
        said = by_room(place, seeds)
        by = "room"
        if said == _SURVIVES and tests:
            said, by = by_tests(place), "tests"
        by = by if said != _SURVIVES else "nothing"
        noticed[by] += 1
        took_s = time.monotonic() - begin_s
        print(f"{number}/{len(chosen)} {by} | {said} | {took_s:.0f} s | {place.line} | {place.name}", flush=True)
    share = noticed["nothing"] / max(1, len(chosen))
    print(f"{len(chosen)} changes: {noticed['room']} the room, {noticed['tests']} the tests, {share:.1%} survive")
    return 1 if share > MOST_SURVIVORS else 0
