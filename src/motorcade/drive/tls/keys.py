"""Keys files, and what TLS does with them: a car and its drivers prove to each other who they are.

A keys file is one PEM file a person or car, made by `motorcade drive keys` (`motorcade.drive.tls.certificates`): its
private key, its certificate, and the certificate of the authority that both ends trust. Only that authority counts:
what a computer trusts by itself doesn't, so nobody drives with a certificate that is good enough for a web site.
"""

import re
import ssl
from pathlib import Path

CAR, DRIVER = "car", "driver"
_TITLE = "Motorcade keys of {role} {name}"
_CERTIFICATE = re.compile(r"-----BEGIN CERTIFICATE-----[A-Za-z0-9+/=\s]+-----END CERTIFICATE-----")
_MOST_BYTES = 1 << 20


class KeysError(ValueError):
    """A keys file that isn't there or isn't one; the sentence says what to do."""


def server_context(keys: Path) -> ssl.SSLContext:
    """TLS 1.3 for a car: drivers show a certificate of the same authority, or don't get in. Raises KeysError."""
    context = https_context(keys)
    _trust(context, keys)
    return context


def client_context(keys: Path) -> ssl.SSLContext:
    """TLS 1.3 for a driver: the car shows a certificate of the same authority, for its name. Raises KeysError."""
    context = _context(ssl.PROTOCOL_TLS_CLIENT, keys, DRIVER)
    _trust(context, keys)
    return context


def https_context(keys: Path) -> ssl.SSLContext:
    """TLS 1.3 for a car's pages, whose visitors show no certificate. Raises KeysError."""
    context = _context(ssl.PROTOCOL_TLS_SERVER, keys, CAR)
    # A client of the bare seed protocol never reads, so nothing is sent to it but the handshake.
    context.num_tickets = 0
    return context


def visitor_context(keys: Path | None) -> ssl.SSLContext:
    """HTTPS for who visits cars' pages: the authority of ``keys`` counts beside whom this computer trusts.

    Raises KeysError.
    """
    context = ssl.create_default_context()
    if keys:
        _trust(context, keys)
    return context


def peer_name(line: ssl.SSLObject | ssl.SSLSocket | None) -> str | None:
    """The name in the certificate that the other end of a TLS connection has shown; None where it has shown none."""
    certificate = line.getpeercert() if line else None
    subject = certificate.get("subject", ()) if certificate else ()
    names = (value for parts in subject for key, value in parts if key == "commonName")  # type: ignore[str-unpack]
    return next((str(name) for name in names), None)


def title(role: str, name: str) -> str:
    """The line that a keys file begins with."""
    return _TITLE.format(role=role, name=name)


def _context(protocol: int, keys: Path, role: str) -> ssl.SSLContext:
    first = _text(keys).partition("\n")[0]
    other = DRIVER if role == CAR else CAR
    if first.startswith(_TITLE.format(role=other, name="")):
        raise KeysError(f"{keys} holds the keys of a {other}; here the keys of a {role} are needed, {role}-….pem")
    context = ssl.SSLContext(protocol)
    context.minimum_version = ssl.TLSVersion.TLSv1_3
    try:
        context.load_cert_chain(keys, password=_no_password)
    except ssl.SSLError as problem:
        raise KeysError(
            f"{keys} is no keys file ({problem.reason or 'its key and certificate are unreadable'}); "
            "`motorcade drive keys` makes them"
        ) from None
    return context


def _no_password() -> str:
    # Without this the library would ask for one at the terminal, in the middle of a drive.
    raise KeysError("the private key is locked with a password; a car starts by itself, so give it a key without one")


def _trust(context: ssl.SSLContext, keys: Path) -> None:
    certificates = _CERTIFICATE.findall(_text(keys))
    if len(certificates) < 2:
        raise KeysError(
            f"{keys} holds no certificate of an authority behind its own, so nobody could be trusted; "
            "`motorcade drive keys` makes such files"
        )
    try:
        context.load_verify_locations(cadata=certificates[-1])
    except ssl.SSLError:
        raise KeysError(f"{keys}: its last certificate can't be read; `motorcade drive keys` makes them") from None
    context.verify_mode = ssl.CERT_REQUIRED


def _text(keys: Path) -> str:
    try:
        with keys.open("rb") as file:
            return file.read(_MOST_BYTES).decode()
    except OSError as problem:
        raise KeysError(f"the keys {keys} can't be read: {problem.strerror}") from None
    except UnicodeDecodeError:
        raise KeysError(f"{keys} is no keys file, since it isn't text; `motorcade drive keys` makes them") from None
