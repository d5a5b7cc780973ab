"""Serve an application at a socket, alone or beside other tasks of an event loop; make the addresses of its pages.

Theory of operation: uvicorn speaks HTTP and WebSocket. Around it stands what docs/security.md promises and uvicorn has
no limit for:

- `motorcade.drive.listener.Listener` accepts connections in uvicorn's place. It bounds them in all and by address, and
  where all places are taken it chooses who gives way. uvicorn's ``limit_concurrency`` would refuse the newcomer.
- `PageConnection` stands between socket and uvicorn's protocol, as the transport of one and the protocol of the
  other. It counts the bytes of both directions. So it finds a request or a body that doesn't go on, and a reader that
  takes nothing, also while the application waits; uvicorn's ``timeout_keep_alive`` begins behind a request.
- `PageWebSocket` counts frames that no application sees: pings, pongs, and parts of messages.
- `PageConnection.serve` is a layer of ASGI around each request. It tells its connection when a request is in work, and
  when it waits for its body.
"""

import asyncio
import ipaddress
import logging
import socket
import ssl
import sys
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager, suppress
from functools import partial
from typing import Any, cast

import uvicorn
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import Frame

from motorcade.drive.listener import Listener, Places
from motorcade.server.request_filter import STATE_KEY, ServerSettings
from motorcade.sockets import allow_files, is_loopback
from motorcade.timing import RateLimit, to_ticks

_PATIENCE_S = 2
# A connection may wait so long for a whole request, its body included.
REQUEST_S = 30.0
# A WebSocket is asked so often whether it is still there, and has so long to answer.
PING_S = 20.0
# Of a request's body so many bytes have to come in REQUEST_S.
_LEAST_BYTES = 1 << 14
# Thirty pages with seven connections each need half of these. All pupils of a class may share one address, and load
# their pages at the same moment: then four times as many. Those whose pupil is known don't count for the address.
_PLACES = Places(512, 32, burst=4, shares=True)
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
            _noted(app),
            http="h11",
            ws=PageWebSocket,
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
        self._connections: set[PageConnection] = set()
        self._limits = _FewWarnings(settings.clock)

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Listen, then call `ready`."""
        for name in _LOGGERS:
            logging.getLogger(name).addFilter(self._limits)
        # Without sockets uvicorn begins everything else.
        await super().startup([])
        places = _PLACES._replace(most=min(_PLACES.most, allow_files() - _KEPT_FILES))
        self._listeners = [
            Listener(bound, self._connection, lambda: None, self._tls, places) for bound in sockets or []
        ]
        self._accepting = [asyncio.create_task(listener.serve()) for listener in self._listeners]
        self._ready()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Accept nobody any more, let the present requests end, and drop all connections."""
        for listener in self._listeners:
            listener.close_to_newcomers()
        for task in self._accepting:
            task.cancel()
        await asyncio.gather(*self._accepting, return_exceptions=True)
        # uvicorn would close a WebSocket that is closing a second time; that error would end the server.
        for connection in list(self._connections):
            if connection.is_closing():
                connection.drop()
        # The loop's next rounds tell them so, one for each of TLS and TCP.
        for _ in range(4):
            await asyncio.sleep(0)
        await super().shutdown()
        for listener in self._listeners:
            listener.drop_all()
        for name in _LOGGERS:
            logging.getLogger(name).removeFilter(self._limits)

    def _connection(self, closed: Callable[[], None]) -> "PageConnection":
        def make_inner(state: dict[str, Any]) -> asyncio.Protocol:
            kind = cast(Callable[..., asyncio.Protocol], self.config.http_protocol_class)
            return kind(config=self.config, server_state=self.server_state, app_state={**self.lifespan.state, **state})

        def lost() -> None:
            self._connections.discard(connection)
            closed()

        connection = PageConnection(make_inner, lost)
        self._connections.add(connection)
        return connection


def _noted(app: ASGIApp) -> ASGIApp:
    """Return an application whose requests are noted at their connections."""

    async def serve(scope: Scope, receive: Receive, send: Send) -> None:
        connection = scope.get("state", {}).get(STATE_KEY)
        if connection is None:
            await app(scope, receive, send)
        else:
            await connection.serve(app, scope, receive, send)

    return serve


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


class PageConnection(asyncio.Protocol):
    """A connection of a browser, between the socket and uvicorn: to uvicorn it is the transport.

    It is dropped where a request doesn't come in time, or where nobody takes what is sent.

    Args:
        make_inner: makes uvicorn's protocol, given what it adds to the state of each request.
        closed: called when the connection is lost, also as a WebSocket.

    Attributes:
        holder: who is known to hold it, by the cookie of a request; "" for nobody.
        stays: whether it keeps its place, however many others come.
    """

    def __init__(self, make_inner: Callable[[dict[str, Any]], asyncio.Protocol], closed: Callable[[], None]) -> None:
        self._inner = make_inner({STATE_KEY: self})
        self._closed = closed
        self._line: asyncio.Transport | None = None
        self._loop = asyncio.get_running_loop()
        self._lost = asyncio.Event()
        self._timers: list[asyncio.TimerHandle] = []
        self._works = 0
        self._awaits_body = self._is_closing = False
        # Bytes that have come, and that were written.
        self._came = self._written = 0
        self.holder = ""
        self.stays = False

    # What the listener asks for.

    def has_session(self) -> bool:
        """Whether a request is in work, or the page has a WebSocket."""
        return self._works > 0

    def drop(self) -> None:
        # A line that was closed while bytes waited, and is lost, can't be aborted.
        if self._line and not self._lost.is_set():
            self._line.abort()

    # What the socket brings.

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._line = transport
        transport.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _KERNEL_BYTES)
        transport.set_write_buffer_limits(_OWN_BYTES)
        self._inner.connection_made(cast(asyncio.Transport, self))
        self._after(REQUEST_S, partial(self._look, 0, 0))

    def data_received(self, data: bytes) -> None:
        self._came += len(data)
        self._inner.data_received(data)

    def eof_received(self) -> bool | None:
        return self._inner.eof_received()

    def pause_writing(self) -> None:
        self._inner.pause_writing()

    def resume_writing(self) -> None:
        self._inner.resume_writing()

    def connection_lost(self, exc: Exception | None) -> None:
        self._is_closing = True
        for timer in self._timers:
            timer.cancel()
        self._inner.connection_lost(exc)
        self._lost.set()
        self._closed()

    # What uvicorn asks its transport for.

    def __getattr__(self, name: str) -> Any:
        return getattr(self._line, name)

    def set_protocol(self, protocol: asyncio.Protocol) -> None:
        """Take a WebSocket in place of HTTP."""
        self._inner = protocol

    def write(self, data: bytes) -> None:
        self._written += len(data)
        assert self._line
        self._line.write(data)

    def close(self) -> None:
        """Close it when all is sent, or after a while: perhaps nobody reads."""
        self._is_closing = True
        if self._line:
            self._line.close()
            self._after(_PATIENCE_S, self.drop)

    def is_closing(self) -> bool:
        return self._is_closing or self._line is None or self._line.is_closing()

    # What the application does.

    async def serve(self, app: ASGIApp, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, and note when it is in work and when it waits for its body."""
        is_socket = scope["type"] == "websocket"
        self._awaits_body = not is_socket

        async def receive_noted() -> Message:
            message = await receive()
            self._awaits_body = bool(message.get("more_body")) and not is_socket
            return message

        async def send_noted(message: Message) -> None:
            if is_socket and self.is_closing():
                # uvicorn would log an error for each message to a page that is leaving.
                raise OSError
            self._awaits_body = False
            await send(message)

        self._works += 1
        try:
            await app(scope, receive_noted, send_noted)
            if is_socket and self.is_closing():
                # A page that was refused has got its answer: uvicorn would log that nothing was accepted.
                await self._lost.wait()
        finally:
            self._works -= 1
            self._awaits_body = False

    def _look(self, came: int, taken: int) -> None:
        """Drop the connection where its other end had to do something, and did too little for `REQUEST_S`."""
        assert self._line
        waiting = self._line.get_write_buffer_size()
        awaits_request = self._awaits_body or self._works == 0
        if (waiting and self._written - waiting <= taken) or (awaits_request and self._came - came < _LEAST_BYTES):
            self.drop()
        else:
            self._after(REQUEST_S, partial(self._look, self._came, self._written - waiting))

    def _after(self, seconds: float, job: Callable[[], None]) -> None:
        self._timers = [self._loop.call_later(seconds, job), *self._timers[:1]]


class PageWebSocket(WebSocketsSansIOProtocol):
    """uvicorn's WebSocket, which is dropped where it brings too many frames that are no whole messages.

    uvicorn answers pings and joins parts by itself, so no application sees how many come. Whole messages are counted
    where they are read (`motorcade.server.page_socket`).
    """

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._controls = RateLimit(CONTROLS_A_MINUTE, 60_000)
        self._fragments = RateLimit(FRAGMENTS_A_MINUTE, 60_000)

    def _allows(self, rate: RateLimit) -> bool:
        if rate.allows(to_ticks(self.loop.time())):
            return True
        self.transport.abort()
        return False

    def handle_ping(self) -> None:
        if self._allows(self._controls):
            super().handle_ping()

    def handle_pong(self, event: Frame) -> None:
        if self._allows(self._controls):
            super().handle_pong(event)

    def handle_cont(self, event: Frame) -> None:
        if self._allows(self._fragments):
            super().handle_cont(event)

    def handle_text(self, event: Frame) -> None:
        if event.fin or self._allows(self._fragments):
            super().handle_text(event)

    def handle_bytes(self, event: Frame) -> None:
        if event.fin or self._allows(self._fragments):
            super().handle_bytes(event)


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
    address = ipaddress.ip_address(listener.getsockname()[0].partition("%")[0])
    if address.is_unspecified:
        return others + names
    return names + others


def url_of(host: str, port: int, token: str | None = None, page: str = "/", scheme: str = "http") -> str:
    """Return a page's address."""
    query = ""
    if token:
        query = f"?token={token}"
    return f"{scheme}://{f'[{host}]' if ':' in host else host}:{port}{page}{query}"
