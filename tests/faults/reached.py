"""Find which seeds and which tests reach each line of the code that is changed by machine.

``python -m tests.faults.reached FILE KIND`` runs seeds of a scenario, or, in place of a kind, ``tests``: the tests of
the changed folders. It notes the lines by coverage, whose context is the seed or the test, and writes them as JSON.
What doesn't reach a line can't notice its change, so a change is tried by those alone that do.
"""

import ast
import json
import os
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path
from typing import Any

_ROOT = Path(__file__).parents[2]
_SOURCE, _TESTS = _ROOT / "src" / "motorcade", _ROOT / "tests"
# What is changed. Tests of services and commands, which use it from outside, are too slow to be run each time.
FOLDERS = ("upload", "fleet", "drive", "classroom", "server")
# So many seeds of a scenario tell which lines it reaches.
_SEEDS = 40
_TESTS_KIND = "tests"
# File, line and what reached it, by numbers of a list of names.
_Reached = dict[str, dict[int, list[int]]]


class Reach:
    """Which seeds and tests reach a line, or, where it runs on import, the module.

    Args:
        kinds: the scenarios.
    """

    def __init__(self, kinds: tuple[str, ...]) -> None:
        self._by_kind = {kind: _known(kind) for kind in (*kinds, _TESTS_KIND)}

    def seeds(self, kind: str, file: Path, line: int) -> list[int]:
        """The seeds of a scenario that reach a line."""
        return sorted(int(seed) for seed in self._reaching(kind, file, line))

    def tests(self, file: Path, line: int) -> list[str]:
        """The tests that reach a line."""
        return sorted(self._reaching(_TESTS_KIND, file, line))

    def _reaching(self, kind: str, file: Path, line: int) -> set[str]:
        names, reached = self._by_kind[kind]
        lines = reached.get(str(file.relative_to(_SOURCE)), {})
        wanted = lines_with(file, line)
        return {names[number] for each in wanted or lines for number in lines.get(each, ()) if names[number]}


def lines_with(file: Path, line: int) -> range:
    """The lines of the statement of a function at a line, without a block below it; none where it runs on import."""
    found: ast.stmt | None = None
    is_in_function = False
    tree: ast.AST = ast.parse(file.read_text(encoding="utf-8"))
    while inner := next((each for each in _statements(tree) if each.lineno <= line <= (each.end_lineno or 0)), None):
        is_in_function = isinstance(tree, ast.FunctionDef | ast.AsyncFunctionDef) or is_in_function
        found = tree = inner
    if found is None or not is_in_function:
        return range(0)
    below = next((each.lineno for each in _statements(found)), (found.end_lineno or line) + 1)
    return range(found.lineno, max(below, found.lineno + 1))


def _statements(tree: ast.AST) -> Iterator[ast.stmt]:
    """The statements in a block of a node, also behind its ``else``, ``except`` and ``case``."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.stmt):
            yield node
        elif isinstance(node, ast.ExceptHandler | ast.match_case):
            yield from _statements(node)


def _known(kind: str) -> tuple[list[str], _Reached]:
    """What a former run has found with this code, or what one finds now: names, and what reached which line."""
    folder = _ROOT / "mutants"
    folder.mkdir(exist_ok=True)
    file = folder / f"reached-{kind}-{_digest()}.json"
    if not file.exists():
        print(f"finding the lines that {kind} reach", flush=True)
        command = [sys.executable, "-m", "tests.faults.reached", str(file), kind]
        subprocess.run(command, cwd=_ROOT, check=True, stdout=subprocess.DEVNULL)
    names, reached = json.loads(file.read_text(encoding="utf-8"))
    return names, {path: {int(line): numbers for line, numbers in lines.items()} for path, lines in reached.items()}


def _digest() -> str:
    """What stands for all code and tests."""
    digest = sha256()
    for file in sorted([*_SOURCE.rglob("*.py"), *_TESTS.rglob("*.py")]):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:12]


class _Contexts:
    """Tells coverage which test runs.

    Attributes:
        failed: tests that fail though nothing is changed.
    """

    def __init__(self, coverage: Any) -> None:
        self._coverage = coverage
        self.failed: set[str] = set()

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        self._coverage.switch_context(nodeid)

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.failed:
            self.failed.add(report.nodeid)


def _write(file: Path, kind: str) -> None:
    import coverage

    sys.path.insert(0, str(_TESTS))
    include = [str(_SOURCE / folder / "*") for folder in FOLDERS]
    concurrency = ["thread", "greenlet"] if kind != _TESTS_KIND else ["thread"]
    seen = coverage.Coverage(data_file=None, include=include, concurrency=concurrency, config_file=False)
    contexts = _Contexts(seen)
    seen.start()
    if kind == _TESTS_KIND:
        import pytest

        options = ["-q", "-p", "no:cacheprovider", "-n", "0", "--hypothesis-profile", "few"]
        folders = [str(_TESTS / folder) for folder in FOLDERS]
        pytest.main([*options, *folders], plugins=[contexts])
    else:
        from tests.faults.run import run

        for seed in range(_SEEDS):
            seen.switch_context(str(seed))
            run(kind, seed)
    seen.stop()
    data, reached = seen.get_data(), defaultdict[str, dict[int, list[int]]](dict)
    numbers = {"": 0}
    if contexts.failed:
        print("they fail though nothing is changed:", *sorted(contexts.failed), file=sys.stderr)
    for path in data.measured_files():
        lines = data.contexts_by_lineno(path)
        name = str(Path(path).relative_to(_SOURCE))
        for line, reaching in lines.items():
            passed = sorted({*reaching} - contexts.failed)
            reached[name][line] = [numbers.setdefault(context, len(numbers)) for context in passed]
    part = file.with_suffix(f".{os.getpid()}")
    part.write_text(json.dumps([list(numbers), reached]), encoding="utf-8")
    part.replace(file)


if __name__ == "__main__":
    _write(Path(sys.argv[1]), sys.argv[2])
