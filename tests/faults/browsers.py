"""A browser in the simulated room: requests by HTTP over one connection that is kept, and WebSockets."""

import asyncio
import json
import ssl
from collections.abc import Callable
from contextlib import suppress
from typing import Any

HOST = "192.168.1.5:7710"
SERVER, PORT = "server", 7710
# A page gives up a request after so long.
_PATIENCE_S = 12.0
# A server closes a connection that is idle; one that is used at that moment would break.
_IDLE_S = 4.0
_KEY = "dGhlIHNhbXBsZSBub25jZQ=="
_TEXT, _BINARY, _PING, _CLOSE = 1, 2, 9, 8
_ENDS = (OSError, EOFError, TimeoutError, asyncio.IncompleteReadError)

# How a request ended, beside the code of an error.
DONE, UNKNOWN = "done", "unknown"


class Browser:
    """A browser with its cookies.

    Args:
        seen: called with all bytes that the server has sent to it.
        address: where it is; None for the process that runs.
        host: what it calls the server.
        server: the computer and the port to which it connects.
        tls: with which it connects, to the class's name in the network.

    Attributes:
        cookies, attributes: values and attributes of each cookie, by its name.
        status, given: of the last answer its status, and the cookies that it sets, as they are written.
        note: called with the path of each request and WebSocket, and how it ended.
    """

    def __init__(
        self,
        seen: Callable[[bytes], None] = lambda data: None,
        address: str | None = None,
        host: str = HOST,
        server: tuple[str, int] = (SERVER, PORT),
        tls: ssl.SSLContext | None = None,
    ) -> None:
        self.cookies: dict[str, str] = {}
        self.attributes: dict[str, str] = {}
        self.status = 0
        self.given: list[str] = []
        self._used_s = 0.0
        self.head: dict[str, str] = {}
        self.address = address
        self.note: Callable[[str, str], None] = lambda path, outcome: None
        self._host = host
        self._server = server
        self._tls: dict[str, Any] = {"ssl": tls, "server_hostname": "motorcade.local"} if tls else {}
        self._seen = seen
        self._streams: tuple[asyncio.StreamReader, asyncio.StreamWriter] | None = None

    async def ask(self, name: str, /, **message: Any) -> tuple[str, Any]:
        """Send a request. Returns DONE and the answer, the code of an error, or UNKNOWN where no answer came."""
        return await self.post(name, json.dumps(message).encode())

    async def post(self, name: str, body: bytes, headers: str = "") -> tuple[str, Any]:
        """Send a body."""
        outcome, data = await self.fetch("POST", f"/api/{name}", body, headers)
        return outcome, self._decoded(data)

    def _decoded(self, data: bytes) -> Any:
        return json.loads(data) if self.head.get("content-type") == "application/json" and data else data

    async def fetch(self, method: str, path: str, body: bytes = b"", headers: str = "") -> tuple[str, bytes]:
        """Send any request; the answer's body comes back as it is."""
        try:
            async with asyncio.timeout(_PATIENCE_S):
                reader, writer = await self._connection()
                writer.write(self._request(method, path, len(body), headers) + body)
                answer = await self._answer(reader, method)
                self.note(path, answer[0])
                return answer
        except _ENDS:
            self.hang_up()
            return UNKNOWN, b""

    async def stream(
        self, path: str, method: str = "GET", count: int = 1
    ) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        """Ask for what goes on without end, or ``count`` times at once, by a connection of its own."""
        reader, writer = await self._connect()
        writer.write(count * self._request(method, path, 0, ""))
        return reader, writer

    async def begin(self, name: str, /, **message: Any) -> "LateBody":
        """Send a request without its body, by a connection of its own."""
        body = json.dumps(message).encode()
        reader, writer = await self._connect()
        writer.write(self._request("POST", f"/api/{name}", len(body), ""))
        return LateBody(self, reader, writer, body)

    def hang_up(self) -> None:
        """Close the connection; the next request begins another one."""
        if self._streams:
            self._streams[1].transport.abort()
        self._streams = None

    async def _connect(self) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        at = {"local_addr": (self.address, 0)} if self.address else {}
        return await asyncio.open_connection(*self._server, **at, **self._tls)  # type: ignore[arg-type]

    async def _connection(self) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        now_s = asyncio.get_running_loop().time()
        is_idle = now_s > self._used_s + _IDLE_S
        if self._streams is None or self._streams[1].is_closing() or self._streams[0].at_eof() or is_idle:
            self.hang_up()
            self._streams = await self._connect()
        self._used_s = now_s
        return self._streams

    def _request(self, method: str, path: str, length: int, headers: str) -> bytes:
        told = f"Content-Length: {length}\r\n" if "Content-Length" not in headers else ""
        return f"{method} {path} HTTP/1.1\r\n{self._own(headers)}{headers}{told}\r\n".encode()

    async def _answer(self, reader: asyncio.StreamReader, method: str = "POST") -> tuple[str, bytes]:
        head = await reader.readuntil(b"\r\n\r\n")
        self._seen(head)
        lines = head.decode("latin-1").split("\r\n")
        self.status, self.head, self.given = int(lines[0].split()[1]), {}, []
        for field, _, value in (line.partition(": ") for line in lines[1:] if line):
            self.head[field.lower()] = value
            if field.lower() == "set-cookie":
                self._keep(value)
        if self.head.get("transfer-encoding") == "chunked":
            answer = await _read_chunks(reader)
        else:
            answer = await reader.readexactly(0 if method == "HEAD" else int(self.head.get("content-length", "0")))
        self._seen(answer)
        if self.status < 400:
            return DONE, answer
        return code_of(answer), answer

    def _keep(self, cookie: str) -> None:
        self.given.append(cookie)
        value, _, attributes = cookie.partition(";")
        key, _, secret = value.partition("=")
        self.attributes[key] = attributes
        # The server deletes a cookie by an empty value.
        self.cookies.pop(key, None)
        if secret.strip('"'):
            self.cookies[key] = secret

    def _own(self, headers: str = "") -> str:
        cookies = "; ".join(f"{name}={value}" for name, value in self.cookies.items())
        host = "" if "Host:" in headers else f"Host: {self._host}\r\n"
        return host + (f"Cookie: {cookies}\r\n" if cookies else "")

    async def listen(self, path: str, take: Callable[[dict[str, Any]], None]) -> None:
        """Open a WebSocket, and give each message to ``take`` until it ends. Raises OSError, EOFError."""
        page = await self.open(path, take)
        if page.refused:
            raise EOFError("refused")
        await page.read()

    async def open(
        self, path: str, take: Callable[[dict[str, Any]], None] = lambda message: None, headers: str = ""
    ) -> "SimulatedPage":
        """Open a WebSocket below /api/, or elsewhere with a path that begins with a slash. Raises OSError, EOFError."""
        reader, writer = await self._connect()
        upgrade = f"Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: {_KEY}\r\n"
        where = path if path.startswith("/") else f"/api/{path}"
        own = self._own(headers)
        writer.write(f"GET {where} HTTP/1.1\r\n{own}{headers}{upgrade}Sec-WebSocket-Version: 13\r\n\r\n".encode())
        try:
            head = await reader.readuntil(b"\r\n\r\n")
            if b" 101 " in head.split(b"\r\n")[0]:
                self.note(where, DONE)
                return SimulatedPage(reader, writer, take, self._seen)
            length = int(head.lower().partition(b"content-length: ")[2].split(b"\r\n")[0] or 0)
            answer = await reader.readexactly(length)
        except asyncio.IncompleteReadError:
            writer.transport.abort()
            raise EOFError("ended") from None
        writer.transport.abort()
        self.note(where, code_of(answer))
        return SimulatedPage(reader, writer, take, self._seen, code_of(answer))


def code_of(answer: bytes) -> str:
    """The code of the error that an answer has."""
    try:
        return str(json.loads(answer)["error"]["code"])
    except (ValueError, KeyError, TypeError):
        return "no-json"


class LateBody:
    """A request whose body waits."""

    def __init__(
        self, browser: Browser, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, body: bytes
    ) -> None:
        self._browser, self._reader, self._writer, self._body = browser, reader, writer, body

    def hang_up(self) -> None:
        """Leave without having sent the body."""
        self._writer.transport.abort()

    async def end(self) -> tuple[str, Any]:
        """Send the body. Returns how the request ended, as `Browser.ask` does."""
        try:
            async with asyncio.timeout(_PATIENCE_S):
                self._writer.write(self._body)
                outcome, data = await self._browser._answer(self._reader)
        except _ENDS:
            return UNKNOWN, None
        finally:
            self._writer.transport.abort()
        return outcome, self._browser._decoded(data)


class SimulatedPage:
    """A WebSocket of a page.

    Attributes:
        refused: the code with which it wasn't opened; "" where it was.
        messages: what came, the newest last; at most some.
        pictures, picture: how many binary messages came, and the last one.
        pings: how often it was asked whether it is there.
        is_mute: whether it answers that no more.
        has_ended: whether the server has ended it.
    """

    def __init__(
        self,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        take: Callable[[dict[str, Any]], None],
        seen: Callable[[bytes], None],
        refused: str = "",
    ) -> None:
        self._reader, self._writer, self._take, self._seen = reader, writer, take, seen
        self.refused = refused
        self.messages: list[dict[str, Any]] = []
        self.pictures = self.pings = 0
        self.picture = b""
        self.is_mute = False
        self.has_ended = bool(refused)
        self._reading: asyncio.Task[None] | None = None

    def follow(self) -> "SimulatedPage":
        """Read beside the present task until it ends."""

        async def follow() -> None:
            with suppress(OSError, EOFError):
                await self.read()

        if not self.refused:
            self._reading = asyncio.create_task(follow())
        return self

    async def read(self) -> None:
        """Read until it ends. Raises OSError, EOFError."""
        try:
            while True:
                opcode, data = await _read_frame(self._reader)
                self._seen(data)
                if opcode == _PING:
                    self.pings += 1
                    if not self.is_mute:
                        self._writer.write(_masked(10, data))
                elif opcode == _CLOSE:
                    raise EOFError("closed")
                elif opcode == _BINARY:
                    self.pictures += 1
                    self.picture = data
                elif opcode == _TEXT:
                    message = json.loads(data)
                    self.messages = [*self.messages[-200:], message]
                    self._take(message)
        except asyncio.IncompleteReadError:
            raise EOFError("ended") from None
        finally:
            self.has_ended = True
            with suppress(RuntimeError):
                self._writer.transport.abort()

    def send(self, message: Any, opcode: int = _TEXT) -> None:
        """Send a message as JSON, or bytes as they are."""
        data = message if isinstance(message, bytes) else json.dumps(message).encode()
        if not self._writer.is_closing():
            self._writer.write(_masked(opcode, data))

    def stop_reading(self) -> None:
        """Take nothing any more of what comes."""
        self._writer.transport.pause_reading()  # type: ignore[attr-defined]

    def codes(self) -> list[str]:
        """The codes of all errors that it was sent."""
        return [each["code"] for each in self.messages if each.get("is") == "error"]

    def newest(self, kind: str) -> dict[str, Any] | None:
        """The newest message of a kind."""
        return next((each for each in reversed(self.messages) if each.get("is") == kind), None)

    def close(self) -> None:
        """Leave."""
        if self._reading:
            self._reading.cancel()
        with suppress(RuntimeError):
            self._writer.transport.abort()
        self.has_ended = True


async def _read_chunks(reader: asyncio.StreamReader) -> bytes:
    data = b""
    while size := int(await reader.readuntil(b"\r\n"), 16):
        data += (await reader.readexactly(size + 2))[:-2]
    await reader.readexactly(2)
    return data


async def _read_frame(reader: asyncio.StreamReader) -> tuple[int, bytes]:
    first, length = await reader.readexactly(2)
    if length == 126:
        length = int.from_bytes(await reader.readexactly(2), "big")
    elif length == 127:
        length = int.from_bytes(await reader.readexactly(8), "big")
    return first & 15, await reader.readexactly(length)


def _masked(opcode: int, data: bytes) -> bytes:
    size = len(data)
    if size < 126:
        head = bytes((0x80 | opcode, 0x80 | size))
    elif size < 1 << 16:
        head = bytes((0x80 | opcode, 0x80 | 126)) + size.to_bytes(2, "big")
    else:
        head = bytes((0x80 | opcode, 0x80 | 127)) + size.to_bytes(8, "big")
    return head + bytes(4) + data
