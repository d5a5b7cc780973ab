"""Lets connections in: so many at once and no more, whoever floods the door, and those inside undisturbed."""

import asyncio
import socket
import ssl
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import suppress

HANDSHAKE_S = 2.0
MOST_AT_ONCE = 64
MOST_OF_ONE_ADDRESS = 16
# What a client sends waits in the kernel at most, so that a stall leaves few old commands; what it is sent, likewise.
_KERNEL_BYTES = 1 << 13
_BACKLOG = 64
_OUT_OF_SOCKETS_S = 0.1
# A peer that is gone without a word is noticed in ten seconds where the system allows to say so.
_KEEPALIVE = (("TCP_KEEPIDLE", 4), ("TCP_KEEPINTVL", 2), ("TCP_KEEPCNT", 3))


class ClientProtocol(asyncio.BaseProtocol, ABC):
    """The protocol of a connection that a door let in."""

    def __init__(self, left: Callable[["ClientProtocol"], None]) -> None:
        self.line: asyncio.Transport | None = None
        self._left = left

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.line = transport  # type: ignore[assignment]

    def connection_lost(self, exc: Exception | None) -> None:
        self.line = None
        self._left(self)

    @abstractmethod
    def is_seated(self) -> bool:
        """Whether it may stay when others want its place."""

    def drop(self) -> None:
        """End the connection at once, if it has begun."""
        if self.line:
            self.line.abort()


class _Slot:
    def __init__(self, address: str, guest: ClientProtocol) -> None:
        self.address = address
        self.guest = guest
        self.opening: asyncio.Task[None] | None = None

    def end(self) -> None:
        if self.opening:
            self.opening.cancel()
        self.guest.drop()


class Listener:
    """One listening socket.

    Newcomers beyond the limits take the place of who came before them and isn't seated: of their own address
    first. So those who drive or watch stay, and one who comes to drive gets in while somebody floods the door.

    Args:
        listener: bound, listening or not.
        make_guest: makes the protocol of a connection, given what it has to call when it has lost its connection.
        turned_away: called for each connection that got or kept no place, or failed to show who it is.
        tls: for connections by TLS.
    """

    def __init__(
        self,
        listener: socket.socket,
        make_guest: Callable[[Callable[[ClientProtocol], None]], ClientProtocol],
        turned_away: Callable[[], None],
        tls: ssl.SSLContext | None = None,
    ) -> None:
        self._listener = listener
        self._make_guest = make_guest
        self._tls = tls
        self._turned_away = turned_away
        self._visits: dict[ClientProtocol, _Slot] = {}
        listener.setblocking(False)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _KERNEL_BYTES)
        listener.listen(_BACKLOG)

    @property
    def address(self) -> tuple[str, int]:
        """Host and port at which it listens."""
        host, port = self._listener.getsockname()[:2]
        return str(host), int(port)

    async def serve(self) -> None:
        """Let in until cancelled; then everybody inside is dropped."""
        try:
            while True:
                try:
                    line, address = await self._next()
                except OSError:
                    # Out of sockets: those inside go on, and some will leave.
                    await asyncio.sleep(_OUT_OF_SOCKETS_S)
                    continue
                self._welcome(line, str(address[0]))
                # While newcomers wait sock_accept doesn't, and those inside would.
                await asyncio.sleep(0)
        finally:
            self._listener.close()
            for visit in list(self._visits.values()):
                visit.end()

    async def _next(self) -> tuple[socket.socket, tuple[str, int]]:
        """The next one who comes. Raises OSError."""
        accepting = asyncio.ensure_future(asyncio.get_running_loop().sock_accept(self._listener))
        try:
            return await asyncio.shield(accepting)
        except asyncio.CancelledError:
            # Who came in this very moment would be lost with the task, and never hear the end of it.
            await asyncio.sleep(0)
            if accepting.done() and accepting.exception() is None:
                accepting.result()[0].close()
            accepting.cancel()
            raise

    def shut(self) -> None:
        """Let nobody in any more; to be called before ``serve`` is cancelled."""
        # A selector's loop would accept one more for a cancelled sock_accept, and lose it; Windows' has no readers.
        with suppress(NotImplementedError):
            asyncio.get_running_loop().remove_reader(self._listener)

    def _welcome(self, line: socket.socket, address: str) -> None:
        if not self._make_room(address):
            self._turned_away()
            line.close()
            return
        with suppress(OSError):
            _prepare(line)
        visit = _Slot(address, self._make_guest(self._left))
        self._visits[visit.guest] = visit
        visit.opening = asyncio.ensure_future(self._open(line, visit.guest))
        visit.opening.add_done_callback(lambda opening: self._opened(opening, line, visit))

    def _left(self, guest: ClientProtocol) -> None:
        self._visits.pop(guest, None)

    def _make_room(self, address: str) -> bool:
        """End visits until there is a place: False where all are seated."""
        visits = list(self._visits.values())
        alike = [visit for visit in visits if visit.address == address]
        for candidates, most in ((alike, MOST_OF_ONE_ADDRESS), (visits, MOST_AT_ONCE)):
            if len(candidates) < most:
                continue
            oldest = next((visit for visit in candidates if not visit.guest.is_seated()), None)
            if oldest is None:
                return False
            self._turned_away()
            del self._visits[oldest.guest]
            oldest.end()
            return True
        return True

    async def _open(self, line: socket.socket, guest: ClientProtocol) -> None:
        timeout_s = HANDSHAKE_S if self._tls else None
        await asyncio.get_running_loop().connect_accepted_socket(
            lambda: guest, line, ssl=self._tls, ssl_handshake_timeout=timeout_s, ssl_shutdown_timeout=timeout_s
        )

    def _opened(self, opening: asyncio.Task[None], line: socket.socket, visit: _Slot) -> None:
        visit.opening = None
        if opening.cancelled():
            line.close()
        elif problem := opening.exception():
            # Wrong certificates, no TLS at all, or gone again.
            if not isinstance(problem, OSError):
                raise problem
            self._turned_away()
            self._left(visit.guest)


def _prepare(line: socket.socket) -> None:
    line.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _KERNEL_BYTES)
    line.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in _KEEPALIVE:
        if hasattr(socket, name):
            line.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)
