"""Where cars are: at serial ports, at addresses of a network, in a list that somebody wrote."""

import unicodedata
from pathlib import Path
from typing import NamedTuple

from motorcade.config.files import parse, read_text
from motorcade.errors import MotorcadeError, Phrase
from motorcade.sockets import DRIVE_PORT, host_and_port

CAR, DRIVE, CLASS, STUDIO = "car", "drive", "class", "studio"
# Where `motorcade car run` listens unless somebody chooses another port.
UPLOAD_PORT = 7001
_LONGEST_NAME = 40
_SCHEMES = {"socket://": CAR, "drive://": DRIVE}


class Place(NamedTuple):
    """Where a car is.

    Attributes:
        address: a serial port, such as /dev/ttyUSB0, or HOST:PORT.
        name: what the list or the announcement calls the car; text of a stranger, made safe by `safe_name`.
        kind: CAR, or DRIVE for a drive server.
        host: where it is at a network; empty for a serial port.
        port: of a network.
        telemetry_port: of a drive server.
    """

    address: str
    name: str = ""
    kind: str = CAR
    host: str = ""
    port: int = 0
    telemetry_port: int = 0


def place_of(address: str, name: str = "") -> Place:
    """Return the place that somebody typed.

    ``HOST:PORT`` and ``socket://HOST:PORT`` are cars, ``drive://HOST[:PORT]`` is a drive server; anything else is a
    serial port. Raises MotorcadeError for an address that can't be one.
    """
    kind, rest = "", address.strip()
    for scheme, meant in _SCHEMES.items():
        if rest.startswith(scheme):
            kind, rest = meant, rest.removeprefix(scheme)
    host, _, port = rest.rpartition(":")
    # COM3 and /dev/ttyUSB0 have no colon; a path such as /dev/serial/by-id/… may.
    if not kind and (not host or rest.startswith("/") or not port.isdecimal()):
        if not rest or not rest.isprintable():
            raise MotorcadeError("not-a-port-name", port=rest)
        return Place(rest, name)
    return network_place(*host_and_port(rest, DRIVE_PORT if kind == DRIVE else UPLOAD_PORT), name, kind or CAR)


def network_place(host: str, port: int, name: str = "", kind: str = CAR, telemetry_port: int = 0) -> Place:
    """Return a place in a network; ``telemetry_port`` of a drive server is the next port unless given."""
    shown = f"[{host}]" if ":" in host else host
    address = f"drive://{shown}:{port}" if kind == DRIVE else f"{shown}:{port}"
    return Place(address, name, kind, host, port, telemetry_port or min(port + 1, 65535))


def read_list(path: Path) -> list[Place]:
    """Return the places in a ``cars.toml``: lines of ``name = "port or address"``. Raises MotorcadeError."""
    document = parse(read_text(path, str(path)), "TOML", str(path))
    places = []
    for name, address in document.items():
        if not isinstance(address, str):
            raise MotorcadeError("car-list-value", file=path, name=name)
        places.append(place_of(address, safe_name(name)))
    addresses = [place.address for place in places]
    for place in places:
        if addresses.count(place.address) > 1 and len(addresses) < 100:
            raise MotorcadeError("car-list-twice", file=path, address=place.address)
    return places


def list_text(places: list[Place]) -> str:
    """Return the text of a ``cars.toml`` with these places."""
    quoted = [(place.name.replace("\\", "\\\\").replace('"', '\\"'), place.address) for place in places]
    return "".join(f'"{name}" = "{address}"\n' for name, address in quoted)


def safe_name(text: str) -> str:
    """Return a stranger's text as a name: on one line, without characters that change others, at most 40."""
    kept = [each for each in text[: 4 * _LONGEST_NAME] if unicodedata.category(each)[0] not in "CZ" or each == " "]
    return "".join(kept).strip()[:_LONGEST_NAME]


def check_name(name: str) -> None:
    """Check a new name of a car. Raises MotorcadeError: letters of any language, digits, '-' and '_', 32 bytes."""
    letters = all(each.isalnum() or each in "-_" for each in name)
    if not letters or not 0 < len(name.encode("utf-8", "replace")) <= 32 or name.lower() == "all":
        raise MotorcadeError("bad-car-name", name=safe_name(name) or Phrase("nothing"))
