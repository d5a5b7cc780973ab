"""An ESP32's Wi-Fi beside its cable: requests of several clients and an upload of one, by TCP, without keys.

Portable. MicroPython's modules are arguments. The chip connects by itself, also after the network was away.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable
    from typing import Any

from motorcade.words.request import split_requests
from motorcade.words.ticks import elapsed_ms
from motorcade.words.upload import error_line

PORT = 7001
_MAX_CLIENTS = 4
# Bytes a call, as of the other lines: so no tick takes long. TCP keeps the sender waiting.
_MAX_BYTES = 160
# An uploader that has sent nothing for so long gives way to another.
_IDLE_MS = 5000
_HOST_LETTERS = "abcdefghijklmnopqrstuvwxyz0123456789-"


class WifiLine:
    """A line whose bytes come by the cable or by TCP.

    Args:
        cable: the line at the cable; while somebody uploads by TCP its bytes wait.
        sockets, select: MicroPython's modules socket and select.
        clock: its module time.
        port: where the car listens.

    Attributes:
        sender: see `motorcade.car.board.Board`.
    """

    def __init__(self, cable: "Any", sockets: "Any", select: "Any", clock: "Any", port: int = PORT) -> None:
        self.sender = 0
        self._cable = cable
        self._clock = clock
        self._poll = select.poll()
        self._readable = select.POLLIN
        self._listener = sockets.socket()
        self._listener.setsockopt(sockets.SOL_SOCKET, sockets.SO_REUSEADDR, 1)
        self._listener.bind(("0.0.0.0", port))
        self._listener.listen(_MAX_CLIENTS)
        self._listener.setblocking(False)
        self._poll.register(self._listener, self._readable)
        self._clients: list[_Client] = []
        self._uploader: _Client | None = None

    def read(self) -> bytes:
        """Return bytes of an upload that are there, a bounded number."""
        for ready in self._poll.poll(0):
            self._serve(ready[0])
        uploader = self._uploader
        if uploader is None:
            data: bytes = self._cable.read()
            return data
        data, uploader.upload = uploader.upload[:_MAX_BYTES], uploader.upload[_MAX_BYTES:]
        if not data and (uploader.is_gone or elapsed_ms(self._clock.ticks_ms(), uploader.last_byte_ms) >= _IDLE_MS):
            self._uploader = None
            self.sender += 1
        return data

    def write(self, data: bytes) -> None:
        """Send ``data`` to the uploader, or by the cable."""
        if self._uploader is None:
            self._cable.write(data)
        else:
            self._send(self._uploader, data)

    def answer_requests(self, answer: "Callable[[bytes], bytes]") -> None:
        """Answer the requests that came by TCP."""
        for client in list(self._clients):
            while client.requests:
                self._send(client, answer(client.requests.pop(0)))

    def close(self) -> None:
        """Close all connections, and the cable's line."""
        for client in list(self._clients):
            self._drop(client)
        self._listener.close()
        self._cable.close()

    def _serve(self, ready: "Any") -> None:
        # CPython's poll gives a number, MicroPython's the socket.
        if ready is self._listener or ready == self._listener.fileno():
            self._accept()
            return
        for client in list(self._clients):
            if ready is client.connection or ready == client.connection.fileno():
                self._receive(client)

    def _accept(self) -> None:
        try:
            connection = self._listener.accept()[0]
        except OSError:
            return
        connection.setblocking(False)
        if len(self._clients) >= _MAX_CLIENTS:
            # The one that has been silent for the longest time gives way.
            others = [each for each in self._clients if each is not self._uploader]
            now_ms = self._clock.ticks_ms()
            self._drop(max(others, key=lambda each: elapsed_ms(now_ms, each.last_byte_ms)))
        self._clients.append(_Client(connection, self._clock.ticks_ms()))
        self._poll.register(connection, self._readable)

    def _receive(self, client: "_Client") -> None:
        if len(client.upload) >= _MAX_BYTES:
            return
        try:
            data = client.connection.recv(_MAX_BYTES)
        except OSError:
            data = b""
        if not data:
            self._drop(client)
            return
        client.last_byte_ms = self._clock.ticks_ms()
        upload, requests, client.rest = split_requests(client.rest + data)
        client.requests += requests
        if not upload or client is self._uploader:
            client.upload += upload
        elif self._uploader is None:
            client.upload = upload
            self._uploader = client
            self.sender += 1
        else:
            self._send(client, error_line("busy with another uploader"))

    def _send(self, client: "_Client", data: bytes) -> None:
        if client.is_gone:
            return
        try:
            while data:
                data = data[client.connection.send(data) :]
        except OSError:
            # It is gone, or it reads no answers.
            self._drop(client)

    def _drop(self, client: "_Client") -> None:
        client.is_gone = True
        self._clients.remove(client)
        self._poll.unregister(client.connection)
        client.connection.close()


class _Client:
    """A client: its connection, and what it sent that isn't used yet."""

    def __init__(self, connection: "Any", now_ms: int) -> None:
        self.connection = connection
        self.last_byte_ms = now_ms
        self.upload = b""
        self.rest = b""
        self.requests: list[bytes] = []
        self.is_gone = False


def join_network(network: "Any", wifi: "dict[str, str]", name: str) -> None:
    """Join a Wi-Fi network, and again whenever it comes back; the car is then found as ``motorcade-NAME.local``."""
    letters = [each for each in name.lower() if each in _HOST_LETTERS]
    network.hostname("motorcade-" + "".join(letters)[:20])
    station = network.WLAN(network.STA_IF)
    station.active(True)
    station.connect(wifi["ssid"], wifi["password"])
