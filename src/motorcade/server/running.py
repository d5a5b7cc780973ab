"""Serve an application at a socket, alone or beside other tasks of an event loop; make the addresses of its pages."""

import asyncio
import ipaddress
import logging
import socket
import ssl
import sys
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager, suppress
from typing import Any

import h11
import uvicorn
from starlette.types import ASGIApp
from uvicorn._types import ASGISendEvent
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.utils import ClientDisconnected
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from uvicorn.server import ServerState
from websockets.frames import Frame
from websockets.protocol import State

from motorcade.drive.listener import Listener, Places
from motorcade.server.request_filter import ServerSettings
from motorcade.sockets import is_loopback, most_files
from motorcade.timing import RateLimit, to_ticks

_PATIENCE_S = 2
# A connection may wait so long for a whole request, its body included.
REQUEST_S = 30.0
# A WebSocket is asked so often whether it is still there, and has so long to answer.
PING_S = 20.0
# Thirty pages with seven connections each need half of these; one computer may have fifteen pages open.
_PLACES = Places(512, 128)
# So many files are kept for the rest of the program: cars, cameras, serial ports, projects.
_KEPT_FILES = 256
# Of the server's warnings so many are printed in a minute: a stranger can cause any number of them.
_WARNINGS_A_MINUTE = 10
# Pings and pongs that a page may send in a minute, and parts of messages that it divided. Browsers answer three pings a
# minute; a message of the largest size has 16 parts or more.
CONTROLS_A_MINUTE = 300
FRAGMENTS_A_MINUTE = 6000
# A thread that computes lets others run after so long. A picture needs five turns or so, and three threads may compute:
# with Python's own 5 ms a page would wait 75 ms for each.
_TURN_S = 0.0005
_LOGGERS = ("asyncio", "uvicorn.error")
# The most bytes that wait to be sent to a page, in the kernel and here: a slow page then misses pictures of a camera
# instead of showing old ones.
_KERNEL_BYTES = 1 << 15
_OWN_BYTES = 1 << 14


class Server(uvicorn.Server):
    """A uvicorn server that calls ``ready`` when it accepts requests; with ``tls`` it serves HTTPS.

    It accepts connections as a car does (`motorcade.drive.listener`): where too many are open, a newcomer replaces the
    oldest one without a request.
    """

    def __init__(
        self, app: ASGIApp, settings: ServerSettings, ready: Callable[[], None], tls: ssl.SSLContext | None = None
    ) -> None:
        config = uvicorn.Config(
            app,
            http=_PageConnection,
            ws=_PageWebSocket,
            log_level="warning",
            access_log=False,
            # There is no proxy in front, so any client could forge these headers.
            proxy_headers=False,
            server_header=False,
            ws_max_size=settings.most_body,
            # Compressing thirty pictures a second for each page costs more than it saves.
            ws_per_message_deflate=False,
            ws_ping_interval=PING_S,
            ws_ping_timeout=PING_S,
            timeout_graceful_shutdown=_PATIENCE_S,
        )
        super().__init__(config)
        self._ready = ready
        self._tls = tls
        self._listeners: list[Listener] = []
        self._accepting: list[asyncio.Task[None]] = []
        self._limits = _FewWarnings(settings.clock)

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Listen, then call `ready`."""
        for name in _LOGGERS:
            logging.getLogger(name).addFilter(self._limits)
        # Without sockets uvicorn begins everything else.
        await super().startup([])
        places = Places(min(_PLACES.most, most_files() - _KEPT_FILES), _PLACES.most_of_one_address)
        self._listeners = [Listener(each, self._connection, lambda: None, self._tls, places) for each in sockets or []]
        self._accepting = [asyncio.create_task(each.serve()) for each in self._listeners]
        self._ready()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Accept nobody any more, let the present requests end, and drop all connections."""
        for listener in self._listeners:
            listener.close_to_newcomers()
        for task in self._accepting:
            task.cancel()
        await asyncio.gather(*self._accepting, return_exceptions=True)
        await super().shutdown()
        for listener in self._listeners:
            listener.drop_all()
        for name in _LOGGERS:
            logging.getLogger(name).removeFilter(self._limits)

    def _connection(self, closed: Callable[[], None]) -> "_PageConnection":
        return _PageConnection(self.config, self.server_state, self.lifespan.state, closed)


def serve_alone(
    app: ASGIApp,
    settings: ServerSettings,
    listener: socket.socket,
    ready: Callable[[], None],
    tls: ssl.SSLContext | None = None,
) -> None:
    """Serve at a listening socket until Ctrl-C; ``ready`` is called when it accepts requests."""
    sys.setswitchinterval(_TURN_S)
    with suppress(KeyboardInterrupt):
        Server(app, settings, ready, tls).run(sockets=[listener])


class _PageConnection(H11Protocol):
    """A connection of a browser, until it becomes a WebSocket; its queue is short, and a request has to come in time.

    ``closed`` is called when the connection is lost, also as a WebSocket.
    """

    def __init__(
        self, config: uvicorn.Config, state: ServerState, app_state: dict[str, Any], closed: Callable[[], None]
    ) -> None:
        super().__init__(config, state, app_state)
        self._closed = closed
        self._is_socket = False
        self._deadline: asyncio.TimerHandle | None = None

    def has_session(self) -> bool:
        """Whether a request is in work, or the page has a WebSocket."""
        return self._is_socket or (self.cycle is not None and not self.cycle.response_complete)

    def drop(self) -> None:
        if self.transport:
            self.transport.abort()

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]  # uvicorn's own type
        transport.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _KERNEL_BYTES)
        transport.set_write_buffer_limits(_OWN_BYTES)
        super().connection_made(transport)
        self._await_request()

    def connection_lost(self, exc: Exception | None) -> None:
        self._end_deadline()
        super().connection_lost(exc)
        self._closed()

    def handle_events(self) -> None:
        super().handle_events()
        if self._is_socket or (self.cycle is not None and not self.cycle.more_body):
            self._end_deadline()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        self._is_socket = True
        super().handle_websocket_upgrade(event)
        socket = self.transport.get_protocol()
        assert isinstance(socket, _PageWebSocket)
        socket.closed = self._closed

    def on_response_complete(self) -> None:
        super().on_response_complete()
        self._await_request()

    def _await_request(self) -> None:
        self._end_deadline()
        self._deadline = self.loop.call_later(REQUEST_S, self.drop)

    def _end_deadline(self) -> None:
        if self._deadline:
            self._deadline.cancel()
        self._deadline = None


class _PageWebSocket(WebSocketsSansIOProtocol):
    """A page's WebSocket: it is dropped where too many frames come that are no messages, or where nobody reads."""

    closed: Callable[[], None] = lambda: None

    def __init__(self, config: uvicorn.Config, server_state: ServerState, app_state: dict[str, Any]) -> None:
        super().__init__(config, server_state, app_state)
        self._controls = RateLimit(CONTROLS_A_MINUTE, 60_000)
        self._fragments = RateLimit(FRAGMENTS_A_MINUTE, 60_000)

    def connection_lost(self, exc: Exception | None) -> None:
        super().connection_lost(exc)
        self.closed()

    def handle_ping(self) -> None:
        if self._allows(self._controls):
            super().handle_ping()

    def handle_pong(self, event: Frame) -> None:
        if self._allows(self._controls):
            super().handle_pong(event)

    def handle_cont(self, event: Frame) -> None:
        if self._allows(self._fragments):
            super().handle_cont(event)

    def keepalive_timeout(self) -> None:
        super().keepalive_timeout()
        # uvicorn would keep the connection until all that waits is sent, and nobody reads it.
        self.transport.abort()

    async def send(self, message: ASGISendEvent) -> None:
        await self.writable.wait()
        if self.close_sent and self.initial_response is None:
            # The connection closes, since a frame was damaged or no ping was answered; uvicorn would log an error.
            raise ClientDisconnected
        await super().send(message)
        # uvicorn doesn't note that a refused page has got its answer, and would log an error for each.
        self.handshake_complete |= message["type"] == "websocket.http.response.body" and self.close_sent

    def shutdown(self) -> None:
        # uvicorn would close a connection that is closing already a second time; that error would end the server.
        if self.conn.state in (State.CLOSING, State.CLOSED):
            self.stop_keepalive()
            self.transport.close()
        else:
            super().shutdown()

    def _allows(self, rate: RateLimit) -> bool:
        """Whether one more frame is allowed; where it isn't, drop the connection."""
        allowed = not self.transport.is_closing() and rate.allows(to_ticks(self.loop.time()))
        if not allowed:
            self.transport.abort()
        return allowed


class _FewWarnings(logging.Filter):
    """Let at most ten lines a minute pass; ``clock`` gives seconds."""

    def __init__(self, clock: Callable[[], float]) -> None:
        super().__init__()
        self._rate = RateLimit(_WARNINGS_A_MINUTE, 60_000)
        self._clock = clock

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether the record is printed. What a page sent is no fault of the program: such a record is one line."""
        if record.exc_info and record.exc_info[0] is UnicodeDecodeError:
            record.exc_info = None
        return self._rate.allows(to_ticks(self._clock()))


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
