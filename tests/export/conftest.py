"""The programs that read exports; they are installed where possible."""

from collections.abc import Callable
from pathlib import Path

import pytest
from filelock import FileLock
from scripts import debian


def _program(command: str, *packages: str) -> Callable[..., Path]:
    """A fixture that is the path of a program of Debian's packages; it skips with what is to be done."""

    @pytest.fixture(scope="session")
    def found(install_lock: FileLock) -> Path:
        with install_lock:
            path = debian.find_or_install(command, *packages)
        if path is None:
            pytest.skip(f"no {command} (on Debian: apt-get install {' '.join(packages)})")
        return path

    return found


gcc = _program("gcc", "gcc", "libc6-dev")
gxx = _program("g++", "g++")
avr_gcc = _program("avr-gcc", "gcc-avr", "avr-libc")
simavr = _program("simavr", "simavr")
tshark = _program("tshark", "tshark")
