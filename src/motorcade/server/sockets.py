"""WebSockets: what a page says next, and the jobs that end with its connection."""

from collections.abc import Awaitable, Callable, Iterable
from contextlib import suppress
from typing import TypeVar

from anyio import create_task_group
from starlette.websockets import WebSocket, WebSocketDisconnect

from motorcade.server.errors import ServerError
from motorcade.server.http import decoded

T = TypeVar("T")


async def heard(socket: WebSocket, kind: type[T], most: int) -> T:
    """What the page says next: a message of some kind, in JSON of at most so many characters.

    Raises:
        ServerError: it says something else.
        WebSocketDisconnect: it has left.
    """
    received = await socket.receive()
    if received["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(received.get("code", 1006))
    text = received.get("text")
    if text is None:
        raise ServerError("bad-message", reason="it is no text")
    if len(text) > most:
        raise ServerError("message-too-long", most=most)
    return decoded(text.encode(), kind)


async def until_one_ends(jobs: Iterable[Callable[[], Awaitable[None]]]) -> None:
    """Do all jobs at once; as soon as one is over or the page has left, the others are cancelled."""
    async with create_task_group() as group:

        async def end_all_with(job: Callable[[], Awaitable[None]]) -> None:
            with suppress(WebSocketDisconnect):
                await job()
            group.cancel_scope.cancel()

        for job in jobs:
            group.start_soon(end_all_with, job)
