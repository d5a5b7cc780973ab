"""Draw each car of `firmware/` from its pin file, and make the table of its wires."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from motorcade.boards.wiring import wiring_rows, wiring_svg
from motorcade.config.pins import load_pins
from motorcade.firmware.shop import shop_cars
from motorcade.locales import text

ROOT = Path(__file__).resolve().parent.parent
PIN_FILES = {
    "raspberry-pi": "firmware/linux/pins.toml",
    "drive-car": "firmware/linux/drive-pins.toml",
    "esp32": "firmware/micropython/esp32.toml",
    "rp2040": "firmware/micropython/rp2040.toml",
    "arduino-uno": "firmware/arduino/uno.toml",
    "arduino-mega": "firmware/arduino/mega.toml",
    **{car: f"firmware/cars/{car}.toml" for car in shop_cars()},
}
_SUFFIX = {"en": "", "zh": ".zh"}


def wiring_files() -> dict[str, Callable[[], str]]:
    """Return what makes each drawing, by its path in the repository."""
    made: dict[str, Callable[[], str]] = {}
    for language, suffix in _SUFFIX.items():
        for car in PIN_FILES:
            made[f"docs/wiring/{car}{suffix}.svg"] = partial(_drawing, car, language)
    return made


def _drawing(car: str, language: str) -> str:
    return wiring_svg(load_pins(ROOT / PIN_FILES[car]), language)


def wiring_table(car: str, language: str) -> str:
    """Return the wires of one of `PIN_FILES` as a table in Markdown."""
    pins = load_pins(ROOT / PIN_FILES[car])
    columns = ["part", "terminal", "supply", "components", "pin"]
    if pins.sources:
        columns = ["part", "terminal", "pin"]
    heads = [text("command_line", f"column-{key}", {}, language) for key in columns]
    lines = [heads, ["---"] * len(heads)]
    before = ("", "")
    for row in wiring_rows(pins, language):
        shown = {**row._asdict(), "pin": row.label}
        if row.part == before[0]:
            shown["part"] = ""
        if (row.part, row.supply) == before:
            shown["supply"] = ""
        lines.append([shown[key] for key in columns])
        before = (row.part, row.supply)
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)
