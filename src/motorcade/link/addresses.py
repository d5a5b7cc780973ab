"""Where a car listens, and who can reach it there."""

import errno
import ipaddress
import socket


class AddressError(OSError):
    """An address that can't be listened at; the sentence says what to do."""


def bind(host: str, port: int, who: str = "car") -> socket.socket:
    """A socket at the address, which doesn't listen yet; port 0 takes a free one. Raises AddressError of ``who``."""
    try:
        family, *_, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    except (socket.gaierror, UnicodeError):
        raise AddressError(f"--host {host[:60]} is no address of this computer; 127.0.0.1 is, 0.0.0.0 is all") from None
    bound = socket.socket(family, socket.SOCK_STREAM)
    try:
        if hasattr(socket, "SO_EXCLUSIVEADDRUSE"):
            bound.setsockopt(socket.SOL_SOCKET, socket.SO_EXCLUSIVEADDRUSE, 1)
        else:
            bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        bound.bind(address)
        # Two may share a port that they have bound, but not one that they listen at.
        bound.listen()
    except OSError as problem:
        bound.close()
        if problem.errno == errno.EADDRINUSE:
            raise AddressError(
                f"port {port} is taken. Perhaps this {who} is served already; else name another"
            ) from None
        reason = problem.strerror or type(problem).__name__
        raise AddressError(f"the {who} can't listen at {host[:60]} port {port}: {reason}; name another") from None
    return bound


def is_loopback(listener: socket.socket) -> bool:
    """Whether only this computer can reach the socket."""
    return ipaddress.ip_address(listener.getsockname()[0].partition("%")[0]).is_loopback
