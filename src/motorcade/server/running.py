"""Serve an application at a socket, alone or beside other tasks of an event loop; make the addresses of its pages."""

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

from motorcade.server.request_filter import ServerSettings
from motorcade.sockets import is_loopback

# Fifty pages open at once need fewer. Further connections are refused, so a flood of them doesn't stop the server.
_MOST_CONNECTIONS = 1000
_PATIENCE_S = 2
# The most bytes that wait to be sent to a page, in the kernel and here: a slow page then misses pictures of a camera
# instead of showing old ones.
_KERNEL_BYTES = 1 << 15
_OWN_BYTES = 1 << 14


class Server(uvicorn.Server):
    """A uvicorn server that calls ``ready`` when it accepts requests; with ``tls`` it serves HTTPS."""

    def __init__(
        self, app: ASGIApp, settings: ServerSettings, ready: Callable[[], None], tls: ssl.SSLContext | None = None
    ) -> None:
        config = uvicorn.Config(
            app,
            http=_ShortQueue,
            ws=_ClosableSocket,
            log_level="warning",
            access_log=False,
            # There is no proxy in front, so any client could forge these headers.
            proxy_headers=False,
            server_header=False,
            ws_max_size=settings.most_body,
            # Compressing thirty pictures a second for each page costs more than it saves.
            ws_per_message_deflate=False,
            limit_concurrency=_MOST_CONNECTIONS,
            timeout_graceful_shutdown=_PATIENCE_S,
            ssl_context_factory=(lambda config, default: tls) if tls else None,
        )
        super().__init__(config)
        self._ready = ready

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Listen, then call `ready`."""
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
    """Serve at a listening socket until Ctrl-C; ``ready`` is called when it accepts requests."""
    with suppress(KeyboardInterrupt):
        Server(app, settings, ready, tls).run(sockets=[listener])


class _ShortQueue(AutoHTTPProtocol):  # type: ignore[misc, valid-type]  # one of two classes, depending on what is installed
    def connection_made(self, transport: asyncio.Transport) -> None:
        transport.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _KERNEL_BYTES)
        transport.set_write_buffer_limits(_OWN_BYTES)
        super().connection_made(transport)


class _ClosableSocket(WebSocketsSansIOProtocol):
    def shutdown(self) -> None:
        # uvicorn would close a connection that is closing already a second time; that error would end the server.
        if self.conn.state in (State.CLOSING, State.CLOSED):
            self.stop_keepalive()
            self.transport.close()
        else:
            super().shutdown()


class _EmbeddedServer(Server):
    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Handle no signals: the surrounding program does."""
        yield


@asynccontextmanager
async def serving(
    app: ASGIApp, settings: ServerSettings, listener: socket.socket, tls: ssl.SSLContext | None = None
) -> AsyncIterator[None]:
    """Serve at a listening socket while the block runs; requests are accepted when it begins."""
    answers = asyncio.Event()
    server = _EmbeddedServer(app, settings, answers.set, tls)
    task = asyncio.ensure_future(server.serve(sockets=[listener]))
    waiting = asyncio.ensure_future(answers.wait())
    try:
        await asyncio.wait((task, waiting), return_when=asyncio.FIRST_COMPLETED)
        yield
    finally:
        waiting.cancel()
        server.should_exit = True
        await task


def names_of(listener: socket.socket, host: str) -> list[str]:
    """Return the host names of the socket, which listens at ``host``; the best one to show to users is the first."""
    names = [host.lower()]
    if is_loopback(listener):
        return names
    name = socket.gethostname().lower()
    others = [name, f"{name.partition('.')[0]}.local", socket.getfqdn().lower()]
    # A page can't be opened at the unspecified address ('all addresses').
    return others + names if _address(listener).is_unspecified else names + others


def url_of(host: str, port: int, token: str | None = None, page: str = "/", scheme: str = "http") -> str:
    """Return a page's address."""
    query = f"?token={token}" if token else ""
    return f"{scheme}://{f'[{host}]' if ':' in host else host}:{port}{page}{query}"


def _address(listener: socket.socket) -> ipaddress.IPv4Address | ipaddress.IPv6Address:
    return ipaddress.ip_address(listener.getsockname()[0].partition("%")[0])
