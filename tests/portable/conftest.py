"""Install MicroPython's WebAssembly build from npm."""

from pathlib import Path

import pytest
from filelock import FileLock

from support import npm_packages


@pytest.fixture(scope="session")
def micropython_installed(install_lock: FileLock) -> None:
    """Install MicroPython; a test fails, and isn't skipped, where that is impossible."""
    with install_lock:
        npm_packages.install(Path(__file__).parent, "MicroPython's WebAssembly build")
