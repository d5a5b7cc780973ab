"""Where cars are: at serial ports, at addresses of a network, in a list that somebody wrote; and what announces them.

Announcements are multicast DNS (RFC 6762, 6763).
"""

import ipaddress
import re
import socket
import unicodedata
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import NamedTuple

from motorcade.config.files import parse, read_text
from motorcade.errors import MotorcadeError, Phrase, TransferError
from motorcade.extras import install_command
from motorcade.sockets import DRIVE_PORT, host_and_port, port_behind, way_out

SERVICE = "_motorcade._tcp.local."
CAR = "car"
DRIVE = "drive"
CLASS = "class"
STUDIO = "studio"
# Where `motorcade car run` listens unless somebody chooses another port.
UPLOAD_PORT = 7001
_LONGEST_NAME = 40
# So much of a name is announced, since a text of DNS has at most 255 bytes.
_LONGEST_ANNOUNCED = 60
_SCHEMES = {"socket": CAR, "drive": DRIVE}


class Place(NamedTuple):
    """Where a car is.

    Attributes:
        address: a serial port, such as /dev/ttyUSB0, or HOST:PORT.
        name: what the list or the announcement calls the car; text of a stranger, made safe by `safe_name`.
        kind: CAR, or DRIVE for a drive server; what announces itself may say anything.
        host, port: where it is in a network; host is empty for a serial port.
        telemetry_port: of a drive server.
        found: whether it was found, and named by nobody: then it may be no car.
    """

    address: str
    name: str = ""
    kind: str = CAR
    host: str = ""
    port: int = 0
    telemetry_port: int = 0
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
            raise TransferError("not-a-port-name", port=address)
        return Place(address.strip(), name)
    return network_place(*host_and_port(rest, DRIVE_PORT if kind == DRIVE else UPLOAD_PORT), name, kind or CAR)


def network_place(host: str, port: int, name: str = "", kind: str = CAR, telemetry_port: int = 0) -> Place:
    """Return a place in a network; ``telemetry_port`` of a drive server is the next port unless given.

    Raises MotorcadeError where there is no next port.
    """
    address = f"{host}:{port}"
    if ":" in host:
        address = f"[{host}]:{port}"
    if kind == DRIVE:
        address = f"drive://{address}"
        telemetry_port = telemetry_port or port_behind(port)
    return Place(address, name, kind, host, port, telemetry_port)


def read_list(path: Path) -> list[Place]:
    """Return the places in a ``cars.toml``: lines of ``name = "port or address"``. Raises MotorcadeError."""
    places: dict[str, Place] = {}
    for name, address in parse(read_text(path, str(path)), "TOML", str(path)).items():
        if not isinstance(address, str):
            raise MotorcadeError("car-list-value", file=path, name=name)
        if address in places:
            raise MotorcadeError("car-list-twice", file=path, address=address)
        places[address] = place_of(address, safe_name(name))
    return list(places.values())


def list_text(cars: Iterable[tuple[str, str]]) -> str:
    """Return the text of such a list; ``cars`` are names, and ports or addresses."""
    quoted = ((name.replace("\\", "\\\\").replace('"', '\\"'), address) for name, address in cars)
    return "".join(f'"{name}" = "{address}"\n' for name, address in quoted)


def safe_name(text: str) -> str:
    """Return a stranger's text as a name: on one line, without characters that change others, at most 40."""
    kept = [
        character
        for character in text[: 4 * _LONGEST_NAME]
        if unicodedata.category(character)[0] not in "CZ" or character == " "
    ]
    return "".join(kept).strip()[:_LONGEST_NAME]


def check_name(name: str) -> None:
    """Check a new name of a car. Raises MotorcadeError: letters of any language, digits, '-' and '_', 32 bytes."""
    letters = all(character.isalnum() or character in "-_" for character in name)
    if not letters or not 0 < len(name.encode("utf-8", "replace")) <= 32 or name.lower() == "all":
        raise MotorcadeError("bad-car-name", name=safe_name(name) or Phrase("nothing"))


@contextmanager
def announced(
    kind: str,
    name: str,
    listener: tuple[str, int],
    problem: Callable[[MotorcadeError], None] = lambda found: None,
    on_loopback: bool = False,
    **properties: object,
) -> Iterator[None]:
    """Announce a car, a drive server, a class or a studio while the block runs.

    Args:
        kind: CAR, DRIVE, CLASS or STUDIO.
        name: what people call it.
        listener: the address and the port where it listens. What only this computer reaches is announced to nobody,
            except with ``on_loopback``.
        problem: called in another thread where that isn't possible; others then need a list.
        properties: more for those who find it: ``telemetry``, the port of a drive server; ``keys``, the name in them.
    """
    host, port = listener
    address = ipaddress.ip_address(host.partition("%")[0])
    if address.is_loopback and not on_loopback:
        yield
        return
    host = (way_out() if address.is_unspecified else None) or host
    # A car says its own name, which may change.
    if kind == CAR:
        name = ""
    else:
        name = name or socket.gethostname()
    text = {"kind": kind, "name": name[:_LONGEST_ANNOUNCED]} | {key: str(value) for key, value in properties.items()}
    label = "-".join(re.findall(r"\w+", f"{kind} {host} {port}"))

    server = f"motorcade-{label}.local."
    announcing = ExitStack()

    def register() -> None:
        try:
            announcing.enter_context(registered(SERVICE, label, port, text, server, [host], allow_name_change=True))
        except ModuleNotFoundError:
            problem(MotorcadeError("announcing-needs-zeroconf", command=install_command("fleet")))
        except Exception as found:  # noqa: BLE001 - whatever the network's stack raises, the car runs on
            problem(MotorcadeError("not-announced", reason=str(found) or type(found).__name__))

    # In the background, since asking whether the name is free takes a second.
    with ThreadPoolExecutor(1) as background:
        registering = background.submit(register)
        try:
            yield
        finally:
            registering.result()
            announcing.close()


@contextmanager
def registered(
    service: str,
    label: str,
    port: int,
    properties: dict[str, str],
    server: str,
    hosts: list[str],
    allow_name_change: bool = False,
) -> Iterator[None]:
    """Announce a service by multicast DNS while the block runs; asking whether its name is free takes a second.

    Args:
        service: its kind, such as `SERVICE`.
        label: its name in front of that; ``allow_name_change`` numbers it where the network has one of that name.
        port: where it listens.
        properties: more for those who find it.
        server: the name that stands for ``hosts``, with a dot at its end.
        hosts: the addresses of this computer that are announced, each at its own interface.

    Raises:
        ModuleNotFoundError: zeroconf isn't installed.
        zeroconf.NonUniqueNameException: the name is taken.
        OSError, RuntimeError: an interface can't do it, or is gone.
    """
    from zeroconf import ServiceInfo, Zeroconf

    full_name = f"{label}.{service}"
    info = ServiceInfo(service, full_name, port, properties=properties, server=server, parsed_addresses=hosts)
    with closing(Zeroconf(interfaces=hosts)) as network:
        network.register_service(info, allow_name_change=allow_name_change)
        yield
