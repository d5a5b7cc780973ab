"""The name that a user chooses: a pupil's nickname, or a driver's name. Others see it."""

import unicodedata

from motorcade.errors import MotorcadeError

MOST_OF_A_NAME = 24
# Letters and marks that show nothing (Unicode's Default_Ignorable_Code_Point): a name with one looks like another.
_INVISIBLE = (
    *(0x034F, 0x115F, 0x1160, 0x17B4, 0x17B5, 0x3164, 0xFFA0),
    *(*range(0x180B, 0x1810), *range(0xFE00, 0xFE10), *range(0xE0100, 0xE01F0)),
)
# More marks on a letter than any language writes cover the lines above and below.
_MOST_MARKS = 3


def checked_user_name(text: str) -> str:
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
