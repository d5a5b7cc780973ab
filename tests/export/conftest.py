"""The programs that read exports; they are installed where possible."""

from collections.abc import Callable
from pathlib import Path

import pytest
from filelock import FileLock
from scripts import debian

from support import npm_packages

HERE = Path(__file__).parent
Finder = Callable[..., Path]


@pytest.fixture(scope="session")
def program(install_lock: FileLock) -> Finder:
    """Finds a program of Debian's packages, or skips with what is to be done."""

    def find(command: str, *packages: str) -> Path:
        with install_lock:
            found = debian.find_or_install(command, *packages)
        if found is None:
            pytest.skip(f"no {command} (on Debian: apt-get install {' '.join(packages)})")
        return found

    return find


def _program(command: str, *packages: str) -> Callable[..., Path]:
    """A fixture that is the path of a program of Debian's packages."""

    @pytest.fixture(scope="session")
    def found(program: Finder) -> Path:
        return program(command, *packages)

    return found


gcc = _program("gcc", "gcc", "libc6-dev")
gxx = _program("g++", "g++")
avr_gcc = _program("avr-gcc", "gcc-avr", "avr-libc")
simavr = _program("simavr", "simavr")
tshark = _program("tshark", "tshark")


@pytest.fixture(scope="session")
def avr8js_installed(build_lock: FileLock) -> None:
    with build_lock:
        npm_packages.install(HERE, "avr8js")
