"""What waits to be sent to a page: bounded, however slow the page is."""

import asyncio
from collections import deque
from typing import Any

import msgspec
from starlette.websockets import WebSocket

from motorcade.server.errors import ServerError

# So many pictures a page has not yet drawn; the others are never made.
MOST_UNDER_WAY = 2
_MOST_WAITING = 64
# Of these only the newest is worth sending.
_REPLACED = ("state", "car")
_LEFT = 1008


class Outbox:
    """Messages for a page in the order in which they were put there."""

    def __init__(self) -> None:
        self._waiting: deque[tuple[str, str | bytes]] = deque()
        self._stirred = asyncio.Event()
        self._numbered = self._shown = 0
        self._closing = False

    @property
    def next_picture(self) -> int | None:
        """The number of the next picture, or None while enough of them are under way."""
        return self._numbered + 1 if self._numbered - self._shown < MOST_UNDER_WAY else None

    def shown(self, number: int) -> None:
        """The page has drawn this picture and those before."""
        self._shown = max(self._shown, min(number, self._numbered))

    def put_picture(self, data: bytes) -> None:
        """Send ``next_picture``."""
        self._numbered += 1
        self._put("picture", data)

    def put(self, kind: str, values: dict[str, Any]) -> None:
        """Send a message."""
        if kind in _REPLACED:
            self._waiting = deque(each for each in self._waiting if each[0] != kind)
        if len(self._waiting) < _MOST_WAITING:
            self._put(kind, msgspec.json.encode({"is": kind} | values).decode())

    def refuse(self, problem: ServerError, closing: bool = False) -> None:
        """Send an error; nothing after it where the connection is ``closing`` with it."""
        self.put("error", problem.as_dict())
        self._closing = self._closing or closing
        self._stirred.set()

    async def send_to(self, socket: WebSocket) -> None:
        """Send what is put here, until there is an error that closes the connection."""
        while not self._closing or self._waiting:
            await self._stirred.wait()
            self._stirred.clear()
            while self._waiting:
                _, data = self._waiting.popleft()
                if isinstance(data, bytes):
                    await socket.send_bytes(data)
                else:
                    await socket.send_text(data)
        await socket.close(_LEFT)

    def _put(self, kind: str, data: str | bytes) -> None:
        self._waiting.append((kind, data))
        self._stirred.set()
