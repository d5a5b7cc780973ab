"""Projects in a folder on disk, with all their versions (`motorcade.service.requests.Storage`).

A project is a folder; its versions are the files ``000001.motorcade.json`` and so on in it, which users can read, copy
and put under version control. An owner other than "" has a folder of its own in ``owners``. The stars of an owner's
missions are in the file ``missions.json``.
"""

import json
import re
import unicodedata
from collections.abc import Sequence
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from stat import S_ISREG
from threading import Lock
from typing import NamedTuple

from motorcade.config.files import replace_file
from motorcade.errors import MotorcadeError
from motorcade.service.messages import LibraryEntry, Version
from motorcade.service.requests import Quota, Storage

# A character takes at most four bytes, three where it is quoted: with the digest a file name stays below 255 bytes.
LONGEST_NAME = 60
DELETED = "deleted"
OWNERS = "owners"
# The stars of missions that an owner has earned.
STARS = "missions.json"
_ALL_STARS = (1, 2, 3)
_ENDING = ".motorcade.json"
_DIGITS = 6
# Characters that some file system refuses or treats specially; the dot because for Windows "con.x" is a device.
_QUOTED = re.compile(r'[<>:"/\\|?*%.]')
_QUOTE = re.compile("%([0-9A-F]{2})")
_UNWANTED = ("Cc", "Cs", "Co", "Zl", "Zp")


class Limits(NamedTuple):
    """How much an owner may store.

    Attributes:
        projects: how many projects.
        versions: how many versions of each; the oldest are removed beyond that.
        size_bytes: of all files, deleted projects among them.
    """

    projects: int = 500
    versions: int = 500
    size_bytes: int = 1 << 30


DEFAULT_LIMITS = Limits()


class FolderStorage(Storage):
    """The projects in ``folder``, which is created when the first is saved.

    Several objects, also in several processes, may use one folder. The size is counted once, so what another process
    stores meanwhile counts from the next start on.
    """

    def __init__(self, folder: Path, limits: Limits = DEFAULT_LIMITS) -> None:
        self._folder = folder
        self._limits = limits
        self._used_bytes: dict[str, int] = {}
        self._stars_lock = Lock()

    def write_version(self, owner: str, name: str, data: bytes) -> int:
        folder = self._owner_folder(owner) / folder_of(name)
        try:
            newest = next(iter(_versions(folder)), None)
            if newest and _file(folder, newest.version).read_bytes() == data:
                return newest.version
            self._check_room(owner, newest is None, len(data))
            folder.mkdir(parents=True, exist_ok=True)
            version = _reserve(folder, newest.version + 1 if newest else 1)
            replace_file(_file(folder, version), data)
            self._used_bytes[owner] += len(data)
            self._remove_oldest(owner, folder)
        except OSError as problem:
            raise _disk_error("cant-save", problem) from None
        return version

    def _check_room(self, owner: str, is_new: bool, size_bytes: int) -> None:
        """Raise MotorcadeError where an owner has too much."""
        if owner not in self._used_bytes:
            files = self._owner_folder(owner).rglob(f"*{_ENDING}")
            self._used_bytes[owner] = sum(file.stat().st_size for file in files)
        most = self._limits
        if is_new and len(self.list(owner)) >= most.projects:
            raise MotorcadeError("too-many-projects", most=most.projects)
        if self._used_bytes[owner] + size_bytes > most.size_bytes:
            raise MotorcadeError("library-full", most=most.size_bytes / 1e6, folder=self._owner_folder(owner))

    def _remove_oldest(self, owner: str, folder: Path) -> None:
        for each in _versions(folder)[self._limits.versions :]:
            file = _file(folder, each.version)
            self._used_bytes[owner] -= file.stat().st_size
            file.unlink()

    def read(self, owner: str, name: str, version: int | None = None) -> bytes:
        folder, versions = self._existing(owner, name)
        chosen = versions[0].version if version is None else version
        if chosen not in {each.version for each in versions}:
            raise MotorcadeError("no-version", name=name, version=chosen)
        try:
            return _file(folder, chosen).read_bytes()
        except OSError as problem:
            raise _disk_error("cant-read", problem) from None

    def history(self, owner: str, name: str) -> list[Version]:
        return self._existing(owner, name)[1]

    def delete(self, owner: str, name: str) -> None:
        """Move a project to the folder ``deleted``, from which a user can move it back. Raises MotorcadeError."""
        folder, _ = self._existing(owner, name)
        deleted = self._owner_folder(owner) / DELETED
        try:
            deleted.mkdir(exist_ok=True)
            number = 1 + sum(1 for each in _children(deleted) if each.name.startswith(f"{folder.name}."))
            folder.rename(deleted / f"{folder.name}.{number}")
        except OSError as problem:
            raise _disk_error("cant-delete", problem) from None

    def quota(self, owner: str) -> Quota:
        """How many bytes an owner's projects use, and may use."""
        projects = [folder for folder in _children(self._owner_folder(owner)) if name_of(folder.name) is not None]
        sizes = [_file(folder, each.version).stat().st_size for folder in projects for each in _versions(folder)]
        return Quota(sum(sizes), self._limits.size_bytes)

    def stars(self, owner: str) -> dict[str, "list[int]"]:
        """Of a file that is damaged, or that another program wrote, what is valid counts."""
        try:
            document = json.loads((self._owner_folder(owner) / STARS).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        found = document.get("stars") if isinstance(document, dict) else None
        return {name: _stars_in(stars) for name, stars in found.items()} if isinstance(found, dict) else {}

    def add_stars(self, owner: str, mission: str, stars: "list[int]") -> "list[int]":
        with self._stars_lock:
            before = self.stars(owner)
            earned = sorted({*before.get(mission, ()), *stars})
            if earned == before.get(mission, []):
                return earned
            folder = self._owner_folder(owner)
            text = json.dumps({"format": "motorcade-stars/1", "stars": before | {mission: earned}}, indent=1) + "\n"
            try:
                folder.mkdir(parents=True, exist_ok=True)
                replace_file(folder / STARS, text.encode())
            except OSError as problem:
                raise _disk_error("cant-save", problem) from None
        return earned

    def _owner_folder(self, owner: str) -> Path:
        return self._folder / OWNERS / folder_of(owner) if owner else self._folder

    def _existing(self, owner: str, name: str) -> tuple[Path, list[Version]]:
        folder = self._owner_folder(owner) / folder_of(name)
        versions = _versions(folder)
        if not versions:
            raise MotorcadeError("no-project", name=name)
        return folder, versions

    # The last method: below it `list` would be this one.
    def list(self, owner: str) -> list[LibraryEntry]:
        found = []
        for folder in _children(self._owner_folder(owner)):
            name = name_of(folder.name)
            versions = _versions(folder) if name is not None else []
            if name is not None and versions:
                found.append(LibraryEntry(name, versions[0].saved_at, len(versions)))
        return sorted(found, key=lambda entry: (entry.saved_at, entry.name), reverse=True)


def _stars_in(value: object) -> list[int]:
    """The stars in what a file has; none where that is no list."""
    return [star for star in _ALL_STARS if isinstance(value, Sequence) and star in value]


def _disk_error(code: str, problem: OSError) -> MotorcadeError:
    return MotorcadeError(code, reason=problem.strerror or type(problem).__name__)


def folder_of(name: str) -> str:
    """Return the folder of the project called ``name``: a name that every file system allows. Raises MotorcadeError.

    Its digest makes two names differ also where the file system doesn't distinguish a from A.
    """
    name = unicodedata.normalize("NFC", name).strip()
    is_allowed = 0 < len(name) <= LONGEST_NAME and name not in (".", "..") and not set(name) & {"/", "\\"}
    if not is_allowed or any(unicodedata.category(character) in _UNWANTED for character in name):
        raise MotorcadeError("bad-project-name", most=LONGEST_NAME)
    return f"{_QUOTED.sub(lambda found: f'%{ord(found[0]):02X}', name)}-{sha256(name.encode()).hexdigest()[:8]}"


def name_of(folder: str) -> str | None:
    """Return the name of the project in ``folder``; None where it isn't a project's folder."""
    quoted = unicodedata.normalize("NFC", folder).rpartition("-")[0]
    name = _QUOTE.sub(lambda found: chr(int(found[1], 16)), quoted)
    try:
        return name if folder_of(name) == unicodedata.normalize("NFC", folder) else None
    except (MotorcadeError, UnicodeEncodeError):
        return None


def _versions(folder: Path) -> list[Version]:
    """Return the versions in a project's folder, the newest first, without empty files, which are being written."""
    found = []
    for file in _children(folder):
        number = file.name.removesuffix(_ENDING)
        if number == file.name or not re.fullmatch(r"[0-9]{6,9}", number):
            continue
        try:
            status = file.stat()
        except OSError:
            continue
        if S_ISREG(status.st_mode) and status.st_size:
            saved_at = datetime.fromtimestamp(status.st_mtime, UTC).isoformat(timespec="milliseconds")
            found.append(Version(int(number), saved_at))
    return sorted(found, key=lambda each: each.version, reverse=True)


def _file(folder: Path, version: int) -> Path:
    return folder / f"{version:0{_DIGITS}}{_ENDING}"


def _reserve(folder: Path, version: int) -> int:
    """Reserve the first free number from ``version`` on by creating its file; return it."""
    while True:
        try:
            _file(folder, version).touch(exist_ok=False)
        except FileExistsError:
            version += 1
        else:
            return version


def _children(folder: Path) -> list[Path]:
    """Return the entries of ``folder``; none where it doesn't exist or can't be read."""
    try:
        return list(folder.iterdir())
    except OSError:
        return []
