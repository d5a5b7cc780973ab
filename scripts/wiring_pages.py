"""Draw each car of `firmware/` from its pin file, and make the tables of wires in the page on building a car."""

import re
from collections.abc import Callable
from functools import partial
from pathlib import Path

from motorcade.boards.wiring import wiring_rows, wiring_svg
from motorcade.config.pins import PinMap, load_pins
from motorcade.locales import text

ROOT = Path(__file__).resolve().parent.parent
PIN_FILES = {
    "raspberry-pi": "firmware/linux/pins.toml",
    "drive-car": "firmware/linux/drive-pins.toml",
    "esp32": "firmware/micropython/esp32.toml",
    "rp2040": "firmware/micropython/rp2040.toml",
    "arduino-uno": "firmware/arduino/uno.toml",
    "arduino-mega": "firmware/arduino/mega.toml",
}
PAGES = {"docs/build-a-car.md": "en", "docs/build-a-car.zh.md": "zh"}
_WIRING = re.compile(r"(?<=<!-- wiring: )([\w-]+) -->\n.*?(?=<!-- end of wiring -->)", re.DOTALL)
_SUFFIX = {"en": "", "zh": ".zh"}


def wiring_files() -> dict[str, Callable[[], str]]:
    """Return what makes each drawing and page, by its path in the repository."""
    made: dict[str, Callable[[], str]] = {}
    for language, suffix in _SUFFIX.items():
        for car in PIN_FILES:
            made[f"docs/wiring/{car}{suffix}.svg"] = partial(_drawing, car, language)
    for name, language in PAGES.items():
        made[name] = partial(_page, name, language)
    return made


def _drawing(car: str, language: str) -> str:
    return wiring_svg(load_pins(ROOT / PIN_FILES[car]), language)


def _table(pins: PinMap, language: str) -> str:
    """Return the rows as a table in Markdown."""
    heads = [text("command_line", f"column-{key}", {}, language) for key in ("part", "supply", "terminal", "pin")]
    lines = [tuple(heads), ("---",) * len(heads)]
    before = ""
    for row in wiring_rows(pins, language):
        again = row.part == before
        lines.append(("" if again else row.part, "" if again else row.supply, row.terminal, row.label))
        before = row.part
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _page(name: str, language: str) -> str:
    """Return the page with new tables between its wiring marks."""

    def wiring(found: "re.Match[str]") -> str:
        car = found[1]
        pins = load_pins(ROOT / PIN_FILES[car])
        picture = f"![{pins.name}](wiring/{car}{_SUFFIX[language]}.svg)"
        summary = text("command_line", "column-pin", {}, language)
        folded = f'<details markdown="1">\n<summary>{summary}</summary>\n\n{_table(pins, language)}\n</details>'
        return f"{car} -->\n\n{picture}\n\n{folded}\n\n"

    return _WIRING.sub(wiring, (ROOT / name).read_text(encoding="utf-8"))
