"""A flash memory whose power can be cut at any byte: the functions of the module os, and open.

A cut leaves the first bytes of a write. On littlefs a closed file is safe, and a
rename is atomic. On FAT a file is safe after a sync, and a rename removes the old
file first: a cut can fall in between.
"""


class PowerCut(BaseException):
    """The power was cut; no other part of the program may run."""


class Flash:
    """Files by name.

    Args:
        atomic_rename: True for littlefs, False for FAT.
        room: how many bytes all files together may have.
    """

    def __init__(self, atomic_rename=True, room=1 << 20):
        self.files = {}
        self.cut_after = None
        self._atomic_rename = atomic_rename
        self._unsafe = set()
        self._room = room

    def spend(self, steps=1):
        """Count ``steps`` bytes or changes of a directory; raise PowerCut where the power ends before the last one."""
        if self.cut_after is not None:
            if self.cut_after < steps:
                self.lose()
                raise PowerCut
            self.cut_after -= steps

    def open(self, path, mode):
        if mode in ("r", "rb"):
            if path not in self.files:
                raise OSError(2)
            return _Reading(self.files[path], mode)
        self.spend()
        self.files[path] = b""
        return _Writing(self, path)

    def rename(self, old, new):
        if old not in self.files:
            raise OSError(2)
        if not self._atomic_rename and new in self.files:
            self.spend()
            del self.files[new]
        self.spend()
        self.files[new] = self.files.pop(old)
        if old in self._unsafe:
            self._unsafe.remove(old)
            self._unsafe.add(new)

    def remove(self, path):
        if path not in self.files:
            raise OSError(2)
        self.spend()
        del self.files[path]

    def sync(self):
        self.spend()
        self._unsafe.clear()

    def append(self, path, data):
        """Write byte by byte: as many as there is room for and the power lasts for."""
        room = self._room - sum([len(content) for content in self.files.values()])
        fitting = data[:room]
        lasting = fitting if self.cut_after is None else fitting[: self.cut_after]
        self.files[path] += lasting
        if not self._atomic_rename:
            self._unsafe.add(path)
        self.spend(len(lasting))
        if len(lasting) < len(fitting):
            self.spend(1)
        if len(fitting) < len(data):
            raise OSError(28)

    def lose(self):
        """Lose what a power failure destroys."""
        for path in self._unsafe:
            self.files[path] = self.files[path][: len(self.files[path]) // 2]
        self._unsafe.clear()


class _Reading:
    def __init__(self, data, mode):
        self._data = data if mode == "rb" else data.decode()

    def read(self):
        return self._data

    def __enter__(self):
        return self

    def __exit__(self, *problem):
        pass


class _Writing:
    """Bytes reach the flash when they are flushed or the file is closed."""

    def __init__(self, flash, path):
        self._flash = flash
        self._path = path
        self._waiting = b""

    def write(self, data):
        self._waiting += data
        return len(data)

    def flush(self):
        data, self._waiting = self._waiting, b""
        self._flash.append(self._path, data)

    def __enter__(self):
        return self

    def __exit__(self, kind, problem, trace):
        # A program whose power was cut closes nothing.
        if kind is not PowerCut:
            self.flush()
