"""A driver's two connections to a car: one for commands, and one for telemetry and requests; and why they fail.

A car without keys takes any bytes for commands, so nothing is sent before it is clear what the car takes. Such a car
sends telemetry at once; one that requires keys is silent until TLS begins. So the telemetry port is called first, and
the port for commands only when telemetry comes.
"""

import asyncio
import socket
import ssl
from collections import deque
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from typing import Any, NamedTuple

from motorcade.drive.wire import MOST_FRAME_BYTES, SessionError, pack_frame, pack_word, take_frames, unpack_frame
from motorcade.errors import DriveError, Phrase

_CONNECT_S = _ANSWER_S = 3.0
# A car that says nothing for so long takes keys.
_GREETING_S = 0.5
# Before it counts as a car that takes none, or as one that has refused them, a slow network has more time.
_SILENT_S = 1.5
_CHUNK_BYTES = 1 << 12
# A car sends ten frames of telemetry a second, and answers; it sends nothing where it takes commands but the reason why
# it refuses them.
_MOST_FRAMES_A_SECOND = 200
_MOST_BESIDE_COMMANDS = 1 << 16
_JOIN = "join"


class LastingDriveError(DriveError):
    """What fails doesn't go away by trying again."""


class AwayError(DriveError):
    """The car can't be reached for a while."""


class CarRefusesError(DriveError):
    """The car refuses this driver, or a request."""


class CarSentence:
    """A sentence that a car sent, as a detail of an error; the car's answer has it by language."""

    def __init__(self, answer: dict[str, Any]) -> None:
        self._sentences = answer

    def sentence(self, language: str = "en") -> str:
        """The sentence in ``language``, or in English."""
        return str(self._sentences.get(language) or self._sentences.get("en"))

    __str__ = sentence


class Address(NamedTuple):
    """Where a car is, and how to connect to it.

    Attributes:
        host, port: where it takes commands.
        telemetry_port: where it sends telemetry; None where it doesn't.
        tls: for a car that requires keys.
        name: the name in its certificate.
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
    """Both connections, open; `connected` opens and closes them. ``greeting`` has come by the one for telemetry."""

    def __init__(
        self, address: Address, commands: _Stream, telemetry: _Stream | None = None, greeting: bytes = b""
    ) -> None:
        self._address = address
        self._commands = commands
        self._telemetry = telemetry
        self._greeting = greeting
        self._answers: deque[asyncio.Future[dict[str, Any]]] = deque()
        self._sent = 0

    @property
    def is_free(self) -> bool:
        """Whether a command would be sent now; else it would wait behind the one before it."""
        return not self._commands[1].transport.get_write_buffer_size()

    def send(self, word: int) -> None:
        """Send a DRIVE word, the first one twice: a car believes two words at once, and one after a while."""
        times = 2
        if self._sent:
            times = 1
        self._sent += times
        self._commands[1].write(pack_word(word) * times)

    async def ask(self, **request: Any) -> dict[str, Any]:
        """Send a request, and wait for its answer. Raises DriveError where there is none, or the car refuses."""
        waiting = self.send_request(**request)
        try:
            async with asyncio.timeout(_ANSWER_S):
                answer = await waiting
        except TimeoutError:
            raise DriveError("hung-up", car=str(self._address), detail=Phrase("gives-no-answer")) from None
        if not answer.get("ok"):
            raise _refusal(self._address, answer)
        return answer

    def send_request(self, **request: Any) -> asyncio.Future[dict[str, Any]]:
        """Send a request. Returns the answer that will come. Raises DriveError where the car takes no requests."""
        if self._telemetry is None:
            raise DriveError("takes-no-requests", car=str(self._address))
        answer: asyncio.Future[dict[str, Any]] = asyncio.get_running_loop().create_future()
        if request["do"] != _JOIN:
            self._answers.append(answer)
        self._telemetry[1].write(pack_frame(request))
        return answer

    def answer_clock(self, clock: int, stamp: int) -> None:
        """Answer the car's clock with ``stamp`` and the number of words sent, so that it believes stamps again."""
        self.send_request(do="sync", clock=clock, words=self._sent, stamp=stamp)

    async def telemetry(self) -> AsyncIterator[dict[str, Any]]:
        """The car's telemetry, frame by frame, until the connection ends.

        Raises EOFError, OSError, ValueError, SessionError.
        """
        if self._telemetry is None:
            return
        received, since_s, count = bytearray(), 0.0, 0
        data = self._greeting
        while data:
            received += data
            # A read of what has come already gives nobody else a turn.
            await asyncio.sleep(0)
            now_s = asyncio.get_running_loop().time()
            if now_s - since_s >= 1.0:
                since_s, count = now_s, 0
            for text in take_frames(received, MOST_FRAME_BYTES):
                count += 1
                if count > _MOST_FRAMES_A_SECOND:
                    raise ValueError(f"more than {_MOST_FRAMES_A_SECOND} frames a second")
                frame = unpack_frame(text)
                if frame.get("kind") == "telemetry":
                    yield frame
                elif frame.get("do") is None:
                    raise _refusal(self._address, frame)
                # The car answers in order, also requests whose sender no longer waits; but "join" maybe later.
                elif frame["do"] != _JOIN and self._answers and not (answer := self._answers.popleft()).done():
                    answer.set_result(frame)
            data = await self._telemetry[0].read(_CHUNK_BYTES)
        raise EOFError("the connection ended")

    async def ended(self) -> None:
        """Wait until the car hangs up the connection for commands. Raises EOFError then, or OSError."""
        reader, left_bytes = self._commands[0], _MOST_BESIDE_COMMANDS
        while left_bytes > 0 and (data := await reader.read(_CHUNK_BYTES)):
            left_bytes -= len(data)
        raise EOFError("the connection ended")


@asynccontextmanager
async def connected(address: Address, takes_keys: bool = False) -> AsyncIterator[Connection]:
    """Connect to a car while the block runs. Raises what `to_error` translates.

    ``takes_keys``: whether the car has proved before that it takes keys; it is not asked again then.
    """
    streams: list[_Stream] = []
    try:
        telemetry, greeting = None, b""
        if address.telemetry_port is not None:
            telemetry = await _open_telemetry(address)
            streams.append(telemetry)
            greeting = await _greeting(address, telemetry, takes_keys)
        async with asyncio.timeout(_CONNECT_S):
            opening = asyncio.open_connection(address.host, address.port, ssl=address.tls, server_hostname=address.name)
            commands = await opening
        streams.append(commands)
        connection = Connection(address, commands, telemetry, greeting)
        # So the car knows that both belong to one client, which it finds out by itself behind a proxy. The socket has
        # no address any more where the car hung up at once.
        if telemetry and (here := commands[1].get_extra_info("sockname")):
            connection.send_request(do=_JOIN, port=here[1])
        yield connection
    finally:
        for _, writer in streams:
            # What hasn't been sent yet would only arrive too late.
            writer.transport.abort()


async def _open_telemetry(address: Address) -> _Stream:
    """Connect to the telemetry port, and send nothing. Raises DriveError where commands alone are taken, or OSError."""
    try:
        async with asyncio.timeout(_CONNECT_S):
            return await asyncio.open_connection(address.host, address.telemetry_port)
    except OSError as problem:
        if isinstance(problem, socket.gaierror):
            raise
        async with asyncio.timeout(_CONNECT_S):
            _, writer = await asyncio.open_connection(address.host, address.port)
        writer.transport.abort()
        raise _no_telemetry(address, problem) from None


async def _greeting(address: Address, telemetry: _Stream, takes_keys: bool) -> bytes:
    """Begin TLS at the telemetry port of a car that takes keys, and return the first telemetry.

    Raises what `to_error` translates: the car takes no keys, or requires them.
    """
    reader, writer = telemetry
    if address.tls and not takes_keys:
        with suppress(TimeoutError):
            async with asyncio.timeout(_GREETING_S):
                if await reader.read(_CHUNK_BYTES):
                    raise DriveError("speaks-no-tls", car=str(address), detail=Phrase("sends-without-tls"))
                raise EOFError
    if address.tls:
        await writer.start_tls(address.tls, server_hostname=address.name, ssl_handshake_timeout=_CONNECT_S)
    try:
        async with asyncio.timeout(_SILENT_S):
            greeting = await reader.read(_CHUNK_BYTES)
    except TimeoutError:
        raise DriveError("says-nothing", car=str(address), port=address.telemetry_port) from None
    if not greeting:
        raise EOFError
    return greeting


def _no_telemetry(address: Address, problem: OSError) -> DriveError:
    detail: OSError | Phrase = problem
    if isinstance(problem, TimeoutError):
        detail = Phrase("takes-too-long")
    return DriveError("no-telemetry", car=str(address), port=address.telemetry_port, detail=detail)


def to_error(address: Address, problem: Exception, has_telemetry: bool) -> DriveError:
    """The error for what ended a connection; ``has_telemetry``: the car has sent some in it."""
    if isinstance(problem, DriveError):
        return problem
    car = str(address)
    detail: object = str(problem) or type(problem).__name__
    if isinstance(problem, ssl.SSLCertVerificationError):
        return LastingDriveError("not-trusted", car=car, detail=problem.verify_message)
    if isinstance(problem, ssl.SSLError):
        reason = (problem.reason or str(detail)).lower().replace("_", " ")
        if "alert" in reason:
            return CarRefusesError("keys-refused", car=car, detail=reason)
        return DriveError("speaks-no-tls", car=car, detail=reason)
    if isinstance(problem, socket.gaierror | UnicodeError):
        return LastingDriveError("no-such-host", car=address.host)
    if isinstance(problem, EOFError | ConnectionResetError | BrokenPipeError | ValueError | SessionError):
        if address.tls and not has_telemetry:
            # By TLS 1.3 a car checks a driver's keys when the connection is made already, and hangs up.
            return CarRefusesError("keys-refused", car=car, detail=Phrase("hangs-up"))
        return DriveError("hung-up", car=car, detail=Phrase("connection-ended"))
    if isinstance(problem, TimeoutError):
        detail = Phrase("takes-too-long")
        if address.tls:
            return DriveError("speaks-no-tls", car=car, detail=detail)
    elif isinstance(problem, OSError):
        detail = problem
    return DriveError("no-car-there", car=car, detail=detail)


def _refusal(address: Address, answer: dict[str, Any]) -> DriveError:
    return CarRefusesError("refuses", car=str(address), reason=CarSentence(answer))
