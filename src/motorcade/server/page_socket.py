"""A page's WebSocket: messages in and answers out, both bounded."""

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable
from contextlib import asynccontextmanager, suppress
from functools import partial
from typing import Any, TypeVar

from anyio import create_task_group
from starlette.websockets import WebSocket, WebSocketDisconnect

from motorcade.errors import MotorcadeError
from motorcade.server.request_filter import RATE_WINDOW_S, ServerSettings
from motorcade.service.messages import decode, encoded
from motorcade.service.world_session import refused
from motorcade.timing import RateLimit, to_ticks

_T = TypeVar("_T")
_MOST_WAITING = 64


class PageSocket:
    """The connection of a page.

    Args:
        socket: accepted.
        settings: the limits for its messages.
        newest: kinds of answers of which only the newest is of use: one that waits is replaced.
    """

    def __init__(self, socket: WebSocket, settings: ServerSettings, newest: tuple[type, ...] = ()) -> None:
        self._socket = socket
        self._settings = settings
        self._newest = newest
        self._waiting: deque[tuple[type, str | bytes]] = deque()
        self._changed = asyncio.Event()
        self._closing = False

    async def serve(
        self, kind: Any, handle: Callable[[Any], Awaitable[None]], jobs: Iterable[Callable[[], Awaitable[None]]]
    ) -> None:
        """Pass each message of type ``kind`` to ``handle`` and run ``jobs`` until one of them ends or the page leaves.

        A MotorcadeError of ``handle`` is sent to the page. A page that sends too fast is disconnected.
        """
        async with create_task_group() as group:

            async def end_all_with(job: Callable[[], Awaitable[None]]) -> None:
                with suppress(WebSocketDisconnect):
                    await job()
                group.cancel_scope.cancel()

            group.start_soon(end_all_with, partial(self._receive, kind, handle))
            group.start_soon(end_all_with, self.send_all)
            for job in jobs:
                group.start_soon(end_all_with, job)

    def put(self, answer: Any) -> None:
        """Send an answer. Where 64 wait the oldest gives way, but no bytes: pages acknowledge them, so they are few."""
        kind = type(answer)
        if kind in self._newest:
            self._waiting = deque(waiting for waiting in self._waiting if waiting[0] is not kind)
        self._waiting.append((kind, encoded(answer)))
        if len(self._waiting) > _MOST_WAITING:
            oldest_text = next((waiting for waiting in self._waiting if waiting[0] is not bytes), None)
            if oldest_text:
                self._waiting.remove(oldest_text)
        self._changed.set()

    def refuse(self, problem: MotorcadeError, closing: bool = False) -> None:
        """Send an error; ``closing`` ends the connection with it."""
        self._closing = self._closing or closing
        self.put(refused(problem))

    def close(self) -> None:
        """End the connection when all answers have been sent."""
        self._closing = True
        self._changed.set()

    async def say_last(self, answer: Any) -> None:
        """Send an answer, and end the connection with it."""
        self.put(answer)
        self.close()
        await asyncio.Event().wait()

    async def send_all(self) -> None:
        """Send the answers as they come, until the connection is to be closed."""
        while not self._closing or self._waiting:
            await self._changed.wait()
            self._changed.clear()
            while self._waiting:
                _, data = self._waiting.popleft()
                if isinstance(data, bytes):
                    await self._socket.send_bytes(data)
                else:
                    await self._socket.send_text(data)
        await self._socket.close()

    async def _receive(self, kind: Any, handle: Callable[[Any], Awaitable[None]]) -> None:
        rate = RateLimit(RATE_WINDOW_S * self._settings.messages_a_second, 1000 * RATE_WINDOW_S)
        while True:
            try:
                await handle(await next_message(self._socket, kind, self._settings.most_body))
            except MotorcadeError as problem:
                self.refuse(problem)
            if not rate.allows(to_ticks(self._settings.clock())):
                too_many = MotorcadeError("too-many-messages", most=self._settings.messages_a_second)
                self.refuse(too_many, closing=True)
                await asyncio.Event().wait()


@asynccontextmanager
async def accepted(
    socket: WebSocket, settings: ServerSettings, newest: tuple[type, ...] = ()
) -> AsyncIterator[PageSocket]:
    """Accept the connection of a page. Where the block raises MotorcadeError the page is sent that, as its last answer.

    A browser gives its page no reason where a connection is refused before it is accepted.
    """
    await socket.accept()
    page = PageSocket(socket, settings, newest)
    try:
        yield page
    except MotorcadeError as problem:
        page.refuse(problem, closing=True)
        with suppress(WebSocketDisconnect):
            await page.send_all()


async def next_message(socket: WebSocket, kind: type[_T], most_characters: int) -> _T:
    """Receive the next message of a page, in JSON.

    Raises:
        MotorcadeError: it isn't a message of ``kind``, or is longer than ``most_characters``.
        WebSocketDisconnect: the page has left.
    """
    received = await socket.receive()
    if received["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(received.get("code", 1006))
    text = received.get("text")
    if text is None:
        raise MotorcadeError("bad-message", reason="it is no text")
    if len(text) > most_characters:
        raise MotorcadeError("message-too-long", most=most_characters)
    return decode(text.encode(), kind)
