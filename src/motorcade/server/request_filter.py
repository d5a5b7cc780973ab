"""Check each request first: its host name and origin, its token, its rate and its size.

In a browser every page may send requests to this computer. So a request must be addressed to a name of this server (a
foreign site can point its own name at this computer, 'DNS rebinding'), and come from a page of this server.
"""

import asyncio
import ipaddress
import re
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from secrets import compare_digest

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket

from motorcade.drive.listener import Connected
from motorcade.errors import MotorcadeError
from motorcade.server.http import error_response, refusal_page
from motorcade.service.library import MOST_BYTES
from motorcade.sockets import network_of
from motorcade.timing import Attempts

# Where the server puts a request's connection into its state.
STATE_KEY = "connection"
# WebSockets of one pupil: three tabs have fewer. The oldest gives way.
MOST_SOCKETS = 8
RATE_WINDOW_S = 2
# So often is asked whether the holder of a WebSocket is still in; who is out is sent nothing after so long: until then,
# why.
_LOOK_S = 0.5
_LAST_WORDS_S = 0.5
# What a stream sends again and again; and why a WebSocket ends (RFC 6455, section 7.4.1).
_PARTS = ("websocket.send", "http.response.body")
_NOT_ALLOWED = 1008
# Paths that may be opened with the token in the address, and paths that only our own pages may request.
_PAGES = ("/", "/drive")
_CAMERA = "/camera"
_GUARDED = ("/api/", "/drive/", _CAMERA)
# A Host header.
_HOST = re.compile(r"(\[(?P<address>[0-9a-fA-F:.]+)\]|(?P<name>[A-Za-z0-9._-]+))(:[0-9]{1,5})?")
_LENGTH = re.compile("[0-9]{1,12}")
# A file of all projects, and the files of a report, grow inside of a JSON text.
_LARGE_BODIES = dict.fromkeys(("/api/projects/import", "/api/teacher/report.html"), 2 * MOST_BYTES)
_WEEK_S = 7 * 24 * 3600
_HEADERS = {
    # Blockly styles its blocks in place; it and the page draw from data: and blob: addresses.
    "Content-Security-Policy": "default-src 'self'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; media-src 'self' data: blob:; font-src 'self' data:; worker-src 'self' blob:; "
    "connect-src 'self' data: blob:; object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=(), serial=(self)",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


class TokenError(MotorcadeError):
    """A request comes without the token that it needs, or with another one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ServerSettings:
    """The addresses of a server, and the limits for its clients.

    Attributes:
        port: where it listens.
        names: the host names, beside addresses, by which others reach it.
        token: the secret that a client must present; None where everybody may ask who reaches the address.
        record: writes into the log what a page's user did, who it is, and with which car; None for no log.
        clock: seconds that never decrease.
        most_body: the most bytes of a request's body or of a message.
        requests_a_second, messages_a_second: the rates of one address and of one WebSocket; twice as many at once
            after a pause.
    """

    port: int = 7700
    names: frozenset[str] = frozenset()
    token: str | None = None
    record: Callable[[str, str, str], None] | None = None
    clock: Callable[[], float] = time.monotonic
    most_body: int = 1 << 20
    requests_a_second: int = 500
    messages_a_second: int = 250


class RequestFilter:
    """Pass requests on to ``app``, except those that aren't allowed: answer these with an error.

    Args:
        app: the application.
        settings: the limits, and the token that is needed.
        admit: in place of a token decides whether a holder may ask for what pages only request; raises MotorcadeError.
        holder: who is known to ask, "" for a stranger; and whether their connections keep their places whoever comes.
    """

    def __init__(
        self,
        app: ASGIApp,
        settings: ServerSettings,
        admit: Callable[[HTTPConnection, str], None] | None = None,
        holder: Callable[[HTTPConnection], tuple[str, bool]] = lambda connection: ("", False),
    ) -> None:
        self._app = app
        self._settings = settings
        self._admit = admit
        self._holder = holder
        self._sockets: dict[str, list[Connected]] = {}
        self._rates = Attempts(RATE_WINDOW_S * settings.requests_a_second, RATE_WINDOW_S, "requests-too-fast")
        # Cookies are shared between ports: two servers on one computer need different names.
        self._cookie = f"motorcade_{settings.port}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse one request, or pass it on."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        send = _with_headers(scope, send)
        asker = HTTPConnection(scope)
        holder, stays = self._holder(asker)
        connection = scope.get("state", {}).get(STATE_KEY)
        if connection:
            connection.holder = holder
            connection.stays = stays
        try:
            self._check(scope, holder)
            shown = self._shown_token(scope)
            if not shown and scope["path"] in _PAGES and not self._admit:
                self._check_token(scope, holder)
        except MotorcadeError as problem:
            # Somebody who opens the page without the token has to read what to do.
            answer: Response = error_response(problem)
            if scope["type"] == "http" and scope["path"] in _PAGES and isinstance(problem, TokenError):
                answer = refusal_page(problem)
            await _respond(answer, scope, receive, send)
            return
        if shown:
            await self._store_token(scope)(scope, receive, send)
            return
        receive = self._bounded(receive, self._most_body(scope))
        if holder:
            receive, send = self._while_in(asker, holder, connection, receive, send)
        if scope["type"] == "websocket":
            with self._counted(connection):
                await self._app(scope, receive, send)
        else:
            await self._app(scope, receive, send)

    def _while_in(
        self, asker: HTTPConnection, holder: str, connection: "Connected | None", receive: Receive, send: Send
    ) -> tuple[Receive, Send]:
        """Return how a holder's request is received and answered while the holder is in.

        The right to ask may end after the head of a request has come: a body that comes later is refused. A WebSocket
        is over with its next message, or within a second; nothing more is sent then. A stream's connection is dropped.
        """
        is_socket = asker.scope["type"] == "websocket"
        out_since_s: float | None = None
        is_over = False

        def is_in() -> bool:
            return self._holder(asker)[0] == holder

        async def end() -> Message:
            nonlocal is_over
            closes = is_socket and not is_over
            is_over = True
            if closes:
                await send({"type": "websocket.close", "code": _NOT_ALLOWED})
            return {"type": "websocket.disconnect", "code": _NOT_ALLOWED}

        async def next_of_socket() -> Message | None:
            """Wait for a message while the holder is in, and for what may be said last."""
            while is_in():
                with suppress(TimeoutError):
                    async with asyncio.timeout(_LOOK_S):
                        return await receive()
            with suppress(TimeoutError):
                async with asyncio.timeout(_LAST_WORDS_S):
                    return await receive()
            return None

        async def receive_in() -> Message:
            message = await (next_of_socket() if is_socket else receive())
            if message is None:
                return await end()
            is_whole = message["type"] == "http.request" and not message.get("more_body")
            if is_whole and self._admit and not is_in():
                self._admit(asker, self._holder(asker)[0])
            if message["type"] == "websocket.receive" and not is_in():
                return await end()
            return message

        async def send_in(message: Message) -> None:
            nonlocal out_since_s, is_over
            if message["type"] in _PARTS and not is_over and not is_in():
                now_s = self._settings.clock()
                if out_since_s is None:
                    out_since_s = now_s
                if now_s - out_since_s >= _LAST_WORDS_S:
                    await end()
            if is_over and connection and not is_socket:
                # The application goes on until it sees that, and an error would be logged.
                connection.drop()
                return
            if is_over:
                raise OSError
            is_over = message["type"] == "websocket.close"
            await send(message)

        return receive_in, send_in

    @contextmanager
    def _counted(self, socket: "Connected | None") -> Iterator[None]:
        """Count a WebSocket of somebody who is known while the block runs; where there are too many drop the oldest."""
        if socket is None or not socket.holder or socket.stays:
            yield
            return
        alike = self._sockets.setdefault(socket.holder, [])
        if len(alike) >= MOST_SOCKETS:
            alike.pop(0).drop()
        alike.append(socket)
        try:
            yield
        finally:
            if socket in alike:
                alike.remove(socket)

    def _check(self, scope: Scope, holder: str) -> None:
        headers = Headers(scope=scope)
        address = network_of(scope["client"][0] if scope.get("client") else "")
        self._rates.count(holder or address, self._settings.clock())
        self._check_host(headers)
        self._check_origin(headers, scope["path"])
        if scope["path"].startswith(_GUARDED):
            self._check_token(scope, holder)
        length = headers.get("content-length", "0")
        most = self._most_body(scope)
        if not _LENGTH.fullmatch(length) or int(length) > most:
            raise MotorcadeError("body-too-large", most=most)

    def _most_body(self, scope: Scope) -> int:
        return max(self._settings.most_body, _LARGE_BODIES.get(scope["path"], 0))

    def _check_host(self, headers: Headers) -> None:
        hosts = headers.getlist("host")
        found = None
        if len(hosts) == 1:
            found = _HOST.fullmatch(hosts[0])
        if found is None or not self._is_ours((found["address"] or found["name"]).lower()):
            raise MotorcadeError("foreign-host", name=", ".join(hosts)[:60] or "''")

    def _is_ours(self, name: str) -> bool:
        if name == "localhost" or name in self._settings.names:
            return True
        try:
            address = ipaddress.ip_address(name)
        except ValueError:
            return False
        # Only a name can be made to point here, so where something has to be shown every address is allowed.
        return address.is_loopback or self._settings.token is not None or self._admit is not None

    def _check_origin(self, headers: Headers, path: str) -> None:
        origins = headers.getlist("origin")
        own = (f"http://{headers['host']}", f"https://{headers['host']}")
        # A link from another site may open the page; every other request from another site is refused.
        site = headers.get("sec-fetch-site", "none")
        if any(origin not in own for origin in origins) or (
            path.startswith(_GUARDED) and site not in ("same-origin", "none")
        ):
            raise MotorcadeError("foreign-origin")

    def _check_token(self, scope: Scope, holder: str) -> None:
        token = self._settings.token
        connection = HTTPConnection(scope)
        if self._admit:
            self._admit(connection, holder)
            return
        shown = connection.cookies.get(self._cookie, "")
        if not shown and scope["path"].startswith(_CAMERA):
            # Programs that show a camera have no cookies.
            shown = connection.query_params.get("token", "")
        if token is not None and not _is_token(shown, token):
            raise TokenError("token-needed")

    def _shown_token(self, scope: Scope) -> bool:
        """Whether the page is opened with the token in its address."""
        shown = None
        if scope["path"] in _PAGES:
            shown = HTTPConnection(scope).query_params.get("token")
        if self._settings.token is None or shown is None:
            return False
        if not _is_token(shown, self._settings.token):
            raise TokenError("wrong-token")
        return True

    def _store_token(self, scope: Scope) -> Response:
        """Store the token in a cookie, and redirect to the address without it."""
        response = RedirectResponse(scope["path"], 303)
        token = self._settings.token or ""
        secure = scope["scheme"] == "https"
        response.set_cookie(self._cookie, token, max_age=_WEEK_S, httponly=True, samesite="strict", secure=secure)
        return response

    def _bounded(self, receive: Receive, most: int) -> Receive:
        left = most

        async def bounded() -> Message:
            nonlocal left
            message = await receive()
            if message["type"] == "http.request":
                left -= len(message.get("body", b""))
            if left < 0:
                raise MotorcadeError("body-too-large", most=most)
            return message

        return bounded


def _is_token(shown: str, token: str) -> bool:
    return compare_digest(shown.encode(), token.encode())


def _with_headers(scope: Scope, send: Send) -> Send:
    more: Mapping[str, str] = {**_HEADERS, "Cache-Control": _caching(scope["path"])}

    async def sending(message: Message) -> None:
        if message["type"] in ("http.response.start", "websocket.http.response.start"):
            headers = MutableHeaders(scope=message)
            for name, value in more.items():
                headers.setdefault(name, value)
        await send(message)

    return sending


def _caching(path: str) -> str:
    """Return how long a browser may cache ``path``; the names of assets change with their content."""
    if path.startswith("/assets/"):
        return "public, max-age=31536000, immutable"
    if path.startswith(_GUARDED):
        return "no-store"
    return "no-cache"


async def _respond(response: Response, scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket":
        await WebSocket(scope, receive, send).send_denial_response(response)
    else:
        await response(scope, receive, send)
