"""The teacher's password and the secrets of devices: what is stored doesn't show them."""

import hashlib
from hmac import compare_digest

from motorcade.errors import MotorcadeError

LEAST_OF_A_PASSWORD, MOST_OF_A_PASSWORD = 8, 200
# 16 MiB and some 50 ms for each attempt (RFC 7914, section 2).
_COST, _BLOCK, _PARALLEL = 1 << 14, 8, 1
_KIND = "scrypt"
_SALT_BYTES = 16


def check_password(password: str) -> None:
    """Raise MotorcadeError where a new password is too short or too long."""
    if not LEAST_OF_A_PASSWORD <= len(password) <= MOST_OF_A_PASSWORD:
        raise MotorcadeError("bad-password", least=LEAST_OF_A_PASSWORD, most=MOST_OF_A_PASSWORD)


def to_stored(password: str, salt: bytes) -> str:
    """What is stored of a password, with 16 random bytes: ``scrypt:COST:SALT:KEY``. It takes some 50 ms."""
    return ":".join((_KIND, str(_COST), salt.hex(), _key(password, salt, _COST).hex()))


def is_password(password: str, stored: str) -> bool:
    """Whether it is the stored password; what is stored in another form is nobody's. It takes some 50 ms."""
    try:
        kind, cost, salt, key = stored.split(":")
        found = _key(password[: MOST_OF_A_PASSWORD + 1], bytes.fromhex(salt), int(cost))
        return kind == _KIND and compare_digest(found, bytes.fromhex(key))
    except ValueError:
        return False


def digest(secret: str) -> str:
    """What is stored of a device's secret: it has 192 random bits, so nobody finds it by trying."""
    return hashlib.sha256(secret.encode()).hexdigest()


def _key(password: str, salt: bytes, cost: int) -> bytes:
    return hashlib.scrypt(password.encode("utf-8", "surrogatepass"), salt=salt, n=cost, r=_BLOCK, p=_PARALLEL)
