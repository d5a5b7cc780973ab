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


@pytest.fixture(scope="session")
def gcc(program: Finder) -> Path:
    return program("gcc", "gcc", "libc6-dev")


@pytest.fixture(scope="session")
def gxx(program: Finder) -> Path:
    return program("g++", "g++")


@pytest.fixture(scope="session")
def avr_gcc(program: Finder) -> Path:
    return program("avr-gcc", "gcc-avr", "avr-libc")


@pytest.fixture(scope="session")
def simavr(program: Finder) -> Path:
    return program("simavr", "simavr")


@pytest.fixture(scope="session")
def tshark(program: Finder) -> Path:
    return program("tshark", "tshark")


@pytest.fixture(scope="session")
def avr8js_installed(install_lock: FileLock) -> None:
    with install_lock:
        npm_packages.install(HERE, "avr8js")
