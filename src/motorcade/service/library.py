"""Where projects are stored, and the rules that every storage has: names, limits, versions and stars; users' names."""

import re
import unicodedata
from collections.abc import Iterable
from datetime import UTC, datetime
from typing import NamedTuple, Protocol

from motorcade.errors import MotorcadeError
from motorcade.service import messages

# A character takes at most four bytes, three where it is quoted: with a digest a file name stays below 255 bytes.
LONGEST_NAME = 60
# Letters that turn the direction of what follows: a name with one reads otherwise than it is.
_TURNS = frozenset("\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")
# Control characters, surrogates, private characters, line and paragraph separators.
_UNWANTED = ("Cc", "Cs", "Co", "Zl", "Zp")
# Of a user: a pupil's nickname, or a driver's name.
MOST_OF_A_NAME = 24
# Letters and marks that show nothing (Unicode's Default_Ignorable_Code_Point): a name with one looks like another.
_INVISIBLE = (
    *(0x034F, 0x115F, 0x1160, 0x17B4, 0x17B5, 0x3164, 0xFFA0),
    *(*range(0x180B, 0x1810), *range(0xFE00, 0xFE10), *range(0xE0100, 0xE01F0)),
)
# More marks on a letter than any language writes cover the lines above and below.
_MOST_MARKS = 3
_ALL_STARS = (1, 2, 3)
_MISSION = re.compile(r"[a-z0-9][a-z0-9-]{0,59}")


class Limits(NamedTuple):
    """How much an owner may store.

    Attributes:
        projects: how many projects.
        versions: how many versions of each; the oldest are removed beyond that.
        size_bytes: of all versions, those of deleted projects among them as long as they are stored.
    """

    projects: int = 500
    versions: int = 500
    size_bytes: int = 1 << 30


DEFAULT_LIMITS = Limits()


def checked_name(name: str) -> str:
    """Return a project's name in Unicode's form NFC, without spaces around it. Raises MotorcadeError."""
    name = unicodedata.normalize("NFC", name).strip()
    is_allowed = 0 < len(name) <= LONGEST_NAME and name not in (".", "..") and not set(name) & {"/", "\\", *_TURNS}
    if not is_allowed or any(unicodedata.category(character) in _UNWANTED for character in name):
        raise MotorcadeError("bad-project-name", most=LONGEST_NAME)
    return name


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


def check_base(name: str, base: int | None, newest: int) -> None:
    """Raise MotorcadeError where ``newest`` isn't the version that a change began with; None: any version is right."""
    if base is not None and base != newest:
        raise MotorcadeError("saved-elsewhere" if base else "project-exists", name=name, version=newest)


def check_count(limits: Limits, projects: int) -> None:
    """Raise MotorcadeError where an owner has ``projects`` projects and begins another one."""
    if projects >= limits.projects:
        raise MotorcadeError("too-many-projects", most=limits.projects)


def iso_time(moment_s: float) -> str:
    """Return a moment (seconds since 1970) as ISO 8601, UTC, with milliseconds."""
    return datetime.fromtimestamp(moment_s, UTC).isoformat(timespec="milliseconds")


def stars_in(value: object) -> dict[str, list[int]]:
    """Return the valid stars by mission in what a file or a browser has stored; what else it has is left out."""
    if not isinstance(value, dict):
        return {}
    missions = {key: stars for key, stars in value.items() if isinstance(key, str) and _MISSION.fullmatch(key)}
    return {mission: _valid_stars(stars) for mission, stars in missions.items()}


def _valid_stars(value: object) -> list[int]:
    return [star for star in _ALL_STARS if isinstance(value, list) and star in value]


def united_stars(earned: dict[str, list[int]], mission: str, stars: Iterable[int]) -> list[int]:
    """Return the stars of a mission: those earned before, and ``stars``."""
    return sorted({*earned.get(mission, ()), *stars})


def mission_library(owner: str) -> str:
    """Return the owner under whom a storage has the missions that ``owner`` wrote: their names meet no project's."""
    return f"{owner}~missions"


class Storage(Protocol):
    """Projects by owner and name; every version of a project is stored.

    Each method is atomic: another caller sees the state before it or after it, never between. Each raises
    MotorcadeError where the name of an owner or a project isn't allowed.
    """

    def read(self, owner: str, name: str, version: int | None = None) -> bytes:
        """The text of a version, by default of the newest. Raises MotorcadeError where there is none."""

    def write_version(
        self, owner: str, name: str, data: bytes, base: int | None = None, saved_at_s: float | None = None
    ) -> int:
        """Store ``data`` as the newest version, unless it equals the newest one; return the version's number.

        Args:
            base: the version that ``data`` was made from, 0 for none; None where that doesn't matter.
            saved_at_s: when it was saved, seconds since 1970; None for now.

        Raises MotorcadeError where the name isn't allowed, the newest version isn't ``base``, or the data can't be
        written.
        """

    def history(self, owner: str, name: str) -> list[messages.Version]:
        """All versions of a project, the newest first. Raises MotorcadeError where there is no such project."""

    def delete(self, owner: str, name: str) -> None:
        """Remove a project with all its versions from the list. Raises MotorcadeError where there is none."""

    def place(self, owner: str) -> messages.StorageState:
        """How many bytes an owner uses and may use, how long they stay, and what is wrong."""

    def stars(self, owner: str) -> dict[str, "list[int]"]:
        """The stars that an owner has earned: of each mission's id a sorted list."""

    def add_stars(self, owner: str, mission: str, stars: "list[int]") -> "list[int]":
        """Add stars of a mission to those that an owner has; return all of them. Raises MotorcadeError."""

    # The last method: after it, in this class, `list` means this method.
    def list(self, owner: str) -> list[messages.LibraryEntry]:
        """All projects of an owner, the one saved last first."""
