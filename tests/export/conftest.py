"""The programs that read exports; they are installed where possible."""

from collections.abc import Callable
from pathlib import Path

import pytest
from filelock import FileLock
from scripts import debian


def _program(command: str) -> Callable[..., Path]:
    """A fixture that is the path of a program of Debian's packages; it skips with what is to be done."""
    packages = debian.FOR_TESTS[command]

    @pytest.fixture(scope="session")
    def found(install_lock: FileLock) -> Path:
        with install_lock:
            path = debian.find_or_install(command, *packages)
        if path is None:
            pytest.skip(f"no {command} (on Debian: apt-get install {' '.join(packages)})")
        return path

    return found


gcc = _program("gcc")
gxx = _program("g++")
avr_gcc = _program("avr-gcc")
simavr = _program("simavr")
tshark = _program("tshark")
