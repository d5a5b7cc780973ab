"""The serial ports of a simulated computer: which is taken for a car, and what is said of one that does not open."""

import errno
from random import Random
from types import SimpleNamespace
from typing import Any

from serial import SerialException
from tests.faults.system import replaced
from tests.faults.world import World

from motorcade.errors import MotorcadeError
from motorcade.fleet.places import CAR, DRIVE, check_name, place_of
from motorcade.upload import serial_port
from motorcade.upload.serial_port import BARE, BOARD, OTHER, USB

# Vendor and product of a port, what the system calls it, and how likely a car is there.
_PORTS = (
    (0x1A86, 0x7523, "USB Serial", BOARD),
    (0x1A86, 0x0001, "something", USB),
    (0x10C4, 0xEA60, "CP2102", BOARD),
    (0x0403, 0x6001, "FT232R", BOARD),
    (0x0403, 0x9999, "a probe", USB),
    (0x2341, 0x0043, "Arduino Uno", BOARD),
    (0x2341, 0x8036, "Arduino Leonardo", BOARD),
    (0x2E8A, 0x0005, "Board in FS mode", BOARD),
    (0x303A, 0x1001, "USB JTAG/serial debug unit", BOARD),
    (0x16C0, 0x0483, "Teensyduino", BOARD),
    (0x16C0, 0x05DC, "a keyboard", USB),
    (0xDEAD, 0xBEEF, "n/a", USB),
    (None, None, "n/a", BARE),
    (None, None, "Bluetooth", OTHER),
)
# How the system refuses a port, and what is said then.
_REFUSALS = (
    (OSError(errno.EACCES, "Permission denied"), "port-forbidden"),
    (SerialException(errno.EACCES, "could not open port: Permission denied"), "port-forbidden"),
    (SerialException("could not open port 'COM3': PermissionError(13, 'Access is denied.', None, 5)"), "port-busy"),
    (SerialException(errno.EBUSY, "Device or resource busy"), "port-busy"),
    (SerialException("Could not exclusively lock port"), "port-busy"),
    (SerialException(errno.ENOENT, "No such file or directory"), "no-such-port"),
    (OSError(errno.ENOTTY, "Inappropriate ioctl for device"), "no-serial-port"),
    (OSError(errno.EISDIR, "Is a directory"), "no-serial-port"),
)


def check_ports(room: World, random: Random) -> None:
    """Draw ports: the likeliest is taken only where it is the only one of its kind, and never a mainboard's."""
    drawn = random.sample(_PORTS, random.randint(0, 4))
    there = [_port(number, *each) for number, each in enumerate(drawn)]
    with replaced({(serial_port, "list_ports"): SimpleNamespace(comports=lambda: there)}):
        found = serial_port.ports()
        ranks = {f"/dev/tty{number}": rank for number, (*_, rank) in enumerate(drawn)}
        told = {port.device: port.rank for port in found}
        room.keep("finds-ports", told == ranks, f"{told}, not {ranks}")
        room.keep("finds-ports", [port.rank for port in found] == sorted(ranks.values()), f"{told} isn't in order")
        best = min(ranks.values(), default=BARE)
        alike = [device for device, rank in ranks.items() if rank == best]
        try:
            outcome = serial_port.likely_port(found).device
        except serial_port.SeveralPortsError as problem:
            outcome = "several"
            room.keep("finds-ports", sorted(device for device, _ in problem.ports) == sorted(alike), f"{problem.ports}")
        except MotorcadeError as problem:
            outcome = problem.code
        wanted = alike[0] if len(alike) == 1 else "several"
        if best not in (BOARD, USB):
            wanted = "no-car-found"
        room.keep("finds-ports", outcome == wanted, f"{outcome} is taken of {ranks}, not {wanted}")
    problem, code = random.choice(_REFUSALS)
    said = serial_port.open_error("/dev/ttyUSB0", problem)
    room.keep("says-why", said.code == code, f"{problem!r} is {said.code}, not {code}")


# What somebody types or lists, and the kind, the host and the port that are meant; None for a serial port.
_PLACES: tuple[tuple[str, tuple[str, str, int] | None], ...] = (
    ("10.0.0.2:7001", (CAR, "10.0.0.2", 7001)),
    ("socket://10.0.0.2:7002", (CAR, "10.0.0.2", 7002)),
    ("drive://10.0.0.2", (DRIVE, "10.0.0.2", 5005)),
    ("drive://10.0.0.2:6000", (DRIVE, "10.0.0.2", 6000)),
    ("ada.local:7001", (CAR, "ada.local", 7001)),
    ("[fe80::1]:7001", (CAR, "fe80::1", 7001)),
    ("/dev/ttyUSB0", None),
    ("COM3", None),
    ("/dev/serial/by-id/usb:1", None),
)
_NO_PLACES = ("", "  ", "a\x1b[2Jb", "drive://10.0.0.2:99999", "socket://10.0.0.2:0x1")
_NAMES, _NO_NAMES = ("ada", "bo-2", "李_雷", "x" * 32), ("", "all", "ALL", "a b", "a.b", "x" * 33, "a\n", "<b>")


def check_places(room: World, random: Random) -> None:
    """What somebody types leads where it says, and nonsense is a sentence."""
    typed, wanted = random.choice(_PLACES)
    place = place_of(typed, "a name")
    found = (place.kind, place.host, place.port) if place.host else None
    room.keep("found", found == wanted and place.name == "a name" and not place.found, f"{typed} is {place}")
    typed = random.choice(_NO_PLACES)
    try:
        place = place_of(typed)
    except MotorcadeError as problem:
        room.keep("found", bool(problem.sentence()), problem.code)
    else:
        room.keep("found", False, f"{typed!r} is {place}")
    for name, is_allowed in ((random.choice(_NAMES), True), (random.choice(_NO_NAMES), False)):
        try:
            check_name(name)
            outcome = True
        except MotorcadeError:
            outcome = False
        room.keep("found", outcome == is_allowed, f"a car may be called {name!r}: {outcome}")


def _port(number: int, vid: int | None, pid: int | None, description: str, rank: int) -> Any:
    name = f"tty{number}"
    told = name if rank == BARE and number % 2 else description
    return SimpleNamespace(device=f"/dev/{name}", name=name, description=told, hwid="n/a", vid=vid, pid=pid)
