"""A connection to one car, by a network or a serial port: requests and their answers, and one upload beside them."""

import asyncio
import secrets
import ssl
import threading
from collections.abc import Callable
from contextlib import suppress

import serial

from motorcade.errors import MotorcadeError
from motorcade.fleet.places import Place
from motorcade.timing import monotonic_ms
from motorcade.upload.serial_port import open_error, open_port
from motorcade.upload.transfer import Retry, Transfer, UploadTransfer
from motorcade.words.request import car_request, read_answer
from motorcade.words.upload import printable

CONNECT_S = 1.5
# A device that says so much, or so many lines, that are no answers is no car.
_MOST_BYTES = 4096
_MOST_LINES = 40
_MOST_UNANSWERED = 8
# A serial device that sends by itself for so long is no car. Boards say something when they start.
_SILENCE_S, _LONGEST_NOISE_S = 0.4, 3.0


class Link(asyncio.Protocol):
    """A connection to a car. Use it in one event loop.

    Attributes:
        closed: whether the connection has ended.
        strange: how many lines came that are no answers.
        heard: whether anything came.
    """

    baud = 0

    def __init__(self) -> None:
        self.closed = False
        self.strange = 0
        self.heard = False
        self._number = secrets.randbelow(256)
        self._answers: dict[str, asyncio.Future[dict[str, str]]] = {}
        self._rest = b""
        self._uploading = False
        self._uploaded = b""
        self._waiting: asyncio.Future[None] | None = None
        self._pausing: asyncio.Future[None] | None = None
        self._transport: asyncio.WriteTransport | None = None

    def send(self, kind: str, name: str = "") -> "asyncio.Future[dict[str, str]]":
        """Send a request at once. Returns its answer to come: the fields, or MotorcadeError where the car refuses."""
        self._number = self._number + 1 & 255
        answer: asyncio.Future[dict[str, str]] = asyncio.get_running_loop().create_future()
        # Nobody may wait for it.
        answer.add_done_callback(lambda done: None if done.cancelled() else done.exception())
        while len(self._answers) >= _MOST_UNANSWERED:
            self._answers.pop(next(iter(self._answers))).cancel()
        self._answers[f"{kind}{self._number:02x}"] = answer
        self._write(car_request(kind, self._number, name))
        return answer

    async def upload(
        self, image: bytes, sent: Callable[[int], None], retrying: Callable[[Retry], None] = lambda retry: None
    ) -> Transfer:
        """Upload an image. Returns the transfer: its outcome, or None where the connection ended, and what it holds."""
        transfer = UploadTransfer(image, self.baud, True, secrets.randbelow(256), sent, retrying)
        self._uploading, self._uploaded = True, b""
        try:
            while True:
                data, self._uploaded = self._uploaded, b""
                out = transfer.step(data, monotonic_ms())
                if transfer.outcome is not None or self.closed:
                    return transfer
                if out:
                    self._write(out)
                if not self._uploaded:
                    await self._wait(transfer.rest_ms / 1000)
        finally:
            self._uploading = False

    async def pause(self, seconds: float) -> None:
        """Wait for ``seconds``, or until the connection ends; cheaper than asyncio.timeout, for a thousand cars."""
        loop = asyncio.get_running_loop()
        self._pausing = loop.create_future()
        timer = loop.call_later(seconds, _wake, self._pausing)
        try:
            if not self.closed:
                await self._pausing
        finally:
            timer.cancel()

    def close(self) -> None:
        """End the connection."""
        if self._transport:
            self._transport.abort()

    # What asyncio calls

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.WriteTransport)
        self._transport = transport

    def connection_lost(self, problem: Exception | None) -> None:
        self.closed = True
        self._wake()
        _wake(self._pausing)
        for answer in self._answers.values():
            answer.cancel()

    def data_received(self, data: bytes) -> None:
        self.heard = True
        *lines, self._rest = (self._rest + data).split(b"\n")
        if len(self._rest) > _MOST_BYTES:
            self.strange += _MOST_LINES
            self._rest = b""
        for line in lines:
            self._take_line(line)
        self._wake()
        if self.is_strange:
            self.close()

    @property
    def is_strange(self) -> bool:
        """Whether what came is so much that is no answer that the other end can't be a car."""
        return self.strange >= _MOST_LINES

    def _take_line(self, line: bytes) -> None:
        fields = read_answer(line)
        answer = self._answers.pop(fields["car"], None) if fields and "car" in fields else None
        if answer and fields:
            self.strange = 0
            if not answer.done():
                answer.set_result(fields)
        elif self._uploading:
            self._uploaded += line + b"\n"
        elif line.startswith(b"ERR ") and self._answers:
            refused = self._answers.pop(next(iter(self._answers)))
            if not refused.done():
                refused.set_exception(_refusal(printable(line[4:])))
        else:
            self.strange += 1

    def _write(self, data: bytes) -> None:
        if self._transport and not self.closed:
            self._transport.write(data)

    async def _wait(self, seconds: float) -> None:
        """Wait until bytes have come, the connection has ended, or ``seconds`` have passed."""
        loop = asyncio.get_running_loop()
        self._waiting = loop.create_future()
        timer = loop.call_later(seconds, _wake, self._waiting)
        try:
            await self._waiting
        finally:
            timer.cancel()

    def _wake(self) -> None:
        _wake(self._waiting)


class SerialLink(Link):
    """A connection to a car at a serial port, which a thread reads."""

    def __init__(self, port: serial.Serial, baud: int) -> None:
        super().__init__()
        self.baud = baud
        self._port = port
        self._loop = asyncio.get_running_loop()
        threading.Thread(target=self._read, name="serial port", daemon=True).start()

    async def settle(self) -> None:
        """Wait until the device is silent; a device that never is, is strange."""
        loop = asyncio.get_running_loop()
        end_s = loop.time() + _LONGEST_NOISE_S
        while not self.closed and loop.time() < end_s:
            self.heard = False
            await self._wait(_SILENCE_S)
            if not self.heard:
                self.strange = 0
                return
        self.strange = _MOST_LINES

    def close(self) -> None:
        self.closed = True

    def _write(self, data: bytes) -> None:
        # A port may keep a writer waiting.
        if not self.closed:
            self._loop.run_in_executor(None, self._write_all, data)

    def _write_all(self, data: bytes) -> None:
        try:
            self._port.write(data)
        except OSError:
            self._end()

    def _read(self) -> None:
        try:
            while not self.closed:
                if data := self._port.read(max(1, self._port.in_waiting)):
                    self._loop.call_soon_threadsafe(self.data_received, data)
        except (OSError, RuntimeError, TypeError):
            # The cable is pulled, or the loop has ended.
            pass
        finally:
            with suppress(OSError):
                self._port.close()
            self._end()

    def _end(self) -> None:
        with suppress(RuntimeError):
            self._loop.call_soon_threadsafe(self.connection_lost, None)


def _wake(waiting: "asyncio.Future[None] | None") -> None:
    if waiting and not waiting.done():
        waiting.set_result(None)


async def connect(place: Place, tls: ssl.SSLContext | None, baud: int) -> Link:
    """Connect to the car at a place. Raises MotorcadeError, OSError or TimeoutError."""
    loop = asyncio.get_running_loop()
    if not place.host:
        port = SerialLink(await asyncio.to_thread(open_port, place.address, baud), baud)
        try:
            await port.settle()
        except BaseException:
            port.close()
            raise
        return port
    # The name in a car's keys is its own, or its address.
    name = (place.name or place.host) if tls else None
    async with asyncio.timeout(CONNECT_S):
        _, link = await loop.create_connection(Link, place.host, place.port, ssl=tls, server_hostname=name)
    return link


def connect_problem(place: Place, problem: Exception) -> MotorcadeError:
    """Return the error for what `connect` raised."""
    if isinstance(problem, MotorcadeError):
        return problem
    if isinstance(problem, ssl.SSLError):
        return MotorcadeError("car-keys-refused", address=place.address)
    if place.host:
        return MotorcadeError("no-car-at-address", port=place.address)
    return open_error(place.address, problem)


def _refusal(reason: str) -> MotorcadeError:
    if reason.startswith("name-"):
        return MotorcadeError("car-keeps-no-name")
    if reason.startswith("image-header"):
        return MotorcadeError("car-old-protocol")
    return MotorcadeError("car-refuses", reason=reason)
