"""What the first seeds of each scenario tried: found once a run of the tests, for the two files that ask for it."""

import os
import pickle
from functools import cache

import pytest
from filelock import FileLock
from tests.faults.tried import try_seeds


@pytest.fixture(scope="session")
def tried(tmp_path_factory):
    """Give what the first seeds of a scenario tried; another process may have found it, or is about to."""
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent

    @cache
    def tried(kind):
        kept = folder / f"tried-{kind}"
        with FileLock(f"{kept}.lock"):
            if not kept.exists():
                kept.write_bytes(pickle.dumps(try_seeds(kind)))
        return pickle.loads(kept.read_bytes())

    return tried
