"""What a sweep's workers compare, so that none has other code."""

import subprocess
import sys
from pathlib import Path

import pytest

import motorcade
from motorcade.lab import plan
from motorcade.lab.search import GRADED_BY
from support.waiting import DEADLINE_S

PACKAGE = Path(motorcade.__file__).parent
# They make sentences and pictures, and no run's outcome.
WITHOUT_EFFECT = {"__init__.py", "errors.py", "extras.py", "locales", "outcomes.py", "runs"}


@pytest.mark.parametrize(
    ("task", "more"),
    [("motorcade.lab.task, motorcade.engine.world", ()), ("motorcade.lab.search", GRADED_BY)],
    ids=["sweep", "search"],
)
def test_all_that_a_task_imports_is_hashed(task, more, monkeypatch):
    script = (
        f"import sys, {task}; print(*(m.__file__ for n, m in sys.modules.items() if n[:9] == 'motorcade'), sep='\\n')"
    )
    listed = subprocess.check_output([sys.executable, "-c", script], text=True, timeout=4 * DEADLINE_S)
    imported = [Path(file) for file in listed.split("\n") if file]
    needed = {file for file in imported if file.relative_to(PACKAGE).parts[0] not in WITHOUT_EFFECT}
    read = set()
    original = Path.read_bytes

    def noted(path):
        read.add(path)
        return original(path)

    monkeypatch.setattr(Path, "read_bytes", noted)
    plan.code_hash.__wrapped__(more)
    assert needed - read == set()
    # What was compiled of the engine, which may be another than its source.
    assert PACKAGE / "engine" / "libraries" / "digests.json" in read
