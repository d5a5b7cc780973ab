"""Append who drove, stopped and cleared a car to a file, as JSON lines."""

import json
import logging
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from functools import partial
from logging.handlers import QueueHandler, QueueListener, RotatingFileHandler
from pathlib import Path
from queue import Empty, Queue
from typing import Any, cast

from motorcade.errors import MotorcadeError

# The file and four older ones, of 1 MB each: the log takes 5 MB at most.
MOST_BYTES, OLD_FILES = 1_000_000, 4
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

    Raises:
        MotorcadeError: the file can't be opened for writing.
    """

    def __init__(
        self,
        file: Path,
        report: Callable[[MotorcadeError], None],
        clock: Callable[[], datetime] = lambda: datetime.now(UTC),
    ) -> None:
        self._clock = clock
        self._repeats = _Repeats()
        self._lock = threading.Lock()
        try:
            self._file = _File(file, report)
        except OSError as problem:
            raise MotorcadeError("log-not-writable", file=file, reason=problem.strerror) from None
        waiting: Queue[Any] = Queue(_MOST_WAITING)
        self._queue = _Queueing(waiting)
        self._listener = _Listening(waiting, self._queue, self._write_due, self._file)
        self._listener.start()

    def record(self, did: str, who: str, car: str = "") -> None:
        """Append a record: ``who`` did something with ``car``; an empty name is left out."""
        now = self._clock()
        record = ({"car": car} if car else {}) | {"did": did, "who": who[:_LONGEST_NAME]}
        with self._lock:
            self._put(self._repeats.take(record, now), now)

    def of_car(self, car: str = "") -> Record:
        """The function that records what is done with ``car``."""
        return partial(self.record, car=car)

    def close(self) -> None:
        """Write what waits, for at most a second."""
        now = self._clock()
        with self._lock:
            self._put(self._repeats.counts(now, everything=True), now)
        # A disk that hangs would let `stop` wait for ever.
        stopping = threading.Thread(target=self._listener.stop, name="end of the activity log", daemon=True)
        stopping.start()
        stopping.join(_LAST_RECORDS_S)
        self._file.is_stuck = stopping.is_alive()
        self._file.close()

    def _write_due(self) -> None:
        now = self._clock()
        with self._lock:
            self._put(self._repeats.counts(now), now)

    def _put(self, records: list[dict[str, Any]], now: datetime) -> None:
        for record in records:
            self._queue.emit(_log_record(now.isoformat(timespec="milliseconds"), record))


class _Repeats:
    """Let the first record of a kind through, and count those that equal it but for the client's port. Pure."""

    def __init__(self) -> None:
        self._since: dict[tuple[str, ...], datetime] = {}
        self._more: dict[tuple[str, ...], dict[str, Any]] = {}

    def take(self, record: dict[str, Any], now: datetime) -> list[dict[str, Any]]:
        """What is to be written now that ``record`` came."""
        due = self.counts(now)
        # A user of a page may have any name before the address.
        client = record["who"].rpartition(" · ")[2].rpartition(":")[0]
        kind = (record.get("car", ""), record["did"], client)
        if kind not in self._since:
            self._since[kind] = now
            return [*due, record]
        more = self._more.get(kind, {}).get("more", 0) + 1
        self._more[kind] = record | {"more": more, "in_s": TOGETHER_S}
        return due

    def counts(self, now: datetime, everything: bool = False) -> list[dict[str, Any]]:
        """The counts whose time is over, or ``everything``."""
        over = [kind for kind, since in self._since.items() if everything or now - since >= timedelta(0, TOGETHER_S)]
        for kind in over:
            del self._since[kind]
        return [self._more.pop(kind) for kind in over if kind in self._more]


class _Queueing(QueueHandler):
    """Put records into the queue, and count those for which it has no place."""

    lost = 0

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802  # the library's name
        self.lost += 1


class _Listening(QueueListener):
    """Write records in a thread, say how many were lost, and ask for counts that are due while no record comes."""

    def __init__(
        self, waiting: Queue[Any], queueing: _Queueing, write_due: Callable[[], None], file: logging.Handler
    ) -> None:
        super().__init__(waiting, file)
        self._waiting = waiting
        self._queueing = queueing
        self._write_due = write_due

    def dequeue(self, block: bool) -> logging.LogRecord:
        while True:
            try:
                return cast(logging.LogRecord, self._waiting.get(block, TOGETHER_S))
            except Empty:
                if not block:
                    raise
                self._write_due()

    def handle(self, record: logging.LogRecord) -> None:
        super().handle(record)
        if self._queueing.lost:
            lost, self._queueing.lost = self._queueing.lost, 0
            super().handle(_log_record(record.name, {"did": "lost", "records": lost}))

    def enqueue_sentinel(self) -> None:
        # The library's own raises where the queue is full.
        self._waiting.put(None)


def _log_record(at: str, record: dict[str, Any]) -> logging.LogRecord:
    return logging.makeLogRecord({"name": at, "msg": json.dumps({"at": at} | record, ensure_ascii=False)})


class _File(RotatingFileHandler):
    """Report the first of the records that can't be written; the library would print a traceback.

    Attributes:
        is_stuck: whether a write hangs, so that the end of the program must not wait for it.
    """

    is_stuck = False

    def __init__(self, file: Path, report: Callable[[MotorcadeError], None]) -> None:
        super().__init__(file, maxBytes=MOST_BYTES, backupCount=OLD_FILES, encoding="utf-8")
        self._file = file
        self._report = report
        self._fails = self._has_failed = False

    def emit(self, record: logging.LogRecord) -> None:
        self._fails = False
        super().emit(record)
        self._has_failed = self._fails

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802  # the library's name
        problem = sys.exc_info()[1]
        if not self._has_failed:
            reason = getattr(problem, "strerror", None) or str(problem)
            self._report(MotorcadeError("log-not-written", file=self._file, reason=reason))
        self._fails = True

    def acquire(self) -> None:
        if not self.is_stuck:
            super().acquire()

    def release(self) -> None:
        if not self.is_stuck:
            super().release()

    def flush(self) -> None:
        if not self.is_stuck:
            super().flush()

    def close(self) -> None:
        if self.is_stuck:
            return
        try:
            super().close()
        except OSError:
            # What a full disk doesn't take is lost.
            self.stream = None


@contextmanager
def logging_to(file: Path | None, report: Callable[[MotorcadeError], None]) -> Iterator[ActivityLog | None]:
    """Open a log while the block runs; None where there is no file. Raises MotorcadeError."""
    log = ActivityLog(file, report) if file else None
    try:
        yield log
    finally:
        if log:
            log.close()
