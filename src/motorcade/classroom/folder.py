"""The folder of a class: ``class.json``, and in ``owners`` the library of each pupil; and all work as one ZIP file.

The folder is the whole class: a copy of it is a backup. A file is replaced whole, so a copy made at any time is good.
"""

import json
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from html import escape
from itertools import chain, count
from pathlib import Path, PureWindowsPath
from threading import Lock
from typing import IO, Annotated, NamedTuple
from urllib.parse import quote

from msgspec import Meta, Struct

from motorcade.classroom.messages import Draft, StoredDraft
from motorcade.classroom.names import RandomBelow
from motorcade.classroom.record import ClassRecord, Pupil, from_bytes, is_known, is_owner, new_record
from motorcade.config.files import SaveError, locked, raised_as, read_bytes, replace_file
from motorcade.errors import InputError, MotorcadeError, Phrase
from motorcade.missions.document import OWN
from motorcade.missions.model import Mission
from motorcade.server.studio.library import OWNERS, FolderStorage, children, name_of
from motorcade.server.studio.uploads import VIRTUAL_CAR, VirtualCarImage
from motorcade.service.documents import project_text
from motorcade.service.library import LONGEST_NAME, Limits, iso_time, mission_library
from motorcade.service.messages import decode
from motorcade.service.missions import list_missions

RECORD = "class.json"
DRAFT = "draft.json"
_LOCK = ".running"
# A pupil's program has some 10 kB; 100 versions of 100 projects fit.
LIMITS = Limits(projects=100, versions=100, size_bytes=128 << 20)
# Fifty missions of a megabyte each may be handed out.
_MOST_BYTES = 1 << 28
_ENDING = ".motorcade.json"
_OVERVIEW = "overview.html"
_REPORT_S = 600.0
# Behind an owner, in the name of the library of the owner's own missions.
_OWN_MISSIONS = mission_library("")
# So many files are checked in one report.
MOST_FILES = 1000
# Of the name of a file that a teacher chooses so many characters are kept: any file system takes them.
_LONGEST_FILE = 60
# What Windows allows in no name of a file.
_FORBIDDEN = re.compile(r'[<>:"/\\|?*\x00-\x1f]')
_STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem}"
    "table{border-collapse:collapse;width:100%}th,td{border:1px solid #999;padding:.4rem .6rem;text-align:left;"
    "vertical-align:top}"
)
_WORDS = ("title", "pupil", "projects", "stars", "draft", "unreadable")


class ClassFolder(FolderStorage):
    """The files of a class; an owner is a pupil's id, or the teacher.

    All methods may be called in several threads. What is stored for an owner is stored by one thread at a time, and
    only while the owner is in: nothing comes back behind a library that is deleted.

    Attributes:
        problem: why the disk takes nothing at present; None where it took what was stored last.
        is_in: whether something may be stored for an owner.
    """

    def __init__(self, folder: Path, limits: Limits = LIMITS) -> None:
        super().__init__(folder, limits)
        self._file = folder / RECORD
        self._locks: dict[str, Lock] = {}
        self.is_in: Callable[[str], bool] = lambda owner: True
        self.problem: MotorcadeError | None = None
        self._new: ClassRecord | None = None

    def _lock(self, owner: str) -> Lock:
        return self._locks.setdefault(owner, Lock())

    @contextmanager
    def _owned(self, owner: str) -> Iterator[None]:
        """Keep an owner in while the block stores something. Raises MotorcadeError where the owner is out already."""
        base = owner.removesuffix(_OWN_MISSIONS)
        with self._lock(base):
            if not self.is_in(base):
                raise MotorcadeError("no-such-pupil")
            yield

    @contextmanager
    def _storing(self) -> Iterator[None]:
        """Keep in mind whether the disk takes what the block stores; OSError becomes MotorcadeError."""
        try:
            with raised_as("cant-save", OSError, SaveError):
                yield
        except SaveError as problem:
            self.problem = MotorcadeError("class-not-stored", reason=problem.details["reason"])
            raise
        self.problem = None

    def write_version(
        self, owner: str, name: str, data: bytes, base: int | None = None, saved_at_s: float | None = None
    ) -> int:
        """Store a version, as `Storage` says, and keep in mind whether the disk takes it."""
        with self._owned(owner), self._storing():
            return super().write_version(owner, name, data, base, saved_at_s)

    def add_stars(self, owner: str, mission: str, stars: list[int]) -> list[int]:
        """Store stars, as `Storage` says, and keep in mind whether the disk takes them."""
        with self._owned(owner), self._storing():
            return super().add_stars(owner, mission, stars)

    def delete(self, owner: str, name: str) -> None:
        """Move a project to the folder ``deleted``. Raises MotorcadeError."""
        with self._owned(owner):
            super().delete(owner, name)

    @contextmanager
    def opened(self) -> Iterator[None]:
        """Keep the folder for this process while the block runs.

        Raises MotorcadeError where another server uses it, or it can't be written to.
        """
        with ExitStack() as stack:
            with raised_as("folder-not-writable", OSError, folder=self._folder):
                self._folder.mkdir(parents=True, exist_ok=True)
                with suppress(OSError):
                    # Also a folder that was there already; some disks have no permissions.
                    self._folder.chmod(0o700)
                refusal = MotorcadeError("class-is-running", folder=self._folder)
                stack.enter_context(locked(self._folder / _LOCK, refusal))
            yield

    def load(self, random_below: RandomBelow) -> ClassRecord:
        """Return the class in the folder, or a new one. Raises MotorcadeError where its file is damaged.

        So is one that is missing, or older than the libraries: newcomers would get those of others.
        """
        try:
            record = from_bytes(read_bytes(self._file, _MOST_BYTES), self._file)
        except FileNotFoundError:
            # The same until it is stored: on a full disk the code that is printed is that of the server.
            record = self._new = self._new or new_record(random_below)
        except OSError as problem:
            raise InputError("unreadable-file", file=self._file, reason=problem) from None
        if not all(is_known(record, owner) for owner in self.owners()):
            raise MotorcadeError("class-without-record", file=self._file, folder=self._folder / OWNERS)
        return record

    def owners(self) -> set[str]:
        """Return the pupils and pairs for whom something is stored."""
        folders = children(self._folder / OWNERS)
        names = (name_of(folder.name) or "" for folder in folders)
        return {owner for name in names if is_owner(owner := name.removesuffix(_OWN_MISSIONS))}

    def store(self, data: bytes) -> None:
        """Replace ``class.json`` by `to_bytes` of a record. Raises MotorcadeError where it can't; the old one stays."""
        with self._storing():
            replace_file(self._file, data)

    def write_draft(self, owner: str, data: bytes) -> None:
        """Replace an owner's draft. Raises MotorcadeError."""
        folder = self._owner_folder(owner)
        with self._owned(owner), self._storing():
            folder.mkdir(parents=True, exist_ok=True)
            replace_file(folder / DRAFT, data)

    def read_draft(self, owner: str) -> StoredDraft | None:
        """Return an owner's draft; None where there is none. Raises MotorcadeError where it is damaged."""
        try:
            draft = decode(read_bytes(self._owner_folder(owner) / DRAFT), Draft)
        except FileNotFoundError:
            return None
        except OSError as problem:
            raise MotorcadeError("cant-read", reason=problem) from None
        except MotorcadeError:
            raise MotorcadeError("damaged-version", name=DRAFT) from None
        return StoredDraft(draft.name, draft.project, self.draft_at(owner) or "", draft.place, draft.mission)

    def draft_at(self, owner: str) -> str | None:
        """Return when an owner's draft was saved; None where there is none."""
        try:
            return iso_time((self._owner_folder(owner) / DRAFT).stat().st_mtime)
        except OSError:
            return None

    def copy(self, data: bytes, to: str, name: str, note: str = "") -> str:
        """Put a copy of a project into an owner's library, under a name that no project there has; return that name.

        Args:
            data: the text of the project.
            to: the owner.
            name: what it is called, with ``note`` in brackets behind it.
            note: whose it is.

        Raises:
            MotorcadeError: the name isn't allowed, or there is no room.
        """
        ending = ""
        if note:
            ending = f" ({note})"
        with self._owned(to), self._storing():
            taken = {entry.name for entry in self.list(to)}
            endings = chain([ending], (f"{ending} {number}" for number in count(2)))
            wishes = (name[: LONGEST_NAME - len(ending)] + ending for ending in endings)
            free = next(wish for wish in wishes if wish not in taken)
            super().write_version(to, free, data)
        return free

    def remove_owner(self, owner: str) -> None:
        """Delete an owner's library, with the missions that the owner wrote. Raises MotorcadeError where it can't."""
        with self._lock(owner):
            for library in (mission_library(owner), owner):
                with raised_as("cant-delete", OSError), suppress(FileNotFoundError):
                    shutil.rmtree(self._owner_folder(library))
                self._used_bytes.pop(library, None)

    def virtual_car(self, owner: str) -> VirtualCarImage:
        """Return the store of an owner's simulated car."""
        return VirtualCarImage(self._owner_folder(owner) / VIRTUAL_CAR, partial(self._owned, owner))


class WorkFile(Struct):
    """A file to be checked: its name, after those of its folders and a slash each, and its bytes."""

    name: str
    data: bytes


class ReportOrder(Struct):
    """Which mission work is checked against, and which work.

    Attributes:
        mission: the id of a built-in mission; None for the one in ``text``.
        text: the text of a mission's file.
        files: checked in place of all pupils' work; None for that.
    """

    mission: str | None = None
    text: str = ""
    files: Annotated[list[WorkFile], Meta(max_length=MOST_FILES)] | None = None


class _Work(NamedTuple):
    """What a pupil has made.

    Attributes:
        name: the pupil's.
        files: of each project its name, when it was saved, and its file in the ZIP file; that is "" where it can't be
            read. The draft has no name.
        stars: by mission.
    """

    name: str
    files: list[tuple[str, str, str]]
    stars: dict[str, list[int]]


def work_file(folder: ClassFolder, pupils: Iterable[Pupil], title: str, language: str) -> IO[bytes]:
    """Return a ZIP file of the newest versions of all projects of these pupils, their drafts, and ``overview.html``.

    Nobody else can open it, and it is gone when it is closed, or the server ends. A file that can't be read is left
    out; the page says so. Raises MotorcadeError where the disk is full.
    """
    with raised_as("work-not-collected", OSError):
        file = tempfile.TemporaryFile(prefix="motorcade-")  # noqa: SIM115 - who reads it closes it
        try:
            with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
                works = [_add(archive.writestr, folder, pupil) for pupil in pupils]
                archive.writestr(_OVERVIEW, overview(works, title, language))
            file.seek(0)
        except BaseException:
            file.close()
            raise
        return file


def class_report(folder: ClassFolder, works: Sequence[Pupil | WorkFile], mission: Mission, language: str) -> bytes:
    """Return the page of `motorcade check` about these files and all work of these pupils; a process computes it.

    Raises MotorcadeError where it can't be made, or takes ten minutes.
    """
    with raised_as("work-not-collected", OSError), tempfile.TemporaryDirectory(prefix="motorcade-") as name:
        work = Path(name) / "work"
        page = Path(name) / "report.html"
        work.mkdir()

        def write(path: str, data: bytes) -> None:
            file = work / path
            file.parent.mkdir(exist_ok=True)
            file.write_bytes(data)

        for entry in works:
            if isinstance(entry, Pupil):
                _add(write, folder, entry)
        chosen = [entry for entry in works if isinstance(entry, WorkFile)]
        for path, file in zip(_chosen_paths(file.name for file in chosen), chosen, strict=True):
            write(path, file.data)
        asked = mission.id
        if mission.id == OWN:
            asked = str(Path(name) / f"{OWN}.json")
            Path(asked).write_text(json.dumps(mission.document), encoding="utf-8")
        command = [sys.executable, "-m", "motorcade", "check", asked, str(work), "-o", str(page), "--json"]
        with suppress(subprocess.TimeoutExpired):
            subprocess.run([*command, "--language", language], capture_output=True, timeout=_REPORT_S, check=False)
        if not page.exists():
            raise MotorcadeError("no-report")
        return read_bytes(page, _MOST_BYTES)


def _add(write: Callable[[str, bytes], None], folder: ClassFolder, pupil: Pupil) -> _Work:
    """Write all work of a pupil, each file by its path and content."""
    place = f"{pupil.id} {_file_name(pupil.name, set())}"
    files = []
    taken = {"draft"}
    for entry in folder.list(pupil.id):
        path = ""
        with suppress(MotorcadeError):
            data = folder.read(pupil.id, entry.name)
            path = f"{place}/{_file_name(entry.name, taken)}{_ENDING}"
            write(path, data)
        files.append((entry.name, entry.saved_at, path))
    with suppress(MotorcadeError):
        if (draft := folder.read_draft(pupil.id)) and draft.project:
            files.append(("", "", f"{place}/draft{_ENDING}"))
            write(files[-1][2], project_text(draft.project).encode())
    return _Work(pupil.name, files, folder.stars(pupil.id))


def _chosen_paths(names: Iterable[str]) -> Iterator[str]:
    """Yield where the files that a teacher has chosen are written, at most one folder deep; no two in one place."""
    top: set[str] = set()
    folders: dict[str, tuple[str, set[str]]] = {"": ("", top)}
    for name in names:
        folder, _, last = name.rpartition("/")
        if folder not in folders:
            folders[folder] = (f"{_file_name(folder[-_LONGEST_FILE:], top)}/", set())
        place, taken = folders[folder]
        stem, dot, ending = last[-_LONGEST_FILE:].partition(".")
        yield place + _file_name(stem, taken, _FORBIDDEN.sub("_", dot + ending).rstrip(". "))


def _file_name(name: str, taken: set[str], ending: str = "") -> str:
    """Return a name that every file system allows, near to ``name`` and not among those taken, to which it is added.

    A project that is opened from such a file gets its name.
    """
    allowed = _FORBIDDEN.sub("_", name).strip(". ") or "_"
    if PureWindowsPath(allowed).is_reserved():
        allowed = f"_{allowed}"
    wishes = chain([allowed + ending], (f"{allowed} {number}{ending}" for number in count(2)))
    found = next(wish for wish in wishes if wish.casefold() not in taken)
    taken.add(found.casefold())
    return found


def overview(works: Iterable[_Work], title: str, language: str) -> str:
    """Return the page that lists all pupils' projects and stars, as HTML in a language."""
    words = {key: escape(Phrase(f"overview-{key}").sentence(language)) for key in _WORDS}
    missions = {mission.id: mission.name.get(language) or mission.name["en"] for mission in list_missions({})}
    rows = []
    for work in works:
        items = "".join(_item(*file, words) for file in work.files)
        stars = ""
        for mission, earned in work.stars.items():
            if earned:
                stars += f"<li>{escape(missions.get(mission, mission))}: {'★' * len(earned)}</li>"
        rows.append(f"<tr><td>{escape(work.name)}</td><td><ul>{items}</ul></td><td><ul>{stars}</ul></td></tr>")
    heads = "".join(f"<th scope=col>{words[key]}</th>" for key in ("pupil", "projects", "stars"))
    name = escape(title) or words["title"]
    return (
        f'<!doctype html><html lang="{escape(language)}"><meta charset=utf-8>'
        f"<meta name=viewport content=width=device-width><title>{name}</title><style>{_STYLE}</style><h1>{name}</h1>"
        f"<table><thead><tr>{heads}</tr></thead><tbody>{''.join(rows)}</tbody></table></html>\n"
    )


def _item(name: str, saved_at: str, path: str, words: dict[str, str]) -> str:
    text = escape(name) or words["draft"]
    if not path:
        return f"<li>{text} ({words['unreadable']})</li>"
    when = ""
    if saved_at:
        when = f" ({escape(saved_at[:16].replace('T', ' '))} UTC)"
    return f'<li><a href="{quote(path)}">{text}</a>{when}</li>'
