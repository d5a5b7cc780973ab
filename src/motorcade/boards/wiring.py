"""The wiring of a car, for its builders: the rows of a table and a drawing, both made from its pin file."""

from itertools import groupby
from typing import NamedTuple
from xml.sax.saxutils import escape

from motorcade.config.pins import PinMap
from motorcade.devices.declaration import Between
from motorcade.errors import Phrase

_WIDTH = 860
_COMPUTER_LEFT = 20
_COMPUTER_RIGHT = 264
_DEVICE_LEFT = 480
_DEVICE_RIGHT = 840
_MARGIN = 20
_HEADING = 44
_ROW = 24
# A row with something between the wire and GND.
_DEEP_ROW = 56
_GAP = 14
# Where components begin, how wide each is, and how far the next one is.
_FIRST = 282
_COMPONENT = 64
_STEP = 104
# People with colour blindness can tell these apart (Okabe and Ito).
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")


class WiringRow(NamedTuple):
    """One wire: the part, its terminal, the GPIO number, its label on the board, and the terminal's supply.

    ``between`` has the components from the pin to the terminal, and ``components`` says the same in words.
    """

    part: str
    terminal: str
    pin: int
    label: str
    supply: str
    components: str
    between: tuple[Between, ...]


def wiring_rows(pins: PinMap, language: str) -> list[WiringRow]:
    """Return a row for each wire. A car from a shop is wired already: it has what its wires do, and no supplies."""
    rows = []
    for wire in pins.wires:
        label = pins.chip.label(wire.pin)
        if pins.sources:
            part = Phrase(f"shop-device-{wire.device.key}").sentence(language)
            does = Phrase(f"wire-{wire.role.key}").sentence(language)
            rows.append(WiringRow(part, does, wire.pin, label, "", "", ()))
            continue
        between = wire.between(pins.chip)
        words = [Phrase(f"between-{component.kind}", value=component.value).sentence(language) for component in between]
        part = Phrase(f"device-{wire.device.key}").sentence(language)
        supply = wire.supply(pins.chip)
        components = Phrase("comma").sentence(language).join(words)
        rows.append(WiringRow(part, wire.role.terminal, wire.pin, label, supply, components, tuple(between)))
    return rows


def wiring_svg(pins: PinMap, language: str) -> str:
    """Return the wires as an SVG drawing: the computer's pins on the left, the parts on the right.

    Between them are the components that the wires need, and beside each terminal is its own supply.
    """
    drawn: list[str] = []
    top = _MARGIN + _HEADING
    parts = groupby(wiring_rows(pins, language), key=lambda row: row.part)
    for number, (part, wired) in enumerate(parts):
        rows = list(wired)
        colour = _COLOURS[number % len(_COLOURS)]
        begin = top
        top += _ROW + 3
        inside = [_text(_DEVICE_LEFT + 12, begin + 18, part, "bold")]
        # What all of its terminals need, the part needs.
        is_common = all(row.supply == rows[0].supply for row in rows)
        if is_common:
            inside.append(_text(_DEVICE_RIGHT - 12, begin + 18, rows[0].supply, "end"))
        for row in rows:
            inside += _row(row, top + 9, colour)
            if not is_common:
                inside.append(_text(_DEVICE_RIGHT - 12, top + 14, row.supply, "end"))
            depth = _DEEP_ROW
            if all(component.kind == "series" for component in row.between):
                depth = _ROW
            top += depth
        drawn += [_box(_DEVICE_LEFT, begin, _DEVICE_RIGHT, top + 3 - begin, colour), *inside]
        top += 3 + _GAP
    height = top + _MARGIN - _GAP
    title = escape(f"{pins.name}: {pins.chip.title}")
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height}" role="img" aria-label="{title}">\n'
        "<style>text{font:14px sans-serif;fill:#111}.bold{font-weight:bold}.end{text-anchor:end}"
        ".value{font-size:12px;text-anchor:middle}</style>\n"
        f'<rect width="{_WIDTH}" height="{height}" fill="#fff"/>\n'
        + _box(_COMPUTER_LEFT, _MARGIN, _COMPUTER_RIGHT, height - 2 * _MARGIN, "#111")
        + _text(_COMPUTER_LEFT + 12, _MARGIN + 22, pins.chip.title, "bold")
        + "".join(drawn)
        + "</svg>\n"
    )


def _row(row: WiringRow, y: int, colour: str) -> list[str]:
    drawn = [
        f'<path d="M{_COMPUTER_RIGHT} {y}H{_DEVICE_LEFT}" stroke="{colour}" stroke-width="3"/>\n',
        _text(_COMPUTER_RIGHT - 12, y + 5, row.label, "end"),
        _text(_DEVICE_LEFT + 12, y + 5, row.terminal, ""),
    ]
    for place, component in enumerate(row.between):
        drawn.append(_component(component, _FIRST + _STEP * place, y, colour))
    return drawn


def _component(component: Between, left: int, y: int, colour: str) -> str:
    """Draw a resistor in the wire, or one from the wire to GND, or a transistor on the wire."""
    centre = left + _COMPONENT // 2
    top = y - 9
    ground = ""
    if component.kind != "series":
        bottom = y + 32
        ground = _line(centre, y, bottom, colour) + _text(centre + 8, bottom + 6, "GND", "")
    if component.kind == "transistor":
        shape = f'<circle cx="{centre}" cy="{y}" r="18" fill="#fff" stroke="{colour}" stroke-width="2"/>\n'
        return ground + shape + _text(centre, y + 4, component.value, "value")
    if component.kind == "ground":
        top = y + 7
    return (
        ground + _box(left, top, left + _COMPONENT, 18, colour, 2) + _text(centre, top + 13, component.value, "value")
    )


def _box(left: int, top: int, right: int, height: int, colour: str, radius: int = 8) -> str:
    return (
        f'<rect x="{left}" y="{top}" width="{right - left}" height="{height}" rx="{radius}" '
        f'fill="#fff" stroke="{colour}" stroke-width="2"/>\n'
    )


def _text(x: int, y: int, text: str, kind: str) -> str:
    return f'<text x="{x}" y="{y}" class="{kind}">{escape(text)}</text>\n'


def _line(x: int, top: int, bottom: int, colour: str) -> str:
    return f'<line x1="{x}" y1="{top}" x2="{x}" y2="{bottom}" stroke="{colour}" stroke-width="2"/>\n'
