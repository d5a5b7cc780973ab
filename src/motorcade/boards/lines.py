"""The car's end of a serial line on a computer: a serial port, a TCP port, or none.

pyserial reaches the TCP port as ``socket://HOST:PORT``. Uploads come by these lines.
"""

import contextlib
import selectors
import socket
import time
from collections.abc import Callable
from functools import partial
from ssl import SSLWantReadError, SSLWantWriteError
from typing import TYPE_CHECKING, TypeVar

from motorcade.boards.on_chip.lines import UploadLine
from motorcade.boards.on_chip.wifi_line import Client, NetworkLine
from motorcade.config.files import raised_as
from motorcade.sockets import listen
from motorcade.words.ticks import TICKS_MASK

if TYPE_CHECKING:
    import ssl

    import serial

_RETRY_S = 1.0
_Result = TypeVar("_Result")


class WaitingLine(UploadLine):
    """A line that can be waited for. This class has no other end; it serves a car that takes no uploads."""

    def wait(self, seconds: float) -> None:
        """Wait until bytes may be there, or ``seconds`` have passed."""
        time.sleep(seconds)


class SerialLine(WaitingLine):
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
        return self._use(lambda port: bytes(port.read(port.in_waiting or 1))) or b""

    def write(self, data: bytes) -> None:
        self._use(lambda port: port.write(data))

    def close(self) -> None:
        if self._port is not None:
            self._port.close()

    def _use(self, action: "Callable[[serial.Serial], _Result]") -> "_Result | None":
        """Return what ``action`` gives with the port; None where that isn't there, goes away or takes no more."""
        from serial import SerialTimeoutException

        now_s = self._clock_s()
        # serial.SerialException is an OSError.
        with contextlib.suppress(OSError):
            if self._port is None and now_s - self._last_try_s >= _RETRY_S:
                self._last_try_s = now_s
                self._port = self._open_port()
        if self._port is None:
            return None
        try:
            return action(self._port)
        except SerialTimeoutException:
            return None
        except OSError:
            with contextlib.suppress(OSError):
                self._port.close()
            self._port = None
            self._last_try_s = now_s
            return None


class TcpPort(NetworkLine, WaitingLine):
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
        has_come: whether something came from a client; who ticks the car then sets it to False.
    """

    has_come = False
    most_clients = 16
    most_bytes = 4096

    def __init__(
        self,
        host: str,
        port: int,
        clock_s: Callable[[], float] = time.monotonic,
        tls: "ssl.SSLContext | None" = None,
        refuses: "Callable[[ssl.SSLSocket], bool]" = lambda connection: False,
        selector: selectors.BaseSelector | None = None,
    ) -> None:
        with raised_as("cannot-listen", (OSError, UnicodeError), host=host, port=port):
            listener = listen(host, port)
        self._tls = tls
        self._refuses = refuses
        super().__init__(listener, selector or selectors.DefaultSelector(), lambda: int(clock_s() * 1000) & TICKS_MASK)
        bound_host, bound_port = listener.getsockname()[:2]
        if ":" in bound_host:
            bound_host = f"[{bound_host}]"
        self.address = f"socket://{bound_host}:{bound_port}"

    def wait(self, seconds: float) -> None:
        for key, _ in self._poll.select(seconds):
            key.data()

    def read(self) -> bytes:
        for client in list(self._clients) if self._tls else ():
            # TLS holds bytes that no selector sees.
            if client.connection.pending():
                self._receive(client)
        return super().read()

    def answer_requests(self, answer: Callable[[bytes], bytes]) -> bool:
        had_some = False
        while super().answer_requests(answer):
            had_some = True
        return had_some

    def _watch(self, socket: socket.socket, client: Client | None) -> None:
        turn = partial(self._receive, client) if client else self._accept
        self._poll.register(socket, selectors.EVENT_READ, turn)

    def _opened(self, connection: socket.socket) -> Client:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if self._tls:
            connection = self._tls.wrap_socket(connection, server_side=True, do_handshake_on_connect=False)
        return super()._opened(connection)

    def _receive(self, client: Client) -> None:
        self.has_come = True
        super()._receive(client)

    def _received(self, client: Client) -> bytes | None:
        try:
            data: bytes = client.connection.recv(self.most_bytes)
        except (BlockingIOError, SSLWantReadError, SSLWantWriteError):
            return None
        except OSError:
            return b""
        if data and self._tls and self._refuses(client.connection):
            return b""
        return data
