"""Parts of all kinds do the same under CPython and MicroPython."""

import json

import any_car
import pytest
from test_microcontroller import on_micropython

from support.chip_benches import ANALOG_PINS, all_kinds


@pytest.mark.parametrize("platform", ANALOG_PINS)
def test_micropython_does_the_same_to_all_kinds_of_parts(platform, micropython_installed) -> None:
    settings = all_kinds(platform)
    printed = list(any_car.lines(settings, platform))
    assert len(printed) > 300
    assert on_micropython("any_car", [json.dumps(settings), json.dumps(platform)]) == printed
