"""A simulated disk: it is full, slow, fails, or forgets at a power failure what it wasn't told to keep.

A `DiskPath` is a path on it: production code gets one where it would get a `pathlib.Path`. What names a folder has
changed in order, as a journal of a file system keeps it; a power failure loses the end of the journal that no fsync has
written, and of each file what wasn't: all of it, or a part.
"""

import io
import stat
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from errno import EEXIST, EIO, EISDIR, ENOENT, ENOSPC, ENOTDIR, ENOTEMPTY
from os import strerror
from pathlib import PurePosixPath
from random import Random
from types import SimpleNamespace
from typing import Any

from tests.faults.world import World

_FIRST_HANDLE = 1 << 20


@dataclass(eq=False)
class Node:
    """A file or a folder, as programs see it and as the disk has it."""

    is_folder: bool
    data: bytes = b""
    kept: bytes | None = None
    entries: dict[str, "Node"] = field(default_factory=dict)
    kept_entries: dict[str, "Node"] = field(default_factory=dict)
    changed_s: float = 0.0
    # The number of the last entry of the journal about it.
    last: int = 0


_Change = tuple[Node, str, Node | None]


class Disk:
    """A disk and its faults.

    Args:
        random: draws how long an operation takes: ``least_s``, and up to ``slow_s`` more.

    Attributes:
        kill_at: at which operation the process is killed by `kill`, and whether by a power failure.
        fail_at: which operations fail, except those that `spared` names.
        failed: called with the name of an operation that fails.
        after: called after each one.
        is_full: whether nothing more can be written.
        lies: whether fsync does nothing, as some disks do.
        free_bytes: how many bytes of a write are taken when it is full: a part of a file is written.
    """

    def __init__(self, world: World, random: Random, least_s: float = 0.0) -> None:
        self.world = world
        self.root = Node(True)
        self.slow_s = 0.0
        self.kill_at: tuple[int, bool] | None = None
        self.kill: Callable[[bool], None] = lambda is_power: None
        self.fail_at: set[int] = set()
        self.spared: tuple[str, ...] = ()
        self.failed: Callable[[str], None] = lambda what: None
        self._random = random
        self._least_s = least_s
        self.after: Callable[[], None] = lambda: None
        self.is_full = False
        self.lies = False
        self.free_bytes = 0
        self.operations = 0
        self.path: Any = type("DiskPath", (DiskPath,), {"disk": self})
        self._journal: list[tuple[int, tuple[_Change, ...]]] = []
        self._number = 0
        self._handles: dict[int, Node] = {}

    # Operations; each takes its time first.

    def begin(self, what: str) -> None:
        """Let time pass before an operation, which may be the last one of its process. Raises OSError."""
        self.operations += 1
        world = self.world
        if world.current is None:
            return
        world.note("disk", what)
        world.sleep(self._least_s + self._random.random() * self.slow_s)
        if self.kill_at and self.operations >= self.kill_at[0]:
            is_power, self.kill_at = self.kill_at[1], None
            self.kill(is_power)
            world.wait()
        if self.operations in self.fail_at and what not in self.spared:
            world.count("disk error")
            self.failed(what)
            raise OSError(EIO, "Input/output error")

    def fill(self) -> None:
        """Let there be no room any more."""
        self.world.count("full disk")
        self.world.note("full")
        self.is_full = True

    def heal(self) -> None:
        """Let all faults end."""
        self.is_full, self.kill_at, self.slow_s = False, None, 0.0
        self.fail_at.clear()

    def find(self, path: "DiskPath") -> Node:
        """The node at a path. Raises OSError."""
        node = self.root
        for part in path.parts[1:]:
            if not node.is_folder:
                raise _error(ENOTDIR, path)
            if part not in node.entries:
                raise _error(ENOENT, path)
            node = node.entries[part]
        return node

    def change(self, *changes: _Change) -> None:
        """Change names in folders, all at once."""
        self._number += 1
        for folder, name, node in changes:
            if node is None:
                folder.entries.pop(name, None)
            else:
                folder.entries[name] = node
                node.last = self._number
            folder.last = self._number
        self._journal.append((self._number, changes))
        self.after()

    def write(self, node: Node, at: int, data: bytes, path: "DiskPath") -> None:
        """Write into a file. Raises OSError where the disk is full: then a part is written."""
        written = data[: self.free_bytes] if self.is_full else data
        node.data = node.data[:at] + written + node.data[at + len(written) :]
        node.changed_s = self.world.now_s
        self.after()
        if self.is_full:
            raise _error(ENOSPC, path)

    def create(self, path: "DiskPath", is_folder: bool) -> Node:
        if self.is_full:
            raise _error(ENOSPC, path)
        folder, node = self.find(path.parent), Node(is_folder, changed_s=self.world.now_s)
        if not folder.is_folder:
            raise _error(ENOTDIR, path)
        self.change((folder, path.name, node))
        return node

    # What the system's functions with handles do (tests.faults.system).

    def open(self, path: "DiskPath") -> int:
        return self.handle(self.find(path))

    def size(self, handle: int) -> int:
        """The bytes of a file that is open."""
        return len(self._handles[handle].data)

    def handle(self, node: Node) -> int:
        handle = _FIRST_HANDLE + len(self._handles)
        self._handles[handle] = node
        return handle

    def fsync(self, handle: int) -> None:
        """Write a file, or the names in a folder, to the disk."""
        node = self._handles[handle]
        self.begin("fsync of a folder" if node.is_folder else "fsync")
        if self.lies:
            return
        node.kept = node.data
        while self._journal and self._journal[0][0] <= node.last:
            _apply(self._journal.pop(0)[1])
        self.after()

    # What a power failure leaves.

    def lose_power(self) -> None:
        """Forget what the disk wasn't told to keep, some of it or all."""
        random = self.world.random
        self.world.count("power failure")
        for _ in range(random.randint(0, len(self._journal))):
            _apply(self._journal.pop(0)[1])
        self._journal.clear()
        self._restore(self.root)

    def _restore(self, node: Node) -> None:
        random = self.world.random
        if not node.is_folder and node.kept != node.data:
            cut = random.randint(0, len(node.data))
            node.data = random.choice((node.kept or b"", b"", node.data[:cut], bytes(len(node.data)), node.data))
            node.kept = node.data
        node.entries = dict(node.kept_entries)
        for child in node.entries.values():
            self._restore(child)

    def possible(self, path: "DiskPath") -> Iterator[bytes | None]:
        """What a power failure now may leave at a path: None for no file."""
        try:
            folder = self.find(path.parent)
        except OSError:
            return
        nodes = [folder.kept_entries.get(path.name)]
        for _, changes in self._journal:
            nodes += [node for of, name, node in changes if of is folder and name == path.name]
        for node in nodes:
            if node is None:
                yield None
            elif node.data == node.kept:
                yield node.data
            else:
                yield from (node.kept or b"", b"", node.data[: len(node.data) // 2])

    def settle(self) -> None:
        """Keep all that was written, as a disk does in time."""
        for _, changes in self._journal:
            _apply(changes)
        self._journal.clear()
        _keep(self.root)


def _apply(changes: tuple[_Change, ...]) -> None:
    for folder, name, node in changes:
        if node is None:
            folder.kept_entries.pop(name, None)
        else:
            folder.kept_entries[name] = node


def _keep(node: Node) -> None:
    node.kept = node.data
    for child in node.entries.values():
        _keep(child)


def _error(code: int, path: object) -> OSError:
    return OSError(code, strerror(code), str(path))


class DiskPath(PurePosixPath):
    """A path on a simulated disk, with the methods of `pathlib.Path` that Motorcade uses."""

    disk: Disk

    def exists(self) -> bool:
        try:
            self.disk.find(self)
        except OSError:
            return False
        return True

    def is_file(self) -> bool:
        return self.exists() and not self.disk.find(self).is_folder

    def is_dir(self) -> bool:
        return self.exists() and self.disk.find(self).is_folder

    def stat(self) -> Any:
        node = self.disk.find(self)
        mode = (stat.S_IFDIR | 0o700) if node.is_folder else (stat.S_IFREG | 0o600)
        return SimpleNamespace(
            st_mode=mode,
            st_size=len(node.data),
            st_mtime=node.changed_s,
            st_mtime_ns=int(node.changed_s * 1e9),
            st_ino=node.last,
        )

    def chmod(self, mode: int) -> None:
        self.disk.find(self)

    def iterdir(self) -> Iterator["DiskPath"]:
        self.disk.begin("iterdir")
        node = self.disk.find(self)
        if not node.is_folder:
            raise _error(ENOTDIR, self)
        return iter([self / name for name in node.entries])

    def rglob(self, pattern: str) -> Iterator["DiskPath"]:
        children = list(self.iterdir()) if self.is_dir() else []
        for child in children:
            if child.match(pattern):
                yield child
            yield from child.rglob(pattern)

    def mkdir(self, mode: int = 0o777, parents: bool = False, exist_ok: bool = False) -> None:
        if parents and not self.parent.exists():
            self.parent.mkdir(parents=True, exist_ok=True)
        self.disk.begin("mkdir")
        if not self.exists():
            self.disk.create(self, True)
        elif not (exist_ok and self.is_dir()):
            raise _error(EEXIST, self)

    def touch(self, mode: int = 0o666, exist_ok: bool = True) -> None:
        self.disk.begin("touch")
        if self.exists():
            if not exist_ok:
                raise _error(EEXIST, self)
            return
        self.disk.create(self, False)

    def unlink(self, missing_ok: bool = False) -> None:
        self.disk.begin("unlink")
        if not self.exists():
            if missing_ok:
                return
            raise _error(ENOENT, self)
        self.disk.change((self.disk.find(self.parent), self.name, None))

    def rmdir(self) -> None:
        self.disk.begin("rmdir")
        if self.disk.find(self).entries:
            raise _error(ENOTEMPTY, self)
        self.disk.change((self.disk.find(self.parent), self.name, None))

    def replace(self, to: "DiskPath | str") -> "DiskPath":
        self.disk.begin("replace")
        target: DiskPath = self.disk.path(to)
        node = self.disk.find(self)
        self.disk.change(
            (self.disk.find(self.parent), self.name, None), (self.disk.find(target.parent), target.name, node)
        )
        return target

    rename = replace

    def read_bytes(self) -> bytes:
        with self.open("rb") as file:
            return file.read()

    def read_text(self, encoding: str = "utf-8", errors: str = "strict") -> str:
        return self.read_bytes().decode(encoding, errors)

    def write_bytes(self, data: bytes) -> int:
        with self.open("wb") as file:
            return file.write(data)

    def open(self, mode: str = "rb") -> "_File":
        assert "b" in mode, "files are opened as bytes"
        self.disk.begin("open")
        if "x" in mode and self.exists():
            raise _error(EEXIST, self)
        if not self.exists() and "r" not in mode:
            self.disk.create(self, False)
        node = self.disk.find(self)
        if node.is_folder:
            raise _error(EISDIR, self)
        if "w" in mode:
            node.data = b""
        return _File(self, node, len(node.data) if "a" in mode else 0)


class _File(io.RawIOBase):
    def __init__(self, path: DiskPath, node: Node, at: int) -> None:
        self._path = path
        self._node = node
        self._at = at

    def read(self, size: int = -1) -> bytes:
        self._path.disk.begin("read")
        end = len(self._node.data) if size < 0 else self._at + size
        data = self._node.data[self._at : end]
        self._at += len(data)
        return data

    def writable(self) -> bool:
        return True

    def write(self, data: Any) -> int:
        self._path.disk.begin("write")
        self._path.disk.write(self._node, self._at, bytes(data), self._path)
        self._at += len(data)
        return len(data)

    def fileno(self) -> int:
        return self._path.disk.handle(self._node)
