"""Addresses of networks, and sockets that listen at an address of this computer."""

import ipaddress
import re
import socket
import sys

from motorcade.errors import MotorcadeError

# Where a car that is driven takes commands, unless somebody chooses another port.
DRIVE_PORT = 5005

LAST_PORT = 65535
# What most systems allow without a question; macOS begins with 256.
_FILES = 1024


def host_and_port(address: str, default_port: int | None = None) -> tuple[str, int]:
    """Return the host and the port in ``HOST:PORT``; with ``default_port`` HOST alone will do. Raises MotorcadeError.

    An IPv6 address has colons of its own; with a port behind it stands in brackets. Port 0, a free one, is for a host
    that listens: not with ``default_port``.
    """
    host, colon, port = address.rpartition(":")
    if default_port is not None and (not colon or port.endswith("]") or (":" in host and not host.endswith("]"))):
        host = address
        port = str(default_port)
    host = host.strip("[]")
    least = 0 if default_port is None else 1
    is_port = re.fullmatch("[0-9]{1,5}", port) and least <= int(port) <= LAST_PORT
    if not is_port or not host or (":" in host and not _is_ipv6(host)):
        raise MotorcadeError("not-host-and-port" if default_port is None else "not-a-car", address=address)
    return host, int(port)


def _is_ipv6(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).version == 6
    except ValueError:
        return False


def port_behind(port: int) -> int:
    """Return the next port, at which a car sends telemetry unless another is named. Raises MotorcadeError."""
    if port >= LAST_PORT:
        raise MotorcadeError("no-port-behind", port=port)
    return port + 1


def listen(host: str, port: int) -> socket.socket:
    """A socket that listens at an address.

    Args:
        host: name or address; 0.0.0.0 is all.
        port: 0 takes a free one.

    Raises:
        OSError: the port is taken, or the address can't be used.
        UnicodeError: no host can have that name.
    """
    family, *_, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    bound = socket.socket(family, socket.SOCK_STREAM)
    try:
        # Windows alone has the first.
        bound.setsockopt(socket.SOL_SOCKET, getattr(socket, "SO_EXCLUSIVEADDRUSE", socket.SO_REUSEADDR), 1)
        bound.bind(address)
        # Two sockets may bind one port, but only one may listen at it.
        bound.listen(socket.SOMAXCONN)
    except OSError:
        bound.close()
        raise
    return bound


def allow_files(count: int = _FILES) -> int:
    """Let this process have ``count`` files and sockets open, as far as the system allows; return how many it may."""
    if sys.platform == "win32":
        # There a select waits for at most 512 sockets, but asyncio doesn't use it.
        return 8192
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if 0 <= soft < count:
        soft = count if hard < 0 else min(hard, count)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    return soft if soft >= 0 else 8192


def network_of(address: str) -> str:
    """Whom a connection from an address counts for: one computer may have all the addresses of an IPv6 /64 network."""
    try:
        found = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return address
    if found.version == 4:
        return str(found)
    return str(found.ipv4_mapped or ipaddress.ip_network((int(found) >> 64 << 64, 64)))


def way_out() -> str | None:
    """Return the address from which this computer sends to others; nothing is sent to find it out."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            # A documentation address (RFC 5737): connecting a datagram socket only chooses a route.
            probe.connect(("192.0.2.1", 9))
        except OSError:
            return None
        return str(probe.getsockname()[0])


def is_loopback(listener: socket.socket) -> bool:
    """Whether only this computer can reach the socket."""
    return ipaddress.ip_address(listener.getsockname()[0].partition("%")[0]).is_loopback
