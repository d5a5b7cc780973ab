"""Break the code by machine: ``python -m tests.mutants`` changes one place after the other, and each time runs tests.

``python -m tests.mutants servers`` does so with uploads, driving, classes, fleets and servers, whose judge is the
simulated room (`tests.faults.trials`). Without that, it changes the car's brain, its frames, its arbiter and the words:
mutmut changes the code and finds out which tests reach which function, as `[tool.mutmut]` in pyproject.toml says. What
survives is printed, except what ``equal_mutants.txt`` lists. Returns 1 where more than 3 % survive.
"""

import argparse
import json
import os
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import partial
from pathlib import Path

_ROOT = Path(__file__).parents[1]
_COPY = _ROOT / "mutants"
_STATS, _EQUAL = _COPY / "mutmut-stats.json", _ROOT / "tests" / "equal_mutants.txt"
_MUTMUT = Path(sys.executable).with_name("mutmut")
_MOST_SURVIVORS = 0.03
# Such a function may run once, for all tests.
_FEW = 3
_SURVIVED = (0, 33)
# In the copy of the project: try those that have no result yet.
_TRY = "--try"
# Names of no changed copy, one for code that runs on import: where such a one is 'found', the others say nothing.
_UNCHANGED = ("motorcade.words.ticks.unchanged", "motorcade.words.field.unchanged")


def results() -> Iterator[tuple[str, str, int | None]]:
    """The file, the name and the exit code of each changed copy."""
    for file in sorted((_COPY / "src").rglob("*.py.meta")):
        path = str(file.relative_to(_COPY)).removesuffix(".meta")
        for name, code in json.loads(file.read_text(encoding="utf-8"))["exit_code_by_key"].items():
            yield path, name, code


def try_all() -> None:
    """Try each copy that has no result yet, and keep the result where mutmut looks for it.

    Raises:
        SystemExit: The tests fail even where nothing is changed.
    """
    import pytest
    from tests.support.mutated_code import ON_IMPORT, Copy, Trial

    settings = tomllib.loads((_ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["mutmut"]
    arguments = [*settings["pytest_add_cli_args_test_selection"], *settings["pytest_add_cli_args"]]
    stats = json.loads(_STATS.read_text(encoding="utf-8"))
    durations_s = stats["duration_by_test"]
    waiting = {name: path for path, name, code in results() if code is None}

    def copy_of(name: str) -> Copy:
        function = name.rpartition("__mutmut_")[0]
        tests, everything = frozenset(stats["tests_by_mangled_function_name"].get(function, ())), frozenset(durations_s)
        if len(tests) <= _FEW and not ON_IMPORT.match(name):
            tests = everything
        return Copy(name, tests, sum(durations_s[test] for test in (everything if ON_IMPORT.match(name) else tests)))

    def keep(name: str, code: int) -> None:
        if name in _UNCHANGED:
            failed.extend([name] if code not in _SURVIVED else [])
            return
        file = _COPY / f"{waiting.pop(name)}.meta"
        meta = json.loads(file.read_text(encoding="utf-8"))
        meta["exit_code_by_key"][name] = code
        file.write_text(json.dumps(meta, indent=4), encoding="utf-8")
        print(len(waiting), "left;", name, code, file=sys.__stderr__, flush=True)

    failed: list[str] = []
    trial = Trial([copy_of(name) for name in [*_UNCHANGED, *waiting]], durations_s, keep, arguments)
    pytest.main(["-q", *arguments], plugins=[trial])
    if failed:
        sys.exit(f"The tests fail though nothing is changed: {', '.join(failed)}")


def change(path: str, name: str) -> str:
    """What was changed: the function, and its new line."""
    from mutmut.mutation.diff_apply import get_diff_for_mutant

    lines = get_diff_for_mutant(name, path=path).splitlines()[3:]
    new = " ".join(line[1:].strip() for line in lines if line.startswith("+"))
    function = name.rpartition("__mutmut_")[0].replace("x_", "").replace("xǁ", "").replace("ǁ", ".")
    return f"{function} | {new}"


def try_servers(arguments: list[str]) -> int:
    """Change the code that the simulated room runs."""
    sys.path.insert(0, str(_ROOT / "tests"))
    from tests.faults import trials

    parser = argparse.ArgumentParser(prog="python -m tests.mutants servers")
    parser.add_argument("--count", type=int, default=0, help="so many changes, drawn by --draw; all unless given")
    parser.add_argument("--draw", type=int, default=0)
    parser.add_argument("--seeds", type=int, default=1000, help="of each scenario")
    parser.add_argument("--room-alone", action="store_true", help="don't run tests for what no seed notices")
    parser.add_argument("folders", nargs="*")
    given = parser.parse_args(arguments)
    return trials.main(given.count, given.draw, given.seeds, tuple(given.folders), not given.room_alone)


def main(arguments: list[str]) -> int:
    """Run all changed copies that have no result yet, or only say what the results are."""
    if arguments[:1] == ["servers"]:
        return try_servers(arguments[1:])
    if not _MUTMUT.exists():
        print("No code was changed: mutmut needs a system with fork.")
        return 0
    if arguments == [_TRY]:
        try_all()
        return 0
    if arguments != ["--results"]:
        run = partial(subprocess.run, check=True)
        if not _STATS.exists():
            # It makes all copies, runs each test once, and then tries those of one small file.
            run([_MUTMUT, "run", "motorcade.words.ticks.*"], cwd=_ROOT)
        path = os.pathsep.join(str(_COPY / each) for each in ("src", "tests", ""))
        run([sys.executable, "-P", __file__, _TRY], cwd=_COPY, env=os.environ | {"PYTHONPATH": path})
    found = [(path, name, code) for path, name, code in results() if code is not None]
    equal = {line.rpartition(" | ")[0] for line in _EQUAL.read_text(encoding="utf-8").splitlines()}
    alive = [change(path, name) for path, name, code in found if code in _SURVIVED]
    survivors = [each for each in alive if each not in equal]
    print(*survivors, sep="\n")
    share = len(survivors) / max(1, len(found) - (len(alive) - len(survivors)))
    print(f"{len(found)} changes, {len(alive) - len(survivors)} change nothing; {len(survivors)} survive: {share:.1%}")
    return 1 if share > _MOST_SURVIVORS else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
