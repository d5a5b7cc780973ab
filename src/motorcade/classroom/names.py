"""What a pupil types: a nickname, the code of the class and the personal number; each is brought into one form."""

import unicodedata
from collections.abc import Callable, Iterable
from functools import cache
from itertools import chain

from motorcade.errors import MotorcadeError, Phrase
from motorcade.locales import languages

# No 0 and O, 1, I and L, 2 and Z, 5 and S, 8 and B, U and V: in handwriting each looks like another.
CODE_CHARACTERS = "34679ACDEFGHJKMNPQRTVWXY"
CODE_LENGTH = 6
_NUMBER_LENGTH = 4
# Cyrillic and Greek letters that look like Latin ones, as small or as capital letters (Unicode's confusables.txt).
_PAIRS = "аa вb еe іi јj кk мm нh оo рp сc тt уy хx ѕs һh ԁd ԛq ԝw αa βb εe ζz ηh ιi κk μm νn οo ρp τt υy χx"
_LOOK_LIKE = str.maketrans({pair[0]: pair[1] for pair in _PAIRS.split()})
# Returns a number from 0 up to below its argument, each with the same chance.
RandomBelow = Callable[[int], int]


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
