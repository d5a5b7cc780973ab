"""Write the parts of the Arduino library that follow from pin files, from the profile and from Motorcade's version."""

import re
from collections.abc import Callable
from functools import partial
from pathlib import Path

from motorcade import __version__
from motorcade.config.chips import CHIPS
from motorcade.config.pins import PinMap, load_pins
from motorcade.config.profile import built_in_profile
from motorcade.firmware.arduino_library import SETTINGS, SKETCH, header_of, settings_header

ROOT = Path(__file__).resolve().parent.parent
LIBRARY = "firmware/arduino"
PROFILE = "classroom"
# The examples for ready cars, and their pin files.
PIN_FILES = {"Uno": "arduino/uno.toml", "Mega": "arduino/mega.toml", "mBot": "cars/mbot.toml"}


def arduino_files() -> dict[str, Callable[[], str]]:
    """Return what makes each file, by its path in the repository."""
    made: dict[str, Callable[[], str]] = {f"{LIBRARY}/library.properties": _properties}
    for example in PIN_FILES:
        made[f"{LIBRARY}/examples/{example}/{SETTINGS}"] = partial(_settings, example)
    made[f"{LIBRARY}/examples/AnyBoard/{SETTINGS}"] = _blank_header
    made[f"{LIBRARY}/examples/Mega/Mega.ino"] = lambda: _read(SKETCH)
    return made


def _properties() -> str:
    return re.sub(r"(?<=^version=).*", __version__, _read("library.properties"), flags=re.MULTILINE)


def _settings(example: str) -> str:
    pins = load_pins(ROOT / "firmware" / PIN_FILES[example])
    return settings_header(pins, built_in_profile(PROFILE))


def _blank_header() -> str:
    """Return the car.h of a board that nobody knows yet: it names no pin."""
    about = [
        "// The pins of your car: write your board's numbers instead of NO_PIN, for the parts that it has. A motor has",
        "// forward, backward, enable, or enable and direction; floor has left, right. MotorcadeSettings.h explains",
        "// the rest. Leave alone the pins that the board itself needs, for its flash memory or its USB line: its",
        "// manual names them.",
    ]
    return header_of(about, [], PinMap("", CHIPS[0], ()), built_in_profile(PROFILE), None)


def _read(name: str) -> str:
    return (ROOT / LIBRARY / name).read_text(encoding="utf-8")
