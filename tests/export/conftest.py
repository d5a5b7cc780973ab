"""The programs that exports are for; what is missing is installed where it can be, else said loudly."""

from pathlib import Path
from typing import Any

import pytest
from scripts import debian

import npm_packages

HERE = Path(__file__).parent


def program(command: str, *packages: str) -> Path:
    """The program, or a skip that the summary tells of."""
    found = debian.find_or_install(command, *packages)
    if found is None:
        pytest.skip(f"no {command}")
    return found


@pytest.fixture(scope="session")
def gcc() -> Path:
    return program("gcc", "gcc", "libc6-dev")


@pytest.fixture(scope="session")
def gxx() -> Path:
    return program("g++", "g++")


@pytest.fixture(scope="session")
def avr_gcc() -> Path:
    return program("avr-gcc", "gcc-avr", "avr-libc")


@pytest.fixture(scope="session")
def simavr() -> Path:
    return program("simavr", "simavr")


@pytest.fixture(scope="session")
def tshark() -> Path:
    return program("tshark", "tshark")


@pytest.fixture(scope="session")
def kaitai_installed() -> None:
    npm_packages.install(HERE, "Kaitai Struct's compiler")


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Says loudly what nobody has checked."""
    skipped = [
        each for each in terminalreporter.getreports("skipped") if Path(each.nodeid).parts[:2] == ("tests", "export")
    ]
    if skipped:
        missing = sorted({each.longrepr[2].removeprefix("Skipped: no ") for each in skipped})
        names = ", ".join(missing)
        terminalreporter.write_sep(
            "!", f"{len(skipped)} tests of exports did NOT run: install {names}", red=True, bold=True
        )
