"""The car's end of a serial line on a computer: a serial port, a pseudo-terminal, a TCP port, or none.

pyserial reaches the TCP port as ``socket://HOST:PORT``. Uploads come by these lines.
"""

import contextlib
import os
import select
import socket
import sys
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from motorcade.errors import MotorcadeError
from motorcade.sockets import listen
from motorcade.words.upload import error_line

if TYPE_CHECKING:
    import serial

_CHUNK_BYTES = 4096
_MAX_WAITING_CLIENTS = 16
_RETRY_S = 1.0
# Longer than any pause of an uploader, which waits two seconds for an answer.
_IDLE_S = 5.0


class LineError(MotorcadeError):
    """A line that the car can't open."""


class Line:
    """The car's end of a line. This class has no other end; it serves a car that takes no uploads."""

    def wait(self, seconds: float) -> None:
        """Wait until bytes may be there, or ``seconds`` have passed."""
        time.sleep(seconds)

    def read(self) -> bytes:
        """Return the bytes that are there, ``b""`` for none; never wait."""
        return b""

    def write(self, data: bytes) -> None:
        """Send ``data``; it is lost where nobody is connected."""

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
    """A TCP port for uploads by one client at a time; others get the answer that the car is busy.

    A client that has sent nothing for 5 s gives way to one that sends.

    Args:
        host, port: where it listens; port 0 takes a free one.
        clock_s: a clock in seconds.

    Attributes:
        address: ``socket://HOST:PORT``, as pyserial reaches it.
    """

    def __init__(self, host: str, port: int, clock_s: Callable[[], float] = time.monotonic) -> None:
        try:
            self._listener = listen(host, port)
        except (OSError, UnicodeError) as problem:
            reason = getattr(problem, "strerror", None) or problem
            raise LineError("cannot-listen", host=host, port=port, reason=reason) from None
        self._clock_s = clock_s
        self._client: socket.socket | None = None
        self._last_byte_s = clock_s()
        self._waiting_clients: list[socket.socket] = []
        bound_host, bound_port = self._listener.getsockname()[:2]
        self.address = f"socket://{f'[{bound_host}]' if ':' in bound_host else bound_host}:{bound_port}"

    def wait(self, seconds: float) -> None:
        sockets = [self._listener, *self._waiting_clients]
        if self._client is not None:
            sockets.append(self._client)
        ready, _, _ = select.select(sockets, [], [], seconds)
        for client in [each for each in self._waiting_clients if each in ready]:
            self._serve_waiting(client)
        if self._listener in ready:
            with contextlib.suppress(OSError):
                self._accept()

    def read(self) -> bytes:
        if self._client is None:
            return b""
        data = _receive(self._client)
        if data is None:
            return b""
        if not data:
            self._hang_up()
        self._last_byte_s = self._clock_s()
        return data

    def write(self, data: bytes) -> None:
        if self._client is None:
            return
        try:
            self._client.sendall(data)
        except OSError:
            self._hang_up()

    def close(self) -> None:
        self._hang_up()
        for client in self._waiting_clients:
            client.close()
        self._listener.close()

    def _accept(self) -> None:
        client, _ = self._listener.accept()
        client.setblocking(False)
        if self._client is not None and _receive(self._client, socket.MSG_PEEK) == b"":
            self._hang_up()
        if self._client is None:
            self._begin(client)
            return
        self._waiting_clients.append(client)
        if len(self._waiting_clients) > _MAX_WAITING_CLIENTS:
            self._waiting_clients.pop(0).close()

    def _begin(self, client: socket.socket) -> None:
        self._client = client
        self._last_byte_s = self._clock_s()

    def _serve_waiting(self, client: socket.socket) -> None:
        """Serve a client that sent something, or answer that the car is busy.

        It leaves by itself: closing first could lose the answer.
        """
        is_free = self._client is None or self._clock_s() - self._last_byte_s >= _IDLE_S
        if is_free and _receive(client, socket.MSG_PEEK):
            self._waiting_clients.remove(client)
            self._hang_up()
            self._begin(client)
            return
        if _receive(client):
            with contextlib.suppress(OSError):
                client.sendall(error_line("busy with another uploader"))
            return
        self._waiting_clients.remove(client)
        client.close()

    def _hang_up(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client = None


def _receive(client: socket.socket, flags: int = 0) -> bytes | None:
    """Return what came from ``client``: None for nothing yet, ``b""`` where it has left."""
    try:
        return client.recv(_CHUNK_BYTES, flags)
    except BlockingIOError:
        return None
    except OSError:
        return b""
