"""Make TLS contexts of keys files, by which a car and its drivers prove to each other who they are.

A keys file is one PEM file for each person or car, made by `motorcade drive keys`
(`motorcade.drive.tls.certificates`): its private key, its certificate, and the certificate of the authority that both
ends trust. Only that authority counts, not those that the computer trusts: nobody drives with a web site's certificate.
"""

import re
import ssl
from pathlib import Path

from motorcade.errors import MotorcadeError, Phrase

CAR, DRIVER = "car", "driver"
_TITLE = "Motorcade keys of {role} {name}"
_CERTIFICATE = re.compile(r"-----BEGIN CERTIFICATE-----[A-Za-z0-9+/=\s]+-----END CERTIFICATE-----")
_MOST_BYTES = 1 << 20


def server_context(keys: Path) -> ssl.SSLContext:
    """TLS 1.3 for a car: drivers have to show a certificate of the same authority. Raises MotorcadeError."""
    context = https_context(keys)
    _trust(context, keys)
    return context


def client_context(keys: Path) -> ssl.SSLContext:
    """TLS 1.3 for a driver: the car has to show a certificate of the same authority. Raises MotorcadeError."""
    context = _context(ssl.PROTOCOL_TLS_CLIENT, keys, DRIVER)
    _trust(context, keys)
    return context


def https_context(keys: Path) -> ssl.SSLContext:
    """TLS 1.3 for a car's pages, whose visitors show no certificate. Raises MotorcadeError."""
    context = _context(ssl.PROTOCOL_TLS_SERVER, keys, CAR)
    # A client that only sends commands never reads, so nothing is sent to it but the handshake.
    context.num_tickets = 0
    return context


def visitor_context(keys: Path | None) -> ssl.SSLContext:
    """HTTPS for a visitor of cars' pages, who trusts the authority of ``keys`` and those that this computer trusts.

    Raises MotorcadeError.
    """
    context = ssl.create_default_context()
    if keys:
        _trust(context, keys)
    return context


def peer_name(line: ssl.SSLObject | ssl.SSLSocket | None) -> str | None:
    """The name in the certificate of the other end of a TLS connection; None where it has shown none."""
    certificate = line.getpeercert() if line else None
    subject = certificate.get("subject", ()) if certificate else ()
    names = (value for parts in subject for key, value in parts if key == "commonName")  # type: ignore[str-unpack]
    return next((str(name) for name in names), None)


def peer_number(line: ssl.SSLObject | ssl.SSLSocket | None) -> int | None:
    """The serial number of the certificate of the other end of a TLS connection; None where it has shown none."""
    certificate = line.getpeercert() if line else None
    number = certificate.get("serialNumber") if certificate else None
    return int(str(number), 16) if number else None


def name_in(keys: Path | None) -> str:
    """The name in a car's keys file; empty without one. Raises MotorcadeError."""
    return _text(keys).partition("\n")[0].removeprefix(title(CAR, "")) if keys else ""


def title(role: str, name: str) -> str:
    """The first line of a keys file."""
    return _TITLE.format(role=role, name=name)


def _context(protocol: int, keys: Path, role: str) -> ssl.SSLContext:
    first = _text(keys).partition("\n")[0]
    other = DRIVER if role == CAR else CAR
    if first.startswith(_TITLE.format(role=other, name="")):
        found, needed = Phrase(f"role-{other}"), Phrase(f"role-{role}")
        raise MotorcadeError("keys-of-wrong-role", file=keys, found=found, role=needed, prefix=role)
    context = ssl.SSLContext(protocol)
    context.minimum_version = ssl.TLSVersion.TLSv1_3
    try:
        context.load_cert_chain(keys, password=_no_password)
    except ssl.SSLError as problem:
        reason = problem.reason or Phrase("key-and-certificate-unreadable")
        raise MotorcadeError("not-a-keys-file", file=keys, reason=reason) from None
    return context


def _no_password() -> str:
    # Without this the library would ask for one at the terminal, in the middle of a drive.
    raise MotorcadeError("keys-locked")


def _trust(context: ssl.SSLContext, keys: Path) -> None:
    certificates = _CERTIFICATE.findall(_text(keys))
    if len(certificates) < 2:
        raise MotorcadeError("keys-without-authority", file=keys)
    try:
        context.load_verify_locations(cadata=certificates[-1])
    except ssl.SSLError:
        raise MotorcadeError("authority-certificate-unreadable", file=keys) from None
    context.verify_mode = ssl.CERT_REQUIRED


def _text(keys: Path) -> str:
    try:
        with keys.open("rb") as file:
            return file.read(_MOST_BYTES).decode()
    except OSError as problem:
        raise MotorcadeError("keys-unreadable", file=keys, reason=problem.strerror) from None
    except UnicodeDecodeError:
        raise MotorcadeError("not-a-keys-file", file=keys, reason=Phrase("is-no-text")) from None
