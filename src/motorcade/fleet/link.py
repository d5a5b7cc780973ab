"""A connection to one car, by a network or a serial port: requests and their answers, and one upload beside them.

The other end may be anything. It is read in pieces of at most 4 KiB, so that others who use the event loop have their
turns; and it is no car once it has sent more, or more lines, that are no answers than a board that starts may send.
"""

import asyncio
import secrets
import socket
import ssl
import threading
from collections.abc import Callable
from contextlib import closing, suppress
from time import monotonic

import serial

from motorcade.errors import MotorcadeError, TransferError
from motorcade.fleet.places import Place, network_place
from motorcade.timing import monotonic_ms
from motorcade.upload.serial_port import open_port
from motorcade.upload.transfer import Transfer, UploadTransfer
from motorcade.words.request import car_request, read_answer
from motorcade.words.uploader import printable

CONNECT_S = 1.5
# A microcontroller waits for a moment in which it may stand still, and then computes for a second.
_HANDSHAKE_S = 6.0
# So much is read at once; no line of a car is as long.
_MOST_BYTES = 4096
# A device that says so many lines that are no answers is no car; so many, and so much, in an upload, whose answers are
# among them.
_MOST_LINES = 40
_MOST_LINES_OF_UPLOAD = 1000
_MOST_BYTES_OF_UPLOAD = 1 << 16
# Where the text of a request begins, which a prompt shows, and what erases a character there.
_TEXT_AT = 4
_ERASE = b"\x7f"
# A serial device that sends by itself for so long is no car. Boards say something when they start.
_SILENCE_S = 0.4
_LONGEST_NOISE_S = 3.0

# The fields of a car's answer, or why it refuses.
Answer = dict[str, str] | MotorcadeError


class Link(asyncio.BufferedProtocol):
    """A connection to a car. Use it in one event loop.

    Args:
        baud: of a serial port, bits a second; 0 for a network.

    Attributes:
        ended: done when the connection has ended.
        heard: whether anything came since somebody set it False.
        is_strange: whether what came is so much that is no answer that the other end can't be a car.
    """

    def __init__(self, baud: int) -> None:
        self.ended: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self.heard = self.is_strange = False
        self._baud = baud
        self._number = secrets.randbelow(256)
        # By kind and number of the request.
        self._answers: dict[str, asyncio.Future[Answer]] = {}
        self._rest = self._echo = b""
        self._strange_lines = 0
        self._buffer = bytearray(_MOST_BYTES)
        # What came for an upload since it was looked at; None where there is none. And all that came for it.
        self._uploaded: list[bytes] | None = None
        self._upload_lines = self._upload_bytes = 0
        self._came = asyncio.Event()
        self._transport: asyncio.WriteTransport

    def send(self, kind: str, name: str = "") -> asyncio.Future[Answer]:
        """Send a request at once. Returns its answer to come; it is cancelled where the connection ends first."""
        self._number = self._number + 1 & 255
        answer = self._answers[f"{kind}{self._number:02x}"] = self.ended.get_loop().create_future()
        request = car_request(kind, self._number, name)
        self._echo = request[_TEXT_AT:]
        self._write(request)
        return answer

    async def upload(self, image: bytes, sent: Callable[[int], None]) -> Transfer:
        """Upload an image. Returns the transfer: its outcome, or None where the connection ended, and what it holds."""
        transfer = UploadTransfer(image, self._baud, True, secrets.randbelow(256), sent)
        self._uploaded = []
        self._upload_lines = 0
        self._upload_bytes = 0
        try:
            while True:
                data = b"".join(self._uploaded)
                self._uploaded = []
                self._write(transfer.step(data, monotonic_ms()))
                if transfer.outcome is not None or self.ended.done():
                    return transfer
                if not self._uploaded:
                    await self._more(transfer.rest_ms / 1000)
        finally:
            self._uploaded = None

    async def settle(self) -> None:
        """Wait until a serial device, which may be starting, is silent; one that never is, is strange."""
        end_s = monotonic() + _LONGEST_NOISE_S
        self.heard = True
        while self.heard and not self.is_strange:
            self.heard = False
            self.is_strange = monotonic() > end_s
            await self._more(_SILENCE_S)
        self._strange_lines = 0

    @property
    def address(self) -> str:
        """The other end's address in a network; empty for a serial port."""
        peer = self._transport.get_extra_info("peername")
        if peer:
            return network_place(*peer[:2]).address
        return ""

    def close(self) -> None:
        """End the connection."""
        self._transport.abort()

    async def _more(self, seconds: float) -> None:
        """Wait until bytes have come, the connection has ended, or ``seconds`` have passed."""
        with suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                await self._came.wait()
        self._came.clear()

    def _write(self, data: bytes) -> None:
        if data and not (self.is_strange or self.ended.done()):
            self._transport.write(data)

    # What asyncio calls

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.WriteTransport)
        self._transport = transport

    def connection_lost(self, problem: Exception | None) -> None:
        if not self.ended.done():
            self.ended.set_result(None)
        self._came.set()
        for answer in self._answers.values():
            answer.cancel()

    def get_buffer(self, sizehint: int) -> bytearray:
        return self._buffer

    def buffer_updated(self, nbytes: int) -> None:
        self.heard = True
        data = self._rest + self._buffer[:nbytes]
        if self._echo and self._echo in data:
            # A prompt, such as MicroPython's. Nothing that it was sent ended a line, and it is erased again.
            self._write(_ERASE * len(self._echo))
            self._end_strange()
            return
        *lines, self._rest = data.split(b"\n")
        for line in lines:
            self._take_line(line)
            if self._is_too_much():
                break
        self._came.set()
        if self._is_too_much() or len(self._rest) > _MOST_BYTES:
            self._end_strange()

    def _is_too_much(self) -> bool:
        of_upload = self._upload_lines > _MOST_LINES_OF_UPLOAD or self._upload_bytes > _MOST_BYTES_OF_UPLOAD
        return of_upload or self._strange_lines >= _MOST_LINES

    def _end_strange(self) -> None:
        self.is_strange = True
        self.close()

    def _take_line(self, line: bytes) -> None:
        fields = read_answer(line)
        answered = ""
        if fields:
            answered = fields.get("car", "")
        result: Answer | None = fields
        if not answered and self._uploaded is not None:
            self._uploaded.append(line + b"\n")
            self._upload_lines += 1
            self._upload_bytes += len(line)
            return
        if line.startswith(b"ERR ") and self._answers:
            # A car that doesn't know the request can't say which one it refuses: the first.
            answered = next(iter(self._answers))
            result = _refusal(printable(line[4:]))
        answer = self._answers.pop(answered, None)
        if answer is None or result is None:
            self._strange_lines += 1
            return
        self._strange_lines = 0
        if not answer.done():
            answer.set_result(result)


async def connect(place: Place, tls: ssl.SSLContext | None, baud: int) -> Link:
    """Connect to the car at a place; `Link.settle` what is at a serial port. Raises MotorcadeError."""
    loop = asyncio.get_running_loop()
    try:
        if not place.host:
            port = await asyncio.to_thread(open_port, place.address, baud)
            return (await loop.create_connection(lambda: Link(baud), sock=_socket_of(port)))[1]
        async with asyncio.timeout(CONNECT_S):
            transport, link = await loop.create_connection(lambda: Link(0), place.host, place.port)
        if tls:
            # In the car's keys is its own name, or its address.
            name = place.name or place.host
            starting = loop.start_tls(transport, link, tls, server_hostname=name, ssl_handshake_timeout=_HANDSHAKE_S)
            secured = await starting
            assert secured
            link.connection_made(secured)
    except ssl.SSLError as problem:
        # It answers without TLS.
        code = "car-keys-refused"
        if problem.reason == "WRONG_VERSION_NUMBER":
            code = "car-takes-no-keys"
        raise TransferError(code, address=place.address) from None
    except (OSError, UnicodeError) as problem:
        # UnicodeError: no host can have that name.
        raise TransferError("no-car-at-address", port=place.address, reason=problem) from None
    return link


def _socket_of(port: serial.Serial) -> socket.socket:
    """Return a socket that is the other end of a serial port, whose bytes two threads carry until either end closes."""
    ours, theirs = socket.socketpair()

    def write() -> None:
        # A port that is gone, or that keeps its writer waiting, ends the connection.
        with suppress(OSError), closing(port), closing(theirs):
            while data := theirs.recv(_MOST_BYTES):
                port.write(data)

    def read() -> None:
        # pyserial raises TypeError where a port is closed meanwhile.
        with suppress(OSError, TypeError):
            while True:
                theirs.sendall(port.read(max(1, port.in_waiting)))
        with suppress(OSError):
            theirs.shutdown(socket.SHUT_RDWR)

    for carry in (write, read):
        threading.Thread(target=carry, name="serial port", daemon=True).start()
    return ours


def _refusal(reason: str) -> MotorcadeError:
    if reason.startswith("name-"):
        return TransferError("car-keeps-no-name")
    if reason.startswith("image-header"):
        return TransferError("car-old-protocol")
    return TransferError("car-refuses", reason=reason)
