"""Make TLS contexts of keys files, by which a car and its drivers prove to each other who they are; revoked keys.

A keys file is one PEM file for each person or car, made by `motorcade drive keys` (`motorcade.drive.certificates`): its
private key, its certificate, and the certificate of the authority that both ends trust. Only that authority counts, not
those that the computer trusts: nobody drives with a web site's certificate. The drivers' keys that a car no longer
takes are in a text file of serial numbers, which is read again whenever it changes. Its last line has the number of
lines and a checksum, so a list that was cut or emptied lets nobody in.
"""

import re
import ssl
from binascii import crc32
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from motorcade.config.files import read_bytes, replace_file
from motorcade.errors import MotorcadeError, Phrase

CAR = "car"
DRIVER = "driver"
_CERTIFICATE = re.compile(r"-----BEGIN CERTIFICATE-----[A-Za-z0-9+/=\s]+-----END CERTIFICATE-----")
REVOKED = "revoked.txt"
_HEADING = "# Serial numbers of drivers' keys that are no longer valid, one a line.\n"
# The last line of a list.
_END = "# The end: {count} lines, checksum {checksum:08x}\n"
# A certificate's serial number has at most 20 bytes (RFC 5280).
_NUMBER = re.compile(r"[0-9a-fA-F]{1,40}")
# What stands in each part of a keys file: key, certificate, authority's certificate.
_PART = re.compile(r"-----BEGIN [A-Z ]+-----\s([A-Za-z0-9+/=\s]+)-----END")


class DriverContext(ssl.SSLContext):
    """A driver's keys.

    Attributes:
        any_car: the same keys, for a car whose name only a stranger told: any car of the authority.
    """

    any_car: ssl.SSLContext


def server_context(keys: Path) -> ssl.SSLContext:
    """TLS 1.3 for a car: drivers have to show a certificate of the same authority. Raises MotorcadeError."""
    return _trust(https_context(keys), keys)


def client_context(keys: Path, takes_chips: bool = False) -> DriverContext:
    """TLS 1.3 for a driver: the car has to show a certificate of the same authority. Raises MotorcadeError.

    ``takes_chips`` allows TLS 1.2, too: a microcontroller has nothing newer.
    """
    context, any_car = contexts = [DriverContext(ssl.PROTOCOL_TLS_CLIENT) for _ in range(2)]
    for either in contexts:
        _load(either, keys, DRIVER)
        if takes_chips:
            either.minimum_version = ssl.TLSVersion.TLSv1_2
            either.set_ciphers("ECDHE+AESGCM")
        _trust(either, keys)
    any_car.check_hostname = False
    context.any_car = any_car
    return context


def chip_keys(keys: Path, revoked: Iterable[int]) -> dict[str, Any]:
    """The keys of a car with a microcontroller, as its car.json has them. Raises MotorcadeError.

    Returns:
        The ``name`` in the keys; ``key``, ``certificate`` and ``authority`` in base64 (DER); ``revoked``, the serial
        numbers of drivers' keys that the car refuses, in hexadecimal digits.
    """
    server_context(keys)
    parts = ["".join(part.splitlines()) for part in _PART.findall(_text(keys))]
    named = dict(zip(("key", "certificate", "authority"), parts, strict=True))
    return {"name": name_in(keys), **named, "revoked": [f"{number:x}" for number in sorted(revoked)]}


def https_context(keys: Path) -> ssl.SSLContext:
    """TLS 1.3 for a car's pages, whose visitors show no certificate. Raises MotorcadeError."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    _load(context, keys, CAR)
    # A client that only sends commands never reads, so nothing is sent to it but the handshake.
    context.num_tickets = 0
    return context


def visitor_context(keys: Path | None) -> ssl.SSLContext:
    """HTTPS for a visitor of cars' pages, who trusts the authority of ``keys`` and those that this computer trusts.

    Raises MotorcadeError.
    """
    context = ssl.create_default_context()
    if keys:
        return _trust(context, keys)
    return context


def peer_name(line: ssl.SSLObject | ssl.SSLSocket | None) -> str | None:
    """The name in the certificate of the other end of a TLS connection; None where it has shown none."""
    subject = _peer(line).get("subject", ())
    return next((str(value) for parts in subject for key, value in parts if key == "commonName"), None)


def peer_number(line: ssl.SSLObject | ssl.SSLSocket | None) -> int | None:
    """The serial number of the certificate of the other end of a TLS connection; None where it has shown none."""
    number = _peer(line).get("serialNumber")
    if number:
        return int(number, 16)
    return None


def _peer(line: ssl.SSLObject | ssl.SSLSocket | None) -> dict[str, Any]:
    return (line and line.getpeercert()) or {}


def name_in(keys: Path | None) -> str:
    """The name in a car's keys file; empty without one. Raises MotorcadeError."""
    if keys:
        return _text(keys).partition("\n")[0].removeprefix(title(CAR, ""))
    return ""


def title(role: str, name: str) -> str:
    """The first line of a keys file."""
    return f"Motorcade keys of {role} {name}"


def _load(context: ssl.SSLContext, keys: Path, role: str) -> None:
    other = CAR
    if role == CAR:
        other = DRIVER
    if _text(keys).startswith(title(other, "")):
        found = Phrase(f"role-{other}")
        needed = Phrase(f"role-{role}")
        raise MotorcadeError("keys-of-wrong-role", file=keys, found=found, role=needed, prefix=role)
    context.minimum_version = ssl.TLSVersion.TLSv1_3
    try:
        context.load_cert_chain(keys, password=_no_password)
    except ssl.SSLError as problem:
        reason = problem.reason or Phrase("key-and-certificate-unreadable")
        raise MotorcadeError("not-a-keys-file", file=keys, reason=reason) from None


def _no_password() -> str:
    # Without this the library would ask for one at the terminal, in the middle of a drive.
    raise MotorcadeError("keys-locked")


def _trust(context: ssl.SSLContext, keys: Path) -> ssl.SSLContext:
    certificates = _CERTIFICATE.findall(_text(keys))
    if len(certificates) < 2:
        raise MotorcadeError("keys-without-authority", file=keys)
    try:
        context.load_verify_locations(cadata=certificates[-1])
    except ssl.SSLError:
        raise MotorcadeError("authority-certificate-unreadable", file=keys) from None
    context.verify_mode = ssl.CERT_REQUIRED
    return context


def _text(file: Path, unreadable: str = "keys-unreadable", no_text: str = "not-a-keys-file") -> str:
    try:
        return read_bytes(file).decode()
    except OSError as problem:
        raise MotorcadeError(unreadable, file=file, reason=problem) from None
    except UnicodeDecodeError:
        raise MotorcadeError(no_text, file=file, reason=Phrase("is-no-text")) from None


def number_of(text: str) -> int | None:
    """The serial number that ``text`` is in hexadecimal digits; None where it is none."""
    if _NUMBER.fullmatch(text):
        return int(text, 16)
    return None


def with_end(text: str) -> str:
    """Return the text of a list with its last line."""
    return text + _END.format(count=text.count("\n"), checksum=crc32(text.encode()))


def without_end(text: str) -> str:
    """Return the text of a list without its last line. Raises ValueError: what the last line of this list has to be."""
    lines = text.splitlines()
    body = "".join(f"{line}\n" for line in lines if not line.startswith(_END[:9]))
    whole = with_end(body)
    if lines != whole.splitlines():
        raise ValueError(whole.splitlines()[-1])
    return body


def read_revoked(file: Path) -> frozenset[int]:
    """The serial numbers in a list: hexadecimal, one a line; what stands behind a # is a remark.

    Raises MotorcadeError where the file can't be read, has another line, or isn't whole.
    """
    unreadable = "revoked-keys-unreadable"
    numbers = set()
    content = _text(file, unreadable, unreadable)
    for at, line in enumerate(content.splitlines(), 1):
        if text := line.partition("#")[0].strip():
            if (number := number_of(text)) is None:
                raise MotorcadeError(unreadable, file=file, reason=Phrase("revoked-line", line=at))
            numbers.add(number)
    try:
        without_end(content)
    except ValueError as end:
        raise MotorcadeError(unreadable, file=file, reason=Phrase("revoked-not-whole", line=end)) from None
    return frozenset(numbers)


def write_revoked(file: Path, keys: Mapping[int, str]) -> None:
    """Write a list of these serial numbers, each with its remark. Raises OSError."""
    lines = [f"{number:x}  # {remark}\n" for number, remark in keys.items()]
    replace_file(file, with_end("".join([_HEADING, *lines])).encode())


class RevokedKeys:
    """The revoked keys in a list that `motorcade drive keys --revoke` writes, or its owner.

    Args:
        file: the list.
        is_expected: whether it counts as a problem that there is no such file when the car starts.

    Attributes:
        problem: why the list can't be read now; what it had before stays valid then. Where it never could be read, all
            keys are revoked, unless there is no list.
    """

    def __init__(self, file: Path, is_expected: bool = True) -> None:
        self.problem: MotorcadeError | None = None
        self._file = file
        # None where there is a list, and none has been read.
        self._numbers: frozenset[int] | None = frozenset()
        self._was_read = False
        # When the file was changed, its size and its inode at the last look; None where there was none.
        self._stamp: tuple[int, int, int] | None = None
        if is_expected or file.exists():
            self._read()

    def __contains__(self, number: int | None) -> bool:
        """Whether the keys whose certificate has this serial number are revoked."""
        return number is not None and (self._numbers is None or number in self._numbers)

    def reload(self) -> bool:
        """Read the list again where its file has changed. Returns whether the list or `problem` is another one now.

        A car calls this for all bytes that come from a driver, so where nothing has changed it reads nothing.
        """
        return (self.problem is not None or self._now() != self._stamp) and self._read()

    def _read(self) -> bool:
        # The file may change while it is read: then it is read once more.
        before = (self._numbers, str(self.problem))
        self._stamp = self._now()
        try:
            self._numbers = read_revoked(self._file)
            self.problem = None
            self._was_read = True
        except MotorcadeError as problem:
            self.problem = problem
            if not self._was_read:
                if self._stamp:
                    self._numbers = None
                else:
                    self._numbers = frozenset()
        return (self._numbers, str(self.problem)) != before

    def _now(self) -> tuple[int, int, int] | None:
        try:
            found = self._file.stat()
        except FileNotFoundError:
            return None
        except OSError:
            return 0, 0, 0
        return found.st_mtime_ns, found.st_size, found.st_ino
