"""Where projects are stored, and the rules that every storage has: names, limits, versions and stars; users' names.

All projects of an owner become one file, and what such a file holds is added to the projects of another owner.
"""

import json
import re
import unicodedata
from collections.abc import Iterable, Iterator
from contextlib import suppress
from datetime import UTC, datetime
from typing import Annotated, Any, Literal, NamedTuple, Protocol

import msgspec
from msgspec import Meta, Struct

from motorcade.errors import MotorcadeError
from motorcade.missions.schema import FORMAT as MISSION_FORMAT
from motorcade.program.diagnostics import ProgramError
from motorcade.program.model import read_document
from motorcade.program.schema import FORMAT
from motorcade.service import messages

# A character takes at most four bytes, three where it is quoted: with a digest a file name stays below 255 bytes.
LONGEST_NAME = 60
# Letters that turn the direction of what follows: a name with one reads otherwise than it is.
_TURNS = frozenset("\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")
_NEVER = _TURNS | {"/", "\\"}
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
_MISSION = re.compile(r"[a-z0-9][a-z0-9-]{0,59}")
# The most bytes of a file.
MOST_BYTES = 32 << 20
_YEAR_2100_S = 4_102_444_800.0


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
    is_allowed = 0 < len(name) <= LONGEST_NAME and name not in (".", "..")
    if not is_allowed or not all(map(_may_be_in_a_name, name)):
        raise MotorcadeError("bad-project-name", most=LONGEST_NAME)
    return name


def allowed_name(name: str) -> str:
    """Return a name that a project may have, near to ``name``."""
    kept = (letter if _may_be_in_a_name(letter) else "_" for letter in unicodedata.normalize("NFC", name))
    short = "".join(kept).strip()[:LONGEST_NAME].strip()
    if short in ("", ".", ".."):
        return "_"
    return short


def _may_be_in_a_name(letter: str) -> bool:
    return letter not in _NEVER and unicodedata.category(letter) not in _UNWANTED


def checked_user_name(text: str) -> str:
    """The name that somebody has chosen, in one Unicode form (NFC), with single spaces; empty for none.

    Raises MotorcadeError for anything but at most 24 letters, marks, digits, spaces and ``.-_'``, where it begins with
    none of letters and digits, has four marks in a row, or a letter that shows nothing.
    """
    normal = unicodedata.normalize("NFC", text[: 4 * MOST_OF_A_NAME])
    name = " ".join(normal.split(" ")).strip()
    if name and not (_may_be_a_user_name(name) and len(text) <= 4 * MOST_OF_A_NAME):
        raise MotorcadeError("bad-user-name", most=MOST_OF_A_NAME)
    return name


def _may_be_a_user_name(name: str) -> bool:
    if len(name) > MOST_OF_A_NAME or not name[0].isalnum():
        return False
    if any(ord(letter) in _INVISIBLE for letter in name):
        return False
    kinds = "".join(unicodedata.category(letter)[0] for letter in name)
    if "M" * (_MOST_MARKS + 1) in kinds:
        return False
    return all(kind in "LMN" or letter in " .-_'" for letter, kind in zip(name, kinds, strict=True))


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
    return {
        mission: [star for star in (1, 2, 3) if isinstance(stars, list) and star in stars]
        for mission, stars in missions.items()
    }


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

    def place(self) -> messages.StorageState:
        """Whether projects stay, and what is wrong with them; in most storages nothing is."""
        return messages.StorageState()

    def stars(self, owner: str) -> dict[str, "list[int]"]:
        """The stars that an owner has earned: of each mission's id a sorted list."""

    def add_stars(self, owner: str, mission: str, stars: "list[int]") -> "list[int]":
        """Add stars of a mission to those that an owner has; return all of them. Raises MotorcadeError."""

    # The last method: after it, in this class, `list` means this method.
    def list(self, owner: str) -> list[messages.LibraryEntry]:
        """All projects of an owner, the one saved last first."""


class _Version(Struct):
    saved_at: Annotated[datetime, Meta(tz=True)]
    text: str

    def saved_at_s(self) -> float:
        return min(max(0.0, self.saved_at.timestamp()), _YEAR_2100_S)


class _Project(Struct):
    name: str
    # The oldest first.
    versions: list[_Version]


class _File(Struct):
    format: Literal["motorcade-projects/1"]
    projects: list[_Project]
    stars: dict[str, Any] = {}
    missions: list[_Project] = []


class LeftOut(Struct):
    """A version of a project that couldn't be read."""

    name: str
    version: int


class Exported(Struct):
    """The text of the file, and the versions that aren't in it."""

    text: str
    left_out: list[LeftOut] = []


class ImportedProject(Struct):
    """A project of the file: the name under which it is stored, and how many versions were added.

    Attributes:
        name: its name in the file.
        stored_as: another one where a different project has that name already.
        versions: how many versions were added; 0 where all of them were there.
    """

    name: str
    stored_as: str
    versions: int


class Imported(Struct):
    """What an import did.

    Attributes:
        projects: what became of each project of the file.
        stars: how many stars were added.
        left_out: names of projects of which some version is no project file, and wasn't added.
    """

    projects: list[ImportedProject]
    stars: int
    left_out: list[str]


def export_all(storage: Storage, owner: str) -> Exported:
    """Return the file of all projects and own missions of ``owner`` with all versions, and the stars of missions."""
    left_out: list[LeftOut] = []
    return Exported("".join(_pieces(storage, owner, left_out)), left_out)


def export_answer(storage: Storage, owner: str) -> Iterator[bytes]:
    """Yield `export_all`'s answer as JSON; one version of a project is in memory at a time."""
    left_out: list[LeftOut] = []
    yield b'{"text":"'
    for piece in _pieces(storage, owner, left_out):
        yield json.dumps(piece, ensure_ascii=False)[1:-1].encode()
    yield b'","left_out":' + msgspec.json.encode(left_out) + b"}"


def _pieces(storage: Storage, owner: str, left_out: list[LeftOut]) -> Iterator[str]:
    """Yield the text of the file; versions that can't be read are added to ``left_out``."""
    yield '{\n "format": "motorcade-projects/1",\n "projects": ['
    yield from _all_of(storage, owner, left_out)
    yield f'],\n "stars": {json.dumps(storage.stars(owner))},\n "missions": ['
    yield from _all_of(storage, mission_library(owner), left_out)
    yield "]\n}\n"


def _all_of(storage: Storage, owner: str, left_out: list[LeftOut]) -> Iterator[str]:
    """Yield the texts of an owner's projects, with a comma between two of them, or two versions."""
    for number, entry in enumerate(storage.list(owner)):
        head = json.dumps(entry.name, ensure_ascii=False)
        yield f'{"," if number else ""}\n  {{"name": {head}, "versions": ['
        comma = ""
        for version in reversed(storage.history(owner, entry.name)):
            try:
                text = storage.read(owner, entry.name, version.version).decode()
            except (MotorcadeError, UnicodeDecodeError):
                left_out.append(LeftOut(entry.name, version.version))
            else:
                whole = {"saved_at": version.saved_at, "text": text}
                yield f"{comma}\n   {json.dumps(whole, ensure_ascii=False)}"
                comma = ","
        yield "]}"


def import_all(storage: Storage, owner: str, text: str) -> Imported:
    """Add the projects of a file to those of ``owner``: nothing that is stored is lost.

    A project whose name is taken is stored beside the old one under a new name, unless all of its versions are there
    already. Raises MotorcadeError where the text isn't such a file, or the storage refuses it.
    """
    file = _read(text)
    left_out: list[str] = []
    projects = []
    libraries = ((owner, file.projects, FORMAT), (mission_library(owner), file.missions, MISSION_FORMAT))
    for library, found, file_format in libraries:
        for project in found:
            name = checked_name(project.name)
            versions = [version for version in project.versions if _is_file(version.text, file_format)]
            if len(versions) < len(project.versions):
                left_out.append(name)
            if versions:
                projects.append(_add(storage, library, name, versions))
    return Imported(projects, _add_stars(storage, owner, stars_in(file.stars)), left_out)


def _read(text: str) -> _File:
    """Return the file's content. Raises MotorcadeError; nothing is stored before the whole file was read."""
    if len(text) > MOST_BYTES:
        raise MotorcadeError("body-too-large", most=MOST_BYTES)
    try:
        file = msgspec.json.decode(text, type=_File)
        for project in (*file.projects, *file.missions):
            checked_name(project.name)
    except (msgspec.DecodeError, RecursionError, UnicodeError, MotorcadeError):
        raise MotorcadeError("no-projects-file") from None
    return file


def _is_file(text: str, file_format: str) -> bool:
    try:
        document = read_document(text)
    except ProgramError:
        return False
    return isinstance(document, dict) and document.get("format") == file_format


def _add(storage: Storage, owner: str, name: str, versions: list[_Version]) -> ImportedProject:
    """Store the versions under the first name like ``name`` that is free; nothing where they are there already."""
    texts = {version.text.encode() for version in versions}
    stored_as = name
    number = 1
    while (stored := _texts(storage, owner, stored_as)) is not None:
        if texts <= stored:
            return ImportedProject(name, stored_as, 0)
        number += 1
        ending = f" ({number})"
        stored_as = name[: LONGEST_NAME - len(ending)].rstrip() + ending
    for version in versions:
        storage.write_version(owner, stored_as, version.text.encode(), saved_at_s=version.saved_at_s())
    return ImportedProject(name, stored_as, len(versions))


def _texts(storage: Storage, owner: str, name: str) -> set[bytes] | None:
    """Return the texts of a project's versions that can be read; None for no project."""
    try:
        history = storage.history(owner, name)
    except MotorcadeError:
        return None
    texts = set()
    for version in history:
        with suppress(MotorcadeError):
            texts.add(storage.read(owner, name, version.version))
    return texts


def _add_stars(storage: Storage, owner: str, stars: dict[str, list[int]]) -> int:
    before = storage.stars(owner)
    return sum(
        len(storage.add_stars(owner, mission, earned)) - len(before.get(mission, ()))
        for mission, earned in stars.items()
        if earned
    )
