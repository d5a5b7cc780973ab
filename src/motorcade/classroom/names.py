"""What pupils and the teacher type: nicknames, codes, numbers and passwords.

Secrets are stored as digests.
"""

import hashlib
import unicodedata
from collections.abc import Callable, Iterable
from functools import cache
from hmac import compare_digest
from itertools import chain

from motorcade.errors import MotorcadeError, Phrase
from motorcade.locales import languages

# No 0 and O, 1, I and L, 2 and Z, 5 and S, 8 and B, U and V: in handwriting each looks like another.
CODE_CHARACTERS = "34679ACDEFGHJKMNPQRTVWXY"
CODE_LENGTH = 6
_NUMBER_LENGTH = 4
LEAST_OF_A_PASSWORD = 8
MOST_OF_A_PASSWORD = 200
# 16 MiB and some 50 ms for each attempt (RFC 7914, section 2).
_COST = 1 << 14
_BLOCK = 8
_PARALLEL = 1
_KIND = "scrypt"
# Cyrillic and Greek letters that look like Latin ones, as small or as capital letters (Unicode's confusables.txt).
_PAIRS = "аa вb еe іi јj кk мm нh оo рp сc тt уy хx ѕs һh ԁd ԛq ԝw αa βb εe ζz ηh ιi κk μm νn οo ρp τt υy χx"
_LOOK_LIKE = str.maketrans({pair[0]: pair[1] for pair in _PAIRS.split()})
# Returns a number from 0 up to below its argument, each with the same chance.
RandomBelow = Callable[[int], int]


def likeness(name: str) -> str:
    """Return the same text for names that people take for the same, whatever case, width, spaces and look-alikes."""
    folded = unicodedata.normalize("NFKC", name).casefold()
    plain = unicodedata.normalize("NFKC", folded).translate(_LOOK_LIKE)
    return "".join(character for character in plain if unicodedata.category(character)[0] in "LMN")


@cache
def _reserved() -> frozenset[str]:
    """Return what a teacher is called, in all languages that the class's pages have, and in some others."""
    names = [Phrase("teacher-names").sentence(language).split(",") for language in languages()]
    return frozenset(likeness(name) for name in chain.from_iterable(names))


def check_free(name: str, others: Iterable[str]) -> None:
    """Raise MotorcadeError where the name is empty or a teacher's, or one of the others has it or one like it."""
    if not name:
        raise MotorcadeError("nickname-missing")
    if likeness(name) in _reserved():
        raise MotorcadeError("nickname-reserved", name=name)
    if likeness(name) in map(likeness, others):
        raise MotorcadeError("nickname-taken", name=name)


def new_code(random_below: RandomBelow) -> str:
    """Return a new code of a class."""
    return "".join(CODE_CHARACTERS[random_below(len(CODE_CHARACTERS))] for _ in range(CODE_LENGTH))


def typed_code(text: str) -> str:
    """Return the code that somebody typed, as `new_code` writes it."""
    normal = unicodedata.normalize("NFKC", text).upper()
    code = "".join(character for character in normal if character.isalnum())
    return code[: 2 * CODE_LENGTH]


def new_number(random_below: RandomBelow, taken: Iterable[str] = ()) -> str:
    """Return a new personal number, if possible one that nobody else has."""
    used = sorted({int(text) for text in taken})
    number = random_below(10**_NUMBER_LENGTH - len(used))
    for taken_number in used:
        number += taken_number <= number
    return f"{number:0{_NUMBER_LENGTH}}"


def typed_number(text: str) -> str:
    """Return the personal number that somebody typed, with plain digits."""
    digits = filter(str.isdecimal, unicodedata.normalize("NFKC", text))
    number = "".join(str(unicodedata.decimal(digit)) for digit in digits)
    return number[: 2 * _NUMBER_LENGTH]


def check_password(password: str) -> None:
    """Raise MotorcadeError where a new password is too short or too long."""
    if not LEAST_OF_A_PASSWORD <= len(password) <= MOST_OF_A_PASSWORD:
        raise MotorcadeError("bad-password", least=LEAST_OF_A_PASSWORD, most=MOST_OF_A_PASSWORD)


def to_stored(password: str, salt: bytes) -> str:
    """Return what is stored of a password, with 16 random bytes: ``scrypt:COST:SALT:KEY``. It takes some 50 ms."""
    key = _key(password, salt, _COST)
    return f"{_KIND}:{_COST}:{salt.hex()}:{key.hex()}"


def is_password(password: str, stored: str) -> bool:
    """Return whether it is the stored password; what is stored in another form is nobody's. It takes some 50 ms."""
    try:
        kind, cost, salt, key = stored.split(":")
        found = _key(password[: MOST_OF_A_PASSWORD + 1], bytes.fromhex(salt), int(cost))
        return kind == _KIND and compare_digest(found, bytes.fromhex(key))
    except ValueError:
        return False


def _key(password: str, salt: bytes, cost: int) -> bytes:
    return hashlib.scrypt(password.encode("utf-8", "surrogatepass"), salt=salt, n=cost, r=_BLOCK, p=_PARALLEL)


def digest(secret: str) -> str:
    """Return what is stored of a device's secret: it has 192 random bits, so nobody finds it by trying."""
    return hashlib.sha256(secret.encode()).hexdigest()
