"""The car's end of a serial line on a computer: a serial port, a pseudo-terminal, a TCP port, or none.

pyserial reaches the TCP port as ``socket://HOST:PORT``. Uploads come by these lines.
"""

import contextlib
import os
import select
import selectors
import socket
import sys
import time
from collections import deque
from collections.abc import Callable
from ssl import SSLWantReadError, SSLWantWriteError
from typing import TYPE_CHECKING

from motorcade.errors import MotorcadeError
from motorcade.sockets import listen
from motorcade.words.request import split_requests
from motorcade.words.upload import error_line

if TYPE_CHECKING:
    import ssl

    import serial

_CHUNK_BYTES = 4096
# How many clients wait for their turn to upload or send requests, and how many requests for their answers.
_MAX_CLIENTS = 16
_MAX_REQUESTS = 64
_RETRY_S = 1.0
# Longer than any pause of an uploader, which waits two seconds for an answer.
_IDLE_S = 5.0


class LineError(MotorcadeError):
    """A line that the car can't open."""


class Line:
    """The car's end of a line. This class has no other end; it serves a car that takes no uploads.

    Attributes:
        sender: see `motorcade.car.board.Board`.
    """

    sender = 0

    def wait(self, seconds: float) -> None:
        """Wait until bytes may be there, or ``seconds`` have passed."""
        time.sleep(seconds)

    def read(self) -> bytes:
        """Return the bytes that are there, ``b""`` for none; never wait."""
        return b""

    def write(self, data: bytes) -> None:
        """Send ``data``; it is lost where nobody is connected."""

    def answer_requests(self, answer: Callable[[bytes], bytes]) -> bool:
        """See `motorcade.car.board.Board`."""
        return False

    def close(self) -> None:
        """Close the line."""


class SerialLine(Line):
    """A serial port, such as a UART, a USB gadget's port or a voice module's.

    A port that goes away, as one on a USB cable does, is opened again once a second; reading then gives ``b""``.
    A car's tick is so short that bytes don't have to end ``wait``.

    Args:
        open_port: opens the port with a read timeout of 0. Raises serial.SerialException where it isn't there.
        clock_s: a clock in seconds.

    Raises:
        serial.SerialException: the port isn't there at the start.
    """

    def __init__(self, open_port: "Callable[[], serial.Serial]", clock_s: Callable[[], float]) -> None:
        self._open_port = open_port
        self._clock_s = clock_s
        self._last_try_s = clock_s()
        self._port: serial.Serial | None = open_port()

    def read(self) -> bytes:
        port = self._reopened()
        if port is None:
            return b""
        try:
            return bytes(port.read(port.in_waiting or 1))
        except OSError:
            self._drop()
            return b""

    def write(self, data: bytes) -> None:
        from serial import SerialTimeoutException

        port = self._reopened()
        if port is None:
            return
        try:
            port.write(data)
        except SerialTimeoutException:
            return
        except OSError:
            self._drop()

    def close(self) -> None:
        if self._port is not None:
            self._port.close()

    def _reopened(self) -> "serial.Serial | None":
        now_s = self._clock_s()
        if self._port is None and now_s - self._last_try_s >= _RETRY_S:
            self._last_try_s = now_s
            # serial.SerialException is an OSError.
            with contextlib.suppress(OSError):
                self._port = self._open_port()
        return self._port

    def _drop(self) -> None:
        if self._port is not None:
            with contextlib.suppress(OSError):
                self._port.close()
        self._port = None
        self._last_try_s = self._clock_s()


class PseudoTerminal(Line):
    """A pseudo-terminal: a simulated serial port of this computer; POSIX only. ``address`` is its device's path."""

    def __init__(self) -> None:
        if sys.platform == "win32":
            raise LineError("no-pseudo-terminals")
        import pty
        import tty

        # The car keeps the client's end open too: without it the line would hang up with each client that leaves.
        self._car_end, self._client_end = pty.openpty()
        tty.setraw(self._client_end)
        os.set_blocking(self._car_end, False)
        self.address = os.ttyname(self._client_end)

    def wait(self, seconds: float) -> None:
        select.select([self._car_end], [], [], seconds)

    def read(self) -> bytes:
        try:
            return os.read(self._car_end, _CHUNK_BYTES)
        except BlockingIOError:
            return b""

    def write(self, data: bytes) -> None:
        while data:
            try:
                data = data[os.write(self._car_end, data) :]
            except BlockingIOError:
                return

    def close(self) -> None:
        os.close(self._car_end)
        os.close(self._client_end)


class TcpPort(Line):
    """A TCP port. Everybody may send requests; of those who upload one is served, and others are told to wait.

    Args:
        host, port: where it listens; port 0 takes a free one.
        clock_s: a clock in seconds.
        tls: for drivers with keys alone (`motorcade.drive.keys.server_context`); None for none.
        refuses: whether the keys of a connection were revoked.
        selector: shared by the ports of several cars, for who calls the selected keys' data; None for one of its own.

    Attributes:
        address: ``socket://HOST:PORT``, as pyserial reaches it.
        sender: counts uploaders.
    """

    def __init__(
        self,
        host: str,
        port: int,
        clock_s: Callable[[], float] = time.monotonic,
        tls: "ssl.SSLContext | None" = None,
        refuses: "Callable[[ssl.SSLSocket], bool]" = lambda connection: False,
        selector: selectors.BaseSelector | None = None,
    ) -> None:
        try:
            self._listener = listen(host, port)
        except (OSError, UnicodeError) as problem:
            reason = getattr(problem, "strerror", None) or problem
            raise LineError("cannot-listen", host=host, port=port, reason=reason) from None
        self._listener.setblocking(False)
        self._clock_s = clock_s
        self._tls = tls
        self._refuses = refuses
        self._selector = selector or selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ, self._accept)
        self._clients: list[_Client] = []
        self._uploader: _Client | None = None
        self._requests: deque[tuple[_Client, bytes]] = deque()
        self.sender = 0
        bound_host, bound_port = self._listener.getsockname()[:2]
        self.address = f"socket://{f'[{bound_host}]' if ':' in bound_host else bound_host}:{bound_port}"

    @property
    def has_come(self) -> bool:
        """Whether requests or bytes of an upload wait for the car."""
        return bool(self._requests) or (self._uploader is not None and bool(self._uploader.upload))

    def wait(self, seconds: float) -> None:
        for key, _ in self._selector.select(seconds):
            key.data()

    def read(self) -> bytes:
        client = self._uploader
        if client is None:
            return b""
        if self._tls:
            # TLS may hold bytes that no selector sees.
            self._serve(client)
        data, client.upload = client.upload, b""
        if client not in self._clients:
            self._uploader = next((each for each in self._clients if each.upload), None)
            self.sender += 1
        return data

    def write(self, data: bytes) -> None:
        if self._uploader is not None:
            self._send(self._uploader, data)

    def answer_requests(self, answer: Callable[[bytes], bytes]) -> bool:
        had_some = bool(self._requests)
        while self._requests:
            client, request = self._requests.popleft()
            self._send(client, answer(request))
        return had_some

    def close(self) -> None:
        for client in list(self._clients):
            self._drop(client)
        self._selector.unregister(self._listener)
        self._listener.close()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            connection, _ = self._listener.accept()
            connection.setblocking(False)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            if self._tls:
                connection = self._tls.wrap_socket(connection, server_side=True, do_handshake_on_connect=False)
            client = _Client(connection, self._clock_s())
            self._clients.append(client)
            self._selector.register(connection, selectors.EVENT_READ, lambda: self._serve(client))
            others = [each for each in self._clients if each is not self._uploader]
            if len(others) > _MAX_CLIENTS:
                self._drop(min(others, key=lambda each: each.last_byte_s))

    def _serve(self, client: "_Client") -> None:
        """Take what came from a client: requests, and bytes of an upload if no other uploads."""
        while len(client.upload) < _CHUNK_BYTES and (data := _receive(client.connection)) is not None:
            if not data or (self._tls and self._refuses(client.connection)):  # type: ignore[arg-type]
                self._drop(client)
                return
            client.last_byte_s = self._clock_s()
            upload, requests, client.rest = split_requests(client.rest + data)
            client.upload += upload
            self._requests.extend((client, request) for request in requests)
            if len(self._requests) > _MAX_REQUESTS:
                self._drop(client)
                return
            if len(data) < _CHUNK_BYTES and not self._tls:
                break
        if client is self._uploader or not client.upload:
            return
        other = self._uploader
        if other is not None and other not in self._clients:
            # What the other sent before it left is read first; then it is this client's turn.
            return
        if other is None or self._clock_s() - other.last_byte_s >= _IDLE_S:
            if other is not None:
                self._drop(other)
            self._uploader = client
            self.sender += 1
        else:
            client.upload = b""
            self._send(client, error_line("busy with another uploader"))

    def _send(self, client: "_Client", data: bytes) -> None:
        if client not in self._clients:
            return
        try:
            client.connection.sendall(data)
        except OSError:
            # It is gone, or it reads no answers.
            self._drop(client)

    def _drop(self, client: "_Client") -> None:
        if client not in self._clients:
            return
        self._clients.remove(client)
        self._selector.unregister(client.connection)
        client.connection.close()
        if client is self._uploader:
            # What it sent is read nevertheless, such as a program from somebody who waits for no answer.
            self._uploader = client if client.upload else None


class _Client:
    """A client of a TcpPort: its connection, the bytes of its upload that weren't read yet, when it sent the last."""

    def __init__(self, connection: socket.socket, now_s: float) -> None:
        self.connection = connection
        self.last_byte_s = now_s
        self.upload = b""
        # The beginning of a request whose rest hasn't come.
        self.rest = b""


def _receive(client: socket.socket) -> bytes | None:
    """Return what came from ``client``: None for nothing yet, ``b""`` where it has left."""
    try:
        return client.recv(_CHUNK_BYTES)
    except (BlockingIOError, SSLWantReadError, SSLWantWriteError):
        return None
    except OSError:
        return b""
