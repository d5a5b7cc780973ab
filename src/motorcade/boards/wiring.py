"""The wiring of a car, for its builders: the rows of a table and a drawing, both made from its pin file."""

from itertools import groupby
from typing import NamedTuple
from xml.sax.saxutils import escape

from motorcade.config.pins import PinMap
from motorcade.errors import Phrase

_WIDTH = 760
_COMPUTER_LEFT, _COMPUTER_RIGHT = 20, 230
_DEVICE_LEFT, _DEVICE_RIGHT = 400, 740
_MARGIN = 20
_HEADING = 44
_ROW = 24
_GAP = 14
# People with colour blindness can tell these apart (Okabe and Ito).
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")


class WiringRow(NamedTuple):
    """One wire: the part, its terminal, the GPIO number, its label on the board, and the part's supply."""

    part: str
    terminal: str
    pin: int
    label: str
    supply: str


def wiring_rows(pins: PinMap, language: str) -> list[WiringRow]:
    """Return a row for each wire. A car from a shop is wired already: it has what its wires do, and no supplies."""
    rows = []
    for wire in pins.wires:
        part = Phrase(f"device-{wire.device.key}")
        terminal = wire.terminal(pins.chip)
        supply = wire.supply(pins.chip)
        if pins.sources:
            part = Phrase(f"shop-device-{wire.device.key}")
            terminal = Phrase(f"wire-{wire.role.key}").sentence(language)
            supply = ""
        label = pins.chip.label(wire.pin)
        rows.append(WiringRow(part.sentence(language), terminal, wire.pin, label, supply))
    return rows


def wiring_svg(pins: PinMap, language: str) -> str:
    """Return the wires as an SVG drawing: the computer's pins on the left, the parts on the right."""
    drawn: list[str] = []
    top = _MARGIN + _HEADING
    parts = groupby(wiring_rows(pins, language), key=lambda row: row.part)
    for number, (part, wired) in enumerate(parts):
        rows = list(wired)
        colour = _COLOURS[number % len(_COLOURS)]
        height = _ROW * (len(rows) + 1) + 6
        drawn.append(_box(_DEVICE_LEFT, top, _DEVICE_RIGHT, height, colour))
        drawn.append(_text(_DEVICE_LEFT + 12, top + 18, part, "bold"))
        drawn.append(_text(_DEVICE_RIGHT - 12, top + 18, rows[0].supply, "end"))
        for place, row in enumerate(rows, start=1):
            y = top + _ROW * place + 12
            drawn.append(_wire(y, colour))
            drawn.append(_text(_COMPUTER_RIGHT - 12, y + 5, row.label, "end"))
            drawn.append(_text(_DEVICE_LEFT + 12, y + 5, row.terminal, ""))
        top += height + _GAP
    height = top + _MARGIN - _GAP
    title = escape(f"{pins.name}: {pins.chip.title}")
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height}" role="img" aria-label="{title}">\n'
        "<style>text{font:14px sans-serif;fill:#111}.bold{font-weight:bold}.end{text-anchor:end}</style>\n"
        f'<rect width="{_WIDTH}" height="{height}" fill="#fff"/>\n'
        + _box(_COMPUTER_LEFT, _MARGIN, _COMPUTER_RIGHT, height - 2 * _MARGIN, "#111")
        + _text(_COMPUTER_LEFT + 12, _MARGIN + 22, pins.chip.title, "bold")
        + "".join(drawn)
        + "</svg>\n"
    )


def _box(left: int, top: int, right: int, height: int, colour: str) -> str:
    return (
        f'<rect x="{left}" y="{top}" width="{right - left}" height="{height}" rx="8" '
        f'fill="#fff" stroke="{colour}" stroke-width="2"/>\n'
    )


def _text(x: int, y: int, text: str, kind: str) -> str:
    return f'<text x="{x}" y="{y}" class="{kind}">{escape(text)}</text>\n'


def _wire(y: int, colour: str) -> str:
    return f'<path d="M{_COMPUTER_RIGHT} {y}H{_DEVICE_LEFT}" stroke="{colour}" stroke-width="3"/>\n'
