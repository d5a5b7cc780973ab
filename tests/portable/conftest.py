"""MicroPython's WebAssembly build, which npm has."""

from pathlib import Path

import pytest
from filelock import FileLock

from support import npm_packages


@pytest.fixture(scope="session")
def micropython_installed(install_lock: FileLock) -> None:
    """Fails, never skips, where MicroPython can't be had."""
    with install_lock:
        npm_packages.install(Path(__file__).parent, "MicroPython's WebAssembly build")
