"""A driver's two connections to a car: four bytes a command, and frames of JSON that tell and ask."""

import asyncio
import json
import os
import socket
import ssl
import struct
from collections import deque
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any, NamedTuple

from motorcade.drive.car_failures import CarAwayError, CarError, CarNotFoundError, CarNotTrustedError, CarRefusesError

_MOST_FRAME_BYTES = 1 << 16
_ANSWER_S = 3.0
_JOIN = "join"
_SIZE = struct.Struct(">I")
_WORD = struct.Struct(">I")


class Address(NamedTuple):
    """Where a car is, and how it is spoken to.

    Attributes:
        host, port: where it takes commands.
        telemetry_port: where it tells what it does; None where it doesn't.
        tls: for a car that wants keys.
        name: what its certificate calls it.
    """

    host: str
    port: int
    telemetry_port: int | None
    tls: ssl.SSLContext | None = None
    name: str | None = None

    def __str__(self) -> str:
        return f"{self.host}:{self.port}"


_Stream = tuple[asyncio.StreamReader, asyncio.StreamWriter]


class Connection:
    """Both connections, open; `connected` opens and closes them."""

    def __init__(self, address: Address, commands: _Stream, telling: _Stream | None) -> None:
        self._address = address
        self._commands = commands
        self._telling = telling
        self._asked: deque[asyncio.Future[dict[str, Any]]] = deque()

    @property
    def is_free(self) -> bool:
        """Whether a command would leave now; else it would wait behind the one before it."""
        return not self._commands[1].transport.get_write_buffer_size()

    def send(self, word: int) -> None:
        """Send a DRIVE word."""
        self._commands[1].write(_WORD.pack(word))

    async def ask(self, **request: Any) -> dict[str, Any]:
        """Send a request, and wait for its answer. Raises CarError where there is none, or the car says no."""
        answer = self.ask_only(**request)
        try:
            async with asyncio.timeout(_ANSWER_S):
                said = await answer
        except TimeoutError:
            raise CarAwayError("hung-up", car=str(self._address), detail="it doesn't answer") from None
        if not said.get("ok"):
            raise refusal(self._address, said)
        return said

    def ask_only(self, **request: Any) -> asyncio.Future[dict[str, Any]]:
        """Send a request; the answer comes later. Raises CarAwayError where the car takes none."""
        if self._telling is None:
            raise CarAwayError("takes-no-requests", car=str(self._address))
        answer: asyncio.Future[dict[str, Any]] = asyncio.get_running_loop().create_future()
        if request["do"] != _JOIN:
            self._asked.append(answer)
        text = json.dumps(request).encode()
        self._telling[1].write(_SIZE.pack(len(text)) + text)
        return answer

    def join(self) -> None:
        """Tell the car that both connections are one client's; behind a proxy it finds that out by itself."""
        # A car that hung up at once has left no address.
        here = self._commands[1].get_extra_info("sockname")
        if self._telling and here:
            self.ask_only(do=_JOIN, port=here[1])

    async def told(self) -> AsyncIterator[dict[str, Any]]:
        """The car's telemetry, frame by frame, until the connection ends, which is an EOFError or OSError."""
        if self._telling is None:
            return
        reader, _ = self._telling
        while True:
            (size,) = _SIZE.unpack(await reader.readexactly(_SIZE.size))
            if size > _MOST_FRAME_BYTES:
                raise ValueError("what it tells is no telemetry")
            frame = json.loads(await reader.readexactly(size))
            if frame.get("kind") == "telemetry":
                yield frame
            elif frame.get("do") is None:
                raise refusal(self._address, frame)
            elif frame["do"] != _JOIN:
                # That one's answer comes out of turn.
                self._answer(frame)

    def _answer(self, frame: dict[str, Any]) -> None:
        # The car answers in turn; who no longer waits had its turn too.
        answer = self._asked.popleft() if self._asked else None
        if answer and not answer.done():
            answer.set_result(frame)

    async def ended(self) -> None:
        """Wait until the car hangs up, which is an EOFError; it sends nothing to where its commands come from."""
        reader, _ = self._commands
        while await reader.read(1024):
            pass
        raise EOFError("the connection ended")


@asynccontextmanager
async def connected(address: Address, patience_s: float) -> AsyncIterator[Connection]:
    """Connections to a car; whatever then goes wrong with them is for `failure` to tell."""
    streams: list[_Stream] = []
    try:
        async with asyncio.timeout(patience_s):
            for port in (address.port, address.telemetry_port):
                if port is not None:
                    opening = asyncio.open_connection(address.host, port, ssl=address.tls, server_hostname=address.name)
                    streams.append(await opening)
        yield Connection(address, streams[0], streams[1] if len(streams) > 1 else None)
    finally:
        for _, writer in streams:
            # What hasn't left yet would only come too late.
            writer.transport.abort()


def refusal(address: Address, answer: dict[str, Any]) -> CarError:
    """What a car says that takes somebody or a request not."""
    return CarRefusesError("refuses", car=str(address), en=str(answer.get("en")), zh=str(answer.get("zh")))


def failure(address: Address, problem: Exception, has_spoken: bool) -> CarError:
    """What became of a connection, as a sentence.

    Args:
        has_spoken: whether the car has told anything in it.
    """
    if isinstance(problem, CarError):
        return problem
    car, detail = str(address), str(problem) or type(problem).__name__
    if isinstance(problem, ssl.SSLCertVerificationError):
        return CarNotTrustedError("not-trusted", car=car, detail=problem.verify_message)
    if isinstance(problem, ssl.SSLError):
        reason = problem.reason or detail
        if "ALERT" in reason:
            return CarRefusesError("keys-refused", car=car, detail=reason.lower().replace("_", " "))
        return CarNotFoundError("speaks-no-tls", car=car, detail=reason.lower().replace("_", " "))
    if isinstance(problem, socket.gaierror | UnicodeError):
        return CarNotFoundError("no-such-host", car=address.host)
    if isinstance(problem, EOFError | ConnectionResetError | BrokenPipeError | ValueError):
        if address.tls and not has_spoken:
            # By TLS 1.3 a car looks at a driver's keys when the connection stands already, and hangs up.
            return CarRefusesError("keys-refused", car=car, detail="it hangs up")
        return CarAwayError("hung-up", car=car, detail="the connection ended")
    if isinstance(problem, TimeoutError):
        detail = "it takes too long"
        if address.tls:
            return CarNotFoundError("speaks-no-tls", car=car, detail=detail)
    elif isinstance(problem, OSError) and problem.strerror:
        detail = os.strerror(problem.errno) if problem.errno else problem.strerror
    return CarNotFoundError("no-car-there", car=car, detail=detail)
