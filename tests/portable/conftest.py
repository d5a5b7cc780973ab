"""MicroPython's WebAssembly build, which npm has."""

from pathlib import Path

import pytest

import npm_packages


@pytest.fixture(scope="session")
def micropython_installed() -> None:
    """Fails, never skips, where MicroPython can't be had."""
    npm_packages.install(Path(__file__).parent, "MicroPython's WebAssembly build")
