"""A plugin of pytest for `tests.mutants`: quick tests come first, and code that runs on import runs again, changed."""

import json
import os
import re
import sys
from pathlib import Path

# Functions that run on import, or whose results are kept: mutmut's process has called them before it changes anything.
ON_IMPORT = re.compile(r"motorcade\.(words\.(field|formats|switches)\.|words\.infrared\.x__mask|car\.arbiter\.x__rows)")


def pytest_configure(config):
    """Forget all modules that could have run such a function; each changed copy has a process of its own."""
    if ON_IMPORT.match(os.environ.get("MUTANT_UNDER_TEST", "")):
        for name in [each for each in sys.modules if each.partition(".")[0] in ("motorcade", "support", "tests")]:
            del sys.modules[name]


def pytest_collection_modifyitems(items):
    """Let the quickest tests run first: the first that fails is enough."""
    stats = Path("mutmut-stats.json")
    durations = json.loads(stats.read_text(encoding="utf-8"))["duration_by_test"] if stats.exists() else {}
    items.sort(key=lambda item: durations.get(item.nodeid, 0))
