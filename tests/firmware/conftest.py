"""MicroPython, as for the portable tests."""

from functools import cache

import pytest

from motorcade.firmware import car_files, shortened
from portable.conftest import micropython_installed as micropython_installed


@pytest.fixture(autouse=True)
def shortened_once(monkeypatch) -> None:
    """Shorten the same files once: most boards differ in their settings alone, and it takes a quarter of a second."""
    monkeypatch.setattr(car_files, "shortened", lambda files, folder: dict(_shortened(tuple(files.items()), folder)))


@cache
def _shortened(files: tuple[tuple[str, bytes], ...], folder: str) -> dict[str, bytes]:
    return shortened.shortened(dict(files), folder)
