"""All projects of an owner as one file, and what such a file holds added to the projects of another owner."""

import json
from collections.abc import Iterator
from contextlib import suppress
from datetime import datetime
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta, Struct

from motorcade.errors import MotorcadeError
from motorcade.missions.schema import FORMAT as MISSION_FORMAT
from motorcade.program.diagnostics import ProgramError
from motorcade.program.model import FORMAT, read_document
from motorcade.service.library import LONGEST_NAME, Storage, checked_name, mission_library, stars_in
from motorcade.service.messages import ProjectVersion

# The most bytes of a file.
MOST_BYTES = 32 << 20
_YEAR_2100_S = 4_102_444_800.0


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


class Exported(Struct):
    """The text of the file, and the versions that couldn't be read and aren't in it."""

    text: str
    left_out: list[ProjectVersion] = []


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
    left_out: list[ProjectVersion] = []
    return Exported("".join(_pieces(storage, owner, left_out)), left_out)


def export_answer(storage: Storage, owner: str) -> Iterator[bytes]:
    """Yield `export_all`'s answer as JSON; one version of a project is in memory at a time."""
    left_out: list[ProjectVersion] = []
    yield b'{"text":"'
    for piece in _pieces(storage, owner, left_out):
        yield json.dumps(piece, ensure_ascii=False)[1:-1].encode()
    yield b'","left_out":' + msgspec.json.encode(left_out) + b"}"


def _pieces(storage: Storage, owner: str, left_out: list[ProjectVersion]) -> Iterator[str]:
    """Yield the text of the file; versions that can't be read are added to ``left_out``."""
    yield '{\n "format": "motorcade-projects/1",\n "projects": ['
    yield from _all_of(storage, owner, left_out)
    yield f'],\n "stars": {json.dumps(storage.stars(owner))},\n "missions": ['
    yield from _all_of(storage, mission_library(owner), left_out)
    yield "]\n}\n"


def _all_of(storage: Storage, owner: str, left_out: list[ProjectVersion]) -> Iterator[str]:
    """Yield the texts of an owner's projects, with a comma between two of them, or two versions."""
    for number, entry in enumerate(storage.list(owner)):
        head = json.dumps(entry.name, ensure_ascii=False)
        yield f'{"," if number else ""}\n  {{"name": {head}, "versions": ['
        comma = ""
        for version in reversed(storage.history(owner, entry.name)):
            try:
                text = storage.read(owner, entry.name, version.version).decode()
            except (MotorcadeError, UnicodeDecodeError):
                left_out.append(ProjectVersion(entry.name, version.version))
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
    for stored_as in _similar_names(name):
        stored = _texts(storage, owner, stored_as)
        if stored is None:
            for version in versions:
                storage.write_version(owner, stored_as, version.text.encode(), saved_at_s=version.saved_at_s())
            return ImportedProject(name, stored_as, len(versions))
        if texts <= stored:
            return ImportedProject(name, stored_as, 0)
    raise AssertionError


def _similar_names(name: str) -> Iterator[str]:
    yield name
    number = 2
    while True:
        ending = f" ({number})"
        yield name[: LONGEST_NAME - len(ending)].rstrip() + ending
        number += 1


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
    added = 0
    for mission, earned in stars.items():
        count = len(before.get(mission, ()))
        added += len(storage.add_stars(owner, mission, earned)) - count if earned else 0
    return added
