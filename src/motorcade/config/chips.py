"""The pins of the supported computers: their numbers, their places on the connector, and what they can't do."""

from typing import NamedTuple

from motorcade.errors import Phrase


class Chip(NamedTuple):
    """A computer that a car may have.

    Attributes:
        name: its name in a pin file.
        title: its name for people.
        header: for each pin that a car may use, its number on the connector, or 0 where boards differ.
        input_only: pins that can be read but not driven.
        taken: pins that the computer needs for itself, each with the reason.
    """

    name: str
    title: str
    header: dict[int, int]
    input_only: frozenset[int]
    taken: dict[int, Phrase]

    def label(self, pin: int) -> str:
        """Return what to look for on the board: ``GPIO17 (11)`` is GPIO 17, the connector's pin 11."""
        place = self.header[pin]
        return f"GPIO{pin} ({place})" if place else f"GPIO{pin}"


_RASPBERRY_PI_ORDER = (
    *((2, 3), (3, 5), (4, 7), (14, 8), (15, 10), (17, 11), (18, 12), (27, 13), (22, 15), (23, 16), (24, 18), (10, 19)),
    *((9, 21), (25, 22), (11, 23), (8, 24), (7, 26), (5, 29), (6, 31), (12, 32), (13, 33), (19, 35), (16, 36)),
    *((26, 37), (20, 38), (21, 40)),
)
_PICO_ORDER = (
    *((0, 1), (1, 2), (2, 4), (3, 5), (4, 6), (5, 7), (6, 9), (7, 10), (8, 11), (9, 12), (10, 14), (11, 15), (12, 16)),
    *((13, 17), (14, 19), (15, 20), (16, 21), (17, 22), (18, 24), (19, 25), (20, 26), (21, 27), (22, 29), (26, 31)),
    *((27, 32), (28, 34)),
)
# The most lines that one gpiochip of a small computer has.
_MAX_LINES = 512
_ESP32_USABLE = (0, 2, 4, 5, *range(12, 20), *range(21, 24), *range(25, 28), *range(32, 40))

_MEMORY = Phrase("pin-of-memory")
_FLASH = Phrase("pin-of-flash")
_USB = Phrase("pin-of-usb")

CHIPS = (
    Chip(
        "raspberry-pi",
        "Raspberry Pi",
        dict(_RASPBERRY_PI_ORDER),
        frozenset(),
        {0: _MEMORY, 1: _MEMORY},
    ),
    Chip(
        "rp2040",
        "Raspberry Pi Pico (RP2040)",
        dict(_PICO_ORDER),
        frozenset(),
        {
            23: Phrase("pin-of-supply-switch"),
            24: Phrase("pin-of-usb-sensing"),
            25: Phrase("pin-of-board-led"),
            29: Phrase("pin-of-supply-measure"),
        },
    ),
    Chip(
        "esp32",
        "ESP32",
        dict.fromkeys(_ESP32_USABLE, 0),
        frozenset(range(34, 40)),
        {
            **dict.fromkeys(range(6, 12), _FLASH),
            1: _USB,
            3: _USB,
        },
    ),
    Chip("linux", "another computer with Linux", dict.fromkeys(range(_MAX_LINES), 0), frozenset(), {}),
)
