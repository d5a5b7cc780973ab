"""Projects in a folder on disk, with all their versions (`motorcade.service.requests.Storage`).

A project is a folder, and its versions are the files ``000001.motorcade.json`` and so on in it: a folder that anybody
can look into, copy and put under version control. An owner other than "" has a folder of its own in ``owners``.
"""

import re
import unicodedata
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from stat import S_ISREG

from motorcade.config.files import replace_file
from motorcade.errors import MotorcadeError
from motorcade.service.messages import LibraryEntry, Version
from motorcade.service.requests import Quota

# Four bytes each, or three for a quoted one, and the digest: short of the 255 bytes that a file's name may have.
LONGEST_NAME = 60
DELETED = "deleted"
OWNERS = "owners"
_ENDING = ".motorcade.json"
_DIGITS = 6
# What some file system can't take, or takes for something else; a dot, for Windows sees a device in "con.x".
_QUOTED = re.compile(r'[<>:"/\\|?*%.]')
_QUOTE = re.compile("%([0-9A-F]{2})")
_UNWANTED = ("Cc", "Cs", "Co", "Zl", "Zp")


class FolderStorage:
    """The projects in ``folder``, which is made when the first is saved.

    Any number of these, in any number of processes, may share a folder.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def write_version(self, owner: str, name: str, data: bytes) -> int:
        """Store ``data`` as the newest version, unless it equals the newest one; returns its number.

        Raises:
            MotorcadeError: the name can't be, or the disk refuses.
        """
        folder = self._shelf(owner) / folder_of(name)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            newest = next(iter(_versions(folder)), None)
            if newest and _file(folder, newest.version).read_bytes() == data:
                return newest.version
            version = _reserve(folder, newest.version + 1 if newest else 1)
            replace_file(_file(folder, version), data)
        except OSError as problem:
            raise _disk_error("cant-save", problem) from None
        return version

    def read(self, owner: str, name: str, version: int | None = None) -> bytes:
        """The text of a version, by default of the newest. Raises MotorcadeError."""
        folder, versions = self._existing(owner, name)
        chosen = versions[0].version if version is None else version
        if chosen not in {each.version for each in versions}:
            raise MotorcadeError("no-version", name=name, version=chosen)
        try:
            return _file(folder, chosen).read_bytes()
        except OSError as problem:
            raise _disk_error("cant-read", problem) from None

    def history(self, owner: str, name: str) -> list[Version]:
        """All versions of a project, the newest first. Raises MotorcadeError."""
        return self._existing(owner, name)[1]

    def delete(self, owner: str, name: str) -> None:
        """Move a project to the folder ``deleted``, from which it can be restored by hand. Raises MotorcadeError."""
        folder, _ = self._existing(owner, name)
        deleted = self._shelf(owner) / DELETED
        try:
            deleted.mkdir(exist_ok=True)
            number = 1 + sum(1 for each in _children(deleted) if each.name.startswith(f"{folder.name}."))
            folder.rename(deleted / f"{folder.name}.{number}")
        except OSError as problem:
            raise _disk_error("cant-delete", problem) from None

    def quota(self, owner: str) -> Quota:
        """How many bytes an owner's projects use; the disk is the only limit."""
        projects = [folder for folder in _children(self._shelf(owner)) if name_of(folder.name) is not None]
        sizes = [_file(folder, each.version).stat().st_size for folder in projects for each in _versions(folder)]
        return Quota(sum(sizes))

    def _shelf(self, owner: str) -> Path:
        return self._folder / OWNERS / folder_of(owner) if owner else self._folder

    def _existing(self, owner: str, name: str) -> tuple[Path, list[Version]]:
        folder = self._shelf(owner) / folder_of(name)
        versions = _versions(folder)
        if not versions:
            raise MotorcadeError("no-project", name=name)
        return folder, versions

    # The last method: below it `list` would be this one.
    def list(self, owner: str) -> list[LibraryEntry]:
        """All projects of an owner, the one saved last first."""
        found = []
        for folder in _children(self._shelf(owner)):
            name = name_of(folder.name)
            versions = _versions(folder) if name is not None else []
            if name is not None and versions:
                found.append(LibraryEntry(name, versions[0].saved_at, len(versions)))
        return sorted(found, key=lambda entry: (entry.saved_at, entry.name), reverse=True)


def _disk_error(code: str, problem: OSError) -> MotorcadeError:
    return MotorcadeError(code, reason=problem.strerror or type(problem).__name__)


def folder_of(name: str) -> str:
    """The folder of the project called ``name``, which every file system can take. Raises MotorcadeError.

    Two names never share a folder, even where the file system doesn't tell a
    from A: the digest does.
    """
    name = unicodedata.normalize("NFC", name).strip()
    wanted = 0 < len(name) <= LONGEST_NAME and name not in (".", "..") and not set(name) & {"/", "\\"}
    if not wanted or any(unicodedata.category(character) in _UNWANTED for character in name):
        raise MotorcadeError("bad-project-name", most=LONGEST_NAME)
    return f"{_QUOTED.sub(lambda found: f'%{ord(found[0]):02X}', name)}-{sha256(name.encode()).hexdigest()[:8]}"


def name_of(folder: str) -> str | None:
    """The project that ``folder`` belongs to; None where it belongs to none."""
    quoted = unicodedata.normalize("NFC", folder).rpartition("-")[0]
    name = _QUOTE.sub(lambda found: chr(int(found[1], 16)), quoted)
    try:
        return name if folder_of(name) == unicodedata.normalize("NFC", folder) else None
    except (MotorcadeError, UnicodeEncodeError):
        return None


def _versions(folder: Path) -> list[Version]:
    """The versions in a project's folder, the newest first; not the empty files, which are about to be written."""
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
    """The first free number from ``version`` on, taken by making its file."""
    while True:
        try:
            _file(folder, version).touch(exist_ok=False)
        except FileExistsError:
            version += 1
        else:
            return version


def _children(folder: Path) -> list[Path]:
    """What stands in ``folder``; nothing where it isn't there, or can't be read."""
    try:
        return list(folder.iterdir())
    except OSError:
        return []
