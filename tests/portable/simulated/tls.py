"""MicroPython's module tls, by CPython's ssl: what a car with Wi-Fi uses of it."""

import base64
import ssl
import tempfile
from pathlib import Path

PROTOCOL_TLS_SERVER = ssl.PROTOCOL_TLS_SERVER
CERT_REQUIRED = ssl.CERT_REQUIRED


def _pem(kind, data):
    return f"-----BEGIN {kind}-----\n{base64.encodebytes(data).decode()}-----END {kind}-----\n"


class SSLContext:
    """A server's keys, in DER; it has no newer TLS than the chip."""

    def __init__(self, protocol):
        self._context = ssl.SSLContext(protocol)
        self._context.maximum_version = ssl.TLSVersion.TLSv1_2
        self.verify_mode = self.verify_callback = None

    def load_cert_chain(self, certificate, key):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "keys.pem")
            file.write_text(_pem("CERTIFICATE", certificate) + _pem("PRIVATE KEY", key))
            self._context.load_cert_chain(file)

    def load_verify_locations(self, authority):
        self._context.load_verify_locations(cadata=authority)

    def wrap_socket(self, records, server_side, do_handshake_on_connect):
        self._context.verify_mode = self.verify_mode
        return Stream(self._context, records, self.verify_callback)


class Stream:
    """A connection that neither waits nor raises an error where nothing is there."""

    def __init__(self, context, records, verify):
        self._records, self._verify = records, verify
        self._came, self._goes = ssl.MemoryBIO(), ssl.MemoryBIO()
        self._connection = context.wrap_bio(self._came, self._goes, server_side=True)

    def read(self, size):
        while True:
            try:
                self._connection.do_handshake()
                if self._verify(self._connection.getpeercert(True), 0):
                    raise OSError
                return self._connection.read(size)
            except ssl.SSLWantReadError:
                if not self._receive():
                    return None
            finally:
                self._send()

    def write(self, data):
        count = self._connection.write(data)
        self._send()
        return count

    def close(self):
        pass

    def _receive(self):
        """Take a record of the other end, if it has come; mbedtls reads the header first, too."""
        for size in (5, 16640):
            buffer = bytearray(size)
            count = self._records.readinto(buffer)
            if count is None:
                return size > 5
            if not count:
                self._came.write_eof()
                return True
            self._came.write(buffer[:count])
        return True

    def _send(self):
        if data := self._goes.read():
            self._records.write(data)
