"""Projects in a folder on disk, with all their versions (`motorcade.service.requests.Storage`).

A project is a folder; its versions are the files ``000001.motorcade.json`` and so on in it, which users can read, copy
and put under version control. An owner other than "" has a folder of its own in ``owners``. The stars of an owner's
missions are in the file ``missions.json``.
"""

import json
import os
import re
import unicodedata
from hashlib import sha256
from itertools import count
from pathlib import Path
from stat import S_ISREG

from filelock import FileLock

from motorcade.config.files import SaveError, parse, raised_as, read_bytes, replace_file
from motorcade.errors import MotorcadeError
from motorcade.service.library import (
    DEFAULT_LIMITS,
    Limits,
    Storage,
    check_base,
    check_count,
    checked_name,
    iso_time,
    stars_in,
    united_stars,
)
from motorcade.service.messages import LibraryEntry, Version

DELETED = "deleted"
OWNERS = "owners"
# The stars of missions that an owner has earned.
STARS = "missions.json"
STARS_LOCK = ".missions.lock"
# For another process that writes stars; longer than any disk takes.
LONGEST_WAIT_S = 10
_ENDING = ".motorcade.json"
# Characters that some file system refuses or treats specially; the dot because for Windows "con.x" is a device.
_QUOTED = re.compile(r'[<>:"/\\|?*%.]')
_QUOTE = re.compile("%([0-9A-F]{2})")


class FolderStorage(Storage):
    """The projects in ``folder``, which is created when the first is saved.

    Several objects, also in several processes, may use one folder. The size is counted once, so what another process
    stores meanwhile counts from the next start on.
    """

    def __init__(self, folder: Path, limits: Limits = DEFAULT_LIMITS) -> None:
        self._folder = folder
        self._limits = limits
        self._used_bytes: dict[str, int] = {}

    def write_version(
        self, owner: str, name: str, data: bytes, base: int | None = None, saved_at_s: float | None = None
    ) -> int:
        folder = self._owner_folder(owner) / folder_of(name)
        with raised_as("cant-save", OSError, SaveError):
            newest = next((version.version for version in _versions(folder)), 0)
            if newest and read_bytes(_file(folder, newest)) == data:
                return newest
            check_base(name, base, newest)
            self._check_room(owner, newest == 0, len(data))
            folder.mkdir(parents=True, exist_ok=True)
            version = _reserve(folder, name, newest, base)
            try:
                replace_file(_file(folder, version), data)
            except OSError:
                # A full disk keeps no empty file for each attempt.
                _file(folder, version).unlink(missing_ok=True)
                raise
            if saved_at_s is not None:
                os.utime(_file(folder, version), (saved_at_s, saved_at_s))
            self._used_bytes[owner] += len(data)
            for oldest in _versions(folder)[self._limits.versions :]:
                self._used_bytes[owner] -= _file(folder, oldest.version).stat().st_size
                _file(folder, oldest.version).unlink()
        return version

    def _check_room(self, owner: str, is_new: bool, size_bytes: int) -> None:
        """Raise MotorcadeError where an owner has too much."""
        if owner not in self._used_bytes:
            files = self._owner_folder(owner).rglob(f"*{_ENDING}")
            self._used_bytes[owner] = sum(file.stat().st_size for file in files)
        most = self._limits
        if is_new:
            check_count(most, len(self.list(owner)))
        if self._used_bytes[owner] + size_bytes > most.size_bytes:
            raise MotorcadeError("library-full", most=most.size_bytes / 1e6, folder=self._owner_folder(owner))

    def read(self, owner: str, name: str, version: int | None = None) -> bytes:
        folder, versions = self._existing(owner, name)
        chosen = version
        if version is None:
            chosen = versions[0].version
        if chosen not in {version_there.version for version_there in versions}:
            raise MotorcadeError("no-version", name=name, version=chosen)
        with raised_as("cant-read", OSError):
            return read_bytes(_file(folder, chosen))

    def history(self, owner: str, name: str) -> list[Version]:
        return self._existing(owner, name)[1]

    def delete(self, owner: str, name: str) -> None:
        """Move a project to the folder ``deleted``, from which a user can move it back. Raises MotorcadeError."""
        folder, _ = self._existing(owner, name)
        deleted = folder.parent / DELETED
        try:
            deleted.mkdir(exist_ok=True)
        except OSError:
            # A full disk has no room for it, or a file has that name: the project is out of the list all the same.
            deleted = folder.parent
        taken = {child.name for child in children(deleted)}
        free = next(wish for number in count(1) if (wish := f"{folder.name}.{number}") not in taken)
        with raised_as("cant-delete", OSError), raised_as("no-project", FileNotFoundError, name=name):
            folder.rename(deleted / free)

    def stars(self, owner: str) -> dict[str, "list[int]"]:
        """Return what is valid in the owner's file, which may be damaged or of another program."""
        try:
            document = parse(read_bytes(self._owner_folder(owner) / STARS), "JSON", STARS)
        except (OSError, MotorcadeError):
            return {}
        if isinstance(document, dict):
            return stars_in(document.get("stars"))
        return {}

    def add_stars(self, owner: str, mission: str, stars: "list[int]") -> "list[int]":
        """Store stars, one at a time among all threads and processes: one would lose what another wrote meanwhile."""
        folder = self._owner_folder(owner)
        if not stars:
            return self.stars(owner).get(mission, [])
        with raised_as("cant-save", OSError, SaveError):
            folder.mkdir(parents=True, exist_ok=True)
            with FileLock(folder / STARS_LOCK, timeout=LONGEST_WAIT_S):
                before = self.stars(owner)
                earned = united_stars(before, mission, stars)
                if earned != before.get(mission, []):
                    text = json.dumps({"format": "motorcade-stars/1", "stars": before | {mission: earned}}, indent=1)
                    replace_file(folder / STARS, f"{text}\n".encode())
        return earned

    def _owner_folder(self, owner: str) -> Path:
        if owner:
            return self._folder / OWNERS / folder_of(owner)
        return self._folder

    def _existing(self, owner: str, name: str) -> tuple[Path, list[Version]]:
        folder = self._owner_folder(owner) / folder_of(name)
        versions = _versions(folder)
        if not versions:
            raise MotorcadeError("no-project", name=name)
        return folder, versions

    # The last method: below it `list` would be this one.
    def list(self, owner: str) -> list[LibraryEntry]:
        found = []
        for folder in children(self._owner_folder(owner)):
            if (name := name_of(folder.name)) is not None and (versions := _versions(folder)):
                found.append(LibraryEntry(name, versions[0].saved_at, len(versions)))
        return sorted(found, key=lambda entry: (entry.saved_at, entry.name), reverse=True)


def folder_of(name: str) -> str:
    """Return the folder of the project called ``name``: a name that every file system allows. Raises MotorcadeError.

    Its digest makes two names differ also where the file system doesn't distinguish a from A.
    """
    name = checked_name(name)
    return f"{_QUOTED.sub(lambda found: f'%{ord(found[0]):02X}', name)}-{sha256(name.encode()).hexdigest()[:8]}"


def name_of(folder: str) -> str | None:
    """Return the name of the project in ``folder``; None where it isn't a project's folder."""
    quoted = unicodedata.normalize("NFC", folder).rpartition("-")[0]
    name = _QUOTE.sub(lambda found: chr(int(found[1], 16)), quoted)
    try:
        is_project = folder_of(name) == unicodedata.normalize("NFC", folder)
    except (MotorcadeError, UnicodeEncodeError):
        return None
    return name if is_project else None


def _versions(folder: Path) -> list[Version]:
    """Return the versions in a project's folder, the newest first, without empty files, which are being written."""
    found = []
    for file in children(folder):
        number = file.name.removesuffix(_ENDING)
        if number == file.name or not re.fullmatch(r"[0-9]{6,9}", number):
            continue
        try:
            status = file.stat()
        except OSError:
            continue
        if S_ISREG(status.st_mode) and status.st_size:
            found.append(Version(int(number), iso_time(status.st_mtime)))
    return sorted(found, key=lambda version: version.version, reverse=True)


def _file(folder: Path, version: int) -> Path:
    return folder / f"{version:06}{_ENDING}"


def _reserve(folder: Path, name: str, newest: int, base: int | None) -> int:
    """Reserve the first free number behind ``newest`` by creating its file; return it.

    Raises MotorcadeError where another version than ``base`` has become the newest meanwhile.
    """
    version = newest + 1
    while True:
        try:
            _file(folder, version).touch(exist_ok=False)
        except FileExistsError:
            versions = _versions(folder)
            check_base(name, base, versions[0].version if versions else 0)
            version += 1
        else:
            return version


def children(folder: Path) -> list[Path]:
    """Return the entries of ``folder``; none where it doesn't exist or can't be read."""
    try:
        return list(folder.iterdir())
    except OSError:
        return []
