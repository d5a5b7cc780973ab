"""List the serial ports of this computer, and guess at which of them a car is.

The USB ids are those of makers of serial converters and boards; products are listed where a maker has others that are
no serial port of a board.
"""

import os
from typing import NamedTuple

from serial.tools import list_ports
from serial.tools.list_ports_common import ListPortInfo

from motorcade.errors import MotorcadeError

# The name; its vendor's number; its products' numbers, none for all of them.
_BOARDS: tuple[tuple[str, int, tuple[int, ...]], ...] = (
    ("CH340", 0x1A86, (0x7522, 0x7523, 0x5523)),
    ("CH343", 0x1A86, (0x55D3,)),
    ("CH9102", 0x1A86, (0x55D4,)),
    ("CP210x", 0x10C4, (0xEA60, 0xEA70, 0xEA71)),
    ("FTDI", 0x0403, (0x6001, 0x6010, 0x6011, 0x6014, 0x6015)),
    ("PL2303", 0x067B, (0x2303, 0x23A3, 0x23C3, 0x23D3)),
    ("Arduino Uno", 0x2341, (0x0001, 0x0043, 0x0243)),
    ("Arduino Mega", 0x2341, (0x0010, 0x0042, 0x0242)),
    ("Arduino", 0x2341, ()),
    ("Arduino Uno", 0x2A03, (0x0043,)),
    ("Arduino Mega", 0x2A03, (0x0010, 0x0042)),
    ("Arduino", 0x2A03, ()),
    ("Raspberry Pi Pico", 0x2E8A, ()),
    ("Espressif", 0x303A, ()),
    ("Adafruit", 0x239A, ()),
    ("SparkFun", 0x1B4F, ()),
    ("Seeed", 0x2886, ()),
    ("Teensy", 0x16C0, (0x0483,)),
    ("micro:bit", 0x0D28, (0x0204,)),
    ("MicroPython", 0xF055, (0x9800,)),
    ("STM32", 0x0483, (0x5740, 0x374B, 0x374E)),
)
# What pyserial returns where nothing is known.
_NOTHING = "n/a"
_USUAL_GROUP = "dialout"

# How likely a car is at a port, the likeliest first.
BOARD, USB, OTHER, BARE = range(4)


class PortInfo(NamedTuple):
    """A serial port of this computer.

    Attributes:
        device: its name, such as /dev/ttyUSB0.
        description, hardware: what the system knows of it, or empty.
        board: the name that belongs to its USB id; empty where that is unknown.
        rank: BOARD, USB, OTHER (such as Bluetooth), or BARE for a mainboard's port, which mostly has nothing on it.
    """

    device: str
    description: str
    hardware: str
    board: str = ""
    rank: int = OTHER

    @property
    def title(self) -> str:
        """What is connected, as far as it is known."""
        if self.board in self.description:
            return self.description
        return f"{self.board} ({self.description})" if self.description else self.board


class SeveralPortsError(MotorcadeError):
    """A car may be at several ports: somebody has to choose.

    Attributes:
        ports: pairs of a device and its title.
    """

    def __init__(self, ports: list[tuple[str, str]]) -> None:
        self.ports = ports
        super().__init__("several-ports", list=", ".join(f"{device} ({title})" for device, title in ports))


def ports() -> list[PortInfo]:
    """The serial ports of this computer now, the likeliest first."""
    return sorted(map(_described, list_ports.comports()), key=lambda port: (port.rank, port.device))


def likely_port(found: list[PortInfo]) -> PortInfo:
    """The one port at which a car may be.

    Raises:
        MotorcadeError: "no-car-found", there is none.
        SeveralPortsError: there are several.
    """
    for rank in (BOARD, USB):
        likely = [port for port in found if port.rank == rank]
        if len(likely) > 1:
            raise SeveralPortsError([(port.device, port.title) for port in likely])
        if likely:
            return likely[0]
    raise MotorcadeError("no-car-found")


def group_of(device: str) -> str:
    """The group whose members may use a port of a POSIX system; the usual one where it is unknown."""
    try:
        from grp import getgrgid

        name = getgrgid(os.stat(device).st_gid).gr_name  # noqa: PTH116 - a port is no path
    except (ImportError, OSError, KeyError):
        return _USUAL_GROUP
    return _USUAL_GROUP if name == "root" else name


def _described(port: ListPortInfo) -> PortInfo:
    description, hardware = (text if text and text != _NOTHING else "" for text in (port.description, port.hwid))
    if port.vid is None:
        # A mainboard's port has its own name for a description, or none.
        bare = (description in ("", port.name) and "/rfcomm" not in port.device) or hardware.startswith("ACPI")
        return PortInfo(port.device, description, hardware, rank=BARE if bare else OTHER)
    board = _board(port.vid, port.pid or 0)
    return PortInfo(port.device, description, hardware, board, BOARD if board else USB)


def _board(vendor: int, product: int) -> str:
    return next((name for name, vid, pids in _BOARDS if vid == vendor and (not pids or product in pids)), "")
