"""Uploads through a port of the page's own: its bytes travel over a WebSocket, what they mean stays here."""

import asyncio
from collections.abc import Callable
from contextlib import suppress
from types import TracebackType
from typing import Self

from starlette.websockets import WebSocket

from motorcade.link.failures import NoAnswerError, readback_failure, upload_failure
from motorcade.words.ticks import TICKS_MASK
from motorcade.words.upload import READBACK_REQUEST, SILENCE_MS, Outcome, ReadbackEnd, UploaderEnd

WEB_SERIAL = "Web Serial"
_CHUNK_BYTES = 64
_BITS_A_BYTE = 10
_READ_S = 0.02
SETTLE_S = SILENCE_MS / 1000 + 0.1
_LONGEST_SETTLE_S = 3.0
# No board says so much; who does is no board.
_MOST_BYTES = 1 << 16


class Carrier:
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

    async def upload(self, image: bytes, verify: bool) -> str:
        """The car's answer to ``image``. Raises PortError."""
        await self._settle()
        end = UploaderEnd(image, verify)
        for begin in range(0, len(image), _CHUNK_BYTES):
            chunk = image[begin : begin + _CHUNK_BYTES]
            await self._socket.send_bytes(chunk)
            # As fast as the line, so that progress and the answer's deadline are the line's.
            await asyncio.sleep(len(chunk) * _BITS_A_BYTE / self._baud)
            await self._socket.send_json({"sent": begin + len(chunk), "of": len(image)})
        end.finish_sending(self._now_ms())
        outcome = await self._outcome(end)
        if failure := upload_failure(WEB_SERIAL, outcome.kind, outcome.detail):
            raise failure
        return str(outcome.detail)

    async def readback(self) -> bytes:
        """The car's image. Raises PortError."""
        await self._settle()
        await self._socket.send_bytes(READBACK_REQUEST)
        outcome = await self._outcome(ReadbackEnd(self._now_ms()))
        if failure := readback_failure(WEB_SERIAL, outcome.kind, outcome.detail):
            raise failure
        return bytes(outcome.detail)

    async def _listen(self) -> None:
        count = 0
        # Whoever says something else than bytes has left, or has lost its way.
        while count <= _MOST_BYTES and (data := (await self._socket.receive()).get("bytes")):
            count += len(data)
            self._came.put_nowait(data)
        self._came.put_nowait(None)

    async def _read(self, seconds: float) -> bytes:
        """The bytes that come next, none where none come in time. Raises NoAnswerError: the page has left."""
        try:
            data = await asyncio.wait_for(self._came.get(), seconds)
        except TimeoutError:
            return b""
        if data is None:
            raise NoAnswerError("went-away", port=WEB_SERIAL)
        return data

    async def _settle(self) -> None:
        """Wait until the car has forgotten whatever reached it before, and told so."""
        end_s = self._clock() + _LONGEST_SETTLE_S
        while await self._read(SETTLE_S) and self._clock() < end_s:
            pass

    async def _outcome(self, end: UploaderEnd | ReadbackEnd) -> Outcome:
        outcome: Outcome | None = end.next_event()
        while outcome is None:
            end.receive_data(await self._read(_READ_S), self._now_ms())
            outcome = end.next_event()
        return outcome

    def _now_ms(self) -> int:
        return int(self._clock() * 1000) & TICKS_MASK
