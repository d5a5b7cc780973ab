"""An ESP32's Wi-Fi with keys: a car and its drivers prove to each other by TLS who they are.

Portable. MicroPython's modules are arguments. TLS 1.2 is the newest that MicroPython has on this chip. A handshake
computes for tenths of a second, so the line asks for moments in which the car stands still: one for each message, since
MicroPython can't pause within one.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from typing import Any

import errno
import io
from binascii import a2b_base64

from motorcade.boards.on_chip.wifi_line import Client, WifiLine
from motorcade.words.ticks import elapsed_ms

# No handshake begins for so long after one that failed, so a stranger can't keep the car from driving.
_AFTER_REFUSAL_MS = 2000
# Each TLS record begins with a header, for which mbedtls asks by itself.
_HEADER_BYTES = 5
_ALL = 1 << 29
# MBEDTLS_ERR_X509_CERT_VERIFY_FAILED
_NOT_VERIFIED = -0x2700
# The tag in front of a certificate's version, which an old one hasn't.
_VERSION = 0xA0


class SecureLine(WifiLine):
    """A line whose bytes come by the cable, or by TLS from drivers of the car's authority.

    Args:
        keys: of the car.
        others: as of `WifiLine`.
    """

    # TLS takes some 25 KB for each, and time to begin.
    most_clients, keeps_ms = 3, 5000

    def __init__(self, keys: "Keys", *others: "Any") -> None:
        super().__init__(*others)
        self._keys = keys
        self._refused_ms: int | None = None

    def read(self) -> bytes:
        """Return bytes of an upload that are there, a bounded number."""
        for client in list(self._clients):
            # TLS has received more than was read.
            if client.connection.has_more:
                self._receive(client)
        return super().read()

    def needs_rest(self) -> bool:
        """Return whether a handshake can go on, which takes some tenths of a second."""
        if self._refused_ms is not None and elapsed_ms(self._now_ms(), self._refused_ms) < _AFTER_REFUSAL_MS:
            return False
        self._refused_ms = None
        return any(client.connection.waits for client in self._clients)

    def work_at_rest(self) -> None:
        """Go on with a handshake."""
        for client in self._clients:
            if client.connection.waits:
                client.connection.go_on()
                super()._receive(client)
                if client.is_gone:
                    self._refused_ms = self._now_ms()
                return

    def _opened(self, connection: "Any") -> Client:
        return Client(connection, _Connection(connection, self._keys))

    def _receive(self, client: Client) -> None:
        if client.connection.is_proven:
            super()._receive(client)
        else:
            client.connection.waits = True


class Keys:
    """A car's keys.

    Args:
        tls: MicroPython's module tls.
        settings: ``certificate``, ``key`` and ``authority`` in base64, and ``revoked``, numbers in hexadecimal digits:
            what `motorcade.drive.keys.chip_keys` returns.
    """

    def __init__(self, tls: "Any", settings: "dict[str, Any]") -> None:
        certificate, key, authority = [a2b_base64(settings[name]) for name in ("certificate", "key", "authority")]
        self._context = tls.SSLContext(tls.PROTOCOL_TLS_SERVER)
        self._context.load_cert_chain(certificate, key)
        self._context.load_verify_locations(authority)
        self._context.verify_mode = tls.CERT_REQUIRED
        self._context.verify_callback = self._verify
        self._revoked = [int(number, 16) for number in settings["revoked"]]

    def wrap(self, stream: "Any") -> "Any":
        """Return a stream by TLS, whose handshake goes on with each read."""
        return self._context.wrap_socket(stream, server_side=True, do_handshake_on_connect=False)

    def _verify(self, certificate: "Any", depth: int) -> int:
        # Of the other end and, with a depth above 0, of its authority.
        return _NOT_VERIFIED if serial_number(certificate) in self._revoked else 0


def serial_number(certificate: "Any") -> int:
    """Return the serial number of a certificate in DER (RFC 5280, 4.1)."""
    at = 0
    for _ in range(2):
        # The certificate and what is signed of it are sequences: a tag, and the length in 1 to 5 bytes.
        size = certificate[at + 1]
        at += 2 + (size & 0x7F if size & 0x80 else 0)
    if certificate[at] == _VERSION:
        at += 2 + certificate[at + 1]
    return int.from_bytes(certificate[at + 2 : at + 2 + certificate[at + 1]], "big")


class _Connection:
    """A client's connection by TLS.

    Attributes:
        is_proven: whether the handshake is over.
        waits: whether the handshake can go on.
        has_more: whether more was received than was read.
    """

    def __init__(self, socket: "Any", keys: Keys) -> None:
        self.is_proven = self.waits = self.has_more = False
        self._records = _Records(socket)
        self._stream = keys.wrap(self._records)

    def go_on(self) -> None:
        """Let ``recv`` do one more step of the handshake."""
        self.waits = False
        self._records.allowed = 1

    def recv(self, size: int) -> "bytes | None":
        """Return at most ``size`` bytes that came; none at the end, None where there are none now.

        Raises OSError or ValueError: the other end has other keys than it needs, or none.
        """
        data: bytes | None = self._stream.read(size)
        self.has_more = data is not None and len(data) == size
        if data and not self.is_proven:
            self.is_proven, self._records.allowed = True, _ALL
        return data

    def send(self, data: bytes) -> int:
        """Send bytes; return how many were sent. Raises OSError where the other end takes none."""
        count: int | None = self._stream.write(data)
        if not count:
            raise OSError
        return count

    def close(self) -> None:
        """End TLS. After a failed handshake it has forgotten its socket, so somebody else closes that."""
        self._stream.close()


class _Records(io.IOBase):
    """What TLS reads from and writes to: a socket, of which it gets ``allowed`` records until somebody sets it again.

    A TLS record has one message of a handshake, as a rule (RFC 5246, 6.2.1).
    """

    def __init__(self, socket: "Any") -> None:
        self._socket = socket
        self.allowed = 0

    def readinto(self, buffer: "Any") -> "int | None":
        """Read into ``buffer``; return how many bytes, None where there are none now. Raises OSError."""
        is_header = len(buffer) == _HEADER_BYTES
        if is_header and not self.allowed:
            return None
        try:
            data = self._socket.recv(len(buffer))
        except OSError as problem:
            if problem.args[0] != errno.EAGAIN:
                raise
            return None
        buffer[: len(data)] = data
        self.allowed -= is_header
        return len(data)

    def write(self, data: "Any") -> int:
        """Send ``data``; return how many bytes were sent."""
        count: int = self._socket.send(data)
        return count

    def ioctl(self, request: int, argument: int) -> int:
        """Nothing else is asked of it: the line looks at the socket, and closes it."""
        return 0
