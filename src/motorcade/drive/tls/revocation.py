"""List the keys of an authority, and revoke drivers' keys by a list that the authority signs (CRL, RFC 5280).

The certificates that an authority has issued stay in ``issued.pem`` of its folder, so that a key whose file is lost can
be revoked.
"""

from collections.abc import Iterable, Sequence
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from motorcade.config.files import replace_file
from motorcade.drive.tls.certificates import AUTHORITY, BACKDATED, ISSUED, read_authority
from motorcade.drive.tls.keys import CAR, DRIVER
from motorcade.errors import MotorcadeError

REVOKED = "revoked.crl"
_MOST_BYTES = 1 << 20


class IssuedKeys(NamedTuple):
    """Keys that an authority has made; ``number`` is the certificate's serial number."""

    role: str
    name: str
    number: int
    valid_until: datetime
    is_revoked: bool


def list_keys(folder: Path) -> list[IssuedKeys]:
    """Return all keys of the authority in ``folder``, the oldest first. Raises MotorcadeError where there is none."""
    authority = read_authority(folder / AUTHORITY).certificate
    revoked = read_revoked(folder / REVOKED, authority) if (folder / REVOKED).exists() else frozenset()
    issued: dict[int, x509.Certificate] = {}
    # Folders made before 2027 have no list of what was issued.
    for file in (folder / ISSUED, *sorted(folder.glob(f"{CAR}-*.pem")), *sorted(folder.glob(f"{DRIVER}-*.pem"))):
        for certificate in _certificates(file):
            if certificate != authority:
                issued.setdefault(certificate.serial_number, certificate)
    return [_described(each, each.serial_number in revoked) for each in issued.values()]


def revoke_drivers(folder: Path, names: Sequence[str], now: datetime) -> Path:
    """Revoke all keys of the drivers ``names``, and remove their files from ``folder``.

    Args:
        now: with its time zone.

    Returns:
        The file with the list, which a car has to have beside its own keys.

    Raises:
        MotorcadeError: there is no authority, or a driver has no keys that are valid; nothing has changed then.
        OSError: a file can't be written.
    """
    keys = list_keys(folder)
    numbers = {each.number for each in keys if each.is_revoked}
    for name in names:
        found = {each.number for each in keys if (each.role, each.name) == (DRIVER, name) and not each.is_revoked}
        if not found:
            raise MotorcadeError("no-keys-to-revoke", name=name, folder=folder)
        numbers |= found
    replace_file(folder / REVOKED, _signed_list(folder, numbers, now))
    for name in names:
        # Now there may be new keys of that name.
        (folder / f"{DRIVER}-{name}.pem").unlink(missing_ok=True)
    return folder / REVOKED


def read_revoked(file: Path, authority: x509.Certificate) -> frozenset[int]:
    """Return the serial numbers in a list that ``authority`` has signed.

    Raises MotorcadeError where it can't be read, or somebody else has signed it.
    """
    try:
        with file.open("rb") as opened:
            revoked = x509.load_pem_x509_crl(opened.read(_MOST_BYTES))
        key = authority.public_key()
        if isinstance(key, ec.EllipticCurvePublicKey) and revoked.is_signature_valid(key):
            return frozenset(each.serial_number for each in revoked)
    except (OSError, ValueError, TypeError):
        pass
    raise MotorcadeError("revoked-keys-unreadable", file=file)


def authority_of(keys: Path) -> x509.Certificate:
    """Return the authority's certificate in a keys file. Raises MotorcadeError."""
    certificates = _certificates(keys)
    if len(certificates) < 2:
        raise MotorcadeError("keys-without-authority", file=keys)
    return certificates[-1]


def _signed_list(folder: Path, numbers: Iterable[int], now: datetime) -> bytes:
    authority = read_authority(folder / AUTHORITY)
    # A Raspberry Pi's clock may be in the past, and the list holds as long as its authority.
    begin, end = now - BACKDATED, authority.certificate.not_valid_after_utc
    builder = x509.CertificateRevocationListBuilder(authority.certificate.subject, begin, end)
    for number in sorted(numbers):
        revoked = x509.RevokedCertificateBuilder(number, begin).build()
        builder = builder.add_revoked_certificate(revoked)
    return builder.sign(authority.key, hashes.SHA256()).public_bytes(serialization.Encoding.PEM)


def _certificates(file: Path) -> list[x509.Certificate]:
    try:
        with file.open("rb") as opened:
            return x509.load_pem_x509_certificates(opened.read(_MOST_BYTES))
    except FileNotFoundError:
        return []
    except (OSError, ValueError):
        raise MotorcadeError("not-a-keys-file", file=file, reason="PEM") from None


def _described(certificate: x509.Certificate, is_revoked: bool) -> IssuedKeys:
    purposes = certificate.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value
    role = DRIVER if ExtendedKeyUsageOID.CLIENT_AUTH in purposes else CAR
    (name,) = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    number, until = certificate.serial_number, certificate.not_valid_after_utc
    return IssuedKeys(role, str(name.value), number, until, is_revoked)
