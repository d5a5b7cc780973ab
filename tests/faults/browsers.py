"""A browser in the simulated room: requests by HTTP over one connection that is kept, and WebSockets."""

import asyncio
import json
from collections.abc import Callable
from contextlib import suppress
from typing import Any

HOST = "192.168.1.5:7710"
_SERVER, _PORT = "server", 7710
# A page gives up a request after so long.
_PATIENCE_S = 12.0
_KEY = "dGhlIHNhbXBsZSBub25jZQ=="
_TEXT, _PING, _CLOSE = 1, 9, 8

# How a request ended, beside the code of an error.
DONE, UNKNOWN = "done", "unknown"


class Browser:
    """A browser with its cookies.

    Args:
        seen: called with all bytes that the server has sent to it.
    """

    def __init__(self, seen: Callable[[bytes], None]) -> None:
        self.cookies: dict[str, str] = {}
        self._seen = seen
        self._streams: tuple[asyncio.StreamReader, asyncio.StreamWriter] | None = None

    async def ask(self, name: str, /, **message: Any) -> tuple[str, Any]:
        """Send a request. Returns DONE and the answer, the code of an error, or UNKNOWN where no answer came."""
        try:
            async with asyncio.timeout(_PATIENCE_S):
                status, body = await self._exchange(name, json.dumps(message).encode())
        except (OSError, EOFError, TimeoutError, asyncio.IncompleteReadError):
            self.hang_up()
            return UNKNOWN, None
        answer = json.loads(body) if body else None
        return (DONE, answer) if status == 200 else (answer["error"]["code"], answer)

    def hang_up(self) -> None:
        """Close the connection; the next request begins another one."""
        if self._streams:
            self._streams[1].transport.abort()
        self._streams = None

    async def _exchange(self, name: str, body: bytes) -> tuple[int, bytes]:
        if self._streams is None or self._streams[1].is_closing() or self._streams[0].at_eof():
            self.hang_up()
            self._streams = await asyncio.open_connection(_SERVER, _PORT)
        reader, writer = self._streams
        writer.write(f"POST /api/{name} HTTP/1.1\r\n{self._head()}Content-Length: {len(body)}\r\n\r\n".encode() + body)
        head = await reader.readuntil(b"\r\n\r\n")
        self._seen(head)
        lines = head.decode("latin-1").split("\r\n")
        fields = [line.partition(": ")[::2] for line in lines[1:] if line]
        length = 0
        for field, value in fields:
            if field.lower() == "set-cookie":
                key, _, secret = value.partition(";")[0].partition("=")
                self.cookies[key] = secret
            elif field.lower() == "content-length":
                length = int(value)
        answer = await reader.readexactly(length)
        self._seen(answer)
        return int(lines[0].split()[1]), answer

    def _head(self) -> str:
        cookies = "; ".join(f"{name}={value}" for name, value in self.cookies.items())
        return f"Host: {HOST}\r\n" + (f"Cookie: {cookies}\r\n" if cookies else "")

    async def listen(self, path: str, take: Callable[[dict[str, Any]], None]) -> None:
        """Open a WebSocket, and give each message to ``take`` until it ends. Raises OSError, EOFError."""
        reader, writer = await asyncio.open_connection(_SERVER, _PORT)
        try:
            upgrade = f"Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: {_KEY}\r\n"
            writer.write(
                f"GET /api/{path} HTTP/1.1\r\n{self._head()}{upgrade}Sec-WebSocket-Version: 13\r\n\r\n".encode()
            )
            head = await reader.readuntil(b"\r\n\r\n")
            if b" 101 " not in head:
                raise EOFError("refused")
            while True:
                opcode, data = await _read_frame(reader)
                self._seen(data)
                if opcode == _PING:
                    writer.write(_masked(10, data))
                elif opcode == _CLOSE:
                    raise EOFError("closed")
                elif opcode == _TEXT:
                    take(json.loads(data))
        except asyncio.IncompleteReadError:
            raise EOFError("ended") from None
        finally:
            with suppress(RuntimeError):
                writer.transport.abort()


async def _read_frame(reader: asyncio.StreamReader) -> tuple[int, bytes]:
    first, length = await reader.readexactly(2)
    if length == 126:
        length = int.from_bytes(await reader.readexactly(2), "big")
    elif length == 127:
        length = int.from_bytes(await reader.readexactly(8), "big")
    return first & 15, await reader.readexactly(length)


def _masked(opcode: int, data: bytes) -> bytes:
    return bytes((0x80 | opcode, 0x80 | len(data), 0, 0, 0, 0)) + data
