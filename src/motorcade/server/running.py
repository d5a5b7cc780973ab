"""Serves an application at a socket, alone or beside other tasks of its loop; and the addresses of its pages."""

import asyncio
import ipaddress
import socket
import ssl
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager, suppress

import uvicorn
from starlette.types import ASGIApp
from uvicorn.protocols.http.auto import AutoHTTPProtocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.protocol import State

from motorcade.drive.listener import is_loopback
from motorcade.server.request_filter import ServerSettings

# So many as fifty pages open at once, and a server that somebody floods still answers.
_MOST_CONNECTIONS = 1000
_PATIENCE_S = 2
# What waits on its way to a page, in the kernel and here. Who looks at a camera, or drives, and is slow
# then misses something, and is shown nothing old.
_KERNEL_BYTES = 1 << 15
_OWN_BYTES = 1 << 14


class Server(uvicorn.Server):
    """Serves an application.

    Args:
        app: what answers.
        settings: how it is reached.
        ready: called once it answers.
        tls: for HTTPS.
    """

    def __init__(
        self, app: ASGIApp, settings: ServerSettings, ready: Callable[[], None], tls: ssl.SSLContext | None = None
    ) -> None:
        config = uvicorn.Config(
            app,
            http=_ShortQueue,
            ws=_LeavableSocket,
            log_level="warning",
            access_log=False,
            # Nobody stands between: a header that says who asks would be anybody's invention.
            proxy_headers=False,
            server_header=False,
            ws_max_size=settings.most_body,
            # Pictures don't shrink much, and thirty a second for each page would cost more than they save.
            ws_per_message_deflate=False,
            limit_concurrency=_MOST_CONNECTIONS,
            timeout_graceful_shutdown=_PATIENCE_S,
            ssl_context_factory=(lambda config, default: tls) if tls else None,
        )
        super().__init__(config)
        self._ready = ready

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Listen, and say so."""
        await super().startup(sockets)
        if self.started:
            self._ready()


def serve_alone(
    app: ASGIApp,
    settings: ServerSettings,
    listener: socket.socket,
    ready: Callable[[], None],
    tls: ssl.SSLContext | None = None,
) -> None:
    """Serve at a listening socket until Ctrl-C; ``ready`` is called once it answers."""
    with suppress(KeyboardInterrupt):
        Server(app, settings, ready, tls).run(sockets=[listener])


class _ShortQueue(AutoHTTPProtocol):  # type: ignore[misc, valid-type]  # which of two it is depends on what is installed
    def connection_made(self, transport: asyncio.Transport) -> None:
        transport.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _KERNEL_BYTES)
        transport.set_write_buffer_limits(_OWN_BYTES)
        super().connection_made(transport)


class _LeavableSocket(WebSocketsSansIOProtocol):
    def shutdown(self) -> None:
        # uvicorn would say goodbye a second time to who is just leaving, which ends the whole server with an error.
        if self.conn.state in (State.CLOSING, State.CLOSED):
            self.stop_keepalive()
            self.transport.close()
        else:
            super().shutdown()


class _EmbeddedServer(Server):
    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave signals to the program around it."""
        yield


@asynccontextmanager
async def served(
    app: ASGIApp, settings: ServerSettings, listener: socket.socket, tls: ssl.SSLContext | None = None
) -> AsyncIterator[None]:
    """Serve at a listening socket while the block runs; it answers when the block begins."""
    answers = asyncio.Event()
    server = _EmbeddedServer(app, settings, answers.set, tls)
    serving = asyncio.ensure_future(server.serve(sockets=[listener]))
    waiting = asyncio.ensure_future(answers.wait())
    try:
        await asyncio.wait((serving, waiting), return_when=asyncio.FIRST_COMPLETED)
        yield
    finally:
        waiting.cancel()
        server.should_exit = True
        await serving


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
