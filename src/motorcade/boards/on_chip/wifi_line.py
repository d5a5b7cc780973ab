"""A line in a network, by TCP: requests of several clients and an upload of one. An ESP32 has it beside its cable.

Portable. `motorcade.boards.lines` has that of a computer. MicroPython's modules are arguments. The chip connects by
itself, also after the network was away.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable
    from typing import Any

import struct

from motorcade.boards.on_chip.lines import UploadLine
from motorcade.words.request import split_requests
from motorcade.words.ticks import elapsed_ms
from motorcade.words.upload import error_line

PORT = 7001
# An uploader that has sent nothing for so long gives way to another: an uploader waits two seconds for an answer.
_IDLE_MS = 5000
# How often the car announces itself, and for how many seconds others may remember it.
_ANNOUNCE_MS = 1000
_REMEMBERED_S = 120
# Multicast DNS: RFC 6762, 6763; numbers of record types: RFC 1035, 2782.
_MULTICAST_DNS = ("224.0.0.251", 5353)
_SERVICE = ("_motorcade", "_tcp", "local")
_ADDRESS, _POINTER, _TEXT, _SERVER = 1, 12, 16, 33
_INTERNET, _REPLACES = 1, 0x8000


class NetworkLine(UploadLine):
    """A line for requests of all clients, and for the upload of one; others that upload meanwhile are told to wait.

    Args:
        listener: a socket that listens; closed with the line.
        poll: where sockets are registered; a subclass calls ``_accept`` or ``_receive`` where one has bytes.
        now_ms: returns the time in ms that wraps at 2^30.

    Attributes:
        sender: see `motorcade.car.board.Board`.
    """

    # How many clients there may be, how long one that is silent keeps its place, and bytes a call.
    most_clients, keeps_ms, most_bytes = 4, 0, 160

    def __init__(self, listener: "Any", poll: "Any", now_ms: "Callable[[], int]") -> None:
        self.sender = 0
        self._listener = listener
        self._poll = poll
        self._now_ms = now_ms
        self._clients: list[Client] = []
        self._uploader: Client | None = None
        listener.setblocking(False)
        self._watch(listener, None)

    def read(self) -> bytes:
        """Return bytes of an upload that are there, a bounded number."""
        uploader = self._uploader
        if uploader is None:
            return b""
        data, uploader.upload = uploader.upload[: self.most_bytes], uploader.upload[self.most_bytes :]
        if not data and (uploader.is_gone or elapsed_ms(self._now_ms(), uploader.last_byte_ms) >= _IDLE_MS):
            self._uploader = None
            self.sender += 1
        return data

    def write(self, data: bytes) -> None:
        """Send ``data`` to the uploader."""
        if self._uploader is not None:
            self._send(self._uploader, data)

    def answer_requests(self, answer: "Callable[[bytes], bytes]") -> bool:
        """Answer one request, so no tick takes long; return whether there was one."""
        for client in self._clients:
            if client.requests:
                self._send(client, answer(client.requests.pop(0)))
                return True
        return False

    def close(self) -> None:
        """Close all connections."""
        for client in list(self._clients):
            self._drop(client)
        self._poll.unregister(self._listener)
        self._listener.close()

    def _watch(self, socket: "Any", client: "Client | None") -> None:
        """Register a socket with ``self._poll``: that of a client, or the listener's."""
        raise NotImplementedError

    def _opened(self, connection: "Any") -> "Client":
        """Return a client for a new connection. Raises OSError where there is no room for it."""
        return Client(connection, connection)

    def _received(self, client: "Client") -> "bytes | None":
        """Return what came from a client: none where it has left, None where there is nothing now."""
        try:
            data: bytes | None = client.connection.recv(self.most_bytes)
        except (OSError, ValueError):
            # TLS raises ValueError for a certificate of another authority.
            data = b""
        return data

    def _accept(self) -> None:
        try:
            connection = self._listener.accept()[0]
        except OSError:
            return
        connection.setblocking(False)
        now_ms = self._now_ms()
        if len(self._clients) >= self.most_clients:
            # The one that has been silent for the longest time gives way.
            others = [client for client in self._clients if client is not self._uploader]
            silent = max(others, key=lambda client: elapsed_ms(now_ms, client.last_byte_ms))
            if elapsed_ms(now_ms, silent.last_byte_ms) < self.keeps_ms:
                connection.close()
                return
            self._drop(silent)
        try:
            client = self._opened(connection)
        except OSError:
            connection.close()
            return
        client.last_byte_ms = now_ms
        self._clients.append(client)
        self._watch(client.socket, client)

    def _receive(self, client: "Client") -> None:
        """Take what came from a client: requests, and bytes of an upload if no other uploads."""
        uploader = self._uploader
        # TCP keeps the rest: what this client or an uploader that has left sent before is used first.
        if (
            client.is_gone
            or client.requests
            or len(client.upload) >= self.most_bytes
            or (uploader and uploader.is_gone)
        ):
            return
        data = self._received(client)
        if data is None:
            return
        if not data:
            self._drop(client)
            return
        client.last_byte_ms = self._now_ms()
        upload, requests, client.rest = split_requests(client.rest + data)
        client.requests += requests
        if not upload or client is uploader:
            client.upload += upload
        elif uploader is None:
            client.upload = upload
            self._uploader = client
            self.sender += 1
        else:
            self._send(client, error_line("busy with another uploader"))

    def _send(self, client: "Client", data: bytes) -> None:
        if client.is_gone:
            return
        try:
            while data:
                data = data[client.connection.send(data) :]
        except OSError:
            # It is gone, or it reads no answers.
            self._drop(client)

    def _drop(self, client: "Client") -> None:
        client.is_gone = True
        self._clients.remove(client)
        self._poll.unregister(client.socket)
        client.connection.close()
        client.socket.close()


class Client:
    """A client: its TCP connection, what secures that, or itself, and what it sent that isn't used yet."""

    def __init__(self, socket: "Any", connection: "Any") -> None:
        self.socket = socket
        self.connection = connection
        self.last_byte_ms = 0
        self.upload = b""
        # The beginning of a request whose rest hasn't come.
        self.rest = b""
        self.requests: list[bytes] = []
        self.is_gone = False


class WifiLine(NetworkLine):
    """A line whose bytes come by the cable or by TCP, from everybody in the network.

    Args:
        cable: the line at the cable; while somebody uploads by TCP its bytes wait.
        sockets, select: MicroPython's modules socket and select.
        clock: its module time.
        announcer: announces the port.
        port: where the car listens.
    """

    def __init__(
        self, cable: UploadLine, sockets: "Any", select: "Any", clock: "Any", announcer: "Announcer", port: int = PORT
    ) -> None:
        self._announcer = announcer
        self._cable = cable
        self._readable = select.POLLIN
        listener = sockets.socket()
        listener.setsockopt(sockets.SOL_SOCKET, sockets.SO_REUSEADDR, 1)
        listener.bind(sockets.getaddrinfo("0.0.0.0", port)[0][-1])
        listener.listen(self.most_clients)
        super().__init__(listener, select.poll(), clock.ticks_ms)

    def read(self) -> bytes:
        """Return bytes of an upload that are there, a bounded number."""
        if self._announcer.turn():
            return b""
        for ready in self._poll.poll(0):
            self._serve(ready[0])
        return self._cable.read() if self._uploader is None else super().read()

    def write(self, data: bytes) -> None:
        """Send ``data`` to the uploader, or by the cable."""
        if self._uploader is None:
            self._cable.write(data)
        else:
            super().write(data)

    def close(self) -> None:
        """Close all connections, and the cable's line."""
        super().close()
        self._announcer.close()
        self._cable.close()

    def _watch(self, socket: "Any", client: "Client | None") -> None:
        self._poll.register(socket, self._readable)

    def _serve(self, ready: "Any") -> None:
        # CPython's poll gives a number, MicroPython's the socket.
        if ready is self._listener or ready == self._listener.fileno():
            self._accept()
            return
        for client in list(self._clients):
            if ready is client.socket or ready == client.socket.fileno():
                self._receive(client)


class Announcer:
    """Announce a car each second by multicast DNS, unasked: the chip's own answers for its host name alone.

    Args:
        station: the chip's connection, from `join_network`.
        sockets, clock: MicroPython's modules socket and time.
        number: the car's, eight hexadecimal digits.
        port: where the car listens.
        keys: the name in its keys; empty where it has none.
    """

    def __init__(
        self, station: "Any", sockets: "Any", clock: "Any", number: str, port: int = PORT, keys: str = ""
    ) -> None:
        self._station = station
        self._sockets = sockets
        self._clock = clock
        # Made before the car drives, since that takes some milliseconds.
        self._beginning = announcement(number, port, keys)
        self._sent_ms = clock.ticks_ms()
        self._address = ""
        self._socket: Any = None
        self._datagram = b""

    def turn(self) -> bool:
        """Announce the car if there is a network; return whether it was time for that."""
        now_ms = self._clock.ticks_ms()
        if elapsed_ms(now_ms, self._sent_ms) < _ANNOUNCE_MS:
            return False
        self._sent_ms = now_ms
        try:
            if self._station.isconnected():
                self._use(self._station.ifconfig()[0])
                self._socket.sendto(self._datagram, _MULTICAST_DNS)
        except OSError:
            # The network has just gone: a new address may come.
            self._address = ""
        return True

    def close(self) -> None:
        """Close the socket."""
        if self._socket:
            self._socket.close()

    def _use(self, address: str) -> None:
        if address == self._address:
            return
        self.close()
        self._socket = self._sockets.socket(self._sockets.AF_INET, self._sockets.SOCK_DGRAM)
        # So it leaves by the interface that has this address.
        self._socket.bind((address, 0))
        self._datagram = self._beginning + bytes([int(part) for part in address.split(".")])
        self._address = address


def announcement(number: str, port: int, keys: str = "") -> bytes:
    """Return the datagram that announces a car: what it is, its port, and the name in its keys.

    The four bytes of its address stand behind.
    """
    service, host = _dns_name(_SERVICE), _dns_name((host_name(number), "local"))
    own = _dns_name((host_name(number),) + _SERVICE)
    texts = [b"kind=car"] + ([b"keys=" + keys.encode()] if keys else [])
    records = [
        _record(service, _POINTER, _INTERNET, own),
        _record(own, _SERVER, _INTERNET | _REPLACES, struct.pack(">3H", 0, 0, port) + host),
        _record(own, _TEXT, _INTERNET | _REPLACES, b"".join([bytes([len(text)]) + text for text in texts])),
        _record(host, _ADDRESS, _INTERNET | _REPLACES, bytes(4)),
    ]
    return struct.pack(">6H", 0, 0x8400, 0, len(records), 0, 0) + b"".join(records)[:-4]


def _dns_name(labels: "tuple[str, ...]") -> bytes:
    return b"".join([bytes([len(label)]) + label.encode() for label in labels]) + b"\0"


def _record(name: bytes, kind: int, kind_of_data: int, data: bytes) -> bytes:
    return name + struct.pack(">HHIH", kind, kind_of_data, _REMEMBERED_S, len(data)) + data


def host_name(number: str) -> str:
    """Return the host name of a car with this number (eight hexadecimal digits)."""
    return "motorcade-" + number


def join_network(network: "Any", wifi: "dict[str, str]", number: str) -> "Any":
    """Join a Wi-Fi network, and again whenever it comes back, and return the connection.

    The car is then found as ``motorcade-NUMBER.local``.
    """
    network.hostname(host_name(number))
    station = network.WLAN(network.STA_IF)
    station.active(True)
    station.connect(wifi["ssid"], wifi["password"])
    return station
