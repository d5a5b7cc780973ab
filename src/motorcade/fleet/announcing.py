"""Announce a car, a drive server, a class or a studio by multicast DNS (RFC 6762, 6763)."""

import ipaddress
import re
import socket
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import TYPE_CHECKING

from motorcade.errors import MotorcadeError
from motorcade.extras import install_command
from motorcade.fleet.places import CAR
from motorcade.sockets import way_out

if TYPE_CHECKING:
    from zeroconf import Zeroconf

SERVICE = "_motorcade._tcp.local."
# So much of a name, since a text of DNS has at most 255 bytes.
_MOST_OF_A_NAME = 60


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
        properties: more for those who find it, as `motorcade.fleet.places.Place` has it: ``telemetry``, ``keys``.
    """
    host, port = listener
    address = ipaddress.ip_address(host.partition("%")[0])
    if address.is_loopback and not on_loopback:
        yield
        return
    host = (way_out() if address.is_unspecified else None) or host
    # A car says its own name, which may change.
    name = "" if kind == CAR else name or socket.gethostname()
    text = {"kind": kind, "name": name[:_MOST_OF_A_NAME]} | {key: str(value) for key, value in properties.items()}
    label = "-".join(re.findall(r"\w+", f"{kind} {host} {port}"))

    def register() -> "Zeroconf | None":
        network = None
        try:
            from zeroconf import ServiceInfo, Zeroconf

            network = Zeroconf(interfaces=[host])
            server = f"motorcade-{label}.local."
            info = ServiceInfo(SERVICE, f"{label}.{SERVICE}", port, 0, 0, text, server, parsed_addresses=[host])
            network.register_service(info, allow_name_change=True)
        except ModuleNotFoundError:
            problem(MotorcadeError("announcing-needs-zeroconf", command=install_command("fleet")))
        except Exception as found:  # noqa: BLE001 - whatever the network's stack raises, the car runs on
            problem(MotorcadeError("not-announced", reason=str(found) or type(found).__name__))
        return network

    # In the background, since asking whether the name is free takes a second.
    with ThreadPoolExecutor(1) as background:
        registering = background.submit(register)
        try:
            yield
        finally:
            if network := registering.result():
                network.close()
