"""Uploads through a port of the page's own: its bytes travel over a WebSocket, what they mean stays here."""

import asyncio
import secrets
from collections.abc import Callable
from contextlib import suppress
from types import TracebackType
from typing import Any, Self

from starlette.websockets import WebSocket

from motorcade.errors import MotorcadeError
from motorcade.program.diagnostics import LANGUAGES
from motorcade.upload.transfer import (
    ReadbackTransfer,
    Retry,
    Transfer,
    UploadTransfer,
    holds_phrase,
    readback_error,
    upload_error,
)
from motorcade.words.ticks import TICKS_MASK
from motorcade.words.upload import Outcome

WEB_SERIAL = "Web Serial"
_READ_S = 0.02
# No board says so much; who does is no board.
_MOST_BYTES = 1 << 16


class WebSerialTransfer:
    """A page with an open port, as a context: binary messages to it go to the port, those from it came from there."""

    def __init__(self, socket: WebSocket, baud: int, clock: Callable[[], float]):
        self._socket = socket
        self._baud = baud
        self._clock = clock
        self._came: asyncio.Queue[bytes | None] = asyncio.Queue()

    async def __aenter__(self) -> Self:
        self._listening = asyncio.create_task(self._listen())
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._listening.cancel()
        with suppress(asyncio.CancelledError):
            await self._listening

    async def upload(self, image: bytes, verify: bool, tell: Callable[[dict[str, Any]], None]) -> str:
        """The car's answer to ``image``; ``tell`` hears how it goes on. Raises MotorcadeError."""
        talk = UploadTransfer(
            image,
            self._baud,
            verify,
            secrets.randbelow(256),
            sent=lambda count: tell({"sent": count, "of": len(image)}),
            retrying=lambda retry: tell(retry_told(retry, len(image))),
        )
        outcome = await self._held(talk)
        if failure := upload_error(WEB_SERIAL, outcome, talk.holds):
            raise failure
        return str(outcome.detail)

    async def readback(self) -> bytes:
        """The car's image. Raises MotorcadeError."""
        outcome = await self._held(ReadbackTransfer(self._baud))
        if failure := readback_error(WEB_SERIAL, outcome):
            raise failure
        return bytes(outcome.detail)

    async def _held(self, talk: Transfer) -> Outcome:
        """The outcome of ``talk``."""
        data = b""
        while True:
            message = talk.step(data, int(self._clock() * 1000) & TICKS_MASK)
            if talk.outcome is not None:
                return talk.outcome
            if message:
                await self._socket.send_bytes(message)
            data = await self._read(talk)

    async def _listen(self) -> None:
        count = 0
        # Whoever says something else than bytes has left, or has lost its way.
        while count <= _MOST_BYTES and (data := (await self._socket.receive()).get("bytes")):
            count += len(data)
            self._came.put_nowait(data)
        self._came.put_nowait(None)

    async def _read(self, talk: Transfer) -> bytes:
        """The bytes that come next, none where none come in time. Raises MotorcadeError: the page has left."""
        try:
            data = await asyncio.wait_for(self._came.get(), min(talk.rest_ms / 1000, _READ_S))
        except TimeoutError:
            return b""
        if data is None:
            raise MotorcadeError("went-away", port=WEB_SERIAL, holds=holds_phrase(talk.holds))
        return data


def retry_told(retry: Retry, size: int) -> dict[str, Any]:
    """What a page is told of another try to send ``size`` bytes."""
    sentences = {language: retry.sentence(language) for language in LANGUAGES}
    return {"sent": 0, "of": size, "retry": {"number": retry.number, "of": retry.of, "message": sentences}}
