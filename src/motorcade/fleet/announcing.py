"""Announce a car, a drive server, a class or a studio by multicast DNS (RFC 6762, 6763)."""

import ipaddress
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from motorcade.errors import MotorcadeError
from motorcade.extras import install_command
from motorcade.sockets import way_out

if TYPE_CHECKING:
    from zeroconf import Zeroconf

SERVICE = "_motorcade._tcp.local."
# A label of DNS has at most 63 bytes.
_LABEL_BYTES = 63


@contextmanager
def announced(
    kind: str,
    name: str,
    listener: tuple[str, int],
    problem: Callable[[MotorcadeError], None] = lambda found: None,
    on_loopback: bool = False,
    **properties: object,
) -> Iterator[None]:
    """Announce a car, a drive server, a class or a studio while the block runs, in a thread of its own.

    Args:
        kind: CAR, DRIVE, CLASS or STUDIO.
        name: what people call it.
        listener: the address and the port where it listens. What only this computer reaches is announced to nobody,
            except with ``on_loopback``.
        problem: called where that isn't possible; others then need a list.
        properties: more for those who find it, such as ``telemetry``.
    """
    host, port = listener
    address = ipaddress.ip_address(host.partition("%")[0])
    if address.is_loopback and not on_loopback:
        yield
        return
    if address.is_unspecified:
        host = way_out() or host
    ended = threading.Event()
    text = {
        "kind": kind,
        "name": name or ("" if kind == "car" else socket.gethostname()),
        **{key: str(value) for key, value in properties.items()},
    }

    def announce() -> None:
        try:
            network = _registered(text, host, port)
        except ModuleNotFoundError:
            problem(MotorcadeError("announcing-needs-zeroconf", command=install_command("fleet")))
            return
        except Exception as found:  # noqa: BLE001 - whatever the network's stack raises, the car runs on
            problem(MotorcadeError("not-announced", reason=str(found) or type(found).__name__))
            return
        ended.wait()
        network.close()

    thread = threading.Thread(target=announce, name="announcement", daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join(timeout=2)


def _registered(text: dict[str, str], host: str, port: int) -> "Zeroconf":
    from zeroconf import ServiceInfo, Zeroconf

    title = f"{text['kind']} {text['name'] or socket.gethostname()} {port}".replace(".", "-")
    label = title.encode()[:_LABEL_BYTES].decode(errors="ignore")
    server = f"motorcade-{''.join(each if each.isalnum() else '-' for each in host)}.local."
    info = ServiceInfo(SERVICE, f"{label}.{SERVICE}", port, 0, 0, text, server, parsed_addresses=[host])
    network = Zeroconf(interfaces=[host])
    try:
        network.register_service(info, allow_name_change=True)
    except BaseException:
        network.close()
        raise
    return network
