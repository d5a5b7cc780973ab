"""Append who drove, stopped and cleared a car to a file, as JSON lines."""

import json
import os
import stat
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from datetime import UTC, datetime
from io import FileIO
from pathlib import Path
from queue import Empty, Full, Queue
from time import monotonic
from typing import Any

from motorcade.config.files import check_no_device
from motorcade.errors import MotorcadeError

# The file and four older ones, of 1 MB each: the log takes 5 MB at most.
MOST_BYTES = 1_000_000
OLD_FILES = 4
# What one client does again within this time is counted, so that nobody can push the others' records out of the log.
TOGETHER_S = 10
# So many records wait for a slow disk; those behind are counted and not written.
_MOST_WAITING = 1000
_LONGEST_NAME = 120
_LAST_RECORDS_S = 1.0

# Called with what was done ("drives", "ends", "stops", "clears", "resumes") and by whom; never waits, never raises.
Record = Callable[[str, str], None]


class ActivityLog:
    """A log that never delays who writes into it: a thread of its own waits for the disk.

    Args:
        file: is continued where it exists.
        report: called in that thread, once, when records can't be written any more.
        clock: gives the time of a record.
        monotonic_s: a clock in seconds that nobody sets, for times between records.

    Raises:
        MotorcadeError: the file can't be opened for writing.
    """

    def __init__(
        self,
        file: Path,
        report: Callable[[MotorcadeError], None],
        clock: Callable[[], datetime] = lambda: datetime.now(UTC),
        monotonic_s: Callable[[], float] = monotonic,
    ) -> None:
        self._path = file
        self._report = report
        self._clock = clock
        self._monotonic_s = monotonic_s
        self._repeats = _Repeats()
        self._lock = threading.Lock()
        self._waiting: Queue[dict[str, Any] | None] = Queue(_MOST_WAITING)
        self._lost = 0
        self._is_over = self._has_failed = False
        try:
            self._file: FileIO | None = self._opened()
        except OSError as problem:
            raise MotorcadeError("log-not-writable", file=file, reason=problem) from None
        self._thread = threading.Thread(target=self._write_all, name="activity log", daemon=True)
        self._thread.start()

    def record(self, did: str, who: str, car: str = "") -> None:
        """Append a record: ``who`` did something with ``car``; an empty name is left out."""
        record = ({"car": car} if car else {}) | {"did": did, "who": who[:_LONGEST_NAME]}
        with self._lock:
            self._put(self._repeats.take(record, self._monotonic_s()))

    def close(self) -> None:
        """Write what waits, for at most a second."""
        with self._lock:
            self._put(self._repeats.counts(self._monotonic_s(), everything=True))
        self._is_over = True
        with suppress(Full):
            self._waiting.put_nowait(None)
        # A disk that hangs would let this wait for ever.
        self._thread.join(_LAST_RECORDS_S)

    def _put(self, records: list[dict[str, Any]]) -> None:
        """Let records wait for the thread; those for which there is no place are counted."""
        now = self._clock()
        for record in records:
            try:
                self._waiting.put_nowait({"at": now.isoformat(timespec="milliseconds")} | record)
            except Full:
                self._lost += 1

    def _write_all(self) -> None:
        """Write what waits until the log is closed, and counts that are due while no record comes."""
        while not (self._is_over and self._waiting.empty()):
            try:
                record = self._waiting.get(timeout=TOGETHER_S)
            except Empty:
                with self._lock:
                    self._put(self._repeats.counts(self._monotonic_s()))
                continue
            if record is None:
                break
            self._write(record)
            with self._lock:
                lost = self._lost
                self._lost = 0
            if lost:
                self._write({"at": record["at"], "did": "lost", "records": lost})
        if self._file:
            self._file.close()

    def _write(self, record: dict[str, Any]) -> None:
        """Write a record, in a new file where this one is full; report the first of those that can't be written."""
        line = json.dumps(record, ensure_ascii=False).encode() + b"\n"
        try:
            self._file = file = self._file or self._opened()
            status = os.fstat(file.fileno())
            if stat.S_ISREG(status.st_mode) and status.st_size + len(line) > MOST_BYTES:
                file = self._next_file(file)
            while line:
                line = line[file.write(line) :]
            self._has_failed = False
        except OSError as problem:
            if not self._has_failed:
                self._report(MotorcadeError("log-not-written", file=self._path, reason=problem))
            self._has_failed = True

    def _next_file(self, file: FileIO) -> FileIO:
        """Rename the files, the oldest of which makes room, and begin a new one. Raises OSError."""
        self._file = None
        file.close()
        for number in range(OLD_FILES, 0, -1):
            if number > 1:
                older = Path(f"{self._path}.{number - 1}")
            else:
                older = Path(self._path)
            with suppress(FileNotFoundError):
                older.replace(f"{self._path}.{number}")
        self._file = self._opened()
        return self._file

    def _opened(self) -> FileIO:
        """Raises OSError, also where it is a pipe: to open it would wait for a reader."""
        check_no_device(self._path)
        return FileIO(self._path, "ab")


class _Repeats:
    """Let the first record of a kind through, and count those that equal it but for the client's port. Pure."""

    def __init__(self) -> None:
        # When the first record of a kind came, and what stands for those behind it, or nothing.
        self._kinds: dict[tuple[str, ...], tuple[float, dict[str, Any]]] = {}

    def take(self, record: dict[str, Any], now_s: float) -> list[dict[str, Any]]:
        """What is to be written now that ``record`` came."""
        due = self.counts(now_s)
        # A user of a page may have any name before the address.
        client = record["who"].rpartition(" · ")[2].rpartition(":")[0]
        kind = (record.get("car", ""), record["did"], client)
        if kind not in self._kinds:
            self._kinds[kind] = now_s, {}
            return [*due, record]
        since_s, counted = self._kinds[kind]
        self._kinds[kind] = since_s, record | {"more": counted.get("more", 0) + 1, "in_s": TOGETHER_S}
        return due

    def counts(self, now_s: float, everything: bool = False) -> list[dict[str, Any]]:
        """The counts whose time is over, or ``everything``."""
        over = [kind for kind, (since_s, _) in self._kinds.items() if everything or now_s - since_s >= TOGETHER_S]
        return [counted for kind in over if (counted := self._kinds.pop(kind)[1])]


@contextmanager
def logging_to(file: Path | None, report: Callable[[MotorcadeError], None]) -> Iterator[Callable[..., None] | None]:
    """Open a log while the block runs; gives `ActivityLog.record`, or None where there is no file.

    Raises MotorcadeError.
    """
    if file is None:
        yield None
    else:
        with closing(ActivityLog(file, report)) as log:
            yield log.record
