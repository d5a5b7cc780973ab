"""Install from npm what the portable tests run on: MicroPython's WebAssembly build and an emulator of the RP2040."""

from pathlib import Path

import pytest
from filelock import FileLock

from support import npm_packages


@pytest.fixture(scope="session")
def micropython_installed(build_lock: FileLock) -> None:
    """Install MicroPython; a test fails, and isn't skipped, where that is impossible."""
    with build_lock:
        npm_packages.install(Path(__file__).parent, "MicroPython's WebAssembly build and rp2040js")
