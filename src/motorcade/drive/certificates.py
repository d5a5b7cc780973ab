"""Make the keys files of cars and drivers (`motorcade.drive.keys`), as a small certificate authority.

One folder is one authority, for a class or a household. Whoever has a driver's keys file of it can drive every car of
it, until the keys are revoked (`motorcade.drive.keys`). The folder keeps what was
issued, so that keys whose file is lost can be revoked.
"""

import ipaddress
import re
from collections.abc import Iterable, Sequence
from datetime import datetime, timedelta
from pathlib import Path
from typing import NamedTuple

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from motorcade.config.files import read_bytes, replace_file, write_secret
from motorcade.drive.keys import (
    CAR,
    DRIVER,
    REVOKED,
    number_of,
    read_revoked,
    title,
    with_end,
    without_end,
    write_revoked,
)
from motorcade.errors import MotorcadeError, Phrase

AUTHORITY = "authority.pem"
AUTHORITY_PUBLIC = "authority.crt"
# The certificates of all keys that the authority has made.
ISSUED = "issued.pem"
# A Raspberry Pi's clock stops while it is off, so its time may be in the past.
BACKDATED = timedelta(days=365)
_AUTHORITY_DAYS = timedelta(days=3650)
# With the backdating it stays below 825 days, above which browsers refuse a certificate.
_KEYS_DAYS = timedelta(days=400)
# It is shown to others and is part of a file's name.
_NAME = re.compile(r"\w([\w-]{0,38}\w)?")
_HOST = re.compile(r"[A-Za-z0-9]([A-Za-z0-9.-]{0,250}[A-Za-z0-9])?")
_USES = (
    *("digital_signature", "content_commitment", "key_encipherment", "data_encipherment", "key_agreement"),
    *("key_cert_sign", "crl_sign", "encipher_only", "decipher_only"),
)
# So that a car can be tried on its own computer.
_OWN = ("localhost", "127.0.0.1", "::1")
_PEM = serialization.Encoding.PEM


class CarKeys(NamedTuple):
    """A car that gets keys: its name, and its addresses beside NAME and NAME.local."""

    name: str
    hosts: tuple[str, ...] = ()


class IssuedKeys(NamedTuple):
    """Keys that an authority has made; ``number`` is the certificate's serial number."""

    role: str
    name: str
    number: int
    valid_until: datetime
    is_revoked: bool


class _Authority(NamedTuple):
    key: ec.EllipticCurvePrivateKey
    certificate: x509.Certificate


def make_keys(folder: Path, cars: Sequence[CarKeys], drivers: Sequence[str], now: datetime) -> list[Path]:
    """Make the keys files of ``cars`` and ``drivers`` in ``folder``, and its authority where it has none yet.

    Args:
        now: with its time zone; certificates are valid for a year and a month from then on.

    Returns:
        The files that are new: ``car-NAME.pem``, ``driver-NAME.pem``, and those of a new authority.

    Raises:
        MotorcadeError: a name that isn't allowed, or whose file exists; nothing has been made then.
        OSError: a file can't be written; those made before have been removed.
    """
    names = [(CAR, car.name) for car in cars] + [(DRIVER, driver) for driver in drivers]
    for role, name in names:
        who = Phrase(f"role-{role}")
        if not _NAME.fullmatch(name) or (role == CAR and not _as_address(name)):
            raise MotorcadeError("not-a-keys-name", name=name, role=who, allowed=Phrase("keys-name-letters"))
        if names.count((role, name)) > 1:
            raise MotorcadeError("keys-named-twice", role=who, name=name)
        if (file := folder / f"{role}-{name}.pem").exists():
            raise MotorcadeError("keys-exist", file=file, name=name)
    before = _issued(folder)
    purposes = [_car_purpose(car) for car in cars]
    purposes += [[x509.ExtendedKeyUsage([ExtendedKeyUsageOID.CLIENT_AUTH])]] * len(drivers)
    made: list[Path] = []
    issued: list[x509.Certificate] = []
    try:
        if not (folder / AUTHORITY).exists():
            made += (folder / AUTHORITY, folder / AUTHORITY_PUBLIC)
            _found_authority(folder, now)
        authority = _read_authority(folder / AUTHORITY)
        for (role, name), purpose in zip(names, purposes, strict=True):
            made.append(folder / f"{role}-{name}.pem")
            own = _certified(name, now, _KEYS_DAYS, purpose, authority)
            _write_secret(made[-1], title(role, name), own, authority)
            issued.append(own.certificate)
        replace_file(folder / ISSUED, with_end("".join(map(_pem, [*before, *issued]))).encode())
    except OSError:
        # Half a file would be in the way of the next try.
        for file in made:
            file.unlink(missing_ok=True)
        raise
    return made


def list_keys(folder: Path) -> list[IssuedKeys]:
    """Return all keys of the authority in ``folder``, the oldest first. Raises MotorcadeError where there is none."""
    _read_authority(folder / AUTHORITY)
    revoked = frozenset[int]()
    if (folder / REVOKED).exists():
        revoked = read_revoked(folder / REVOKED)
    keys = []
    for certificate in _issued(folder):
        purposes = certificate.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value
        role = CAR
        if ExtendedKeyUsageOID.CLIENT_AUTH in purposes:
            role = DRIVER
        (name,) = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
        number = certificate.serial_number
        keys.append(IssuedKeys(role, str(name.value), number, certificate.not_valid_after_utc, number in revoked))
    return keys


def revoke_drivers(folder: Path, drivers: Sequence[str]) -> Path:
    """Revoke keys of drivers, and remove the files of those that are named from ``folder``.

    Args:
        drivers: a driver's name, for all their keys, or the serial number of one.

    Returns:
        The file with the list, which cars have to have.

    Raises:
        MotorcadeError: there is no authority, or a driver has no keys that are valid; nothing has changed then.
        OSError: a file can't be written.
    """
    keys = list_keys(folder)
    revoked = {made.number: made.name for made in keys if made.is_revoked}
    valid = [made for made in keys if made.role == DRIVER and not made.is_revoked]
    for driver in drivers:
        found = {made.number: made.name for made in valid if driver == made.name or number_of(driver) == made.number}
        if not found:
            raise MotorcadeError("no-keys-to-revoke", name=driver, folder=folder)
        revoked |= found
    write_revoked(folder / REVOKED, revoked)
    for driver in drivers:
        # Now there may be new keys of that name.
        (folder / f"{DRIVER}-{driver}.pem").unlink(missing_ok=True)
    return folder / REVOKED


def _issued(folder: Path) -> list[x509.Certificate]:
    """The certificates of all keys that were made. Raises MotorcadeError: a list that was cut would revoke too few."""
    file = folder / ISSUED
    try:
        text = without_end(read_bytes(file).decode())
        return x509.load_pem_x509_certificates(text.encode()) if text else []
    except FileNotFoundError:
        return []
    except (OSError, ValueError):
        raise MotorcadeError("not-a-keys-file", file=file, reason=Phrase("issued-not-whole")) from None


def _pem(certificate: x509.Certificate) -> str:
    return certificate.public_bytes(_PEM).decode()


def _car_purpose(car: CarKeys) -> list[x509.ExtensionType]:
    name = _as_address(car.name)
    hosts = (name, f"{name}.local", *_OWN, *car.hosts)
    named = x509.SubjectAlternativeName([_general_name(host) for host in dict.fromkeys(hosts)])
    return [x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), named]


def _as_address(name: str) -> str:
    """Return a car's name as networks write it (RFC 5890), since it is an address too; empty where it can't be one."""
    try:
        return name.encode("idna").decode()
    except UnicodeError:
        return ""


def _general_name(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        if not _HOST.fullmatch(host):
            raise MotorcadeError("not-a-car-address", host=host) from None
        return x509.DNSName(host)


def _found_authority(folder: Path, now: datetime) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    authority = _certified(f"Motorcade authority {folder.resolve().name}"[:64], now, _AUTHORITY_DAYS)
    _write_secret(folder / AUTHORITY, "Motorcade authority: whoever has this file can make keys", authority)
    replace_file(folder / AUTHORITY_PUBLIC, authority.certificate.public_bytes(_PEM))


def _read_authority(file: Path) -> _Authority:
    """Return the key and the certificate in an authority's file. Raises MotorcadeError, or OSError."""
    try:
        data = read_bytes(file)
        key = serialization.load_pem_private_key(data, password=None)
        certificate = x509.load_pem_x509_certificate(data)
    except FileNotFoundError:
        raise MotorcadeError("no-authority", folder=file.parent) from None
    except (ValueError, TypeError):
        raise MotorcadeError("authority-unreadable", file=file) from None
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise MotorcadeError("authority-key-kind", file=file)
    return _Authority(key, certificate)


def _certified(
    name: str,
    now: datetime,
    lasts: timedelta,
    purpose: Iterable[x509.ExtensionType] = (),
    authority: _Authority | None = None,
) -> _Authority:
    """A new key and its certificate; without an ``authority`` it is one itself."""
    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    if authority:
        issuer = authority.certificate.subject
        issuer_key = authority.key
        use = "digital_signature"
        constraints = x509.BasicConstraints(ca=False, path_length=None)
    else:
        issuer = subject
        issuer_key = key
        use = "key_cert_sign"
        constraints = x509.BasicConstraints(ca=True, path_length=0)
    critical = (constraints, x509.KeyUsage(**{usage: usage == use for usage in _USES}))
    others = (
        x509.SubjectKeyIdentifier.from_public_key(key.public_key()),
        x509.AuthorityKeyIdentifier.from_issuer_public_key(issuer_key.public_key()),
        *purpose,
    )
    serial = x509.random_serial_number()
    begin = now - BACKDATED
    end = now + lasts
    builder = x509.CertificateBuilder(issuer, subject, key.public_key(), serial, begin, end)
    for extension in (*critical, *others):
        builder = builder.add_extension(extension, critical=extension in critical)
    return _Authority(key, builder.sign(issuer_key, hashes.SHA256()))


def _write_secret(file: Path, first_line: str, own: _Authority, authority: _Authority | None = None) -> None:
    """Key, certificate and the authority's certificate, in a new file that only its owner may read."""
    key = own.key.private_bytes(_PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    certificates = (pair.certificate.public_bytes(_PEM) for pair in (own, authority) if pair)
    write_secret(file, b"".join([f"{first_line}\n".encode(), key, *certificates]))
