"""The folder of a class: ``class.json``, and in ``owners`` the shelf of each pupil.

The folder is the whole class: a copy of it is a backup. A file is replaced whole, so a copy made at any time is good.
"""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from threading import Lock

from motorcade.classroom.names import RandomBelow
from motorcade.classroom.record import ClassRecord, from_bytes, new_record, to_bytes
from motorcade.config.files import disk_reason, locked, replace_file
from motorcade.errors import MotorcadeError
from motorcade.server.studio.library import FolderStorage
from motorcade.service.library import LONGEST_NAME, Limits, mission_library

RECORD, DRAFT, _LOCK = "class.json", "draft.json", ".running"
# A pupil's program has some 10 kB; 100 versions of 100 projects fit.
LIMITS = Limits(projects=100, versions=100, size_bytes=128 << 20)


class ClassFolder(FolderStorage):
    """The files of a class; an owner is a pupil's id, or the teacher.

    All methods may be called in several threads.

    Attributes:
        problem: why the disk takes nothing at present; None where it took what was stored last.
    """

    def __init__(self, folder: Path, limits: Limits = LIMITS) -> None:
        super().__init__(folder, limits)
        self._file = folder / RECORD
        self._copying = Lock()
        self.problem: MotorcadeError | None = None
        self._new: ClassRecord | None = None

    @contextmanager
    def _storing(self) -> Iterator[None]:
        """Keep in mind whether the disk takes what the block stores; OSError becomes MotorcadeError."""
        try:
            yield
        except OSError as problem:
            error = MotorcadeError("cant-save", reason=disk_reason(problem))
            self._note(error)
            raise error from None
        except MotorcadeError as problem:
            if problem.code == "cant-save":
                self._note(problem)
            raise
        self.problem = None

    def _note(self, problem: MotorcadeError) -> None:
        self.problem = MotorcadeError("class-not-stored", reason=problem.details["reason"])

    def write_version(
        self, owner: str, name: str, data: bytes, base: int | None = None, saved_at_s: float | None = None
    ) -> int:
        """As the base class does."""
        with self._storing():
            return super().write_version(owner, name, data, base, saved_at_s)

    def add_stars(self, owner: str, mission: str, stars: list[int]) -> list[int]:
        """As the base class does."""
        with self._storing():
            return super().add_stars(owner, mission, stars)

    @contextmanager
    def opened(self) -> Iterator[None]:
        """Keep the folder for this process while the block runs.

        Raises MotorcadeError where another server uses it, or it can't be written to.
        """
        try:
            self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            with suppress(OSError):
                # A folder that was there already; some disks have no permissions.
                self._folder.chmod(0o700)
            with locked(self._folder / _LOCK, MotorcadeError("class-is-running", folder=self._folder)):
                yield
        except OSError as problem:
            raise MotorcadeError("folder-not-writable", folder=self._folder, reason=disk_reason(problem)) from None

    def load(self, random_below: RandomBelow) -> ClassRecord:
        """The class in the folder, or a new one. Raises MotorcadeError where its file is damaged."""
        try:
            return from_bytes(self._file.read_bytes(), self._file)
        except FileNotFoundError:
            # The same until it is stored: on a full disk the code that is printed is that of the server.
            self._new = self._new or new_record(random_below)
            return self._new
        except OSError as problem:
            raise MotorcadeError("cant-read", reason=disk_reason(problem)) from None

    def store(self, data: bytes) -> None:
        """Replace ``class.json``. Raises MotorcadeError where it can't be written; the old one is kept then."""
        with self._storing():
            replace_file(self._file, data)

    def store_record(self, record: ClassRecord) -> None:
        """Replace ``class.json``, as `store`."""
        self.store(to_bytes(record))

    def write_draft(self, owner: str, data: bytes) -> None:
        """Replace an owner's draft. Raises MotorcadeError."""
        folder = self._owner_folder(owner)
        with self._storing():
            folder.mkdir(parents=True, exist_ok=True)
            replace_file(folder / DRAFT, data)

    def read_draft(self, owner: str) -> tuple[bytes, str] | None:
        """An owner's draft, and when it was saved (ISO 8601, UTC); None where there is none. Raises MotorcadeError."""
        file = self._owner_folder(owner) / DRAFT
        try:
            data = file.read_bytes()
            saved_at = datetime.fromtimestamp(file.stat().st_mtime, UTC).isoformat(timespec="milliseconds")
        except FileNotFoundError:
            return None
        except OSError as problem:
            raise MotorcadeError("cant-read", reason=disk_reason(problem)) from None
        return data, saved_at

    def draft_at(self, owner: str) -> str | None:
        """When an owner's draft was saved (ISO 8601, UTC); None where there is none. Raises MotorcadeError."""
        found = self.read_draft(owner)
        return found[1] if found else None

    def copy(self, data: bytes, to: str, name: str, note: str = "") -> str:
        """Put a copy of a project into an owner's shelf, under a name that no project there has; return that name.

        Args:
            data: the text of the project.
            to: the owner.
            name: what it is called, with ``note`` in brackets behind it.
            note: whose it is.

        Raises:
            MotorcadeError: the name isn't allowed, or there is no room.
        """
        ending = f" ({note})" if note else ""
        with self._copying:
            taken = {entry.name for entry in self.list(to)}
            free, count = name[: LONGEST_NAME - len(ending)] + ending, 1
            while free in taken:
                count += 1
                more = f"{ending} {count}"
                free = name[: LONGEST_NAME - len(more)] + more
            self.write_version(to, free, data)
        return free

    def remove_owner(self, owner: str) -> None:
        """Delete an owner's shelf, with the missions that the owner wrote. Raises MotorcadeError where it can't."""
        for each in (owner, mission_library(owner)):
            try:
                shutil.rmtree(self._owner_folder(each))
            except FileNotFoundError:
                pass
            except OSError as problem:
                raise MotorcadeError("cant-delete", reason=disk_reason(problem)) from None
            self._used_bytes.pop(each, None)

    def virtual_car(self, owner: str) -> Path:
        """The file of an owner's simulated car."""
        folder = self._owner_folder(owner)
        folder.mkdir(parents=True, exist_ok=True)
        return folder / "virtual-car.image"
