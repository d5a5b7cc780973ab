"""Append who drove, stopped and cleared a car to a file, as JSON lines."""

import json
import logging
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from functools import partial
from logging.handlers import RotatingFileHandler
from pathlib import Path
from queue import Full, Queue
from typing import Any

from motorcade.errors import MotorcadeError

# The file and four older ones, of 1 MB each: the log takes 5 MB at most.
MOST_BYTES, OLD_FILES = 1_000_000, 4
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

    Raises:
        MotorcadeError: the file can't be opened for writing.
    """

    def __init__(
        self,
        file: Path,
        report: Callable[[MotorcadeError], None],
        clock: Callable[[], datetime] = lambda: datetime.now(UTC),
    ) -> None:
        self._file = file
        self._report = report
        self._clock = clock
        self._waiting: Queue[dict[str, Any] | None] = Queue(_MOST_WAITING)
        self._lost = 0
        self._has_failed = False
        try:
            self._handler = _Handler(file, maxBytes=MOST_BYTES, backupCount=OLD_FILES, encoding="utf-8")
        except OSError as problem:
            raise MotorcadeError("log-not-writable", file=file, reason=problem.strerror) from None
        self._thread = threading.Thread(target=self._write_all, name="activity log", daemon=True)
        self._thread.start()

    def record(self, did: str, who: str, car: str = "") -> None:
        """Append a record: ``who`` did something with ``car``; an empty name is left out."""
        at = self._clock().isoformat(timespec="milliseconds")
        record = {"at": at} | ({"car": car} if car else {}) | {"did": did, "who": who[:_LONGEST_NAME]}
        try:
            self._waiting.put_nowait(record)
        except Full:
            self._lost += 1

    def of_car(self, car: str = "") -> Record:
        """The function that records what is done with ``car``."""
        return partial(self.record, car=car)

    def close(self) -> None:
        """Write what waits, for at most a second."""
        with suppress(Full):
            self._waiting.put(None, timeout=_LAST_RECORDS_S)
        self._thread.join(_LAST_RECORDS_S)

    def _write_all(self) -> None:
        while (record := self._waiting.get()) is not None:
            self._write(record)
            if self._lost:
                lost, self._lost = self._lost, 0
                self._write({"at": record["at"], "did": "lost", "records": lost})
        # What a full disk doesn't take is lost.
        with suppress(OSError):
            self._handler.close()

    def _write(self, record: dict[str, Any]) -> None:
        self._handler.problem = None
        self._handler.emit(logging.makeLogRecord({"msg": json.dumps(record, ensure_ascii=False)}))
        problem = self._handler.problem
        if problem and not self._has_failed:
            reason = getattr(problem, "strerror", None) or str(problem)
            self._report(MotorcadeError("log-not-written", file=self._file, reason=reason))
        self._has_failed = problem is not None


class _Handler(RotatingFileHandler):
    """Keep the error of a record that can't be written; the library would print a traceback."""

    problem: BaseException | None = None

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802  # the library's name
        self.problem = sys.exc_info()[1]


@contextmanager
def logging_to(file: Path | None, report: Callable[[MotorcadeError], None]) -> Iterator[ActivityLog | None]:
    """Open a log while the block runs; None where there is no file. Raises MotorcadeError."""
    log = ActivityLog(file, report) if file else None
    try:
        yield log
    finally:
        if log:
            log.close()
