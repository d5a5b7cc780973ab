"""What a pupil types: a nickname, the code of the class and the personal number; each is brought into one form."""

import unicodedata
from collections.abc import Callable, Iterable
from functools import cache
from itertools import chain

from motorcade.errors import MotorcadeError, Phrase
from motorcade.locales import languages

MOST_OF_A_NAME = 24
# No 0 and O, 1, I and L, 2 and Z, 5 and S, 8 and B, U and V: in handwriting each looks like another.
CODE_CHARACTERS = "34679ACDEFGHJKMNPQRTVWXY"
CODE_LENGTH = 6
_NUMBER_LENGTH = 4
# Letters and marks that show nothing (Unicode's Default_Ignorable_Code_Point): a name with one looks like another.
_INVISIBLE = (
    *(0x034F, 0x115F, 0x1160, 0x17B4, 0x17B5, 0x3164, 0xFFA0),
    *(*range(0x180B, 0x1810), *range(0xFE00, 0xFE10), *range(0xE0100, 0xE01F0)),
)
# More marks on a letter than any language writes cover the lines above and below.
_MOST_MARKS = 3
# Cyrillic and Greek letters that look like Latin ones, as small or as capital letters (Unicode's confusables.txt).
_PAIRS = "аa вb еe іi јj кk мm нh оo рp сc тt уy хx ѕs һh ԁd ԛq ԝw αa βb εe ζz ηh ιi κk μm νn οo ρp τt υy χx"
_LOOK_LIKE = str.maketrans({pair[0]: pair[1] for pair in _PAIRS.split()})
# Returns a number from 0 up to below its argument, each with the same chance.
RandomBelow = Callable[[int], int]


def checked_name(text: str) -> str:
    """The name that somebody has chosen, in one Unicode form (NFC), with single spaces; empty for none.

    Raises MotorcadeError for anything but at most 24 letters, marks, digits, spaces and ``.-_'``, where it begins with
    none of letters and digits, has four marks in a row, or a letter that shows nothing.
    """
    name = " ".join(unicodedata.normalize("NFC", text[: 4 * MOST_OF_A_NAME]).split(" ")).strip()
    kinds = "".join(unicodedata.category(each)[0] for each in name)
    allowed = all(kind in "LMN" or each in " .-_'" for each, kind in zip(name, kinds, strict=True))
    allowed = allowed and "M" * (_MOST_MARKS + 1) not in kinds and not any(ord(each) in _INVISIBLE for each in name)
    if name and not (allowed and name[0].isalnum() and len(name) <= MOST_OF_A_NAME and len(text) <= 4 * MOST_OF_A_NAME):
        raise MotorcadeError("bad-user-name", most=MOST_OF_A_NAME)
    return name


def likeness(name: str) -> str:
    """The same text for names that people take for the same: case, width, spaces and look-alikes make no difference."""
    folded = unicodedata.normalize("NFKC", name).casefold()
    plain = unicodedata.normalize("NFKC", folded).translate(_LOOK_LIKE)
    return "".join(each for each in plain if unicodedata.category(each)[0] in "LMN")


@cache
def _reserved() -> frozenset[str]:
    """What a teacher is called, in all languages that the class's pages have, and in some others."""
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
    """A new code of a class."""
    return "".join(CODE_CHARACTERS[random_below(len(CODE_CHARACTERS))] for _ in range(CODE_LENGTH))


def typed_code(text: str) -> str:
    """The code that somebody typed, as `new_code` writes it."""
    return "".join(each for each in unicodedata.normalize("NFKC", text).upper() if each.isalnum())[: 2 * CODE_LENGTH]


def new_number(random_below: RandomBelow, taken: Iterable[str] = ()) -> str:
    """A new personal number, if possible one that nobody else has."""
    free = sorted({f"{each:0{_NUMBER_LENGTH}}" for each in range(10**_NUMBER_LENGTH)} - set(taken))
    return free[random_below(len(free))]


def typed_number(text: str) -> str:
    """The personal number that somebody typed, with plain digits."""
    digits = [each for each in unicodedata.normalize("NFKC", text) if each.isdecimal()]
    return "".join(str(unicodedata.decimal(each)) for each in digits)[: 2 * _NUMBER_LENGTH]
