"""Where cars are: at serial ports, at addresses of a network, in a list that somebody wrote."""

import unicodedata
from pathlib import Path
from typing import NamedTuple

from motorcade.config.cars import read_cars
from motorcade.errors import MotorcadeError, Phrase
from motorcade.sockets import DRIVE_PORT, host_and_port

CAR, DRIVE, CLASS, STUDIO = "car", "drive", "class", "studio"
# Where `motorcade car run` listens unless somebody chooses another port.
UPLOAD_PORT = 7001
_LONGEST_NAME = 40
_SCHEMES = {"socket": CAR, "drive": DRIVE}


class Place(NamedTuple):
    """Where a car is.

    Attributes:
        address: a serial port, such as /dev/ttyUSB0, or HOST:PORT.
        name: what the list or the announcement calls the car; text of a stranger, made safe by `safe_name`.
        kind: CAR, or DRIVE for a drive server.
        host, port: where it is in a network; host is empty for a serial port.
        telemetry_port: of a drive server.
        keys: the name in its keys, as it announces that; empty where it doesn't.
        found: whether it was found, and named by nobody: then it may be no car.
    """

    address: str
    name: str = ""
    kind: str = CAR
    host: str = ""
    port: int = 0
    telemetry_port: int = 0
    keys: str = ""
    found: bool = False


def place_of(address: str, name: str = "") -> Place:
    """Return the place that somebody typed.

    ``HOST:PORT`` and ``socket://HOST:PORT`` are cars, ``drive://HOST[:PORT]`` is a drive server; anything else is a
    serial port. Raises MotorcadeError for an address that can't be one.
    """
    scheme, _, rest = address.strip().rpartition("://")
    kind = _SCHEMES.get(scheme, "")
    host, _, port = rest.rpartition(":")
    # COM3 and /dev/ttyUSB0 have no colon; a path such as /dev/serial/by-id/… may.
    if not kind and (scheme or not host or rest.startswith("/") or not port.isdecimal()):
        if not rest or not address.isprintable():
            raise MotorcadeError("not-a-port-name", port=address)
        return Place(address.strip(), name)
    return network_place(*host_and_port(rest, DRIVE_PORT if kind == DRIVE else UPLOAD_PORT), name, kind or CAR)


def network_place(host: str, port: int, name: str = "", kind: str = CAR, telemetry_port: int = 0) -> Place:
    """Return a place in a network; ``telemetry_port`` of a drive server is the next port unless given."""
    shown = f"[{host}]" if ":" in host else host
    address = f"drive://{shown}:{port}" if kind == DRIVE else f"{shown}:{port}"
    return Place(address, name, kind, host, port, telemetry_port or min(port + 1, 65535))


def read_list(path: Path) -> list[Place]:
    """Return the places in a ``cars.toml``: lines of ``name = "port or address"``. Raises MotorcadeError."""
    return [place_of(address, safe_name(name)) for name, address in read_cars(path).items()]


def safe_name(text: str) -> str:
    """Return a stranger's text as a name: on one line, without characters that change others, at most 40."""
    kept = [each for each in text[: 4 * _LONGEST_NAME] if unicodedata.category(each)[0] not in "CZ" or each == " "]
    return "".join(kept).strip()[:_LONGEST_NAME]


def check_name(name: str) -> None:
    """Check a new name of a car. Raises MotorcadeError: letters of any language, digits, '-' and '_', 32 bytes."""
    letters = all(each.isalnum() or each in "-_" for each in name)
    if not letters or not 0 < len(name.encode("utf-8", "replace")) <= 32 or name.lower() == "all":
        raise MotorcadeError("bad-car-name", name=safe_name(name) or Phrase("nothing"))
