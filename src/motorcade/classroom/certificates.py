"""The certificate of a class's HTTPS, made where somebody asks for it, by an authority of the class's own."""

import hashlib
from collections.abc import Sequence
from datetime import datetime, timedelta
from pathlib import Path
from typing import NamedTuple

from cryptography import x509

from motorcade.drive.tls.certificates import AUTHORITY_PUBLIC, CarKeys, make_keys
from motorcade.drive.tls.keys import CAR

_NAME = "motorcade"
# A certificate that lasts for less than this is made anew.
_LEAST = timedelta(days=14)


class ClassKeys(NamedTuple):
    """The files of a class's HTTPS: the server's secret keys, and the authority's certificate for tablets."""

    server: Path
    authority: Path


def class_keys(folder: Path, hosts: Sequence[str], now: datetime) -> ClassKeys:
    """The keys for ``motorcade.local`` and these addresses of this computer; made where they aren't there or end soon.

    The authority stays when the addresses change, so a tablet that trusts it goes on to do so. Raises MotorcadeError,
    or OSError where the folder can't be written to.
    """
    digest = hashlib.sha256(" ".join(sorted(hosts)).encode()).hexdigest()[:8]
    kept = folder / f"class-{digest}.pem"
    if not kept.exists() or _ends_before(kept, now + _LEAST):
        made = folder / f"{CAR}-{_NAME}.pem"
        made.unlink(missing_ok=True)
        make_keys(folder, [CarKeys(_NAME, tuple(hosts))], [], now)
        made.replace(kept)
    return ClassKeys(kept, folder / AUTHORITY_PUBLIC)


def _ends_before(keys: Path, then: datetime) -> bool:
    try:
        return x509.load_pem_x509_certificate(keys.read_bytes()).not_valid_after_utc < then
    except ValueError:
        return True
