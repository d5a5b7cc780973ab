"""What the two seeds say against themselves or leave open, how it was decided, and words that show it."""

from typing import NamedTuple


class Erratum(NamedTuple):
    """One of them. ``words`` are pairs of a format's name and a word that is right by what was decided."""

    where: str
    says: str
    decided: str
    words: tuple[tuple[str, int], ...] = ()


ERRATA = (
    Erratum(
        "seed 000, table of use cases, c3",
        "6 bits",
        "7 bits: version 0.3 adds the one that enables the motor, and the body describes 1 + 2 + 2 + 2",
        (("control", 0x3F800000),),
    ),
    Erratum(
        "seed 000, table of use cases, c8",
        "12 bits",
        "11 bits, so that 1 + 1 + 7 + 4 + 5 + 1 + 1 + 11 + 1 = 32",
        (("control", 0x00000FFE),),
    ),
    Erratum("seed 000, c8", "fill 9 zeros", "fill all 11: the 9 is left over from an earlier version"),
    Erratum("seed 000, c4", "'these 6 bits' are 0", "its 4 bits", (("control", 0x00780000),)),
    Erratum(
        "seed 000, h1, extension",
        "the message counts parallel modules",
        "h1 counts the serial ones, and the message says so",
    ),
    Erratum(
        "seed 000, order of bits and bytes",
        "nothing",
        "as listed, the first is most significant; big-endian",
        (("header", 0x05030400),),
    ),
    Erratum(
        "seed 001, worked example",
        "a = 40, yet the bits shown and 313307136 hold a = 42",
        "40 packs to 311209984, and 313307136 unpacks to 42",
        (("drive", 0x128CB000), ("drive", 0x12ACB000)),
    ),
    Erratum("seed 001, unpacking in prose", "cmd | mask", "cmd & mask, as its code has it", (("drive", 0x10000000),)),
    Erratum(
        "seed 001, test program",
        "speed 40, backward, angle 150",
        "its struct's order makes it angle 40, speed 150; the second word is what the text means",
        (("drive", 0x1284B000), ("drive", 0x19614000)),
    ),
    Erratum(
        "seed 001, range of the angle",
        "8 bits hold 0 to 255",
        "over 180 is refused at both ends",
        (("drive", 0x1B400000),),
    ),
    Erratum("seed 001, parseCmd", "ignores the code", "the code is checked before all else"),
    Erratum(
        "seed 001, byte order",
        "the word is moved as a native int",
        "network byte order; a little-endian client's four bytes stand reversed, and a signed int is the same 32 bits",
        (("drive", 0x128CB000),),
    ),
)
