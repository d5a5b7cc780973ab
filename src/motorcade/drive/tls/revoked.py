"""The drivers' keys that a car no longer takes: a text file of serial numbers, read again whenever it changes."""

import re
from collections.abc import Mapping
from pathlib import Path

from motorcade.config.files import disk_reason, replace_file
from motorcade.errors import MotorcadeError, Phrase

REVOKED = "revoked.txt"
_HEADING = "# Serial numbers of drivers' keys that are no longer valid, one a line.\n"
# A certificate's serial number has at most 20 bytes (RFC 5280).
_NUMBER = re.compile(r"[0-9a-fA-F]{1,40}")
_MOST_BYTES = 1 << 20

_Stamp = tuple[int, int, int]


def number_of(text: str) -> int | None:
    """The serial number that ``text`` is in hexadecimal digits; None where it is none."""
    return int(text, 16) if _NUMBER.fullmatch(text) else None


def read_revoked(file: Path) -> frozenset[int]:
    """The serial numbers in a list: hexadecimal, one a line; what stands behind a # is a remark.

    Raises MotorcadeError where the file can't be read or has another line.
    """
    try:
        with file.open("rb") as opened:
            lines = opened.read(_MOST_BYTES).decode().splitlines()
    except (OSError, UnicodeDecodeError) as problem:
        reason = disk_reason(problem) if isinstance(problem, OSError) else Phrase("is-no-text")
        raise MotorcadeError("revoked-keys-unreadable", file=file, reason=reason) from None
    numbers = set()
    for at, line in enumerate(lines, 1):
        if text := line.partition("#")[0].strip():
            if (number := number_of(text)) is None:
                raise MotorcadeError("revoked-keys-unreadable", file=file, reason=Phrase("revoked-line", line=at))
            numbers.add(number)
    return frozenset(numbers)


def write_revoked(file: Path, keys: Mapping[int, str]) -> None:
    """Write a list of these serial numbers, each with its remark. Raises OSError."""
    lines = [f"{number:x}  # {remark}\n" for number, remark in keys.items()]
    replace_file(file, "".join([_HEADING, *lines]).encode())


class RevokedKeys:
    """The revoked keys in a list that `motorcade drive keys --revoke` writes, or its owner.

    Args:
        file: the list.
        is_expected: whether it counts as a problem that there is no such file when the car starts.

    Attributes:
        problem: why the list can't be read now; what it had before stays valid then.
    """

    def __init__(self, file: Path, is_expected: bool = True) -> None:
        self.problem: MotorcadeError | None = None
        self._file = file
        self._numbers: frozenset[int] = frozenset()
        self._stamp: _Stamp | None = None
        if is_expected or file.exists():
            self._read()

    def __contains__(self, number: int | None) -> bool:
        """Whether the keys whose certificate has this serial number are revoked."""
        return number in self._numbers

    def reload(self) -> bool:
        """Read the list again where its file has changed. Returns whether the list or `problem` is another one now."""
        return _stamp_of(self._file) != self._stamp and self._read()

    def _read(self) -> bool:
        before = self._numbers, str(self.problem)
        # The file may change while it is read: then it is read once more.
        self._stamp = _stamp_of(self._file)
        try:
            self._numbers, self.problem = read_revoked(self._file), None
        except MotorcadeError as problem:
            self.problem = problem
        return (self._numbers, str(self.problem)) != before


def _stamp_of(file: Path) -> _Stamp | None:
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino
