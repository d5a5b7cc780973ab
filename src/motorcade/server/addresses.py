"""Where a server is reached: the names of its address, and how a page is opened there."""

import ipaddress
import socket

from motorcade.drive.listener import is_loopback


def names_of(listener: socket.socket, host: str) -> list[str]:
    """The names by which pages may reach the socket, which listens at ``host``; the best to show is the first."""
    names = [host.lower()]
    if is_loopback(listener):
        return names
    name = socket.gethostname().lower()
    others = [name, f"{name.partition('.')[0]}.local", socket.getfqdn().lower()]
    # 'All addresses' is none that a page could be opened at.
    return others + names if _address(listener).is_unspecified else names + others


def url_of(host: str, port: int, token: str | None = None, page: str = "/", scheme: str = "http") -> str:
    """A page's address."""
    shown = f"?token={token}" if token else ""
    return f"{scheme}://{f'[{host}]' if ':' in host else host}:{port}{page}{shown}"


def _address(listener: socket.socket) -> ipaddress.IPv4Address | ipaddress.IPv6Address:
    return ipaddress.ip_address(listener.getsockname()[0].partition("%")[0])
