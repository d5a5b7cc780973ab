"""A class in a folder of the test."""

import pytest

from support.class_page import class_room


@pytest.fixture
def now():
    """What the clocks of the class show, in seconds."""
    return [100.0]


@pytest.fixture
def room(tmp_path, now):
    with class_room(tmp_path, clock=lambda: now[0], unix_s=lambda: now[0]) as opened:
        yield opened
