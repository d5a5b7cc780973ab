"""Where a car listens, and who can reach it there."""

import errno
import ipaddress
import socket

from motorcade.errors import Sentences, ToldError

_WHO = {"car": {"en": "car", "zh": "小车"}, "remote": {"en": "remote", "zh": "遥控页面"}}
_SENTENCES: Sentences = {
    "no-address": {
        "en": "--host {host} is no address of this computer; 127.0.0.1 is, 0.0.0.0 is all",
        "zh": "--host {host} 不是这台电脑的地址；127.0.0.1 是，0.0.0.0 表示所有地址",
    },
    "taken": {
        "en": "port {port} is taken. Perhaps this {who} is served already; else name another",
        "zh": "端口 {port} 已被占用。{who}可能已在运行；否则请换一个端口",
    },
    "unusable": {
        "en": "the {who} can't listen at {host} port {port}: {reason}; name another",
        "zh": "{who}无法监听 {host} 的端口 {port}：{reason}；请换一个",
    },
}


class AddressError(ToldError, OSError):
    """An address that can't be listened at; the sentence says what to do."""

    SENTENCES = _SENTENCES


def bind(host: str, port: int, who: str = "car") -> socket.socket:
    """A socket at the address, which doesn't listen yet; port 0 takes a free one. Raises AddressError of ``who``."""
    try:
        family, *_, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    except (socket.gaierror, UnicodeError):
        raise AddressError("no-address", host=host[:60]) from None
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
            raise AddressError("taken", port=port, who=_WHO[who]) from None
        reason = problem.strerror or type(problem).__name__
        raise AddressError("unusable", who=_WHO[who], host=host[:60], port=port, reason=reason) from None
    return bound


def is_loopback(listener: socket.socket) -> bool:
    """Whether only this computer can reach the socket."""
    return ipaddress.ip_address(listener.getsockname()[0].partition("%")[0]).is_loopback
