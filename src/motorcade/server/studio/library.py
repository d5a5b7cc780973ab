"""Projects in a folder, every save of them kept. Knows nothing of HTTP.

A project is a folder, its saves are the files ``000001.motorcade.json`` and so on
in it: a folder that anybody can look into, copy and put under version control.
"""

import re
import unicodedata
from collections.abc import Iterator
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from stat import S_ISREG
from typing import NamedTuple

from motorcade.config.files import replace_file
from motorcade.service.errors import StudioError

# Four bytes each, or three for a quoted one, and the digest: short of the 255 bytes that a file's name may have.
LONGEST_NAME = 60
DELETED = "deleted"
_ENDING = ".motorcade.json"
_DIGITS = 6
# What some file system can't take, or takes for something else; a dot, for Windows sees a device in "con.x".
_QUOTED = re.compile(r'[<>:"/\\|?*%.]')
_QUOTE = re.compile("%([0-9A-F]{2})")
_UNWANTED = ("Cc", "Cs", "Co", "Zl", "Zp")


class Save(NamedTuple):
    """One save of a project: its number, and when it was made (ISO 8601, UTC)."""

    version: int
    saved_at: str


class Entry(NamedTuple):
    """A project: its name, when it was last saved, and how many saves there are."""

    name: str
    saved_at: str
    versions: int


class Library:
    """The projects in ``folder``, which is made when the first is saved.

    Any number of libraries, in any number of processes, may share a folder.
    """

    def __init__(self, folder: Path):
        self._folder = folder

    def entries(self) -> list[Entry]:
        """All projects, the one saved last first."""
        found = []
        for folder in _children(self._folder):
            name = _name_of(folder.name)
            saves = list(_saves(folder)) if name is not None else []
            if name is not None and saves:
                found.append(Entry(name, max(saves).saved_at, len(saves)))
        return sorted(found, key=lambda entry: (entry.saved_at, entry.name), reverse=True)

    def save(self, name: str, text: str) -> int:
        """Keep ``text`` as the newest save of the project and return its number.

        What is the same as the newest save already isn't kept twice. Raises StudioError.
        """
        folder = self._folder / _folder_of(name)
        data = text.encode()
        try:
            folder.mkdir(parents=True, exist_ok=True)
            newest = max(_saves(folder), default=None)
            if newest and _file(folder, newest.version).read_bytes() == data:
                return newest.version
            version = _reserve(folder, newest.version + 1 if newest else 1)
            replace_file(_file(folder, version), data)
        except OSError as problem:
            raise StudioError("cant-save", 500, reason=problem.strerror or type(problem).__name__) from None
        return version

    def text(self, name: str, version: int | None = None) -> bytes:
        """The text of a save, by default the newest. Raises StudioError."""
        folder, saves = self._existing(name)
        chosen = max(saves).version if version is None else version
        if chosen not in {save.version for save in saves}:
            raise StudioError("no-version", 404, name=name, version=chosen)
        try:
            return _file(folder, chosen).read_bytes()
        except OSError as problem:
            raise StudioError("cant-read", 500, reason=problem.strerror or type(problem).__name__) from None

    def saves(self, name: str) -> list[Save]:
        """All saves of a project, the newest first. Raises StudioError."""
        return sorted(self._existing(name)[1], reverse=True)

    def delete(self, name: str) -> None:
        """Move the project to the folder ``deleted``, from which it can be brought back by hand. Raises StudioError."""
        folder, _ = self._existing(name)
        bin_folder = self._folder / DELETED
        try:
            bin_folder.mkdir(exist_ok=True)
            number = 1 + sum(1 for each in _children(bin_folder) if each.name.startswith(f"{folder.name}."))
            folder.rename(bin_folder / f"{folder.name}.{number}")
        except OSError as problem:
            raise StudioError("cant-delete", 500, reason=problem.strerror or type(problem).__name__) from None

    def _existing(self, name: str) -> tuple[Path, list[Save]]:
        folder = self._folder / _folder_of(name)
        saves = list(_saves(folder))
        if not saves:
            raise StudioError("no-project", 404, name=name)
        return folder, saves


def _folder_of(name: str) -> str:
    """The folder of the project called ``name``, which every file system can take. Raises StudioError.

    Two names never share a folder, even where the file system doesn't tell a
    from A: the digest does.
    """
    name = unicodedata.normalize("NFC", name).strip()
    wanted = 0 < len(name) <= LONGEST_NAME and name not in (".", "..") and not set(name) & {"/", "\\"}
    if not wanted or any(unicodedata.category(character) in _UNWANTED for character in name):
        raise StudioError("bad-name", most=LONGEST_NAME)
    return f"{_QUOTED.sub(lambda found: f'%{ord(found[0]):02X}', name)}-{sha256(name.encode()).hexdigest()[:8]}"


def _name_of(folder: str) -> str | None:
    """The project that ``folder`` belongs to; None where it belongs to none."""
    quoted = unicodedata.normalize("NFC", folder).rpartition("-")[0]
    name = _QUOTE.sub(lambda found: chr(int(found[1], 16)), quoted)
    try:
        return name if _folder_of(name) == unicodedata.normalize("NFC", folder) else None
    except (StudioError, UnicodeEncodeError):
        return None


def _saves(folder: Path) -> Iterator[Save]:
    """The saves in a project's folder. A file that somebody is only about to write is empty, and not among them."""
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
            yield Save(int(number), saved_at)


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
