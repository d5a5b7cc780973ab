"""The drivers' keys that a car no longer takes, read again whenever the list changes."""

from collections.abc import Callable
from pathlib import Path

from motorcade.errors import MotorcadeError

_Stamp = tuple[int, int]


class RevokedKeys:
    """The revoked keys in a list of `motorcade drive keys --revoke`. Raises MotorcadeError where it can't be read.

    Args:
        file: the list; it may come later.
        keys: the car's keys file, whose authority has to have signed the list.
        report: called with the reason where a changed list can't be read; the old one stays valid then.
    """

    def __init__(self, file: Path, keys: Path, report: Callable[[MotorcadeError], None] = lambda problem: None) -> None:
        self._file = file
        self._keys = keys
        self._report = report
        self._stamp = _stamp_of(file)
        self._numbers = self._read() if self._stamp else frozenset()

    def __contains__(self, number: int | None) -> bool:
        """Whether the keys whose certificate has this serial number are revoked."""
        return number in self._numbers

    def reload(self) -> bool:
        """Read the list again where its file has changed. Returns whether it has."""
        stamp = _stamp_of(self._file)
        # A list that was removed stays valid until the car is started again.
        if stamp in (None, self._stamp):
            return False
        self._stamp = stamp
        try:
            self._numbers = self._read()
        except MotorcadeError as problem:
            self._report(problem)
            return False
        return True

    def _read(self) -> frozenset[int]:
        # A car without such a list needs no cryptography but Python's own.
        from motorcade.drive.tls.revocation import authority_of, read_revoked

        return read_revoked(self._file, authority_of(self._keys))


def _stamp_of(file: Path) -> _Stamp | None:
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size
