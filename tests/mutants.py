"""Break the code by machine: ``python -m tests.mutants`` changes one place after the other, and each time runs tests.

mutmut does it, as `[tool.mutmut]` in pyproject.toml says. What survives is printed, except what ``equal_mutants.txt``
lists. Returns 1 where more than 3 % survive.
"""

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from tests.support.mutated_code import ON_IMPORT

_ROOT = Path(__file__).parents[1]
_STATS, _EQUAL = _ROOT / "mutants" / "mutmut-stats.json", _ROOT / "tests" / "equal_mutants.txt"
_MUTMUT = Path(sys.executable).with_name("mutmut")
_MOST_SURVIVORS = 0.03
# Such a function may run once, for all tests.
_FEW = 3
_SURVIVED = (0, 33)


def choose_tests() -> None:
    """Let mutmut find out which tests reach which function, and let all tests judge what runs on import."""
    subprocess.run([_MUTMUT, "run", "motorcade.words.ticks.*"], cwd=_ROOT, check=True)
    stats = json.loads(_STATS.read_text(encoding="utf-8"))
    every = sorted(stats["duration_by_test"], key=stats["duration_by_test"].get)
    chosen = stats["tests_by_mangled_function_name"]
    for function, tests in chosen.items():
        if len(tests) <= _FEW or ON_IMPORT.match(function):
            chosen[function] = every
    _STATS.write_text(json.dumps(stats), encoding="utf-8")


def results() -> Iterator[tuple[str, str, int | None]]:
    """The file, the name and the exit code of each changed copy."""
    for file in sorted((_ROOT / "mutants" / "src").rglob("*.py.meta")):
        path = str(file.relative_to(_ROOT / "mutants")).removesuffix(".meta")
        for name, code in json.loads(file.read_text(encoding="utf-8"))["exit_code_by_key"].items():
            yield path, name, code


def change(path: str, name: str) -> str:
    """What was changed: the function, and its new line."""
    from mutmut.mutation.diff_apply import get_diff_for_mutant

    lines = get_diff_for_mutant(name, path=path).splitlines()[3:]
    new = " ".join(line[1:].strip() for line in lines if line.startswith("+"))
    function = name.rpartition("__mutmut_")[0].replace("x_", "").replace("xǁ", "").replace("ǁ", ".")
    return f"{function} | {new}"


def main(arguments: list[str]) -> int:
    """Run all changed copies that have no result yet, or only say what the results are."""
    if not _MUTMUT.exists():
        print("No code was changed: mutmut needs a system with fork.")
        return 0
    if arguments != ["--results"]:
        if not _STATS.exists():
            choose_tests()
        subprocess.run([_MUTMUT, "run"], cwd=_ROOT, check=True)
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
